//! The vehicle's MAVLink endpoint: receives and sends messages.

mod dispatch;
mod queued;
mod report;

use self::queued::{PARAMETER_TASKS_MAX, ParameterTask, REPLIES_MAX, Reply};
use crate::failsafes::Failsafes;
use crate::ignored::IgnoredAids;
use crate::link_share::LinkShare;
use crate::log_server::LogServer;
use crate::parameters::{Service, VALUE_BYTES};
use crate::services::calibration::{CalibrationState, Calibrator};
use crate::services::commands::Commands;
use crate::services::control::OperatorControl;
use crate::services::fence::FenceWatch;
use crate::services::mission::Missions;
use crate::services::signing::{SetupOutcome, Signing, SigningRecord};
use crate::services::status::{AuxSensors, VehicleStatus};
use crate::services::storage::{FileStore, LogSource, LogStore};
use crate::services::streams::{Streams, id};
use crate::services::texts::Texts;
use crate::services::unanswered::Unanswered;
use crate::setup::Setup;
use crate::transferring::{Outcome, Transferring};
use crate::transfers::Transfers;
use afbc::monitor::EstimateNorms;
use afbc_calibration::RawSample;
use afbc_flight_core::{Tracker, rate};
use afbc_guidance::fence::BrakingLimits;
use afbc_guidance::{BatteryReading, FenceStatus, MotionLimits};
use afbc_mavlink::{
    Address, ChannelsOverride, Counters, Decoder, Downlink, Encoder, InertialSample, MavSeverity, MissionItem, Reboot,
    SIGNED_FRAME_MAX, SetupSigning, Uplink,
};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{Configuration, EscTelemetry};
use afbc_rc::StickCurves;
use afbc_types::PerAxis;
use heapless::Deque;
use nalgebra::{Vector2, Vector3};

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
const KEY_OVER_WIRE: &str = "signing key refused: send it by wire or signed";

/// Text to the pilot when the clock has failed.
pub const CLOCK_FAILED: &str = "crystal failed, on internal clock: land now";
/// Text to the pilot when the control tick's rate or timing is wrong.
pub const TICK_OFF: &str = "control loop rate is wrong: land now";

/// Period of the heartbeat \[ticks\], and the tick of the first one.
const HEARTBEAT: (u64, u64) = (1000, 3);
/// Longest time between rotor commands \[ticks\]. If they are sent, one follows each new state.
const ROTORS: u64 = 10;

