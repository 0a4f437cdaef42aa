//! Conversion between the vehicle's local frame and the simulator's earth frame.

use crate::ServedVehicle;
use nalgebra::Vector3;

/// Offset between the vehicle's local frame and the earth frame. It is updated until the vehicle is armed: from then
/// on, the page shows positions as if the estimate had been exact at that time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LocalFrame {
    /// Position of the local frame's origin in the earth frame \[m\].
    shift_m: Vector3<f32>,
}

impl LocalFrame {
    /// Updates the offset after a step.
    pub(crate) fn update(&mut self, vehicle: &ServedVehicle) {
        let Some(report) = vehicle.report() else { return };
        // With a tracker, both frames are the same.
        let told = vehicle.scenario().instruments.tracker.is_some();
        if let Some(estimate) = report.estimate.filter(|_| !told && !report.mode.armed()) {
            let truth_m: Vector3<f32> = vehicle.world().plant().motion().position_m.cast();
            self.shift_m = truth_m - estimate.position_m;
        }
    }

    /// Converts a place from the local frame to the earth frame \[m\].
    pub(crate) fn earth(&self, local_m: &Vector3<f32>) -> Vector3<f32> {
        local_m + self.shift_m
    }

    /// Converts a place from the earth frame to the local frame \[m\].
    pub(crate) fn local(&self, earth_m: &Vector3<f32>) -> Vector3<f32> {
        earth_m - self.shift_m
    }
}
