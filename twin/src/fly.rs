//! Flies the image, as flashed, in lockstep with the plant. The instruments' readings appear in the registers of the
//! board's sensors, motor commands are read from its pins, and a ground station is connected to its telemetry UART.

use crate::card::CardFaults;
use crate::card_logs::{self, StorageLog};
use crate::check::check;
use crate::machine::{Machine, Signal, quiet_usb};
use crate::parameter_flash::{self, PWM400};
use crate::pilot::GroundPilot;
use crate::pins::MotorPins;
use crate::same;
use crate::ublox::{Generation, UbloxPeer};
use crate::usb_ring::UsbRing;
use crate::wire::UartWire;
use crate::world::at_the_place;
use afbc_scenario::load;
use rigless::emulator::{Driver, Host, Settled, Start, Stop, run};
use rigless::image::Image;
use rigless::session::Session;
use rigless::time::VirtualNanos;
use std::error::Error;
use std::path::{Path, PathBuf};

pub(crate) const TICK_NS: u64 = 1_000_000;
/// Largest total of dropouts in a log on a faultless card [ms]; the start of a log fills the queue.
const DROPOUTS_MS: u64 = 100;

/// Receiver of the exact log on the second link.
pub(crate) enum Hearer {
    Uart(UartWire),
    Usb(UsbRing),
}

impl Hearer {
    fn take(&mut self) -> Vec<u8> {
        match self {
            Hearer::Uart(wire) => wire.take(),
            Hearer::Usb(ring) => std::mem::take(&mut ring.bytes),
        }
    }
}

pub(crate) struct TwinFlight {
    pub(crate) pilot: GroundPilot,
    pub(crate) hearer: Option<Hearer>,
    /// u-blox receiver that replaces the board's own GNSS receiver.
    pub(crate) receiver: Option<UbloxPeer>,
    pub(crate) pins: MotorPins,
    /// Times at which the card's content is kept.
    pub(crate) cuts: Option<PowerCutTimes>,
    /// Logs as they were before they were erased.
    pub(crate) fetched: Option<Result<Vec<StorageLog>, String>>,
}

/// Times at which the card's content is kept, as if the power were cut then.
pub(crate) struct PowerCutTimes {
    folder: PathBuf,
    at_ms: Vec<u64>,
}

/// Description of the flight.
pub struct FlightOptions<'a> {
    /// File of the scenario.
    pub scenario: &'a Path,
    /// Duration of the hover [ms].
    pub hover_ms: u64,
    /// True to fly a mission instead of a hover.
    pub is_mission: bool,
    /// u-blox receiver that replaces the board's own GNSS receiver.
    pub receiver: Option<Generation>,
    /// File for the exact log.
    pub log: Option<&'a Path>,
    /// Folder for the logs of the memory card.
    pub card: Option<&'a Path>,
    /// Faults of the memory card.
    pub card_faults: CardFaults,
    /// Free space of a nearly full card [kB].
    pub full_kb: Option<u64>,
    /// Times at which the card's content is kept, as if the power were cut then [ms].
    pub cuts_ms: &'a [u64],
    /// True to download and erase the logs after the flight.
    pub fetches: bool,
}

