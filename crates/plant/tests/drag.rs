//! Drag against closed forms.
#![allow(clippy::unwrap_used, missing_docs)]

use airframe::{Parameters, RotorSpeeds};
use nalgebra::{Vector3, Vector4};
use plant::{Drag, Environment, Model, Motion, Plant, Realism, Wind};
use proptest::prelude::*;

const STEP_S: f64 = 0.001;
const P: Parameters<f64> = Parameters::PAPER;
const MODELS: [Model; 2] = [Model::Simplified, Model::RigidBody];

fn none() -> Drag {
    Drag {
        air_density_kg_m3: 1.225,
        blade_n_s2_m: 0.0,
        rotor_height_m: 0.0,
        area_m2: Vector3::zeros(),
        centre_m: Vector3::zeros(),
    }
}

fn plant(model: Model, initial: Motion, drag: Drag, steady_m_s: Vector3<f64>) -> Plant {
    let wind = Wind { steady_m_s, ..Wind::default() };
    let realism = Realism { drag: Some(drag), wind, ..Realism::default() };
    Plant::with(model, initial, Environment::calm(P).unwrap(), &realism, STEP_S).unwrap()
}

fn hover() -> RotorSpeeds {
    RotorSpeeds(Vector4::repeat((P.mass_kg * P.gravity_m_s2 / (4.0 * P.thrust_factor_n_s2)).sqrt() as f32))
}

#[test]
fn a_falling_body_reaches_its_terminal_velocity_as_it_should() {
    let drag = Drag { area_m2: Vector3::new(0.01, 0.01, 0.02), ..none() };
    let terminal = (2.0 * P.mass_kg * P.gravity_m_s2 / (drag.air_density_kg_m3 * 0.02)).sqrt();
    for model in MODELS {
        let mut plant = plant(model, Motion::default(), drag, Vector3::zeros());
        for k in 1..=15_000 {
            plant.step(&RotorSpeeds::default(), STEP_S);
            let expected = -terminal * (P.gravity_m_s2 * f64::from(k) * STEP_S / terminal).tanh();
            assert!((plant.motion().velocity_m_s.z - expected).abs() < 1e-9);
        }
        assert!((plant.motion().velocity_m_s.z + terminal).abs() < 1e-4);
    }
}

#[test]
fn blades_slow_a_level_vehicle_exponentially_to_the_winds_speed() {
    let drag = Drag { blade_n_s2_m: 2.4e-4, ..none() };
    let initial = Motion { velocity_m_s: Vector3::new(2.0, -1.0, 0.5), ..Motion::default() };
    let wind = Vector3::new(-1.0, 3.0, 0.0);
    let rate = drag.blade_n_s2_m * hover().0.map(f64::from).sum() / P.mass_kg;
    for model in MODELS {
        let mut plant = plant(model, initial, drag, wind);
        for k in 1..=5000 {
            plant.step(&hover(), STEP_S);
            let gone = (-rate * f64::from(k) * STEP_S).exp();
            let expected = wind + (initial.velocity_m_s - wind) * gone;
            let velocity = plant.motion().velocity_m_s;
            assert!((velocity.xy() - expected.xy()).amax() < 1e-9);
            // Nothing along the rotors' axes, save the rounding of the speeds.
            assert!((velocity.z - 0.5).abs() < 1e-4);
        }
    }
}

