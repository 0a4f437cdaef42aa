//! Tests the largest error of every function of `afbc_control::math` over its documented range, against `f64`. The
//! bounds are the documented figures.

use afbc_control::math;
use afbc_control::nalgebra::Vector3;
use core::f32::consts::{FRAC_PI_2, PI};
use proptest::prelude::*;

/// Returns every `stride`-th finite `f32` bit pattern of both signs: equally dense at all magnitudes.
fn bit_sweep(stride: usize) -> impl Iterator<Item = f32> {
    (0..f32::INFINITY.to_bits()).step_by(stride).flat_map(|bits| [f32::from_bits(bits), -f32::from_bits(bits)])
}

/// Returns even steps from `from` to `to`, both included.
fn even_sweep(from: f32, to: f32, count: u32) -> impl Iterator<Item = f32> {
    (0..=count)
        .map(move |i| (f64::from(from) + (f64::from(to) - f64::from(from)) * f64::from(i) / f64::from(count)) as f32)
}

/// Returns the largest error and its position.
fn worst(points: impl Iterator<Item = f32>, error: impl Fn(f32) -> f64) -> (f64, f32) {
    points.fold((0.0, 0.0), |(largest, at), x| {
        let e = error(x);
        // The comparison counts NaN as the worst.
        if e <= largest { (largest, at) } else { (e, x) }
    })
}

fn absolute(ours: fn(f32) -> f32, exact: fn(f64) -> f64) -> impl Fn(f32) -> f64 {
    move |x| (f64::from(ours(x)) - exact(f64::from(x))).abs()
}

/// Asserts that the largest error is at most `bound` and at least half of it, so that the documented figure is neither
/// too small nor too large.
fn assert_figure(name: &str, (error, at): (f64, f32), bound: f64) {
    println!("{name}: {error:.4e} at {at:e}, documented {bound:e}");
    assert!(error <= bound, "{name}: error {error:e} at {at:e} is above the documented {bound:e}");
    assert!(error >= 0.5 * bound, "{name}: documented {bound:e}, yet the largest error is {error:e}");
}

#[test]
fn exp_is_as_exact_as_documented() {
    let relative = |x: f32| (f64::from(math::exp(x)) / f64::from(x).exp() - 1.0).abs();
    let points = even_sweep(-87.0, 0.0, 8_000_000).chain(bit_sweep(997).filter(|x| (-87.0..=0.0).contains(x)));
    assert_figure("exp", worst(points, relative), 8e-8);
}

#[test]
fn exp_is_0_below_minus_104_1_at_0_and_never_above_1_for_what_is_not_positive() {
    assert_eq!(math::exp(0.0), 1.0);
    assert_eq!(math::exp(-0.0), 1.0);
    assert_eq!(math::exp(f32::NEG_INFINITY), 0.0);
    for x in bit_sweep(997).filter(|x| *x <= 0.0) {
        let y = math::exp(x);
        assert!((0.0..=1.0).contains(&y), "exp({x:e}) = {y:e}");
        assert!(x > -104.0 || y == 0.0, "exp({x:e}) = {y:e}");
    }
}

#[test]
fn exp_never_falls_as_its_argument_grows() {
    let mut last = 0.0;
    for x in even_sweep(-105.0, 0.0, 4_000_000) {
        let y = math::exp(x);
        assert!(y >= last, "exp falls before {x:e}: {last:e} to {y:e}");
        last = y;
    }
}

#[test]
fn exp2_is_as_exact_as_documented_and_least_below() {
    let relative = |x: f32| (f64::from(math::exp2(x)) / f64::from(x).exp2() - 1.0).abs();
    let points = even_sweep(-126.0, 0.0, 8_000_000).chain(bit_sweep(997).filter(|x| (-126.0..=0.0).contains(x)));
    assert_figure("exp2", worst(points, relative), 1.5e-7);
    for x in bit_sweep(997).filter(|x| *x <= 0.0).chain([f32::NEG_INFINITY]) {
        let y = math::exp2(x);
        assert!(
            (f32::MIN_POSITIVE..=1.0).contains(&y) && (x >= -126.0 || y == f32::MIN_POSITIVE),
            "exp2({x:e}) = {y:e}"
        );
    }
}

#[test]
fn tanh_never_passes_1_nor_changes_its_sign() {
    for x in bit_sweep(499).chain(even_sweep(-10.0, 10.0, 4_000_000)).chain([f32::INFINITY, f32::NEG_INFINITY]) {
        let y = math::tanh(x);
        assert!(y.abs() <= 1.0 && y * x >= 0.0, "tanh({x:e}) = {y:e}");
    }
}

#[test]
fn tan_and_tilt_cosine_are_as_exact_as_documented() {
    let relative = |x: f32| (f64::from(math::tan(x)) / f64::from(x).tan() - 1.0).abs();
    assert_figure("tan", worst(even_sweep(1e-3, 1.0, 1_000_000), relative), 3e-7);
    assert_figure("tan near a quarter turn", worst(even_sweep(1.0, 1.57, 1_000_000), relative), 1e-4);
    let alone = |x: f32| (f64::from(math::tilt_cosine(x, 0.0)) - f64::from(x).cos()).abs();
    assert_figure("tilt_cosine", worst(even_sweep(-FRAC_PI_2, FRAC_PI_2, 1_000_000), alone), 1e-4);
    let both =
        |x: f32| (f64::from(math::tilt_cosine(x, 1.3 * x)) - f64::from(x).cos() * f64::from(1.3 * x).cos()).abs();
    // The product has two cosines, each accurate to 1.7e-4.
    assert!(worst(even_sweep(-700.0, 700.0, 1_000_000), both).0 <= 3.4e-4);
}

