//! Transcendental functions of all control crates.
//!
//! None of them calls the platform's mathematical library, so results are bit-identical on host and target. Each
//! function states its largest error against `f64`, measured over the stated range by `tests/math.rs`. Functions
//! without a source are minimax polynomials and quotients, as short as their use allows. For example, sine and cosine
//! rotate the virtual controls by the yaw angle and scale thrust by the tilt, where an error of 1e-4 is a gain error of
//! 0.01 %.
//!
//! | function | from | why |
//! |---|---|---|
//! | [`exp2`], [`tanh`], [`atan`], [`tan`] | here | same precision as libm in a fourth of its time |
//! | [`sin`], [`cos`] | here | 1.7e-4 is enough for a projection; micromath has 2e-3 |
//! | `sin_cos` of the types crate | Cephes' polynomials | 1.3e-7, for computing attitudes |
//! | [`sqrt`] | the FPU, or libm without one | one instruction, correctly rounded; micromath is off by 5 % |
//! | [`exp`], and `atan2` where a heading is flown | libm | before flight, or not in every tick |
//! | `floor`, `atan2` for display on a station | micromath | short; 0.16 degrees, for a course good to some degrees |

/// Number of powers of 2 between 1 and 2 in the table of [`exp2`].
const STEPS: usize = 64;

/// Bits of 2^(i/64), minus the bits that i itself adds to the exponent.
#[allow(clippy::indexing_slicing, reason = "the compiler evaluates it and checks the index")]
const POWERS: [u32; STEPS] = {
    let mut powers = [0; STEPS];
    let mut i = 0;
    while i < STEPS {
        // e^y by its series, accurate to 1e-17.
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

/// Returns 2^x for x <= 0: a table's power of the nearest 64th to x, times 2^f of the remainder by a quadratic of least
/// relative error. Takes a fourth of libm's time. Error at most 1.5e-7 relative for x >= -126; returns 2^-126 below.
#[inline]
pub fn exp2(x: f32) -> f32 {
    // `max` with the constant first compiles without a copy.
    let x = max(-126.0, x);
    // Numbers of this size have six fractional bits: the addition rounds x to a 64th and leaves it in the lowest bits.
    const LARGE: f32 = 196_608.0;
    let n = x + LARGE;
    let f = x - (n - LARGE);
    let bits = n.to_bits();
    // The index is always in range; `get` keeps a panic out of the tick.
    let power = POWERS.get(bits as usize % STEPS).copied().unwrap_or_default();
    // Modulo 2^32: a negative number of 1/64 steps lowers the exponent, which -126 keeps above subnormal numbers.
    let power = f32::from_bits(power.wrapping_add(bits << 17));
    power + power * (f * (0.693_149_7 + f * 0.240_226_5))
}

/// Returns e^x, by libm. For construction only. Error at most 8e-8 relative for -87 <= x <= 0; 0 below -104.
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// Returns tanh x = (1 - t)/(1 + t) with t = e^(-2|x|). Error at most 1.2e-7 absolute for all x.
#[inline]
pub fn tanh(x: f32) -> f32 {
    let t = exp2(-2.0 * core::f32::consts::LOG2_E * x.abs());
    ((1.0 - t) / (1.0 + t)).copysign(x)
}

/// Returns atan x: x plus a quotient of polynomials for |x| <= 1, and a quarter turn minus atan 1/x beyond. Error at
/// most 1.7e-7 absolute for all x, 1e-7 for |x| <= 1.
#[inline]
pub fn atan(x: f32) -> f32 {
    let steep = x.abs() > 1.0;
    let t = if steep { 1.0 / x } else { x };
    let s = t * t;
    let above = s * (-0.333_330_06 - s * (0.184_124_17 + s * 0.002_808_310_8));
    let angle = t + t * (above / (1.0 + s * (1.152_216_1 + s * 0.272_099_2)));
    if steep { core::f32::consts::FRAC_PI_2.copysign(x) - angle } else { angle }
}

/// Returns tan x for |x| <= 1.57, by Lambert's continued fraction at x/2. libm's would pull double-precision code into
/// an image that needs none. Error at most 3e-7 relative for |x| <= 1, 1e-4 at 1.57.
pub fn tan(x: f32) -> f32 {
    let y = 0.5 * x;
    let square = y * y;
    let half = y / (1.0 - square / (3.0 - square / (5.0 - square / (7.0 - square / 9.0))));
    // tan(x/2) is below 1 for |x| <= 1.57, so the divisor is positive.
    2.0 * half / (1.0 - half * half)
}

/// Returns the smaller number; `b` if `a` is NaN. Uses a comparison, because `f32::min` is a library call on processors
/// without such an instruction.
#[inline]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Returns the larger number; `b` if `a` is NaN.
#[inline]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Returns `x` limited to +-`most`; -`most` if `x` is NaN.
#[inline]
pub fn limited(x: f32, most: f32) -> f32 {
    // The usual case within the limits takes one comparison instead of two.
    if x.abs() < most { x } else { min(max(x, -most), most) }
}

/// Returns `x` after adding 1e-25 and subtracting it again: zero for |x| < 3e-33, and never subnormal. For the memory
/// of filters, whose decay would otherwise end in subnormal numbers, which some processors take a hundred times as long
/// to compute with. Error at most 6e-33 plus 1.2e-7 relative; none for |x| >= 4e-18.
#[inline]
pub fn settled(x: f32) -> f32 {
    const SMALL: f32 = 1e-25;
    (x + SMALL) - SMALL
}

/// Returns the largest absolute value of a vector's coordinates, none of which may be NaN.
#[inline]
pub fn abs_max(v: &nalgebra::Vector3<f32>) -> f32 {
    max(max(v.x.abs(), v.y.abs()), v.z.abs())
}

/// Returns the square root, by the processor or by libm, both correctly rounded.
#[inline]
pub fn sqrt(x: f32) -> f32 {
    afbc_fpu::sqrt(x)
}

/// Returns the nearest integer, for |x| <= 2^22. Numbers of the constant's size have no fractional bits.
#[inline]
fn round(x: f32) -> f32 {
    const LARGE: f32 = 12_582_912.0;
    (x + LARGE) - LARGE
}

/// Returns cos(2 pi turns), as the sine of the distance to the next quarter or three quarters of a turn. Exactly 1 for
/// 0.
#[inline]
fn cos_of_turns(turns: f32) -> f32 {
    let u = 0.25 - (turns - round(turns)).abs();
    let s = u * u;
    u * (6.280_971_5 + s * (-41.069_5 + s * 73.183_26))
}

/// Returns sin x. Error at most 1.7e-4 absolute for |x| <= 1000 rad.
#[inline]
pub fn sin(x: f32) -> f32 {
    cos_of_turns(x * (1.0 / core::f32::consts::TAU) - 0.25)
}

/// Returns cos x. Error at most 1.7e-4 absolute for |x| <= 1000 rad.
#[inline]
pub fn cos(x: f32) -> f32 {
    cos_of_turns(x * (1.0 / core::f32::consts::TAU))
}

/// Returns cos phi cos theta, the cosine of the tilt.
#[inline]
pub fn tilt_cosine(phi: f32, theta: f32) -> f32 {
    cos(phi) * cos(theta)
}

/// Wraps an angle to \[-pi, pi\], for |x| <= 2000 rad. Angles within \[-pi, pi\] are returned unchanged.
#[inline]
pub fn wrap_angle(x: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    // The result is at most half a turn, whose product with a full turn is exactly pi.
    let turns = x * (1.0 / TAU);
    if x.abs() <= PI { x } else { (turns - round(turns)) * TAU }
}
