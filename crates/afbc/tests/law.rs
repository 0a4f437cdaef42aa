//! Properties of the laws: backstepping (9)-(16), (21), and AFBC (20)-(22), (32)-(34).
#![allow(clippy::unwrap_used, missing_docs)] // a law that cannot be built must stop the test

use afbc::adaptive::{ControlTerms, Gains, Subsystem, SubsystemConditions};
use afbc::backstepping::{self, ideal, proportional};
use afbc::fuzzy::{FuzzyBasis, Membership};
use afbc::integral::{IntegralBackstepping, IntegralMemory};
use afbc::law::StepContext;
use afbc::law::SubsystemTracking;
use afbc::model::{Dynamics, ModelConstants, RollPitch};
use afbc::{Adaptive, AdaptiveEstimate, Backstepping, Profile, Safeguards, SubsystemLaw};
use afbc_control::Errors;
use afbc_types::{Axis, Declaration, Parameters, PerAxis, State};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

/// Rounding error of one `f32` operation, relative.
const U: f64 = 1.0 / (1 << 24) as f64;

fn tracking() -> impl Strategy<Value = SubsystemTracking> {
    (-10.0_f32..10.0, -10.0_f32..10.0, -10.0_f32..10.0, -10.0_f32..10.0, -10.0_f32..10.0).prop_map(
        |(x1, x2, e1, x1d_dot, x1d_ddot)| SubsystemTracking { x1, x2, e1, x1d_dot, x1d_ddot, approach_1_s: None },
    )
}

fn gains() -> impl Strategy<Value = Gains> {
    let membership = prop_oneof![Just((0.26_f32, 0.1_f32)), Just((10.0, 4.0))];
    (
        0.01_f32..10.0,
        0.0_f32..20.0,
        0.0_f32..20.0,
        0.0_f32..5.0,
        prop_oneof![Just(0.001_f32), 0.001_f32..1.0],
        membership,
    )
        .prop_map(|(alpha1, alpha2, gamma, eta, epsilon, (centre, width))| Gains {
            backstepping: backstepping::Gains { alpha1, alpha2, ..backstepping::Gains::DEFAULT },
            gamma,
            eta,
            epsilon,
            membership: Membership { centre, width },
            safeguards: Safeguards::NONE,
        })
}

