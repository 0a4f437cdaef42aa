//! Arming and failsafes: requests, the four modes and their transitions.

pub use crate::refusal::Refusal;

use crate::reasons::Reasons;
use afbc_control::math::abs_max;
use afbc_types::{Setpoint, State, parameters};

/// Age above which a state is stale, so that the law must not fly on it \[us\].
pub const COAST_US: u32 = 20_000;
/// Time for which states must be fresh to end coasting \[us\], so that the mode does not flicker.
pub const STEADY_US: u32 = 100_000;
/// Age of the state at which coasting ends and the vehicle descends \[us\].
pub const DESCEND_US: u32 = 250_000;
/// Time for which states must be fresh to end a descent \[us\]. A tracker that recovers only for moments must not make
/// the vehicle descend and climb repeatedly.
pub const RESUME_US: u32 = 1_000_000;
/// Age of the attitude at which the motors stop \[us\]: after two seconds of blind descent.
pub const GIVE_UP_US: u32 = 2_250_000;
/// Age of the setpoint above which the vehicle holds its position instead \[us\].
pub const SETPOINT_STALE_US: u32 = 500_000;
/// Time at rest required for arming \[us\].
pub const REST_US: u32 = 1_000_000;

/// Mode of the flight core.
///
/// ```text
///              Arm, and ready                age > 20 ms
///  +----------+              +----------+ --------------> +----------+
///  | Disarmed | -----------> |  Flying  |                 |  Coasting  |
///  +----------+              +----------+ <-------------- +----------+
///    ^      ^                     |     fresh for 100 ms       |
///    |      |                     | age > 250 ms               | age > 250 ms
///    |      |                     v                            |
///    |      |               +------------+                     |
///    |      +---------------| Descending | <-------------------+
///    |    on the ground     +------------+ --> Flying, fresh for 1 s
///    |
///    +--- Kill, tumbled, or attitude's age > 2.25 s, from anywhere; Disarm, from anywhere on the ground
/// ```
///
/// `age` is the age of the newest plausible state. The mode at power-up is Disarmed. In Coasting and Descending the law
/// flies while the state is fresh. A vehicle that knows its attitude but not its position is held level and descends
/// without drifting on purpose ([`crate::descent`]), for as long as it takes. Otherwise it is flown blind
/// ([`crate::dead_reckoning`]).
///
/// If states return during a descent, the law flies the descent with them ([`crate::descent`]). Once they have been
/// fresh for [`RESUME_US`] and show the vehicle moving, the setpoint is flown again. The wait keeps a tracker that
/// recovers only for moments from making the vehicle descend and climb repeatedly. A vehicle that stands on the ground
/// has landed.
///
/// The numbers are part of the link's protocol.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Mode {
    /// Motors off.
    #[default]
    Disarmed = 0,
    /// The law flies on fresh states.
    Flying = 1,
    /// The state is stale, or was a moment ago.
    Coasting = 2,
    /// Descending to land and disarm.
    Descending = 3,
}

/// A request from the commander.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Request {
    /// Start the motors: they idle for one tick, then the law flies.
    Arm,
    /// Stop the motors of a vehicle on the ground.
    Disarm,
    /// Stop the motors immediately, even in flight. Takes precedence over other requests.
    Kill,
    /// Return from the fallback law to the controller's own law: the rotors hold for one tick, then that law flies.
    Engage,
}

/// Reason for the end of a flight. The numbers are part of the link's protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum EndReason {
    /// [`Request::Disarm`] on the ground.
    Disarmed = 1,
    /// [`Request::Kill`].
    Killed = 2,
    /// The descent reached the ground.
    Landed = 3,
    /// No state and no attitude for 2.25 s.
    StateLost = 4,
    /// Upside down or spinning without recovery ([`crate::tumble`]).
    Tumbled = 5,
}

parameters! {
    /// Limits of setpoint distance, tilt and motion for arming. Not in the paper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct ArmingLimits {
        /// Largest roll, and largest pitch: 15 degrees.
        #[parameter(TILT_MAX, "rad", 0.01..=0.8)]
        pub tilt_max_rad: f32 = 0.26,
        /// Largest distance between setpoint and position.
        #[parameter(DIST_MAX, "m", 0.01..=100.0)]
        pub setpoint_distance_max_m: f32 = 2.0,
        /// Largest speed of a vehicle at rest.
        #[parameter(SPEED_MAX, "m/s", 0.01..=2000.0)]
        pub speed_max_m_s: f32 = 0.5,
        /// Largest angular rate of a vehicle at rest, about any axis.
        #[parameter(RATE_MAX, "rad/s", 0.01..=2000.0)]
        pub rate_max_rad_s: f32 = 0.5,
    }
}

impl ArmingLimits {
    /// No limits beyond those of plausible values, for a simulated vehicle that is held until it flies.
    pub const NONE: Self = ArmingLimits {
        tilt_max_rad: Self::TILT_MAX.range.max as f32,
        setpoint_distance_max_m: Self::DIST_MAX.range.max as f32,
        speed_max_m_s: Self::SPEED_MAX.range.max as f32,
        rate_max_rad_s: Self::RATE_MAX.range.max as f32,
    };

    /// True if a vehicle in this state neither moves nor rotates.
    pub fn at_rest(&self, state: &State) -> bool {
        state.velocity_m_s.norm_squared() <= self.speed_max_m_s * self.speed_max_m_s
            && abs_max(&state.rates_rad_s) <= self.rate_max_rad_s
    }

