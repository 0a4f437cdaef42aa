//! Mounting of a part on its board: rotation matrices from the part's axes to the body's (x forward, y left, z up).
//!
//! Names are Betaflight's: the degrees tell how far the part is turned clockwise, seen from above, from the orientation
//! in which its axes are the body's. A part with `FLIP` is upside down: it is first turned by 180 degrees about its y
//! axis.

use crate::reading::InertialReading;
use nalgebra::{Matrix3, Vector3};

/// Not turned.
pub const CW0: Matrix3<f32> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
/// The part's x points to the right.
pub const CW90: Matrix3<f32> = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
/// The part's x points backwards.
pub const CW180: Matrix3<f32> = Matrix3::new(-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0);
/// The part's x points to the left.
pub const CW270: Matrix3<f32> = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
/// Upside down, the part's x points backwards.
pub const CW0_FLIP: Matrix3<f32> = Matrix3::new(-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0);
/// Upside down, the part's x points to the left.
pub const CW90_FLIP: Matrix3<f32> = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
/// Upside down, the part's x points forward.
pub const CW180_FLIP: Matrix3<f32> = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
/// Upside down, the part's x points to the right.
pub const CW270_FLIP: Matrix3<f32> = Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0);

/// Returns an IMU's rates \[rad/s\] and specific force \[m/s2\] in the body's axes.
#[must_use]
pub fn turned(reading: &InertialReading, to_body: &Matrix3<f32>) -> [Vector3<f32>; 2] {
    [reading.rates_rad_s, reading.specific_force_m_s2].map(|value| to_body * value)
}
