//! Properties of the fuzzy basis (17)-(19), for every accepted membership and every finite input.

use afbc::fuzzy::{FuzzyBasis, Membership, SPREAD};
use afbc_types::{Declared, Range};
use nalgebra::Matrix3;
use proptest::prelude::*;

const WIDTH: Range = Membership::WIDTH.range;

/// Rounding error of one `f32` operation, relative.
const U: f64 = 1.0 / (1 << 24) as f64;

/// Draws any finite `f32`: random bit patterns, often the extremes.
fn finite() -> impl Strategy<Value = f32> {
    let edges = [0.0, f32::from_bits(1), f32::MIN_POSITIVE.next_down(), f32::MIN_POSITIVE, f32::EPSILON, 1.0, f32::MAX];
    prop_oneof![
        3 => prop::num::f32::ANY.prop_filter("finite", |x| x.is_finite()),
        2 => -30.0_f32..30.0,
        1 => (prop::sample::select(edges.to_vec()), any::<bool>())
            .prop_map(|(x, negative)| if negative { -x } else { x }),
    ]
}

/// Draws any accepted membership, often at its bounds.
fn membership() -> impl Strategy<Value = Membership> {
    let spread =
        prop_oneof![3 => SPREAD.min..=SPREAD.max, 1 => Just(SPREAD.min), 1 => Just(SPREAD.max), 1 => Just(2.5)];
    let width = prop_oneof![
        3 => (WIDTH.min.ln()..=WIDTH.max.ln()).prop_map(f64::exp),
        1 => Just(WIDTH.min),
        1 => Just(WIDTH.max),
        1 => Just(0.1),
    ];
    (spread, width)
        .prop_map(|(spread, width)| Membership { centre: (spread * width) as f32, width: width as f32 })
        .prop_filter("accepted", |m| m.validate().is_ok())
}

/// Computes (18) in `f64`, normalised before the exponential.
fn exact(membership: Membership, inputs: [f32; 2]) -> Matrix3<f64> {
    let (c, s) = (f64::from(membership.centre), f64::from(membership.width));
    let logit = |x: f32, j: usize| {
        let z = (f64::from(x) - c * (j as f64 - 1.0)) / s;
        -0.5 * z * z
    };
    let logits = Matrix3::from_fn(|i, j| logit(inputs[0], i) + logit(inputs[1], j));
    let largest = logits.max();
    let firing = logits.map(|z| (z - largest).exp());
    firing / firing.sum()
}

/// Returns a bound on the relative error of a weight. ln w_i changes by at most twice the change of the exponents k|x|
/// and ln q. k|x| has 7 roundings (c, s, two divisions by s, s again, x, the product), and ln q = c^2 / 2s^2 has 5.
/// Another 20 cover the exponentials (2 each) and the products and sums around them.
fn relative_bound(membership: Membership, inputs: [f32; 2]) -> f64 {
    let (c, s) = (f64::from(membership.centre), f64::from(membership.width));
    let exponents: f64 = inputs.iter().map(|x| c / (s * s) * f64::from(x.abs())).sum();
    (2.0 * (7.0 * exponents + 2.0 * 5.0 * 0.5 * (c / s) * (c / s)) + 20.0) * U
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn weights_are_finite_within_0_and_1_and_sum_to_1(membership in membership(), a in finite(), b in finite()) {
        let w = FuzzyBasis::new(membership).unwrap().weights([a, b]);
        prop_assert!(w.iter().all(|w| w.is_finite() && (0.0..=1.0).contains(w)), "{w:?}");
        // A weight takes two sums of three, a product, a division and a product, and then follows the sum of nine: 16
        // roundings.
        let sum: f64 = w.iter().copied().map(f64::from).sum();
        prop_assert!((sum - 1.0).abs() <= 16.0 * U, "sum {sum}");
        prop_assert!((w.sum() - 1.0).abs() <= 1e-6, "sum {}", w.sum());
    }

    #[test]
    fn weights_agree_with_18_in_f64(membership in membership(), widths in prop::array::uniform2(-60.0_f32..60.0)) {
        let inputs = widths.map(|x| x * membership.width);
        let (w, exact) = (FuzzyBasis::new(membership).unwrap().weights(inputs), exact(membership, inputs));
        let bound = relative_bound(membership, inputs);
        for (w, exact) in w.iter().zip(exact.iter()) {
            // An exponential below the normal numbers of f32 is 0: 2^-126 divided by a sum of at least q = 1.5e-8.
            let allowed = exact * bound + 8e-31;
            prop_assert!((f64::from(*w) - exact).abs() <= allowed, "{w:e} against {exact:e}, allowed {allowed:e}");
        }
    }

    #[test]
    fn mirroring_an_input_mirrors_the_weights(membership in membership(), a in finite(), b in finite()) {
        let basis = FuzzyBasis::new(membership).unwrap();
        let (w, first, second) = (basis.weights([a, b]), basis.weights([-a, b]), basis.weights([a, -b]));
        // The triples are the same numbers in reverse order; their sums may round differently, by 2 roundings each.
        let near = |x: f32, y: f32| (f64::from(x) - f64::from(y)).abs() <= 8.0 * U * f64::from(x) + 1e-44;
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            prop_assert!(near(w[(i, j)], first[(2 - i, j)]), "row {i}, column {j}: {w} against {first}");
            prop_assert!(near(w[(i, j)], second[(i, 2 - j)]), "row {i}, column {j}: {w} against {second}");
        }
    }

    #[test]
    fn far_out_the_outer_rule_takes_all(membership in membership(), far in 200.0_f32..1e30) {
        // Beyond 200 widths the next Gaussian is exp(-k x + c^2 / 2s^2) < exp(-200 * 0.1 + 18) of the outer one for the
        // widest spread, the worst case: less than 0.14. It decreases with x.
        let basis = FuzzyBasis::new(membership).unwrap();
        let x = far * membership.width;
        let w = basis.weights([x, -x]);
        let (row, column) = (2, 0);
        prop_assert!(w[(row, column)] > 0.75, "{w}");
    }
}

#[test]
fn each_rule_has_its_place() {
    // The first input is the outer index: rule 3 i + j + 1 is row i, column j, from -c to c.
    let membership = Membership { centre: 10.0, width: 2.0 };
    let basis = FuzzyBasis::new(membership).unwrap();
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let w = basis.weights([10.0 * (i as f32 - 1.0), 10.0 * (j as f32 - 1.0)]);
        assert!(w[(i, j)] > 0.999_98, "rule {}: {w}", 3 * i + j + 1);
    }
}

#[test]
fn a_bad_membership_is_refused_by_name() {
    let refused = |centre, width| FuzzyBasis::new(Membership { centre, width }).unwrap_err().range.name;
    assert_eq!(refused(f32::NAN, 1.0), "centre");
    assert_eq!(refused(0.0, 1.0), "centre");
    assert_eq!(refused(-1.0, 1.0), "centre");
    assert_eq!(refused(1.0, f32::INFINITY), "width");
    assert_eq!(refused(1.0, 0.0), "width");
    assert_eq!(refused(1.0, 0.16), "centre / width");
    assert_eq!(refused(1.0, 11.0), "centre / width");
}
