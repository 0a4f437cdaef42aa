//! Tests of the interface's defaults for every controller: a screen before each step, and the answers of a law without
//! a fallback.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use afbc_control::{Action, FlightController, Health, Mixer, Trace, Validated};
use afbc_types::{Inputs, PLUS, Parameters, ROTORS_MAX, Setpoint, State};
use nalgebra::Vector3;
use proptest::prelude::*;

/// A controller that gives a constant thrust and records its inputs.
struct Listener(Mixer);

/// Inputs of the last step, and number of steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Seen {
    steps: u32,
    state: State,
    setpoint: Setpoint,
    fresh: bool,
}

const THRUST_N: f32 = 4.8;

impl FlightController for Listener {
    type Memory = Seen;

    fn dt_s(&self) -> f32 {
        0.001
    }

    fn mixer(&self) -> &Mixer {
        &self.0
    }

    fn decide(&self, memory: &mut Seen, state: &State, setpoint: &Setpoint, fresh: bool) -> Action {
        *memory = Seen { steps: memory.steps + 1, state: *state, setpoint: *setpoint, fresh };
        self.0.action(&Inputs { roll_n: 0.1, thrust_n: THRUST_N, ..Inputs::default() })
    }

    fn trace(_: &Seen) -> Trace {
        Trace::default()
    }
}

fn listener() -> Listener {
    Listener(Mixer::new(Parameters::PAPER.to_f32(), 3.0).unwrap())
}

/// A plausible number, or sometimes an implausible one.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![12 => -3.0_f32..3.0, 1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, 1e6, -1e6])]
}

fn state() -> impl Strategy<Value = Option<State>> {
    let any = (number(), number(), number()).prop_map(|(x, v, yaw)| State {
        position_m: Vector3::new(x, 0.1, 0.2),
        velocity_m_s: Vector3::new(0.0, v, 0.0),
        attitude_rad: Vector3::new(0.0, 0.0, yaw),
        ..State::default()
    });
    prop::option::weighted(0.8, any)
}

fn setpoint() -> impl Strategy<Value = Setpoint> {
    (number(), number()).prop_map(|(x, yaw_rad)| Setpoint {
        position_m: Vector3::new(x, 0.0, 0.0),
        yaw_rad,
        ..Setpoint::default()
    })
}

proptest! {
    /// The law gets the last plausible state and setpoint, and whether the state is new. Without any state, it does not
    /// run, and the rotors stand still. Without any setpoint, it holds the position.
    #[test]
    fn a_law_sees_what_is_plausible(steps in prop::collection::vec((state(), setpoint()), 1..40)) {
        let (listener, mut memory) = (listener(), Validated::default());
        let (mut last_state, mut last_setpoint, mut seen) = (None, None, Seen::default());
        for (measured, setpoint) in steps {
            let fresh = measured.is_some_and(|state| state.is_plausible());
            if fresh {
                last_state = measured;
            }
            if setpoint.is_plausible() {
                last_setpoint = Some(setpoint);
            }
            let action = listener.step(&mut memory, measured.as_ref(), &setpoint);
            let health = action.health;
            prop_assert_eq!(health.state_rejected, !fresh);
            prop_assert_eq!(health.setpoint_rejected, !setpoint.is_plausible());
            let Some(state) = last_state else {
                prop_assert_eq!(action, { let mut none = Action::default(); none.health = health; none });
                prop_assert!(!health.saturated && health.fallback.is_none());
                prop_assert_eq!(memory.control, seen);
                continue;
            };
            let setpoint = *last_setpoint.get_or_insert(Setpoint::hold(&state));
            seen = Seen { steps: seen.steps + 1, state, setpoint, fresh };
            prop_assert_eq!(memory.control, seen);
            prop_assert!((action.forces.0.sum() - THRUST_N).abs() < 1e-5 && action.given.thrust_n == THRUST_N);
            prop_assert!(action.speeds.0.iter().all(|speed| *speed > 100.0));
        }
    }
}

/// A law without a fallback need not implement `engage`.
#[test]
fn a_plain_law_has_no_fallback() {
    let (listener, mut memory) = (listener(), Validated::default());
    let _ = listener.step(&mut memory, Some(&State::default()), &Setpoint::default());
    let before = memory;
    assert!(!listener.engage(&mut memory.control));
    listener.position_lost(&mut memory.control);
    assert_eq!(memory, before);
}

/// An action reports saturation exactly if rotors saturate, and no other fault.
#[test]
fn an_action_says_whether_it_saturates() {
    let mixer = listener().0;
    for (thrust_n, saturated) in [(THRUST_N, false), (13.0, true), (-1.0, true)] {
        let action = mixer.action(&Inputs { thrust_n, ..Inputs::default() });
        let mut health = Health::default();
        health.saturated = saturated;
        assert_eq!(action.health, health, "{thrust_n} N");
        assert!((action.given.thrust_n - thrust_n.clamp(0.0, 12.0)).abs() < 1e-5);
    }
}

/// A padded action, for logs of any vehicle, has the vehicle's own rotors first, then zeros.
#[test]
fn a_padded_action_is_the_same_for_its_own_rotors() {
    let inputs = Inputs { roll_n: 0.3, pitch_n: -0.2, yaw_n: 0.1, thrust_n: 20.0 };
    let action = listener().0.action(&inputs);
    let padded = action.padded();
    for rotor in 0..ROTORS_MAX {
        let own = |of: &[f32]| of.get(rotor).copied().unwrap_or(0.0);
        assert_eq!(padded.forces.0[rotor], own(action.forces.0.as_slice()), "rotor {rotor}");
        assert_eq!(padded.speeds.0[rotor], own(action.speeds.0.as_slice()), "rotor {rotor}");
    }
    assert_eq!((padded.given, padded.health), (action.given, action.health));
    assert!(action.health.saturated && action.forces.0.min() > 1.0 && PLUS.len() < ROTORS_MAX);
}
