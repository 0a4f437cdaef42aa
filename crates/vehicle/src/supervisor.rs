//! Arming and failsafe.

use airframe::{OutOfRange, Range, Setpoint, State};

/// Older than this, a state is stale and the law may not fly on it \[us\].
pub const RIDE_US: u64 = 20_000;
/// Older than this, riding on ends and the vehicle comes down \[us\].
pub const DESCEND_US: u64 = 250_000;
/// Older than this, the attitude is anyone's guess and the motors stop \[us\]: two seconds of blind descent.
pub const GIVE_UP_US: u64 = 2_250_000;
/// Older than this, a setpoint no longer counts: the vehicle holds its position \[us\].
pub const SETPOINT_STALE_US: u64 = 500_000;

/// What the vehicle is doing.
///
/// ```text
///              Arm, and ready                age > 20 ms
///  +----------+              +----------+ --------------> +----------+
///  | Disarmed | -----------> |  Flying  |                 |  Riding  |
///  +----------+              +----------+ <-------------- +----------+
///    ^      ^                     |          age <= 20 ms      |
///    |      |                     | age > 250 ms               | age > 250 ms
///    |      |                     v                            |
///    |      |               +------------+                     |
///    |      +---------------| Descending | <-------------------+
///    |    on the ground, or +------------+
///    |    age > 2.25 s
///    |
///    +--- Disarm, from anywhere; age > 2.25 s, from anywhere
/// ```
///
/// `age` is that of the newest plausible state. Disarmed at power-up.
///
/// Descending does not lead back to Flying. The attitude has been unknown for a quarter of a second: whatever comes
/// back may be a tracker that recovers for a moment, and a vehicle that goes up and down with it is worse than one that
/// comes down. A state that does come back is used, to come down under control ([`crate::descent`]).
///
/// The numbers go over the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Motors off.
    #[default]
    Disarmed = 0,
    /// The law flies on fresh states.
    Flying = 1,
    /// The state is stale: the last attitude is held ([`crate::blind`]).
    Riding = 2,
    /// Coming down, to disarm.
    Descending = 3,
}

/// What the commander asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Request {
    /// Start the motors: they idle for a tick, from the next one on the law flies.
    Arm,
    /// Stop the motors, now, wherever the vehicle is.
    Disarm,
    /// Give the flight back to the controller, if it has fallen back on another law: the rotors stay as they are for a
    /// tick, from the next one on it flies.
    Engage,
}

/// Why arming is refused: the first reason that applies, in this order. The numbers go over the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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
    /// The control tick's rate is not known to be within 997 to 1003 Hz.
    Unhealthy = 6,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Refusal; 6] = [
        Refusal::AlreadyArmed,
        Refusal::StateStale,
        Refusal::TiltTooLarge,
        Refusal::SetpointMissing,
        Refusal::SetpointTooFar,
        Refusal::Unhealthy,
    ];

    /// The reason in words, at most 50 characters.
    pub const fn reason(self) -> &'static str {
        match self {
            Refusal::AlreadyArmed => "arming refused: already armed",
            Refusal::StateStale => "arming refused: no fresh state",
            Refusal::TiltTooLarge => "arming refused: tilt too large",
            Refusal::SetpointMissing => "arming refused: no fresh setpoint",
            Refusal::SetpointTooFar => "arming refused: setpoint too far away",
            Refusal::Unhealthy => "arming refused: tick rate not 997 to 1003 Hz",
        }
    }
}

/// How far from its setpoint and how tilted a vehicle may be when it is armed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmingLimits {
    /// Largest roll and largest pitch, each \[rad\].
    pub tilt_max_rad: f32,
    /// Largest distance between setpoint and position \[m\].
    pub setpoint_distance_max_m: f32,
}

/// Accepted [`ArmingLimits::tilt_max_rad`].
pub const TILT_MAX: Range = Range::new("tilt_max_rad", 0.01, 0.8);
/// Accepted [`ArmingLimits::setpoint_distance_max_m`].
pub const SETPOINT_DISTANCE_MAX: Range = Range::new("setpoint_distance_max_m", 0.01, 100.0);

impl Default for ArmingLimits {
    /// 15 degrees and 2 m. Ours.
    fn default() -> Self {
        ArmingLimits { tilt_max_rad: 0.26, setpoint_distance_max_m: 2.0 }
    }
}

impl ArmingLimits {
    /// Checks both limits.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        TILT_MAX.check(self.tilt_max_rad)?;
        SETPOINT_DISTANCE_MAX.check(self.setpoint_distance_max_m)
    }

    /// Whether a vehicle that is disarmed may be armed: `state` and `setpoint` are there if they are plausible and
    /// fresh.
    ///
    /// # Errors
    /// The first reason against it.
    pub fn ready(&self, state: Option<&State>, setpoint: Option<&Setpoint>, healthy: bool) -> Result<(), Refusal> {
        let state = state.ok_or(Refusal::StateStale)?;
        if state.attitude_rad.x.abs() > self.tilt_max_rad || state.attitude_rad.y.abs() > self.tilt_max_rad {
            return Err(Refusal::TiltTooLarge);
        }
        let setpoint = setpoint.ok_or(Refusal::SetpointMissing)?;
        let distance_max = self.setpoint_distance_max_m;
        if (setpoint.position_m - state.position_m).norm_squared() > distance_max * distance_max {
            return Err(Refusal::SetpointTooFar);
        }
        if healthy { Ok(()) } else { Err(Refusal::Unhealthy) }
    }
}

/// What the supervisor decides from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observed {
    /// What was asked for since the last tick.
    pub request: Option<Request>,
    /// Whether a disarmed vehicle may be armed, [`ArmingLimits::ready`].
    pub ready: Result<(), Refusal>,
    /// Age of the newest plausible state \[us\]; `u64::MAX` if there is none.
    pub state_age_us: u64,
    /// True if the vehicle that descends has touched down.
    pub landed: bool,
}

impl Mode {
    /// True if the motors may turn.
    pub const fn armed(self) -> bool {
        !matches!(self, Mode::Disarmed)
    }

    /// The mode that follows from what is observed, by the diagram above.
    pub fn next(self, observed: &Observed) -> Mode {
        let age_us = observed.state_age_us;
        match (self, observed.request) {
            (_, Some(Request::Disarm)) => Mode::Disarmed,
            (Mode::Disarmed, Some(Request::Arm)) if observed.ready.is_ok() => Mode::Flying,
            (Mode::Disarmed, _) => Mode::Disarmed,
            _ if age_us > GIVE_UP_US => Mode::Disarmed,
            (Mode::Descending, _) if observed.landed => Mode::Disarmed,
            (Mode::Descending, _) => Mode::Descending,
            _ if age_us > DESCEND_US => Mode::Descending,
            _ if age_us > RIDE_US => Mode::Riding,
            _ => Mode::Flying,
        }
    }

    /// The answer to `request` in this mode: done, or refused and why.
    ///
    /// # Errors
    /// Arming refused.
    pub fn answer(self, request: Request, ready: Result<(), Refusal>) -> Result<Request, Refusal> {
        match request {
            Request::Disarm | Request::Engage => Ok(request),
            Request::Arm if self.armed() => Err(Refusal::AlreadyArmed),
            Request::Arm => ready.map(|()| request),
        }
    }
}
