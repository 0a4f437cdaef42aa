//! Reads motor commands from the pins: DSHOT600 bit by bit, or lengths of PWM pulses. With the parameter [`ANSWERS`]
//! set, DSHOT frames are inverted and motor controllers answer them.
//!
//! The timers' counters are held between two frames. Their updates, 600,000 per second, change no pin and would take a
//! quarter of the emulator's time.

use crate::line_answers::LineAnswers;
use crate::machine::{FrameTimer, Signal};
use afbc_flight_core::motor::{THROTTLE_MAX, THROTTLE_MIN};
use rigless::emulator::{Access, AccessKind};
use rigless::machine::flight::Actuator;
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Width;
use rigless::time::VirtualNanos;

/// Parameter that enables answers on the motors' signal lines.
pub const ANSWERS: &str = "DSHOT_BIDIR_EN";
/// Bits of a DSHOT frame.
const BITS: u64 = 16;
/// Bit position of the transfer direction in a stream's control register (RM0090, 10.5.5; RM0433, 15.5.5).
const DIRECTION: u32 = 6;
/// Period of a bit \[ns\].
const BIT_NS: f64 = 1e9 / 600e3;
/// Pulse lengths of a zero and of a one \[ns\], and resolution of the timers \[ns\].
const PULSES_NS: [u64; 2] = [625, 1_250];
const COUNT_NS: u64 = 6;
/// Time between two samples while waiting for a frame's first bit \[ns\], and largest number of samples.
const LOOK_NS: u64 = 200;
const LOOKS: u32 = 100;
/// PWM \[ns\]: pulse of a stopped motor, increment at full throttle, period, and resolution.
const STOPPED_NS: u64 = 1_000_000;
const SPAN_NS: u64 = 1_000_000;
const PERIOD_NS: u64 = 2_500_000;
const DIVIDED_COUNT_NS: u64 = 50;
/// Largest number of wrong signals that are recorded.
const TOLD: usize = 10;

/// State of reading a timer's frames.
#[derive(Clone, Copy, Debug)]
enum Sampling {
    Idle,
    /// Samples left while waiting for the first bit.
    Waits(u32),
    /// Time of the first bit \[ns\], and bits read so far. After the last bit, the line is sampled once more.
    Reads(u64, u64),
}

/// Frames of a timer's motors.
#[derive(Clone, Debug)]
struct TimerFrames {
    timer: &'static FrameTimer,
    sampling: Sampling,
    /// Time of the next sample \[ns\].
    look_ns: Option<u64>,
    bits: Vec<u16>,
    /// End of the last frame \[ns\].
    ended_ns: u64,
    /// True while the counter is held.
    held: bool,
    /// Answers of the motor controllers, if enabled.
    answers: Option<LineAnswers>,
}

/// Motor pins of a board.
#[derive(Clone, Debug)]
pub struct MotorPins {
    frames: Vec<TimerFrames>,
    /// Newest command of each motor: 0, or 48 to 2047.
    throttles: Vec<Option<u16>>,
    /// Motors whose telemetry bit was set.
    asked: Vec<usize>,
    /// Number of DSHOT frames, or of ticks with a PWM pulse on each pin.
    pub sent: u64,
    /// Signals that were neither a frame nor a valid pulse.
    pub wrong: Vec<String>,
}

impl MotorPins {
    /// Creates the pins of this many motors.
    pub fn new(signal: Signal, motors: usize) -> Self {
        let timers = match signal {
            Signal::Dshot600(timers) => timers,
            Signal::Pwm400 => &[],
        };
        let frames = timers.iter().filter(|timer| timer.motors.start < motors).map(|timer| TimerFrames {
            timer,
            sampling: Sampling::Idle,
            look_ns: None,
            bits: vec![0; timer.motors.end.min(motors) - timer.motors.start],
            ended_ns: 0,
            held: false,
            answers: None,
        });
        MotorPins {
            frames: frames.collect(),
            throttles: vec![None; motors],
            asked: Vec::new(),
            sent: 0,
            wrong: Vec::new(),
        }
    }

    /// Adds motor controllers that answer, if the parameters enable them and the board supports it.
    pub fn answering(mut self, parameters: &[(&str, f32)]) -> Self {
        if parameters.iter().any(|(name, value)| *name == ANSWERS && *value != 0.0) {
            for frames in &mut self.frames {
                let motors = frames.bits.len();
                frames.answers = frames.timer.lines.as_ref().map(|lines| LineAnswers::new(lines, motors));
            }
        }
        self
    }

