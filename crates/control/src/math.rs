//! Transcendental functions for all control crates.
//!
//! None of them calls the platform's mathematical library, so results are bit-identical on host and target. Each
//! function states its source and its largest error against `f64`, measured over the stated range by `tests/math.rs`.
//!
//! `micromath` is used where its error is harmless: sine and cosine rotate the virtual controls by the yaw angle and
//! scale thrust by the tilt, where 1.2e-3 is a gain error of 0.1 %. It is not used for `atan` (2.8e-3 rad of tilt
//! would be a steady-state position error of 9 mm in the baseline flight), `exp` (not monotone) and `sqrt` (6 %).

use micromath::F32Ext;

/// Powers of 2 between 1 and 2 that [`exp2`] looks up.
const STEPS: usize = 64;

/// Bits of 2^(i/64), less those that i itself adds to the exponent.
const POWERS: [u32; STEPS] = {
    let mut powers = [0; STEPS];
    let mut i = 0;
    while i < STEPS {
        // e^y by its series, to 1e-17.
        let y = core::f64::consts::LN_2 * i as f64 / STEPS as f64;
        let (mut power, mut n) = (1.0, 20.0);
        while n > 0.0 {
            power = 1.0 + y / n * power;
            n -= 1.0;
        }
        powers[i] = (power as f32).to_bits() - ((i as u32) << 17);
        i += 1;
    }
    powers
};

/// 2^x for x <= 0: a table's power of the nearest 64th to x, times 2^f of the remainder by the quadratic of least
/// relative error. Takes a fourth of the time of libm's. Error at most 1.5e-7 relative for x >= -126; 2^-126 below and
/// for NaN.
#[inline]
pub fn exp2(x: f32) -> f32 {
    let x = max(x, -126.0);
    // Numbers of this size have six fractional bits: the addition rounds x to a 64th and leaves it in the lowest bits.
    const LARGE: f32 = 196_608.0;
    let n = x + LARGE;
    let f = x - (n - LARGE);
    let bits = n.to_bits();
    let power = POWERS.get(bits as usize % STEPS).copied().unwrap_or_default();
    let power = f32::from_bits(power.wrapping_add(bits << 17));
    power + power * (f * (0.693_149_7 + f * 0.240_226_5))
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
