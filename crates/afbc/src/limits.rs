//! Limits on the demands of position control. Not in the paper.

use crate::law::SubsystemTracking;
use afbc_control::command_filter::RATE_MAX;
use afbc_types::parameters;

parameters! {
    /// Limits on the demands of position control. By default only (40) limits the tilt, to below 90 degrees.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct PositionControlLimits {
        /// Largest angle between thrust and vertical.
        #[parameter(TILT, "rad", 0.05..=1.57)]
        pub tilt_max_rad: f32 = 1.57,
        /// Largest rate of phi_d and of theta_d after the command filter.
        #[parameter(RATE, "rad/s", RATE_MAX.min..=RATE_MAX.max)]
        pub tilt_rate_max_rad_s: f32 = 1e6,
        /// Largest norm of (u5, u6), the horizontal acceleration.
        #[parameter(ACCEL, "m/s2", 0.1..=1e6)]
        pub acceleration_max_m_s2: f32 = 1e6,
        /// Largest speed along x and along y that a position error demands, alpha_1 e_1; the reference's speed comes on
        /// top.
        #[parameter(SPEED, "m/s", 0.1..=1e6)]
        pub speed_max_m_s: f32 = 1e6,
        /// Largest speed along z that a height error demands, alpha_1 e_1; the reference's speed comes on top.
        #[parameter(CLIMB, "m/s", 0.1..=1e6)]
        pub climb_max_m_s: f32 = 1e6,
    }
}

impl PositionControlLimits {
    /// No limits.
    pub const NONE: Self = Self::DEFAULT;
}

/// Speed limit of x, y or z: cuts the position error to the error that demands the largest speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApproachLimit {
    /// Largest e_1 \[m\].
    e1_max_m: f32,
    /// Approach speed per e_1 \[1/s\].
    approach_1_s: f32,
}

impl ApproachLimit {
    /// Creates the speed limit for a law with an approach speed of `approach_1_s` times the error.
    pub fn new(speed_max_m_s: f32, approach_1_s: f32) -> Self {
        // A law that does not approach has no limit: the quotient is infinite.
        ApproachLimit { e1_max_m: speed_max_m_s / approach_1_s, approach_1_s }
    }

    /// Returns state, reference and error (9) for the law, with the error cut at the limit.
    #[inline(always)]
    pub fn tracking(&self, [x1, x2]: [f32; 2], [x1d, x1d_dot, x1d_ddot]: [f32; 3]) -> SubsystemTracking {
        let distance = x1d - x1;
        let (e1, approach_1_s) = if distance.abs() > self.e1_max_m {
            (self.e1_max_m.copysign(distance), Some(self.approach_1_s))
        } else {
            (distance, None)
        };
        SubsystemTracking { x1, x2, e1, x1d_dot, x1d_ddot, approach_1_s }
    }
}
