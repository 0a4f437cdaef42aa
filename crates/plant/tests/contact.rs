//! Ground contact: standing, landing, sliding; and ground effect.

use afbc_plant::{
    Contact, Environment, GroundEffect, Motion, Payload, Plant, PlantModel, PlantParameter, PlantParameterChange,
    Realism,
};
use afbc_types::{Parameters, RotorSpeeds};
use nalgebra::{Rotation3, Vector3, Vector4};
use proptest::prelude::*;

const STEP_S: f64 = 0.001;
const P: Parameters<f64> = Parameters::PAPER;
const C: Contact = Contact::PAPER;
const MODELS: [PlantModel; 2] = [PlantModel::Simplified, PlantModel::RigidBody];

fn plant(model: PlantModel, initial: Motion) -> Plant {
    let realism = Realism { contact: Some(C), ..Realism::default() };
    Plant::with_realism(model, initial, Environment::calm(P).unwrap(), &realism, STEP_S).unwrap()
}

fn at(height_m: f64) -> Motion {
    Motion { position_m: Vector3::new(0.0, 0.0, height_m), ..Motion::default() }
}

fn run(plant: &mut Plant, seconds: f64) {
    (0..(seconds / STEP_S) as u32).for_each(|_| plant.step(&RotorSpeeds::<4>::default(), STEP_S));
}

/// Returns kinetic and potential energy, including the springs: 1/2 k d^2 of each point below the ground.
fn energy_j(motion: &Motion) -> f64 {
    let eta = &motion.attitude_rad;
    let r = Rotation3::from_euler_angles(eta.x, eta.y, eta.z);
    let k = P.mass_kg * P.gravity_m_s2 / (4.0 * C.sink_m);
    let around = |radius: f64, z: f64| {
        [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)].map(|(x, y)| Vector3::new(radius * x, radius * y, z))
    };
    let points = [around(C.foot_radius_m, -C.foot_depth_m), around(P.arm_m, C.rotor_height_m)];
    let springs: f64 = points.iter().flatten().map(|p| 0.5 * k * (motion.position_m + r * p).z.min(0.0).powi(2)).sum();
    let rates = &motion.rates_rad_s;
    springs
        + P.mass_kg * (0.5 * motion.velocity_m_s.norm_squared() + P.gravity_m_s2 * motion.position_m.z)
        + 0.5 * rates.dot(&P.inertia_kg_m2.component_mul(rates))
}

#[test]
fn a_vehicle_at_rest_stays_at_rest() {
    for model in MODELS {
        let mut plant = plant(model, at(C.foot_depth_m - C.sink_m));
        run(&mut plant, 10.0);
        let motion = plant.motion();
        assert!((motion.position_m - Vector3::new(0.0, 0.0, C.foot_depth_m - C.sink_m)).amax() < 1e-12);
        assert!(motion.attitude_rad.amax() < 1e-12 && plant.telemetry().unwrap().on_ground);
    }
}

#[test]
fn a_vehicle_that_lands_comes_to_rest_on_its_feet() {
    for model in MODELS {
        let mut plant = plant(model, at(0.5));
        plant.step(&RotorSpeeds::<4>::default(), STEP_S);
        assert!(!plant.telemetry().unwrap().on_ground);
        run(&mut plant, 5.0);
        let motion = plant.motion();
        assert!((motion.position_m.z - (C.foot_depth_m - C.sink_m)).abs() < 1e-6, "{}", motion.position_m.z);
        assert!(motion.velocity_m_s.norm() < 1e-6 && motion.rates_rad_s.norm() < 1e-6);
    }
}

#[test]
fn a_vehicle_that_lands_upside_down_rests_on_its_rotors() {
    let initial = Motion { attitude_rad: Vector3::new(core::f64::consts::PI, 0.0, 0.0), ..at(0.5) };
    let mut plant = plant(PlantModel::RigidBody, initial);
    run(&mut plant, 5.0);
    assert!((plant.motion().position_m.z - (C.rotor_height_m - C.sink_m)).abs() < 1e-6);
}