    /// Returns all reasons against arming a disarmed vehicle. Without a state, leaves out the checks that need one.
    pub fn against(&self, vehicle: &ArmingInputs<'_>) -> Reasons {
        let mut reasons = vehicle.inhibited;
        match vehicle.state {
            Some(state) => {
                let tilt =
                    state.attitude_rad.x.abs() > self.tilt_max_rad || state.attitude_rad.y.abs() > self.tilt_max_rad;
                reasons.note(tilt, Refusal::TiltTooLarge);
                let distance_max = self.setpoint_distance_max_m;
                let far = vehicle.setpoint.is_some_and(|setpoint| {
                    (setpoint.position_m - state.position_m).norm_squared() > distance_max * distance_max
                });
                reasons.note(far, Refusal::SetpointTooFar);
            }
            // The quantity that the estimator lacks is the cause of the missing state, and tells more.
            None => reasons.note(true, vehicle.missing.unwrap_or(Refusal::StateStale)),
        }
        reasons.note(vehicle.setpoint.is_none(), Refusal::SetpointMissing);
        reasons.note(!vehicle.healthy, Refusal::Unhealthy);
        reasons.note(vehicle.rest_us < REST_US, Refusal::NotAtRest);
        reasons
    }
}

/// State of a vehicle that is to be armed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmingInputs<'a> {
    /// State, if plausible and fresh.
    pub state: Option<&'a State>,
    /// Quantity that the vehicle's own estimator lacks, if any.
    pub missing: Option<Refusal>,
    /// Setpoint, if plausible and fresh.
    pub setpoint: Option<&'a Setpoint>,
    /// True if the control tick's rate is healthy.
    pub healthy: bool,
    /// Time for which the vehicle has been [at rest](ArmingLimits::at_rest) \[us\].
    pub rest_us: u32,
    /// Reasons found outside the flight core, from [`Inbox::inhibit`](crate::Inbox::inhibit).
    pub inhibited: Reasons,
}

/// Inputs of the supervisor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SupervisorInputs {
    /// Request to answer in this tick.
    pub request: Option<Request>,
    /// True if any queued request is [`Request::Kill`].
    pub kill: bool,
    /// Verdict of [`ArmingLimits::against`].
    pub ready: Result<(), Refusal>,
    /// Age of the newest plausible state \[us\]; `u32::MAX` if there is none.
    pub state_age_us: u32,
    /// Age of the newest attitude \[us\]. Less than the state's if the vehicle knows its attitude but not its position.
    pub attitude_age_us: u32,
    /// Time for which no state has been stale \[us\].
    pub steady_us: u32,
    /// False if the vehicle is on the ground ([`crate::landing`]).
    pub airborne: bool,
    /// True if the vehicle does not move. It may be on the ground, even if the landing is not yet detected.
    pub stands: bool,
    /// True if the vehicle is upside down or spinning without recovery ([`crate::tumble`]).
    pub tumbled: bool,
}

impl Mode {
    /// True if the motors may turn.
    pub const fn armed(self) -> bool {
        !matches!(self, Mode::Disarmed)
    }

    /// Returns the reason for the end of the flight, if it ends, by the diagram of [`Mode`].
    pub fn end(self, observed: &SupervisorInputs) -> Option<EndReason> {
        match self {
            Mode::Disarmed => None,
            _ if observed.kill => Some(EndReason::Killed),
            _ if observed.request == Some(Request::Disarm) && !observed.airborne => Some(EndReason::Disarmed),
            _ if observed.tumbled => Some(EndReason::Tumbled),
            _ if observed.attitude_age_us > GIVE_UP_US => Some(EndReason::StateLost),
            Mode::Descending if !observed.airborne => Some(EndReason::Landed),
            _ => None,
        }
    }

    /// Returns the next mode, by the diagram of [`Mode`].
    #[must_use]
    pub fn next(self, observed: &SupervisorInputs) -> Mode {
        if self.end(observed).is_some() { Mode::Disarmed } else { self.onward(observed) }
    }

    /// Returns the next mode, assuming that the flight does not end.
    pub(crate) fn onward(self, observed: &SupervisorInputs) -> Mode {
        let age_us = observed.state_age_us;
        match self {
            Mode::Disarmed if observed.request == Some(Request::Arm) && self.answer(Request::Arm, observed).is_ok() => {
                Mode::Flying
            }
            Mode::Disarmed => Mode::Disarmed,
            Mode::Descending if age_us > COAST_US || observed.steady_us < RESUME_US || observed.stands => {
                Mode::Descending
            }
            _ if age_us > DESCEND_US => Mode::Descending,
            _ if age_us > COAST_US => Mode::Coasting,
            Mode::Coasting if observed.steady_us < STEADY_US => Mode::Coasting,
            _ => Mode::Flying,
        }
    }

    /// Returns the answer to `request` in this mode.
    ///
    /// # Errors
    /// The reason for refusing the request.
    pub fn answer(self, request: Request, observed: &SupervisorInputs) -> Result<(), Refusal> {
        match request {
            Request::Kill => Ok(()),
            _ if observed.kill => Err(Refusal::Overtaken),
            Request::Arm if self.armed() => Err(Refusal::AlreadyArmed),
            Request::Arm => observed.ready,
            Request::Disarm if self.armed() && observed.airborne => Err(Refusal::InFlight),
            // The request is accepted for a disarmed vehicle, too, since a station repeats a command whose answer was
            // lost.
            Request::Disarm => Ok(()),
            Request::Engage if !self.armed() => Err(Refusal::NotArmed),
            Request::Engage => Ok(()),
        }
    }
}
