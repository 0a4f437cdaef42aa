//! Tests of the rate controller.
#![allow(clippy::expect_used, reason = "a test that cannot go on should say why")]

use crate::motor::Response;
use crate::rate_control::{RateControl, RateMemory, RateTarget};
use afbc_control::Mixer;
use afbc_types::{Inputs, Parameters, State};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Simulates a rigid body with lagging rotors under rate control. Returns the state after `ms` milliseconds and the
/// largest rates.
fn turn(lag_s: f32, true_lag_s: f32, push_rad_s2: Vector3<f32>, target: &RateTarget, ms: u32) -> (State, Vector3<f32>) {
    let parameters = Parameters::PAPER.to_f32();
    let mixer = Mixer::<4>::new(parameters, 3.0).expect("valid");
    let control = RateControl::new(&parameters, &Response { time_constant_s: lag_s }, 1e-3);
    let (mut memory, mut state, mut given) = (RateMemory::default(), State::default(), Vector3::zeros());
    let inertia = parameters.inertia_kg_m2;
    let mut most = Vector3::zeros();
    for _ in 0..ms {
        let action = control.advance(&mixer, &mut memory, &state, target);
        let Inputs { roll_n, pitch_n, yaw_n, .. } = action.given;
        let wanted = Vector3::new(roll_n, pitch_n, yaw_n).component_mul(&parameters.effectiveness());
        given += (wanted - given) * (1e-3 / true_lag_s);
        let rates = state.rates_rad_s;
        let gyroscopic = rates.cross(&inertia.component_mul(&rates)).component_div(&inertia);
        state.rates_rad_s += (given + push_rad_s2 - gyroscopic) * 1e-3;
        most = most.sup(&state.rates_rad_s.abs());
    }
    (state, most)
}

proptest! {
    /// Rates are reached about all axes at once, with rotors faster or slower than their model, and against unknown
    /// moments. Yaw has a tenth of the authority.
    #[test]
    fn rates_are_reached(
        lag_s in 0.005f32..0.1,
        ratio in 0.75f32..1.3,
        rates in prop::array::uniform3(-6.0f32..6.0),
        push in prop::array::uniform3(-4.0f32..4.0),
        thrust in 0.35f32..0.6,
    ) {
        let (rates, push) = (Vector3::from(rates), Vector3::from(push));
        let wanted = Vector3::new(rates.x, rates.y, 0.1 * rates.z);
        let push = Vector3::new(push.x, push.y, 0.1 * push.z);
        let target = RateTarget { rates_rad_s: wanted, thrust };
        let (state, most) = turn(lag_s, ratio * lag_s, push, &target, 4_000);
        prop_assert!((state.rates_rad_s - wanted).amax() < 0.05, "{:?}", state);
        let room = wanted.abs().map(|rate| 1.4 * rate + 1.0);
        prop_assert!(most.x < room.x && most.y < room.y && most.z < room.z, "{:?}", most);
    }

    #[test]
    fn what_is_no_number_is_no_target(
        rates in prop::array::uniform3(-2e3f32..2e3),
        thrust in -0.5f32..1.5,
        place in 0usize..5,
    ) {
        let mut target = RateTarget { rates_rad_s: rates.into(), thrust };
        let expected = rates.iter().all(|rate| rate.abs() <= 1e3) && (0.0..=1.0).contains(&thrust);
        prop_assert_eq!(target.is_plausible(), expected);
        match place {
            0..3 => target.rates_rad_s.iter_mut().nth(place).into_iter().for_each(|rate| *rate = f32::NAN),
            3 => target.thrust = f32::NAN,
            _ => target.thrust = f32::INFINITY,
        }
        prop_assert!(!target.is_plausible());
    }
}

/// Nothing is learnt while rotors saturate, or while the vehicle is still accelerating to the rate.
#[test]
fn limits_teach_nothing() {
    let parameters = Parameters::PAPER.to_f32();
    let mixer = Mixer::<4>::new(parameters, 3.0).expect("valid");
    let control = RateControl::new(&parameters, &Response::DEFAULT, 1e-3);
    let mut memory = RateMemory::default();
    let fast = RateTarget { rates_rad_s: Vector3::new(900.0, 0.0, 0.0), thrust: 0.5 };
    let slow = RateTarget { rates_rad_s: Vector3::new(2.0, 0.0, 0.0), thrust: 0.5 };
    for target in [fast, slow] {
        let action = control.advance(&mixer, &mut memory, &State::default(), &target);
        assert!(action.given.roll_n > 0.0 && memory.learnt == Vector3::zeros());
    }
}
