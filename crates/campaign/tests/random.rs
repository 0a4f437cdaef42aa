//! Tests of the suite `random`: flights are the same everywhere, fit every vehicle and stay within its capability.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs)]

use afbc_campaign::compare::standard_and_monitored;
use afbc_campaign::random::{self, DrawnFlight, FeedbackSource, ModelMismatch, RandomFlights};
use afbc_files::read::BuiltIn;
use afbc_scenario::trajectory::{Reference, Trajectory};
use afbc_vehicles::{BUILT_IN, Vehicle, built_in, parse};
use std::collections::BTreeSet;

fn fleet() -> Vec<Vehicle> {
    BUILT_IN.iter().map(|vehicle| BuiltIn::read(vehicle).unwrap()).collect()
}

fn paper(name: &str, change: impl Fn(String) -> String) -> Vehicle {
    parse("mine.toml", &change(built_in("paper").unwrap().text.into()), name).unwrap()
}

/// Returns variants of the paper's vehicle: bare with little lag, weak, with much drag, three times as large.
fn own() -> Vec<Vehicle> {
    let bare = |text: String| {
        let (before, after) = text.split_once("[battery]").unwrap();
        let imu = after.split_once("[imu]").unwrap().1;
        format!("{before}[imu]{imu}").replace("time_constant_s = 0.02 ", "time_constant_s = 0.01 ")
    };
    let weak = |text: String| text.replace("force_max_n = 3.0 ", "force_max_n = 1.85 ");
    let dragged = |text: String| text.replace("area_m2 = [0.01, 0.01, 0.02]", "area_m2 = [0.9, 0.9, 1.9]");
    let large = |text: String| {
        ["mass_kg = 0.486 ", "arm_m = 0.25 ", "-0.25,", " 0.25,", "[0.25,", "[-0.25,"]
            .into_iter()
            .zip(["mass_kg = 3.0 ", "arm_m = 0.75 ", "-0.75,", " 0.75,", "[0.75,", "[-0.75,"])
            .fold(text, |text, (from, to)| text.replace(from, to))
            .replace("inertia_kg_m2 = [0.0038, 0.0038, 0.0076]", "inertia_kg_m2 = [0.06, 0.06, 0.12]")
            .replace("force_max_n = 3.0 ", "force_max_n = 15.0 ")
            .replace("[ground]", "[ground]\ndamping_ratio = 0.3")
    };
    vec![paper("bare", bare), paper("weak", weak), paper("dragged", dragged), paper("large", large)]
}

fn random(seen: FeedbackSource, vehicles: Vec<Vehicle>) -> RandomFlights {
    RandomFlights { seeds: 1..4, flights: 12, seen, vehicles }
}

fn everywhere(seen: FeedbackSource) -> Vec<(Vehicle, Vec<DrawnFlight>)> {
    let vehicles = fleet().into_iter().chain(own());
    vehicles.map(|vehicle| (vehicle.clone(), random(seen, vec![vehicle]).draw().unwrap())).collect()
}

/// A flight depends only on seed, vehicle and number, not on the other flights.
#[test]
fn a_flight_is_the_same_beside_any_others() {
    let all = random(FeedbackSource::Truth, fleet()).draw().unwrap();
    assert_eq!(all.len(), 3 * 6 * 12);
    assert_eq!(all, random(FeedbackSource::Truth, fleet()).draw().unwrap());
    let one = RandomFlights { seeds: 2..4, flights: 5, ..random(FeedbackSource::Truth, vec![fleet().remove(3)]) }
        .draw()
        .unwrap();
    assert_eq!(one.len(), 2 * 5);
    assert!(one.iter().all(|flight| all.contains(flight)));
    let names: BTreeSet<_> = all.iter().map(|flight| &flight.scenario.name).collect();
    let seeds: BTreeSet<_> = all.iter().map(|flight| flight.scenario.seed).collect();
    let texts: BTreeSet<_> = all.iter().map(|flight| &flight.scenario.description).collect();
    assert_eq!((names.len(), seeds.len()), (all.len(), all.len()));
    // Some descriptions are equal: hovers without a change, or in turbulence, differ only in their noise.
    assert!(texts.len() > all.len() * 3 / 4, "{}", texts.len());
}

/// Flights are valid on every vehicle and for every law, with the true state and with both estimates.
#[test]
fn every_flight_is_valid_on_every_vehicle() {
    let contenders = standard_and_monitored();
    for seen in [FeedbackSource::Truth, FeedbackSource::Mocap, FeedbackSource::Outdoor] {
        for vehicle in fleet().into_iter().chain(own()) {
            let name = vehicle.name.clone();
            for flight in random(seen, vec![vehicle]).under(&contenders, &[]).unwrap_or_else(|error| panic!("{error}"))
            {
                let DrawnFlight { scenario, speed_m_s, .. } = &flight;
                assert_eq!(scenario.check(), Ok(()), "{}: {}", scenario.name, scenario.description);
                assert_eq!(scenario.contenders.len(), contenders.len());
                assert!(speed_m_s.is_finite() && scenario.name.starts_with(&name));
                assert_eq!(scenario.instruments.imu.is_some(), seen != FeedbackSource::Truth);
                let tilts = scenario.contenders.iter().map(|contender| contender.settings.limits.tilt_max_rad);
                assert!(tilts.zip(&contenders).all(|(tilt, own)| tilt >= 1.2 || own.kind().in_cascade()));
            }
        }
    }
}

