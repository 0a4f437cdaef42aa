//! Compares the moment observer with its closed solution, and checks which effects it must not see as a moment.

use afbc::disturbance::{DisturbanceObserver, ObserverConditions};
use afbc::effectiveness::{AGED_S, SHARE_MAX, SHARE_MIN};
use afbc::moments::{AGE_S, MomentObserver, MomentObserverMemory};
use afbc_types::{Inputs, Parameters};
use nalgebra::Vector3;
use proptest::prelude::*;

const DT_S: f32 = 0.001;
const THRUST_MAX_N: f32 = 12.0;

fn observer(rad_s: f32, disturbance_lag_s: f32) -> MomentObserver {
    let settings = DisturbanceObserver {
        disturbance_tilt_rad_s: rad_s,
        disturbance_yaw_rad_s: rad_s,
        disturbance_lag_s,
        ..DisturbanceObserver::DEFAULT
    };
    MomentObserver::new(&settings, &Parameters::PAPER.to_f32(), THRUST_MAX_N, DT_S).unwrap()
}

fn conditions(fresh: bool, touches_ground: bool) -> ObserverConditions {
    ObserverConditions { fresh, touches_ground }
}

fn effectiveness() -> Vector3<f32> {
    Parameters::PAPER.to_f32().effectiveness()
}

/// A body under a moment, whose rotors lag by `lag_s` and give `share` of their nominal effect.
struct Body {
    rates: Vector3<f32>,
    input: Vector3<f32>,
    lag_s: f32,
    share: f32,
    memory: Option<MomentObserverMemory>,
}

impl Body {
    fn new(lag_s: f32, share: f32) -> Self {
        Body { rates: Vector3::zeros(), input: Vector3::zeros(), lag_s: lag_s + AGE_S, share, memory: None }
    }

    /// Turns one step with these inputs and moment \[rad/s2\]; returns the observer's output.
    fn step(&mut self, observer: &MomentObserver, u: &Vector3<f32>, f: &Vector3<f32>, effort: f32) -> Vector3<f32> {
        let seen = observer.advance(&mut self.memory, &self.rates, &Vector3::zeros(), conditions(true, false));
        observer.record_inputs(
            &mut self.memory,
            &Inputs { roll_n: u.x, pitch_n: u.y, yaw_n: u.z, thrust_n: 5.0 },
            effort,
        );
        self.rates += (self.input.component_mul(&effectiveness()) * self.share + f) * DT_S;
        self.input += (u - self.input) * (1.0 - (-DT_S / self.lag_s).exp());
        seen
    }
}

#[test]
fn without_a_bandwidth_there_is_none() {
    let none = DisturbanceObserver::DEFAULT;
    assert!(MomentObserver::new(&none, &Parameters::PAPER.to_f32(), THRUST_MAX_N, DT_S).is_none());
}

/// For a constant moment f, f_hat is f behind two poles at w, whatever the rotors do.
#[test]
fn a_constant_moment_is_found_as_two_poles_say() {
    for w in [15.0, 40.0, 100.0] {
        let (observer, f) = (observer(w, 0.02), Vector3::new(0.2 * w, -0.1 * w, 0.03 * w));
        let mut body = Body::new(0.02, 1.0);
        for step in 0..1500_u16 {
            let t = f32::from(step) * DT_S;
            let u = Vector3::new((9.0 * t).sin(), 0.5 * (5.0 * t).cos(), -0.3 * (7.0 * t).sin()) * 0.2;
            let seen = body.step(&observer, &u, &f, 1.0);
            let expected = f * (1.0 - (1.0 + w * t) * (-w * t).exp());
            let off = (seen - expected).component_div(&f).abs().max();
            assert!(off < 0.05, "{w} rad/s, step {step}: {seen:?}, not {expected:?}");
        }
    }
}

/// Known weakness and a known lag of the rotors do not look like a moment.
#[test]
fn what_the_rotors_do_is_no_moment() {
    for lag_s in [0.01, 0.02, 0.07] {
        for share in [0.6, 1.0, 1.25] {
            let observer = observer(40.0, lag_s);
            let mut body = Body::new(lag_s, share);
            for step in 0..3000_u16 {
                let t = f32::from(step) * DT_S;
                let u = Vector3::new((9.0 * t).sin(), (6.0 * t).cos(), (4.0 * t).sin()) * 0.3;
                let seen = body.step(&observer, &u, &Vector3::zeros(), 1.0 / share);
                let largest = effectiveness() * 0.3 * share;
                let off = seen.component_div(&largest).abs().max();
                assert!(step < 300 || off < 0.03, "{lag_s} s, {share}, step {step}: {seen:?}");
            }
        }
    }
}

