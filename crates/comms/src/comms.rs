//! The vehicle's MAVLink endpoint: receives and sends messages.

use crate::dispatcher::Dispatcher;
use crate::failsafes::Failsafes;
use crate::link_share::LinkShare;
use crate::log_server::LogServer;
use crate::parameters::VALUE_BYTES;
use crate::services::calibration::Calibrator;
use crate::services::commands::ANSWERS_PER_TICK;
use crate::services::escs;
use crate::services::modes;
use crate::services::signing::{SetupOutcome, Signing, SigningRecord};
use crate::services::status::AuxSensors;
use crate::services::storage::{FileStore, LogSource, LogStore};
use crate::services::streams::{Requested, id};
use crate::services::telemetry::compose;
use crate::services::texts::{Words, reason, urgency};
use crate::setup::Setup;
use crate::transferring::{Outcome, TransferRequests, Transferring};
use crate::transfers::Transfers;
use afbc::monitor::Norm;
use afbc_calibration::RawSample;
use afbc_control::math::sqrt;
use afbc_flight_core::rate;
use afbc_flight_core::supervisor::COAST_US;
use afbc_flight_core::tracker::{POSE_AGE_MAX_US, Refused, Sighting};
use afbc_flight_core::{Mode, Stamped, Tracker};
use afbc_guidance::{BatteryReading, Cause, ModeReason, Notice};
use afbc_mavlink::telemetry::ESCS_PER_MESSAGE;
use afbc_mavlink::{
    Address, Decoder, Downlink, InertialSample, MavSeverity, Message, MissionItem, PositionTarget, Reboot,
    ReceivedFrame, SIGNED_FRAME_MAX, Sender, SetupSigning, StatesRefused, Telemetry, Uplink,
};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{Configuration, ControlInputs, EscTelemetry, Report};
use afbc_types::{PerAxis, Pose};

/// MAVLink component number of the vehicle: the autopilot.
const AUTOPILOT: u8 = 1;
/// Largest size of all messages sent after one tick \[bytes\].
pub const REPORT_MAX: usize = 768;
/// Size of a frame's signature \[bytes\], and of a signed frame without its payload.
const SIGNATURE: usize = 13;
const FRAME: usize = 12 + SIGNATURE;
/// Longest frames \[bytes\]: of a STATUSTEXT, and of a reply (the longest is a PARAM_EXT_VALUE).
const TEXT_MAX: usize = FRAME + 54;
const REPLY_MAX: usize = FRAME + 149;
/// Length of a HIGHRES_IMU frame \[bytes\].
const SAMPLE_MAX: usize = FRAME + 62;
/// Replies sent per tick.
const REPLIES_PER_TICK: usize = 2;

/// Warning to a station whose SETUP_SIGNING is refused.
const KEY_OVER_WIRE: &str = "signing key refused: over a wire or signed only";

/// Text to the pilot when the clock has failed.
pub const CLOCK_FAILED: &str = "clock failed, using the internal one: land";
/// Text to the pilot when the control tick's rate or timing is wrong.
pub const TICK_OFF: &str = "control tick rate is wrong: land";

/// Period of the heartbeat \[ticks\], and the tick of the first one.
const HEARTBEAT: (u64, u64) = (1000, 3);
/// Longest time between rotor commands \[ticks\]. If they are sent, one follows each new state.
const ROTORS: u64 = 10;

/// Receives and sends the vehicle's MAVLink messages.
pub struct Comms {
    decoder: Decoder<Uplink>,
    sender: Sender,
    signing: Signing,
    pub(crate) dispatcher: Dispatcher,
    tracker: Tracker,
    tick: u64,
    tick_us_max: f32,
    saturated_ticks: u32,
    /// True if a state has arrived since the last rotor command.
    state_is_news: bool,
    failsafes: Failsafes,
    norms: PerAxis<Norm>,
    fallback: Option<&'static str>,
    rate: rate::RateReport,
    /// Number of bytes that may still be sent after this tick.
    left: usize,
    /// True if HIGHRES_IMU is due. The message is sent with the sensors' next sample.
    sample_is_due: bool,
    share: LinkShare,
}

impl Default for Comms {
    fn default() -> Self {
        Self::new()
    }
}

impl Comms {
    /// Creates an endpoint in the default setup that has received nothing.
    pub fn new() -> Self {
        Self::with(Setup::default())
    }

