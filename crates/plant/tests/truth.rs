//! Compares the instruments' input with finite differences of the motion and with forces written out.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc_plant::noise::{Noise, NoiseStream};
use afbc_plant::{
    Contact, Drag, Environment, GroundEffect, Gust, GustKind, Motion, Plant, PlantModel, Realism, RotorStart, Rotors,
    Truth, Turbulence, Wind,
};
use afbc_types::{Axis, Parameters, RotorSpeeds};
use nalgebra::{Quaternion, Vector3, Vector4};

const G: f64 = 9.81;
const HOVER_RAD_S: f32 = 199.9;

fn three(noise: &mut Noise, size: f64) -> Vector3<f64> {
    Vector3::new(noise.normal(), noise.normal(), noise.normal()) * size
}

/// Returns drag, wind and turbulence, lag, and ground with its effect.
fn stormy(seed: u64) -> Realism {
    Realism {
        rotors: Rotors { time_constant_s: 0.02, max_rad_s: 317.0, ..Rotors::default() },
        drag: Some(Drag::PAPER),
        wind: Wind {
            steady_m_s: Vector3::new(3.0, -2.0, 0.0),
            turbulence: Some(Turbulence::MODERATE),
            ..Wind::default()
        },
        contact: Some(Contact::PAPER),
        ground_effect: Some(GroundEffect::PAPER),
        seed,
    }
}

fn calm() -> Environment {
    Environment::calm(Parameters::PAPER).unwrap()
}

/// Visits random flights: tilted, turning, at heights from which some fall to the ground.
fn flights(mut visit: impl FnMut(&mut Plant, &mut Noise)) {
    let mut noise = Noise::new(11, NoiseStream::Scenario);
    for seed in 0..20 {
        for model in [PlantModel::RigidBody, PlantModel::Simplified] {
            let initial = Motion {
                position_m: Vector3::new(0.0, 0.0, 0.1 + 0.5 * noise.uniform()),
                velocity_m_s: three(&mut noise, 1.0),
                attitude_rad: three(&mut noise, 0.3),
                rates_rad_s: three(&mut noise, 1.0),
            };
            let gust = Gust { axis: Axis::X, kind: GustKind::Force, size: 0.3, start_s: 0.0, end_s: f64::INFINITY };
            let environment = Environment::new(Parameters::PAPER, Vec::new(), vec![gust]).unwrap();
            for realism in [None, Some(stormy(seed))] {
                // Steps of 0.1 ms, so that the differences are taken over a short time.
                let mut plant = match realism {
                    None => Plant::new(model, initial, environment.clone()),
                    Some(realism) => Plant::with_realism(model, initial, environment.clone(), &realism, 1e-4).unwrap(),
                };
                visit(&mut plant, &mut noise);
            }
        }
    }
}

/// Returns the body rate that turns one attitude into the next in `dt_s`.
fn turned(before: &Quaternion<f64>, after: &Quaternion<f64>, dt_s: f64) -> Vector3<f64> {
    let between = before.conjugate() * after;
    between.imag() * (2.0 * between.w.signum() / dt_s)
}

/// In the air, accelerations and rates agree with the differences over a step, as the mean of both ends. The bound is
/// half of one step's change: lagging rotors 0.015 m/s2, turbulence some 0.05 m/s2; without drag, 1 m/s2 would be
/// missing. On the ground, dampers act at once when a foot touches. There the sum over 10 ms agrees with the change of
/// velocity within half of some such jumps, 20 m/s2 for 0.1 ms each; without the ground 0.1 m/s would be missing.
#[test]
fn accelerations_and_rates_are_those_of_the_motion() {
    const DT_S: f64 = 1e-4;
    const WINDOW: u32 = 100;
    let (mut in_air, mut on_ground) = (0, 0);
    flights(|plant, noise| {
        let mut speeds = RotorSpeeds(Vector4::repeat(HOVER_RAD_S * 0.9));
        plant.step(&speeds, DT_S);
        let (mut missing, mut turning, mut touched) = (Vector3::zeros(), Vector3::zeros(), 0);
        for step in 1..=4000 {
            if step % 500 == 1 {
                speeds.0 = Vector4::from_fn(|_, _| HOVER_RAD_S * (0.85 + 0.1 * noise.uniform() as f32));
            }
            let a = plant.truth();
            plant.step(&speeds, DT_S);
            let b = plant.truth();
            let dv = (b.velocity_m_s - a.velocity_m_s) - (a.acceleration_m_s2 + b.acceleration_m_s2) * (DT_S / 2.0);
            let angular = a.angular_acceleration_rad_s2 + b.angular_acceleration_rad_s2;
            let dw = (b.rates_rad_s - a.rates_rad_s) - angular * (DT_S / 2.0);
            let dq = turned(&a.attitude, &b.attitude, DT_S) - (a.rates_rad_s + b.rates_rad_s) / 2.0;
            // An ideal plant's load jumps with the command.
            if step % 500 > 2 && a.position_m.z.min(b.position_m.z) > 0.3 {
                in_air += 1;
                assert!(dv.norm() < 0.1 * DT_S, "{dv:?} in step {step}");
                assert!(dw.norm() < 0.5 * DT_S, "{dw:?} in step {step}");
                assert!(dq.norm() < 1e-3, "{dq:?} in step {step}");
            }
            (missing, turning) = (missing + dv, turning + dw);
            touched += u32::from(plant.telemetry().is_some_and(|telemetry| telemetry.on_ground));
            if step % WINDOW == 0 {
                on_ground += u32::from(touched == WINDOW);
                assert!(missing.norm() < 0.01, "{missing:?} before step {step}, {touched} of them on the ground");
                assert!(turning.norm() < 0.1, "{turning:?} before step {step}, {touched} of them on the ground");
                (missing, turning, touched) = (Vector3::zeros(), Vector3::zeros(), 0);
            }
        }
    });
    assert!(in_air > 50_000 && on_ground > 50, "{in_air} steps in the air, {on_ground} windows on the ground");
}

