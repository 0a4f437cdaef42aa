//! Sending: the messages that are due after a tick.

use super::{CLOCK_FAILED, Comms, HEARTBEAT, REPLIES_PER_TICK, REPLY_MAX, REPORT_MAX, ROTORS, TEXT_MAX, TICK_OFF};
use crate::services::commands::ANSWERS_PER_TICK;
use crate::services::streams::{Requested, id};
use crate::services::telemetry::compose;
use crate::services::texts::{Words, reason, urgency};
use crate::services::{escs, modes};
use afbc::monitor::EstimateNorms;
use afbc_control::math::sqrt;
use afbc_flight_core::Mode;
use afbc_flight_core::tracker::Refused;
use afbc_guidance::{FailsafeCause, GuidanceNotice, ModeReason};
use afbc_mavlink::telemetry::ESCS_PER_MESSAGE;
use afbc_mavlink::{Downlink, MavSeverity, MessageSet, PositionTarget, SIGNED_FRAME_MAX, StatesRefused, Telemetry};
use afbc_onboard::Report;
use afbc_types::PerAxis;

impl Comms {
    /// Sends all messages that are due after a tick, at most [`REPORT_MAX`] bytes, by one call of `send` per frame.
    /// `tick_us` is the duration of the tick.
    pub fn report(&mut self, report: &Report, tick_us: f32, mut send: impl FnMut(&[u8])) {
        self.tick += 1;
        self.tick_us_max = self.tick_us_max.max(tick_us);
        let dropped_frames = self.bad_frames();
        self.now_us = report.time_us;
        self.status.update(report, tick_us);
        self.status.dropped_frames = dropped_frames;
        if let Some(estimate) = report.estimate {
            (self.status.state, self.state_is_news) = (Some(estimate), true);
        }
        self.tick();
        if let Some((axis, norm)) = report.norms {
            self.norms[axis] = norm;
        }
        self.saturated_ticks = report.saturated_ticks;
        self.watch(report);

        self.left = REPORT_MAX;
        let (now_us, armed) = (report.time_us, report.mode.armed());
        if self.streams.rotors() && (self.state_is_news || self.tick.is_multiple_of(ROTORS)) {
            self.state_is_news = false;
            // Rotor commands do not count against the link's rate, which is lower while they are sent.
            self.send(&Downlink::Rotors { time_us: now_us, armed, speeds: report.motors }, &mut send);
        }
        let commands = &mut self.commands;
        let settled = report.answer.and_then(|answer| commands.settle(answer));
        let ordered = report.guided.answer.and_then(|(ticket, result)| commands.settle_order(ticket, result));
        // Answers are sent regardless of the budget: a station repeats an unanswered command, or gives up.
        for answer in settled.into_iter().chain(ordered) {
            self.say(&answer, &mut send);
        }
        for _ in 0..ANSWERS_PER_TICK {
            let Some(answer) = self.commands.next(now_us) else { break };
            self.say(&answer, &mut send);
        }
        while self.streams.has_room()
            && self.left >= TEXT_MAX
            && let Some(text) = self.texts.next()
        {
            self.say(&text, &mut send);
        }
        let (period, phase) = HEARTBEAT;
        if self.tick % period == phase && self.left >= TEXT_MAX {
            let heartbeat = self.heartbeat();
            self.say(&heartbeat, &mut send);
        }
        for _ in 0..REPLIES_PER_TICK {
            if self.streams.has_room()
                && self.left >= REPLY_MAX
                && let Some(reply) = self.next_reply()
            {
                self.say(&reply, &mut send);
            }
        }
        // The size of a message is known only once it is composed, so there must be room for the longest frame.
        while self.left >= SIGNED_FRAME_MAX
            && let Some(requested) = self.streams.next(now_us)
        {
            if let Some(message) = self.compose(requested) {
                self.say(&message, &mut send);
            }
        }
    }

    /// Sends a message and counts it against the link's rate. Returns the length of the frame.
    pub(super) fn say(&mut self, message: &impl MessageSet, send: &mut impl FnMut(&[u8])) -> usize {
        let bytes = self.send(message, send);
        self.streams.spend(bytes);
        bytes
    }

    /// Sends a message. Returns the length of the frame. Not inlined because it has many callers.
    #[inline(never)]
    fn send(&mut self, message: &impl MessageSet, send: &mut impl FnMut(&[u8])) -> usize {
        let mut buffer = [0; SIGNED_FRAME_MAX];
        let frame = self.sender.send_signed(message, self.signing.stamp(self.now_us), &mut buffer);
        send(frame);
        self.left = self.left.saturating_sub(frame.len());
        frame.len()
    }

