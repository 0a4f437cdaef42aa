//! Which places are flown to: the same answer for whoever orders, uploads or flies one.

use nalgebra::Vector3;

/// Largest coordinate of a place that is flown to \[m\].
// Setpoints beyond 1e5 m are implausible: some room is left for the way.
const PLACE_MAX_M: f32 = 9e4;

/// True of a coordinate that is flown to; false of NaN.
pub(crate) fn is_within(value_m: f32) -> bool {
    value_m.abs() <= PLACE_MAX_M
}

/// True if every coordinate is a number that is flown to, or NaN.
pub fn is_place(place_m: &Vector3<f32>) -> bool {
    place_m.iter().all(|value| value.is_nan() || is_within(*value))
}
