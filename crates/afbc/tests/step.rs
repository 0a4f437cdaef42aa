//! Properties of one controller step, for every law: any input gives valid motor commands.
#![allow(clippy::unwrap_used, missing_docs)] // a controller that cannot be built must stop the test

use crate::common::{check_step, gains, plausible, setpoint, settings, state, step, value};
use afbc::adaptive::Gains;
use afbc::{Adaptive, AdaptiveEstimate, Backstepping, CascadeMemory, Controller, Profile, Settings, SubsystemLaw};
use afbc_control::{Health, Validated};
use afbc_types::{Axis, Parameters, PerAxis, Setpoint, State};
use core::any::Any;
use proptest::prelude::*;

fn sequence<S: Strategy<Value = f32> + 'static>(value: fn() -> S) -> impl Strategy<Value = Vec<(State, Setpoint)>> {
    prop::collection::vec((state(value), setpoint(value)), 50)
}

fn adaptive(gains: PerAxis<Gains>, settings: Settings) -> Controller<Adaptive> {
    Controller::new(Parameters::PAPER.to_f32(), settings, Adaptive::new(gains).unwrap()).unwrap()
}

fn backstepping(gains: PerAxis<Gains>, settings: Settings) -> Controller<Backstepping> {
    let vehicle = Parameters::PAPER.to_f32();
    let gains = PerAxis::from_fn(|axis| gains[axis].backstepping);
    Controller::new(vehicle, settings, Backstepping::new(&vehicle, gains).unwrap()).unwrap()
}

/// Returns AFBC's estimates, zero for a law without any.
fn estimates<L: SubsystemLaw>(memory: &Validated<CascadeMemory<L::Estimate>>) -> PerAxis<AdaptiveEstimate> {
    let adaptive = |estimate: &dyn Any| estimate.downcast_ref().copied().unwrap_or_default();
    PerAxis::from_fn(|axis| adaptive(&memory.control.estimates[axis]))
}

fn check_estimates(estimates: &PerAxis<AdaptiveEstimate>) -> Result<(), TestCaseError> {
    for axis in Axis::ALL {
        let estimate = &estimates[axis];
        prop_assert!(
            estimate.delta.is_finite() && estimate.theta.iter().all(|t| t.is_finite()),
            "{axis:?} {estimate:?}"
        );
    }
    Ok(())
}

