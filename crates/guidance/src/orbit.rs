//! Orbits: circles around a place.

use crate::limiter::LimiterTarget;
use crate::mode_io::{ModeInputs, ModeOutput};
use crate::order::OrbitHeading;
use crate::settings::MotionLimits;
use afbc_control::math::{cos, max, min, sin, sqrt, wrap_angle};
use core::f32::consts::{FRAC_PI_2, PI};
use nalgebra::Vector3;

/// Accepted radii \[m\].
pub(crate) const RADIUS_M: core::ops::RangeInclusive<f32> = 1.0..=1000.0;
/// Radius of an orbit for which none is given \[m\].
pub const ORBIT_RADIUS_M: f32 = 10.0;
/// Shares of the acceleration of an approach. The first is for the largest centripetal acceleration, the second for the
/// acceleration along the circle.
const SHARE: f32 = 0.8;
const ALONG: f32 = 0.3;
/// Distance from the circle, horizontally and vertically, at which the orbit starts \[m\].
const NEAR_M: f32 = 0.5;
/// Largest distance between the setpoint and the orbit's moving place \[m\]. Beyond this distance the place waits.
const LATE_M: f32 = 2.0;

/// An orbit and its progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Orbit {
    pub(crate) centre_m: Vector3<f32>,
    pub(crate) radius_m: f32,
    /// Speed along the circle, positive counter-clockwise (to the left) \[m/s\].
    pub(crate) speed_m_s: f32,
    pub(crate) heading: OrbitHeading,
    /// Angle to fly; infinite for an endless orbit \[rad\].
    pub(crate) angle_rad: f32,
    pub(crate) round: OrbitProgress,
}

/// Progress of an orbit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct OrbitProgress {
    /// Direction from the centre to the present place; none until the circle is reached \[rad\].
    at_rad: Option<f32>,
    turned_rad: f32,
    /// Present speed, without sign \[m/s\].
    speed_m_s: f32,
    /// Running number of the targets made.
    aims: u32,
}

/// Returns the largest speed on a circle of this radius \[m/s\].
pub(crate) fn speed_max_m_s(limits: &MotionLimits, radius_m: f32) -> f32 {
    // The centripetal acceleration is v^2/r.
    min(limits.speed_m_s, sqrt(SHARE * limits.acceleration_m_s2 * radius_m))
}

impl Orbit {
    /// Flies the orbit. Done when its angle has been flown.
    pub(crate) fn fly(&mut self, inputs: &ModeInputs<'_>) -> ModeOutput {
        let Orbit { centre_m, radius_m, speed_m_s, .. } = *self;
        let present = inputs.present.position_m;
        let off_m = present - centre_m;
        let Some(before_rad) = self.round.at_rad else {
            // Fly to the nearest point of the circle.
            let at_rad = libm::atan2f(off_m.y, off_m.x);
            let to_m = centre_m + Vector3::new(cos(at_rad), sin(at_rad), 0.0) * radius_m;
            let near = inputs.is_at(&to_m, NEAR_M);
            self.round.at_rad = near.then_some(at_rad);
            let yaw_rad = self.yaw_rad(at_rad);
            return ModeOutput::fly(LimiterTarget { yaw_rad, ..inputs.to(to_m) });
        };
        let place = |at_rad: f32| centre_m + Vector3::new(cos(at_rad), sin(at_rad), 0.0) * radius_m;
        let late = (place(before_rad) - present).norm_squared() > LATE_M * LATE_M;
        let (before_m_s, most_m_s) = (self.round.speed_m_s, if late { 0.0 } else { speed_m_s.abs() });
        let change_m_s = ALONG * inputs.limits.acceleration_m_s2 * inputs.dt_s;
        let now_m_s = min(max(most_m_s, before_m_s - change_m_s), before_m_s + change_m_s);
        self.round.speed_m_s = now_m_s;
        let side = if speed_m_s < 0.0 { -1.0 } else { 1.0 };
        let (speed_m_s, along_m_s2) = (side * now_m_s, side * (now_m_s - before_m_s) / inputs.dt_s);
        let rate_rad_s = speed_m_s / radius_m;
        // The place moves by the mean of old and new speed. With another speed, position and velocity would not fit
        // each other.
        let step_rad = 0.5 * (before_m_s + now_m_s) * side / radius_m * inputs.dt_s;
        let at_rad = wrap_angle(before_rad + step_rad);
        self.round.at_rad = Some(at_rad);
        self.round.turned_rad += step_rad.abs();
        // The number may wrap around, because it only tells this target from the previous target.
        self.round.aims = self.round.aims.wrapping_add(1);
        let (s, c) = (sin(at_rad), cos(at_rad));
        let yaw_rad = self.yaw_rad(at_rad);
        let aim = LimiterTarget {
            velocity_m_s: Vector3::new(-s, c, 0.0) * speed_m_s,
            acceleration_m_s2: Vector3::new(-c, -s, 0.0) * (speed_m_s * rate_rad_s)
                + Vector3::new(-s, c, 0.0) * along_m_s2,
            yaw_rad,
            yaw_rate_rad_s: if yaw_rad.is_nan() { f32::NAN } else { rate_rad_s },
            // The targets form a stream whose motion is continuous, so the limiter passes them unchanged.
            sent_us: Some(self.round.aims.into()),
            ..inputs.to(place(at_rad))
        };
        // The largest speed of the approach is higher than the orbit's speed, so that the vehicle can catch up with the
        // place on the circle.
        let aim =
            LimiterTarget { speed_m_s: max(aim.speed_m_s, min(speed_m_s.abs() + 1.0, inputs.limits.speed_m_s)), ..aim };
        ModeOutput { done: self.round.turned_rad >= self.angle_rad, ..ModeOutput::fly(aim) }
    }

    /// Returns the heading at a place on the circle; NaN keeps the present one.
    fn yaw_rad(&self, at_rad: f32) -> f32 {
        match self.heading {
            OrbitHeading::Centre => wrap_angle(at_rad + PI),
            OrbitHeading::Kept => f32::NAN,
            OrbitHeading::Along => wrap_angle(at_rad + if self.speed_m_s < 0.0 { -FRAC_PI_2 } else { FRAC_PI_2 }),
        }
    }
}
