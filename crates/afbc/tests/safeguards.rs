//! Compares the safeguards with the equations in `safeguards.rs` in `f64`, and checks their consequences.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use crate::common::{U, gains_of_one};
use afbc::adaptive::Gains;
use afbc::disturbance::DisturbanceObserver;
use afbc::fuzzy::{FiringStrengths, FuzzyBasis};
use afbc::law::StepContext;
use afbc::law::SubsystemTracking;
use afbc::model::RollPitch;
use afbc::{Adaptive, AdaptiveEstimate, Controller, Profile, Safeguards, Settings, SubsystemLaw};
use afbc_control::{FlightController, Validated};
use afbc_types::{Axis, Parameters, PerAxis, Setpoint, State};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

/// Returns a subsystem's tracking with e_2 = `e2` exactly: e_1 = 0, x_2 = -e_2.
fn tracking(e2: f32) -> SubsystemTracking {
    SubsystemTracking { x2: -e2, ..SubsystemTracking::default() }
}

/// Runs one step of the x subsystem; returns its u.
fn step(gains: Gains, e2: f32, unallocated: f32, dt_s: f32, estimate: &mut AdaptiveEstimate) -> f32 {
    let law = Adaptive::new(PerAxis::from_fn(|_| gains)).unwrap();
    let context = StepContext {
        state: &State::default(),
        roll_pitch: RollPitch::new(&State::default()),
        rotor_residual_rad_s: 0.0,
        dt_s,
        adapt: true,
        adapt_z: true,
        unallocated: &PerAxis { x: unallocated, ..PerAxis::default() },
        observed_m_s2: Vector3::zeros(),
        softness: 1.0,
        known: None,
    };
    law.input(Axis::X, &tracking(e2), &context, estimate).0
}

/// Computes the documented adaptation step in `f64`.
fn reference(gains: &Gains, e2: f32, unallocated: f32, dt_s: f32, before: &AdaptiveEstimate) -> (Matrix3<f64>, f64) {
    let Safeguards { sigma, theta_max, delta_max } = gains.safeguards;
    let [sigma, theta_max, delta_max] = [sigma, theta_max, delta_max].map(f64::from);
    let [gamma, eta, epsilon, dt] = [gains.gamma, gains.eta, gains.epsilon, dt_s].map(f64::from);
    // e_1 = 0, so its derivative is e_2.
    let w = FuzzyBasis::new(gains.membership).unwrap().weights([0.0, e2]).map(f64::from);
    let towards_limit = f64::from(e2) * f64::from(unallocated) > 0.0;
    let e2 = f64::from(e2);
    let e = if towards_limit { 0.0 } else { e2 };
    let keep = 1.0 - sigma * dt;
    let mut theta = before.theta.map(f64::from) * keep + w * (gamma * e * dt);
    if theta.norm() > theta_max {
        theta *= theta_max / theta.norm();
    }
    let delta = f64::from(before.delta) * keep + eta * e * (e2 / epsilon).tanh() * dt;
    (theta, delta.min(delta_max))
}

fn error() -> impl Strategy<Value = f32> {
    prop_oneof![3 => -1.0_f32..1.0, 1 => -1e4_f32..1e4, 1 => Just(0.0)]
}

fn unallocated() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0_f32), -1.0_f32..1.0, Just(f32::INFINITY), Just(f32::NEG_INFINITY)]
}

/// Draws an estimate within the safeguards' bounds.
fn estimate(safeguards: Safeguards) -> impl Strategy<Value = AdaptiveEstimate> {
    (prop::array::uniform9(-1.0_f32..1.0), 0.0_f32..=1.0).prop_map(move |(theta, delta)| AdaptiveEstimate {
        theta: Matrix3::from_row_slice(&theta) * (safeguards.theta_max / 3.0),
        delta: delta * safeguards.delta_max,
    })
}