fn estimate() -> impl Strategy<Value = AdaptiveEstimate> {
    (prop::array::uniform9(-5.0_f32..5.0), 0.0_f32..5.0)
        .prop_map(|(theta, delta)| AdaptiveEstimate { theta: Matrix3::from_row_slice(&theta), delta })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Checks the Lyapunov derivative under (16) with (21) for known f, g and dg/dt. (15) claims V_dot = -alpha_1 e_1^2
    /// - alpha_2 e_2^2 for (14), but divides e_1 by g where (14) does not. So the claim holds for g = 1 only; otherwise
    /// e_1 e_2 (1 - 1/g) remains. The errors still converge: with the law as printed, half the sum of their squares has
    /// the derivative -alpha_1 e_1^2 - g alpha_2 e_2^2 + dg/dt e_2^2 / 2g, never positive for a constant g. With the
    /// weight c of e_1 the same holds for (c e_1^2 + e_2^2)/2 and -c alpha_1 e_1^2.
    #[test]
    fn lyapunov(
        tracking in tracking(),
        alpha1 in 0.01_f32..10.0,
        alpha2 in 0.0_f32..20.0,
        stiffness in prop_oneof![Just(1.0_f32), 0.0_f32..500.0],
        f in -20.0_f32..20.0,
        g in prop_oneof![Just(1.0_f32), 0.05_f32..70.0],
        g_dot in prop_oneof![Just(0.0_f32), -5.0_f32..5.0],
    ) {
        let errors = tracking.errors(alpha1);
        let gains = backstepping::Gains { alpha1, alpha2, stiffness };
        let u = ideal(&gains, &errors, tracking.x1d_ddot, &Dynamics { f, g, g_dot }) + proportional(alpha2, &errors);

        let [e1, e2, a1, a2, c] = [errors.e1, errors.e2, alpha1, alpha2, stiffness].map(f64::from);
        let [f, g, g_dot, x1d_ddot, u] = [f, g, g_dot, tracking.x1d_ddot, u].map(f64::from);
        let e1_dot = e2 - a1 * e1; // (13)
        let e2_dot = a1 * (e2 - a1 * e1) + x1d_ddot - f - g * u; // (13)
        // u is rounded at most 12 times, each time relative to its largest term. Both derivatives contain e_2 g u, but
        // (14) divides it by g.
        let terms = c * e1.abs()
            + a1 * e2.abs()
            + a1 * a1 * e1.abs()
            + x1d_ddot.abs()
            + f.abs()
            + (g_dot / g * e2).abs()
            + g * a2 * e2.abs();
        let allowed = 12.0 * U * terms * e2.abs() + 1e-12;

        let printed = c * e1 * e1_dot + e2 * e2_dot / g - g_dot / (2.0 * g * g) * e2 * e2; // (14)
        let left_over = c * e1 * e2 * (1.0 - 1.0 / g);
        let wanted = -c * a1 * e1 * e1 - a2 * e2 * e2 + left_over;
        prop_assert!((printed - wanted).abs() <= allowed / g, "{printed}, {wanted} wanted, allowed {:e}", allowed / g);

        let squares = c * e1 * e1_dot + e2 * e2_dot;
        let wanted = -c * a1 * e1 * e1 - g * a2 * e2 * e2 + 0.5 * g_dot / g * e2 * e2;
        prop_assert!((squares - wanted).abs() <= allowed, "{squares}, {wanted} wanted, allowed {allowed:e}");
        prop_assert!(g_dot != 0.0 || squares <= allowed);
        prop_assert!(g != 1.0 || left_over == 0.0);
    }

    /// At the speed limit e_2 is the missing approach speed, and the law changes the speed with the rate gain alpha_1 +
    /// alpha_2 g until e_2 is zero. Where the limit begins, the law equals (16) and (21). For x: f = 0, g = 1.
    #[test]
    fn at_the_speed_limit_e2_is_the_lack_of_speed(
        tracking in tracking(), alpha1 in 0.01_f32..10.0, alpha2 in 0.1_f32..20.0, stiffness in 0.0_f32..50.0,
    ) {
        let gains = PerAxis::from_fn(|_| backstepping::Gains { alpha1, alpha2, stiffness });
        let law = Backstepping::new(&Parameters::PAPER.to_f32(), gains).unwrap();
        let context = StepContext {
            state: &State::default(),
            roll_pitch: RollPitch::new(&State::default()),
            rotor_residual_rad_s: 0.0,
            dt_s: 0.001,
            adapt: true,
            adapt_z: true,
            unallocated: &PerAxis::default(),
            observed_m_s2: Vector3::zeros(),
            softness: 1.0,
            known: None,
        };
        let approach = law.approach(Axis::X, None);
        let at_limit = SubsystemTracking { approach_1_s: Some(approach), ..tracking };
        let (u, errors) = law.input(Axis::X, &at_limit, &context, &mut ());
        let [e1, rate, r, a1, a2] = [tracking.e1, errors.e1_dot, approach, alpha1, alpha2].map(f64::from);
        let lack = rate + r * e1;
        let size = rate.abs() + (r * e1).abs();
        prop_assert!((f64::from(errors.e2) - lack).abs() <= 4.0 * U * size, "{} for {lack}", errors.e2);
        let (asked, wanted) = (f64::from(u) - f64::from(tracking.x1d_ddot), (a1 + a2) * lack);
        let allowed = 12.0 * U * ((a1 + a2) * size + f64::from(tracking.x1d_ddot).abs());
        prop_assert!((asked - wanted).abs() <= allowed, "{asked} for {wanted}");
        let (unlimited, _) = law.input(Axis::X, &tracking, &context, &mut ());
        let terms = (a1 + a2) * size + (f64::from(stiffness) + a1 * a2 + a1 * a1) * e1.abs();
        let allowed = 24.0 * U * (terms + f64::from(tracking.x1d_ddot).abs());
        prop_assert!((f64::from(unlimited) - f64::from(u)).abs() <= allowed, "{unlimited} and {u}");
    }

    /// For old states, z is slower also at the speed limit: where the limit begins, the input does not jump. The
    /// fallback law is slower by the same factor.
    #[test]
    fn old_states_make_z_slower_within_and_at_the_speed_limit(
        tracking in tracking(), alpha1 in 0.1_f32..10.0, alpha2 in 0.1_f32..20.0, stiffness in 0.0_f32..50.0,
        softness in 0.2_f32..1.0,
    ) {
        let vehicle = Parameters::PAPER.to_f32();
        let model = ModelConstants::new(&vehicle);
        let gains = backstepping::Gains { alpha1, alpha2, stiffness };
        let slower = backstepping::Gains {
            alpha1: alpha1 * softness,
            alpha2: alpha2 * softness,
            stiffness: stiffness * softness * softness,
        };
        let context = StepContext {
            state: &State::default(),
            roll_pitch: RollPitch::new(&State::default()),
            rotor_residual_rad_s: 0.0,
            dt_s: 0.001,
            adapt: false,
            adapt_z: false,
            unallocated: &PerAxis::default(),
            observed_m_s2: Vector3::zeros(),
            softness,
            known: Some(&model),
        };
        let of = |backstepping| Gains { backstepping, ..Profile::Flight.gains().z };
        let law = Adaptive::new(PerAxis::from_fn(|_| of(gains))).unwrap();
        let fallback = IntegralBackstepping::new(&vehicle, PerAxis::from_fn(|_| (&of(gains)).into())).unwrap();
        let slow = Backstepping::new(&vehicle, PerAxis::from_fn(|_| slower)).unwrap();
        let firm = StepContext { softness: 1.0, ..context };
        let at_limit = SubsystemTracking { approach_1_s: Some(law.approach(Axis::Z, Some(&model))), ..tracking };
        let slow_limit = SubsystemTracking { approach_1_s: Some(slow.approach(Axis::Z, None)), ..tracking };
        for (tracking, slow_tracking) in [(&tracking, &tracking), (&at_limit, &slow_limit)] {
            let (expected, errors) = slow.input(Axis::Z, slow_tracking, &firm, &mut ());
            let own = law.input(Axis::Z, tracking, &context, &mut AdaptiveEstimate::default()).0;
            let other = fallback.input(Axis::Z, tracking, &context, &mut IntegralMemory::default()).0;
            let size = vehicle.weight_n() + alpha2 * (errors.e2.abs() + 1.0)
                + (stiffness + alpha1 * alpha1) * (tracking.e1.abs() + errors.e1_dot.abs() + 1.0);
            prop_assert!((own - expected).abs() < 1e-4 * size, "{own}, not {expected}");
            prop_assert!((other - expected).abs() < 1e-4 * size, "{other}, not {expected}");
        }
    }

    /// The feed-forward is (16) by the known model in this state, in addition to what the law learns. AFBC uses drag
    /// and the observed f for x, y and z, and no gyroscopic f for roll, pitch and yaw if that is observed; the baseline
    /// uses the rotor residual.
    #[test]
    fn what_is_known_is_the_ideal_law_of_the_model(
        tracking in tracking(),
        gains in gains(),
        stiffness in 0.0_f32..50.0,
        (angles, rates) in (prop::array::uniform3(-1.0_f32..1.0), prop::array::uniform3(-3.0_f32..3.0)),
        observed_m_s2 in prop::array::uniform3(-5.0_f32..5.0).prop_map(Vector3::from),
        rotor_residual_rad_s in -500.0_f32..500.0,
        before in estimate(),
    ) {
        let vehicle = Parameters::PAPER.to_f32();
        let backstepping = backstepping::Gains { stiffness, ..gains.backstepping };
        let gains = Gains { backstepping, ..gains };
        let state = State { attitude_rad: angles.into(), rates_rad_s: rates.into(), ..State::default() };
        let model = ModelConstants::new(&vehicle);
        let context = StepContext {
            state: &state,
            roll_pitch: RollPitch::new(&state),
            rotor_residual_rad_s,
            dt_s: 0.001,
            adapt: false,
            adapt_z: false,
            unallocated: &PerAxis::default(),
            observed_m_s2,
            softness: 1.0,
            known: None,
        };
        let adaptive = Adaptive::new(PerAxis::from_fn(|_| gains)).unwrap();
        let fixed = Backstepping::new(&vehicle, PerAxis::from_fn(|_| backstepping)).unwrap();
        for axis in Axis::ALL {
            let errors = tracking.errors(backstepping.alpha1);
            let nominal = model.dynamics(axis, &state, rotor_residual_rad_s);
            let f = match axis {
                Axis::X => observed_m_s2.x,
                Axis::Y => observed_m_s2.y,
                Axis::Z => nominal.f + observed_m_s2.z,
                Axis::Roll | Axis::Pitch | Axis::Yaw => nominal.f,
            };
            let known = ideal(&backstepping, &errors, tracking.x1d_ddot, &Dynamics { f, ..nominal });
            // The robust term is another with feed-forward.
            let mut estimate = AdaptiveEstimate { delta: 0.0, ..before };
            let (alone, _) = adaptive.input(axis, &tracking, &context, &mut estimate);
            let with_model = StepContext { known: Some(&model), ..context };
            let (whole, seen) = adaptive.input(axis, &tracking, &with_model, &mut estimate);
            let allowed = 4.0 * U * (f64::from(alone.abs()) + f64::from(known.abs()));
            prop_assert_eq!(seen, errors);
            prop_assert!(
                (f64::from(whole) - f64::from(alone) - f64::from(known)).abs() <= allowed,
                "{axis:?}: {whole} is not {alone} and {known}"
            );

            let (u, seen) = fixed.input(axis, &tracking, &context, &mut ());
            let known = ideal(&backstepping, &errors, tracking.x1d_ddot, &nominal);
            prop_assert_eq!((u, seen), (known + proportional(backstepping.alpha2, &errors), errors));
        }
    }

    /// By (12) and (13), e_2 is the remainder of e_1's dynamics.
    #[test]
    fn errors_obey_13(tracking in tracking(), alpha1 in 0.01_f32..10.0) {
        let errors = tracking.errors(alpha1);
        prop_assert_eq!(errors.e1.to_bits(), tracking.e1.to_bits());
        let [e1, e1_dot, e2, a1] = [errors.e1, errors.e1_dot, errors.e2, alpha1].map(f64::from);
        let [x1d_dot, x2] = [tracking.x1d_dot, tracking.x2].map(f64::from);
        prop_assert!((e1_dot - (x1d_dot - x2)).abs() <= U * e1_dot.abs());
        // The product and the sum are rounded once each.
        prop_assert!((e1_dot - (e2 - a1 * e1)).abs() <= U * (a1 * e1.abs() + e2.abs()) * 1.01);
    }

    /// (20): u = u_a + u_r + u_pd, each as defined.
    #[test]
    fn the_law_is_the_sum_of_its_three_terms(
        gains in gains(),
        tracking in tracking(),
        inputs in prop::array::uniform2(-3.0_f32..3.0),
        estimate in estimate(),
    ) {
        let errors = tracking.errors(gains.backstepping.alpha1);
        let subsystem = Subsystem::new(gains).unwrap();
        let (terms, _) = subsystem.law(&errors, inputs, &estimate, &SubsystemConditions::default());
        prop_assert_eq!(terms.sum(), terms.fuzzy + terms.robust + terms.proportional);
        prop_assert_eq!(terms.proportional, gains.backstepping.alpha2 * errors.e2); // (21)

        // (22): nine products, eight sums.
        let w = FuzzyBasis::new(gains.membership).unwrap().weights(inputs);
        let products = w.zip_map(&estimate.theta, |w, theta| f64::from(w) * f64::from(theta));
        prop_assert!((f64::from(terms.fuzzy) - products.sum()).abs() <= 10.0 * U * products.abs().sum());
        // A weighted mean is between the smallest and the largest value.
        let slack = 16.0 * U as f32 * estimate.theta.abs().max();
        prop_assert!(terms.fuzzy >= estimate.theta.min() - slack && terms.fuzzy <= estimate.theta.max() + slack);

        // (32): the quotient has 2 roundings, and s tanh'(s) <= 0.448; tanh itself is accurate to 1.4e-7.
        let s = (f64::from(errors.e2) / f64::from(gains.epsilon)).tanh();
        let delta = f64::from(estimate.delta);
        prop_assert!((f64::from(terms.robust) - delta * s).abs() <= delta * (1.4e-7 + 2.0 * U));

        // With feed-forward: a product, a quotient and a sum.
        let conditions = SubsystemConditions { printed: false, ..SubsystemConditions::default() };
        let (soft, rate) = Subsystem::new(gains).unwrap().law(&errors, inputs, &estimate, &conditions);
        let (e2, epsilon) = (f64::from(errors.e2), f64::from(gains.epsilon));
        let s = e2 / (e2.abs() + epsilon);
        prop_assert!((f64::from(soft.robust) - delta * s).abs() <= 4.0 * U * delta * s.abs() + 1e-44);
        let wanted = f64::from(gains.eta) * e2 * s;
        prop_assert!((f64::from(rate.delta()) - wanted).abs() <= 8.0 * U * wanted + 1e-44);
        prop_assert_eq!(ControlTerms { robust: terms.robust, ..soft }, terms);
    }

    /// Old states slow down learning, and nothing else.
    #[test]
    fn learning_slows_down_alone(
        gains in gains(),
        tracking in tracking(),
        estimate in estimate(),
        learning in 0.0_f32..1.0,
    ) {
        let (errors, subsystem) = (tracking.errors(gains.backstepping.alpha1), Subsystem::new(gains).unwrap());
        let [(terms, rate), (same, slow)] = [1.0, learning].map(|learning| {
            let conditions = SubsystemConditions { learning, ..SubsystemConditions::default() };
            subsystem.law(&errors, [0.1, -0.2], &estimate, &conditions)
        });
        prop_assert_eq!((terms, rate.delta()), (same, slow.delta()));
        let off = (slow.theta() - rate.theta() * learning).abs().max();
        prop_assert!(off <= 1e-6 * rate.theta().abs().max() + 1e-30, "{off}");
    }

    /// (33), (34): Theta_hat changes with the sign of e_2, in proportion to the weights; delta_hat can only grow.
    #[test]
    fn adaptation_has_the_sign_of_the_error(
        gains in gains(),
        tracking in tracking(),
        inputs in prop::array::uniform2(-3.0_f32..3.0),
        estimate in estimate(),
    ) {
        let errors = tracking.errors(gains.backstepping.alpha1);
        let (_, rate) = Subsystem::new(gains).unwrap().law(&errors, inputs, &estimate, &SubsystemConditions::default());
        let w = FuzzyBasis::new(gains.membership).unwrap().weights(inputs);
        let e2 = f64::from(errors.e2);
        for (rate, w) in rate.theta().iter().zip(w.iter()) {
            let wanted = f64::from(gains.gamma) * e2 * f64::from(*w);
            // A weight has five roundings, not counting the sums of memberships, which are the same; a rate has seven.
            // A product of memberships below the normal numbers is off by 1.4e-45, divided by a sum of at least q^2 =
            // 2e-16.
            let least = 1e-29 * f64::from(gains.gamma) * e2.abs();
            prop_assert!(
                (f64::from(*rate) - wanted).abs() <= 12.0 * U * wanted.abs() + least + 1e-44,
                "{rate:e} for {wanted:e}"
            );
        }
        // The weights sum to one, so the rates sum to gamma e_2.
        let total: f64 = rate.theta().iter().copied().map(f64::from).sum();
        prop_assert!((total - f64::from(gains.gamma) * e2).abs() <= 20.0 * U * f64::from(gains.gamma) * e2.abs());

        prop_assert!(rate.delta() >= 0.0);
        let wanted = f64::from(gains.eta) * e2 * (e2 / f64::from(gains.epsilon)).tanh();
        prop_assert!((f64::from(rate.delta()) - wanted).abs() <= f64::from(gains.eta) * e2.abs() * (1.4e-7 + 5.0 * U));
    }

    /// For all six subsystems, this checks the fuzzy inputs (Section IV), the Euler step and the freeze.
    #[test]
    fn a_step_uses_the_estimate_as_it_stood_and_then_moves_it(
        tracking in tracking(),
        before in estimate(),
        dt_s in 1e-4_f32..0.02,
    ) {
        let gains = Profile::Paper.gains();
        let law = Adaptive::new(gains).unwrap();
        let state = State::default();
        for axis in Axis::ALL {
            let gains = gains[axis];
            let errors = tracking.errors(gains.backstepping.alpha1);
            let inputs = match axis {
                Axis::Roll | Axis::Pitch | Axis::Yaw => [tracking.x1, tracking.x2],
                Axis::Z | Axis::X | Axis::Y => [errors.e1, errors.e1_dot],
            };
            let subsystem = Subsystem::new(gains).unwrap();
            let (terms, rate) = subsystem.law(&errors, inputs, &before, &SubsystemConditions::default());

            let mut frozen = before;
            let context = StepContext {
                state: &state,
                roll_pitch: RollPitch::new(&state),
                rotor_residual_rad_s: 0.0,
                dt_s,
                // Only the other subsystems may learn, of which z has a flag of its own.
                adapt: axis == Axis::Z,
                adapt_z: axis != Axis::Z,
                unallocated: &PerAxis::default(),
                observed_m_s2: Vector3::zeros(),
                softness: 1.0,
                known: None,
            };
            let (u, seen) = law.input(axis, &tracking, &context, &mut frozen);
            prop_assert_eq!((u, seen, frozen), (terms.sum(), errors, before));

            let mut moved = before;
            let learns = StepContext { adapt: axis != Axis::Z, adapt_z: axis == Axis::Z, ..context };
            let (u, _) = law.input(axis, &tracking, &learns, &mut moved);
            prop_assert_eq!(u, terms.sum());
            for ((moved, before), rate) in moved.theta.iter().zip(before.theta.iter()).zip(rate.theta().iter()) {
                // The rate's factors round four times, the sum once.
                let step = f64::from(*rate) * f64::from(dt_s);
                let exact = f64::from(*before) + step;
                prop_assert!((f64::from(*moved) - exact).abs() <= U * exact.abs() + 8.0 * U * step.abs() + 1e-44);
            }
            prop_assert_eq!(moved.delta, before.delta + rate.delta() * dt_s);
        }
    }
}

