//! Range of places that may be flown to, shared by the checks of orders, uploads and missions.

use nalgebra::Vector3;

/// Largest coordinate of a place that may be flown to \[m\]. Setpoints are implausible beyond 1e5 m; this leaves room
/// for the path.
const PLACE_MAX_M: f32 = 9e4;

/// True if a coordinate may be flown to; false for NaN.
pub(crate) fn is_within(value_m: f32) -> bool {
    value_m.abs() <= PLACE_MAX_M
}

/// True if every coordinate may be flown to or is NaN.
pub fn is_place(place_m: &Vector3<f32>) -> bool {
    place_m.iter().all(|value| value.is_nan() || is_within(*value))
}
