//! The vehicle's local frame in the simulator's earth frame.

use crate::ServedVehicle;
use nalgebra::Vector3;

/// Where the local frame of a vehicle is that nobody tells where it is: it counts as knowing its place when it is
/// armed, as for a pilot who reads its position there.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LocalFrame {
    /// Origin of the local frame, in the earth frame \[m\].
    shift_m: Vector3<f32>,
}

impl LocalFrame {
    /// Looks at a vehicle after a step.
    pub(crate) fn look(&mut self, vehicle: &ServedVehicle) {
        let Some(report) = vehicle.report() else { return };
        // A tracker tells it.
        let told = vehicle.scenario().instruments.tracker.is_some();
        if let Some(estimate) = report.estimate.filter(|_| !told && !report.mode.armed()) {
            let truth_m: Vector3<f32> = vehicle.world().plant().motion().position_m.cast();
            self.shift_m = truth_m - estimate.position_m;
        }
    }

    /// Returns a place of the local frame in the earth frame \[m\].
    pub(crate) fn earth(&self, local_m: &Vector3<f32>) -> Vector3<f32> {
        local_m + self.shift_m
    }

    /// Returns a place of the earth frame in the local one \[m\].
    pub(crate) fn local(&self, earth_m: &Vector3<f32>) -> Vector3<f32> {
        earth_m - self.shift_m
    }
}
