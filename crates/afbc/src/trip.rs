//! Reasons for switching from the adaptive law to the fallback law.

use afbc_types::Axis;

/// Reason why the monitor switched off the adaptive law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Trip {
    /// |Theta_hat| passed its bound.
    Theta(Axis),
    /// delta_hat passed its bound.
    Delta(Axis),
    /// The mean distance from the reference passed its bound.
    Error(Axis),
    /// Rotors stayed at their limits.
    Saturation,
    /// An input keeps oscillating; z stands for the thrust.
    LimitCycle(Axis),
}

impl Trip {
    /// Returns the reason as text of at most 50 characters.
    pub const fn reason(self) -> &'static str {
        match self {
            Trip::Theta(Axis::Roll) => "AFBC off: Theta_hat of roll out of bounds",
            Trip::Theta(Axis::Pitch) => "AFBC off: Theta_hat of pitch out of bounds",
            Trip::Theta(Axis::Yaw) => "AFBC off: Theta_hat of yaw out of bounds",
            Trip::Theta(Axis::Z) => "AFBC off: Theta_hat of z out of bounds",
            Trip::Theta(Axis::X) => "AFBC off: Theta_hat of x out of bounds",
            Trip::Theta(Axis::Y) => "AFBC off: Theta_hat of y out of bounds",
            Trip::Delta(Axis::Roll) => "AFBC off: delta_hat of roll out of bounds",
            Trip::Delta(Axis::Pitch) => "AFBC off: delta_hat of pitch out of bounds",
            Trip::Delta(Axis::Yaw) => "AFBC off: delta_hat of yaw out of bounds",
            Trip::Delta(Axis::Z) => "AFBC off: delta_hat of z out of bounds",
            Trip::Delta(Axis::X) => "AFBC off: delta_hat of x out of bounds",
            Trip::Delta(Axis::Y) => "AFBC off: delta_hat of y out of bounds",
            Trip::Error(Axis::Roll) => "AFBC off: errors of roll stay large",
            Trip::Error(Axis::Pitch) => "AFBC off: errors of pitch stay large",
            Trip::Error(Axis::Yaw) => "AFBC off: errors of yaw stay large",
            Trip::Error(Axis::Z) => "AFBC off: errors of z stay large",
            Trip::Error(Axis::X) => "AFBC off: errors of x stay large",
            Trip::Error(Axis::Y) => "AFBC off: errors of y stay large",
            Trip::Saturation => "AFBC off: rotors stay saturated",
            Trip::LimitCycle(Axis::Roll) => "AFBC off: limit cycle of U1 (roll)",
            Trip::LimitCycle(Axis::Pitch) => "AFBC off: limit cycle of U2 (pitch)",
            Trip::LimitCycle(Axis::Yaw) => "AFBC off: limit cycle of U3 (yaw)",
            Trip::LimitCycle(_) => "AFBC off: limit cycle of U4 (thrust)",
        }
    }
}
