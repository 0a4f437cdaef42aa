//! Sine and cosine in single precision only: libm's reduce the angle in double precision, for which a Cortex-M4F has no
//! instructions.

use core::f32::consts::FRAC_2_PI;

/// pi/2 in three parts. The first two have so few bits that their products with a number of quarter turns are exact
/// (Cody and Waite, *Software Manual for the Elementary Functions*, 1980).
const QUARTER: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
/// Adding and subtracting this constant rounds to the nearest integer, for sizes up to 2^22.
const ROUND: f32 = 12_582_912.0;

/// Returns sine and cosine of an angle of at most 2000 rad in size, with an error of at most 1.3e-7.
///
/// Uses minimax polynomials within an eighth of a turn, those of `sinf` and `cosf` in Moshier's Cephes.
#[inline]
pub fn sin_cos(angle_rad: f32) -> (f32, f32) {
    let quarters = (angle_rad * FRAC_2_PI + ROUND) - ROUND;
    let [first, second, third] = QUARTER;
    let x = ((angle_rad - quarters * first) - quarters * second) - quarters * third;
    let z = x * x;
    let sine = x + x * z * (-1.666_665_5e-1 + z * (8.332_161e-3 - z * 1.951_529_6e-4));
    let cosine = 1.0 - 0.5 * z + z * z * (4.166_664_6e-2 + z * (-1.388_731_6e-3 + z * 2.443_315_7e-5));
    // The two lowest bits are the quarter turns modulo 4. In two's complement, this also holds below zero.
    match quarters as i32 & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}