/// A jump of the rates, as after an outage, changes nothing, nor does a repeated state; on the ground f_hat is zero.
#[test]
fn jumps_and_old_states_teach_nothing() {
    let observer = observer(40.0, 0.02);
    let (mut body, f, zero) = (Body::new(0.02, 1.0), Vector3::new(8.0, -5.0, 1.0), Vector3::zeros());
    for _ in 0..1000 {
        body.step(&observer, &zero, &f, 1.0);
    }
    let before = body.step(&observer, &zero, &f, 1.0);
    body.rates += Vector3::new(20.0, -20.0, 3.0);
    for _ in 0..100 {
        let seen = body.step(&observer, &zero, &f, 1.0);
        assert!((seen - before).abs().max() < 0.05, "{seen:?}, {before:?} before");
    }
    let held = observer.advance(&mut body.memory, &(body.rates * 2.0), &Vector3::zeros(), conditions(false, false));
    assert_eq!(
        observer.advance(&mut body.memory, &(body.rates * -3.0), &Vector3::zeros(), conditions(false, false)),
        held
    );
    assert_eq!(observer.advance(&mut body.memory, &body.rates, &Vector3::zeros(), conditions(true, true)), zero);
    assert!(
        observer.advance(&mut body.memory, &body.rates, &Vector3::zeros(), conditions(true, false)).abs().max() < 0.5
    );
}

proptest! {
    /// For any rates, f_hat stays finite and within what the rotors can compensate.
    #[test]
    fn it_is_bounded(
        w in 0.1_f32..500.0,
        lag_s in 0.0_f32..0.5,
        steps in prop::collection::vec((-1e3_f32..1e3, -1e3_f32..1e3, -50.0_f32..50.0, 0.7_f32..1.8), 1..200),
    ) {
        let (observer, mut memory) = (observer(w, lag_s), None);
        let most = effectiveness() * (0.5 * THRUST_MAX_N * 1.0001);
        for (p, r, u, effort) in steps {
            let rates = Vector3::new(p, -p, r);
            let seen = observer.advance(&mut memory, &rates, &Vector3::zeros(), conditions(true, false));
            prop_assert!(seen.iter().zip(most.iter()).all(|(f, most)| f.abs() <= *most), "{seen:?}");
            observer.record_inputs(&mut memory, &Inputs { roll_n: u, pitch_n: -u, yaw_n: u, thrust_n: 5.0 }, effort);
        }
    }
}

/// The observer does not observe known moments if the rates have the assumed age. A moment as force gives an angular
/// acceleration by the factor mass over inertia.
#[test]
fn what_is_known_is_not_observed() {
    let (observer, vehicle) = (observer(60.0, 0.02), Parameters::PAPER.to_f32());
    let per_moment = vehicle.inertia_kg_m2.map(|inertia| vehicle.mass_kg / inertia);
    let amplitude = observer.angular_acceleration_rad_s2(&Vector3::new(0.02, -0.01, 0.005));
    assert!((amplitude - Vector3::new(0.02, -0.01, 0.005).component_mul(&per_moment)).norm() < 1e-5);
    for age_s in [0.0, AGE_S] {
        let (mut memory, mut rates, mut seen_rates): (Option<MomentObserverMemory>, _, _) =
            (None, Vector3::zeros(), Vector3::zeros());
        let mut largest = 0.0_f32;
        for k in 0..4_000 {
            let known = amplitude * (10.0 * k as f32 * DT_S).sin();
            let seen = observer.advance(&mut memory, &seen_rates, &known, conditions(true, false));
            largest = largest.max(seen.component_div(&amplitude).abs().max());
            rates += known * DT_S;
            seen_rates += (rates - seen_rates) * if age_s > 0.0 { 1.0 - (-DT_S / age_s).exp() } else { 1.0 };
        }
        // The known moment has a frequency of 10 rad/s. Rates that are 10 ms too young give an error of a tenth.
        assert!(if age_s > 0.0 { largest < 0.02 } else { (0.08..0.12).contains(&largest) }, "{age_s}: {largest}");
    }
    let found = Vector3::new(1.0, 2.0, -3.0);
    let against = Vector3::from(observer.compensating_inputs_n(&found)).component_mul(&effectiveness());
    assert!((against + found).norm() < 1e-4, "{against}");
}

