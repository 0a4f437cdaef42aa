//! Mounting of a sensor on the vehicle.

use crate::{ParameterNumber, parameters, sin_cos};
use nalgebra::{Matrix3, Vector3};

parameters! {
    /// Mounting of the inertial sensor. The plant has the true mounting in `f64`, flight software the nominal one in
    /// `f32`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    #[cfg_attr(feature = "serde", serde(bound = "T: crate::ParameterNumber + serde::Serialize"))]
    pub struct Mounting<T = f32, f64> {
        /// Position of the sensor, from the centre of mass, body frame.
        #[parameter(POS, "m", -10.0..=10.0)]
        pub position_m: Vector3<T> = Vector3::new(0.0, 0.0, 0.0),
        /// Roll, pitch and yaw of the sensor in the body frame.
        #[parameter(ATT, "rad", -7.0..=7.0)]
        pub attitude_rad: Vector3<T> = Vector3::new(0.0, 0.0, 0.0),
    }
}

impl Mounting {
    /// Sensor at the centre of mass, along the body's axes.
    pub const PLAIN: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        Mounting { position_m: zero, attitude_rad: zero }
    };

    /// Returns the matrix that turns the sensor's axes into the body's, Rz(yaw) Ry(pitch) Rx(roll).
    #[must_use]
    pub fn r_body_sensor(&self) -> Matrix3<f32> {
        let [[roll, pitch, yaw]] = self.attitude_rad.data.0;
        let [(sr, cr), (sp, cp), (sy, cy)] = [roll, pitch, yaw].map(sin_cos);
        let x = Vector3::new(cy * cp, sy * cp, -sp);
        let y = Vector3::new(cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr);
        let z = Vector3::new(cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr);
        Matrix3::from_columns(&[x, y, z])
    }
}

impl<T: ParameterNumber> Mounting<T> {
    /// True if the sensor is at the centre of mass, along the body's axes, so that the mounting changes nothing.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        self.position_m.iter().chain(&self.attitude_rad).all(|&part| part.into() == 0.0)
    }
}

impl Mounting<f64> {
    /// Returns the mounting in flight software's precision.
    #[must_use]
    pub fn to_f32(&self) -> Mounting {
        Mounting { position_m: self.position_m.cast(), attitude_rad: self.attitude_rad.cast() }
    }
}
