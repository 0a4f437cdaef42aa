//! Where every transcendental function of the control crates comes from.
//!
//! Nothing here reaches the platform's own library, so host and target give the same bits. Each function names its
//! source and its largest error against `f64`, measured over the stated range by `tests/math.rs`.
//!
//! `micromath` serves where its error is harmless: sine and cosine turn the virtual controls by the yaw angle and scale
//! thrust by the tilt, so 1.2e-3 there is a gain error of 0.1 %. It does not serve for `atan` (2.8e-3 rad of tilt would
//! be a lasting error of 9 mm in the baseline's position), `exp` (not monotone) or `sqrt` (6 %).

use micromath::F32Ext;

/// 2^x for x <= 0, ours: the nearest integer to x by the exponent's bits, 2^f for the rest by the polynomial that is
/// nearest to it in the relative sense. A third of what libm's costs. Error at most 9e-8 relative for x >= -126; 0 below
/// and for NaN.
#[inline]
pub fn exp2(x: f32) -> f32 {
    const P: [f32; 6] = [core::f32::consts::LN_2, 0.24022648, 0.055503618, 0.009618529, 0.0013390387, 0.00015320831];
    // So large a number has no places behind the point: adding it rounds, and leaves the integer, with the exponent's
    // bias, in its lowest bits.
    const LARGE: f32 = 12_582_912.0 + 127.0;
    let n = x + LARGE;
    let f = x - (n - LARGE);
    let p = P[0] + f * (P[1] + f * (P[2] + f * (P[3] + f * (P[4] + f * P[5]))));
    let y = (1.0 + f * p) * f32::from_bits(n.to_bits() << 23);
    // Last, and a choice rather than a branch: so the constants of several exponentials in a row are loaded once.
    if x >= -126.0 { y } else { 0.0 }
}

/// e^x; libm. For setting up. Error at most 8e-8 relative for -87 <= x <= 0, 0 below -104.
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// tanh x = (1 - t)/(1 + t) with t = e^(-2|x|). Error at most 1.2e-7 absolute for all x; a NaN counts as infinite.
#[inline]
pub fn tanh(x: f32) -> f32 {
    let t = exp2(-2.0 * core::f32::consts::LOG2_E * x.abs());
    ((1.0 - t) / (1.0 + t)).copysign(x)
}

/// atan x; libm. Error at most 9.1e-8 absolute for all x.
#[inline]
pub fn atan(x: f32) -> f32 {
    libm::atanf(x)
}

/// tan x by Lambert's continued fraction at x/2, for |x| <= 1.57; libm's own would bring double precision into an image
/// that needs it nowhere else. Error at most 3e-7 relative for |x| <= 1, 1e-4 at 1.57.
pub fn tan(x: f32) -> f32 {
    let y = 0.5 * x;
    let square = y * y;
    let half = y / (1.0 - square / (3.0 - square / (5.0 - square / (7.0 - square / 9.0))));
    2.0 * half / (1.0 - half * half)
}

/// The smaller one, `b` if `a` is not a number: a comparison, where `f32::min` is a call on processors without the
/// instruction.
#[inline]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger one, `b` if `a` is not a number.
#[inline]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The size of a vector's largest coordinate; NaN coordinates do not count.
#[inline]
pub fn abs_max(v: &nalgebra::Vector3<f32>) -> f32 {
    max(max(v.x.abs(), v.y.abs()), max(v.z.abs(), 0.0))
}

/// Square root; the processor's own or libm's, both correctly rounded.
#[inline]
pub fn sqrt(x: f32) -> f32 {
    afbc_fpu::sqrt(x)
}

/// sin x; micromath. Error at most 1.2e-3 absolute for |x| <= 1000 rad.
#[inline]
pub fn sin(x: f32) -> f32 {
    F32Ext::sin(x)
}

/// cos x; micromath. Error at most 1.2e-3 absolute for |x| <= 1000 rad.
#[inline]
pub fn cos(x: f32) -> f32 {
    F32Ext::cos(x)
}

/// cos phi cos theta, the cosine of a tilt: by their series within a quarter turn, error at most 1e-3 absolute; beyond, by
/// [`cos`].
#[inline]
pub fn tilt_cosine(phi: f32, theta: f32) -> f32 {
    if max(phi.abs(), theta.abs()) > core::f32::consts::FRAC_PI_2 {
        return cos(phi) * cos(theta);
    }
    let [cos_phi, cos_theta] = [phi * phi, theta * theta].map(|s| 1.0 - s * (0.5 - s * (1.0 / 24.0 - s / 720.0)));
    cos_phi * cos_theta
}

/// The angle's representative within \[-pi, pi\]; angles already there come back unchanged. For |x| <= 2000 rad.
#[inline]
pub fn wrap_angle(x: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    if x.abs() <= PI { x } else { (x - TAU * F32Ext::round(x / TAU)).clamp(-PI, PI) }
}