    /// Creates an endpoint that has received nothing.
    pub fn with(setup: Setup) -> Self {
        let me = Address { system: setup.system, component: AUTOPILOT };
        Comms {
            decoder: Decoder::new(me),
            sender: Sender::new(me),
            signing: Signing::default(),
            dispatcher: Dispatcher::new(me, &setup),
            tracker: Tracker::default(),
            tick: 0,
            tick_us_max: 0.0,
            saturated_ticks: 0,
            state_is_news: false,
            failsafes: Failsafes::default(),
            norms: PerAxis::default(),
            fallback: None,
            rate: rate::RateReport::default(),
            left: 0,
            sample_is_due: false,
            share: LinkShare::NEW,
        }
    }

    /// Sets the data that the control tick does not have: origin, satellite receiver, battery, time of day.
    pub fn set_aux_sensors(&mut self, aux: AuxSensors) {
        self.dispatcher.status.aux = aux;
    }

    /// Returns the latest telemetry of the motor controllers (ESCs).
    pub fn esc_telemetry(&self) -> &EscTelemetry {
        &self.dispatcher.status.escs
    }

    /// Sends a text of the shell to all stations, as information.
    pub fn inform(&mut self, text: &str) {
        self.dispatcher.texts.put(MavSeverity::MAV_SEVERITY_INFO, text);
    }

    /// Sends a text of the shell to all stations, as a warning.
    pub fn warn(&mut self, text: &str) {
        self.dispatcher.texts.put(MavSeverity::MAV_SEVERITY_WARNING, text);
    }

    /// Returns the reboot that a station has asked the disarmed vehicle for. The shell sends pending bytes first.
    pub fn wants_reboot(&self) -> Option<Reboot> {
        self.dispatcher.reboot
    }

    /// Returns true once after a station has asked the disarmed vehicle for the sensors' self-tests.
    pub fn wants_self_tests(&mut self) -> bool {
        core::mem::take(&mut self.dispatcher.tests)
    }

    /// Returns the uploaded items of the mission and of the geofence.
    pub fn plan(&self) -> [&[MissionItem]; 2] {
        let missions = &self.dispatcher.missions;
        [missions.items(), missions.fence()]
    }

    /// Returns true if [`receive`](Self::receive) has new inputs for the next tick even if no bytes have arrived.
    pub fn has_mail(&self) -> bool {
        self.dispatcher.wanted_leg().is_some() || self.dispatcher.has_fence_news()
    }

    /// Processes the next bytes of the stream. Returns new inputs for the control tick, to be
    /// [merged](ControlInputs::merge).
    ///
    /// A vehicle that has no estimator ignores poses, because the control law needs velocities and rates too.
    pub fn receive(&mut self, bytes: &[u8]) -> ControlInputs {
        self.receive_beside(bytes, &mut ())
    }

    /// Does the same as [`receive`](Self::receive) for a vehicle that stores logs but no other files.
    #[inline(never)]
    pub fn receive_with_logs(&mut self, bytes: &[u8], server: &mut LogServer) -> ControlInputs {
        self.receive_beside(bytes, server)
    }

