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
        /// Bandwidth of the pulse with which roll and pitch are fed forward behind a jump of the setpoint's jerk: what
        /// rotors can follow.
        #[parameter(FORWARD, "rad/s", BANDWIDTH.min..=BANDWIDTH.max, tuned)]
        pub forward_rad_s: f32 = 40.0,
        /// Limits on the demands of position control.
        #[group("limits")]
        pub limits: PositionControlLimits = PositionControlLimits::NONE,
        /// Whether the desired attitude is computed with the commanded thrust, instead of the hover thrust (39).
        #[switch(TILT_THRUST)]
        pub tilt_by_thrust: bool = false,
        /// Whether an estimate stops growing in the direction in which rotors, tilt or acceleration are at a limit.
        #[switch(ANTI_WINDUP)]
        pub anti_windup: bool = false,
        /// Whether adaptation stops, and rotors give thrust only, while the vehicle stands on the ground.
        #[switch(FREEZE)]
        pub freeze_on_ground: bool = false,
        /// Whether estimates start with the weight, and the command filter at the attitude, so that a vehicle in flight
        /// is taken over without a jump. The paper starts with zero estimates and at its first command.
        #[switch(BUMPLESS)]
        pub bumpless: bool = false,
        /// Whether the law is given the known part of (16) by the nominal model, so that only the rest is learnt, and
        /// roll and pitch the derivatives that follow from jerk and snap of the setpoint, instead of the command
        /// filter's second derivative, which is mostly noise.
        #[switch(FEED_FORWARD)]
        pub feed_forward: bool = false,
        /// Whether errors of the attitude are those of the rotation to the desired one, tilt before yaw, and rates
        /// those of the body, instead of differences and derivatives of Euler angles.
        #[switch(ROTATION)]
        pub by_rotation: bool = false,
        /// Observer of the horizontal acceleration that the model does not know, for a law that is given what is known.
        #[group("")]
        pub disturbance: DisturbanceObserver = DisturbanceObserver::DEFAULT,
        /// Reference model between setpoint and law.
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