    /// Sets the speeds of the rotors \[rad/s\].
    pub fn set_rotor_speeds(&mut self, speeds_rad_s: &[f64]) {
        for frames in &mut self.frames {
            let speeds_rad_s = speeds_rad_s.get(frames.timer.motors.start..).unwrap_or_default();
            frames.answers.iter_mut().for_each(|answers| answers.set_rotor_speeds(speeds_rad_s));
        }
    }

    /// Returns the motors whose telemetry was requested since the last call.
    pub fn take_asked(&mut self) -> Vec<usize> {
        std::mem::take(&mut self.asked)
    }

    /// Returns the command of each motor since the last call, if any.
    pub fn take(&mut self) -> Vec<Option<u16>> {
        self.throttles.iter_mut().map(Option::take).collect()
    }

    /// Observes an access of the image, which may start a frame. Returns true if the time of the next sample has
    /// changed.
    pub fn watch(&mut self, access: &Access, value: u64, mcu: &mut dyn Mcu) -> bool {
        let starts = |frames: &&mut TimerFrames| {
            (access.kind, access.address, value & 1) == (AccessKind::Write, frames.timer.stream, 1)
        };
        let Some(frames) = self.frames.iter_mut().find(starts) else { return false };
        // A transfer from the pins means that the firmware samples the controllers' answers.
        if value >> DIRECTION & 0b11 == 0
            && let Some(answers) = &mut frames.answers
        {
            answers.begin(access.virtual_time, frames.ended_ns);
            frames.hold(mcu, access.virtual_time, false);
            return true;
        }
        frames.sampling = Sampling::Waits(LOOKS);
        frames.look_ns = Some(access.virtual_time.0 + LOOK_NS);
        frames.hold(mcu, access.virtual_time, false);
        true
    }

    /// Releases all counters, as the image has set them.
    pub fn release(&mut self, mcu: &mut dyn Mcu, at: VirtualNanos) {
        self.frames.iter_mut().for_each(|frames| frames.hold(mcu, at, false));
    }

    /// Returns the time of the next sample \[ns\].
    pub fn look_ns(&self) -> Option<u64> {
        self.frames.iter().filter_map(TimerFrames::next_ns).min()
    }

    /// Samples the pins for the bits of frames. Returns true if a frame is complete.
    pub fn look(&mut self, pins: &[Actuator], mcu: &mut dyn Mcu, at: VirtualNanos) -> bool {
        let mut complete = false;
        for frames in &mut self.frames {
            if frames.answers.as_mut().is_some_and(|answers| answers.step(mcu, at)) {
                frames.hold(mcu, at, true);
            }
        }
        let due = |frames: &&mut TimerFrames| frames.look_ns.is_some_and(|look_ns| at.0 >= look_ns);
        for frames in self.frames.iter_mut().filter(due) {
            let pins = pins.get(frames.timer.motors.clone()).unwrap_or_default();
            if frames.is_complete() {
                (frames.sampling, frames.look_ns) = (Sampling::Idle, None);
                if pins.iter().any(|pin| frames.pulse_ns(pin) > 0) {
                    tell(&mut self.wrong, || format!("frame {}: more than {BITS} bits", self.sent));
                } else {
                    frames.hold(mcu, at, true);
                }
                continue;
            }
            frames.look_ns = frames.sample(pins, at.0, &mut self.wrong);
            if frames.is_complete() {
                frames.ended_ns = at.0;
                self.sent += 1;
                let first = frames.timer.motors.start;
                for (motor, bits) in (first..).zip(&mut frames.bits) {
                    let Some(throttle) = self.throttles.get_mut(motor) else { continue };
                    // Inverted frames have an inverted checksum, by which controllers know that they must answer.
                    let complement = if frames.answers.is_some() { 0xF } else { 0 };
                    let read = frame_of(std::mem::take(bits) ^ complement);
                    *throttle = read.map(|(throttle, _)| throttle);
                    self.asked.extend(read.filter(|(_, asks)| *asks).map(|_| motor));
                    if throttle.is_none() {
                        tell(&mut self.wrong, || format!("frame {}: a wrong checksum", self.sent));
                    }
                }
                complete = true;
            }
        }
        complete
    }