    /// Does the same as [`receive`](Self::receive); `requests` takes the stations' requests for files and logs.
    pub fn receive_beside(&mut self, bytes: &[u8], requests: &mut impl TransferRequests) -> ControlInputs {
        let mut update = ControlInputs::EMPTY;
        let Comms { decoder, dispatcher, tracker, state_is_news, signing, .. } = self;
        let estimates = dispatcher.status.senses;
        let (wired, now_us) = (decoder.is_wired(), dispatcher.now_us);
        let mut setup = None;
        let accept = |frame: &ReceivedFrame<'_>| signing.accepts(now_us, frame, wired);
        decoder.feed_whole(bytes, accept, |from, message, payload| match message {
            Uplink::State { sent_us, state: value, sigmas } => {
                let age_max_us = if estimates { POSE_AGE_MAX_US } else { COAST_US.into() };
                let sighting = Sighting::State(value);
                if let Some(at_us) = tracker.sight(number(from), sent_us, dispatcher.now_us, sighting, age_max_us) {
                    // A control law needs a fresh state. An estimator fuses an old pose at the time of the pose.
                    if dispatcher.now_us - at_us <= COAST_US.into() {
                        update.inbox.put_state(Stamped { value, at_us });
                    }
                    if estimates {
                        update.inbox.put_pose(Stamped { value: Pose::of(&value, sigmas), at_us });
                    }
                    (dispatcher.status.state, *state_is_news) = (Some(value), true);
                }
            }
            Uplink::Pose { sent_us, pose: value } if estimates => {
                let sighting = Sighting::Pose(value);
                if let Some(at_us) = tracker.sight(number(from), sent_us, dispatcher.now_us, sighting, POSE_AGE_MAX_US)
                {
                    update.inbox.put_pose(Stamped { value, at_us });
                }
            }
            // The new key is set after all bytes: the frames beside SETUP_SIGNING are checked with the old key.
            Uplink::Signing(wanted) => setup = Some(wanted),
            other if requests.wants(&other) => dispatcher.hand_to(requests, (from, &other, payload), &mut update),
            other => dispatcher.hear(from, other, &mut update),
        });
        if let Some(setup) = setup {
            self.set_key(&setup);
        }
        let Comms { dispatcher, signing, .. } = self;
        if signing.has_refused() {
            dispatcher.texts.put(MavSeverity::MAV_SEVERITY_WARNING, KEY_OVER_WIRE);
        }
        dispatcher.hand_over(&mut update);
        update.battery = self.battery();
        update
    }

    /// Sets or removes the signing key.
    fn set_key(&mut self, setup: &SetupSigning) {
        let Dispatcher { now_us, status, texts, .. } = &mut self.dispatcher;
        match self.signing.set(*now_us, setup, status.mode.armed()) {
            SetupOutcome::Done(text) => texts.put(MavSeverity::MAV_SEVERITY_INFO, text),
            SetupOutcome::Refused(reason) => texts.put(MavSeverity::MAV_SEVERITY_WARNING, reason),
        }
    }

    /// Sets the signing key and the clock that were restored from storage.
    pub fn set_signing(&mut self, signing: Signing) {
        self.signing = signing;
    }

    /// Returns the state of message signing.
    pub fn signing(&self) -> &Signing {
        &self.signing
    }

    /// Returns the next signing record to be stored. Each record is returned once.
    pub fn signing_record(&mut self) -> Option<SigningRecord> {
        let Dispatcher { now_us, status, .. } = &self.dispatcher;
        self.signing.record(*now_us, status.mode.armed())
    }

    /// Returns the battery's measurements, for the control tick.
    pub fn battery(&self) -> Option<BatteryReading> {
        self.dispatcher.status.aux.battery.map(|battery| BatteryReading {
            voltage_v: f32::from(battery.voltage_mv) * 1e-3,
            // Negative means not measured.
            current_a: f32::from(battery.current_ca.max(0)) * 1e-2,
            charge: (battery.remaining_percent >= 0).then(|| f32::from(battery.remaining_percent) * 1e-2),
        })
    }

    /// Exchanges the decoder. If there are several byte streams, each has a decoder of its own. It is put in before the
    /// bytes of its stream are received, and taken out after them, because a frame continues in later bytes of the same
    /// stream only.
    pub fn exchange(&mut self, decoder: &mut Decoder<Uplink>) {
        core::mem::swap(&mut self.decoder, decoder);
    }

    /// Returns a decoder for a further stream, to be [exchanged](Self::exchange). The stream does not count as
    /// [wired](Decoder::wired) unless the shell says so.
    pub fn decoder(&self) -> Decoder<Uplink> {
        Decoder::new(self.dispatcher.me)
    }

    /// Returns the number of frames dropped since power-up, for any reason.
    pub fn bad_frames(&self) -> u32 {
        let c = self.decoder.counters();
        [c.bad_checksum, c.unknown, c.malformed, c.implausible, c.unsupported].into_iter().fold(0, u32::saturating_add)
    }

