//! Optional effects in the code must not change the ideal plant.

use afbc_plant::integrate::rk4;
use afbc_plant::{
    Environment, Gust, GustKind, Load, Motion, Plant, PlantModel, PlantParameter, PlantParameterChange, Realism,
    rigid_body, simplified,
};
use afbc_types::{Axis, Parameters, RotorSpeeds};
use nalgebra::{Vector3, Vector4};

const STEP_S: f64 = 0.001;
const STEPS: u16 = 2000;

fn environment() -> Environment {
    let change = |quantity, factor, start_s, end_s| PlantParameterChange { quantity, factor, start_s, end_s };
    let changes = vec![
        change(PlantParameter::Inertia, 1.75, 0.5, 1.5),
        change(PlantParameter::ThrustFactor, 0.6, 0.7, f64::INFINITY),
    ];
    let gusts = vec![
        Gust { axis: Axis::X, kind: GustKind::Acceleration, size: 1.2, start_s: 0.3, end_s: 1.3 },
        Gust { axis: Axis::Roll, kind: GustKind::Force, size: 0.01, start_s: 0.2, end_s: 0.4 },
    ];
    Environment::new(Parameters::PAPER, changes, gusts).unwrap()
}

fn start() -> Motion {
    Motion {
        position_m: Vector3::new(0.1, -0.2, 0.5),
        velocity_m_s: Vector3::new(0.3, 0.2, -0.1),
        attitude_rad: Vector3::new(0.1, -0.2, 0.35),
        rates_rad_s: Vector3::new(0.5, -0.4, 0.3),
    }
}

fn speeds(k: u16) -> RotorSpeeds {
    RotorSpeeds(Vector4::new(200.0 + f32::from(k % 7), 199.0 + f32::from(k % 5), 201.0, 198.5 + f32::from(k % 3)))
}

fn bits(motion: &Motion) -> Vec<u64> {
    let Motion { position_m, velocity_m_s, attitude_rad, rates_rad_s } = motion;
    [position_m, velocity_m_s, attitude_rad, rates_rad_s].iter().flat_map(|v| v.iter()).map(|x| x.to_bits()).collect()
}

fn hash(mut plant: Plant) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for k in 0..STEPS {
        plant.step(&speeds(k), STEP_S);
        for bits in bits(&plant.motion()) {
            hash = (hash ^ bits).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}

/// Hashes recorded before any effect was added.
#[test]
fn flights_of_the_ideal_plant_stay_what_they_were() {
    assert_eq!(hash(Plant::new(PlantModel::Simplified, start(), environment())), 0x0640_40e6_7508_8793);
    assert_eq!(hash(Plant::new(PlantModel::RigidBody, start(), environment())), 0x3c53_bd46_9a9b_57e6);
}

#[test]
fn realism_that_adds_nothing_changes_no_bit() {
    for model in [PlantModel::Simplified, PlantModel::RigidBody] {
        let real = Plant::with_realism(model, start(), environment(), &Realism::default(), STEP_S).unwrap();
        assert_eq!(hash(real), hash(Plant::new(model, start(), environment())));
    }
}

#[test]
fn a_step_is_one_runge_kutta_step_under_the_load() {
    let vehicle = Parameters::PAPER;
    let zero = Vector3::zeros();
    let mut plant = Plant::new(PlantModel::Simplified, start(), Environment::calm(vehicle).unwrap());
    let mut x = simplified::vector(&start());
    for k in 0..STEPS {
        let load = Load::new(&vehicle, speeds(k).0.map(f64::from).into(), zero, zero);
        x = rk4(|x| simplified::derivative(x, &load), &x, STEP_S);
        plant.step(&speeds(k), STEP_S);
        assert_eq!(bits(&plant.motion()), bits(&simplified::motion(&x)));
    }

    let mut plant = Plant::new(PlantModel::RigidBody, start(), Environment::calm(vehicle).unwrap());
    let mut x = rigid_body::vector(&start());
    for k in 0..STEPS {
        let load = Load::new(&vehicle, speeds(k).0.map(f64::from).into(), zero, zero);
        x = rk4(|x| rigid_body::derivative(x, &load), &x, STEP_S);
        let (w, i, j, k_) = (x.get(6).unwrap(), x.get(7).unwrap(), x.get(8).unwrap(), x.get(9).unwrap());
        let scale = 1.0 / (w * w + i * i + j * j + k_ * k_).sqrt();
        x.fixed_rows_mut::<4>(6).iter_mut().for_each(|q| *q *= scale);
        plant.step(&speeds(k), STEP_S);
        assert_eq!(bits(&plant.motion()), bits(&rigid_body::motion(&x)));
    }
}
