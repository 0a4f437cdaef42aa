//! Compares the nominal model (7) with rigid-body mechanics in `f64`, and d eta/dt with the rotation that it describes.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use crate::common::{U, spread, step};
use afbc::model::{ModelConstants, RollPitch, TILT_COSINE_MIN};
use afbc::{Adaptive, Controller, Profile, Settings};
use afbc_control::Validated;
use afbc_types::{Axis, Declaration, Parameters, Setpoint, State};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;

/// Error of a sine or cosine.
const SINE: f64 = 1.7e-4;

fn vehicle() -> impl Strategy<Value = Parameters> {
    let inertia = || spread(Parameters::<f32>::INERTIA);
    let any = |declaration: Declaration| spread(declaration);
    (
        any(Parameters::<f32>::MASS),
        any(Parameters::<f32>::ARM),
        [inertia(), inertia(), inertia()],
        any(Parameters::<f32>::ROT_INERTIA),
        (any(Parameters::<f32>::THRUST), any(Parameters::<f32>::DRAG)),
        any(Parameters::<f32>::GRAVITY),
    )
        .prop_map(|(mass_kg, arm_m, inertia, rotor_inertia_kg_m2, (thrust_factor_n_s2, drag), gravity_m_s2)| {
            Parameters {
                mass_kg,
                arm_m,
                inertia_kg_m2: Vector3::from(inertia),
                rotor_inertia_kg_m2,
                thrust_factor_n_s2,
                drag_factor_n_m_s2: drag,
                gravity_m_s2,
            }
        })
}

fn attitude(tilt_max_rad: f32) -> impl Strategy<Value = Vector3<f32>> {
    (-tilt_max_rad..tilt_max_rad, -tilt_max_rad..tilt_max_rad, -3.1_f32..3.1)
        .prop_map(|(roll, pitch, yaw)| Vector3::new(roll, pitch, yaw))
}

fn rates() -> impl Strategy<Value = Vector3<f32>> {
    prop::array::uniform3(-5.0_f32..5.0).prop_map(Vector3::from)
}

/// Returns the d eta/dt that the law uses, from its trace: d e_1/dt = d x_1d/dt - d eta/dt, with a setpoint that does
/// not turn.
fn eta_dot(settings: Settings, attitude_rad: Vector3<f32>, rates_rad_s: Vector3<f32>) -> Vector3<f64> {
    let law = Adaptive::new(Profile::Paper.gains()).unwrap();
    let controller = Controller::new(Parameters::PAPER.to_f32(), settings, law).unwrap();
    let state = State { attitude_rad, rates_rad_s, ..State::default() };
    let setpoint = Setpoint { yaw_rad: attitude_rad.z, ..Setpoint::default() };
    let trace = step(&controller, &mut Validated::default(), &state, &setpoint).trace;
    let [roll, pitch] = trace.filtered.map(|filtered| filtered.rate);
    let errors = trace.errors;
    Vector3::new(roll - errors.roll.e1_dot, pitch - errors.pitch.e1_dot, -errors.yaw.e1_dot).cast()
}