/// Every kind of path and change is drawn within its interval, and the flight has the drawn change.
#[test]
fn what_is_drawn_is_what_flies() {
    let (mut paths, mut changes) = (BTreeSet::new(), BTreeSet::new());
    for (vehicle, flights) in everywhere(FeedbackSource::Truth) {
        for DrawnFlight { path, change, scenario, .. } in flights {
            paths.insert(path);
            changes.insert(change.kind());
            let calm = scenario.realism.wind == Default::default();
            let intact = scenario.environment.payloads().is_empty() && scenario.environment.changes().is_empty();
            let whole = scenario.realism.rotors.faults.is_empty();
            let stated = scenario.vehicle_file.as_ref().unwrap();
            assert_eq!(stated, &vehicle);
            assert_eq!(scenario.sensing.noise.position_m, 0.001);
            match change {
                ModelMismatch::Nothing => assert!(calm && intact && whole),
                ModelMismatch::Wind(wind_m_s) => {
                    assert!(wind_m_s.amax() <= 4.0 && wind_m_s.z == 0.0);
                    assert_eq!((scenario.realism.wind.steady_m_s, intact, whole), (wind_m_s, true, true));
                }
                ModelMismatch::Turbulence(turbulence) => {
                    assert_eq!((scenario.realism.wind.turbulence, intact, whole), (Some(turbulence), true, true));
                }
                ModelMismatch::Payload { share, ahead_m, left_m, .. } => {
                    let [payload] = scenario.environment.payloads() else { panic!("one payload") };
                    assert!((payload.mass_kg / vehicle.parameters.mass_kg - share).abs() < 1e-12 && share <= 0.25);
                    assert!(ahead_m.abs().max(left_m.abs()) <= 0.3 * vehicle.parameters.arm_m);
                    assert!(calm && whole);
                }
                ModelMismatch::Mass(factor) => {
                    assert!((0.85..=1.2).contains(&factor));
                    assert_eq!((scenario.environment.changes()[0].factor, calm, whole), (factor, true, true));
                }
                ModelMismatch::Rotor { rotor, efficiency } => {
                    let fault = scenario.realism.rotors.faults[0];
                    assert_eq!((fault.rotor, fault.efficiency, calm, intact), (rotor, efficiency, true, true));
                    assert!((1..=vehicle.rotors.len()).contains(&usize::from(rotor)));
                    assert!((0.65..=1.0).contains(&efficiency));
                }
                ModelMismatch::Drag(factor) => {
                    let area = |drag: Option<afbc_plant::Drag>| drag.map_or(0.0, |drag| drag.area_m2.z);
                    let ratio = area(scenario.realism.drag) - factor * area(stated.realism.drag);
                    assert!(ratio.abs() < 1e-12 && (0.5..=2.0).contains(&factor) && calm && intact && whole);
                }
                ModelMismatch::Older(age_s) => {
                    assert!((0.0..=0.012).contains(&age_s));
                    assert_eq!(scenario.sensing.delay_s, age_s);
                }
            }
        }
    }
    assert_eq!((paths.len(), changes.len()), (4, ModelMismatch::KINDS.len()));
}