/// Swings a body about roll and pitch with large moments for 5 s, at this angular frequency; the observer sees rates
/// that are older by `late_s`. Returns the learnt share of the effectiveness.
fn swung(share: f32, rad_s: f32, late_s: f32, f: &Vector3<f32>) -> f32 {
    let (observer, mut body) = (observer(60.0, 0.02), Body::new(0.02, share));
    let mut wire = std::collections::VecDeque::from(vec![Vector3::zeros(); (late_s / DT_S) as usize]);
    for step in 0..5000_u16 {
        let t = f32::from(step) * DT_S;
        let u = Vector3::new((rad_s * t).sin(), (rad_s * t).cos(), 0.0) * 2.0;
        wire.push_back(body.rates);
        let rates = std::mem::replace(&mut body.rates, wire.pop_front().unwrap());
        body.step(&observer, &u, &Vector3::zeros(), 1.0);
        let turned = (body.input.component_mul(&effectiveness()) * share + f) * DT_S;
        body.rates = rates + turned;
    }
    body.memory.unwrap().effectiveness_share()
}

/// A vehicle that turns less by its moments than the model is known by it, whatever constant moment acts beside.
#[test]
fn the_effectiveness_is_learnt_from_large_moments() {
    for share in [0.3, 0.4, 0.6, 1.0] {
        for rad_s in [10.0, 20.0, 30.0] {
            for f in [Vector3::zeros(), Vector3::new(20.0, -10.0, 0.0)] {
                let learnt = swung(share, rad_s, 0.0, &f);
                // The observer leaves out a shortfall that old rates may explain.
                let aged = 0.5 * (AGED_S * rad_s) * (AGED_S * rad_s);
                let (least, most) = (share - 0.05, share + aged.min(1.0 - share) + 0.05);
                assert!((least..most).contains(&learnt), "{share} at {rad_s} rad/s, {f:?}: {learnt}");
            }
        }
    }
}

/// Old rates are not taken for a vehicle that turns less.
#[test]
fn old_rates_are_no_missing_effectiveness() {
    for late_s in [0.005, 0.01, AGED_S] {
        for rad_s in [10.0, 20.0, 40.0, 60.0] {
            let learnt = swung(1.0, rad_s, late_s, &Vector3::zeros());
            assert!(learnt > 0.9, "{late_s} s late at {rad_s} rad/s: {learnt}");
        }
    }
}

/// Small moments, as in a hover, teach nothing.
#[test]
fn small_moments_teach_nothing() {
    let (observer, mut body) = (observer(60.0, 0.02), Body::new(0.02, 0.5));
    for step in 0..5000_u16 {
        let t = f32::from(step) * DT_S;
        body.step(&observer, &(Vector3::new((20.0 * t).sin(), (20.0 * t).cos(), 0.0) * 0.02), &Vector3::zeros(), 1.0);
    }
    let learnt = body.memory.unwrap().effectiveness_share();
    assert!((learnt - 1.0).abs() < 0.05, "{learnt}");
}

proptest! {
    /// The share stays within its bounds for any rates and inputs, and on the ground.
    #[test]
    fn the_effectiveness_stays_within_bounds(
        numbers in prop::collection::vec((-1e3_f32..1e3, -1e3_f32..1e3, -50.0_f32..50.0, any::<[bool; 2]>()), 1..300),
    ) {
        let (observer, mut memory) = (observer(60.0, 0.02), None);
        for (roll, pitch, u, [fresh, touches_ground]) in numbers {
            let rates = Vector3::new(roll, pitch, 0.0);
            observer.advance(&mut memory, &rates, &Vector3::zeros(), conditions(fresh, touches_ground));
            observer.record_inputs(&mut memory, &Inputs { roll_n: u, pitch_n: -u, ..Inputs::default() }, 1.0);
            let share = memory.as_ref().unwrap().effectiveness_share();
            prop_assert!((SHARE_MIN..=SHARE_MAX).contains(&share), "{}", share);
        }
    }
}