/// Coulomb friction: v^2 = 2 mu g s.
#[test]
fn a_vehicle_that_slides_stops_after_the_distance_that_friction_gives() {
    let initial = Motion { velocity_m_s: Vector3::new(1.0, 0.0, 0.0), ..at(C.foot_depth_m - C.sink_m) };
    let mut plant = plant(PlantModel::RigidBody, initial);
    run(&mut plant, 3.0);
    let expected = 1.0 / (2.0 * C.friction * P.gravity_m_s2);
    let motion = plant.motion();
    assert!((motion.position_m.x - expected).abs() < 0.1 * expected, "{} of {expected}", motion.position_m.x);
    assert!(motion.velocity_m_s.norm() < 1e-6 && motion.attitude_rad.amax() < 1e-6);
}

#[test]
fn a_vehicle_lifts_off_the_ground() {
    let mut plant = plant(PlantModel::RigidBody, at(C.foot_depth_m - C.sink_m));
    (0..1000).for_each(|_| plant.step(&RotorSpeeds(Vector4::repeat(230.0)), STEP_S));
    let lift = 4.0 * P.thrust_factor_n_s2 * 230.0_f64.powi(2) / P.mass_kg - P.gravity_m_s2;
    let telemetry = plant.telemetry().unwrap();
    assert!(!telemetry.on_ground && plant.motion().attitude_rad.amax() < 1e-12);
    // The springs contribute less than their sink in height.
    let gained = plant.motion().position_m.z - C.foot_depth_m;
    assert!((gained - 0.5 * lift).abs() < 0.1, "{gained}");
}

#[test]
fn contact_that_the_step_cannot_follow_is_refused() {
    let refused = |contact: Contact, step_s| {
        let realism = Realism { contact: Some(contact), ..Realism::default() };
        let environment = Environment::calm(P).unwrap();
        Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, step_s)
            .unwrap_err()
            .range
            .name
    };
    assert_eq!(refused(C, 0.01), "sink_m");
    assert_eq!(refused(Contact { sink_m: 1e-4, ..C }, STEP_S), "sink_m");
    assert_eq!(refused(Contact { damping_ratio: 4.0, ..C }, STEP_S), "damping_ratio");
    assert_eq!(refused(Contact { friction: f64::NAN, ..C }, STEP_S), "friction");
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// For any fall, energy never increases, the vehicle does not tunnel, and it comes to rest.
    #[test]
    fn a_vehicle_that_falls_loses_its_energy(
        height in 0.3_f64..3.0,
        velocity in vector(3.0),
        attitude in (-3.1_f64..3.1, -1.5_f64..1.5, -3.1_f64..3.1).prop_map(|(x, y, z)| Vector3::new(x, y, z)),
        rates in vector(8.0),
    ) {
        let mut plant = plant(
            PlantModel::RigidBody,
            Motion { velocity_m_s: velocity, attitude_rad: attitude, rates_rad_s: rates, ..at(height) },
        );
        let start_j = energy_j(&plant.motion());
        let mut lowest_j = start_j;
        for _ in 0..20_000 {
            plant.step(&RotorSpeeds::<4>::default(), STEP_S);
            let motion = plant.motion();
            let now_j = energy_j(&motion);
            prop_assert!(now_j < lowest_j + 2e-3 * start_j, "{now_j} J after {lowest_j} J of {start_j} J");
            lowest_j = lowest_j.min(now_j);
            prop_assert!(motion.position_m.z > -0.2, "{}", motion.position_m.z);
        }
        prop_assert!(plant.motion().velocity_m_s.norm() < 0.02, "{:?}", plant.motion());
        prop_assert!(plant.motion().rates_rad_s.norm() < 0.1, "{:?}", plant.motion());
    }
}