/// Flies a sequence of random inputs, with the checks of every step and of rejected inputs.
fn fly_anything<L: SubsystemLaw>(
    controller: &Controller<L>,
    settings: &Settings,
    inputs: &[(State, Setpoint)],
) -> Result<(), TestCaseError> {
    let mut memory = Validated::default();
    let mut seen_state = false;
    for (state, setpoint) in inputs {
        let before = estimates::<L>(&memory);
        let command = step(controller, &mut memory, state, setpoint);
        let after = estimates::<L>(&memory);
        check_step(&command, settings)?;
        check_estimates(&after)?;
        prop_assert_eq!(command.action.health.state_rejected, !state.is_plausible());
        prop_assert_eq!(command.action.health.setpoint_rejected, !setpoint.is_plausible());
        if !state.is_plausible() {
            prop_assert_eq!(after, before, "an implausible state taught the law something");
        }
        seen_state |= state.is_plausible();
        if !seen_state {
            prop_assert!(command.action.speeds.0.iter().all(|w| *w == 0.0), "rotors turn before there is a state");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_input_to_afbc_gives_valid_motor_commands(
        gains in gains(),
        settings in settings(),
        inputs in sequence(value),
    ) {
        fly_anything(&adaptive(gains, settings), &settings, &inputs)?;
    }

    #[test]
    fn any_input_to_backstepping_gives_valid_motor_commands(
        gains in gains(),
        settings in settings(),
        inputs in sequence(value),
    ) {
        fly_anything(&backstepping(gains, settings), &settings, &inputs)?;
    }

    #[test]
    fn the_same_inputs_give_the_same_bits(gains in gains(), settings in settings(), inputs in sequence(value)) {
        let controller = adaptive(gains, settings);
        let fly = || {
            let mut memory = Validated::default();
            inputs
                .iter()
                .map(|(state, setpoint)| {
                    let command = step(&controller, &mut memory, state, setpoint);
                    let estimates = estimates::<Adaptive>(&memory);
                    let learnt = Axis::ALL.map(|axis| estimates[axis].theta.map(f32::to_bits));
                    (command.action.speeds.0.map(f32::to_bits), learnt)
                })
                .collect::<Vec<_>>()
        };
        prop_assert_eq!(fly(), fly());
    }

    /// While a state is implausible, the step uses the last plausible state, without adaptation.
    #[test]
    fn the_last_plausible_state_is_used_instead(
        good in state(plausible),
        bad in state(value),
        setpoint in setpoint(plausible),
        next in setpoint(plausible),
    ) {
        prop_assume!(!bad.is_plausible());
        let controller = adaptive(Profile::Paper.gains(), Profile::Paper.settings());
        let mut memory = Validated::default();
        step(&controller, &mut memory, &good, &setpoint);
        let mut other = memory;

        let stood_in = step(&controller, &mut memory, &bad, &next);
        let wanted = step(&controller, &mut other, &good, &next);
        prop_assert_eq!(stood_in.action.speeds, wanted.action.speeds);
        prop_assert_eq!(stood_in.trace.errors, wanted.trace.errors);
        let mut health = Health::default();
        (health.state_rejected, health.saturated) = (true, wanted.action.health.saturated);
        prop_assert_eq!(stood_in.action.health, health);
        prop_assert_ne!(memory.control.estimates, other.control.estimates, "the plausible twin should have learnt");
    }

    /// While a setpoint is implausible, the last plausible one is used, with adaptation. Before the first one, the
    /// vehicle holds its position.
    #[test]
    fn the_last_plausible_setpoint_is_used_instead(
        state in state(plausible),
        good in setpoint(plausible),
        bad in setpoint(value),
        after in state(plausible),
    ) {
        prop_assume!(!bad.is_plausible());
        let controller = adaptive(Profile::Paper.gains(), Profile::Paper.settings());
        for first in [Some(good), None] {
            let (mut memory, mut other) = (Validated::default(), Validated::default());
            let substitute = first.unwrap_or(Setpoint::hold(&state));
            let started = step(&controller, &mut memory, &state, &first.unwrap_or(bad));
            let wanted = step(&controller, &mut other, &state, &substitute);
            prop_assert_eq!(started.action.speeds, wanted.action.speeds);
            prop_assert_eq!(started.action.health.setpoint_rejected, first.is_none());

            let stood_in = step(&controller, &mut memory, &after, &bad);
            let wanted = step(&controller, &mut other, &after, &substitute);
            prop_assert_eq!(stood_in.action.speeds, wanted.action.speeds);
            prop_assert!(stood_in.action.health.setpoint_rejected && !stood_in.action.health.state_rejected);
            prop_assert_eq!(memory.control.estimates, other.control.estimates);
        }
    }
}

/// For each field separately, NaN, infinite and slightly too large values are refused, but the largest accepted value
/// is not.
#[test]
fn every_field_is_checked_for_plausibility() {
    type SetState = fn(&mut State, f32);
    type SetSetpoint = fn(&mut Setpoint, f32);
    let states: [(SetState, f32); 12] = [
        (|s, v| s.position_m.x = v, 1e5),
        (|s, v| s.position_m.y = v, 1e5),
        (|s, v| s.position_m.z = v, 1e5),
        (|s, v| s.velocity_m_s.x = v, 1e3),
        (|s, v| s.velocity_m_s.y = v, 1e3),
        (|s, v| s.velocity_m_s.z = v, 1e3),
        (|s, v| s.attitude_rad.x = v, 1e3),
        (|s, v| s.attitude_rad.y = v, 1e3),
        (|s, v| s.attitude_rad.z = v, 1e3),
        (|s, v| s.rates_rad_s.x = v, 1e3),
        (|s, v| s.rates_rad_s.y = v, 1e3),
        (|s, v| s.rates_rad_s.z = v, 1e3),
    ];
    let setpoints: [(SetSetpoint, f32); 18] = [
        (|s, v| s.position_m.x = v, 1e5),
        (|s, v| s.position_m.y = v, 1e5),
        (|s, v| s.position_m.z = v, 1e5),
        (|s, v| s.velocity_m_s.x = v, 1e3),
        (|s, v| s.velocity_m_s.y = v, 1e3),
        (|s, v| s.velocity_m_s.z = v, 1e3),
        (|s, v| s.acceleration_m_s2.x = v, 1e3),
        (|s, v| s.acceleration_m_s2.y = v, 1e3),
        (|s, v| s.acceleration_m_s2.z = v, 1e3),
        (|s, v| s.jerk_m_s3.x = v, 1e5),
        (|s, v| s.jerk_m_s3.y = v, 1e5),
        (|s, v| s.jerk_m_s3.z = v, 1e5),
        (|s, v| s.snap_m_s4.x = v, 1e7),
        (|s, v| s.snap_m_s4.y = v, 1e7),
        (|s, v| s.snap_m_s4.z = v, 1e7),
        (|s, v| s.yaw_rad = v, 1e3),
        (|s, v| s.yaw_rate_rad_s = v, 1e3),
        (|s, v| s.yaw_acceleration_rad_s2 = v, 1e3),
    ];
    let controller = adaptive(Profile::Paper.gains(), Profile::Paper.settings());
    let health = |state, setpoint| step(&controller, &mut Validated::default(), &state, &setpoint).action.health;
    let bad = |max: f32| [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, max.next_up(), -max.next_up()];
    for (index, (set, max)) in states.into_iter().enumerate() {
        let with = |value| {
            let mut state = State::default();
            set(&mut state, value);
            health(state, Setpoint::default()).state_rejected
        };
        assert!(!with(max) && !with(-max), "field {index}");
        for value in bad(max) {
            assert!(with(value), "field {index} = {value}");
        }
    }
    for (index, (set, max)) in setpoints.into_iter().enumerate() {
        let with = |value| {
            let mut setpoint = Setpoint::default();
            set(&mut setpoint, value);
            health(State::default(), setpoint).setpoint_rejected
        };
        assert!(!with(max) && !with(-max), "field {index}");
        for value in bad(max) {
            assert!(with(value), "field {index} = {value}");
        }
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let paper = Profile::Paper.settings();
    let build = |settings| {
        let law = Adaptive::new(Profile::Paper.gains()).unwrap();
        Controller::new(Parameters::PAPER.to_f32(), settings, law).map(|_| ()).map_err(|error| error.range.name)
    };
    assert_eq!(build(paper), Ok(()));
    for bad in [0.0, -1.0, 1e9, f32::NAN, f32::INFINITY] {
        assert_eq!(build(paper.with_dt_s(bad)), Err("dt_s"));
        assert_eq!(build(Settings { command_filter_rad_s: bad, ..paper }), Err("command_filter_rad_s"));
        assert_eq!(build(paper.with_rotor_force_max_n(bad)), Err("rotor_force_max_n"));
    }
}
