//! Compares drag with closed-form solutions.

use afbc_plant::{Drag, Environment, Gust, GustKind, Motion, Plant, PlantModel, Realism, Wind};
use afbc_types::{Axis, Parameters, RotorSpeeds};
use nalgebra::{Matrix3, Rotation3, Vector3, Vector4};
use proptest::prelude::*;

const STEP_S: f64 = 0.001;
const P: Parameters<f64> = Parameters::PAPER;
const MODELS: [PlantModel; 2] = [PlantModel::Simplified, PlantModel::RigidBody];

fn none() -> Drag {
    Drag {
        air_density_kg_m3: 1.225,
        blade_n_s2_m: 0.0,
        rotor_height_m: 0.0,
        area_m2: Vector3::zeros(),
        centre_m: Vector3::zeros(),
    }
}

fn plant(model: PlantModel, initial: Motion, drag: Drag, steady_m_s: Vector3<f64>) -> Plant {
    let wind = Wind { steady_m_s, ..Wind::default() };
    let realism = Realism { drag: Some(drag), wind, ..Realism::default() };
    Plant::with_realism(model, initial, Environment::calm(P).unwrap(), &realism, STEP_S).unwrap()
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
            plant.step(&RotorSpeeds::<4>::default(), STEP_S);
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
            // The blades give no force along the rotor axes. The tolerance covers the rounding of the speeds.
            assert!((velocity.z - 0.5).abs() < 1e-4);
        }
    }
}

#[test]
fn drag_above_the_centre_of_mass_turns_the_vehicle_away_from_its_motion() {
    let initial = Motion { velocity_m_s: Vector3::new(2.0, 1.0, 0.0), ..Motion::default() };
    let drag = Drag { blade_n_s2_m: 2.4e-4, rotor_height_m: 0.05, ..none() };
    let mut by_blades = plant(PlantModel::RigidBody, initial, drag, Vector3::zeros());
    by_blades.step(&hover(), STEP_S);
    let rates = by_blades.motion().rates_rad_s;
    let force = drag.blade_n_s2_m * hover().0.map(f64::from).sum() * 2.0;
    assert!((rates.y + 0.05 * force / P.inertia_kg_m2.y * STEP_S).abs() < 1e-3 * rates.y.abs());

    let centre_m = Vector3::new(0.0, 0.0, 0.05);
    let drag = Drag { area_m2: Vector3::new(0.02, 0.02, 0.0), centre_m, ..none() };
    let mut by_body = plant(PlantModel::RigidBody, initial, drag, Vector3::zeros());
    by_body.step(&hover(), STEP_S);
    let rates = by_body.motion().rates_rad_s;
    let force = 0.5 * 1.225 * 0.02 * 5.0_f64.sqrt() * 2.0;
    assert!((rates.y + 0.05 * force / P.inertia_kg_m2.y * STEP_S).abs() < 1e-3 * rates.y.abs());
    assert!((rates.x - 0.5 * -rates.y).abs() < 1e-3 * rates.y.abs());
}

/// At the yaw rate r, each hub moves around the centre of mass at the speed r l. Its blade force opposes the motion, so
/// dr/dt = -4 k omega l^2/Iz r. Only yaw changes, because the blade forces of four equally fast hubs cancel.
#[test]
fn blades_brake_yaw_exponentially() {
    let drag = Drag { blade_n_s2_m: 2.4e-4, rotor_height_m: 0.02, ..none() };
    let initial = Motion { rates_rad_s: Vector3::new(0.0, 0.0, 3.0), ..Motion::default() };
    let omega = f64::from(hover().0.x);
    let rate = 4.0 * drag.blade_n_s2_m * omega * P.arm_m * P.arm_m / P.inertia_kg_m2.z;
    assert!((1.5..1.7).contains(&rate), "{rate} 1/s for the paper's vehicle");
    for model in MODELS {
        let mut plant = plant(model, initial, drag, Vector3::zeros());
        for k in 1..=2000 {
            plant.step(&hover(), STEP_S);
            let gone = (-rate * f64::from(k) * STEP_S).exp();
            let Motion { velocity_m_s, rates_rad_s, .. } = plant.motion();
            assert!((rates_rad_s - initial.rates_rad_s * gone).amax() < 1e-9, "{rates_rad_s} after {k} steps");
            assert!(velocity_m_s.xy().amax() < 1e-9);
        }
    }
}

