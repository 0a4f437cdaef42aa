//! Communication: receives and sends messages.

use crate::answers::{ANSWERS_PER_TICK, Answers};
use crate::failsafes::Failsafes;
use crate::flight::Report;
use afbc::monitor::Norm;
use afbc_control::Trip;
use afbc_flight_core::rate;
use afbc_flight_core::supervisor::COAST_US;
use afbc_flight_core::tracker::{POSE_AGE_MAX_US, Refused, Sighting};
use afbc_flight_core::{Inbox, Mode, Stamped, Tracker};
use afbc_link::{Address, Decoder, Downlink, FRAME_MAX, MavSeverity, Sender, StatesRefused, Text, Uplink};
use afbc_types::{PerAxis, Pose, State};

/// Address of the vehicle: system 1, component 1 (autopilot).
pub const ADDRESS: Address = Address { system: 1, component: 1 };
/// Largest size of all messages after one tick \[bytes\].
pub const REPORT_MAX: usize = 768;

/// Text to the pilot when the clock has failed.
pub const CLOCK_FAILED: &str = "clock failed, using the internal one: land";
/// Text to the pilot when the control tick's rate or timing is wrong.
pub const TICK_OFF: &str = "control tick rate is wrong: land";

/// A message sent every `period` ticks, in the ticks given by `phase`.
struct Schedule {
    period: u64,
    phase: u64,
}

impl Schedule {
    fn is_due(&self, tick: u64) -> bool {
        tick % self.period == self.phase
    }
}

/// 1 Hz.
const HEARTBEAT: Schedule = Schedule { period: 1000, phase: 3 };
/// 50 Hz.
const ATTITUDE: Schedule = Schedule { period: 20, phase: 1 };
/// 50 Hz.
const POSITION: Schedule = Schedule { period: 20, phase: 11 };
/// 10 Hz.
const HEALTH: Schedule = Schedule { period: 100, phase: 7 };
/// 100 Hz, and after every tick with a new state, the link's or the vehicle's own.
const ROTORS: Schedule = Schedule { period: 10, phase: 0 };

/// Receives and sends messages.
pub struct Comms {
    decoder: Decoder<Uplink>,
    sender: Sender,
    tracker: Tracker,
    /// True if the vehicle has an estimate of its own: then the tracker's poses are for it.
    estimates: bool,
    /// Start of the last tick \[us\], the time stamp of everything that arrives before the next one.
    now_us: u64,
    tick: u64,
    tick_us_max: f32,
    state: Option<State>,
    /// True if a state has arrived since the last rotor command.
    state_is_news: bool,
    answers: Answers,
    failsafes: Failsafes,
    norms: PerAxis<Norm>,
    trip: Option<Trip>,
    rate: rate::Report,
}

impl Default for Comms {
    fn default() -> Self {
        Self::new()
    }
}

impl Comms {
    /// Creates it with nothing received.
    pub fn new() -> Self {
        Comms {
            decoder: Decoder::new(ADDRESS),
            sender: Sender::new(ADDRESS),
            tracker: Tracker::default(),
            estimates: false,
            now_us: 0,
            tick: 0,
            tick_us_max: 0.0,
            state: None,
            state_is_news: false,
            answers: Answers::default(),
            failsafes: Failsafes::default(),
            norms: PerAxis::default(),
            trip: None,
            rate: rate::Report::default(),
        }
    }

    /// Processes the next bytes of the stream; returns new inputs for the control tick, to be [posted](Inbox::post).
    ///
    /// A vehicle without an estimate of its own ignores poses, since a law needs velocities and rates.
    pub fn receive(&mut self, bytes: &[u8]) -> Inbox {
        let mut news = Inbox::default();
        let Comms { decoder, tracker, estimates, now_us, state, state_is_news, answers, .. } = self;
        decoder.feed(bytes, |from, message| match message {
            Uplink::Heartbeat => (),
            Uplink::State { sent_us, state: value, sigmas } => {
                let age_max_us = if *estimates { POSE_AGE_MAX_US } else { COAST_US.into() };
                let sighting = Sighting::State(value);
                if let Some(at_us) = tracker.sight(number(from), sent_us, *now_us, sighting, age_max_us) {
                    if *now_us - at_us <= COAST_US.into() {
                        news.put_state(Stamped { value, at_us });
                    }
                    if *estimates {
                        news.put_pose(Stamped { value: Pose::of(&value, sigmas), at_us });
                    }
                    (*state, *state_is_news) = (Some(value), true);
                }
            }
            Uplink::Pose { sent_us, pose: value } if *estimates => {
                let sighting = Sighting::Pose(value);
                if let Some(at_us) = tracker.sight(number(from), sent_us, *now_us, sighting, POSE_AGE_MAX_US) {
                    news.put_pose(Stamped { value, at_us });
                }
            }
            Uplink::Pose { .. } => (),
            Uplink::Setpoint(value) => news.put_setpoint(Stamped { value, at_us: *now_us }),
            Uplink::Command(command) => answers.hear(command, from, *now_us, &mut news),
        });
        news
    }