/// Flies as ordered. If an exact log is kept, replays it, and fails unless the replay is the same to the last bit.
pub fn fly<M: Machine>(image: &Path, order: &FlightOptions<'_>) -> Result<(), Box<dyn Error>> {
    let &FlightOptions { scenario, hover_ms, is_mission, receiver, log, card, card_faults, full_kb, cuts_ms, fetches } =
        order;
    let scenario = load(scenario)?;
    let mut board = M::built()?;
    board.sense(&at_the_place());
    if card.is_some() {
        board.insert_card();
    }
    if let Some(storage) = board.log_storage() {
        storage.set_faults(card_faults);
        if let Some(kb) = full_kb {
            storage.fill(kb * 1024);
        }
        // Without a folder for the logs, the slot is empty.
        if card.is_none() {
            storage.remove();
        }
    }
    let wire = UartWire::default();
    check(board.attach_link(wire.clone()), "the link is wired")?;
    let mut hearer = None;
    if log.is_some() {
        let wire = UartWire::default();
        let is_uart = board.attach_second_link(wire.clone());
        hearer = Some(if is_uart { Hearer::Uart(wire) } else { Hearer::Usb(UsbRing::find(image)?) });
    }
    let receiver = receiver.map(|generation| UbloxPeer::new(generation, M::RECEIVER));
    let pins = MotorPins::new(M::SIGNAL, scenario.rotors.len());
    let pilot = GroundPilot::new(&scenario, wire)?.hovering(hover_ms);
    let pilot = if is_mission { pilot.with_mission() } else { pilot };
    let pilot = if card.is_some() { pilot.logging() } else { pilot };
    let pilot = if fetches { pilot.fetching() } else { pilot };
    let cuts = card.map(|folder| PowerCutTimes { folder: folder.into(), at_ms: cuts_ms.to_vec() });
    let flight = TwinFlight { pilot, hearer, receiver, pins, cuts, fetched: None };
    // About 75 bytes per tick are too much for a UART at the default rate.
    let to_log: &[_] = if log.is_some() { &[("LOG_PORT", 2.0), ("SER_TEL1_BAUD", 921_600.0)] } else { &[] };
    let images = images::<M>(image, to_log)?;
    let session = Session::new(board, 0, VirtualNanos(TICK_NS))?;
    let mut finished = run(session, &Start::new(&images), flight)?;
    for told in finished.session.told() {
        println!("the models say: {} {}: {}", told.instance, told.register, told.reason);
    }
    let unmapped: Vec<_> = finished.session.unmapped().iter().map(|access| access.address).collect();
    let refused = finished.session.refused().len();
    let TwinFlight { pilot, hearer, receiver, pins, fetched, .. } = finished.driver;
    match M::SIGNAL {
        Signal::Dshot600(_) => println!("{} frames of DSHOT600", pins.sent),
        Signal::Pwm400 => println!("{} ticks with PWM's pulses", pins.sent),
    }
    if let Some(receiver) = &receiver {
        println!("{}", receiver.summary());
    }
    // The flight is checked at the end, so that log and card of a failed flight are kept too.
    let verdict = pilot.verdict();
    let mut same = Ok(());
    if let (Some(log), Some(mut hearer)) = (log, hearer) {
        let bytes = hearer.take();
        std::fs::write(log, &bytes)?;
        same = same::check_log(&bytes);
    }
    if let Some(folder) = card {
        let storage = finished.session.board_mut().log_storage().ok_or("this machine keeps no logs")?;
        let mut logs = card_logs::save(storage, folder)?;
        if let Some(fetched) = fetched {
            check(logs.is_empty(), "the logs are erased")?;
            logs = fetched?;
        }
        println!("{} blocks or pages written", storage.written());
        for log in &logs {
            println!(
                "{}: {} bytes, {} of them outside records; {} ms missing",
                log.name, log.bytes, log.rest, log.missing_ms
            );
        }
        let is_sound = card_faults != CardFaults::default()
            || full_kb.is_some()
            || logs.iter().all(|log| log.rest == 0 && log.missing_ms <= DROPOUTS_MS);
        check(!logs.is_empty() && is_sound, "a log covers the whole flight")?;
    }
    same?;
    verdict?;
    check(receiver.is_none_or(|receiver| receiver.is_configured()), "the receiver is configured")?;
    check(pins.wrong.is_empty(), &format!("{:?}: {:?}", M::SIGNAL, pins.wrong))?;
    check(
        unmapped.iter().all(|address| M::UNMAPPED.contains(address)) && refused == 0,
        &format!("unmapped accesses {unmapped:x?} and {refused} refused ones"),
    )?;
    check(finished.session.resets().is_empty(), "no reset")
}

