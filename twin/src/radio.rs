//! A flight by radio of the image as flashed: a CRSF receiver at a UART of the board. The pilot arms by a switch, climbs
//! and hovers by the sticks, and stops the motors by a switch, which their pins must show in time.

use crate::check::check;
use crate::fly::{TICK_NS, images};
use crate::machine::{Machine, Signal, quiet_usb};
use crate::pilot::Pilot;
use crate::pins::MotorPins;
use crate::wire::Wire;
use crate::world::at_the_place;
use afbc_radio::{Channels, CrsfFrame};
use afbc_scenario::load;
use rigless::emulator::{Driver, Host, Settled, Start, Stop, run};
use rigless::session::Session;
use rigless::time::VirtualNanos;
use std::error::Error;
use std::path::Path;

/// Time between two frames [ms].
const FRAME_MS: u64 = 4;
/// Time of the last byte on the line, of ten bits at 420,000 baud [ns].
const BYTE_NS: u64 = 10 * 1_000_000_000 / 420_000;
/// Time from the last byte of the first frame with the switch on until no motor is driven, at most [ns].
const KILL_NS: u64 = 20_000_000;
/// Time after which the pilot tries to arm, moves the switch again, and gives up [ms].
const ARMS_MS: u64 = 12_000;
const AGAIN_MS: u64 = 2_000;
const PATIENCE_MS: u64 = 45_000;
/// Height at which it hovers, and the time of climb and hover [m, ms].
const HEIGHT_M: f64 = 3.0;
const CLIMB_MS: u64 = 15_000;
const HOVER_MS: u64 = 5_000;
/// What a hover may be off, and the vehicle tilted by [m, rad].
const OFF_M: f64 = 2.5;
const TILT_RAD: f64 = 0.5;

const THROTTLE: usize = 2;
const ARM: usize = 4;
const KILL: usize = 6;

/// Parts of the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Wakes,
    Climbs,
    Hovers([f64; 3]),
    Kills,
}

struct RadioFlight {
    pilot: Pilot,
    pins: MotorPins,
    receiver: Wire,
    channels: Channels,
    part: Part,
    since_ms: u64,
    tilt_rad: f64,
    /// When the last byte of the first frame with the kill switch on was sent, and no motor was driven any more [ns].
    sent_ns: Option<u64>,
    silent_ns: Option<u64>,
    error: Option<String>,
}

/// Flies by radio.
pub fn fly<M: Machine>(image: &Path, scenario: &Path) -> Result<(), Box<dyn Error>> {
    let scenario = load(scenario)?;
    let mut board = M::built()?;
    board.sense(&at_the_place());
    let (wire, receiver) = (Wire::default(), Wire::default());
    check(board.attach_link(wire.clone()), "the link is wired")?;
    let port = board.attach_radio(receiver.clone()).ok_or("this board has no UART for a radio receiver here")?;
    let mut us = [1000; 16];
    us[..4].fill(1500);
    us[THROTTLE] = 1000;
    let flight = RadioFlight {
        pilot: Pilot::new(&scenario, wire)?,
        pins: MotorPins::new(M::SIGNAL, scenario.rotors.len()),
        receiver,
        channels: Channels::of(us),
        part: Part::Wakes,
        since_ms: 0,
        tilt_rad: 0.0,
        sent_ns: None,
        silent_ns: None,
        error: None,
    };
    let images = images::<M>(image, &[("RC_PORT", port), ("RC_MAP_KILL_SW", 1.0 + KILL as f32)])?;
    let session = Session::new(board, 0, VirtualNanos(TICK_NS))?;
    let flight = run(session, &Start::new(&images), flight)?.driver;
    if let Some(error) = flight.error {
        return Err(error.into());
    }
    let (Some(sent_ns), Some(silent_ns)) = (flight.sent_ns, flight.silent_ns) else {
        return Err("the motors are not stopped".into());
    };
    let took_ns = silent_ns.saturating_sub(sent_ns);
    println!("the motors are still {:.2} ms after the last byte of the kill switch's frame", took_ns as f64 * 1e-6);
    check(took_ns <= KILL_NS, "within 20 ms")
}

