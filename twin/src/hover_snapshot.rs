//! Hovering flight, kept as a snapshot of the board's models and a record of the motor commands so far. Replaying the
//! record brings the plant to the same state. Many faults can thus begin in the same instant of one flight.

use crate::check::check;
use crate::fly::{TICK_NS, TwinFlight, images};
use crate::machine::{Machine, quiet_usb};
use crate::pilot::GroundPilot;
use crate::pins::MotorPins;
use crate::wire::UartWire;
use crate::world::at_the_place;
use afbc_scenario::{Scenario, load};
use rigless::emulator::{Driver, Finished, Host, Settled, Start, Stop, run};
use rigless::image::{Image, digest};
use rigless::session::Session;
use rigless::snapshot::{Error as SnapshotError, Reader, Snapshot, Store, Writer, take};
use rigless::time::VirtualNanos;
use std::error::Error;
use std::marker::PhantomData;
use std::path::Path;

/// Time in hover before the snapshot is taken [ms].
const HOVERED_MS: u64 = 5_000;

/// Record of each millisecond: the throttles, and the bytes that the board sent over the link.
#[derive(Clone, Debug, Default)]
struct FlightRecord(Vec<(Vec<u16>, Vec<u8>)>);

impl Store for FlightRecord {
    fn store(&self, to: &mut Writer) -> Result<(), SnapshotError> {
        to.put(&self.0)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), SnapshotError> {
        self.0 = from.take()?;
        Ok(())
    }
}

/// Both ends of the link. The bytes of a millisecond are delivered at its end.
#[derive(Clone, Debug, Default)]
pub struct LinkEnds {
    board: UartWire,
    pilot: UartWire,
}

impl LinkEnds {
    /// Delivers the bytes in both directions, and returns those from the board.
    pub fn pass(&self) -> Vec<u8> {
        let from_board = self.board.take();
        self.board.send(&self.pilot.exchange(&from_board));
        from_board
    }

    /// Sends bytes to the board.
    pub fn flood(&self, bytes: &[u8]) {
        self.board.send(bytes);
    }
}

/// Vehicle in hover.
pub struct HoverSnapshot<M> {
    images: Vec<Image>,
    scenario: Scenario,
    snapshot: Snapshot,
    past: FlightRecord,
    machine: PhantomData<M>,
}

/// Driver that flies until the vehicle hovers.
struct ClimbDriver {
    flight: TwinFlight,
    link: LinkEnds,
    past: FlightRecord,
    firmware: [u8; 32],
    taken: Option<Result<Vec<u8>, SnapshotError>>,
}

impl<M: Machine> Driver<M> for ClimbDriver {
    fn on_settled(&mut self, session: &mut Session<M>, host: &mut dyn Host, settled: Settled) {
        self.flight.on_settled(session, host, settled);
    }

    fn on_stop(&mut self, session: &mut Session<M>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        self.flight.hear_pulses(session);
        quiet_usb(session, stop.at);
        let pilot = &mut self.flight.pilot;
        self.past.0.push((pilot.throttles().to_vec(), self.link.pass()));
        let (_, signals) = pilot.advance(stop.at.0 / TICK_NS)?;
        session.board_mut().sense(&signals);
        let is_there = pilot.hovers_ms().is_some_and(|hovers_ms| hovers_ms >= HOVERED_MS);
        // A frame that is being read is not part of the snapshot, so none is taken during a frame.
        if is_there && self.flight.pins.look_ns().is_none() {
            // The twin holds the timers' counters. It releases them first, so that the snapshot has them as the image.
            self.flight.pins.release(session.mcu(), stop.at);
            self.taken = Some(take(session, host, stop, &self.firmware, &self.past).map(|taken| taken.file));
            return None;
        }
        Some(VirtualNanos(stop.at.0 + TICK_NS))
    }
}

fn flight<M: Machine>(scenario: &Scenario, link: &LinkEnds, prints: bool) -> Result<TwinFlight, Box<dyn Error>> {
    let pilot = GroundPilot::new(scenario, link.pilot.clone())?;
    Ok(TwinFlight {
        pilot: if prints { pilot } else { pilot.quiet() },
        hearer: None,
        receiver: None,
        pins: MotorPins::new(M::SIGNAL, scenario.rotors.len()),
        cuts: None,
        fetched: None,
    })
}

fn board<M: Machine>(link: &LinkEnds) -> Result<Box<M>, Box<dyn Error>> {
    let mut board = M::built()?;
    board.sense(&at_the_place());
    check(board.attach_link(link.board.clone()), "the link is wired")?;
    Ok(board)
}

impl<M: Machine> HoverSnapshot<M> {
    /// Flies a scenario until the vehicle hovers, and keeps the snapshot in the file `kept`. If the file exists, reads
    /// the snapshot from it; fails if it belongs to another image.
    pub fn of(image: &Path, scenario: &Path, kept: &Path) -> Result<Self, Box<dyn Error>> {
        let images = images::<M>(image, &[])?;
        let scenario = load(scenario)?;
        if let Ok(snapshot) = Snapshot::read(kept) {
            let mut hover =
                HoverSnapshot { images, scenario, snapshot, past: FlightRecord::default(), machine: PhantomData };
            let mut session = Session::new(board::<M>(&LinkEnds::default())?, 0, VirtualNanos(0))?;
            let firmware = digest(&hover.images, None);
            if hover.snapshot.restore(&mut session, &firmware, &mut hover.past).is_ok() {
                return Ok(hover);
            }
            return Err(format!("{}: the file comes from another image or program; remove it", kept.display()).into());
        }
        let link = LinkEnds::default();
        let climb = ClimbDriver {
            flight: flight::<M>(&scenario, &link, true)?,
            link: link.clone(),
            past: FlightRecord::default(),
            firmware: digest(&images, None),
            taken: None,
        };
        let session = Session::new(board::<M>(&link)?, 0, VirtualNanos(TICK_NS))?;
        let ClimbDriver { flight, taken, past, .. } = run(session, &Start::new(&images), climb)?.driver;
        let Some(taken) = taken else {
            flight.pilot.verdict()?;
            return Err("the vehicle does not hover".into());
        };
        std::fs::write(kept, taken?)?;
        Ok(HoverSnapshot { images, scenario, snapshot: Snapshot::read(kept)?, past, machine: PhantomData })
    }

    /// Resumes the flight with the driver that `driver` makes of the flight, its link and the time \[ns\].
    pub fn resume<R: Driver<M> + 'static>(
        &self,
        driver: impl FnOnce(TwinFlight, LinkEnds, u64) -> R,
    ) -> Result<Finished<M, R>, Box<dyn Error>> {
        let link = LinkEnds::default();
        let mut flight = flight::<M>(&self.scenario, &link, false)?;
        for (ms, (throttles, bytes)) in (1..).zip(&self.past.0) {
            flight.pilot.command(throttles.iter().copied().map(Some));
            link.pilot.exchange(bytes);
            check(flight.pilot.advance(ms).is_some(), "the plant's history is restored")?;
        }
        let mut session = Session::new(board::<M>(&link)?, 0, VirtualNanos(0))?;
        let firmware = digest(&self.images, None);
        let resume = self.snapshot.restore(&mut session, &firmware, &mut FlightRecord::default())?;
        let now_ns = self.snapshot.stop().at.0;
        session.run_until(VirtualNanos(now_ns + TICK_NS));
        let mut start = Start::new(&self.images);
        start.resume = Some(&resume);
        Ok(run(session, &start, driver(flight, link, now_ns))?)
    }
}