#[test]
fn thrust_near_the_ground_follows_cheeseman_and_bennett() {
    let effect = GroundEffect { rotor_radius_m: 0.2, rotor_height_m: 0.0 };
    // z/R = 1/2, 1, 2: 1/(1 - 1/4), 1/(1 - 1/16), 1/(1 - 1/64).
    for (z, ratio) in [(0.1, 4.0 / 3.0), (0.2, 16.0 / 15.0), (0.4, 64.0 / 63.0), (0.0, 4.0 / 3.0), (-1.0, 4.0 / 3.0)] {
        assert!((effect.thrust_ratio(z) - ratio).abs() < 1e-12);
    }
    assert!((effect.thrust_ratio(100.0) - 1.0).abs() < 1e-6);

    let realism = Realism { ground_effect: Some(effect), ..Realism::default() };
    let environment = Environment::calm(P).unwrap();
    let mut plant = Plant::with_realism(PlantModel::RigidBody, at(0.2), environment, &realism, 1e-4).unwrap();
    plant.step(&RotorSpeeds(Vector4::repeat(200.0)), 1e-4);
    let lift = 16.0 / 15.0 * 4.0 * P.thrust_factor_n_s2 * 4e4 / P.mass_kg - P.gravity_m_s2;
    assert!((plant.motion().velocity_m_s.z - lift * 1e-4).abs() < 1e-12);
}

#[test]
fn a_payload_brings_its_mass_and_its_inertia() {
    let payload = Payload { mass_kg: 0.2, below_m: 0.1, ahead_m: 0.0, left_m: 0.0, start_s: 0.5, end_s: 1.0 };
    let environment = Environment::calm(P).unwrap().with_payloads(vec![payload]).unwrap();
    let mut plant = Plant::new(PlantModel::RigidBody, Motion::default(), environment);
    let command = RotorSpeeds(Vector4::new(200.0, 200.0, 210.0, 200.0));
    let acceleration = |plant: &mut Plant| {
        let before = plant.motion();
        plant.step(&command, STEP_S);
        let after = plant.motion();
        (
            (after.velocity_m_s - before.velocity_m_s).norm() / STEP_S,
            (after.rates_rad_s - before.rates_rad_s).x / STEP_S,
        )
    };
    let thrust = P.thrust_factor_n_s2 * (3.0 * 4e4 + 210.0 * 210.0);
    let moment = P.arm_m * P.thrust_factor_n_s2 * (210.0 * 210.0 - 4e4);
    // Two point masses are 0.1 m apart. About their common centre they have the inertia m1 (h m2/M)^2 + m2 (h m1/M)^2.
    let total = P.mass_kg + 0.2;
    let ix = P.inertia_kg_m2.x + P.mass_kg * (0.1 * 0.2 / total).powi(2) + 0.2 * (0.1 * P.mass_kg / total).powi(2);
    for k in 0..1500 {
        let level = plant.motion().attitude_rad;
        let (linear, roll) = acceleration(&mut plant);
        let (m, i) = if (500..1000).contains(&k) { (total, ix) } else { (P.mass_kg, P.inertia_kg_m2.x) };
        if level.y.abs() < 1e-3 && k < 3 || k == 500 {
            let weight = Rotation3::from_euler_angles(level.x, level.y, level.z) * Vector3::z() * (thrust / m)
                - Vector3::new(0.0, 0.0, P.gravity_m_s2);
            assert!((linear - weight.norm()).abs() < 0.1, "step {k}: {linear} is not {}", weight.norm());
        }
        let rates = plant.motion().rates_rad_s;
        if rates.y.abs() < 0.5 && rates.z.abs() < 0.5 {
            assert!((roll - moment / i).abs() < 0.05 * moment / i, "step {k}: {roll} is not {}", moment / i);
        }
    }
    let too_heavy = Payload { mass_kg: 499.9, ..payload };
    assert_eq!(Environment::calm(P).unwrap().with_payloads(vec![too_heavy]).unwrap_err().range.name, "mass_kg");
    let negative = Payload { mass_kg: -0.1, ..payload };
    assert_eq!(Environment::calm(P).unwrap().with_payloads(vec![negative]).unwrap_err().range.name, "payload_mass_kg");
}