    /// Returns the number of frames dropped since power-up, for any reason.
    pub fn bad_frames(&self) -> u32 {
        let c = self.decoder.counters();
        [c.bad_checksum, c.unknown, c.oversized, c.malformed, c.implausible, c.unsupported]
            .into_iter()
            .fold(0, u32::saturating_add)
    }

    /// Sends all messages due after a tick, frame by frame, through `send`. `tick_cycles` is the duration of the tick
    /// in cycles of 168 MHz.
    pub fn report<const N: usize>(&mut self, report: &Report<N>, tick_cycles: u32, mut send: impl FnMut(&[u8])) {
        let mut buffer = [0; FRAME_MAX];
        let mut say = |message: Downlink| send(self.sender.send(&message, &mut buffer));

        self.now_us = report.time_us;
        self.tick += 1;
        let tick_us = tick_cycles as f32 / 168.0;
        self.tick_us_max = self.tick_us_max.max(tick_us);

        let armed = report.mode.armed();
        self.estimates = report.estimate.is_some();
        if let Some(estimate) = report.estimate {
            (self.state, self.state_is_news) = (Some(estimate), true);
        }
        if self.state_is_news || ROTORS.is_due(self.tick) {
            self.state_is_news = false;
            say(Downlink::Rotors { time_us: report.time_us, armed, speeds: report.motors.padded() });
        }
        if let Some(answer) = report.answer.and_then(|answer| self.answers.settle(answer)) {
            say(answer);
        }
        for answer in core::iter::from_fn(|| self.answers.next(report.time_us)).take(ANSWERS_PER_TICK) {
            say(answer);
        }
        let mut text = |severity, text: &str| say(Downlink::Text { severity, text: Text::from(text) });
        if let Some(Err(refusal)) = report.answer.map(|answer| answer.result) {
            text(MavSeverity::MAV_SEVERITY_WARNING, refusal.reason());
        }
        for (severity, notice) in self.failsafes.watch(report, self.tick) {
            text(severity, notice);
        }
        let trip = report.health.control.trip;
        if let (Some(trip), None) = (trip, self.trip) {
            text(MavSeverity::MAV_SEVERITY_WARNING, trip.reason());
        }
        let (rate, before) = (report.health.rate, self.rate);
        self.rate = rate;
        if rate.clock_failed && !before.clock_failed {
            text(MavSeverity::MAV_SEVERITY_CRITICAL, CLOCK_FAILED);
        } else if before.healthy() && !rate.healthy() {
            text(MavSeverity::MAV_SEVERITY_CRITICAL, TICK_OFF);
        }
        // While the vehicle flies blind there is no report of a law.
        if report.mode != Mode::Coasting {
            self.trip = trip;
        }
        if let Some((axis, norm)) = report.learnt {
            self.norms[axis] = norm;
        }
        if HEARTBEAT.is_due(self.tick) {
            let failsafe = self.failsafes.within(HEARTBEAT.period, self.tick);
            say(Downlink::Heartbeat { armed, failsafe, mode: report.mode as u32 });
        }
        let time_ms = (report.time_us / 1000) as u32;
        if let Some(State { position_m, velocity_m_s, attitude_rad, rates_rad_s }) = self.state {
            if ATTITUDE.is_due(self.tick) {
                say(Downlink::Attitude { time_ms, attitude_rad, rates_rad_s });
            }
            if POSITION.is_due(self.tick) {
                say(Downlink::Position { time_ms, position_m, velocity_m_s });
            }
        }
        if HEALTH.is_due(self.tick) {
            let Report { health, .. } = report;
            let norm = |norm: &Norm| libm::sqrtf(norm.theta_squared);
            let Refused { overtaken, late, elsewhere } = *self.tracker.refused();
            say(Downlink::Health(afbc_link::Health {
                time_us: report.time_us,
                tick_us,
                tick_max_us: self.tick_us_max,
                rate_hz: health.rate.rate_hz.unwrap_or(0) as f32,
                late_ticks: health.rate.off_ticks(),
                saturated_ticks: report.saturated_ticks,
                state_age_us: health.state_age_us as f32,
                theta_norm: PerAxis::from_fn(|axis| norm(&self.norms[axis])),
                delta: PerAxis::from_fn(|axis| self.norms[axis].delta),
                link: *self.decoder.counters(),
                unanswered: self.answers.unanswered(),
                states_refused: StatesRefused { overtaken, late, elsewhere, frozen: health.frozen_states },
            }));
        }
    }
}

/// Returns a sender's number for the [`Tracker`].
fn number(from: Address) -> u16 {
    u16::from_be_bytes([from.system, from.component])
}
