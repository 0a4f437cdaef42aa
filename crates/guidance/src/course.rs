//! Flight modes hold, take-off, landing and return.

use crate::limiter::LimiterTarget;
use crate::mode_io::{ModeInputs, ModeOutput};
use afbc_control::math::{max, min, wrap_angle};
use afbc_types::ResetDelta;
use nalgebra::{Vector2, Vector3};

/// Distance from home at which a return begins to descend \[m\].
const OVER_HOME_M: f32 = 1.0;
/// Remaining height at which a climb counts as complete \[m\].
const CLIMBED_M: f32 = 0.3;
/// Share of the climb by which the vehicle may still be short when a take-off counts as complete.
const TAKEN_OFF_SHARE: f32 = 0.1;

/// Memory of mode hold: holds an ordered place, or the place where the vehicle stops.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Hold {
    pub(crate) at_m: Option<Vector3<f32>>,
    /// Heading \[rad\]; `None` keeps the present one.
    pub(crate) yaw_rad: Option<f32>,
    pub(crate) speed_m_s: Option<f32>,
}

impl Hold {
    /// Shifts the place and heading by an estimator reset, if the setpoint is within `within_m` of the place.
    pub(crate) fn shift(&mut self, reset: &ResetDelta, present_m: Option<Vector3<f32>>, within_m: f32) {
        let (Some(at_m), Some(present_m)) = (&mut self.at_m, present_m) else { return };
        if (*at_m - present_m).norm_squared() <= within_m * within_m {
            *at_m += reset.position_m;
            self.yaw_rad = self.yaw_rad.map(|yaw_rad| wrap_angle(yaw_rad + reset.yaw_rad));
        }
    }

    /// Returns the target: first a stop, unless a place was ordered, then a hold.
    pub(crate) fn fly(&mut self, inputs: &ModeInputs<'_>) -> LimiterTarget {
        if self.at_m.is_none() && inputs.stands() {
            self.at_m = Some(inputs.present.position_m);
        }
        let aim = self.at_m.map_or(inputs.stop(), |at_m| inputs.to(at_m));
        let speed_m_s = min(self.speed_m_s.unwrap_or(aim.speed_m_s), inputs.speed_m_s);
        LimiterTarget { yaw_rad: self.yaw_rad.unwrap_or(f32::NAN), speed_m_s, ..aim }
    }
}

/// Memory of a take-off: climbs vertically to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Takeoff {
    pub(crate) to_m: Vector3<f32>,
    from_m: f32,
}

impl Takeoff {
    /// Starts a take-off at the present setpoint.
    pub(crate) fn new(inputs: &ModeInputs<'_>, height_m: f32) -> Self {
        Takeoff::above(inputs.present.position_m, height_m)
    }

    /// Starts a take-off at `from_m`.
    pub(crate) fn above(from_m: Vector3<f32>, height_m: f32) -> Self {
        Takeoff { to_m: from_m + Vector3::new(0.0, 0.0, height_m), from_m: from_m.z }
    }

    /// Shifts the take-off by an estimator reset.
    pub(crate) fn shift(&mut self, reset: &ResetDelta) {
        self.to_m += reset.position_m;
        self.from_m += reset.position_m.z;
    }

    pub(crate) fn fly(&self, inputs: &ModeInputs<'_>) -> ModeOutput {
        let aim = LimiterTarget { up_m_s: inputs.flying.takeoff_m_s, ..inputs.to(self.to_m) };
        let short_m = max(TAKEN_OFF_SHARE * (self.to_m.z - self.from_m), CLIMBED_M);
        let there = (self.to_m.z - inputs.present.position_m.z).abs() < 0.05 && inputs.stands();
        let done = inputs.airborne && there && self.to_m.z - inputs.state.position_m.z < short_m;
        ModeOutput { lifts: true, done, ..ModeOutput::fly(aim) }
    }
}

