//! The square root against that of double precision.
#![allow(missing_docs)]

use afbc_fpu::sqrt;

/// Rounding twice, to double and then to single precision, is rounding once: 53 bits are more than twice 24 and two.
#[test]
fn it_is_rounded_correctly() {
    for bits in (0..=u32::MAX).step_by(6_553).chain([0, 0x8000_0000, 1, 0x007F_FFFF, 0x0080_0000, 0x7F80_0000]) {
        let x = f32::from_bits(bits);
        let (root, wanted) = (sqrt(x), f64::from(x).sqrt() as f32);
        assert!(root.to_bits() == wanted.to_bits() || root.is_nan() && wanted.is_nan(), "{x}: {root}, not {wanted}");
    }
}
