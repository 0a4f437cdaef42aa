//! Limits of the cascade on the demands of position control. Not in the paper.

use afbc_control::command_filter::RATE_MAX;
use afbc_types::parameters;

parameters! {
    /// Limits on the demands of position control. The default is no limit but that of (40) itself, a tilt below 90
    /// degrees.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Limits {
        /// Largest angle between thrust and vertical.
        #[parameter(TILT, "rad", 0.05..=1.57)]
        pub tilt_max_rad: f32 = 1.57,
        /// Largest rate of phi_d and of theta_d after the command filter.
        #[parameter(RATE, "rad/s", RATE_MAX.min..=RATE_MAX.max)]
        pub tilt_rate_max_rad_s: f32 = 1e6,
        /// Largest norm of (u5, u6), the horizontal acceleration.
        #[parameter(ACCEL, "m/s2", 0.1..=1e6)]
        pub acceleration_max_m_s2: f32 = 1e6,
        /// Largest speed along x and along y demanded by a position error, alpha_1 e_1, in addition to the reference's.
        #[parameter(SPEED, "m/s", 0.1..=1e6)]
        pub speed_max_m_s: f32 = 1e6,
        /// Largest speed along z demanded by a height error, alpha_1 e_1, in addition to the reference's.
        #[parameter(CLIMB, "m/s", 0.1..=1e6)]
        pub climb_max_m_s: f32 = 1e6,
    }
}

impl Limits {
    /// No limits.
    pub const NONE: Self = Self::DEFAULT;
}