#[test]
fn drag_above_the_centre_of_mass_turns_the_vehicle_away_from_its_motion() {
    let initial = Motion { velocity_m_s: Vector3::new(2.0, 1.0, 0.0), ..Motion::default() };
    let drag = Drag { blade_n_s2_m: 2.4e-4, rotor_height_m: 0.05, ..none() };
    let mut by_blades = plant(Model::RigidBody, initial, drag, Vector3::zeros());
    by_blades.step(&hover(), STEP_S);
    let rates = by_blades.motion().rates_rad_s;
    let force = drag.blade_n_s2_m * hover().0.map(f64::from).sum() * 2.0;
    assert!((rates.y + 0.05 * force / P.inertia_kg_m2.y * STEP_S).abs() < 1e-3 * rates.y.abs());

    let centre_m = Vector3::new(0.0, 0.0, 0.05);
    let drag = Drag { area_m2: Vector3::new(0.02, 0.02, 0.0), centre_m, ..none() };
    let mut by_body = plant(Model::RigidBody, initial, drag, Vector3::zeros());
    by_body.step(&hover(), STEP_S);
    let rates = by_body.motion().rates_rad_s;
    let force = 0.5 * 1.225 * 0.02 * 5.0_f64.sqrt() * 2.0;
    assert!((rates.y + 0.05 * force / P.inertia_kg_m2.y * STEP_S).abs() < 1e-3 * rates.y.abs());
    assert!((rates.x - 0.5 * -rates.y).abs() < 1e-3 * rates.y.abs());
}

#[test]
fn drag_that_the_step_cannot_follow_is_refused() {
    let refused = |drag: Drag| {
        let realism = Realism { drag: Some(drag), ..Realism::default() };
        let environment = Environment::calm(P).unwrap();
        Plant::with(Model::RigidBody, Motion::default(), environment, &realism, 0.02).unwrap_err().range.name
    };
    assert_eq!(refused(Drag { blade_n_s2_m: 0.01, ..none() }), "blade_n_s2_m");
    assert_eq!(refused(Drag { area_m2: Vector3::new(0.0, 0.0, 1.0), ..none() }), "area_m2");
    assert_eq!(refused(Drag { centre_m: Vector3::new(0.0, 0.0, 5.0), ..none() }), "centre_m");
    assert_eq!(refused(Drag { air_density_kg_m3: f64::NAN, ..none() }), "air_density_kg_m3");
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Galilei: an observer who drifts with the wind sees a flight in still air.
    #[test]
    fn wind_is_motion_of_the_frame(
        velocity in vector(10.0), wind in vector(15.0), attitude in vector(1.0), rates in vector(3.0), first in 0..2_usize
    ) {
        let model = *MODELS.get(first).unwrap();
        let still = Motion {
            velocity_m_s: velocity, attitude_rad: attitude, rates_rad_s: rates, ..Motion::default()
        };
        let moving = Motion { velocity_m_s: velocity + wind, ..still };
        let mut in_still_air = plant(model, still, Drag::PAPER, Vector3::zeros());
        let mut in_wind = plant(model, moving, Drag::PAPER, wind);
        for _ in 0..1000 {
            in_still_air.step(&hover(), STEP_S);
            in_wind.step(&hover(), STEP_S);
        }
        let (a, b) = (in_still_air.motion(), in_wind.motion());
        prop_assert!((b.velocity_m_s - a.velocity_m_s - wind).amax() < 1e-6);
        prop_assert!((b.position_m - a.position_m - wind).amax() < 1e-6);
        prop_assert!((b.rates_rad_s - a.rates_rad_s).amax() < 1e-6);
    }

    /// Drag takes energy from the motion through the air, and gives none.
    #[test]
    fn drag_never_pushes(velocity in vector(30.0), attitude in vector(1.0)) {
        let initial = Motion { velocity_m_s: velocity, attitude_rad: attitude, ..Motion::default() };
        let mut dragged = plant(Model::RigidBody, initial, Drag { rotor_height_m: 0.0, centre_m: Vector3::zeros(), ..Drag::PAPER }, Vector3::zeros());
        let energy = |m: &Motion| 0.5 * m.velocity_m_s.norm_squared() + P.gravity_m_s2 * m.position_m.z;
        let mut before = energy(&dragged.motion());
        for _ in 0..500 {
            dragged.step(&RotorSpeeds::default(), STEP_S);
            let now = energy(&dragged.motion());
            prop_assert!(now <= before + 1e-9);
            before = now;
        }
    }
}
