//! Second-order command filter: turns a raw command into a smooth reference with two derivatives. Not in the paper.
//!
//! (12) needs d phi_d/dt and d theta_d/dt, which the paper does not provide. The filter is critically damped,
//!
//! ```text
//! d^2 x/dt^2 = w^2 (command - x) - 2 w dx/dt
//! ```
//!
//! The filter steps by its exact solution for a command held over the step, so it is stable at any bandwidth.

use crate::math;
use afbc_types::{OutOfRange, Range};

/// Accepted bandwidth w \[rad/s\].
pub const BANDWIDTH: Range = Range::new("command_filter_rad_s", 1.0, 1000.0);

/// Accepted rate limit of the filter \[rad/s\].
pub const RATE_MAX: Range = Range::new("tilt_rate_max_rad_s", 0.1, 1e6);

/// Constants of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandFilter {
    bandwidth: f32,
    dt: f32,
    /// Decay per step, exp(-w dt).
    decay: f32,
    rate_max: f32,
}

/// State of the filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Filtered {
    /// Filtered angle x \[rad\].
    pub angle: f32,
    /// Its rate dx/dt \[rad/s\].
    pub rate: f32,
}

impl CommandFilter {
    /// Makes a filter of this bandwidth \[rad/s\] with a time step of `dt_s` seconds, which must be within
    /// [`crate::Settings::DT`].
    ///
    /// # Errors
    /// If the bandwidth is outside [`BANDWIDTH`].
    pub fn new(bandwidth_rad_s: f32, dt_s: f32) -> Result<Self, OutOfRange> {
        BANDWIDTH.check(bandwidth_rad_s)?;
        let decay = math::exp(-bandwidth_rad_s * dt_s);
        Ok(CommandFilter { bandwidth: bandwidth_rad_s, dt: dt_s, decay, rate_max: f32::INFINITY })
    }

    /// Returns the filter with the rate limited to `rate_max_rad_s`.
    ///
    /// # Errors
    /// If the rate is outside [`RATE_MAX`].
    pub fn limited(self, rate_max_rad_s: f32) -> Result<Self, OutOfRange> {
        RATE_MAX.check(rate_max_rad_s)?;
        Ok(CommandFilter { rate_max: rate_max_rad_s, ..self })
    }

    /// Returns d^2 x/dt^2 under `command` \[rad/s2\]. At the rate limit, an acceleration beyond it is zero.
    #[inline]
    pub fn acceleration(&self, state: &Filtered, command: f32) -> f32 {
        let acceleration = self.bandwidth * (self.bandwidth * (command - state.angle) - 2.0 * state.rate);
        let limited = state.rate.abs() >= self.rate_max && acceleration * state.rate > 0.0;
        if limited { 0.0 } else { acceleration }
    }

    /// Returns the state one step later, with `command` held during the step.
    #[inline]
    #[must_use]
    pub fn advance(&self, state: &Filtered, command: f32) -> Filtered {
        let offset = state.angle - command;
        let slope = state.rate + self.bandwidth * offset;
        let angle = math::settled(command + (offset + slope * self.dt) * self.decay);
        let rate = math::settled((state.rate - self.bandwidth * slope * self.dt) * self.decay);
        // A fast filter may reach its command and stop within one step: check the distance as well as the rate.
        let travel = angle - state.angle;
        let fastest = if rate.abs() > self.rate_max { rate } else { travel };
        if rate.abs() <= self.rate_max && travel.abs() <= self.rate_max * self.dt {
            Filtered { angle, rate }
        } else {
            let rate = self.rate_max.copysign(fastest);
            Filtered { angle: state.angle + rate * self.dt, rate }
        }
    }
}
