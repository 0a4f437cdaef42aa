//! A flight of the image as flashed, in lockstep with the plant: the instruments' readings at the registers of the
//! board's sensors, motor commands from its pins, a station at its telemetry UART.

use crate::check::check;
use crate::pins::{BIT_NS, BITS, Frames};
use crate::ublox::{Generation, UbloxPeer};
use crate::wire::Telemetry;
use crate::world::Transducers;
use afbc_flight_core::motor::{THROTTLE_MAX, THROTTLE_MIN};

use afbc_link::{Address, Command, Datum, Decoder, Downlink, FRAME_MAX, Height, Sender, Uplink};
use afbc_scenario::load;
use afbc_sim::flight::World;
use afbc_types::{ROTORS_MAX, RotorSpeeds};
use rigless::edge::Edge;
use rigless::emulator::{AccessKind, Driver, Host, Settled, Start, Stop, run};
use rigless::image::Image;
use rigless::machine::flight::Actuator;
use rigless::machine::matekh743::MatekH743;
use rigless::session::Session;
use rigless::time::VirtualNanos;
use std::error::Error;
use std::path::Path;

const STATION: Address = Address { system: 255, component: 190 };
const TICK_NS: u64 = 1_000_000;
/// Control register of the DMA stream of the motors' timer, TIM5; its lowest bit starts a frame (RM0433, 15.5.5).
const DMA_S0CR: u64 = 0x4002_0010;
/// First motor's output: PWM3.
const FIRST: usize = 2;
/// The wire of the first link, UART7.
const LINK: &str = "serial1";
/// Time between two looks for the first bit of a frame, and for how long [ns].
const LOOK_NS: u64 = 200;
const LOOKS: u32 = 100;
/// Height of the hover above where it stood [m], and its time [ms].
const HEIGHT_M: f32 = 5.0;
const HOVER_MS: u64 = 30_000;
/// Time within which it must arm, climb, and land and disarm [ms].
const PATIENCE_MS: [u64; 3] = [40_000, 15_000, 40_000];
/// What the hover may be off on average, and the vehicle be tilted by at any time, in gusts [m, rad].
const OFF_M: f64 = 2.5;
const TILT_RAD: f64 = 0.7;

/// Parts of the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Wakes,
    Climbs,
    Hovers,
    Lands,
    Done,
}

/// Reading a frame of the motors.
#[derive(Clone, Copy)]
enum Sampling {
    Idle,
    /// Looks left for the first bit.
    Waits(u32),
    /// Bits taken, of a frame whose first was seen at this time [ns].
    Reads(u64, u64),
}

struct Flight {
    world: World,
    transducers: Transducers,
    /// In place of the board's own one.
    receiver: Option<UbloxPeer>,
    frames: Frames,
    sampling: Sampling,
    /// When the pins are looked at next [ns].
    look_ns: Option<u64>,
    throttles: Vec<u16>,
    speed_max_rad_s: f32,
    wire: Telemetry,
    sender: Sender,
    decoder: Decoder<Downlink>,
    phase: Phase,
    /// Milliseconds, and when the phase began.
    now_ms: u64,
    since_ms: u64,
    armed: bool,
    /// Where it hovers, by the truth [m].
    start_m: [f64; 3],
    off_m: (f64, u64),
    tilt_rad: f64,
    error: Option<String>,
}

/// Flies a scenario, with a receiver of u-blox's if one is given.
pub fn fly(image: &Path, file: &Path, receiver: Option<Generation>) -> Result<(), Box<dyn Error>> {
    let scenario = load(file)?;
    let mut board = Box::new(MatekH743::new()?);
    let wire = Telemetry::default();
    check(rigless::machine::Board::attach_host(&mut *board, LINK, Box::new(wire.clone())), "the link is wired")?;
    let flight = Flight {
        world: World::released(&scenario, 1e-3)?,
        transducers: Transducers::new(),
        receiver: receiver.map(UbloxPeer::new),
        frames: Frames::new(scenario.rotors.len()),
        sampling: Sampling::Idle,
        look_ns: None,
        throttles: vec![0; scenario.rotors.len()],
        speed_max_rad_s: 1000.0,
        wire,
        sender: Sender::new(STATION),
        decoder: Decoder::new(STATION),
        phase: Phase::Wakes,
        now_ms: 0,
        since_ms: 0,
        armed: false,
        start_m: [0.0; 3],
        off_m: (0.0, 0),
        tilt_rad: 0.0,
        error: None,
    };
    let images = [Image::read(image, None)?];
    let session = Session::new(board, 0, VirtualNanos(TICK_NS))?;
    let finished = run(session, &Start::new(&images), flight)?;
    for told in finished.session.told() {
        println!("the models say: {} {}: {}", told.instance, told.register, told.reason);
    }
    let [unmapped, refused] = [finished.session.unmapped().len(), finished.session.refused().len()];
    let Flight { frames, error, off_m: (sum, count), tilt_rad, now_ms, phase, receiver, .. } = finished.driver;
    if let Some(receiver) = receiver {
        println!("{}", receiver.told());
    }
    let off_m = sum / count.max(1) as f64;
    let (time_s, sent) = (now_ms as f64 * 1e-3, frames.sent);
    println!("{time_s:.1} s, {sent} frames to each motor");
    println!("hover off by {off_m:.2} m on average, largest tilt {tilt_rad:.2} rad");
    if let Some(error) = error {
        return Err(error.into());
    }
    check(phase == Phase::Done, "the flight ends")?;
    check(frames.wrong.is_empty(), &format!("DSHOT600: {:?}", frames.wrong))?;
    check(off_m < OFF_M && tilt_rad < TILT_RAD, "it flies well")?;
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
        self.now_ms = stop.at.0 / TICK_NS;
        let mut speeds = RotorSpeeds::<ROTORS_MAX>::default();
        for (speed, throttle) in speeds.0.iter_mut().zip(&self.throttles) {
            let share = throttle.saturating_sub(THROTTLE_MIN) as f32 / f32::from(THROTTLE_MAX - THROTTLE_MIN);
            *speed = share * self.speed_max_rad_s;
        }
        self.world.advance(&speeds);
        self.world.look();
        let readings = self.world.readings().copied().unwrap_or_default();
        let signals = self.transducers.feel(&readings);
        match &self.receiver {
            Some(receiver) => receiver.sense(session.board_mut(), stop.at, (&readings, &signals)),
            None => session.board_mut().sense(&signals),
        }
        self.talk();
        self.supervise();
        (self.error.is_none() && self.phase != Phase::Done).then(|| VirtualNanos(stop.at.0 + TICK_NS))
    }
}

