//! Arming and failsafe: the five things that may be asked for, the four modes, and what leads from one to another.

use afbc_control::math::abs_max;
use afbc_types::{Setpoint, State, parameters};

/// Older than this, a state is stale and the law may not fly on it \[us\].
pub const COAST_US: u64 = 20_000;
/// Coasting ends once states have been fresh for this long \[us\]: a tracker that stutters does not make the mode flicker.
pub const STEADY_US: u64 = 100_000;
/// Older than this, coasting ends and the vehicle comes down \[us\].
pub const DESCEND_US: u64 = 250_000;
/// Older than this, the attitude is anyone's guess and the motors stop \[us\]: two seconds of blind descent.
pub const GIVE_UP_US: u64 = 2_250_000;
/// Older than this, a setpoint no longer counts: the vehicle holds its position \[us\].
pub const SETPOINT_STALE_US: u64 = 500_000;
/// Arming asks that the vehicle has been at rest for this long \[us\].
pub const REST_US: u64 = 1_000_000;

/// What the vehicle is doing.
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
///    |    on the ground     +------------+
///    |
///    +--- Kill, age > 2.25 s or tumbled, from anywhere; Disarm, from anywhere on the ground
/// ```
///
/// `age` is that of the newest plausible state. Disarmed at power-up. In Coasting and Descending the law flies whenever the
/// state is fresh; without one the vehicle is flown blind ([`crate::blind`]).
///
/// Descending does not lead back to Flying. The attitude has been unknown for a quarter of a second: whatever comes
/// back may be a tracker that recovers for a moment, and a vehicle that goes up and down with it is worse than one that
/// comes down. A state that does come back is used, to come down under control ([`crate::descent`]).
///
/// The numbers go over the wire.
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
    /// Coming down, to disarm.
    Descending = 3,
}

/// What the commander asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Request {
    /// Start the motors: they idle for a tick, from the next one on the law flies.
    Arm,
    /// Stop the motors of a vehicle that is on the ground.
    Disarm,
    /// Stop the motors now, wherever the vehicle is, before any other request.
    Kill,
    /// Give the flight back to the controller, if it has fallen back on another law: the rotors stay as they are for a
    /// tick, from the next one on it flies.
    Engage,
}

/// Why a request is refused; for arming, the first reason that applies, in this order. The numbers go over the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Refusal {
    /// It is armed.
    AlreadyArmed = 1,
    /// No plausible state for 20 ms, or never.
    StateStale = 2,
    /// Roll or pitch above [`ArmingLimits::tilt_max_rad`].
    TiltTooLarge = 3,
    /// No plausible setpoint for 500 ms, or never.
    SetpointMissing = 4,
    /// The setpoint is farther from the vehicle than [`ArmingLimits::setpoint_distance_max_m`].
    SetpointTooFar = 5,
    /// The control tick is not known to keep its rate and its time ([`crate::rate`]), or its clock has failed.
    Unhealthy = 6,
    /// Within the last second it moved faster than [`ArmingLimits::speed_max_m_s`] or turned faster than
    /// [`ArmingLimits::rate_max_rad_s`], or no state told.
    NotAtRest = 7,
    /// It is in flight, and only [`Request::Kill`] stops the motors there.
    InFlight = 8,
    /// It is not armed.
    NotArmed = 9,
    /// A request to stop the motors came after it.
    Overtaken = 10,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Refusal; 10] = [
        Refusal::AlreadyArmed,
        Refusal::StateStale,
        Refusal::TiltTooLarge,
        Refusal::SetpointMissing,
        Refusal::SetpointTooFar,
        Refusal::Unhealthy,
        Refusal::NotAtRest,
        Refusal::InFlight,
        Refusal::NotArmed,
        Refusal::Overtaken,
    ];

    /// The reason in words, at most 50 characters.
    pub const fn reason(self) -> &'static str {
        match self {
            Refusal::AlreadyArmed => "arming refused: already armed",
            Refusal::StateStale => "arming refused: no fresh state",
            Refusal::TiltTooLarge => "arming refused: tilt too large",
            Refusal::SetpointMissing => "arming refused: no fresh setpoint",
            Refusal::SetpointTooFar => "arming refused: setpoint too far away",
            Refusal::Unhealthy => "arming refused: tick off its 1000 Hz, or clock bad",
            Refusal::NotAtRest => "arming refused: not at rest for a second",
            Refusal::InFlight => "disarming refused: in flight; force it to stop",
            Refusal::NotArmed => "refused: not armed",
            Refusal::Overtaken => "refused: motors were stopped meanwhile",
        }
    }
}

/// Why a flight ended. The numbers go over the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum End {
    /// [`Request::Disarm`] on the ground.
    Disarmed = 1,
    /// [`Request::Kill`].
    Killed = 2,
    /// The descent reached the ground.
    Landed = 3,
    /// No state for too long.
    StateLost = 4,
    /// Upside down or spinning, beyond recovery ([`crate::tumble`]).
    Tumbled = 5,
}

