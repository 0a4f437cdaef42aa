//! Mounts the IMU off the centre of mass, with and without telling the vehicle: every built-in vehicle must take off,
//! fly and land.
#![allow(clippy::unwrap_used, missing_docs)] // a flight that cannot begin must stop the test

use afbc::Profile;
use afbc_plant::RotorStart;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::trajectory::{Trajectory, Waypoint};
use afbc_scenario::{Scenario, built_in};
use afbc_sim::flight::fly;
use afbc_vehicles::{BUILT_IN, Vehicle};
use nalgebra::Vector3;
use std::thread;

const LAWS: [ControllerKind; 4] =
    [ControllerKind::Afbc, ControllerKind::Pid, ControllerKind::Geometric, ControllerKind::Mpc];

/// Returns a scenario in a breeze: take-off, 3 m forth and back with a turn of 1 rad, landing.
fn there_and_back(vehicle: &Vehicle, kind: ControllerKind) -> Scenario {
    let mut scenario = built_in("mocap").unwrap().read().unwrap();
    let ground = vehicle.realism.contact.unwrap();
    let stands_m = ground.foot_depth_m - ground.sink_m;
    let at = |time_s, x, z, yaw_rad| Waypoint { time_s, position_m: Vector3::new(x, 0.0, z), yaw_rad };
    scenario.trajectory = Trajectory::Waypoints(vec![
        at(1.0, 0.0, stands_m, 0.0),
        at(4.0, 0.0, 3.0, 0.0),
        at(7.0, 3.0, 3.0, 1.0),
        at(10.0, 0.0, 3.0, 0.0),
        at(14.0, 0.0, stands_m, 0.0),
    ]);
    (scenario.duration_s, scenario.flight_core) = (15.0, true);
    (scenario.initial.position_m, scenario.initial.attitude_rad) = (Vector3::z() * stands_m, Vector3::zeros());
    scenario.contenders = vec![Contender::of(kind, Profile::Flight).monitored()];
    scenario.realism.wind.steady_m_s = Vector3::new(1.0, 1.0, 0.0);
    let mut scenario = scenario.on(vehicle, Profile::Flight).unwrap();
    scenario.realism.rotors.start = RotorStart::Idle;
    scenario
}

/// Flies the scenario. Returns the final distance from the reference \[m\] and the mean NEES, or an error if the
/// vehicle was lost or the monitor tripped.
fn flown(scenario: &Scenario) -> Result<[f64; 2], String> {
    let [contender] = scenario.contenders.as_slice() else { return Err("one contender flies".into()) };
    let (mut distance_m, mut trip, mut nees) = (f64::NAN, None, Vec::new());
    let lost = fly(scenario, contender, |sample| {
        distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
        trip = trip.or(sample.action.health.fallback);
        nees.extend(sample.estimated.filter(|_| sample.time_s > 5.0).map(|estimated| f64::from(estimated.nees)));
    });
    match (lost.unwrap(), trip) {
        (None, None) => Ok([distance_m, nees.iter().sum::<f64>() / nees.len() as f64]),
        (lost, trip) => Err(format!("lost: {lost:?}, tripped: {trip:?}")),
    }
}

/// Flies every vehicle under every law with each of the levers; `mount` applies a lever. Returns the failed flights and
/// the mean of all NEES.
fn faults(
    levers_m: &[[f64; 3]],
    mount: impl Fn(&mut Vehicle, &mut Vector3<f64>, Vector3<f64>) + Sync,
) -> (Vec<String>, f64) {
    let ends: Vec<_> = thread::scope(|threads| {
        let mount = &mount;
        let fly_all = |known: &'static afbc_files::read::BuiltIn<Vehicle>| {
            threads.spawn(move || {
                let mut ends = Vec::new();
                for kind in LAWS {
                    for &lever_m in levers_m {
                        let (mut vehicle, mut untold_m) = (known.read().unwrap(), Vector3::zeros());
                        mount(&mut vehicle, &mut untold_m, lever_m.into());
                        let mut scenario = there_and_back(&vehicle, kind);
                        scenario.instruments.imu.as_mut().unwrap().lever_m = untold_m;
                        ends.push((format!("{} under {}, {lever_m:?}", vehicle.name, kind.name()), flown(&scenario)));
                    }
                }
                ends
            })
        };
        let flown: Vec<_> = BUILT_IN.iter().map(fly_all).collect();
        flown.into_iter().flat_map(|ends| ends.join().unwrap()).collect()
    });
    let wrong = |(name, end): &(String, Result<[f64; 2], String>)| match end {
        Ok([end_m, nees]) if *end_m < 0.1 && *nees < 60.0 => None,
        _ => Some(format!("{name}: {end:?}")),
    };
    let nees: f64 = ends.iter().filter_map(|(_, end)| end.as_ref().ok()).map(|[_, nees]| nees).sum();
    (ends.iter().filter_map(wrong).collect(), nees / ends.len() as f64)
}

#[test]
fn five_centimetres_untold_make_no_difference() {
    let levers_m =
        [[0.0, 0.0, -0.05], [0.0, 0.0, 0.05], [0.05, 0.0, 0.0], [-0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, -0.05, 0.0]];
    let (faults, nees) = faults(&levers_m, |_, untold_m, lever_m| *untold_m = lever_m);
    assert!(faults.is_empty() && nees < 10.0, "{nees} {faults:#?}");
}

#[test]
fn twenty_centimetres_told_make_no_difference() {
    let levers_m = [[0.0, 0.0, -0.2], [0.0, 0.0, 0.2], [0.2, 0.0, 0.0], [0.0, -0.2, 0.0]];
    let (faults, nees) = faults(&levers_m, |vehicle, _, lever_m| vehicle.imu.position_m = lever_m);
    assert!(faults.is_empty() && nees < 10.0, "{nees} {faults:#?}");
}