    /// Reads the lengths of the PWM pulses.
    pub fn take_pulses(&mut self, pins: &[Actuator]) {
        for (throttle, pin) in self.throttles.iter_mut().zip(pins) {
            // No pulse before the outputs start.
            let Some(pulse) = pin.pulse.filter(|pulse| pulse.width.0 > 0) else { continue };
            let [width, period] = [pulse.width.0, pulse.period.0];
            let longest = STOPPED_NS + SPAN_NS + DIVIDED_COUNT_NS;
            if width + DIVIDED_COUNT_NS < STOPPED_NS || width > longest || period.abs_diff(PERIOD_NS) > DIVIDED_COUNT_NS
            {
                tell(&mut self.wrong, || format!("{}: {width} of {period} ns", pin.name));
            }
            let steps = u64::from(THROTTLE_MAX - THROTTLE_MIN);
            let above = (width.saturating_sub(STOPPED_NS) * steps + SPAN_NS / 2) / SPAN_NS;
            *throttle = Some(THROTTLE_MIN + above.min(steps) as u16);
        }
        self.sent += u64::from(self.throttles.iter().all(Option::is_some));
    }
}

impl TimerFrames {
    /// Samples the timer's pins; returns the time of the next sample.
    fn sample(&mut self, pins: &[Actuator], now_ns: u64, wrong: &mut Vec<String>) -> Option<u64> {
        let (first_ns, taken) = match self.sampling {
            Sampling::Idle => return None,
            Sampling::Waits(_) if pins.iter().any(|pin| self.pulse_ns(pin) > 0) => (now_ns, 0),
            Sampling::Waits(0) => {
                tell(wrong, || format!("no frame at {now_ns} ns"));
                self.sampling = Sampling::Idle;
                return None;
            }
            Sampling::Waits(left) => {
                self.sampling = Sampling::Waits(left - 1);
                return Some(now_ns + LOOK_NS);
            }
            Sampling::Reads(first_ns, taken) => (first_ns, taken),
        };
        let widths: Vec<_> = pins.iter().map(|pin| self.pulse_ns(pin)).collect();
        for ((pin, width), bits) in pins.iter().zip(widths).zip(&mut self.bits) {
            let bit = PULSES_NS.iter().position(|length| length.abs_diff(width) <= COUNT_NS);
            if bit.is_none() {
                tell(wrong, || format!("{}: a pulse of {width} ns", pin.name));
            }
            *bits = *bits << 1 | bit.unwrap_or(0) as u16;
        }
        let taken = taken + 1;
        self.sampling = Sampling::Reads(first_ns, taken);
        // The time counts from the first bit, so that rounding errors do not add up.
        Some(first_ns + (taken as f64 * BIT_NS) as u64)
    }

    /// Returns the time of the next sample, or of the next change by an answer \[ns\].
    fn next_ns(&self) -> Option<u64> {
        let answers_ns = self.answers.as_ref().and_then(LineAnswers::next_ns);
        self.look_ns.into_iter().chain(answers_ns).min()
    }

    /// Returns the length of the pulse on a pin \[ns\]; of the low pulse, if the line idles high.
    fn pulse_ns(&self, pin: &Actuator) -> u64 {
        pin.pulse.map_or(0, |pulse| {
            let [width, period] = [pulse.width.0, pulse.period.0];
            if self.answers.is_some() { period - width } else { width }
        })
    }

    /// True if all bits are read.
    fn is_complete(&self) -> bool {
        matches!(self.sampling, Sampling::Reads(_, BITS))
    }

    /// Holds or releases the counter. A counter that the image has stopped stays as it is.
    fn hold(&mut self, mcu: &mut dyn Mcu, at: VirtualNanos, held: bool) {
        let Ok(control) = mcu.read(at, self.timer.counter, Width::W32) else { return };
        if held == self.held || (held && control & 1 == 0) {
            return;
        }
        self.held = held;
        let control = if held { control & !1 } else { control | 1 };
        // Succeeds, since a timer whose register could be read has a clock.
        let _ = mcu.write(at, self.timer.counter, Width::W32, control);
    }
}

/// Returns throttle and telemetry bit of a frame; `None` if its checksum is wrong.
fn frame_of(frame: u16) -> Option<(u16, bool)> {
    let data = frame >> 4;
    let checksum = (data ^ (data >> 4) ^ (data >> 8)) & 0xF;
    (checksum == frame & 0xF).then_some((data >> 1, data & 1 == 1))
}

fn tell(wrong: &mut Vec<String>, what: impl FnOnce() -> String) {
    if wrong.len() < TOLD {
        wrong.push(what());
    }
}