/// Memory of a landing: descends over a place, or where the vehicle stops.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Land {
    pub(crate) over_m: Option<Vector3<f32>>,
}

impl Land {
    /// Shifts the landing by an estimator reset.
    pub(crate) fn shift(&mut self, reset: &ResetDelta) {
        self.over_m = self.over_m.map(|over_m| over_m + reset.position_m);
    }

    pub(crate) fn fly(&mut self, inputs: &ModeInputs<'_>) -> ModeOutput {
        if self.over_m.is_none() {
            let speed_m_s = inputs.present.velocity_m_s.xy().norm_squared();
            self.over_m = (speed_m_s < 0.05 * 0.05).then_some(inputs.present.position_m);
        }
        ModeOutput { lands: true, ..ModeOutput::fly(inputs.down(self.over_m.unwrap_or(Vector3::repeat(f32::NAN)))) }
    }
}

/// Memory of a return: climbs, flies to home or a nearer rally point, and lands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Return {
    height_m: f32,
    to_m: Vector2<f32>,
    /// Place above which the vehicle climbs. It is not set until the vehicle has stopped.
    hold: Hold,
    stage: ReturnStage,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum ReturnStage {
    Climbs,
    /// Flies home with this heading \[rad\].
    Flies(f32),
    Descends,
}

impl Return {
    pub(crate) fn new(inputs: &ModeInputs<'_>, to_m: Vector2<f32>) -> Self {
        let position_m = inputs.present.position_m;
        let off_m = to_m - position_m.xy();
        let near = off_m.norm_squared() <= inputs.flying.near_home_m * inputs.flying.near_home_m;
        let safe_m = inputs.home_m.z + inputs.flying.return_height_m;
        // A return must not itself cross the geofence's ceiling.
        let height_m = if near { position_m.z } else { min(max(position_m.z, safe_m), inputs.ceiling_m) };
        Return { height_m, to_m, hold: Hold::default(), stage: ReturnStage::Climbs }
    }

    /// Shifts the place of the climb by an estimator reset. Home does not move.
    pub(crate) fn shift(&mut self, reset: &ResetDelta, present_m: Option<Vector3<f32>>, within_m: f32) {
        // The vehicle may still be far below this place, so only the horizontal distance is compared.
        let level_m = present_m.zip(self.hold.at_m).map(|(present, at)| Vector3::new(present.x, present.y, at.z));
        self.hold.shift(reset, level_m, within_m);
    }

    /// True once the vehicle has stopped and climbed.
    pub(crate) fn is_on_its_way(&self) -> bool {
        self.stage != ReturnStage::Climbs
    }

    pub(crate) fn fly(&mut self, inputs: &ModeInputs<'_>) -> ModeOutput {
        let home_m = Vector3::new(self.to_m.x, self.to_m.y, self.height_m);
        match self.stage {
            ReturnStage::Climbs => {
                let mut aim = self.hold.fly(inputs);
                let short_m = |z: f32| self.height_m - z;
                // The vehicle itself must have climbed, not only its setpoint. A vehicle that cannot climb must not fly
                // home too low.
                if short_m(inputs.present.position_m.z) < CLIMBED_M && short_m(inputs.state.position_m.z) < 1.0 {
                    self.stage = ReturnStage::Flies(inputs.towards(&home_m));
                }
                // The vehicle climbs while it is still stopping.
                aim.position_m.z = self.height_m;
                ModeOutput::fly(aim)
            }
            ReturnStage::Flies(yaw_rad) => {
                if inputs.is_at(&home_m, OVER_HOME_M) && inputs.present.velocity_m_s.norm_squared() < 0.3 * 0.3 {
                    self.stage = ReturnStage::Descends;
                }
                ModeOutput::fly(LimiterTarget { yaw_rad, ..inputs.to(home_m) })
            }
            ReturnStage::Descends => ModeOutput { lands: true, ..ModeOutput::fly(inputs.down(home_m)) },
        }
    }
}
