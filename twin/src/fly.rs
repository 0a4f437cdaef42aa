//! A flight of the image as flashed, in lockstep with the plant: the instruments' readings at the registers of the
//! board's sensors, motor commands from its pins, a station at its telemetry UART.

use crate::check::check;
use crate::kept::parameters;
use crate::machine::{Machine, quiet_usb};
use crate::pilot::Pilot;
use crate::pins::{BIT_NS, BITS, Frames};
use crate::same;
use crate::ublox::{Generation, UbloxPeer};
use crate::wire::Wire;
use afbc_scenario::load;
use rigless::edge::Edge;
use rigless::emulator::{AccessKind, Driver, Host, Settled, Start, Stop, run};
use rigless::image::Image;
use rigless::machine::flight::Actuator;
use rigless::machine::matekh743::MatekH743;
use rigless::session::Session;
use rigless::time::VirtualNanos;
use std::error::Error;
use std::path::Path;

pub(crate) const TICK_NS: u64 = 1_000_000;
/// Control register of the DMA stream of the motors' timer, TIM5; its lowest bit starts a frame (RM0433, 15.5.5).
const DMA_S0CR: u64 = 0x4002_0010;
/// First motor's output: PWM3.
const FIRST: usize = 2;
/// The wire of the first link, UART7.
pub(crate) const LINK: &str = "serial1";
/// The second link, USART1, among the chip's.
const SECOND_LINK: usize = 0;
/// Time between two looks for the first bit of a frame, and for how long [ns].
const LOOK_NS: u64 = 200;
const LOOKS: u32 = 100;
/// Reading a frame of the motors.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Sampling {
    Idle,
    /// Looks left for the first bit.
    Waits(u32),
    /// Bits taken, of a frame whose first was seen at this time [ns].
    Reads(u64, u64),
}

pub(crate) struct Flight {
    pub(crate) pilot: Pilot,
    /// In place of the board's own one.
    pub(crate) receiver: Option<UbloxPeer>,
    pub(crate) frames: Frames,
    pub(crate) sampling: Sampling,
    /// When the pins are looked at next [ns].
    pub(crate) look_ns: Option<u64>,
    pub(crate) motors: usize,
}

/// Flies a scenario, with a receiver of u-blox's if one is given. The exact log, if it is to be kept in a file, must be
/// flown again with the same result to the last bit.
pub fn fly(image: &Path, file: &Path, receiver: Option<Generation>, log: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let scenario = load(file)?;
    let mut board = Box::new(MatekH743::new()?);
    let wire = Wire::default();
    check(rigless::machine::Board::attach_host(&mut *board, LINK, Box::new(wire.clone())), "the link is wired")?;
    let recorded = Wire::default();
    board.mcu.usart[SECOND_LINK].attach_boxed(Box::new(recorded.clone()));
    let motors = scenario.rotors.len();
    let flight = Flight {
        pilot: Pilot::new(&scenario, wire)?,
        receiver: receiver.map(UbloxPeer::new),
        frames: Frames::new(motors),
        sampling: Sampling::Idle,
        look_ns: None,
        motors,
    };
    let mut images = vec![Image::read(image, None)?];
    if log.is_some() {
        // On the second link. A word of the chip's flash has 32 bytes.
        let kept = parameters("LOG_PORT", 2.0, 32)?;
        images.push(Image::new(Path::new("parameters"), kept, Some(MatekH743::STORE))?);
    }
    let session = Session::new(board, 0, VirtualNanos(TICK_NS))?;
    let finished = run(session, &Start::new(&images), flight)?;
    for told in finished.session.told() {
        println!("the models say: {} {}: {}", told.instance, told.register, told.reason);
    }
    let [unmapped, refused] = [finished.session.unmapped().len(), finished.session.refused().len()];
    let Flight { frames, pilot, receiver, .. } = finished.driver;
    println!("{} frames to each motor", frames.sent);
    if let Some(receiver) = receiver {
        println!("{}", receiver.told());
    }
    let verdict = pilot.verdict();
    if let Some(log) = log {
        let bytes = recorded.take();
        std::fs::write(log, &bytes)?;
        same::check_log(&bytes)?;
    }
    verdict?;
    check(frames.wrong.is_empty(), &format!("DSHOT600: {:?}", frames.wrong))?;
    check(unmapped + refused == 0, &format!("{unmapped} unmapped and {refused} refused accesses"))?;
    check(finished.session.resets().is_empty(), "no reset")
}

fn has_pulse(pin: &Actuator) -> bool {
    pin.pulse.is_some_and(|pulse| pulse.width.0 > 0)
}

impl Driver<MatekH743> for Flight {
    fn on_settled(&mut self, session: &mut Session<MatekH743>, _: &mut dyn Host, settled: Settled) {
        if let Some(receiver) = &self.receiver {
            receiver.watch(&settled);
        }
        match settled {
            Settled::Access { access, value }
                if (access.kind, access.address, value & 1) == (AccessKind::Write, DMA_S0CR, 1) =>
            {
                self.sampling = Sampling::Waits(LOOKS);
                self.look_ns = Some(access.virtual_time.0 + LOOK_NS);
            }
            Settled::Stop(stop) if self.look_ns.is_some_and(|look_ns| stop.at.0 >= look_ns) => {
                self.look_ns = self.sample(session, stop.at.0);
            }
            _ => return,
        }
        session.pause_at(self.look_ns.map(VirtualNanos));
    }

    fn on_stop(&mut self, session: &mut Session<MatekH743>, stop: Stop, _: &mut dyn Host) -> Option<VirtualNanos> {
        quiet_usb(session, stop.at);
        let (readings, signals) = self.pilot.advance(stop.at.0 / TICK_NS)?;
        match &self.receiver {
            Some(receiver) => receiver.sense(session.board_mut(), stop.at, (&readings, &signals)),
            None => session.board_mut().sense(&signals),
        }
        Some(VirtualNanos(stop.at.0 + TICK_NS))
    }
}

impl Flight {
    /// Looks at the motors' pins; returns when to look again.
    fn sample(&mut self, session: &mut Session<MatekH743>, now_ns: u64) -> Option<u64> {
        let outputs = session.board_mut().drive().0;
        let pins = outputs.get(FIRST..FIRST + self.motors)?;
        let (first_ns, taken) = match self.sampling {
            Sampling::Idle => return None,
            Sampling::Waits(_) if pins.iter().any(has_pulse) => (now_ns, 0),
            Sampling::Waits(0) => {
                self.frames.wrong.push(format!("no frame at {now_ns} ns"));
                self.sampling = Sampling::Idle;
                return None;
            }
            Sampling::Waits(left) => {
                self.sampling = Sampling::Waits(left - 1);
                return Some(now_ns + LOOK_NS);
            }
            Sampling::Reads(first_ns, taken) => (first_ns, taken),
        };
        self.frames.take(pins);
        let taken = taken + 1;
        if taken < BITS {
            self.sampling = Sampling::Reads(first_ns, taken);
            return Some(first_ns + (taken as f64 * BIT_NS) as u64);
        }
        self.sampling = Sampling::Idle;
        self.pilot.command(self.frames.throttles());
        None
    }
}
