//! The body's axes in the earth frame.
//!
//! The plant's rotations are its own, in `f64`: no law is judged by the functions that it turns vectors with.

use nalgebra::Vector3;

/// The columns of `r_earth_body`. Written out, a rotation takes a third of the time of a general matrix product.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyAxes {
    pub(crate) forward: Vector3<f64>,
    pub(crate) left: Vector3<f64>,
    pub(crate) up: Vector3<f64>,
}

impl BodyAxes {
    /// Earth coordinates of a vector in body coordinates.
    #[inline]
    pub(crate) fn to_earth(self, v: &Vector3<f64>) -> Vector3<f64> {
        self.forward * v.x + self.left * v.y + self.up * v.z
    }

    /// Body coordinates of a vector in earth coordinates.
    #[inline]
    pub(crate) fn to_body(self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.forward.dot(v), self.left.dot(v), self.up.dot(v))
    }

    /// Height of a vector in body coordinates.
    #[inline]
    pub(crate) fn height(&self, v: &Vector3<f64>) -> f64 {
        self.forward.z * v.x + self.left.z * v.y + self.up.z * v.z
    }
}
