//! Flights controlled by a pilot's transmitter, and a hover from which many of them resume.

use crate::check::check;
use crate::esc_line::Escs;
use crate::fly::{TICK_NS, images};
use crate::machine::{Machine, Signal, quiet_usb};
use crate::pilot::GroundPilot;
use crate::pins::MotorPins;
use crate::transmitter::RcTransmitter;
use crate::wire::UartWire;
use crate::world::at_the_place;
use afbc_flight_core::motor::THROTTLE_MIN;
use afbc_scenario::load;
use rigless::emulator::{Driver, Finished, Host, Settled, Start, Stop, run};
use rigless::image::{Image, digest};
use rigless::session::Session;
use rigless::snapshot::{Error as SnapshotError, Reader, Snapshot, Store, Writer, take};
use rigless::time::VirtualNanos;
use std::error::Error;
use std::marker::PhantomData;
use std::path::Path;

/// Usual time between two frames of an ExpressLRS receiver \[ns\].
pub const FRAME_NS: u64 = 4_000_000;
/// Time between two samples of PWM pins, for pilots that set `LOOKS` \[ns\].
const PULSES_NS: u64 = 50_000;

/// Decision of a pilot whether the flight goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PilotDecision {
    GoesOn,
    Ends,
}

/// Pilot at the transmitter.
pub trait StickPilot: Send {
    /// True if PWM pins are to be sampled more than once per millisecond.
    const LOOKS: bool = false;

    /// Moves sticks and switches, once per millisecond.
    fn move_sticks(&mut self, vehicle: &mut PilotedVehicle, now_ms: u64) -> Result<PilotDecision, String>;

    /// Observes the motor commands at a time \[ns\].
    fn see_motors(&mut self, _: &PilotedVehicle, _: u64) {}
}

/// Vehicle in its world, with its motor pins and the pilot's transmitter.
pub struct PilotedVehicle {
    pub pilot: GroundPilot,
    pub pins: MotorPins,
    pub transmitter: RcTransmitter,
    pub escs: Escs,
    signal: Signal,
    /// Time of the plant's next step \[ns\].
    tick_ns: u64,
}

/// Flight controlled by a pilot.
pub struct PilotedFlight<H> {
    pub vehicle: PilotedVehicle,
    pub stick_pilot: H,
    /// Digest of the images, if a snapshot is to be taken at the end of the flight.
    firmware: Option<[u8; 32]>,
    taken: Option<Result<Vec<u8>, SnapshotError>>,
    error: Option<String>,
}

/// Host state of a snapshot: none, since these snapshots keep the board alone.
struct NoHostState;

impl Store for NoHostState {
    fn store(&self, _: &mut Writer) -> Result<(), SnapshotError> {
        Ok(())
    }

    fn load(&mut self, _: &mut Reader) -> Result<(), SnapshotError> {
        Ok(())
    }
}

/// Wires connected to a board.
#[derive(Default)]
struct BoardWires {
    link: UartWire,
    receiver: UartWire,
    escs: UartWire,
}

impl BoardWires {
    /// Returns the board connected to these wires, and the `RC_PORT` of the radio receiver.
    fn board<M: Machine>(&self) -> Result<(Box<M>, f32), Box<dyn Error>> {
        let mut board = M::built()?;
        board.sense(&at_the_place());
        check(board.attach_link(self.link.clone()), "the link is wired")?;
        let port = board.attach_radio(self.receiver.clone());
        board.attach_escs(self.escs.clone());
        Ok((board, port.ok_or("the model of this board has no UART for a radio receiver")?))
    }
}

/// Returns the finished flight, or the error that ended it.
fn flown<M: Machine, H>(finished: Finished<M, PilotedFlight<H>>) -> Result<PilotedFlight<H>, Box<dyn Error>> {
    let flight = finished.driver;
    if let Some(error) = flight.error {
        return Err(error.into());
    }
    let wrong = &flight.vehicle.pins.wrong;
    check(wrong.is_empty(), &format!("{:?}: {wrong:?}", M::SIGNAL))?;
    let session = finished.session;
    let unmapped = session.unmapped().into_iter().map(|access| access.address);
    let unmapped: Vec<_> = unmapped.filter(|address| !M::UNMAPPED.contains(address)).collect();
    check(unmapped.is_empty() && session.refused().is_empty(), &format!("unmapped accesses {unmapped:x?}"))?;
    check(session.resets().is_empty(), "no reset")?;
    Ok(flight)
}

/// Hover from which flights resume.
pub struct PilotedHover<M> {
    images: Vec<Image>,
    snapshot: Snapshot,
    vehicle: PilotedVehicle,
    machine: PhantomData<M>,
}