/// The hover thrust is the known weight plus Theta_hat of the rule for zero error, but at least 0.3 of the weight. It
/// is the weight for a law that learns nothing, and at a start in flight.
#[test]
fn the_hover_thrust_is_what_carries_the_vehicle() {
    let gains = Profile::Paper.gains();
    let (adaptive, fixed) = (
        Adaptive::new(gains).unwrap(),
        Backstepping::new(&Parameters::PAPER.to_f32(), gains.map(|gains| gains.backstepping)).unwrap(),
    );
    let weight_n = 4.8;
    let mut learnt = AdaptiveEstimate { theta: Matrix3::repeat(-50.0), delta: 3.0 };
    for (rule, known, wanted) in [(5.0, 0.0, 5.0), (0.6, weight_n, 5.4), (-1.5, weight_n, 3.3), (1.0, 0.0, 1.44)] {
        learnt.theta.m22 = rule;
        let got = adaptive.hover_thrust_n(&learnt, weight_n, known);
        assert!((got - wanted).abs() < 1e-6, "{got} instead of {wanted}");
    }
    assert_eq!(fixed.hover_thrust_n(&(), weight_n, 0.0), weight_n);

    let mut started = PerAxis::<AdaptiveEstimate>::default();
    adaptive.start(&mut started, weight_n);
    assert_eq!(adaptive.hover_thrust_n(&started.z, weight_n, 0.0), weight_n);
    for inputs in [[0.0, 0.0], [3.0, -20.0], [-9.0, 1.0]] {
        let (terms, _) = Subsystem::new(gains.z).unwrap().law(
            &Errors::default(),
            inputs,
            &started.z,
            &SubsystemConditions::default(),
        );
        assert!((terms.sum() - weight_n).abs() < 1e-5, "{terms:?}");
    }
    assert_eq!(PerAxis { z: AdaptiveEstimate::default(), ..started }, PerAxis::default());
}

