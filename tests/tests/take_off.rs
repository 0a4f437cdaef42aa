//! Every built-in vehicle takes off in wind, on the estimate from an inertial sensor and a tracker. Its feet slide,
//! hold and leave the ground.

use afbc::Profile;
use afbc_plant::RotorStart;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::trajectory::{Trajectory, Waypoint};
use afbc_scenario::{Scenario, built_in};
use afbc_sim::flight::fly;
use afbc_vehicles::{BUILT_IN, Vehicle};
use nalgebra::Vector3;
use proptest::prelude::*;

const DURATION_S: f64 = 9.0;

/// Returns a climb to 3 m from 1 s to 5 s in this wind \[m/s\]. It begins on the ground with idling rotors.
fn take_off(vehicle: &Vehicle, wind_m_s: [f64; 2], yaw_rad: f64, seed: u64) -> Scenario {
    let mut scenario = built_in("mocap").unwrap().read().unwrap();
    let ground = vehicle.realism.contact.unwrap();
    let at = |time_s, z| Waypoint { time_s, position_m: Vector3::new(0.0, 0.0, z), yaw_rad };
    let stands_m = ground.foot_depth_m - ground.sink_m;
    scenario.trajectory = Trajectory::Waypoints(vec![at(1.0, stands_m), at(5.0, 3.0)]);
    scenario.duration_s = DURATION_S;
    scenario.seed = seed;
    scenario.flight_core = true;
    (scenario.initial.position_m, scenario.initial.attitude_rad) = (Vector3::z() * stands_m, Vector3::z() * yaw_rad);
    scenario.contenders = vec![Contender::of(ControllerKind::Afbc, Profile::Flight).monitored()];
    let [x, y] = wind_m_s;
    scenario.realism.wind.steady_m_s = Vector3::new(x, y, 0.0);
    let mut scenario = scenario.on(vehicle, Profile::Flight).unwrap();
    scenario.realism.rotors.start = RotorStart::Idle;
    scenario
}

/// Flies the scenario. Returns the last distance from the reference \[m\], or the reason of a loss or trip.
fn flown(scenario: &Scenario) -> Result<f64, String> {
    let (mut distance_m, mut trip) = (f64::NAN, None);
    let [contender] = scenario.contenders.as_slice() else { return Err("one contender flies".into()) };
    let lost = fly(scenario, contender, |sample| {
        distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
        trip = trip.or(sample.action.health.fallback);
    });
    match (lost.unwrap(), trip) {
        (None, None) => Ok(distance_m),
        (lost, trip) => Err(format!("lost: {lost:?}, tripped: {trip:?}")),
    }
}

fn vehicles() -> impl Strategy<Value = Vehicle> {
    let standing: Vec<Vehicle> = BUILT_IN.iter().map(|vehicle| vehicle.read().unwrap()).collect();
    assert!(standing.iter().all(|vehicle| vehicle.realism.contact.is_some()));
    proptest::sample::select(standing)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_wind_tips_a_vehicle_over_its_feet(
        vehicle in vehicles(),
        wind_m_s in 0.0..5.6_f64,
        from_rad in -3.1..3.1_f64,
        yaw_rad in -1.0..1.0_f64,
        seed in any::<u32>(),
    ) {
        let (sin, cos) = from_rad.sin_cos();
        let scenario = take_off(&vehicle, [wind_m_s * cos, wind_m_s * sin], yaw_rad, seed.into());
        let end_m = flown(&scenario);
        prop_assert!(end_m.as_ref().is_ok_and(|&end_m| end_m < 0.1), "{}: {end_m:?}", vehicle.name);
    }
}
