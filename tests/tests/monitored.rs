//! The monitor in flight: faults trip it in time and with the right reason, hard flights do not trip it.

use afbc::Profile;
use afbc::Trip;
use afbc_campaign::suite::{SUITES, Suite};
use afbc_files::read::BuiltIn;
use afbc_plant::{Drag, Environment, PlantParameter, PlantParameterChange, Turbulence};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::trajectory::Trajectory;
use afbc_scenario::{Scenario, built_in};
use afbc_sim::flight::fly;
use afbc_types::Axis;
use nalgebra::Vector3;

/// Time of every fault in the suite `faults` \[s\].
const FAULT_S: f64 = 10.0;

/// Flies AFBC as on board. Returns time and reason of the monitor's trip, and the vehicle's distance from the reference
/// at that time, in the largest coordinate \[m\].
fn trip(scenario: &Scenario) -> Option<(f64, &'static str, f64)> {
    let contender = Contender::of(ControllerKind::Afbc, Profile::Flight).monitored().for_vehicle(&scenario.vehicle);
    let mut tripped = None;
    let _ = fly(scenario, &contender, |sample| {
        let off_m = (sample.motion.position_m - sample.reference.position_m).amax();
        let first = sample.action.health.fallback.filter(|_| tripped.is_none());
        tripped = first.map(|trip| (sample.time_s, trip, off_m)).or(tripped);
    })
    .unwrap();
    tripped
}

/// A wrong sign, whose error the law itself amplifies, trips the monitor within 2.5 s and a few metres. A rotor at 40 %
/// trips it within 5 s. (With a wrong sign of roll or pitch, the vehicle tumbles before any monitor could help.)
#[test]
fn faults_trip_for_what_they_are_and_in_time() {
    let suite: Suite = BuiltIn::named(&SUITES, "faults").unwrap().read().unwrap();
    let scenarios = suite.under(&[Contender::of(ControllerKind::Afbc, Profile::Flight)]).unwrap();
    let expected = [
        ("sign-x", Trip::Error(Axis::X), 2.0, 7.0),
        ("sign-y", Trip::Error(Axis::Y), 2.0, 7.0),
        ("sign-z", Trip::Error(Axis::Z), 2.0, 7.0),
        ("sign-yaw", Trip::Error(Axis::Yaw), 2.5, 7.0),
        ("sign-yaw-moment", Trip::Error(Axis::Yaw), 2.5, 7.0),
        ("rotor-1-40", Trip::Saturation, 5.0, 1.0),
    ];
    for (name, reason, within_s, within_m) in expected {
        let scenario = scenarios.iter().find(|scenario| scenario.name == name).unwrap();
        let (time_s, trip, off_m) = trip(scenario).unwrap();
        assert_eq!(trip, reason.reason(), "{name}");
        assert!(time_s - FAULT_S < within_s && off_m < within_m, "{name}: at {time_s} s, {off_m} m off");
    }
}

/// Weak and heavy vehicles make steps in every direction, in wind and moderate turbulence. This is hard, but no fault.
#[test]
fn hard_flights_do_not_trip() {
    let hardware = built_in("hardware").unwrap().read().unwrap();
    let from_m = Vector3::new(0.0, 0.0, 3.0);
    for (mass, thrust) in [(1.0, 1.0), (0.8, 1.1), (1.3, 0.75), (1.0, 0.6)] {
        for step_m in [[0.0, 0.0, 2.0], [0.0, 0.0, -2.0], [4.0, 0.0, 0.0], [-3.0, 3.0, 0.5]] {
            let mut scenario = Scenario { duration_s: 15.0, ..hardware.clone() };
            let change =
                |quantity, factor| PlantParameterChange { quantity, factor, start_s: 1.0, end_s: f64::INFINITY };
            let changes = vec![change(PlantParameter::Mass, mass), change(PlantParameter::ThrustFactor, thrust)];
            scenario.environment = Environment::new(*hardware.environment.nominal(), changes, Vec::new()).unwrap();
            scenario.initial.position_m = from_m;
            let to_m = from_m + Vector3::from(step_m);
            scenario.trajectory = Trajectory::Step { from_m, to_m, at_s: 6.0, yaw_rad: 0.0, turn_rad: 1.5 };
            scenario.realism.drag = Some(Drag::PAPER);
            scenario.realism.wind.steady_m_s = Vector3::new(3.0, -2.0, 0.0);
            scenario.realism.wind.turbulence = Some(Turbulence::MODERATE);
            assert_eq!(trip(&scenario), None, "mass {mass}, thrust {thrust}, step {step_m:?}");
        }
    }
}