impl RadioFlight {
    fn begin(&mut self, part: Part, now_ms: u64) {
        println!("{:7.3} s: {part:?}", now_ms as f64 * 1e-3);
        (self.part, self.since_ms) = (part, now_ms);
    }

    /// Moves sticks and switches; false at the end.
    fn lead(&mut self, now_ms: u64) -> bool {
        let motion = self.pilot.motion();
        let place_m: [f64; 3] = motion.position_m.into();
        let passed_ms = now_ms - self.since_ms;
        self.tilt_rad = self.tilt_rad.max(motion.attitude_rad.x.hypot(motion.attitude_rad.y));
        match self.part {
            Part::Wakes => {
                let on = now_ms >= ARMS_MS && now_ms % AGAIN_MS >= AGAIN_MS / 2;
                self.channels.us[ARM] = if on || self.pilot.armed() { 2000 } else { 1000 };
                if self.pilot.armed() {
                    self.channels.us[THROTTLE] = 1900;
                    self.begin(Part::Climbs, now_ms);
                } else if passed_ms > PATIENCE_MS {
                    self.error = Some("it does not arm".to_owned());
                }
            }
            Part::Climbs if place_m[2] > HEIGHT_M => {
                self.channels.us[THROTTLE] = 1500;
                self.begin(Part::Hovers(place_m), now_ms);
            }
            Part::Climbs if passed_ms > CLIMB_MS => self.error = Some("it does not climb".to_owned()),
            Part::Climbs => (),
            Part::Hovers(start_m) => {
                let off_m = place_m.iter().zip(start_m).map(|(now, then)| (now - then).powi(2)).sum::<f64>().sqrt();
                if off_m > OFF_M || self.tilt_rad > TILT_RAD || !self.pilot.armed() {
                    self.error = Some(format!("it does not hover: {off_m:.2} m off, {:.2} rad", self.tilt_rad));
                }
                if passed_ms >= HOVER_MS && now_ms % FRAME_MS == 0 {
                    self.channels.us[KILL] = 2000;
                    self.begin(Part::Kills, now_ms);
                }
            }
            Part::Kills => {
                if self.sent_ns.is_none() {
                    self.sent_ns = self.receiver.emptied_ns().map(|begun_ns| begun_ns + BYTE_NS);
                }
                if self.silent_ns.is_some() || passed_ms > 200 {
                    return false;
                }
            }
        }
        if now_ms % FRAME_MS == 0 {
            self.receiver.send(&CrsfFrame::Channels(self.channels).encode());
        }
        // Its telemetry goes nowhere.
        drop(self.receiver.take());
        self.error.is_none()
    }

    /// Takes what the motors' wires say.
    fn command(&mut self, at: VirtualNanos) {
        self.pilot.command(self.pins.take());
        if self.part == Part::Kills && self.silent_ns.is_none() && self.pilot.throttles().iter().all(|it| *it == 0) {
            self.silent_ns = Some(at.0);
        }
    }
}

impl<M: Machine> Driver<M> for RadioFlight {
    fn on_settled(&mut self, session: &mut Session<M>, _: &mut dyn Host, settled: Settled) {
        match settled {
            Settled::Access { access, value } if self.pins.watch(&access, value, session.mcu()) => {}
            Settled::Stop(stop) if self.pins.look_ns().is_some_and(|look_ns| stop.at.0 >= look_ns) => {
                let motors = session.board_mut().motors();
                if self.pins.look(&motors, session.mcu(), stop.at) {
                    self.command(stop.at);
                }
            }
            _ => return,
        }
        session.pause_at(self.pins.look_ns().map(VirtualNanos));
    }

    fn on_stop(&mut self, session: &mut Session<M>, stop: Stop, _: &mut dyn Host) -> Option<VirtualNanos> {
        if M::SIGNAL == Signal::Pwm400 {
            self.pins.take_pulses(&session.board_mut().motors());
            self.command(stop.at);
        }
        quiet_usb(session, stop.at);
        let now_ms = stop.at.0 / TICK_NS;
        let (_, signals) = self.pilot.watch(now_ms);
        session.board_mut().sense(&signals);
        self.lead(now_ms).then_some(VirtualNanos(stop.at.0 + TICK_NS))
    }
}
