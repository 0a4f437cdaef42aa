//! Body axes in the earth frame.
//!
//! The plant has its own rotations in `f64`, so that no law is judged by the functions that it uses itself.

use nalgebra::Vector3;

/// Columns of `r_earth_body`. Written out, because a general matrix product takes three times as long.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyAxes {
    pub(crate) forward: Vector3<f64>,
    pub(crate) left: Vector3<f64>,
    pub(crate) up: Vector3<f64>,
}

impl BodyAxes {
    /// Returns the axes of a body with this unit quaternion (body to earth).
    #[inline]
    pub(crate) fn of_quaternion(w: f64, x: f64, y: f64, z: f64) -> Self {
        let (x2, y2, z2) = (2.0 * x, 2.0 * y, 2.0 * z);
        BodyAxes {
            forward: Vector3::new(1.0 - (y * y2 + z * z2), x * y2 + w * z2, x * z2 - w * y2),
            left: Vector3::new(x * y2 - w * z2, 1.0 - (x * x2 + z * z2), y * z2 + w * x2),
            up: Vector3::new(w * y2 + x * z2, y * z2 - w * x2, 1.0 - (x * x2 + y * y2)),
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

    /// Returns the earth z coordinate of a vector in body coordinates.
    #[inline]
    pub(crate) fn height(&self, v: &Vector3<f64>) -> f64 {
        self.forward.z * v.x + self.left.z * v.y + self.up.z * v.z
    }
}