/// Returns linear and angular acceleration of a level vehicle in its first step, body frame.
fn first_step(environment: Environment, speeds: [f32; 4]) -> (Vector3<f64>, Vector3<f64>) {
    const STEP_S: f64 = 1e-5;
    let mut plant = Plant::new(PlantModel::RigidBody, Motion::default(), environment);
    plant.step(&RotorSpeeds(Vector4::from(speeds)), STEP_S);
    (plant.motion().velocity_m_s / STEP_S, plant.motion().rates_rad_s / STEP_S)
}

/// Compares with the torque of each rotor about the common centre of mass, divided by the inertia about it, both summed
/// body by body. With two payloads, one is added after the other.
#[test]
fn a_payload_beside_the_axis_tilts_the_vehicle() {
    let (ahead_m, left_m) = (0.03, -0.02);
    let payload = Payload { mass_kg: 0.1, below_m: 0.05, ahead_m, left_m, start_s: 0.0, end_s: f64::INFINITY };
    let loaded = Environment::calm(P).unwrap().with_payloads(vec![payload]).unwrap();
    let speeds = [205.0, 210.0, 190.0, 220.0];
    let (linear, angular) = first_step(loaded, speeds);

    let total_kg = P.mass_kg + payload.mass_kg;
    let place = Vector3::new(ahead_m, left_m, -payload.below_m);
    let centre = place * (payload.mass_kg / total_kg);
    let about = |place: Vector3<f64>, mass_kg: f64| {
        let r = place - centre;
        mass_kg * Vector3::new(r.y * r.y + r.z * r.z, r.x * r.x + r.z * r.z, r.x * r.x + r.y * r.y)
    };
    let inertia = P.inertia_kg_m2 + about(Vector3::zeros(), P.mass_kg) + about(place, payload.mass_kg);
    let l = P.arm_m;
    // The paper's plus frame: rotors 1 to 4 at -y, +x, +y, -x; the drag of 1 and 3 turns the body positively.
    let places = [[0.0, -l], [l, 0.0], [0.0, l], [-l, 0.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
    let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
    for ((place, speed), turn) in places.iter().zip(speeds).zip([1.0, -1.0, 1.0, -1.0]) {
        let square = f64::from(speed).powi(2);
        let thrust = Vector3::z() * (P.thrust_factor_n_s2 * square);
        force += thrust;
        torque += (place - centre).cross(&thrust) + Vector3::z() * (turn * P.drag_factor_n_m_s2 * square);
    }
    assert!((linear - (force / total_kg - Vector3::z() * P.gravity_m_s2)).norm() < 1e-4, "{linear}");
    assert!((angular - torque.component_div(&inertia)).norm() < 1e-3 * angular.norm(), "{angular}");
    assert!(angular.y > 1.0, "weight ahead lowers the nose");

    let both = vec![payload, Payload { ahead_m: -ahead_m, left_m: -left_m, ..payload }];
    let (_, balanced) = first_step(Environment::calm(P).unwrap().with_payloads(both).unwrap(), [200.0; 4]);
    assert!(balanced.norm() < angular.norm());
    let far = Payload { ahead_m: 11.0, ..payload };
    assert_eq!(Environment::calm(P).unwrap().with_payloads(vec![far]).unwrap_err().range.name, "ahead_m");
}

/// A fault scales one moment of the intact vehicle by its factor and leaves the other two.
#[test]
fn a_wrong_sign_turns_one_moment_round() {
    let speeds = [205.0, 210.0, 190.0, 220.0];
    let (_, intact) = first_step(Environment::calm(P).unwrap(), speeds);
    assert!(intact.amin() > 0.1);
    let moments = [PlantParameter::RollMoment, PlantParameter::PitchMoment, PlantParameter::YawMoment];
    for (index, quantity) in moments.into_iter().enumerate() {
        for factor in [-1.0, 0.5, 2.0] {
            let change = PlantParameterChange { quantity, factor, start_s: 0.0, end_s: f64::INFINITY };
            let (_, changed) = first_step(Environment::new(P, vec![change], Vec::new()).unwrap(), speeds);
            let mut expected: Vector3<f64> = intact;
            expected[index] *= factor;
            assert!((changed - expected).norm() < 1e-3 * intact.norm(), "{quantity:?} {factor}: {changed}");
        }
    }
}
