//! Compares forces and moments of any frame with the sum of r x F, and a vehicle with the same vehicle turned about its
//! z axis.

use afbc_plant::{Drag, Environment, Motion, Plant, PlantModel, Realism, RotorFault, RotorLayout, Rotors};
use afbc_types::{Parameters, Rotor, RotorSpeeds};
use nalgebra::{SVector, Vector3};
use proptest::prelude::*;

const P: Parameters<f64> = Parameters::PAPER;
const STEP_S: f64 = 1e-4;

fn rotors() -> impl Strategy<Value = Vec<Rotor<f64>>> {
    let rotor = (-2.0..2.0_f64, -2.0..2.0_f64, any::<bool>());
    prop::collection::vec(rotor.prop_map(|(x, y, pushes_left)| Rotor { x, y, pushes_left }), 4..=8)
}

fn speeds(values: &[f64]) -> RotorSpeeds<8> {
    RotorSpeeds(SVector::from_iterator(values.iter().map(|&w| w as f32)))
}

fn plant(rotors: &[Rotor<f64>], initial: Motion, realism: Option<&Realism>) -> Plant {
    let environment = Environment::calm(P).unwrap().with_frame(RotorLayout::new(rotors).unwrap());
    match realism {
        None => Plant::new(PlantModel::RigidBody, initial, environment),
        Some(realism) => Plant::with_realism(PlantModel::RigidBody, initial, environment, realism, STEP_S).unwrap(),
    }
}

proptest! {
    /// One short step from rest: the sum over the rotors, and nothing else, turns and lifts the vehicle.
    #[test]
    fn a_frame_gives_the_sum_of_its_rotors(
        rotors in rotors(),
        w in prop::array::uniform8(0.0..400.0_f64),
    ) {
        let mut plant = plant(&rotors, Motion::default(), None);
        plant.step(&speeds(&w), STEP_S);
        let (mut force, mut moment) = (0.0, Vector3::zeros());
        for (rotor, w) in rotors.iter().zip(w) {
            let w = f64::from(w as f32);
            let f = P.thrust_factor_n_s2 * w * w;
            let at_m = Vector3::new(rotor.x, rotor.y, 0.0) * P.arm_m;
            let drag = if rotor.pushes_left { P.drag_factor_n_m_s2 } else { -P.drag_factor_n_m_s2 };
            force += f;
            moment += at_m.cross(&Vector3::new(0.0, 0.0, f)) + Vector3::new(0.0, 0.0, drag * w * w);
        }
        let motion = plant.motion();
        let rates = moment.component_div(&P.inertia_kg_m2) * STEP_S;
        let scale = 1.0 + rates.amax();
        // Within a step the body hardly turns.
        prop_assert!((motion.rates_rad_s - rates).amax() < 1e-3 * scale * scale, "{} {rates}", motion.rates_rad_s);
        let rise = (force / P.mass_kg - P.gravity_m_s2) * STEP_S;
        let climb = motion.velocity_m_s.z;
        prop_assert!((climb - rise).abs() < 1e-3 * (1.0 + rise.abs()), "{climb} {rise}");
    }

    /// The frame is turned about z by an angle and the body back by it, so the rotors are at the same places. The
    /// vehicle moves the same, including drag; I_x equals I_y.
    #[test]
    fn a_turned_frame_is_the_same_vehicle(
        rotors in rotors(),
        angle in -3.0..3.0_f64,
        w in prop::array::uniform8(150.0..250.0_f64),
        velocity in prop::array::uniform3(-3.0..3.0_f64),
    ) {
        let (s, c) = angle.sin_cos();
        let turned: Vec<_> =
            rotors.iter().map(|r| Rotor { x: c * r.x - s * r.y, y: s * r.x + c * r.y, ..*r }).collect();
        let drag = Drag { area_m2: Vector3::repeat(0.01), centre_m: Vector3::zeros(), ..Drag::PAPER };
        let actuators = Rotors { time_constant_s: 0.02, max_rad_s: 400.0, ..Rotors::DEFAULT };
        let realism = Realism { rotors: actuators, drag: Some(drag), ..Realism::default() };
        let velocity_m_s = Vector3::from(velocity);
        let start = Motion { velocity_m_s, ..Motion::default() };
        let mut straight = plant(&rotors, start, Some(&realism));
        let yawed = Motion { attitude_rad: Vector3::new(0.0, 0.0, -angle), ..start };
        let mut turned = plant(&turned, yawed, Some(&realism));
        for _ in 0..200 {
            straight.step(&speeds(&w), STEP_S);
            turned.step(&speeds(&w), STEP_S);
        }
        let (straight, turned) = (straight.motion(), turned.motion());
        let scale = 1.0 + straight.velocity_m_s.amax();
        prop_assert!((straight.velocity_m_s - turned.velocity_m_s).amax() < 1e-9 * scale);
        let (rates, other) = (straight.rates_rad_s, turned.rates_rad_s);
        prop_assert!((rates.z - other.z).abs() < 1e-9 * (1.0 + rates.amax()));
    }
}

#[test]
fn rotors_that_are_not_there_do_nothing() {
    let four = RotorLayout::default();
    assert_eq!(four.count(), 4);
    let mut plant = plant(&afbc_types::PLUS.map(|rotor| rotor.to_f64()), Motion::default(), None);
    let mut alike = Plant::new(PlantModel::RigidBody, Motion::default(), Environment::calm(P).unwrap());
    plant.step(&speeds(&[200.0, 210.0, 190.0, 205.0, 300.0, 300.0, 300.0, 300.0]), STEP_S);
    alike.step(&RotorSpeeds(SVector::from([200.0, 210.0, 190.0, 205.0])), STEP_S);
    assert_eq!(plant.motion(), alike.motion());
}

#[test]
fn too_few_too_many_and_too_far_are_refused() {
    let rotor = Rotor { x: 1.0, y: 0.0, pushes_left: true };
    let refused = |rotors: &[Rotor<f64>]| RotorLayout::new(rotors).unwrap_err().range.name;
    assert_eq!((refused(&[rotor; 3]), refused(&[rotor; 9])), ("rotors", "rotors"));
    assert_eq!(refused(&[rotor, rotor, rotor, Rotor { x: f64::NAN, ..rotor }]), "rotor_position");
    assert_eq!(refused(&[rotor, rotor, rotor, Rotor { y: 11.0, ..rotor }]), "rotor_position");
    // A fault of a rotor that does not exist.
    let fault = RotorFault { rotor: 5, efficiency: 0.5, start_s: 0.0 };
    let realism = Realism { rotors: Rotors { faults: vec![fault], ..Rotors::DEFAULT }, ..Realism::default() };
    let on = |count| {
        let environment = Environment::calm(P).unwrap().with_frame(RotorLayout::new(&vec![rotor; count]).unwrap());
        Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, STEP_S)
    };
    assert_eq!(on(4).unwrap_err().range.name, "rotor");
    assert!(on(6).is_ok());
}
