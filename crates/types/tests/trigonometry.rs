//! Compares sine and cosine with double precision.
#![allow(missing_docs)]

use afbc_types::sin_cos;
use proptest::prelude::*;

fn check(angle: f32, error: f64) {
    let (sine, cosine) = sin_cos(angle);
    let (sine_64, cosine_64) = f64::from(angle).sin_cos();
    let off = (f64::from(sine) - sine_64).abs().max((f64::from(cosine) - cosine_64).abs());
    assert!(off <= error, "{angle}: {off}");
}

#[test]
fn they_are_exact_where_they_must_be() {
    assert_eq!(sin_cos(0.0), (0.0, 1.0));
    for quarter in -1270..=1270_i16 {
        for eighth in [0.0, 0.5] {
            check((f32::from(quarter) + eighth) * core::f32::consts::FRAC_PI_2, 1.3e-7);
        }
    }
    let (sine, cosine) = sin_cos(f32::NAN);
    assert!(sine.is_nan() && cosine.is_nan());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200_000))]
    #[test]
    fn they_are_those_of_double_precision(angle in -2000.0_f32..2000.0) {
        check(angle, 1.3e-7);
    }
}

proptest! {
    #[test]
    fn small_angles_keep_their_digits(angle in -1e-3_f32..1e-3) {
        let (sine, _) = sin_cos(angle);
        prop_assert!((f64::from(sine) - f64::from(angle).sin()).abs() <= 1e-7 * f64::from(angle.abs()));
    }
}