/// The approach speed is the speed at which the known part and u_pd cancel, for the g of each input; without a known
/// model it is alpha_1.
#[test]
fn an_error_is_approached_at_the_speed_that_the_law_holds() {
    let (vehicle, gains) = (Parameters::PAPER.to_f32(), Profile::Flight.gains());
    let (model, adaptive) = (ModelConstants::new(&vehicle), Adaptive::new(gains).unwrap());
    let fixed = Backstepping::new(&vehicle, gains.map(|gains| gains.backstepping)).unwrap();
    let integral = IntegralBackstepping::new(&vehicle, gains.map(|gains| gains.into())).unwrap();
    for axis in Axis::ALL {
        let of = gains[axis].backstepping;
        assert_eq!(adaptive.approach(axis, None), of.alpha1);
        let dynamics = model.dynamics(axis, &State::default(), 0.0);
        for approach in
            [adaptive.approach(axis, Some(&model)), fixed.approach(axis, None), integral.approach(axis, None)]
        {
            // At e_1 = 1 m and this approach speed, the input only compensates f.
            let tracking = SubsystemTracking { x2: approach, e1: 1.0, ..SubsystemTracking::default() };
            let errors = tracking.errors(of.alpha1);
            let u = ideal(&of, &errors, 0.0, &dynamics) + proportional(of.alpha2, &errors);
            let held = -dynamics.f / dynamics.g;
            assert!((u - held).abs() < 1e-4 * (1.0 + of.stiffness / dynamics.g), "{axis:?}: {u} instead of {held}");
        }
    }
}

