//! Reasons for refusing a request.

/// Reason for refusing a request. For arming, the first that applies in the order of [`Refusal::ARMING`]. The numbers
/// are part of the link's protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Refusal {
    /// The vehicle is armed.
    AlreadyArmed = 1,
    /// No plausible state within the last 20 ms.
    StateStale = 2,
    /// Roll or pitch above [`ArmingLimits::tilt_max_rad`](crate::ArmingLimits::tilt_max_rad).
    TiltTooLarge = 3,
    /// No plausible setpoint within the last 500 ms.
    SetpointMissing = 4,
    /// The setpoint is farther away than
    /// [`ArmingLimits::setpoint_distance_max_m`](crate::ArmingLimits::setpoint_distance_max_m).
    SetpointTooFar = 5,
    /// The control tick's rate or timing is wrong or unknown ([`crate::rate`]), or its clock has failed.
    Unhealthy = 6,
    /// Within the last second, speed or rate exceeded
    /// [`ArmingLimits::speed_max_m_s`](crate::ArmingLimits::speed_max_m_s) or
    /// [`ArmingLimits::rate_max_rad_s`](crate::ArmingLimits::rate_max_rad_s), or there was no state.
    NotAtRest = 7,
    /// The vehicle is in flight, where only [`Request::Kill`](crate::Request::Kill) stops the motors.
    InFlight = 8,
    /// The vehicle is not armed.
    NotArmed = 9,
    /// A later request in the queue stops the motors.
    Overtaken = 10,
    /// The vehicle's own estimator has no attitude: no samples, or the vehicle is being moved.
    AttitudeUnknown = 11,
    /// The vehicle's own estimator has no heading.
    HeadingUnknown = 12,
    /// The vehicle's own estimator has no position.
    PositionUnknown = 13,
    /// The battery is low, or monitored but unknown.
    BatteryLow = 14,
    /// A sensor has failed.
    SensorFailed = 15,
    /// The vehicle is outside its geofence.
    OutsideFence = 16,
    /// The flight mode does not allow arming.
    WrongMode = 17,
}

impl Refusal {
    /// All reasons.
    pub const ALL: [Refusal; 17] = [
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
        Refusal::AttitudeUnknown,
        Refusal::HeadingUnknown,
        Refusal::PositionUnknown,
        Refusal::BatteryLow,
        Refusal::SensorFailed,
        Refusal::OutsideFence,
        Refusal::WrongMode,
    ];

    /// Reasons against arming in order of precedence: unknown quantities, then the flight core's checks, then those
    /// [from outside](crate::Inbox::inhibit).
    pub const ARMING: [Refusal; 14] = [
        Refusal::AlreadyArmed,
        Refusal::AttitudeUnknown,
        Refusal::HeadingUnknown,
        Refusal::PositionUnknown,
        Refusal::StateStale,
        Refusal::TiltTooLarge,
        Refusal::SetpointMissing,
        Refusal::SetpointTooFar,
        Refusal::Unhealthy,
        Refusal::NotAtRest,
        Refusal::BatteryLow,
        Refusal::SensorFailed,
        Refusal::OutsideFence,
        Refusal::WrongMode,
    ];

    /// Returns the reason as text of at most 50 characters.
    pub const fn reason(self) -> &'static str {
        match self {
            Refusal::AlreadyArmed => "arming refused: already armed",
            Refusal::StateStale => "arming refused: no fresh state",
            Refusal::TiltTooLarge => "arming refused: tilt too large",
            Refusal::SetpointMissing => "arming refused: no fresh setpoint",
            Refusal::SetpointTooFar => "arming refused: setpoint too far away",
            Refusal::Unhealthy => "arming refused: control rate or clock is wrong",
            Refusal::NotAtRest => "arming refused: not at rest for a second",
            Refusal::InFlight => "disarming refused: in flight; force to override",
            Refusal::NotArmed => "refused: not armed",
            Refusal::Overtaken => "refused: a later request stopped the motors",
            Refusal::AttitudeUnknown => "arming refused: estimator has no attitude yet",
            Refusal::HeadingUnknown => "arming refused: estimator has no heading",
            Refusal::PositionUnknown => "arming refused: estimator has no position",
            Refusal::BatteryLow => "arming refused: battery low or unknown",
            Refusal::SensorFailed => "arming refused: a sensor has failed",
            Refusal::OutsideFence => "arming refused: outside the geofence",
            Refusal::WrongMode => "arming refused: this mode does not allow arming",
        }
    }
}