impl Flight {
    /// Looks at the motors' pins; returns when to look again.
    fn sample(&mut self, session: &mut Session<MatekH743>, now_ns: u64) -> Option<u64> {
        let outputs = session.board_mut().drive().0;
        let pins = outputs.get(FIRST..FIRST + self.throttles.len())?;
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
        for (known, new) in self.throttles.iter_mut().zip(self.frames.throttles()) {
            *known = new.unwrap_or(*known);
        }
        None
    }

    fn say(&mut self, message: &Uplink) {
        let mut frame = [0; FRAME_MAX];
        let bytes = self.sender.send(message, &mut frame).to_vec();
        self.wire.send(&bytes);
    }

    /// Hears the vehicle.
    fn talk(&mut self) {
        let bytes = self.wire.take();
        let now_ms = self.now_ms;
        let armed = &mut self.armed;
        self.decoder.feed(&bytes, |_, message| match message {
            Downlink::Heartbeat { armed: is_armed, .. } => *armed = is_armed,
            Downlink::Text { text, .. } => println!("{:7.3} s: {}", now_ms as f64 * 1e-3, text.to_str().unwrap_or("?")),
            _ => {}
        });
        if self.now_ms % 1000 == 0 {
            self.say(&Uplink::Heartbeat);
        }
    }

    /// Leads it through the flight, and watches.
    fn supervise(&mut self) {
        let motion = self.world.plant().motion();
        let [x, y, z]: [f64; 3] = motion.position_m.into();
        let tilt_rad = motion.attitude_rad.x.hypot(motion.attitude_rad.y);
        self.tilt_rad = self.tilt_rad.max(tilt_rad);
        let passed_ms = self.now_ms - self.since_ms;
        let second = passed_ms % 1000 == 999;
        if self.now_ms % 5000 == 0 {
            let [east, north, up] = self.transducers.fix_m();
            println!(
                "{:7.3} s: {:?}, {x:.2} {y:.2} {z:.2} m; fix off by {:.2} {:.2} {:.2} m, height by {:.2} m",
                self.now_ms as f64 * 1e-3,
                self.phase,
                east - x,
                north - y,
                up - z,
                self.transducers.height_m() - z
            );
        }
        let next = match self.phase {
            Phase::Wakes => {
                if second && self.now_ms > 3000 {
                    self.say(&Uplink::Command(Command::Arm));
                }
                self.armed.then_some(Phase::Climbs)
            }
            Phase::Climbs => {
                if passed_ms == 0 {
                    self.start_m = [x, y, z];
                }
                if passed_ms % 2000 == 500 && z - self.start_m[2] < 0.5 {
                    let height = Height { metres: HEIGHT_M, above: Datum::Here };
                    self.say(&Uplink::Command(Command::TakeOff(height)));
                }
                (z - self.start_m[2] > 0.6 * f64::from(HEIGHT_M)).then_some(Phase::Hovers)
            }
            Phase::Hovers => {
                if passed_ms > 3000 {
                    self.off_m.0 += (x - self.start_m[0]).hypot(y - self.start_m[1]).hypot(z - self.start_m[2] - 5.0);
                    self.off_m.1 += 1;
                }
                (passed_ms >= HOVER_MS).then_some(Phase::Lands)
            }
            Phase::Lands => {
                if passed_ms % 2000 == 0 && self.armed {
                    self.say(&Uplink::Command(Command::Land));
                }
                (!self.armed).then_some(Phase::Done)
            }
            Phase::Done => None,
        };
        let patience_ms = match self.phase {
            Phase::Wakes => PATIENCE_MS[0],
            Phase::Climbs => PATIENCE_MS[1],
            Phase::Lands => PATIENCE_MS[2],
            _ => u64::MAX,
        };
        if let Some(next) = next {
            (self.phase, self.since_ms) = (next, self.now_ms);
        } else if passed_ms > patience_ms {
            self.error = Some(format!("{:?}: not within {} s", self.phase, patience_ms / 1000));
        }
        if matches!(self.phase, Phase::Climbs | Phase::Hovers) && !self.armed {
            self.error = Some(format!("{:?}: it disarmed", self.phase));
        }
        if tilt_rad > 1.5 {
            self.error = Some(format!("{:?}: it turned over", self.phase));
        }
    }
}