#[test]
fn tanh_is_as_exact_as_documented() {
    let points = bit_sweep(499).chain(even_sweep(-10.0, 10.0, 4_000_000));
    assert_figure("tanh", worst(points, absolute(math::tanh, f64::tanh)), 1.2e-7);
}

#[test]
fn atan_is_as_exact_as_documented() {
    let points = bit_sweep(499).chain(even_sweep(-20.0, 20.0, 4_000_000));
    assert_figure("atan", worst(points, absolute(math::atan, f64::atan)), 1.7e-7);
    let points = bit_sweep(499).filter(|x| x.abs() <= 1.0).chain(even_sweep(-1.0, 1.0, 4_000_000));
    assert_figure("atan up to 1", worst(points, absolute(math::atan, f64::atan)), 1e-7);
}

#[test]
fn sqrt_is_correctly_rounded() {
    // Rounding the f64 square root of an f32 to f32 gives the correctly rounded result: 53 >= 2 * 24 + 2 bits.
    for x in bit_sweep(211).filter(|x| *x >= 0.0) {
        let exact = f64::from(x).sqrt() as f32;
        assert_eq!(math::sqrt(x).to_bits(), exact.to_bits(), "sqrt({x:e})");
    }
}

#[test]
fn sine_and_cosine_are_as_exact_as_documented() {
    let points = || even_sweep(-1000.0, 1000.0, 6_000_000).chain(bit_sweep(997).filter(|x| x.abs() <= 1000.0));
    assert_figure("sin", worst(points(), absolute(math::sin, f64::sin)), 1.7e-4);
    assert_figure("cos", worst(points(), absolute(math::cos, f64::cos)), 1.7e-4);
}

/// `min` and `max` return the smaller and the larger number. If the first argument is NaN, they return the second.
#[test]
fn min_and_max_choose_one_of_both() {
    for (a, b) in [(-2.0, 3.0), (3.0, -2.0), (-1.0, -0.5), (0.25, 7.0), (5.0, 5.0), (f32::NEG_INFINITY, 1e-45)] {
        assert_eq!((math::min(a, b), math::max(a, b)), (f32::min(a, b), f32::max(a, b)), "{a} and {b}");
    }
    for b in [-3.0, 0.0, 2.0] {
        assert_eq!((math::min(f32::NAN, b), math::max(f32::NAN, b)), (b, b));
    }
}

proptest! {
    // Random points in addition to those of the sweeps above.
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// The largest coordinate is found for either sign and any position.
    #[test]
    fn the_largest_coordinate_is_that_of_amax(v in prop::array::uniform3(-1e3_f32..1e3)) {
        let v = Vector3::from(v);
        prop_assert_eq!(math::abs_max(&v), v.amax());
    }

    #[test]
    fn no_random_point_is_worse_than_documented(
        x in prop::num::f32::NORMAL | prop::num::f32::SUBNORMAL,
        angle in -1000.0_f32..1000.0,
        low in -87.0_f32..0.0,
    ) {
        let exp = f64::from(low).exp();
        prop_assert!((f64::from(math::exp(low)) - exp).abs() <= 8e-8 * exp);
        prop_assert!(absolute(math::tanh, f64::tanh)(x) <= 1.2e-7);
        prop_assert!(absolute(math::atan, f64::atan)(x) <= 1.7e-7);
        prop_assert!(absolute(math::sin, f64::sin)(angle) <= 1.7e-4);
        prop_assert!(absolute(math::cos, f64::cos)(angle) <= 1.7e-4);
    }

    #[test]
    fn wrapping_moves_an_angle_by_whole_turns_into_plus_minus_pi(x in -2000.0_f32..2000.0) {
        let wrapped = math::wrap_angle(x);
        prop_assert!(wrapped.abs() <= PI, "{x} wraps to {wrapped}");
        // The f32 value of a turn is off by 1.75e-7, and at most 318 turns fit into the range. The product is rounded
        // at 2000 (6.1e-5), and so is the difference. Near an odd multiple of pi, as much again is clipped.
        let turns = (f64::from(x) - f64::from(wrapped)) / core::f64::consts::TAU;
        prop_assert!((turns - turns.round()).abs() * core::f64::consts::TAU <= 2.6e-4, "{x} wraps to {wrapped}");
    }

    #[test]
    fn an_angle_within_plus_minus_pi_comes_back_unchanged(x in -PI..=PI) {
        prop_assert_eq!(math::wrap_angle(x).to_bits(), x.to_bits());
    }
}

#[test]
fn what_has_settled_is_zero_or_normal_and_else_as_it_was() {
    for x in bit_sweep(997) {
        let settled = math::settled(x);
        assert!(settled == 0.0 || settled.is_normal(), "{x:e}: {settled:e}");
        assert!(x.abs() >= 3e-33 || settled == 0.0, "{x:e}: {settled:e}");
        assert!(x.abs() < 4e-18 || settled == x, "{x:e}: {settled:e}");
        let (error, x) = ((f64::from(settled) - f64::from(x)).abs(), f64::from(x).abs());
        assert!(error <= 6e-33 + 1.2e-7 * x, "{x:e}: {error:e}");
    }
}

#[test]
fn what_is_limited_is_as_it_was_within_the_limit_and_else_on_it() {
    let clamped = |x: f32, most: f32| f64::from(x).clamp(-f64::from(most), f64::from(most)) as f32;
    for x in bit_sweep(997).chain([f32::INFINITY, f32::NEG_INFINITY]) {
        for most in [0.1, 10.0, 1e5_f32.next_down(), x.abs(), x.abs().next_up().min(f32::MAX)] {
            assert_eq!(math::limited(x, most), clamped(x, most), "{x:e} within {most:e}");
        }
    }
    assert_eq!(math::limited(f32::NAN, 3.0), -3.0);
}