    /// Queues the texts that announce the events of a tick.
    fn watch(&mut self, report: &Report) {
        let warning = MavSeverity::MAV_SEVERITY_WARNING;
        if let Some(Err(refusal)) = report.answer.map(|answer| answer.result) {
            self.texts.put(warning, refusal.reason());
        }
        if let Some((_, Err(declined))) = report.guided.answer {
            self.texts.put(warning, reason(declined));
        }
        // `Failsafes` announces the flight core's own failsafes, below.
        let descends = |notice: &GuidanceNotice| {
            matches!(notice, GuidanceNotice::Mode(_, ModeReason::Failsafe(FailsafeCause::Descent)))
        };
        for notice in report.guided.notices.iter().filter(|notice| !descends(notice)) {
            let [first, second, third] = notice.parts();
            self.texts.say(urgency(notice.severity()), &Words::of(first).and(second).and(third));
        }
        for (severity, notice) in self.failsafes.watch(report, self.tick) {
            self.texts.put(severity, notice);
        }
        for (severity, notice) in self.ignored.watch(report.ignored, report.guided.airborne, self.tick) {
            self.texts.put(severity, notice);
        }
        let fallback = report.health.control.fallback;
        if let (Some(reason), None) = (fallback, self.fallback) {
            self.texts.put(warning, reason);
        }
        let (rate, before) = (report.health.rate, self.rate);
        self.rate = rate;
        if rate.clock_failed && !before.clock_failed {
            self.texts.put(MavSeverity::MAV_SEVERITY_CRITICAL, CLOCK_FAILED);
        } else if before.healthy() && !rate.healthy() {
            self.texts.put(MavSeverity::MAV_SEVERITY_CRITICAL, TICK_OFF);
        }
        // While the vehicle coasts without a state, no law runs, and none reports a fallback.
        if report.mode != Mode::Coasting {
            self.fallback = fallback;
        }
    }

    /// Composes a telemetry message.
    fn compose(&mut self, requested: Requested) -> Option<Downlink> {
        let status = &self.status;
        match requested.message {
            id::HEARTBEAT => Some(self.heartbeat()),
            id::MISSION_CURRENT => Some(self.mission_current()),
            id::POSITION_TARGET_LOCAL_NED => {
                let setpoint = self.followed()?;
                Some(Downlink::PositionTarget(status.time_ms(), PositionTarget::from(setpoint)))
            }
            id::AVAILABLE_MODES => {
                // Index 0 asks for all modes. Each answer requests the next mode.
                let (place, all) = modes::place(requested.index);
                if all && place < modes::COUNT {
                    let next = Requested { index: modes::all_from(place + 1), ..requested };
                    self.streams.request_first(next);
                }
                modes::available(place).map(Downlink::AvailableMode)
            }
            id::ORBIT_EXECUTION_STATUS => self.orbit_status(),
            id::ESC_INFO => {
                let info = escs::info(status, self.esc_page(requested))?;
                Some(Downlink::Telemetry(Telemetry::EscInfo(info)))
            }
            id::ESC_STATUS => {
                let measured = escs::status(status, self.esc_page(requested))?;
                Some(Downlink::Telemetry(Telemetry::EscStatus(measured)))
            }
            id::DEBUG_FLOAT_ARRAY => Some(Downlink::Health(self.health())),
            id::HIGHRES_IMU => {
                self.sample_is_due = true;
                None
            }
            message => compose(message, status),
        }
    }

    /// Returns the group of four ESCs to report: the one requested, counted from 1, or else each group in turn.
    fn esc_page(&self, requested: Requested) -> u8 {
        let Comms { status, streams, .. } = self;
        // The interval is a divisor, so it must not be 0. The interval of a disabled stream is -1.
        let interval_us = u64::try_from(streams.interval_us(requested.message)).unwrap_or(1).max(1);
        let pages = status.rotors.div_ceil(ESCS_PER_MESSAGE as u8).max(1);
        let page = u64::from(requested.index).checked_sub(1).unwrap_or(status.time_us / interval_us);
        (page % u64::from(pages)) as u8
    }

    fn heartbeat(&self) -> Downlink {
        let status = &self.status;
        let (period, _) = HEARTBEAT;
        let failsafe = self.failsafes.within(period, self.tick);
        Downlink::Heartbeat { armed: status.mode.armed(), failsafe, mode: modes::custom(status.flight_mode()) }
    }

    fn health(&self) -> afbc_mavlink::HealthArray {
        let status = &self.status;
        let norm = |norm: &EstimateNorms| sqrt(norm.theta_squared);
        let Refused { overtaken, late, elsewhere } = *self.tracker.refused();
        let health = &status.health;
        afbc_mavlink::HealthArray {
            time_us: status.time_us,
            tick_us: status.tick_us,
            tick_max_us: self.tick_us_max,
            rate_hz: health.rate.rate_hz.unwrap_or(0) as f32,
            late_ticks: health.rate.off_ticks(),
            saturated_ticks: self.saturated_ticks,
            state_age_us: health.state_age_us as f32,
            theta_norm: PerAxis::from_fn(|axis| norm(&self.norms[axis])),
            delta: PerAxis::from_fn(|axis| self.norms[axis].delta),
            link: self.frames,
            unanswered: self.commands.unanswered(),
            states_refused: StatesRefused { overtaken, late, elsewhere, frozen: health.frozen_states },
        }
    }
}
