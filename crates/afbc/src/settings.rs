//! Settings of the cascade around the law.

use crate::disturbance::DisturbanceObserver;
use crate::limits::PositionControlLimits;
use crate::reference::ReferenceModel;
use afbc_control::Smoothing;
use afbc_control::command_filter::BANDWIDTH;
use afbc_types::parameters;

parameters! {
    /// Settings of the cascade around the law. The defaults are the paper's.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Settings {
        /// Settings that every controller needs.
        #[group("")]
        pub common: afbc_control::Settings = afbc_control::Settings::DEFAULT,
        /// Bandwidth of the filter on phi_d and theta_d.
        #[parameter(FILTER, "rad/s", BANDWIDTH.min..=BANDWIDTH.max, tuned)]
        pub command_filter_rad_s: f32 = 40.0,
        /// Bandwidth of the pulse that feeds roll and pitch forward after a jump of the setpoint's jerk; choose one
        /// that the rotors can follow.
        #[parameter(FORWARD, "rad/s", BANDWIDTH.min..=BANDWIDTH.max, tuned)]
        pub forward_rad_s: f32 = 40.0,
        /// Limits on the demands of position control.
        #[group("limits")]
        pub limits: PositionControlLimits = PositionControlLimits::NONE,
        /// Whether the desired attitude is computed with the commanded thrust instead of the hover thrust (39).
        #[switch(TILT_THRUST)]
        pub tilt_by_thrust: bool = false,
        /// Whether an estimate stops growing in the direction in which rotors, tilt or acceleration are at a limit.
        #[switch(ANTI_WINDUP)]
        pub anti_windup: bool = false,
        /// Whether, on the ground, adaptation stops and the rotors give thrust but no moments.
        #[switch(FREEZE)]
        pub freeze_on_ground: bool = false,
        /// Whether the thrust estimate starts at the weight and the command filter at the present attitude, so that the
        /// law takes over a vehicle in flight without a jump. In the paper, the estimates start at zero and the filter
        /// at its first command.
        #[switch(BUMPLESS)]
        pub bumpless: bool = false,
        /// Whether the nominal model supplies the known part of the paper's equation 16, so that the law only learns
        /// the rest. Roll and pitch then use derivatives computed from the setpoint's jerk and snap instead of the
        /// command filter's second derivative, which is mostly noise.
        #[switch(FEED_FORWARD)]
        pub feed_forward: bool = false,
        /// Whether attitude errors are taken from the rotation to the desired attitude, tilt before yaw, and rates from
        /// the body rates. Otherwise, errors are differences of Euler angles and rates their derivatives.
        #[switch(ROTATION)]
        pub by_rotation: bool = false,
        /// Observer of the acceleration that the nominal model does not explain; needs the known part of (16).
        #[group("")]
        pub disturbance: DisturbanceObserver = DisturbanceObserver::DEFAULT,
        /// Reference model between the setpoint and the law.
        #[group("")]
        pub reference: ReferenceModel = ReferenceModel::DEFAULT,
        /// Low-pass filters on U1..U4.
        #[group("")]
        pub smoothing: Smoothing = Smoothing::DEFAULT,
    }
}

impl Settings {
    /// Returns the settings with this time step.
    #[must_use]
    pub const fn with_dt_s(mut self, dt_s: f32) -> Self {
        self.common.dt_s = dt_s;
        self
    }

    /// Returns the settings for a vehicle that is `slowness` times slower: command filter, tilt rate, observers,
    /// reference model and input filters slow down. Limits of speed and acceleration stay, because they belong to the
    /// task. Not in the paper.
    #[must_use]
    pub fn slowed(self, slowness: f32, lag_s: f32) -> Self {
        let Settings { command_filter_rad_s, forward_rad_s, limits, disturbance, reference, smoothing, .. } = self;
        Settings {
            command_filter_rad_s: command_filter_rad_s / slowness,
            forward_rad_s: forward_rad_s / slowness,
            limits: PositionControlLimits { tilt_rate_max_rad_s: limits.tilt_rate_max_rad_s / slowness, ..limits },
            disturbance: disturbance.slowed(slowness, lag_s),
            reference: reference.slowed(slowness),
            smoothing: smoothing.slowed(slowness),
            ..self
        }
    }

    /// Returns the settings with this known drag.
    #[must_use]
    pub const fn with_drag(mut self, drag: afbc_control::drag::KnownDrag) -> Self {
        self.common.drag = drag;
        self
    }

    /// Returns the settings with this largest rotor force.
    #[must_use]
    pub const fn with_rotor_force_max_n(mut self, force_n: f32) -> Self {
        self.common.rotor_force_max_n = force_n;
        self
    }
}