    /// Sends all messages that are due after a tick, at most [`REPORT_MAX`] bytes, by one call of `send` per frame.
    /// `tick_us` is the duration of the tick.
    pub fn report(&mut self, report: &Report, tick_us: f32, mut send: impl FnMut(&[u8])) {
        self.tick += 1;
        self.tick_us_max = self.tick_us_max.max(tick_us);
        let dropped_frames = self.bad_frames();
        let dispatcher = &mut self.dispatcher;
        dispatcher.now_us = report.time_us;
        dispatcher.status.update(report, tick_us);
        dispatcher.status.dropped_frames = dropped_frames;
        if let Some(estimate) = report.estimate {
            (dispatcher.status.state, self.state_is_news) = (Some(estimate), true);
        }
        dispatcher.tick();
        if let Some((axis, norm)) = report.norms {
            self.norms[axis] = norm;
        }
        self.saturated_ticks = report.saturated_ticks;
        self.watch(report);

        self.left = REPORT_MAX;
        let (now_us, armed) = (report.time_us, report.mode.armed());
        if self.dispatcher.streams.rotors() && (self.state_is_news || self.tick.is_multiple_of(ROTORS)) {
            self.state_is_news = false;
            // Rotor commands do not count against the link's rate, which is lower while they are sent.
            self.send(&Downlink::Rotors { time_us: now_us, armed, speeds: report.motors }, &mut send);
        }
        let commands = &mut self.dispatcher.commands;
        let settled = report.answer.and_then(|answer| commands.settle(answer));
        let ordered = report.guided.answer.and_then(|(ticket, result)| commands.settle_order(ticket, result));
        // Answers are sent regardless of the budget: a station repeats an unanswered command, or gives up.
        for answer in settled.into_iter().chain(ordered) {
            self.say(&answer, &mut send);
        }
        for _ in 0..ANSWERS_PER_TICK {
            let Some(answer) = self.dispatcher.commands.next(now_us) else { break };
            self.say(&answer, &mut send);
        }
        while self.dispatcher.streams.has_room()
            && self.left >= TEXT_MAX
            && let Some(text) = self.dispatcher.texts.next()
        {
            self.say(&text, &mut send);
        }
        let (period, phase) = HEARTBEAT;
        if self.tick % period == phase && self.left >= TEXT_MAX {
            let heartbeat = self.heartbeat();
            self.say(&heartbeat, &mut send);
        }
        for _ in 0..REPLIES_PER_TICK {
            if self.dispatcher.streams.has_room()
                && self.left >= REPLY_MAX
                && let Some(reply) = self.dispatcher.next_reply()
            {
                self.say(&reply, &mut send);
            }
        }
        // The size of a message is known only once it is composed, so there must be room for the longest frame.
        while self.left >= SIGNED_FRAME_MAX
            && let Some(requested) = self.dispatcher.streams.next(now_us)
        {
            if let Some(message) = self.compose(requested) {
                self.say(&message, &mut send);
            }
        }
    }

    /// Handles the stations' parameter requests. To be called after each [`report`](Self::report). Sends values by one
    /// call of `send` per frame; `report` and this function together send at most [`REPORT_MAX`] bytes. Returns the
    /// change of `table`, which is to be flown ([`Flight::adopt`](afbc_onboard::Flight::adopt)) and stored
    /// ([`Kept::keep`](afbc_onboard::parameters::Kept::keep)). Nothing changes while the vehicle is armed.
    pub fn parameters(&mut self, table: &mut ParameterTable, mut send: impl FnMut(&[u8])) -> Option<RecordChange> {
        let change = self.dispatcher.grant(table);
        // COM_DL_LOSS_T. Its range is checked, so the conversion is safe.
        let silent_us = (table.configuration().guidance.net.station_lost_s * 1e6) as u64;
        self.dispatcher.control.set_silence(silent_us);
        let afbc_guidance::Settings { limits, net, .. } = &table.configuration().guidance;
        self.dispatcher.braking = limits.braking();
        self.dispatcher.cylinder_m = [net.fence_radius_m, net.fence_height_m];
        let radio = &table.configuration().radio;
        (self.dispatcher.curves, self.dispatcher.takes_joystick) = (radio.curves, radio.receiver.takes_joystick());
        while self.left >= VALUE_BYTES as usize + SIGNATURE
            && let Dispatcher { parameters, streams, now_us, .. } = &mut self.dispatcher
            && let Some(value) = parameters.next_value(*now_us, streams.bytes_per_s(), table)
        {
            self.say(&Downlink::Parameter(value), &mut send);
        }
        change
    }

