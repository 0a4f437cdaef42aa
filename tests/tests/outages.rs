//! Scenarios with `flight_core`: inside the flight core, a law coasts through outages that it would not survive alone.

use afbc_scenario::contender::ControllerKind;
use afbc_scenario::{Outage, Scenario, built_in};
use afbc_sim::flight::{Lost, Sample, fly};

/// Returns the paper's flight on realistic hardware with an outage of `length_s` from 7.45 s on, during which a gust
/// begins.
fn scenario(length_s: f64, flight_core: bool) -> Scenario {
    let mut scenario = built_in("hardware").unwrap().read().unwrap();
    scenario.duration_s = 20.0;
    scenario.outages = vec![Outage { start_s: 7.45, end_s: 7.45 + length_s }];
    scenario.flight_core = flight_core;
    scenario
}

/// Returns each contender's name, loss, largest distance from the reference \[m\] and last sample.
fn outcomes(scenario: &Scenario) -> Vec<(String, Option<Lost>, f64, Sample)> {
    let outcome = |contender: &afbc_scenario::contender::Contender| {
        let (mut worst_m, mut last) = (0.0_f64, None);
        let lost = fly(scenario, contender, |sample| {
            if sample.time_s > 5.0 {
                worst_m = worst_m.max((sample.motion.position_m - sample.reference.position_m).norm());
            }
            last = Some(*sample);
        });
        (contender.name.clone(), lost.unwrap(), worst_m, last.unwrap())
    };
    scenario.contenders.iter().map(outcome).collect()
}

#[test]
fn inside_the_flight_core_every_law_survives_an_outage() {
    let outcomes = outcomes(&scenario(0.24, true));
    assert_eq!(outcomes.len(), ControllerKind::ALL.len());
    for (name, lost, worst_m, _) in outcomes {
        assert_eq!(lost, None, "{name}");
        assert!(worst_m < 0.5, "{name}: {worst_m} m");
    }
}

#[test]
fn alone_no_law_survives_an_outage_of_a_second() {
    for (name, lost, ..) in outcomes(&scenario(1.0, false)) {
        assert!(lost.is_some(), "{name}");
    }
}

/// Without an outage, only the arming tick differs from a flight of the law alone.
#[test]
fn without_an_outage_the_flight_core_changes_nothing() {
    let ends = [true, false].map(|flight_core| outcomes(&scenario(0.0, flight_core)));
    for ((name, _, aboard_m, aboard), (.., alone_m, alone)) in ends[0].iter().zip(&ends[1]) {
        assert!((aboard_m - alone_m).abs() < 1e-3, "{name}: {aboard_m} m and {alone_m} m");
        let apart_m = (aboard.motion.position_m - alone.motion.position_m).norm();
        assert!(apart_m < 5e-3, "{name}: {apart_m} m");
    }
}

/// If states never return, the vehicle descends and its motors stop.
#[test]
fn an_outage_to_the_end_ends_with_the_motors_off() {
    for (name, _, _, last) in outcomes(&scenario(f64::INFINITY, true)) {
        assert!(last.time_s > 9.0 && last.action.speeds == afbc_types::RotorSpeeds::default(), "{name}: {last:?}");
    }
}
