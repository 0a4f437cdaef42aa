//! Compares the model that the baseline inverts with the plant: two independent implementations.
#![allow(clippy::indexing_slicing, missing_docs)] // missing data must stop the test

use afbc::model;
use afbc_plant::{Load, Motion, simplified};
use afbc_types::{Axis, Parameters, State};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Relative rounding error of one `f32` operation.
const U: f64 = 1.0 / (1 << 24) as f64;

/// Largest error of the control crate's sine and cosine, checked by `crates/control/tests/math.rs`.
const TRIGONOMETRY: f64 = 1.7e-4;

fn parameters() -> impl Strategy<Value = Parameters<f64>> {
    let f = |x: f64| 0.5 * x..2.0 * x;
    let p = Parameters::PAPER;
    let inertia = (f(p.inertia_kg_m2.x), f(p.inertia_kg_m2.y), f(p.inertia_kg_m2.z));
    let rotors = (f(p.rotor_inertia_kg_m2), f(p.thrust_factor_n_s2), f(p.drag_factor_n_m_s2));
    (f(p.mass_kg), f(p.arm_m), inertia, rotors).prop_map(|(mass_kg, arm_m, (x, y, z), (ir, b, d))| Parameters {
        mass_kg,
        arm_m,
        inertia_kg_m2: Vector3::new(x, y, z),
        rotor_inertia_kg_m2: ir,
        thrust_factor_n_s2: b,
        drag_factor_n_m_s2: d,
        gravity_m_s2: 9.81,
    })
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// f_i + g_i u_i of (7) is the plant's acceleration in each subsystem, for any rotor speeds.
    #[test]
    fn the_nominal_model_is_the_simplified_plant(
        p in parameters(),
        attitude_rad in vector(1.4),
        rates_rad_s in vector(5.0),
        speeds in prop::array::uniform4(0.0_f64..500.0),
    ) {
        let motion = Motion { attitude_rad, rates_rad_s, ..Motion::default() };
        let load = Load::new(&p, speeds, Vector3::zeros(), Vector3::zeros());
        let x_dot = simplified::derivative(&simplified::vector(&motion), &load);

        let [w1, w2, w3, w4] = speeds;
        let [f1, f2, f3, f4] = speeds.map(|w| p.thrust_factor_n_s2 * w * w);
        let state: State = motion.measure();
        let residual = w1 - w2 + w3 - w4;
        let model = model::ModelConstants::new(&p.to_f32());

        let (q, r) = (rates_rad_s.abs(), residual.abs());
        let i = p.inertia_kg_m2;
        let coupling = |a: f64, b: f64, c: f64, x: f64, y: f64| (a + b) / c * x * y;
        let gyroscopic = |i: f64, x: f64| p.rotor_inertia_kg_m2 / i * x * r;
        let total = f1 + f2 + f3 + f4;
        let (_, c_theta) = (attitude_rad.x.cos(), attitude_rad.y.cos());
        // Each case has a subsystem, the plant's acceleration, the paper's U_i, and the sum of the terms' magnitudes. A
        // term of f is rounded at most 8 times. z contains cosines that are not exact.
        let cases = [
            (
                Axis::Roll,
                x_dot[9],
                f3 - f1,
                coupling(i.y, i.z, i.x, q.y, q.z) + gyroscopic(i.x, q.y) + p.arm_m * total / i.x,
            ),
            (
                Axis::Pitch,
                x_dot[10],
                f4 - f2,
                coupling(i.z, i.x, i.y, q.x, q.z) + gyroscopic(i.y, q.x) + p.arm_m * total / i.y,
            ),
            (
                Axis::Yaw,
                x_dot[11],
                f1 - f2 + f3 - f4,
                coupling(i.x, i.y, i.z, q.x, q.y) + p.drag_factor_n_m_s2 / p.thrust_factor_n_s2 * total / i.z,
            ),
            (Axis::Z, x_dot[5], total, 9.81 + total / p.mass_kg),
        ];
        for (axis, expected, u, size) in cases {
            let dynamics = model.dynamics(axis, &state, residual as f32);
            let got = f64::from(dynamics.f) + f64::from(dynamics.g) * u;
            let trigonometry = if axis == Axis::Z {
                // Both cosines have errors of at most 1.7e-4. Below a product of 0.1, g_4 is limited by design.
                prop_assume!(attitude_rad.x.cos() * c_theta > 0.11);
                (2.0 + TRIGONOMETRY) * TRIGONOMETRY * total / p.mass_kg
            } else {
                0.0
            };
            let allowed = 8.0 * U * size + trigonometry;
            prop_assert!(
                (got - expected).abs() <= allowed,
                "{}: {got}, the plant gives {expected}, allowed {allowed:e}",
                axis.name()
            );
        }
        // The virtual subsystems are plain accelerations.
        for axis in [Axis::X, Axis::Y] {
            let wanted = model::Dynamics { f: 0.0, g: 1.0, g_dot: 0.0 };
            prop_assert_eq!(model.dynamics(axis, &state, residual as f32), wanted);
        }
    }

    /// d g_4/dt is the derivative of g_4 along the motion.
    #[test]
    fn the_derivative_of_g_4_is_that_of_g_4(attitude_rad in vector(1.2), rates_rad_s in vector(5.0)) {
        let p = Parameters::PAPER;
        let model = model::ModelConstants::new(&p.to_f32());
        let state: State = Motion { attitude_rad, rates_rad_s, ..Motion::default() }.measure();
        let dynamics = model.dynamics(Axis::Z, &state, 0.0);
        let g = |t: f64| {
            let eta = attitude_rad + rates_rad_s * t;
            eta.x.cos() * eta.y.cos() / p.mass_kg
        };
        let h = 1e-5;
        let exact = (g(h) - g(-h)) / (2.0 * h);
        // The allowed error comes from two products of a sine and a cosine, times a rate. Each factor has an error of
        // at most 1.7e-4, so a product has 3.4e-4.
        let allowed = 2.5 * TRIGONOMETRY * (rates_rad_s.x.abs() + rates_rad_s.y.abs()) / p.mass_kg + 1e-6;
        prop_assert!((f64::from(dynamics.g_dot) - exact).abs() <= allowed, "{} for {exact}", dynamics.g_dot);
        prop_assert!((f64::from(dynamics.g) - g(0.0)).abs() <= 2.5 * TRIGONOMETRY / p.mass_kg);
        prop_assert_eq!(dynamics.f, -9.81);
    }
}

/// Beyond a tilt of 84 degrees, g_4 no longer falls. It stays positive at any attitude, as assumption A4 requires.
#[test]
fn g_4_stays_positive_at_any_tilt() {
    let model = model::ModelConstants::new(&Parameters::PAPER.to_f32());
    for step in -2000..=2000_i16 {
        let tilt = f32::from(step) / 100.0;
        let state = State { attitude_rad: Vector3::new(tilt, 0.3 * tilt, 0.0), ..State::default() };
        let g = model.dynamics(Axis::Z, &state, 0.0).g;
        assert!(g >= 0.999 * model::TILT_COSINE_MIN / 0.486, "{g} at {tilt} rad");
    }
}