/// In free fall the specific force is zero at any attitude; with thrust it is along body z alone.
#[test]
fn free_fall_is_felt_as_nothing_and_thrust_along_body_z() {
    for model in [PlantModel::RigidBody, PlantModel::Simplified] {
        let attitude_rad = Vector3::new(0.5, -0.7, 2.0);
        let initial = Motion { attitude_rad, rates_rad_s: Vector3::new(0.1, 0.2, -0.3), ..Motion::default() };
        let mut plant = Plant::new(model, initial, calm());
        for _ in 0..100 {
            plant.step(&RotorSpeeds::<4>::default(), 1e-3);
            assert!(plant.truth().specific_force_m_s2().norm() < 1e-12);
            assert!(plant.truth().thrust_share.abs() < 1e-12);
        }
        plant.step(&RotorSpeeds(Vector4::repeat(150.0)), 1e-3);
        let thrust = 4.0 * Parameters::PAPER.thrust_factor_n_s2 * 150.0 * 150.0 / Parameters::PAPER.mass_kg;
        assert!((plant.truth().specific_force_m_s2() - Vector3::z() * thrust).norm() < 1e-12);
        assert!((plant.truth().thrust_share - thrust / G).abs() < 1e-12);
    }
}

/// A vehicle at rest on the ground has gravity upward as its specific force. This also holds before the first step, on
/// the ground and in a hover.
#[test]
fn rest_is_felt_as_gravity_upward() {
    let at_rest = |truth: &Truth, bound: f64| {
        let felt = truth.specific_force_m_s2();
        assert!((felt - Vector3::z() * G).norm() < bound, "{felt:?}");
    };
    let rest = Contact::PAPER.foot_depth_m - Contact::PAPER.sink_m;
    let initial = Motion { position_m: Vector3::new(0.0, 0.0, rest), ..Motion::default() };
    let realism = Realism {
        rotors: Rotors { start: RotorStart::Idle, max_rad_s: 317.0, ..Rotors::default() },
        contact: Some(Contact::PAPER),
        ..Realism::default()
    };
    for model in [PlantModel::RigidBody, PlantModel::Simplified] {
        let mut plant = Plant::with_realism(model, initial, calm(), &realism, 1e-3).unwrap();
        at_rest(&plant.truth(), 1e-9);
        for _ in 0..3000 {
            plant.step(&RotorSpeeds::<4>::default(), 1e-3);
            at_rest(&plant.truth(), 1e-9);
        }
        at_rest(&Plant::new(model, Motion::default(), calm()).truth(), 1e-9);
        let hovering = Realism { drag: Some(Drag::PAPER), ..Realism::default() };
        at_rest(&Plant::with_realism(model, Motion::default(), calm(), &hovering, 1e-3).unwrap().truth(), 1e-9);
    }
}

/// The drag of the paper's vehicle that slides through still air is calculated separately for blades and body.
#[test]
fn drag_is_felt() {
    let initial = Motion { velocity_m_s: Vector3::new(4.0, 0.0, 0.0), ..Motion::default() };
    let realism = Realism { drag: Some(Drag::PAPER), ..Realism::default() };
    let mut plant = Plant::with_realism(PlantModel::RigidBody, initial, calm(), &realism, 1e-5).unwrap();
    plant.step(&RotorSpeeds(Vector4::repeat(HOVER_RAD_S)), 1e-5);
    let Drag { air_density_kg_m3, blade_n_s2_m, area_m2, .. } = Drag::PAPER;
    let newton = 4.0 * blade_n_s2_m * f64::from(HOVER_RAD_S) * 4.0 + 0.5 * air_density_kg_m3 * area_m2.x * 16.0;
    let felt = plant.truth().specific_force_m_s2().x;
    assert!((felt + newton / Parameters::PAPER.mass_kg).abs() < 1e-3, "{felt}");
}

/// Reading the truth changes nothing.
#[test]
fn truth_is_only_read() {
    let fly = |ask: bool| {
        let mut plant =
            Plant::with_realism(PlantModel::RigidBody, Motion::default(), calm(), &stormy(3), 1e-3).unwrap();
        for _ in 0..500 {
            plant.step(&RotorSpeeds(Vector4::new(199.0, 200.0, 201.0, 199.5)), 1e-3);
            if ask {
                let _ = plant.truth();
            }
        }
        plant.motion()
    };
    assert_eq!(fly(true), fly(false));
}