parameters! {
    /// How far from its setpoint, how tilted and how restless a vehicle may be when it is armed. Not in the paper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ArmingLimits {
        /// Largest roll and largest pitch, each: 15 degrees.
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
    /// No limit but that of what is plausible, for a simulated vehicle that is held until it flies.
    pub const NONE: Self = ArmingLimits {
        tilt_max_rad: Self::TILT_MAX.range.max as f32,
        setpoint_distance_max_m: Self::DIST_MAX.range.max as f32,
        speed_max_m_s: Self::SPEED_MAX.range.max as f32,
        rate_max_rad_s: Self::RATE_MAX.range.max as f32,
    };

    /// True if a vehicle in this state neither moves nor turns.
    pub fn at_rest(&self, state: &State) -> bool {
        state.velocity_m_s.norm_squared() <= self.speed_max_m_s * self.speed_max_m_s
            && abs_max(&state.rates_rad_s) <= self.rate_max_rad_s
    }

    /// Whether a vehicle that is disarmed may be armed.
    ///
    /// # Errors
    /// The first reason against it.
    pub fn ready(&self, vehicle: &Standing) -> Result<(), Refusal> {
        let state = vehicle.state.ok_or(Refusal::StateStale)?;
        if state.attitude_rad.x.abs() > self.tilt_max_rad || state.attitude_rad.y.abs() > self.tilt_max_rad {
            return Err(Refusal::TiltTooLarge);
        }
        let setpoint = vehicle.setpoint.ok_or(Refusal::SetpointMissing)?;
        let distance_max = self.setpoint_distance_max_m;
        if (setpoint.position_m - state.position_m).norm_squared() > distance_max * distance_max {
            return Err(Refusal::SetpointTooFar);
        }
        if !vehicle.healthy {
            return Err(Refusal::Unhealthy);
        }
        if vehicle.rest_us >= REST_US { Ok(()) } else { Err(Refusal::NotAtRest) }
    }
}

/// A vehicle that may be armed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing<'a> {
    /// Its state, if that is plausible and fresh.
    pub state: Option<&'a State>,
    /// Its setpoint, if that is plausible and fresh.
    pub setpoint: Option<&'a Setpoint>,
    /// True if the control tick runs at its rate.
    pub healthy: bool,
    /// For how long it has been [at rest](ArmingLimits::at_rest) \[us\].
    pub rest_us: u64,
}

/// What the supervisor decides from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observed {
    /// The request whose turn it is.
    pub request: Option<Request>,
    /// True if one that waits is [`Request::Kill`].
    pub kill: bool,
    /// Whether a disarmed vehicle may be armed, [`ArmingLimits::ready`].
    pub ready: Result<(), Refusal>,
    /// Age of the newest plausible state \[us\]; `u64::MAX` if there is none.
    pub state_age_us: u64,
    /// For how long no state has been stale \[us\].
    pub steady_us: u64,
    /// False if the vehicle is on the ground ([`crate::landing`]).
    pub airborne: bool,
    /// True if it is upside down or spinning, beyond recovery ([`crate::tumble`]).
    pub tumbled: bool,
}

impl Mode {
    /// True if the motors may turn.
    pub const fn armed(self) -> bool {
        !matches!(self, Mode::Disarmed)
    }

    /// Why the flight ends, if it does, by the diagram above.
    pub fn end(self, observed: &Observed) -> Option<End> {
        match self {
            Mode::Disarmed => None,
            _ if observed.kill => Some(End::Killed),
            _ if observed.request == Some(Request::Disarm) && !observed.airborne => Some(End::Disarmed),
            _ if observed.tumbled => Some(End::Tumbled),
            _ if observed.state_age_us > GIVE_UP_US => Some(End::StateLost),
            Mode::Descending if !observed.airborne => Some(End::Landed),
            _ => None,
        }
    }

    /// The mode that follows from what is observed, by the diagram above.
    #[must_use]
    pub fn next(self, observed: &Observed) -> Mode {
        let age_us = observed.state_age_us;
        match self {
            Mode::Disarmed if self.answer(Request::Arm, observed).is_ok() && observed.request == Some(Request::Arm) => {
                Mode::Flying
            }
            Mode::Disarmed => Mode::Disarmed,
            _ if self.end(observed).is_some() => Mode::Disarmed,
            Mode::Descending => Mode::Descending,
            _ if age_us > DESCEND_US => Mode::Descending,
            _ if age_us > COAST_US => Mode::Coasting,
            Mode::Coasting if observed.steady_us < STEADY_US => Mode::Coasting,
            _ => Mode::Flying,
        }
    }

    /// The answer to `request` in this mode: done, or refused and why.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn answer(self, request: Request, observed: &Observed) -> Result<(), Refusal> {
        match request {
            Request::Kill => Ok(()),
            _ if observed.kill => Err(Refusal::Overtaken),
            Request::Arm if self.armed() => Err(Refusal::AlreadyArmed),
            Request::Arm => observed.ready,
            Request::Disarm if self.armed() && observed.airborne => Err(Refusal::InFlight),
            Request::Disarm => Ok(()),
            Request::Engage if !self.armed() => Err(Refusal::NotArmed),
            Request::Engage => Ok(()),
        }
    }
}
