//! Inputs and outputs of a flight mode.

use crate::limiter::LimiterTarget;
use crate::settings::{FlightModeSettings, MotionLimits};
use afbc_control::math::{max, min};
use afbc_flight_core::RateTarget;
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;

/// Inputs of a flight mode in a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ModeInputs<'a> {
    pub(crate) flying: &'a FlightModeSettings,
    pub(crate) limits: &'a MotionLimits,
    pub(crate) dt_s: f32,
    pub(crate) state: &'a State,
    /// Limited setpoint of the last tick.
    pub(crate) present: &'a Setpoint,
    pub(crate) airborne: bool,
    pub(crate) home_m: Vector3<f32>,
    /// Ordered horizontal speed; infinite if none \[m/s\].
    pub(crate) speed_m_s: f32,
    /// Height up to which the vehicle is well inside the geofence; infinite without one \[m\].
    pub(crate) ceiling_m: f32,
}

impl ModeInputs<'_> {
    /// Returns a target that stops, with the usual speeds of approach.
    pub(crate) fn stop(&self) -> LimiterTarget {
        LimiterTarget::stop(min(self.flying.cruise_m_s, self.speed_m_s), self.limits.up_m_s, self.limits.down_m_s)
    }

    /// Returns a target at a place.
    pub(crate) fn to(&self, position_m: Vector3<f32>) -> LimiterTarget {
        LimiterTarget { position_m, ..self.stop() }
    }

    /// Returns a target that descends over the place `over_m`, or where the vehicle stops if that is NaN.
    pub(crate) fn down(&self, over_m: Vector3<f32>) -> LimiterTarget {
        let FlightModeSettings { land_m_s, land_slow_m, .. } = *self.flying;
        let above_m = self.present.position_m.z - self.home_m.z - land_slow_m;
        let share = if above_m > 0.0 { min(above_m / max(land_slow_m, 1.0), 1.0) } else { 0.0 };
        let fast_m_s = max(self.limits.down_m_s, land_m_s);
        let sink_m_s = land_m_s + (fast_m_s - land_m_s) * share;
        let aim = self.to(Vector3::new(over_m.x, over_m.y, f32::NAN));
        LimiterTarget { velocity_m_s: Vector3::new(f32::NAN, f32::NAN, -sink_m_s), ..aim }
    }

    /// Returns the heading towards a place; NaN if it is within 1 m horizontally.
    pub(crate) fn towards(&self, place_m: &Vector3<f32>) -> f32 {
        let off_m = place_m - self.present.position_m;
        if off_m.xy().norm_squared() > 1.0 { libm::atan2f(off_m.y, off_m.x) } else { f32::NAN }
    }

    /// True if the setpoint is nearly at rest.
    pub(crate) fn stands(&self) -> bool {
        let Setpoint { velocity_m_s, acceleration_m_s2, .. } = self.present;
        velocity_m_s.norm_squared() < 0.05 * 0.05 && acceleration_m_s2.norm_squared() < 0.2 * 0.2
    }

    /// True if both vehicle and setpoint are within a distance of a place, horizontally and vertically.
    pub(crate) fn is_at(&self, place_m: &Vector3<f32>, within_m: f32) -> bool {
        [&self.state.position_m, &self.present.position_m].into_iter().all(|position_m| {
            let off_m = position_m - place_m;
            off_m.xy().norm_squared() <= within_m * within_m && off_m.z.abs() <= within_m
        })
    }
}

/// Output of a flight mode in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ModeOutput {
    pub(crate) shaping: Shaping,
    /// True if a vehicle on the ground shall take off.
    pub(crate) lifts: bool,
    /// True if the vehicle shall land and stop its motors on the ground.
    pub(crate) lands: bool,
    /// True if the mode has finished.
    pub(crate) done: bool,
}

/// Way in which a mode's output becomes a setpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shaping {
    /// Flown through the limiter.
    Limited(LimiterTarget),
    /// Horizontal acceleration as given \[m/s2\]; height and heading through the limiter.
    Leaning(LimiterTarget, [f32; 2]),
    /// Setpoint flown as it is; its position and velocity are the vehicle's own.
    Direct(Setpoint),
    /// Body rates and thrust, flown without a setpoint.
    Turning(RateTarget),
}

impl ModeOutput {
    /// Makes the output of a mode that flies to `aim`.
    pub(crate) fn fly(aim: LimiterTarget) -> Self {
        ModeOutput { shaping: Shaping::Limited(aim), lifts: false, lands: false, done: false }
    }
}

#[cfg(test)]
mod tests;
