//! Place of a sensor on the vehicle.

use crate::body_axes::BodyAxes;
use crate::rigid_body::quaternion;
use crate::truth::Truth;
use afbc_types::parameters;
use nalgebra::Vector3;

parameters! {
    /// Mounting of the inertial sensor.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Mounting {
        /// Position of the sensor, from the centre of mass, body frame.
        #[parameter(POS, "m", -10.0..=10.0)]
        pub position_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0),
        /// Roll, pitch and yaw of the sensor in the body frame.
        #[parameter(ATT, "rad", -7.0..=7.0)]
        pub attitude_rad: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0),
    }
}

impl Mounting {
    /// Converts a vector from sensor to body coordinates, as flight software does that knows the mounting.
    pub fn to_body(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Mounted::new(self).axes.to_earth(v)
    }
}

/// A mounting with its rotation worked out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mounted {
    position_m: Vector3<f64>,
    /// Sensor axes in the body frame, which stands for the earth's here.
    axes: BodyAxes,
}

impl Mounted {
    pub(super) fn new(mounting: &Mounting) -> Self {
        let [w, x, y, z] = quaternion(&mounting.attitude_rad);
        Mounted { position_m: mounting.position_m, axes: BodyAxes::of_quaternion(w, x, y, z) }
    }

    /// Returns angular rate and specific force at the sensor, sensor axes: f + d omega/dt x r + omega x (omega x r).
    pub(super) fn feel(&self, truth: &Truth) -> [Vector3<f64>; 2] {
        let (omega, r) = (truth.rates_rad_s, self.position_m);
        let lever = truth.angular_acceleration_rad_s2.cross(&r) + omega.cross(&omega.cross(&r));
        [self.axes.to_body(&omega), self.axes.to_body(&(truth.specific_force_m_s2() + lever))]
    }
}