impl<M: Machine> PilotedHover<M> {
    /// Flies a scenario with these parameters, controlled by a pilot whose flight ends in a hover.
    pub fn of<H: StickPilot + 'static>(
        image: &Path,
        scenario: &Path,
        parameters: &[(&str, f32)],
        stick_pilot: H,
    ) -> Result<Self, Box<dyn Error>> {
        let (scenario, wires) = (load(scenario)?, BoardWires::default());
        let (board, port) = wires.board::<M>()?;
        let parameters: Vec<_> = [("RC_PORT", port)].iter().chain(parameters).copied().collect();
        let images = images::<M>(image, &parameters)?;
        let vehicle = PilotedVehicle {
            pilot: GroundPilot::new(&scenario, wires.link)?,
            pins: MotorPins::new(M::SIGNAL, scenario.rotors.len()).answering(&parameters),
            transmitter: RcTransmitter::new(wires.receiver, FRAME_NS, TICK_NS),
            escs: Escs::new(wires.escs),
            signal: M::SIGNAL,
            tick_ns: TICK_NS,
        };
        let mut flight = PilotedFlight::of(vehicle, stick_pilot);
        flight.firmware = Some(digest(&images, None));
        let session = Session::new(board, 0, VirtualNanos(TICK_NS))?;
        let finished = run(session, &Start::new(&images), flight)?;
        let PilotedFlight { vehicle, taken, .. } = flown(finished)?;
        // Snapshots can only be read from files.
        let path = std::env::temp_dir().join(format!("twin-hover-{}", std::process::id()));
        std::fs::write(&path, taken.ok_or("the vehicle does not hover")??)?;
        let snapshot = Snapshot::read(&path);
        std::fs::remove_file(&path)?;
        Ok(PilotedHover { images, snapshot: snapshot?, vehicle, machine: PhantomData })
    }

    /// Returns the vehicle in hover.
    pub fn vehicle(&self) -> &PilotedVehicle {
        &self.vehicle
    }

    /// Resumes the hover, controlled by `stick_pilot`. The receiver's frames are `period_ns` apart; the first comes
    /// `late_ns` after a millisecond.
    pub fn resume<H: StickPilot + 'static>(
        &self,
        period_ns: u64,
        late_ns: u64,
        stick_pilot: H,
    ) -> Result<PilotedFlight<H>, Box<dyn Error>> {
        let wires = BoardWires::default();
        let (board, _) = wires.board::<M>()?;
        let mut session = Session::new(board, 0, VirtualNanos(0))?;
        let resume = self.snapshot.restore(&mut session, &digest(&self.images, None), &mut NoHostState)?;
        let next_ns = self.snapshot.stop().at.0 + TICK_NS;
        session.run_until(VirtualNanos(next_ns));
        let vehicle = PilotedVehicle {
            pilot: self.vehicle.pilot.again(wires.link),
            pins: self.vehicle.pins.clone(),
            transmitter: self.vehicle.transmitter.again(wires.receiver, period_ns, next_ns + late_ns),
            escs: Escs::new(wires.escs),
            signal: M::SIGNAL,
            tick_ns: next_ns,
        };
        let mut start = Start::new(&self.images);
        start.resume = Some(&resume);
        flown(run(session, &start, PilotedFlight::of(vehicle, stick_pilot))?)
    }
}

impl PilotedVehicle {
    /// True if the newest commands on the motor pins stop all motors.
    pub fn is_stopped(&self) -> bool {
        let stopped = match self.signal {
            Signal::Dshot600(_) => 0,
            Signal::Pwm400 => THROTTLE_MIN,
        };
        self.pilot.throttles().iter().all(|throttle| *throttle == stopped)
    }
}

impl<H: StickPilot> PilotedFlight<H> {
    fn of(vehicle: PilotedVehicle, stick_pilot: H) -> Self {
        PilotedFlight { vehicle, stick_pilot, firmware: None, taken: None, error: None }
    }

    /// Passes on the newest motor commands and telemetry requests.
    fn command(&mut self, at: VirtualNanos) {
        self.vehicle.pilot.command(self.vehicle.pins.take());
        self.vehicle.escs.ask(self.vehicle.pins.take_asked());
        self.stick_pilot.see_motors(&self.vehicle, at.0);
    }
}

impl<M: Machine, H: StickPilot> Driver<M> for PilotedFlight<H> {
    fn on_settled(&mut self, session: &mut Session<M>, _: &mut dyn Host, settled: Settled) {
        let pins = &mut self.vehicle.pins;
        match settled {
            Settled::Access { access, value } if pins.watch(&access, value, session.mcu()) => {}
            Settled::Stop(stop) if pins.look_ns().is_some_and(|look_ns| stop.at.0 >= look_ns) => {
                let motors = session.board_mut().motors();
                if pins.look(&motors, session.mcu(), stop.at) {
                    self.command(stop.at);
                }
            }
            _ => return,
        }
        session.pause_at(self.vehicle.pins.look_ns().map(VirtualNanos));
    }

    fn on_stop(&mut self, session: &mut Session<M>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        let mut next_ns = u64::MAX;
        if M::SIGNAL == Signal::Pwm400 {
            self.vehicle.pins.take_pulses(&session.board_mut().motors());
            self.command(stop.at);
            if H::LOOKS {
                next_ns = stop.at.0 + PULSES_NS;
            }
        }
        if stop.at.0 >= self.vehicle.tick_ns {
            self.vehicle.tick_ns += TICK_NS;
            quiet_usb(session, stop.at);
            let (_, signals) = self.vehicle.pilot.watch(stop.at.0 / TICK_NS);
            session.board_mut().sense(&signals);
            self.vehicle.escs.answer(self.vehicle.pilot.rotor_speeds_rad_s());
            self.vehicle.pins.set_rotor_speeds(self.vehicle.pilot.rotor_speeds_rad_s());
            match self.stick_pilot.move_sticks(&mut self.vehicle, stop.at.0 / TICK_NS) {
                Ok(PilotDecision::GoesOn) => {}
                // No snapshot while a frame is being read from the pins.
                Ok(PilotDecision::Ends) if self.vehicle.pins.look_ns().is_some() => {}
                Ok(PilotDecision::Ends) => {
                    if let Some(firmware) = &self.firmware {
                        self.vehicle.pins.release(session.mcu(), stop.at);
                        self.taken = Some(take(session, host, stop, firmware, &NoHostState).map(|taken| taken.file));
                    }
                    return None;
                }
                Err(error) => {
                    self.error = Some(error);
                    return None;
                }
            }
        }
        self.vehicle.transmitter.step(stop.at.0);
        Some(VirtualNanos(next_ns.min(self.vehicle.tick_ns).min(self.vehicle.transmitter.next_ns())))
    }
}