/// Rotors 2 (front) and 4 (rear) turn at unequal speeds in wind from the right. The faster one has the larger force.
#[test]
fn unequal_rotors_in_wind_turn_the_vehicle_about_its_vertical_axis() {
    let drag = Drag { blade_n_s2_m: 2.4e-4, ..none() };
    let wind = Vector3::new(0.0, 5.0, 0.0);
    // The squares of 1, 3 and 2, 4 have the same sum, so that the rotors' drag moments cancel.
    let (front, rear) = (220.0_f32, 170.0_f32);
    let side = ((front * front + rear * rear) / 2.0).sqrt();
    let speeds = RotorSpeeds(Vector4::new(side, front, side, rear));
    let yaw_rad_s2 = |wind| {
        let mut plant = plant(PlantModel::RigidBody, Motion::default(), drag, wind);
        plant.step(&speeds, STEP_S);
        plant.motion().rates_rad_s.z / STEP_S
    };
    let expected = drag.blade_n_s2_m * f64::from(front - rear) * P.arm_m * wind.y / P.inertia_kg_m2.z;
    let found = yaw_rad_s2(wind) - yaw_rad_s2(Vector3::zeros());
    // The tolerance covers the yaw damping of 1.6 1/s during a step, and the pitch that grows within it.
    assert!((found / expected - 1.0).abs() < 2e-3, "{found}, not {expected} rad/s2");
}

#[test]
fn drag_that_the_step_cannot_follow_is_refused() {
    let refused = |drag: Drag| {
        let realism = Realism { drag: Some(drag), ..Realism::default() };
        let environment = Environment::calm(P).unwrap();
        Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, 0.02)
            .unwrap_err()
            .range
            .name
    };
    assert_eq!(refused(Drag { blade_n_s2_m: 0.01, ..none() }), "blade_n_s2_m");
    // The step is stable for the mass, but not for the inertia that the hubs rotate.
    assert_eq!(refused(Drag { blade_n_s2_m: 2.4e-4, ..none() }), "blade_n_s2_m");
    assert_eq!(refused(Drag { area_m2: Vector3::new(0.0, 0.0, 1.0), ..none() }), "area_m2");
    assert_eq!(refused(Drag { centre_m: Vector3::new(0.0, 0.0, 5.0), ..none() }), "centre_m");
    assert_eq!(refused(Drag { air_density_kg_m3: f64::NAN, ..none() }), "air_density_kg_m3");
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

/// Returns the rotation from body to earth: Rz(psi) Ry(theta) Rx(phi).
fn r_earth_body(eta: &Vector3<f64>) -> Matrix3<f64> {
    *Rotation3::from_euler_angles(eta.x, eta.y, eta.z).matrix()
}

