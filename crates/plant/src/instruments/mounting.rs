//! Position and rotation of a sensor on the vehicle.

use crate::body_axes::BodyAxes;
use crate::rigid_body::quaternion;
use crate::truth::Truth;
use afbc_types::Mounting;
use nalgebra::Vector3;

/// Mounting with precomputed rotation.
#[derive(Clone, Copy, Debug)]
pub(super) struct MountedSensor {
    position_m: Vector3<f64>,
    /// Sensor axes in the body frame; [`BodyAxes`] is used with body in place of earth and sensor in place of body.
    axes: BodyAxes,
}

impl MountedSensor {
    /// Creates the mounting of a sensor that is displaced by `lever_m` from its stated position.
    pub(super) fn new(mounting: &Mounting<f64>, lever_m: &Vector3<f64>) -> Self {
        let [w, x, y, z] = quaternion(&mounting.attitude_rad);
        MountedSensor { position_m: mounting.position_m + lever_m, axes: BodyAxes::of_quaternion(w, x, y, z) }
    }

    /// Returns angular rate and specific force at the sensor in sensor axes: f + d omega/dt x r + omega x (omega x r).
    pub(super) fn feel(&self, truth: &Truth) -> [Vector3<f64>; 2] {
        let (omega, r) = (truth.rates_rad_s, self.position_m);
        let lever = truth.angular_acceleration_rad_s2.cross(&r) + omega.cross(&omega.cross(&r));
        [self.axes.to_body(&omega), self.axes.to_body(&(truth.specific_force_m_s2() + lever))]
    }
}