fn printed(feed_forward: bool) -> Settings {
    Settings { feed_forward, ..Profile::Paper.settings() }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Roll, pitch and yaw: I dOmega/dt = moments - Omega x (I Omega), for the body and for its rotors, which have the
    /// inertia I_r and the angular velocity -omega along body z. Also the moment of each input.
    #[test]
    fn attitude_is_that_of_a_rigid_body(vehicle in vehicle(), rates in rates(), omega in -2e3_f32..2e3) {
        let inertia: Vector3<f64> = vehicle.inertia_kg_m2.cast();
        let turning: Vector3<f64> = rates.cast();
        let spin = Vector3::new(0.0, 0.0, -f64::from(vehicle.rotor_inertia_kg_m2) * f64::from(omega));
        let moment = -turning.cross(&(inertia.component_mul(&turning) + spin));
        let largest = turning.abs().max() * (inertia.max() * turning.abs().max() + spin.norm());
        let arm_m = f64::from(vehicle.arm_m);
        let per_newton = [arm_m, arm_m, f64::from(vehicle.drag_factor_n_m_s2) / f64::from(vehicle.thrust_factor_n_s2)];
        let (model, state) = (ModelConstants::new(&vehicle), State { rates_rad_s: rates, ..State::default() });
        for (index, axis) in [Axis::Roll, Axis::Pitch, Axis::Yaw].into_iter().enumerate() {
            let (about, got) = (inertia.as_slice()[index], model.dynamics(axis, &state, omega));
            let (f, g) = (moment.as_slice()[index] / about, per_newton[index] / about);
            prop_assert!((f64::from(got.f) - f).abs() <= 16.0 * U * largest / about, "{axis:?}: {} for {f}", got.f);
            prop_assert!((f64::from(got.g) - g).abs() <= 4.0 * U * g, "{axis:?}: {} for {g}", got.g);
            prop_assert_eq!((got.g_dot, model.hover_gain(axis)), (0.0, got.g));
        }
    }

    /// z: thrust along body z against gravity, with g_4 from the rotation matrix and its derivative along d eta/dt =
    /// Omega of (6). x and y: u5 and u6 are the accelerations.
    #[test]
    fn position_is_that_of_a_thrust_along_body_z(vehicle in vehicle(), eta in attitude(1.0), rates in rates()) {
        let (model, mass) = (ModelConstants::new(&vehicle), f64::from(vehicle.mass_kg));
        let state = State { attitude_rad: eta, rates_rad_s: rates, ..State::default() };
        let upward = |time_s: f64| {
            let eta = eta.cast::<f64>() + rates.cast::<f64>() * time_s;
            Rotation3::from_euler_angles(eta.x, eta.y, eta.z)[(2, 2)]
        };
        let z = model.dynamics(Axis::Z, &state, 100.0);
        prop_assert_eq!(z.f, -vehicle.gravity_m_s2);
        prop_assert!((f64::from(z.g) * mass - upward(0.0)).abs() <= 3.0 * SINE, "{} for {}", z.g, upward(0.0) / mass);
        let slope = (upward(1e-5) - upward(-1e-5)) / 2e-5;
        let allowed = 6.0 * SINE * rates.abs().sum() as f64 + 1e-6;
        prop_assert!((f64::from(z.g_dot) * mass - slope).abs() <= allowed, "{} for {}", z.g_dot, slope / mass);
        prop_assert!((f64::from(model.hover_gain(Axis::Z)) * mass - 1.0).abs() <= 2.0 * U);
        for axis in [Axis::X, Axis::Y] {
            let level = model.dynamics(axis, &state, 100.0);
            prop_assert_eq!((level.f, level.g, level.g_dot, model.hover_gain(axis)), (0.0, 1.0, 0.0, 1.0));
        }
    }

    /// A turn by Omega for a short time changes the angles by d eta/dt: R(eta + h d eta/dt) = R(eta) exp(h [Omega]).
    #[test]
    fn angles_turn_as_the_body_does(eta in attitude(1.3), rates in rates()) {
        let got = eta_dot(printed(true), eta, rates);
        let (eta, rates) = (eta.cast::<f64>(), rates.cast::<f64>());
        let after = |time_s: f64| {
            let turned = Rotation3::from_euler_angles(eta.x, eta.y, eta.z) * Rotation3::new(rates * time_s);
            let (roll, pitch, yaw) = turned.euler_angles();
            Vector3::new(roll, pitch, yaw)
        };
        let h = 1e-6;
        let exact = (after(h) - after(-h)) / (2.0 * h);
        prop_assume!(exact.amax() < 1e3);
        // Sine and cosine are divided by cos theta, whose error enters by its square.
        let allowed = 4.0 * SINE * rates.abs().sum() / eta.y.cos().powi(2) + 1e-5;
        prop_assert!((got - exact).amax() <= allowed, "{got} for {exact}");
        // As printed, (6) uses the rates for d eta/dt.
        prop_assert!((eta_dot(printed(false), eta.cast(), rates.cast()) - rates).amax() <= 1e-5);
    }

    /// Near a vertical nose, where yaw has no rate, cos theta counts as 0.1, also upside down.
    #[test]
    fn a_vertical_nose_turns_at_a_finite_rate(
        roll in -3.1_f32..3.1, pitch in 1.4709_f32..3.1, up: bool, rates in rates(),
    ) {
        let eta = Vector3::new(roll, if up { -pitch } else { pitch }, 0.0);
        let got = eta_dot(printed(true), eta, rates);
        let (eta, rates, least) = (eta.cast::<f64>(), rates.cast::<f64>(), f64::from(TILT_COSINE_MIN));
        let yaw = (rates.y * eta.x.sin() + rates.z * eta.x.cos()) / least;
        let exact = Vector3::new(rates.x + eta.y.sin() * yaw, rates.y * eta.x.cos() - rates.z * eta.x.sin(), yaw);
        let allowed = 4.0 * SINE * rates.abs().sum() / least + 1e-5;
        prop_assert!((got - exact).amax() <= allowed, "{got} for {exact}");
    }
}

/// R e_z agrees with roll and pitch: its z is the cosine of the tilt, of which (6) uses at least 0.1.
#[test]
fn the_tilt_is_the_angle_of_body_z() {
    let model = ModelConstants::new(&Parameters::PAPER.to_f32());
    for (roll, pitch) in (-31..=31).flat_map(|roll| (-31..=31).map(move |pitch| (roll, pitch))) {
        let attitude_rad = Vector3::new(0.1 * roll as f32, 0.1 * pitch as f32, 0.4);
        let state = State { attitude_rad, ..State::default() };
        let matrix: Matrix3<f64> = Rotation3::from_euler_angles(
            f64::from(attitude_rad.x),
            f64::from(attitude_rad.y),
            f64::from(attitude_rad.z),
        )
        .into_inner();
        let cosine = f64::from(RollPitch::new(&state).tilt_cosine());
        assert!((cosine - matrix.m33).abs() <= 2.1 * SINE, "{cosine} for {}", matrix.m33);
        let g = f64::from(model.dynamics(Axis::Z, &state, 0.0).g) * 0.486;
        assert!((g - matrix.m33.max(f64::from(TILT_COSINE_MIN))).abs() <= 2.2 * SINE, "{g} for {}", matrix.m33);
    }
}
