//! Smooth motion of the heading (yaw) to its target, with limits of rate and acceleration.

use afbc_control::math::{max, min, sqrt, wrap_angle};

/// Decay rate of a small heading error \[1/s\].
const APPROACH_1_S: f32 = 2.0;
/// Decay rate of a small error of the yaw rate \[1/s\].
const SETTLE_1_S: f32 = 8.0;
/// Share of the largest acceleration used for braking.
const BRAKING: f32 = 0.7;
/// Share of the rate limit that the heading aims at.
const AIM: f32 = 0.99;
/// Errors of heading and rate below which the target counts as reached, and is then copied exactly \[rad, rad/s\].
const REACHED_RAD: f32 = 1e-3;
const REACHED_RAD_S: f32 = 5e-3;

/// Target of the heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum HeadingTarget {
    /// Heading that itself turns at a rate \[rad, rad/s\].
    To(f32, f32),
    /// Turn at this rate, without a target heading \[rad/s\].
    By(f32),
}

/// Heading with its first two derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Heading {
    pub(crate) yaw_rad: f32,
    pub(crate) rate_rad_s: f32,
    pub(crate) acceleration_rad_s2: f32,
}

/// Limits of yaw rate and acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct YawLimits {
    pub(crate) rate_rad_s: f32,
    pub(crate) acceleration_rad_s2: f32,
}

impl Heading {
    /// Makes a heading at rest.
    pub(crate) fn new(yaw_rad: f32) -> Self {
        Heading { yaw_rad, rate_rad_s: 0.0, acceleration_rad_s2: 0.0 }
    }

    /// Advances the heading by one step.
    pub(crate) fn advance(&mut self, turn: &HeadingTarget, limits: &YawLimits, dt_s: f32) {
        let most = AIM * limits.rate_rad_s;
        let bounded = |value: f32, most: f32| max(min(value, most), -most);
        let (wanted, change) = match *turn {
            HeadingTarget::By(rate) => (bounded(rate, most), 0.0),
            HeadingTarget::To(yaw, rate) => {
                let error = wrap_angle(yaw - self.yaw_rad);
                let off = rate - self.rate_rad_s;
                // The remaining step is too small to matter to the law.
                let near = error.abs() <= REACHED_RAD + off.abs() * dt_s && off.abs() <= REACHED_RAD_S;
                if near && rate.abs() <= limits.rate_rad_s {
                    *self = Heading { yaw_rad: yaw, rate_rad_s: rate, acceleration_rad_s2: 0.0 };
                    return;
                }
                let braking = BRAKING * limits.acceleration_rad_s2;
                let c = braking / APPROACH_1_S;
                let root = sqrt(c * c + 2.0 * braking * error.abs());
                let approach = error * (2.0 * braking / (root + c));
                let wanted = rate + approach;
                if wanted.abs() <= most { (wanted, off * (braking / root)) } else { (bounded(wanted, most), 0.0) }
            }
        };
        let acceleration = change + (wanted - self.rate_rad_s) * SETTLE_1_S;
        let acceleration = bounded(acceleration, limits.acceleration_rad_s2);
        self.yaw_rad = wrap_angle(self.yaw_rad + (self.rate_rad_s + 0.5 * acceleration * dt_s) * dt_s);
        self.rate_rad_s += acceleration * dt_s;
        self.acceleration_rad_s2 = acceleration;
    }
}

#[cfg(test)]
mod tests;
