//! Parameters of the guidance. Where the meaning is PX4's, so are the name and the numbers of the actions.

use crate::failsafe::FailsafeSettings;
use crate::fence::BrakingLimits;
use afbc_types::{Range, parameters};

parameters! {
    /// Limits of the trajectory limiter.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct MotionLimits {
        /// Largest horizontal speed.
        #[parameter(MPC_XY_VEL_MAX, "m/s", 0.1..=40.0)]
        pub speed_m_s: f32 = 12.0,
        /// Largest speed upwards.
        #[parameter(MPC_Z_VEL_MAX_UP, "m/s", 0.1..=20.0)]
        pub up_m_s: f32 = 3.0,
        /// Largest speed downwards.
        #[parameter(MPC_Z_VEL_MAX_DN, "m/s", 0.1..=10.0)]
        pub down_m_s: f32 = 1.5,
        /// Horizontal acceleration toward a distant target.
        #[parameter(MPC_ACC_HOR, "m/s2", 0.5..=20.0)]
        pub acceleration_m_s2: f32 = 3.0,
        /// Largest horizontal acceleration including the target's own; at least the acceleration toward a distant
        /// target.
        #[parameter(MPC_ACC_HOR_MAX, "m/s2", 0.5..=40.0)]
        pub acceleration_max_m_s2: f32 = 10.0,
        /// Largest vertical acceleration.
        #[parameter(MPC_ACC_UP_MAX, "m/s2", 0.5..=20.0)]
        pub vertical_acceleration_m_s2: f32 = 4.0,
        /// Jerk toward a distant target.
        #[parameter(MPC_JERK_AUTO, "m/s3", 0.5..=100.0)]
        pub jerk_m_s3: f32 = 8.0,
        /// Largest jerk including the target's own; at least the jerk toward a distant target.
        #[parameter(MPC_JERK_MAX, "m/s3", 0.5..=500.0)]
        pub jerk_max_m_s3: f32 = 100.0,
        /// Largest rate of the heading.
        #[parameter(YAW_RATE_MAX, "rad/s", 0.05..=10.0)]
        pub yaw_rate_rad_s: f32 = 1.0,
        /// Largest angular acceleration of the heading.
        #[parameter(YAW_ACC_MAX, "rad/s2", 0.05..=50.0)]
        pub yaw_acceleration_rad_s2: f32 = 2.0,
    }
    together(limits) {
        let least = |range: Range, least: f32| Range { min: least.into(), ..range };
        least(MotionLimits::MPC_ACC_HOR_MAX.range, limits.acceleration_m_s2).check(limits.acceleration_max_m_s2)?;
        least(MotionLimits::MPC_JERK_MAX.range, limits.jerk_m_s3).check(limits.jerk_max_m_s3)
    }
}

impl MotionLimits {
    /// Returns the limits that the vehicle brakes with before a geofence.
    pub const fn braking(&self) -> BrakingLimits {
        BrakingLimits::new(self.acceleration_m_s2, self.jerk_m_s3)
    }
}

parameters! {
    /// Parameters of the flight modes.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct FlightModeSettings {
        /// Height to which the vehicle takes off, above the place where it stands.
        #[parameter(MIS_TAKEOFF_ALT, "m", 0.3..=100.0)]
        pub takeoff_height_m: f32 = 2.5,
        /// Speed of take-off.
        #[parameter(MPC_TKO_SPEED, "m/s", 0.1..=10.0)]
        pub takeoff_m_s: f32 = 1.5,
        /// Landing speed.
        #[parameter(MPC_LAND_SPEED, "m/s", 0.1..=3.0)]
        pub land_m_s: f32 = 0.7,
        /// Height above home below which the vehicle descends at the landing speed.
        #[parameter(MPC_LAND_ALT2, "m", 0.0..=100.0)]
        pub land_slow_m: f32 = 5.0,
        /// Horizontal speed on the way to a place.
        #[parameter(MPC_XY_CRUISE, "m/s", 0.1..=40.0)]
        pub cruise_m_s: f32 = 5.0,
        /// Smallest height above home at which the vehicle returns.
        #[parameter(RTL_RETURN_ALT, "m", 0.0..=1000.0)]
        pub return_height_m: f32 = 15.0,
        /// Distance from home within which the vehicle returns without climbing.
        #[parameter(RTL_MIN_DIST, "m", 0.0..=100.0)]
        pub near_home_m: f32 = 5.0,
        /// Distance at which a waypoint counts as reached, unless the waypoint has a radius of its own.
        #[parameter(NAV_ACC_RAD, "m", 0.05..=200.0)]
        pub within_m: f32 = 1.0,
        /// Largest tilt that the sticks command.
        #[parameter(MAN_TILT_MAX, "rad", 0.05..=1.2)]
        pub stick_tilt_rad: f32 = 0.6,
        /// Roll rate at full stick in acro mode.
        #[parameter(MC_ACRO_R_MAX, "deg/s", 0.0..=1800.0)]
        pub acro_roll_deg_s: f32 = 100.0,
        /// Pitch rate at full stick in acro mode.
        #[parameter(MC_ACRO_P_MAX, "deg/s", 0.0..=1800.0)]
        pub acro_pitch_deg_s: f32 = 100.0,
        /// Yaw rate at full stick in acro mode.
        #[parameter(MC_ACRO_Y_MAX, "deg/s", 0.0..=1800.0)]
        pub acro_yaw_deg_s: f32 = 100.0,
        /// Time after which the targets of a companion computer count as lost.
        #[parameter(COM_OF_LOSS_T, "s", 0.05..=60.0)]
        pub targets_lost_s: f32 = 0.5,
        /// Time after which the sticks of a pilot count as lost.
        #[parameter(COM_RC_LOSS_T, "s", 0.05..=60.0)]
        pub sticks_lost_s: f32 = 0.5,
        /// Time on the ground after which an armed vehicle that has not taken off is disarmed; 0: never.
        #[parameter(COM_DISARM_PRFLT, "s", 0.0..=3600.0)]
        pub disarm_before_s: f32 = 10.0,
        /// Time on the ground after which a vehicle that has landed is disarmed; 0: never.
        #[parameter(COM_DISARM_LAND, "s", 0.0..=3600.0)]
        pub disarm_after_s: f32 = 2.0,
    }
}

parameters! {
    /// All parameters of the guidance.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Settings {
        /// Limits of the trajectory limiter.
        #[group("")]
        pub limits: MotionLimits = MotionLimits::DEFAULT,
        /// How the modes fly.
        #[group("")]
        pub flying: FlightModeSettings = FlightModeSettings::DEFAULT,
        /// Failsafes.
        #[group("")]
        pub failsafe: FailsafeSettings = FailsafeSettings::DEFAULT,
    }
}