impl TwinFlight {
    /// Reads the motor commands from PWM pulses, which the pins repeat, if the board uses PWM.
    pub(crate) fn hear_pulses<M: Machine>(&mut self, session: &mut Session<M>) {
        if M::SIGNAL == Signal::Pwm400 {
            self.pins.take_pulses(&session.board_mut().motors());
            self.pilot.command(self.pins.take());
        }
    }
}

impl TwinFlight {
    /// Keeps the card's content if it is time to, and compares downloaded logs.
    fn look_at_card<M: Machine>(&mut self, session: &mut Session<M>, now_ms: u64) {
        let (Some(cuts), Some(storage)) = (&self.cuts, session.board_mut().log_storage()) else { return };
        if cuts.at_ms.contains(&now_ms) {
            match card_logs::save(storage, &cuts.folder.join(format!("cut-{now_ms}"))) {
                Ok(logs) => println!(
                    "{:8.3} s  storage of the logs saved as if the power was cut here; logs: \
                     {logs:?}",
                    now_ms as f64 * 1e-3
                ),
                Err(error) => println!("{:8.3} s  cut here: {error}", now_ms as f64 * 1e-3),
            }
        }
        if self.fetched.is_none()
            && let Some(fetch) = self.pilot.fetched()
        {
            let saved = card_logs::save(storage, &cuts.folder).and_then(|logs| {
                let read = |log: &StorageLog| std::fs::read(cuts.folder.join(&log.name));
                let bytes: Vec<_> = logs.iter().map(read).collect::<Result<_, _>>()?;
                fetch.compare(&bytes).map(|()| logs)
            });
            self.fetched = Some(saved.map_err(|error| error.to_string()));
        }
    }
}

/// Returns the image, and the parameters' flash with these values and those that the board's motor protocol needs.
pub(crate) fn images<M: Machine>(image: &Path, parameters: &[(&str, f32)]) -> Result<Vec<Image>, Box<dyn Error>> {
    let pwm = (M::SIGNAL == Signal::Pwm400).then_some(("MOT_PROTOCOL", PWM400));
    let kept: Vec<_> = pwm.into_iter().chain(parameters.iter().copied()).collect();
    let mut images = vec![Image::read(image, None)?];
    if !kept.is_empty() {
        let kept = parameter_flash::parameters(&kept, M::STORE_WORD)?;
        images.push(Image::new(Path::new("parameters"), kept, Some(M::STORE))?);
    }
    Ok(images)
}

impl<M: Machine> Driver<M> for TwinFlight {
    fn on_settled(&mut self, session: &mut Session<M>, _: &mut dyn Host, settled: Settled) {
        if let Some(receiver) = &self.receiver {
            receiver.watch(&settled);
        }
        if let Settled::Access { access, .. } = &settled {
            M::complete(session, access);
        }
        match settled {
            Settled::Access { access, value } if self.pins.watch(&access, value, session.mcu()) => {}
            Settled::Stop(stop) if self.pins.look_ns().is_some_and(|look_ns| stop.at.0 >= look_ns) => {
                let motors = session.board_mut().motors();
                if self.pins.look(&motors, session.mcu(), stop.at) {
                    self.pilot.command(self.pins.take());
                }
            }
            _ => return,
        }
        session.pause_at(self.pins.look_ns().map(VirtualNanos));
    }

    fn on_stop(&mut self, session: &mut Session<M>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        if let Some(Hearer::Usb(ring)) = &mut self.hearer {
            ring.drain(host);
        }
        self.hear_pulses(session);
        quiet_usb(session, stop.at);
        self.look_at_card(session, stop.at.0 / TICK_NS);
        let (readings, signals) = self.pilot.advance(stop.at.0 / TICK_NS)?;
        match &self.receiver {
            Some(receiver) => receiver.sense(session.board_mut(), stop.at, (&readings, &signals)),
            None => session.board_mut().sense(&signals),
        }
        Some(VirtualNanos(stop.at.0 + TICK_NS))
    }
}
