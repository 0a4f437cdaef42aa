//! The body's axes in the earth frame.
//!
//! The plant's rotations are its own, in `f64`: no law is judged by the functions that it turns vectors with.

use nalgebra::Vector3;

/// The columns of `r_earth_body`. Written out, since a general matrix product takes three times as long.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyAxes {
    pub(crate) forward: Vector3<f64>,
    pub(crate) left: Vector3<f64>,
    pub(crate) up: Vector3<f64>,
}

impl BodyAxes {
    /// Returns the axes of a body with this unit quaternion, body to earth.
    #[inline]
    pub(crate) fn of_quaternion(w: f64, x: f64, y: f64, z: f64) -> Self {
        BodyAxes {
            forward: Vector3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
            left: Vector3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
            up: Vector3::new(2.0 * (w * y + x * z), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
        }
    }

    /// Converts a vector from body to earth coordinates.
    #[inline]
    pub(crate) fn to_earth(self, v: &Vector3<f64>) -> Vector3<f64> {
        self.forward * v.x + self.left * v.y + self.up * v.z
    }

    /// Converts a vector from earth to body coordinates.
    #[inline]
    pub(crate) fn to_body(self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.forward.dot(v), self.left.dot(v), self.up.dot(v))
    }

    /// Returns the height of a vector in body coordinates.
    #[inline]
    pub(crate) fn height(&self, v: &Vector3<f64>) -> f64 {
        self.forward.z * v.x + self.left.z * v.y + self.up.z * v.z
    }
}