/// Receives and sends the vehicle's MAVLink messages.
pub struct Comms {
    sender: Encoder,
    signing: Signing,
    /// Counts of all decoders together.
    frames: Counters,
    pub(crate) me: Address,
    /// Start of the last tick \[us\]. Messages that arrive before the next tick get this time stamp.
    pub(crate) now_us: u64,
    pub(crate) status: VehicleStatus,
    pub(crate) commands: Commands,
    pub(crate) control: OperatorControl,
    pub(crate) missions: Missions,
    /// State of the geofence. `braking` has the limits with which stopping paths are computed.
    fence: FenceWatch,
    pub(crate) braking: BrakingLimits,
    /// Radius and height of the cylindrical geofence around home \[m\]; 0 for none.
    pub(crate) cylinder_m: [f32; 2],
    /// Response curves of a station's joystick, and whether a joystick is accepted.
    pub(crate) curves: StickCurves,
    pub(crate) takes_joystick: bool,
    /// True once the settings above have been taken over.
    is_configured: bool,
    /// Channels of RC_CHANNELS_OVERRIDE, until radio control takes them.
    pub(crate) overrides: Option<ChannelsOverride>,
    fence_given: FenceStatus,
    /// Nearest safe place for a return \[m\], the safe place that the guidance knows, and the time of the last search
    /// \[us\].
    safe_m: Option<Vector2<f32>>,
    safe_given_m: Option<Vector2<f32>>,
    safe_us: u64,
    /// Centre and radius of the orbit ordered last \[m\].
    orbit_m: Option<(Vector3<f32>, f32)>,
    pub(crate) streams: Streams,
    pub(crate) texts: Texts,
    unanswered: Unanswered,
    replies: Deque<Reply, REPLIES_MAX>,
    /// Queued parameter requests.
    parameter_tasks: Deque<ParameterTask, PARAMETER_TASKS_MAX>,
    pub(crate) parameters: Service,
    pub(crate) calibration: CalibrationState,
    /// True if the shell supports calibration.
    calibrates: bool,
    /// True if a station has asked for the sensors' self-tests.
    pub(crate) tests: bool,
    /// Item and upload number of the mission item last given to the guidance.
    given: Option<(u16, u16)>,
    /// Mission item reached last.
    reached: Option<u16>,
    /// Last time at which the guidance was told that the station in control was heard \[us\].
    heard_us: Option<u64>,
    /// Time of the last stick input from the radio receiver \[us\].
    pub(crate) radio_us: Option<u64>,
    /// Set if a station has requested the arming checks. True if one of these stations may arm.
    checks: Option<bool>,
    /// Kinds of reboot that the shell supports.
    reboots: &'static [Reboot],
    /// Kind of reboot that a station has requested.
    pub(crate) reboot: Option<Reboot>,
    tracker: Tracker,
    tick: u64,
    tick_us_max: f32,
    saturated_ticks: u32,
    /// True if a state has arrived since the last rotor command.
    state_is_news: bool,
    failsafes: Failsafes,
    ignored: IgnoredAids,
    norms: PerAxis<EstimateNorms>,
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
            sender: Encoder::new(me),
            signing: Signing::default(),
            frames: Counters::default(),
            me,
            now_us: 0,
            status: VehicleStatus::default(),
            commands: Commands::default(),
            control: OperatorControl::default(),
            missions: Missions::default(),
            fence: FenceWatch::default(),
            braking: MotionLimits::DEFAULT.braking(),
            cylinder_m: [0.0; 2],
            curves: StickCurves::DEFAULT,
            takes_joystick: true,
            is_configured: false,
            overrides: None,
            fence_given: FenceStatus::default(),
            safe_m: None,
            safe_given_m: None,
            safe_us: 0,
            orbit_m: None,
            streams: Streams::new(setup.bytes_per_s),
            texts: Texts::default(),
            unanswered: Unanswered::default(),
            replies: Deque::new(),
            parameter_tasks: Deque::new(),
            parameters: Service::default(),
            calibration: CalibrationState::default(),
            calibrates: setup.calibrates,
            tests: false,
            given: None,
            reached: None,
            heard_us: None,
            radio_us: None,
            checks: None,
            reboots: setup.reboots,
            reboot: None,
            tracker: Tracker::default(),
            tick: 0,
            tick_us_max: 0.0,
            saturated_ticks: 0,
            state_is_news: false,
            failsafes: Failsafes::default(),
            ignored: IgnoredAids::default(),
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
        self.status.aux = aux;
    }

    /// Returns the latest telemetry of the motor controllers (ESCs).
    pub fn esc_telemetry(&self) -> &EscTelemetry {
        &self.status.escs
    }

    /// Sends a text of the shell to all stations, as information.
    pub fn inform(&mut self, text: &str) {
        self.texts.put(MavSeverity::MAV_SEVERITY_INFO, text);
    }

    /// Sends a text of the shell to all stations, as a warning.
    pub fn warn(&mut self, text: &str) {
        self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, text);
    }

    /// Returns the reboot that a station has asked the disarmed vehicle for. The shell sends pending bytes first.
    pub fn wants_reboot(&self) -> Option<Reboot> {
        self.reboot
    }

    /// Returns true once after a station has asked the disarmed vehicle for the sensors' self-tests.
    pub fn wants_self_tests(&mut self) -> bool {
        core::mem::take(&mut self.tests)
    }

    /// Returns the uploaded items of the mission and of the geofence.
    pub fn plan(&self) -> [&[MissionItem]; 2] {
        let missions = &self.missions;
        [missions.items(), missions.fence()]
    }

    /// Returns true if [`receive`](Self::receive) has new inputs for the next tick even if no bytes have arrived.
    pub fn has_mail(&self) -> bool {
        self.wanted_leg().is_some() || self.has_fence_news()
    }

    /// Sets or removes the signing key.
    fn set_key(&mut self, setup: &SetupSigning) {
        let Comms { signing, now_us, status, texts, .. } = self;
        match signing.set(*now_us, setup, status.mode.armed()) {
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
        self.signing.record(self.now_us, self.status.mode.armed())
    }

    /// Returns the battery's measurements, for the control tick.
    pub fn battery(&self) -> Option<BatteryReading> {
        self.status.aux.battery.map(|battery| BatteryReading {
            voltage_v: f32::from(battery.voltage_mv) * 1e-3,
            // A negative current means that it is not measured.
            current_a: f32::from(battery.current_ca.max(0)) * 1e-2,
            charge: (battery.remaining_percent >= 0).then(|| f32::from(battery.remaining_percent) * 1e-2),
        })
    }

    /// Returns a decoder for one of the vehicle's streams of bytes. Each stream has its own, because a frame continues
    /// in later bytes of the same stream only. The stream does not count as [wired](Decoder::wired) unless the shell
    /// says so.
    pub fn decoder(&self) -> Decoder<Uplink> {
        Decoder::new(self.me)
    }

    /// Returns the number of frames dropped since power-up, for any reason.
    pub fn bad_frames(&self) -> u32 {
        let c = self.frames;
        [c.bad_checksum, c.unknown, c.malformed, c.implausible, c.unsupported].into_iter().fold(0, u32::saturating_add)
    }

    /// Takes over the settings that this object needs.
    fn configure(&mut self, configuration: &Configuration) {
        // The parameter is COM_DL_LOSS_T. Its range is checked, so the conversion is safe.
        self.control.set_silence((configuration.guidance.failsafe.station_lost_s * 1e6) as u64);
        let afbc_guidance::Settings { limits, failsafe, .. } = &configuration.guidance;
        self.braking = limits.braking();
        self.cylinder_m = [failsafe.fence_radius_m, failsafe.fence_height_m];
        let radio = &configuration.radio;
        (self.curves, self.takes_joystick) = (radio.curves, radio.receiver.takes_joystick());
        self.is_configured = true;
    }

    /// Handles the stations' parameter requests. To be called after each [`report`](Self::report). Sends values by one
    /// call of `send` per frame; `report` and this function together send at most [`REPORT_MAX`] bytes. Returns the
    /// change of `table`, which is to be flown ([`Flight::adopt`](afbc_onboard::Flight::adopt)) and stored
    /// ([`Kept::keep`](afbc_onboard::parameters::Kept::keep)). Nothing changes while the vehicle is armed.
    pub fn parameters(&mut self, table: &mut ParameterTable, mut send: impl FnMut(&[u8])) -> Option<RecordChange> {
        let change = self.grant(table);
        if change.is_some() || !self.is_configured {
            self.configure(table.configuration());
        }
        while self.left >= VALUE_BYTES as usize + SIGNATURE
            && let Comms { parameters, streams, now_us, .. } = &mut *self
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
        self.status.has_files = true;
        self.go_on(&mut (transfers, store), send);
    }

    /// Does the same as [`transfer`](Self::transfer) for a vehicle that stores logs but no other files.
    #[inline(never)]
    pub fn transfer_logs(&mut self, server: &mut LogServer, store: &mut dyn LogStore, send: &mut dyn FnMut(&[u8])) {
        self.go_on(&mut (server, store), send);
    }

    fn go_on(&mut self, transfers: &mut impl Transferring, mut send: impl FnMut(&[u8])) {
        let (now_us, armed) = (self.now_us, self.status.mode.armed());
        self.share.tick(self.streams.bytes_per_s());
        while self.left >= SIGNED_FRAME_MAX
            && (self.share.has_room() || self.streams.spares(transfers.frame_max()))
            && let Some(outcome) = transfers.next(now_us, armed)
        {
            let texts = &mut self.texts;
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
        let Comms { calibration, streams, .. } = self;
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
        self.advance_calibration(calibrator, sample, table);
        if let Some(sample) = sample
            && self.sample_is_due
            && self.left >= SAMPLE_MAX
        {
            self.sample_is_due = false;
            self.say(&corrected(&sample, table.configuration()), &mut send);
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
