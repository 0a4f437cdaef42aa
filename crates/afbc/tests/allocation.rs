//! Properties of the mixer: there and back, and its limits under anything.
#![allow(clippy::unwrap_used, missing_docs)] // a mixer that cannot be built must stop the test

use afbc::allocation::{FORCE_MAX, Mixer};
use airframe::{Inputs, Parameters, RotorForces};
use nalgebra::Vector4;
use proptest::prelude::*;

/// Rounding error of one `f32` operation, relative.
const U: f32 = 1.0 / (1 << 24) as f32;

fn mixer(force_max_n: f32) -> Mixer {
    Mixer::new(&Parameters::PAPER.to_f32(), force_max_n).unwrap()
}

fn inputs(values: [f32; 4]) -> Inputs {
    let [roll_n, pitch_n, yaw_n, thrust_n] = values;
    Inputs { roll_n, pitch_n, yaw_n, thrust_n }
}

fn list(inputs: &Inputs) -> [f32; 4] {
    [inputs.roll_n, inputs.pitch_n, inputs.yaw_n, inputs.thrust_n]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_the_rotors_can_give_they_give(forces in prop::array::uniform4(0.0_f32..30.0)) {
        let wanted = Mixer::inputs(&RotorForces(Vector4::from(forces)));
        let mixer = mixer(31.0);
        let allocation = mixer.allocate(&wanted);
        let total: f32 = forces.iter().sum();
        // A force is a sum of three terms of at most the total, each rounded twice; so are the inputs again.
        for (got, force) in allocation.forces.0.iter().zip(forces) {
            prop_assert!((got - force).abs() <= 6.0 * U * total, "{got} for {force}");
        }
        for (got, wanted) in list(&Mixer::inputs(&allocation.forces)).into_iter().zip(list(&wanted)) {
            prop_assert!((got - wanted).abs() <= 24.0 * U * total, "{got} for {wanted}");
        }
        // A force that is nothing may come out as the rounding of nothing, negative and clipped; none else may.
        prop_assert!(!allocation.saturated || forces.iter().any(|force| *force <= 6.0 * U * total));
    }

    #[test]
    fn speeds_and_forces_are_inverse(force in prop::array::uniform4(0.0_f32..1e4)) {
        let mixer = mixer(1e4);
        let forces = RotorForces(Vector4::from(force));
        let speeds = mixer.speeds(&forces);
        // 1/b, the product and the root (which halves errors) forth; two products back.
        for (back, force) in mixer.forces(&speeds).0.iter().zip(force) {
            prop_assert!((back - force).abs() <= 6.0 * U * force, "{back} for {force}");
        }
        let b = Parameters::PAPER.thrust_factor_n_s2;
        for (speed, force) in speeds.0.iter().zip(force) {
            let exact = (f64::from(force) / b).sqrt();
            prop_assert!((f64::from(*speed) - exact).abs() <= 3.0 * f64::from(U) * exact, "{speed} for {exact}");
        }
    }

    #[test]
    fn whatever_is_asked_every_force_stays_within_its_limits(
        asked in prop::array::uniform4(prop_oneof![prop::num::f32::ANY, -100.0_f32..100.0]), limit in 1e-3_f32..1e4,
    ) {
        let mixer = mixer(limit);
        let allocation = mixer.allocate(&inputs(asked));
        prop_assert!(allocation.forces.0.iter().all(|force| (0.0..=limit).contains(force)), "{allocation:?}");
        let fastest = (f64::from(limit) / Parameters::PAPER.thrust_factor_n_s2).sqrt() * (1.0 + 3.0 * f64::from(U));
        let speeds = mixer.speeds(&allocation.forces);
        prop_assert!(speeds.0.iter().all(|speed| (0.0..=fastest).contains(&f64::from(*speed))), "{speeds:?}");
        if asked.iter().any(|value| value.is_nan()) {
            prop_assert!(allocation.saturated, "a NaN went unnoticed");
        }
    }

    #[test]
    fn a_clipped_rotor_is_reported_and_only_then(asked in prop::array::uniform4(-10.0_f64..10.0), limit in 0.1_f64..5.0) {
        let [u1, u2, u3, u4] = asked;
        let wanted = [
            (u4 + u3) / 4.0 - u1 / 2.0,
            (u4 - u3) / 4.0 - u2 / 2.0,
            (u4 + u3) / 4.0 + u1 / 2.0,
            (u4 - u3) / 4.0 + u2 / 2.0,
        ];
        // Nothing can be said of a force within rounding of a limit.
        let margin = 1e-5;
        prop_assume!(wanted.iter().all(|force| force.abs() > margin && (force - limit).abs() > margin));
        let allocation = mixer(limit as f32).allocate(&inputs(asked.map(|value| value as f32)));
        prop_assert_eq!(allocation.saturated, wanted.iter().any(|force| !(0.0..=limit).contains(force)));
        for (force, wanted) in allocation.forces.0.iter().zip(wanted) {
            prop_assert!((f64::from(*force) - wanted.clamp(0.0, limit)).abs() <= margin, "{force} for {wanted}");
        }
    }
}

#[test]
fn nan_becomes_no_force() {
    let mixer = mixer(10.0);
    let all = mixer.allocate(&inputs([0.0, 0.0, 0.0, f32::NAN]));
    assert_eq!(all.forces.0, Vector4::zeros());
    assert!(all.saturated);
    // Only the rotors that the NaN reaches.
    let roll = mixer.allocate(&inputs([f32::NAN, 0.0, 0.0, 8.0]));
    assert_eq!(roll.forces.0, Vector4::new(0.0, 2.0, 0.0, 2.0));
    // Opposed infinities are a NaN too.
    let opposed = mixer.allocate(&inputs([0.0, 0.0, f32::NEG_INFINITY, f32::INFINITY]));
    assert_eq!(opposed.forces.0, Vector4::new(0.0, 10.0, 0.0, 10.0));
}

#[test]
fn a_limit_out_of_range_is_refused_by_name() {
    let vehicle = Parameters::PAPER.to_f32();
    for limit in [0.0, -1.0, 2e4, f32::NAN, f32::INFINITY] {
        assert_eq!(Mixer::new(&vehicle, limit).unwrap_err().range, FORCE_MAX);
    }
    let weightless = Parameters { mass_kg: 0.0, ..vehicle };
    assert_eq!(Mixer::new(&weightless, 10.0).unwrap_err().range.name, "mass_kg");
}