fn gains_and_estimate() -> impl Strategy<Value = (Gains, AdaptiveEstimate)> {
    gains_of_one().prop_flat_map(|gains| (Just(gains), estimate(gains.safeguards)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_step_is_the_documented_one(
        (gains, before) in gains_and_estimate(),
        e2 in error(),
        unallocated in unallocated(),
        dt_s in 1e-4_f32..=0.02,
    ) {
        let mut after = before;
        step(gains, e2, unallocated, dt_s, &mut after);
        let (theta, delta) = reference(&gains, e2, unallocated, dt_s, &before);
        // Each increment has some ten roundings; 1 - leakage dt is rounded as a whole.
        let [gamma, eta, dt, e2] = [gains.gamma, gains.eta, dt_s, e2].map(f64::from);
        let learnt = e2.abs() * dt;
        let theta_size = f64::from(before.theta.abs().max()) + gamma * learnt;
        for (got, wanted) in after.theta.iter().zip(theta.iter()) {
            prop_assert!((f64::from(*got) - wanted).abs() <= 20.0 * U * theta_size + 1e-38, "{got:e} for {wanted:e}");
        }
        let allowed = 20.0 * U * (f64::from(before.delta) + eta * learnt) + 1e-38;
        prop_assert!((f64::from(after.delta) - delta).abs() <= allowed, "{:e} for {delta:e}", after.delta);
    }

    #[test]
    fn estimates_never_leave_their_bounds(
        gains in gains_of_one(),
        inputs in prop::collection::vec((error(), unallocated()), 1..100),
        dt_s in 1e-4_f32..=0.02,
    ) {
        let mut estimate = AdaptiveEstimate::default();
        let (theta_max, delta_max) = (f64::from(gains.safeguards.theta_max), gains.safeguards.delta_max);
        for (e2, unallocated) in inputs {
            let u = step(gains, e2, unallocated, dt_s, &mut estimate);
            let norm = estimate.theta.map(f64::from).norm();
            // The norm rounds in the sum of nine squares, a root, a quotient and a product. Squares below 1e-38 vanish.
            prop_assert!(norm <= theta_max * (1.0 + 12.0 * U) + 1e-18, "{norm} beyond {theta_max}");
            prop_assert!((0.0..=delta_max).contains(&estimate.delta), "{} beyond {delta_max}", estimate.delta);
            prop_assert!(u.is_finite());
        }
    }

    /// With `NONE` the step is the Euler step of (33), (34), bit for bit.
    #[test]
    fn no_safeguards_give_the_printed_law(
        gains in gains_of_one(),
        e2 in error(),
        dt_s in 1e-4_f32..=0.02,
        theta in prop::array::uniform9(-5.0_f32..5.0),
        delta in 0.0_f32..5.0,
    ) {
        let gains = Gains { safeguards: Safeguards::NONE, ..gains };
        let before = AdaptiveEstimate { theta: Matrix3::from_row_slice(&theta), delta };
        let FiringStrengths { first, second, share } = FuzzyBasis::new(gains.membership).unwrap().fire([0.0, e2]);
        let s = afbc_control::math::tanh(e2 * (1.0 / gains.epsilon));
        let printed = AdaptiveEstimate {
            theta: before.theta + first * (gains.gamma * e2 * share * dt_s) * second.transpose(),
            delta: before.delta + gains.eta * e2 * s * dt_s,
        };
        prop_assume!(printed.theta.norm() < 1e6 && printed.delta < 1e6);
        let mut after = before;
        step(gains, e2, 0.0, dt_s, &mut after);
        prop_assert_eq!(after.theta.map(f32::to_bits), printed.theta.map(f32::to_bits));
        prop_assert_eq!(after.delta.to_bits(), printed.delta.to_bits());
    }

    /// There is no adaptation towards a reached limit, and full adaptation away from it.
    #[test]
    fn anti_windup_acts_in_the_saturated_direction(
        (gains, before) in gains_and_estimate(),
        e2 in 1e-3_f32..10.0,
        missing in 1e-6_f32..100.0,
    ) {
        let safeguards = Safeguards { sigma: 0.0, ..gains.safeguards };
        let gains = Gains { safeguards, ..gains };
        let fly = |e2, missing| {
            let mut estimate = before;
            step(gains, e2, missing, 0.001, &mut estimate);
            estimate
        };
        let still = fly(0.0, 0.0);
        prop_assert_eq!(fly(e2, missing), still);
        prop_assert_eq!(fly(-e2, -missing), still);
        prop_assert_eq!(fly(e2, -missing), fly(e2, 0.0));
    }

    /// Without anti-windup, adaptation does not depend on the rotors' limits, bit for bit; with it, it does.
    #[test]
    fn anti_windup_acts_if_it_is_set(up_m in 1.0_f32..3.0, roll_rad in 0.2_f32..1.0) {
        let setpoint = Setpoint { position_m: Vector3::new(0.0, 0.0, up_m), ..Setpoint::default() };
        let state = State { attitude_rad: Vector3::new(roll_rad, 0.0, 0.0), ..State::default() };
        let fly = |anti_windup, rotor_force_max_n| {
            let settings =
                Settings { anti_windup, ..Profile::Flight.settings().with_rotor_force_max_n(rotor_force_max_n) };
            // There is no observer, because it would get the thrust that the rotors gave.
            let disturbance = DisturbanceObserver::DEFAULT;
            let settings = Settings { tilt_by_thrust: false, disturbance, ..settings };
            let law = Adaptive::new(Profile::Flight.gains()).unwrap();
            let controller = Controller::new(Parameters::PAPER.to_f32(), settings, law).unwrap();
            let mut memory = Validated::default();
            for _ in 0..20 {
                let _ = controller.step(&mut memory, Some(&state), &setpoint);
            }
            memory.control.estimates
        };
        let [careless, heeding] = [false, true].map(|heed| fly(heed, 0.5));
        prop_assert_eq!(careless, fly(false, 1e4));
        prop_assert_eq!(heeding.x, careless.x, "its limits are not the rotors'");
        prop_assert!(heeding.z.theta.m22 < careless.z.theta.m22 && heeding.roll != careless.roll);
    }
}

/// No step can turn an estimate's sign by leakage: the ranges of sigma and of the time step leave at least 0.8 of it.
#[test]
fn the_ranges_keep_the_leakage_slower_than_the_step() {
    let lost = Safeguards::SIGMA.range.max * afbc_control::Settings::DT.range.max;
    assert!(lost < 0.201, "{lost} of an estimate in a step");
}

/// Without an error, an estimate decays by exp(-sigma t). Under a constant error, delta_hat settles where adaptation
/// and leakage are equal.
#[test]
fn leakage_forgets_at_its_rate() {
    let dt_s = 0.001;
    for sigma in [0.01_f32, 0.5, 10.0] {
        let safeguards = Safeguards { sigma, ..Safeguards::NONE };
        let gains = Gains { safeguards, ..Profile::Paper.gains().x };
        let mut estimate = AdaptiveEstimate { theta: Matrix3::repeat(2.0), delta: 3.0 };
        for _ in 0..1000 {
            step(gains, 0.0, 0.0, dt_s, &mut estimate);
        }
        // (1 - sigma dt)^n is below exp(-sigma n dt) by a share of sigma^2 dt n dt / 2, at most 5 %; rounding adds 1000
        // U.
        let (exact, sigma) = ((-f64::from(sigma)).exp(), f64::from(sigma));
        let share = sigma * sigma * f64::from(dt_s) / 2.0 + 1e-4;
        for (got, start) in estimate.theta.iter().map(|theta| (theta, 2.0)).chain([(&estimate.delta, 3.0)]) {
            let left = f64::from(*got) / start / exact;
            assert!((1.0 - 1.1 * share..=1.0 + 1e-4).contains(&left), "sigma {sigma}: {left} of exp(-sigma t)");
        }
    }
    let (sigma, e2) = (0.2, 0.4);
    let safeguards = Safeguards { sigma, ..Safeguards::NONE };
    let gains = Gains { eta: 2.0, epsilon: 0.1, safeguards, ..Profile::Paper.gains().x };
    let mut estimate = AdaptiveEstimate::default();
    for _ in 0..60_000 {
        step(gains, e2, 0.0, dt_s, &mut estimate);
    }
    let settled = 2.0 * e2 * (e2 / 0.1).tanh() / sigma;
    assert!((estimate.delta / settled - 1.0).abs() < 1e-3, "{} for {settled}", estimate.delta);
}

/// A double integrator is measured with noise. The printed delta_hat grows throughout the flight. With the profile
/// `flight`, delta_hat settles.
#[test]
fn noise_drives_the_printed_delta_hat_and_not_the_hardened() {
    const SECOND: u32 = 1000;
    let fly = |profile: Profile| {
        let gains = profile.gains();
        let law = Adaptive::new(gains).unwrap();
        let (mut estimate, mut x, mut v, mut random) = (AdaptiveEstimate::default(), 0.0_f32, 0.0_f32, 1_u32);
        let mut noise = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        [500 * SECOND, 500 * SECOND].map(|steps| {
            for _ in 0..steps {
                let (x1, x2) = (x + 0.02 * noise(), v + 0.04 * noise());
                let tracking = SubsystemTracking { x1, x2, e1: -x1, ..SubsystemTracking::default() };
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
                let (u, _) = law.input(Axis::X, &tracking, &context, &mut estimate);
                v += (u + 0.3) * 0.001;
                x += v * 0.001;
                assert!(estimate.theta.norm() <= gains.x.safeguards.theta_max * 1.000_001);
            }
            assert!(x.abs() < 0.2, "{profile:?} lost it: {x}");
            estimate.delta
        })
    };
    let [half, whole] = fly(Profile::Paper);
    assert!(half > 2.0 && whole > 1.9 * half, "printed: {half}, then {whole}");
    let [half, whole] = fly(Profile::Flight);
    assert!(whole < 0.5 && whole < 1.2 * half, "hardened: {half}, then {whole}");
}