/// At every millisecond, the thrust for acceleration leaves two fifths of the thrust beyond the weight, the thrust
/// against drag is available, and the tilt is at most 1 rad. The path's frequency fits the rotors' lag. A change leaves
/// 15 % of thrust beyond the weight on every vehicle that has it.
#[test]
fn no_flight_asks_for_more_than_the_vehicle_can_do() {
    for (vehicle, flights) in everywhere(FeedbackSource::Truth) {
        let count = vehicle.rotors.len() as f64;
        let g = vehicle.parameters.gravity_m_s2;
        let intact_m_s2 = count * vehicle.force_max_n / vehicle.parameters.mass_kg;
        let mut boldest = 0.0_f64;
        for DrawnFlight { change, scenario, acceleration_m_s2, .. } in &flights {
            let thrust_m_s2 = intact_m_s2
                * match change {
                    ModelMismatch::Payload { share, .. } => 1.0 / (1.0 + share),
                    ModelMismatch::Mass(factor) => 1.0 / factor,
                    ModelMismatch::Rotor { efficiency, .. } => *efficiency,
                    _ => 1.0,
                };
            let what = format!("{}: {}", scenario.name, scenario.description);
            assert!(thrust_m_s2 > 1.15 * g || thrust_m_s2 == intact_m_s2, "{what}");
            let drag = scenario.realism.drag;
            for ms in 0..20_000 {
                let reference = scenario.trajectory.at(1e-3 * f64::from(ms));
                let wind_m_s = scenario.realism.wind.steady_m_s;
                let air = drag.map_or(0.0, |drag| {
                    let airspeed_m_s = (reference.velocity_m_s - wind_m_s).norm();
                    0.5 * drag.air_density_kg_m3 * drag.area_m2.x * airspeed_m_s * airspeed_m_s
                }) / vehicle.parameters.mass_kg;
                let force = reference.acceleration_m_s2 + nalgebra::Vector3::z() * g;
                let asked_m_s2 = force.norm();
                assert!(asked_m_s2 <= g + 0.6 * (thrust_m_s2 - g) + 1e-9, "{what}: {asked_m_s2} of {thrust_m_s2} m/s2");
                assert!(libm::hypot(force.xy().norm(), air) < thrust_m_s2, "{what}: {air} m/s2");
                assert!((force.xy().norm() / force.z).atan() <= 1.0 + 1e-9, "{what}");
            }
            assert!(
                fastest_rad_s(&scenario.trajectory) * (vehicle.realism.rotors.time_constant_s + 0.01) < 0.34,
                "{what}"
            );
            boldest = boldest.max(*acceleration_m_s2);
        }
        // The demanded acceleration is at least 0.4 times the largest one, though batteries sag and the rotors' lag
        // limits small paths.
        let most_m_s2 = ((g + 0.6 * (intact_m_s2 - g)).powi(2) - g * g).sqrt().min(1.56 * g);
        let known = built_in(&vehicle.name).is_some();
        assert!(!known || boldest > 0.4 * most_m_s2, "{}: {boldest} of {most_m_s2} m/s2", vehicle.name);
    }
}

/// Returns the highest frequency of a path's acceleration, from its rate of change. Exact for sines.
fn fastest_rad_s(trajectory: &Trajectory) -> f64 {
    let at = |ms: u32| -> Reference { trajectory.at(1e-3 * f64::from(ms)) };
    match trajectory {
        Trajectory::Waypoints(waypoints) => {
            let legs = waypoints.windows(2).map(|legs| std::f64::consts::TAU / (legs[1].time_s - legs[0].time_s));
            legs.fold(0.0, f64::max)
        }
        _ => {
            let peak = |of: fn(&Reference) -> f64| (0..20_000).map(|ms| of(&at(ms))).fold(0.0, f64::max);
            let acceleration = peak(|reference| reference.acceleration_m_s2.norm());
            if acceleration == 0.0 { 0.0 } else { peak(|reference| reference.jerk_m_s3.norm()) / acceleration }
        }
    }
}

/// With the estimate indoors, waypoints and hovers begin on the ground with idle rotors, in the flight core. Other
/// flights begin in the air.
#[test]
fn flights_on_the_estimate_begin_on_the_ground_where_they_can() {
    for (vehicle, flights) in everywhere(FeedbackSource::Mocap) {
        for DrawnFlight { path, stands, scenario, .. } in flights {
            assert_eq!(stands, vehicle.realism.contact.is_some() && ["waypoints", "hover"].contains(&path));
            assert_eq!(scenario.flight_core, stands);
            let height_m = scenario.initial.position_m.z;
            let foot_m = vehicle.realism.contact.map_or(0.0, |ground| ground.foot_depth_m - ground.sink_m);
            assert_eq!(height_m, if stands { foot_m } else { 3.0 });
            let tilt = |rad: f64| assert!(rad.abs() < 0.61, "{rad} rad");
            tilt(scenario.initial.attitude_rad.x);
            tilt(scenario.initial.attitude_rad.y);
            assert_eq!(scenario.trajectory.at(0.0).position_m, scenario.initial.position_m);
        }
    }
    let outdoors = random(FeedbackSource::Outdoor, fleet()).draw().unwrap();
    assert!(outdoors.iter().all(|flight| !flight.stands && flight.scenario.initial.position_m.z == 10.0));
}

/// AFBC flies random flights of the paper's vehicle without a loss and within 0.1 m of the reference.
#[test]
fn flights_are_flown_and_judged() {
    let afbc = standard_and_monitored().remove(0);
    let random = RandomFlights { flights: 6, seeds: 1..2, ..random(FeedbackSource::Truth, vec![fleet().remove(0)]) };
    let flown = random::fly(random.under(&[afbc], &[]).unwrap(), &|| ()).unwrap();
    assert_eq!(flown.len(), 6);
    for flown in &flown {
        let [outcome] = flown.outcomes.as_slice() else { panic!("one contender") };
        let score = flown.score();
        assert_eq!((outcome.seed, score.seed), (flown.flight.scenario.seed, 1));
        assert_eq!(score.rms_m[0], outcome.lost.is_none().then(|| outcome.metrics.rmse.xyz().norm()));
        assert!(score.rms_m[0].is_some_and(|rms_m| rms_m < 0.1), "{}: {score:?}", flown.flight.scenario.description);
    }
}
