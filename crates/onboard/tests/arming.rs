//! Arming: what the guidance has against it, and what stations are told before.
#![allow(clippy::expect_used, missing_docs, reason = "tests")]

mod common;

use afbc_estimator::Measurement;
use afbc_flight_core::Refusal;
use afbc_guidance::{FlightMode, Net, Settings};
use afbc_link::telemetry::Battery;
use afbc_link::{Answer, Command, Downlink, Telemetry, Uplink};
use afbc_onboard::services::{health::sensor, modes};
use afbc_onboard::{Aged, Configuration, Flight, Readings, Surroundings};
use afbc_types::State;
use common::Bench;
use nalgebra::Vector3;

const ARM_DISARM: u16 = 400;

/// One that watches its battery of three cells, and lies within its fence of 10 m.
fn bench() -> Bench {
    let net = Net { cells: 3.0, fence_radius_m: 10.0, ..Net::DEFAULT };
    let guidance = Settings { net, ..Settings::DEFAULT };
    let mut bench = Bench::new();
    bench.flight = Flight::new(&Configuration { guidance, ..Configuration::default() }).expect("valid");
    charge(&mut bench, 12_000);
    bench
}

fn charge(bench: &mut Bench, voltage_mv: u16) {
    let battery = Battery { voltage_mv, current_ca: -1, remaining_percent: -1, consumed_mah: -1, charge: 0 };
    bench.comms.surround(Surroundings { battery: Some(battery), ..Surroundings::default() });
}

fn stand(bench: &mut Bench, ticks: u32, state: &State, readings: &Readings) -> Vec<Downlink> {
    (0..ticks)
        .flat_map(|_| {
            bench.measure(state);
            bench.sense(readings).1
        })
        .collect()
}

/// Returns the answer to the wish to arm, and what SYS_STATUS said of it just before.
fn arm(bench: &mut Bench, state: &State) -> (Answer, bool) {
    bench.hear(Uplink::Command(Command::RequestMessage { message: 1, index: 0 }));
    let said = stand(bench, 3, state, &Readings::NONE);
    let system = said.iter().rev().find_map(|message| match message {
        Downlink::Telemetry(Telemetry::System(system)) => Some(*system),
        _ => None,
    });
    let armable = system.expect("sent").healthy & sensor::ARMING != 0;
    bench.hear(Uplink::Command(Command::Arm));
    let said = stand(bench, 3, state, &Readings::NONE);
    let answer = said.iter().find_map(|message| match message {
        Downlink::Answer { command: ARM_DISARM, answer, .. } => Some(*answer),
        _ => None,
    });
    (answer.expect("answered"), armable)
}

fn refused(refusal: Refusal) -> (Answer, bool) {
    (Answer::Refused(refusal as i32), false)
}

#[test]
fn the_guidance_refuses_with_its_reason_and_stations_are_told_before() {
    let here = State::default();
    let mut well = bench();
    stand(&mut well, 1500, &here, &Readings::NONE);
    assert_eq!(arm(&mut well, &here), (Answer::Accepted, true));

    let mut empty = bench();
    charge(&mut empty, 10_900);
    stand(&mut empty, 1500, &here, &Readings::NONE);
    assert_eq!(arm(&mut empty, &here), refused(Refusal::BatteryLow));

    let mut lands = bench();
    lands.hear(Uplink::Command(Command::SelectMode(modes::custom(FlightMode::Land))));
    stand(&mut lands, 1500, &here, &Readings::NONE);
    assert_eq!(arm(&mut lands, &here), refused(Refusal::WrongMode));

    let mut carried = bench();
    stand(&mut carried, 1100, &here, &Readings::NONE);
    let there = State { position_m: Vector3::new(8.0, 8.0, 0.0), ..here };
    stand(&mut carried, 1500, &there, &Readings::NONE);
    assert_eq!(arm(&mut carried, &there), refused(Refusal::OutsideFence));

    // A magnetometer that was heard once, and never again.
    let mut silent = bench();
    let field = Measurement::MagneticField { field: Vector3::new(0.2, 0.0, -0.4), sigma: 0.01 };
    let readings = Readings { aids: [Some(Aged { value: field, age_us: 0 }), None], ..Readings::NONE };
    stand(&mut silent, 1, &here, &readings);
    stand(&mut silent, 1500, &here, &Readings::NONE);
    assert_eq!(arm(&mut silent, &here), refused(Refusal::SensorFailed));
    stand(&mut silent, 1, &here, &readings);
    assert_eq!(arm(&mut silent, &here), (Answer::Accepted, true));
}

/// Whoever arms as soon as the vehicle says that it may be armed, is not refused; it is so within 1.1 s at rest.
#[test]
fn what_is_told_agrees_with_the_answer() {
    let (here, moves) = (State::default(), State { velocity_m_s: Vector3::new(0.6, 0.0, 0.0), ..State::default() });
    let mut armable = Vec::new();
    for rest_ms in (800..1300).step_by(20) {
        let mut bench = Bench::new();
        stand(&mut bench, 2000, &moves, &Readings::NONE);
        stand(&mut bench, rest_ms, &here, &Readings::NONE);
        let (answer, told) = arm(&mut bench, &here);
        assert!(!told || answer == Answer::Accepted, "{rest_ms} ms: {answer:?}");
        armable.push(told);
    }
    assert_eq!((armable.first(), armable.last()), (Some(&false), Some(&true)));
    assert!(armable.iter().skip_while(|told| !**told).all(|told| *told));
}