    /// Continues the transfers of files and logs. To be called after everything else that sends. Transfers take the
    /// bandwidth that telemetry and parameters leave, and at least a fifth of the link. All together send at most
    /// [`REPORT_MAX`] bytes.
    pub fn transfer<S: FileStore + LogStore + LogSource>(
        &mut self,
        transfers: &mut Transfers<S::File>,
        store: &mut S,
        send: impl FnMut(&[u8]),
    ) {
        self.dispatcher.status.has_files = true;
        self.go_on(&mut (transfers, store), send);
    }

    /// Does the same as [`transfer`](Self::transfer) for a vehicle that stores logs but no other files.
    #[inline(never)]
    pub fn transfer_logs(&mut self, server: &mut LogServer, store: &mut dyn LogStore, send: &mut dyn FnMut(&[u8])) {
        self.go_on(&mut (server, store), send);
    }

    fn go_on(&mut self, transfers: &mut impl Transferring, mut send: impl FnMut(&[u8])) {
        let (now_us, armed) = (self.dispatcher.now_us, self.dispatcher.status.mode.armed());
        self.share.tick(self.dispatcher.streams.bytes_per_s());
        while self.left >= SIGNED_FRAME_MAX
            && (self.share.has_room() || self.dispatcher.streams.spares(transfers.frame_max()))
            && let Some(outcome) = transfers.next(now_us, armed)
        {
            let texts = &mut self.dispatcher.texts;
            match outcome {
                Outcome::Send(message) => {
                    let bytes = self.say(&message, &mut send);
                    self.share.spend(bytes);
                }
                Outcome::Say(text, true) => texts.put(MavSeverity::MAV_SEVERITY_WARNING, text),
                Outcome::Say(text, false) => texts.put(MavSeverity::MAV_SEVERITY_INFO, text),
            }
        }
    }

    /// Returns true if [`calibrate`](Self::calibrate) needs sensor samples: during a calibration, or while a station
    /// wants HIGHRES_IMU.
    pub fn takes_samples(&self) -> bool {
        let Dispatcher { calibration, streams, .. } = &self.dispatcher;
        calibration.active.is_some() || self.sample_is_due || streams.interval_us(id::HIGHRES_IMU) > 0
    }

    /// Advances the calibration that a station has asked for, and sends HIGHRES_IMU if it is due. To be called after
    /// each [`report`](Self::report) and before [`parameters`](Self::parameters), which sets the parameters that were
    /// found; only in a shell that [has sensors](Setup::calibrates). `sample` is the average of
    /// [`RawReadings`](afbc_onboard::RawReadings), if one has been completed since the last call.
    pub fn calibrate(
        &mut self,
        calibrator: &mut Calibrator,
        sample: Option<RawSample>,
        table: &ParameterTable,
        mut send: impl FnMut(&[u8]),
    ) {
        self.dispatcher.calibrate(calibrator, sample, table);
        if let Some(sample) = sample
            && self.sample_is_due
            && self.left >= SAMPLE_MAX
        {
            self.sample_is_due = false;
            self.say(&corrected(&sample, table.configuration()), &mut send);
        }
    }

    /// Sends a message and counts it against the link's rate. Returns the length of the frame.
    fn say(&mut self, message: &impl Message, send: &mut impl FnMut(&[u8])) -> usize {
        let bytes = self.send(message, send);
        self.dispatcher.streams.spend(bytes);
        bytes
    }

    /// Sends a message. Returns the length of the frame. Not inlined because it has many callers.
    #[inline(never)]
    fn send(&mut self, message: &impl Message, send: &mut impl FnMut(&[u8])) -> usize {
        let mut buffer = [0; SIGNED_FRAME_MAX];
        let frame = self.sender.send_signed(message, self.signing.stamp(self.dispatcher.now_us), &mut buffer);
        send(frame);
        self.left = self.left.saturating_sub(frame.len());
        frame.len()
    }

