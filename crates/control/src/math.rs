//! Transcendental functions for all control crates.
//!
//! None of them calls the platform's mathematical library, so results are bit-identical on host and target. Each
//! function states its source and its largest error against `f64`, measured over the stated range by `tests/math.rs`.
//!
//! `micromath` is used where its error is harmless: sine and cosine rotate the virtual controls by the yaw angle and
//! scale thrust by the tilt, where 1.2e-3 is a gain error of 0.1 %. It is not used for `atan` (2.8e-3 rad of tilt
//! would be a steady-state position error of 9 mm in the baseline flight), `exp` (not monotone) and `sqrt` (6 %).

use micromath::F32Ext;

/// 2^x for x <= 0: the nearest integer to x goes into the exponent's bits; 2^f of the remaining fraction is the
/// minimax polynomial for relative error. Takes a third of the time of libm's. Error at most 9e-8 relative for
/// x >= -126; 0 below and for NaN.
#[inline]
pub fn exp2(x: f32) -> f32 {
    const P: [f32; 6] = [core::f32::consts::LN_2, 0.24022648, 0.055503618, 0.009618529, 0.0013390387, 0.00015320831];
    // Numbers of this size have no fractional bits: the addition rounds x to an integer and leaves it, with the
    // exponent's bias, in the lowest bits.
    const LARGE: f32 = 12_582_912.0 + 127.0;
    let n = x + LARGE;
    let f = x - (n - LARGE);
    let p = P[0] + f * (P[1] + f * (P[2] + f * (P[3] + f * (P[4] + f * P[5]))));
    let y = (1.0 + f * p) * f32::from_bits(n.to_bits() << 23);
    // At the end and without a branch, so that several exponentials in a row share the loaded constants.
    if x >= -126.0 { y } else { 0.0 }
}

/// e^x; libm. For construction only. Error at most 8e-8 relative for -87 <= x <= 0, 0 below -104.
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// tanh x = (1 - t)/(1 + t) with t = e^(-2|x|). Error at most 1.2e-7 absolute for all x; NaN counts as infinite.
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

/// tan x by Lambert's continued fraction at x/2, for |x| <= 1.57; libm's would pull double-precision code into an
/// image that needs none. Error at most 3e-7 relative for |x| <= 1, 1e-4 at 1.57.
pub fn tan(x: f32) -> f32 {
    let y = 0.5 * x;
    let square = y * y;
    let half = y / (1.0 - square / (3.0 - square / (5.0 - square / (7.0 - square / 9.0))));
    2.0 * half / (1.0 - half * half)
}

/// The smaller of both, `b` if `a` is NaN. A comparison, because `f32::min` is a library call on processors without
/// such an instruction.
#[inline]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of both, `b` if `a` is NaN.
#[inline]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The largest absolute value of a vector's coordinates; NaN coordinates are ignored.
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

/// cos phi cos theta, the cosine of the tilt: by power series up to a quarter turn, error at most 1e-3 absolute; by
/// [`cos`] beyond.
#[inline]
pub fn tilt_cosine(phi: f32, theta: f32) -> f32 {
    if max(phi.abs(), theta.abs()) > core::f32::consts::FRAC_PI_2 {
        return cos(phi) * cos(theta);
    }
    let [cos_phi, cos_theta] = [phi * phi, theta * theta].map(|s| 1.0 - s * (0.5 - s * (1.0 / 24.0 - s / 720.0)));
    cos_phi * cos_theta
}

/// Wraps an angle to \[-pi, pi\]; angles within it are returned unchanged. For |x| <= 2000 rad.
#[inline]
pub fn wrap_angle(x: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    if x.abs() <= PI { x } else { (x - TAU * F32Ext::round(x / TAU)).clamp(-PI, PI) }
}
