//! Tests of feature `serde`: values survive a round trip, and keep the format that files and other programs rely on.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_control::{Action, Errors, Health, Mixer, Settings, Trace};
use afbc_types::{Axis, Inputs, Parameters, PerAxis, Setpoint, State};
use core::fmt::Debug;
use nalgebra::Vector3;
use proptest::prelude::*;
use serde_json::json;

/// Checks that `value` survives a round trip.
fn round_trip<T: serde::Serialize + serde::de::DeserializeOwned + Debug + PartialEq>(value: &T) {
    let text = serde_json::to_string(value).unwrap();
    assert_eq!(&serde_json::from_str::<T>(&text).unwrap(), value, "{text}");
}

/// Any finite number.
fn number() -> impl Strategy<Value = f32> {
    prop::num::f32::NORMAL | prop::num::f32::SUBNORMAL | prop::num::f32::ZERO
}

fn vector() -> impl Strategy<Value = Vector3<f32>> {
    prop::array::uniform3(number()).prop_map(Vector3::from)
}

proptest! {
    #[test]
    fn values_survive_a_round_trip(
        position_m in vector(),
        velocity_m_s in vector(),
        attitude_rad in vector(),
        rates_rad_s in vector(),
        yaw_rad in number(),
        saturated: bool,
        inputs in prop::array::uniform4(-9.0_f32..9.0),
    ) {
        round_trip(&State { position_m, velocity_m_s, attitude_rad, rates_rad_s });
        let acceleration_m_s2 = rates_rad_s;
        round_trip(&Setpoint { position_m, velocity_m_s, acceleration_m_s2, yaw_rad, ..Setpoint::default() });

        let mixer = Mixer::new(Parameters::PAPER.to_f32(), 3.0).unwrap();
        let [roll_n, pitch_n, yaw_n, thrust_n] = inputs;
        let inputs = Inputs { roll_n, pitch_n, yaw_n, thrust_n };
        round_trip(&mixer.allocate(&inputs));
        let mut action = mixer.action(&inputs);
        action.health.saturated = saturated;
        round_trip::<Action>(&action);

        let errors = PerAxis::from_fn(|axis| Errors { e1: yaw_rad, e2: axis as u8 as f32, ..Errors::default() });
        let mut trace = Trace::default();
        (trace.inputs, trace.errors, trace.virtual_m_s2) = (inputs, errors, [yaw_rad, roll_n]);
        round_trip(&trace);
    }
}

#[test]
fn parameters_are_read_as_written() {
    round_trip(&Parameters::PAPER);
    round_trip(&Parameters::PAPER.to_f32());
    round_trip(&Settings::DEFAULT);
}

/// Missing fields take their defaults.
#[test]
fn a_state_or_setpoint_may_leave_out_what_is_zero() {
    let height = Vector3::new(0.0, 0.0, 2.0);
    let (state, setpoint) = (r#"{"position_m": [0, 0, 2]}"#, r#"{"position_m": [0, 0, 2], "yaw_rad": 0.5}"#);
    assert_eq!(serde_json::from_str::<State>(state).unwrap(), State { position_m: height, ..State::default() });
    let expected = Setpoint { position_m: height, yaw_rad: 0.5, ..Setpoint::default() };
    assert_eq!(serde_json::from_str::<Setpoint>(setpoint).unwrap(), expected);
}

#[test]
fn names_are_those_of_scenario_files() {
    let mut health = Health::default();
    let fallback = "rotors stay saturated";
    health.fallback = Some(fallback);
    let expected =
        json!({ "state_rejected": false, "setpoint_rejected": false, "saturated": false, "fallback": fallback });
    assert_eq!(serde_json::to_value(health).unwrap(), expected);
    health.fallback = None;
    assert_eq!(serde_json::from_value::<Health>(expected).unwrap(), health, "a reason is not read");
    for axis in Axis::ALL {
        assert_eq!(serde_json::to_value(axis).unwrap(), json!(axis.name()));
    }
    let speeds = <Action>::default().speeds;
    assert_eq!(serde_json::to_value(speeds).unwrap(), json!([0.0, 0.0, 0.0, 0.0]));
}