    /// Queues the texts that announce the events of a tick.
    fn watch(&mut self, report: &Report) {
        let Comms { dispatcher, failsafes, tick, .. } = self;
        let warning = MavSeverity::MAV_SEVERITY_WARNING;
        if let Some(Err(refusal)) = report.answer.map(|answer| answer.result) {
            dispatcher.texts.put(warning, refusal.reason());
        }
        if let Some((_, Err(declined))) = report.guided.answer {
            dispatcher.texts.put(warning, reason(declined));
        }
        // `Failsafes` announces the flight core's own failsafes, below.
        let descends = |notice: &Notice| matches!(notice, Notice::Mode(_, ModeReason::Failsafe(Cause::Descent)));
        for notice in report.guided.notices.iter().filter(|notice| !descends(notice)) {
            let [first, second, third] = notice.parts();
            dispatcher.texts.say(urgency(notice.severity()), &Words::of(first).and(second).and(third));
        }
        for (severity, notice) in failsafes.watch(report, *tick) {
            dispatcher.texts.put(severity, notice);
        }
        let fallback = report.health.control.fallback;
        if let (Some(reason), None) = (fallback, self.fallback) {
            dispatcher.texts.put(warning, reason);
        }
        let (rate, before) = (report.health.rate, self.rate);
        self.rate = rate;
        if rate.clock_failed && !before.clock_failed {
            dispatcher.texts.put(MavSeverity::MAV_SEVERITY_CRITICAL, CLOCK_FAILED);
        } else if before.healthy() && !rate.healthy() {
            dispatcher.texts.put(MavSeverity::MAV_SEVERITY_CRITICAL, TICK_OFF);
        }
        // While the vehicle coasts without a state, no law runs, and none reports a fallback.
        if report.mode != Mode::Coasting {
            self.fallback = fallback;
        }
    }

    /// Composes a telemetry message.
    fn compose(&mut self, requested: Requested) -> Option<Downlink> {
        let status = &self.dispatcher.status;
        match requested.message {
            id::HEARTBEAT => Some(self.heartbeat()),
            id::MISSION_CURRENT => Some(self.dispatcher.mission_current()),
            id::POSITION_TARGET_LOCAL_NED => {
                let setpoint = self.dispatcher.followed()?;
                Some(Downlink::Followed(status.time_ms(), PositionTarget::from(setpoint)))
            }
            id::AVAILABLE_MODES => {
                // Index 0 asks for all modes. Each answer requests the next mode.
                let (place, all) = modes::place(requested.index);
                if all && place < modes::COUNT {
                    let next = Requested { index: modes::all_from(place + 1), ..requested };
                    self.dispatcher.streams.request_first(next);
                }
                modes::available(place).map(Downlink::AvailableMode)
            }
            id::ORBIT_EXECUTION_STATUS => self.dispatcher.orbit_status(),
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
        let Dispatcher { status, streams, .. } = &self.dispatcher;
        // The interval is a divisor, so it must not be 0. The interval of a disabled stream is -1.
        let interval_us = u64::try_from(streams.interval_us(requested.message)).unwrap_or(1).max(1);
        let pages = status.rotors.div_ceil(ESCS_PER_MESSAGE as u8).max(1);
        let page = u64::from(requested.index).checked_sub(1).unwrap_or(status.time_us / interval_us);
        (page % u64::from(pages)) as u8
    }

    fn heartbeat(&self) -> Downlink {
        let status = &self.dispatcher.status;
        let (period, _) = HEARTBEAT;
        let failsafe = self.failsafes.within(period, self.tick);
        Downlink::Heartbeat { armed: status.mode.armed(), failsafe, mode: modes::custom(status.flight_mode()) }
    }

    fn health(&self) -> afbc_mavlink::HealthArray {
        let status = &self.dispatcher.status;
        let norm = |norm: &Norm| sqrt(norm.theta_squared);
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
            link: *self.decoder.counters(),
            unanswered: self.dispatcher.commands.unanswered(),
            states_refused: StatesRefused { overtaken, late, elsewhere, frozen: health.frozen_states },
        }
    }
}

/// Returns a sample of the IMU with its calibration applied, in the body frame.
fn corrected(sample: &RawSample, configuration: &Configuration) -> InertialSample {
    let Configuration { imu, calibration, .. } = configuration;
    let r_body_sensor = imu.r_body_sensor();
    InertialSample {
        time_us: sample.at_us,
        specific_force_m_s2: r_body_sensor * calibration.specific_force(&sample.specific_force_m_s2),
        rates_rad_s: r_body_sensor * (sample.rates_rad_s - calibration.gyro_offset_rad_s),
        field_ut: sample.field_ut.map(|field_ut| calibration.field(&field_ut)),
    }
}

/// Returns the number by which the [`Tracker`] tells senders apart.
fn number(from: Address) -> u16 {
    u16::from_be_bytes([from.system, from.component])
}