/// Every gain is refused outside its range, by name, and accepted at both ends.
#[test]
fn a_gain_out_of_range_is_refused_by_name() {
    type Set = fn(&mut Gains, f32);
    let cases: [(Declaration, Set); 9] = [
        (backstepping::Gains::ALPHA1, |g, v| g.backstepping.alpha1 = v),
        (backstepping::Gains::ALPHA2, |g, v| g.backstepping.alpha2 = v),
        (Gains::GAMMA, |g, v| g.gamma = v),
        (Gains::ETA, |g, v| g.eta = v),
        (Gains::EPSILON, |g, v| g.epsilon = v),
        (Safeguards::SIGMA, |g, v| g.safeguards.sigma = v),
        (Safeguards::THETAMAX, |g, v| g.safeguards.theta_max = v),
        (Safeguards::DELTAMAX, |g, v| g.safeguards.delta_max = v),
        (Membership::WIDTH, |g, v| g.membership = Membership { centre: 2.0 * v, width: v }),
    ];
    for axis in Axis::ALL {
        for (Declaration { range, .. }, set) in cases {
            let with = |value: f32| {
                let mut gains: PerAxis<Gains> = Profile::Paper.gains();
                set(&mut gains[axis], value);
                Adaptive::new(gains).map(|_| ()).map_err(|error| error.range.name)
            };
            let (min, max) = (range.min as f32, range.max as f32);
            if range != Membership::WIDTH.range {
                assert_eq!(with(min), Ok(()), "{} = {min} on {}", range.name, axis.name());
                assert_eq!(with(max), Ok(()), "{} = {max} on {}", range.name, axis.name());
                for bad in [min.next_down(), max.next_up(), f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                    assert_eq!(with(bad), Err(range.name), "{} = {bad} on {}", range.name, axis.name());
                }
            } else {
                assert!(with(min / 4.0).is_err() && with(f32::NAN).is_err());
            }
        }
    }
}
