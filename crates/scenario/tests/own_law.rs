//! Tests users' laws, which are not in the list.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use afbc::Profile;
use afbc_control::{FlightController, Validated};
use afbc_scenario::contender::{Contender, ControllerKind, Law};
use afbc_scenario::{OWN_GAINS_MAX, OwnController, OwnGain, OwnLaw, OwnVehicle};
use afbc_types::{Declared, Inputs, PLUS, Parameters, Setpoint, State};
use proptest::prelude::*;

/// A law that returns fixed inputs, with more yaw at each step.
struct Counting {
    inputs: Inputs,
    steps: f32,
}

impl OwnController for Counting {
    fn step(&mut self, _: &State, _: &Setpoint, _fresh: bool) -> Inputs {
        self.steps += 1.0;
        Inputs { yaw_n: self.inputs.yaw_n + 1e-4 * self.steps, ..self.inputs }
    }
}

fn counting(name: &'static str, inputs: Inputs) -> ControllerKind {
    OwnLaw::new(name, move |_| Counting { inputs, steps: 0.0 }).register().unwrap()
}

const HOVER: Inputs = Inputs { roll_n: 0.0, pitch_n: 0.0, yaw_n: 0.0, thrust_n: 0.486 * 9.81 };

/// Every flight begins with a law that has not flown, even if the controller has.
#[test]
fn each_flight_has_a_law_of_its_own() {
    let contender = Contender::of(counting("counts", HOVER), Profile::Flight);
    let rotors = PLUS.map(|rotor| rotor.to_f64());
    let controller = contender.controller::<4>(&Parameters::PAPER, &rotors).unwrap();
    let flight = || {
        let mut memory = Validated::default();
        let mut step = |_| controller.step(&mut memory, Some(&State::default()), &Setpoint::default()).given.yaw_n;
        (0..3).map(&mut step).collect::<Vec<_>>()
    };
    let first = flight();
    assert!(first.is_sorted_by(|a, b| a < b), "{first:?}");
    assert_eq!(first, flight());
}

proptest! {
    /// The rotors turn at finite speeds within their limits, for any input that a law returns.
    #[test]
    fn no_input_reaches_the_rotors_unchecked(inputs in prop::array::uniform4(prop::num::f32::ANY)) {
        let [roll_n, pitch_n, yaw_n, thrust_n] = inputs;
        let kind = counting("anything", Inputs { roll_n, pitch_n, yaw_n, thrust_n });
        let contender = Contender::of(kind, Profile::Flight);
        let controller = contender.controller::<4>(&Parameters::PAPER, &PLUS.map(|rotor| rotor.to_f64())).unwrap();
        let action = controller.step(&mut Validated::default(), Some(&State::default()), &Setpoint::default());
        let most_n = contender.settings.common.rotor_force_max_n;
        prop_assert!(action.speeds.0.iter().all(|speed| speed.is_finite() && *speed >= 0.0));
        prop_assert!(action.forces.0.iter().all(|force| (0.0..=most_n).contains(force)));
    }
}

/// Invalid names and gains are refused in one line that gives the reason.
#[test]
fn what_cannot_be_registered_is_refused() {
    let law = |name| OwnLaw::new(name, |_: &OwnVehicle| Counting { inputs: HOVER, steps: 0.0 });
    let gain = |name, value| OwnGain::new(name, "1", value, [0.1, 10.0]);
    for (law, problem) in [
        (law(""), "the name must have 1 to 32 characters"),
        (law("Mine"), "a to z"),
        (law("afbc"), "a built-in law has this name"),
        (law("afbc-as-printed"), "a built-in law has this name"),
        (law("mine").gains([gain("kp", 11.0)]), "kp"),
        (law("mine").gains([gain("kp", f32::NAN)]), "kp"),
        (law("mine").gains([gain("kp", 1.0), gain("kp", 2.0)]), "two gains are called kp"),
        (law("mine").gains(vec![gain("kp", 1.0); OWN_GAINS_MAX + 1]), "at most 32"),
    ] {
        let refused = law.register().unwrap_err();
        assert!(refused.contains(problem) && !refused.contains('\n'), "{refused}");
    }
    assert_eq!(ControllerKind::named("mine"), None);
}

/// A law may be registered again while it is being made for a flight, as by another thread.
#[test]
fn making_a_law_holds_up_no_one() {
    let again = || OwnLaw::new("anew", |_| Counting { inputs: HOVER, steps: 0.0 }).register();
    let kind = OwnLaw::new("anew", move |_| {
        again().unwrap();
        Counting { inputs: HOVER, steps: 0.0 }
    });
    let contender = Contender::of(kind.register().unwrap(), Profile::Flight);
    let controller = contender.controller::<4>(&Parameters::PAPER, &PLUS.map(|rotor| rotor.to_f64())).unwrap();
    let action = controller.step(&mut Validated::default(), Some(&State::default()), &Setpoint::default());
    assert!(action.given.thrust_n > 0.0);
}

/// A scenario file flies a registered law, under its own name or another, and sets its gains; so does a vehicle's file.
#[test]
fn files_know_it() {
    let gains = [OwnGain::new("kp_1_s2", "1/s2", 2.0, [0.1, 50.0]), OwnGain::new("ki", "1", 1.0, [0.1, 50.0])];
    let kind = OwnLaw::new("filed", |_| Counting { inputs: HOVER, steps: 0.0 }).gains(gains).register().unwrap();
    let text = "controllers = [\"afbc\", \"filed\"]\n[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n\
                [[contender]]\nname = \"stiff\"\ncontroller = \"filed\"\n[contender.gains]\nkp_1_s2 = 8.0\n";
    let scenario = afbc_scenario::parse("test.toml", text, "test").unwrap();
    let values = |law: &Law| {
        let mut values = Vec::new();
        let Ok(()) = law.visit(&mut |_: &_, value: afbc_types::DeclaredValue<'_>| {
            values.extend(value.numbers());
            Ok::<(), core::convert::Infallible>(())
        });
        values
    };
    let [_, filed, stiff] = scenario.contenders.as_slice() else { panic!("{:?}", scenario.contenders) };
    assert_eq!((filed.kind(), values(&filed.law)), (kind, vec![2.0, 1.0]));
    assert_eq!((stiff.kind(), values(&stiff.law)), (kind, vec![8.0, 1.0]));
    let wrong = text.replace("kp_1_s2 = 8.0", "kp_1_s2 = 80.0");
    let refused = afbc_scenario::parse("test.toml", &wrong, "test").unwrap_err().to_string();
    assert!(refused.contains("test.toml:9:") && refused.contains("kp_1_s2"), "{refused}");

    // On a slower vehicle, the gain decreases by the power of time in its unit, unless the vehicle's file has its own
    // value.
    let vehicle = afbc_vehicles::built_in("crazyflie").unwrap();
    let scaled = Contender::of(kind, Profile::Flight).on(&vehicle.read().unwrap(), Profile::Flight).unwrap();
    let [kp, ki] = values(&scaled.law)[..] else { panic!("two gains") };
    assert!(kp < 1.0 && ki == 1.0, "{kp}");
    let own = format!("{}\n[gains.flight.filed]\nkp_1_s2 = 3.0\n", vehicle.text);
    let own = afbc_vehicles::parse("own.toml", &own, "own").unwrap();
    let own = Contender::of(kind, Profile::Flight).on(&own, Profile::Flight).unwrap();
    assert_eq!(values(&own.law)[0], 3.0);
}
