//! Limits of the cascade: what position control may ask of the vehicle. Ours; the paper has none.

pub use afbc_control::command_filter::RATE_MAX as TILT_RATE;
use afbc_types::{OutOfRange, Range};

/// Accepted largest tilt \[rad\].
pub const TILT: Range = Range::new("tilt_max_rad", 0.05, 1.57);
/// Accepted largest horizontal acceleration \[m/s2\].
pub const ACCELERATION: Range = Range::new("acceleration_max_m_s2", 0.1, 1e6);
/// Accepted largest speed for an error along x and along y \[m/s\].
pub const SPEED: Range = Range::new("speed_max_m_s", 0.1, 1e6);
/// Accepted largest speed for an error along z \[m/s\].
pub const CLIMB: Range = Range::new("climb_max_m_s", 0.1, 1e6);

/// What position control may ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Angle between thrust and vertical \[rad\].
    pub tilt_max_rad: f32,
    /// Rate of phi_d and of theta_d behind the command filter \[rad/s\].
    pub tilt_rate_max_rad_s: f32,
    /// Size of (u5, u6) \[m/s2\].
    pub acceleration_max_m_s2: f32,
    /// Speed along x and along y that a position error may ask for, on top of the reference's \[m/s\]: alpha_1 e_1.
    pub speed_max_m_s: f32,
    /// The same along z \[m/s\].
    pub climb_max_m_s: f32,
}

impl Limits {
    /// No limits but that of (40) itself: the tilt stays below 90 degrees.
    pub const NONE: Self = Limits {
        tilt_max_rad: 1.57,
        tilt_rate_max_rad_s: 1e6,
        acceleration_max_m_s2: 1e6,
        speed_max_m_s: 1e6,
        climb_max_m_s: 1e6,
    };

    /// Checks every limit.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        TILT.check(self.tilt_max_rad)?;
        TILT_RATE.check(self.tilt_rate_max_rad_s)?;
        ACCELERATION.check(self.acceleration_max_m_s2)?;
        SPEED.check(self.speed_max_m_s)?;
        CLIMB.check(self.climb_max_m_s)
    }
}