/// Returns force and moment of the blades in body axes: the sum over the rotors of k omega_i times the in-plane
/// velocity of each hub relative to the air, acting at the hub.
fn blades(drag: &Drag, motion: &Motion, wind: &Vector3<f64>, speeds: &RotorSpeeds) -> (Vector3<f64>, Vector3<f64>) {
    let (l, h) = (P.arm_m, drag.rotor_height_m);
    let hubs = [(0.0, -l), (l, 0.0), (0.0, l), (-l, 0.0)].map(|(x, y)| Vector3::new(x, y, h));
    let airspeed = r_earth_body(&motion.attitude_rad).transpose() * (motion.velocity_m_s - wind);
    let each = hubs.iter().zip(&speeds.0).map(|(hub, &omega)| {
        let through_air = airspeed + motion.rates_rad_s.cross(hub);
        let force = -drag.blade_n_s2_m * f64::from(omega) * Vector3::new(through_air.x, through_air.y, 0.0);
        (force, hub.cross(&force))
    });
    each.fold((Vector3::zeros(), Vector3::zeros()), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// By Galilean invariance, an observer who drifts with the wind sees a flight in still air.
    #[test]
    fn wind_is_motion_of_the_frame(
        velocity in vector(10.0),
        wind in vector(15.0),
        attitude in vector(1.0),
        rates in vector(3.0),
        first in 0..2_usize,
    ) {
        let model = *MODELS.get(first).unwrap();
        let still = Motion { velocity_m_s: velocity, attitude_rad: attitude, rates_rad_s: rates, ..Motion::default() };
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

    /// The effect of blade drag on the motion is the sum over the rotors, each at its own speed and its own hub's
    /// airspeed.
    #[test]
    fn each_rotor_is_held_back_at_its_own_hub(
        velocity in vector(10.0),
        wind in vector(10.0),
        attitude in vector(1.0),
        rates in vector(5.0),
        speeds in prop::array::uniform4(0.0_f32..400.0),
        height in -0.1..0.1,
        first in 0..2_usize,
    ) {
        const SHORT_S: f64 = 1e-5;
        let model = *MODELS.get(first).unwrap();
        let initial =
            Motion { velocity_m_s: velocity, attitude_rad: attitude, rates_rad_s: rates, ..Motion::default() };
        let speeds = RotorSpeeds(Vector4::from(speeds));
        let drag = Drag { blade_n_s2_m: 2.4e-4, rotor_height_m: height, ..none() };
        let after = |drag: Drag| {
            let wind = Wind { steady_m_s: wind, ..Wind::default() };
            let realism = Realism { drag: Some(drag), wind, ..Realism::default() };
            let mut plant =
                Plant::with_realism(model, initial, Environment::calm(P).unwrap(), &realism, SHORT_S).unwrap();
            plant.step(&speeds, SHORT_S);
            plant.motion()
        };
        let (with, without) = (after(drag), after(none()));
        let force = (with.velocity_m_s - without.velocity_m_s) * (P.mass_kg / SHORT_S);
        let moment = (with.rates_rad_s - without.rates_rad_s).component_mul(&P.inertia_kg_m2) / SHORT_S;
        let (body_force, expected_moment) = blades(&drag, &initial, &wind, &speeds);
        let expected_force = r_earth_body(&attitude) * body_force;
        // During the step, rates of at most 9 rad/s and angular accelerations of 3000 rad/s2 change the forces by 1e-4
        // of their largest value: 0.4 N s/m at a hub speed of 36 m/s, with arms of 0.25 m.
        prop_assert!((force - expected_force).amax() < 2e-3, "{force} N, not {expected_force}");
        prop_assert!((moment - expected_moment).amax() < 5e-4, "{moment} N m, not {expected_moment}");
    }

    /// Zero drag changes nothing: with or without surroundings, the models' equations give the same bits.
    #[test]
    fn zero_drag_changes_nothing(
        velocity in vector(10.0),
        wind in vector(10.0),
        attitude in vector(3.0),
        rates in vector(5.0),
        speeds in prop::array::uniform4(0.0_f32..400.0),
        size in -2.0..2.0,
        axis in 0..6_usize,
        first in 0..2_usize,
    ) {
        let model = *MODELS.get(first).unwrap();
        let initial =
            Motion { velocity_m_s: velocity, attitude_rad: attitude, rates_rad_s: rates, ..Motion::default() };
        let axis = *Axis::ALL.get(axis).unwrap();
        let push = Gust { axis, kind: GustKind::Acceleration, size, start_s: 0.0, end_s: f64::INFINITY };
        let environment = || Environment::new(P, Vec::new(), vec![push]).unwrap();
        let realism =
            Realism { drag: Some(none()), wind: Wind { steady_m_s: wind, ..Wind::default() }, ..Realism::default() };
        let mut with = Plant::with_realism(model, initial, environment(), &realism, STEP_S).unwrap();
        let mut without = Plant::new(model, initial, environment());
        for _ in 0..100 {
            with.step(&RotorSpeeds(Vector4::from(speeds)), STEP_S);
            without.step(&RotorSpeeds(Vector4::from(speeds)), STEP_S);
            prop_assert_eq!(with.motion(), without.motion());
        }
    }

    /// Drag only takes energy from the motion relative to the air.
    #[test]
    fn drag_never_pushes(velocity in vector(30.0), attitude in vector(1.0)) {
        let initial = Motion { velocity_m_s: velocity, attitude_rad: attitude, ..Motion::default() };
        let mut dragged = plant(
            PlantModel::RigidBody,
            initial,
            Drag { rotor_height_m: 0.0, centre_m: Vector3::zeros(), ..Drag::PAPER },
            Vector3::zeros(),
        );
        let energy = |m: &Motion| 0.5 * m.velocity_m_s.norm_squared() + P.gravity_m_s2 * m.position_m.z;
        let mut before = energy(&dragged.motion());
        for _ in 0..500 {
            dragged.step(&RotorSpeeds::<4>::default(), STEP_S);
            let now = energy(&dragged.motion());
            prop_assert!(now <= before + 1e-9);
            before = now;
        }
    }
}
