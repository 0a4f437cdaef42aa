//! Where every transcendental function of the control crate comes from.
//!
//! Nothing here reaches the platform's own library, so host and target give the same bits. Each function names its
//! source and its largest error against `f64`, measured over the stated range by `tests/math.rs`.
//!
//! `micromath` serves where its error is harmless: sine and cosine turn the virtual controls by the yaw angle and scale
//! thrust by the tilt, so 1.2e-3 there is a gain error of 0.1 %. It does not serve for `atan` (2.8e-3 rad of tilt would
//! be a lasting error of 9 mm in the baseline's position), `exp` (not monotone) or `sqrt` (6 %); those are `libm`'s.

use micromath::F32Ext;

/// e^x; libm. Error at most 8e-8 relative for -87 <= x <= 0, 0 below -104.
#[inline]
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// tanh x = (1 - t)/(1 + t) with t = e^(-2|x|) from libm: half of what libm's own tanh costs where it costs most. Error at
/// most 1.2e-7 absolute for all x; a NaN counts as infinite.
#[inline]
pub fn tanh(x: f32) -> f32 {
    let size = x.abs();
    // From here on tanh rounds to 1.
    let tanh = if size < 9.02 {
        let t = exp(-2.0 * size);
        (1.0 - t) / (1.0 + t)
    } else {
        1.0
    };
    tanh.copysign(x)
}

/// atan x; libm. Error at most 9.1e-8 absolute for all x.
#[inline]
pub fn atan(x: f32) -> f32 {
    libm::atanf(x)
}

/// tan x; libm. For setting up: it costs a processor without double precision some 1700 instructions.
pub fn tan(x: f32) -> f32 {
    libm::tanf(x)
}

/// Square root; the processor's own or libm's, both correctly rounded.
#[inline]
pub fn sqrt(x: f32) -> f32 {
    fpu::sqrt(x)
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

/// The angle's representative within \[-pi, pi\]; angles already there come back unchanged. For |x| <= 2000 rad.
#[inline]
pub fn wrap_angle(x: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    if x.abs() <= PI { x } else { (x - TAU * F32Ext::round(x / TAU)).clamp(-PI, PI) }
}
