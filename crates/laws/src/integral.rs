//! Bounded integrals with anti-windup.

use nalgebra::Vector3;

/// Largest integral of rate and attitude errors \[rad/s2\].
pub(crate) const RATE_INTEGRAL_MAX_RAD_S2: f32 = 20.0;

/// Returns `integral` one step later, clipped to +-`max` in each coordinate.
#[inline]
pub(crate) fn integrate(integral: &Vector3<f32>, rate: &Vector3<f32>, dt_s: f32, max: f32) -> Vector3<f32> {
    (integral + rate * dt_s).map(|i| i.max(-max).min(max))
}

/// Returns `error`, or 0 if it would drive an integral further into the saturation that `missing` shows.
#[inline]
pub(crate) fn away_from(error: f32, missing: f32) -> f32 {
    if missing > 0.0 {
        error.min(0.0)
    } else if missing < 0.0 {
        error.max(0.0)
    } else {
        error
    }
}
