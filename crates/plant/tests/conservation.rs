//! Conservation laws and closed-form solutions.

use afbc_plant::integrate::rk4;
use afbc_plant::{Environment, Load, Motion, Plant, PlantModel, rigid_body, simplified};
use afbc_types::{Parameters, RotorSpeeds};
use nalgebra::{Matrix3, SVector, Vector3, Vector4};
use proptest::prelude::*;

const G: f64 = 9.81;
const DT_S: f64 = 1e-3;

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

/// Draws principal inertias of a physical body: each at most the sum of the other two, here by a margin.
fn inertia() -> impl Strategy<Value = Vector3<f64>> {
    (0.002_f64..0.01, 0.002_f64..0.01, 0.1_f64..0.9)
        .prop_map(|(x, y, share)| Vector3::new(x, y, (x - y).abs() + share * (x + y - (x - y).abs())))
}

fn motion() -> impl Strategy<Value = Motion> {
    (vector(10.0), vector(5.0), (-3.0_f64..3.0, -1.4_f64..1.4, -3.0_f64..3.0), vector(5.0)).prop_map(
        |(position_m, velocity_m_s, (roll, pitch, yaw), rates_rad_s)| Motion {
            position_m,
            velocity_m_s,
            attitude_rad: Vector3::new(roll, pitch, yaw),
            rates_rad_s,
        },
    )
}

/// Returns the rotation from body to earth, Rz(psi) Ry(theta) Rx(phi), by the convention of `afbc-types`.
fn r_earth_body(eta: &Vector3<f64>) -> Matrix3<f64> {
    let (sx, cx) = eta.x.sin_cos();
    let (sy, cy) = eta.y.sin_cos();
    let (sz, cz) = eta.z.sin_cos();
    let rx = Matrix3::new(1.0, 0.0, 0.0, 0.0, cx, -sx, 0.0, sx, cx);
    let ry = Matrix3::new(cy, 0.0, sy, 0.0, 1.0, 0.0, -sy, 0.0, cy);
    let rz = Matrix3::new(cz, -sz, 0.0, sz, cz, 0.0, 0.0, 0.0, 1.0);
    rz * ry * rx
}

/// Returns translational and potential energy, rotational energy, and angular momentum in the earth frame.
fn conserved(p: &Parameters<f64>, m: &Motion) -> (f64, f64, Vector3<f64>) {
    let momentum = p.inertia_kg_m2.component_mul(&m.rates_rad_s);
    let translation = p.mass_kg * (0.5 * m.velocity_m_s.norm_squared() + p.gravity_m_s2 * m.position_m.z);
    (translation, 0.5 * m.rates_rad_s.dot(&momentum), r_earth_body(&m.attitude_rad) * momentum)
}

fn fall(p: Parameters<f64>, start: Motion, steps: usize) -> Plant {
    let mut plant = Plant::new(PlantModel::RigidBody, start, Environment::calm(p).unwrap());
    for _ in 0..steps {
        plant.step(&RotorSpeeds::<4>::default(), DT_S);
    }
    plant
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn free_fall_conserves_energy_and_angular_momentum(inertia in inertia(), start in motion()) {
        let p = Parameters { inertia_kg_m2: inertia, ..Parameters::PAPER };
        let before = conserved(&p, &start);
        let after = conserved(&p, &fall(p, start, 1000).motion());
        // The translation is a polynomial of second degree, which the method solves exactly, so only the rounding of
        // 1000 steps remains. Rotation at 5 rad/s with axis ratios up to 5 turns by at most 0.04 rad per step: an error
        // of at most (0.04)^5/120 = 1e-9 per step, 1e-6 in 1000 steps.
        let scale = p.mass_kg * (0.5 * 15.0 * 15.0 + G * 20.0);
        prop_assert!((after.0 - before.0).abs() <= 1e-11 * scale, "{} to {} J", before.0, after.0);
        prop_assert!((after.1 - before.1).abs() <= 1e-6 * before.1, "{} to {} J", before.1, after.1);
        prop_assert!((after.2 - before.2).norm() <= 1e-6 * before.2.norm(), "{} to {}", before.2, after.2);
    }

    /// The rotors' momentum I_r omega about body z is part of the total: without thrust and drag (b and d at their
    /// lower limits), gyroscopic moments do no work.
    #[test]
    fn rotor_gyroscopics_do_no_work(
        inertia in inertia(),
        rates in vector(5.0),
        speeds in prop::array::uniform4(0.0_f64..500.0),
    ) {
        let p = Parameters { inertia_kg_m2: inertia, rotor_inertia_kg_m2: 1e-4, ..Parameters::PAPER };
        let still = Load::new(&p, [0.0; 4], Vector3::zeros(), Vector3::zeros());
        let turning = Load::new(&p, speeds, Vector3::zeros(), Vector3::zeros());
        let level = Motion { rates_rad_s: rates, ..Motion::default() };
        let rates_dot = |load: &Load| -> Vector3<f64> {
            rigid_body::derivative(&rigid_body::vector(&level), load).fixed_rows::<3>(10).into()
        };
        let [s1, s2, s3, s4] = speeds.map(|w| w * w);
        let (l, b, d) = (p.arm_m, p.thrust_factor_n_s2, p.drag_factor_n_m_s2);
        let rotors = Vector3::new(l * b * (s3 - s1), l * b * (s4 - s2), d * (s1 - s2 + s3 - s4));
        let moment = (rates_dot(&turning) - rates_dot(&still)).component_mul(&inertia);
        let gyroscopic = moment - rotors;
        // The momentum of rotors 1 and 3 points to negative body z, that of 2 and 4 to positive; the moment is -Omega x
        // h.
        let h = Vector3::new(0.0, 0.0, -p.rotor_inertia_kg_m2 * (speeds[0] - speeds[1] + speeds[2] - speeds[3]));
        let scale = rotors.norm() + rates.norm() * h.norm() + 1e-3;
        prop_assert!((gyroscopic + rates.cross(&h)).norm() <= 1e-12 * scale, "{gyroscopic} for {}", -rates.cross(&h));
        prop_assert!(gyroscopic.dot(&rates).abs() <= 1e-12 * scale * (1.0 + rates.norm()));
    }

    /// A body with Ix = Iy: p and q rotate at the rate (Iz - Ix)/Ix r, and r is constant (Euler's closed form).
    #[test]
    fn a_symmetric_top_precesses_as_euler_says(rates in vector(5.0), attitude in vector(1.0)) {
        let p = Parameters::PAPER;
        let i = p.inertia_kg_m2;
        let start = Motion { rates_rad_s: rates, attitude_rad: attitude, ..Motion::default() };
        let end = fall(p, start, 1000).motion();
        let (s, c) = ((i.z - i.x) / i.x * rates.z).sin_cos(); // after 1 s
        let exact = Vector3::new(c * rates.x - s * rates.y, s * rates.x + c * rates.y, rates.z);
        // The integration error is (5e-3)^5/120 per step. After 1000 steps it is 3e-11 of the rates.
        prop_assert!(
            (end.rates_rad_s - exact).norm() <= 1e-10 * (1.0 + rates.norm()),
            "{} for {exact}",
            end.rates_rad_s
        );
    }

    /// Euler angles are converted to a quaternion and back. The body axes are compared with the quaternion's.
    #[test]
    fn attitude_is_preserved_by_the_quaternion(start in motion()) {
        let v = rigid_body::vector(&start);
        prop_assert!((v.fixed_rows::<4>(6).norm() - 1.0).abs() <= 4.0 * f64::EPSILON);
        let back = rigid_body::motion(&v);
        // Roll and yaw lose accuracy by a factor of 1/cos(pitch), at most 6; pitch up to 1.4 rad loses as much in asin.
        prop_assert!(
            (back.attitude_rad - start.attitude_rad).amax() <= 1e-14 * 6.0 * 3.0,
            "{} for {}",
            back.attitude_rad,
            start.attitude_rad
        );
        prop_assert_eq!(
            (back.position_m, back.velocity_m_s, back.rates_rad_s),
            (start.position_m, start.velocity_m_s, start.rates_rad_s)
        );
        // A thrust of 1 m/s2 shows the direction of body z.
        let p = Parameters { thrust_factor_n_s2: 1.0, mass_kg: 4.0, drag_factor_n_m_s2: 1e-12, ..Parameters::PAPER };
        let load = Load::new(&p, [1.0; 4], Vector3::new(0.0, 0.0, -G), Vector3::zeros());
        let body_z: Vector3<f64> = rigid_body::derivative(&v, &load).fixed_rows::<3>(3).into();
        prop_assert!((body_z - r_earth_body(&start.attitude_rad).column(2)).amax() <= 1e-14, "{body_z}");
    }

    /// The quaternion's derivative is orthogonal to it, so its length is constant, and equals the attitude's
    /// derivative.
    #[test]
    fn the_quaternion_stays_on_the_unit_sphere(start in motion()) {
        let v = rigid_body::vector(&start);
        let load = Load::new(&Parameters::PAPER, [0.0; 4], Vector3::zeros(), Vector3::zeros());
        let f = |v: &rigid_body::RigidBodyVector| rigid_body::derivative(v, &load);
        let (q, q_dot) = (v.fixed_rows::<4>(6), f(&v).fixed_rows::<4>(6).into_owned());
        prop_assert!(q.dot(&q_dot).abs() <= 1e-14 * (1.0 + q_dot.norm()));
        prop_assert!((q_dot.norm() - 0.5 * start.rates_rad_s.norm()).abs() <= 1e-14 * (1.0 + q_dot.norm()));
        // An unnormalised step loses at most the method's error (|Omega| dt / 2)^6 / 144.
        let after = rk4(f, &v, DT_S);
        prop_assert!((after.fixed_rows::<4>(6).norm() - 1.0).abs() <= 1e-15 + (0.005_f64).powi(6) / 144.0);

        // Compares a central difference of the Euler angles with `euler_rates`.
        let h = 1e-5;
        let (back, ahead) = (rigid_body::motion(&(v - f(&v) * h)), rigid_body::motion(&(v + f(&v) * h)));
        let mut difference = ahead.attitude_rad - back.attitude_rad;
        difference.apply(|angle| *angle -= core::f64::consts::TAU * (*angle / core::f64::consts::TAU).round());
        let rates = rigid_body::euler_rates(&start.attitude_rad, &start.rates_rad_s);
        // Error of h^2/6 times a third derivative that grows as (|Omega| / cos(pitch))^3, plus rounding divided by h.
        let steep = start.rates_rad_s.norm() / start.attitude_rad.y.cos();
        prop_assert!(
            (difference / (2.0 * h) - rates).amax() <= 1e-10 * (1.0 + steep * steep * steep) + 1e-9,
            "{} for {rates}",
            difference / (2.0 * h)
        );
    }

    /// Near hover the two models differ only in second order, because N(eta) is the identity to first order.
    #[test]
    fn the_models_agree_near_hover(
        attitude in vector(1.0),
        rates in vector(1.0),
        spread in prop::array::uniform4(-1.0_f64..1.0),
    ) {
        let p = Parameters::PAPER;
        let hover = (p.mass_kg * G / (4.0 * p.thrust_factor_n_s2)).sqrt();
        let apart = |size: f64| {
            let start = Motion { attitude_rad: attitude * size, rates_rad_s: rates * size, ..Motion::default() };
            let speeds = RotorSpeeds(Vector4::from(spread).map(|s| (hover * (1.0 + 0.01 * size * s)) as f32));
            let fly = |model| {
                let mut plant = Plant::new(model, start, Environment::calm(p).unwrap());
                (0..200).for_each(|_| plant.step(&speeds, DT_S));
                plant.motion()
            };
            let (a, b) = (fly(PlantModel::Simplified), fly(PlantModel::RigidBody));
            let of = |f: fn(&Motion) -> Vector3<f64>| (f(&a) - f(&b)).norm();
            of(|m| m.position_m) + of(|m| m.velocity_m_s) + of(|m| m.attitude_rad) + of(|m| m.rates_rad_s)
        };
        // In 0.2 s attitude and rates stay below about 3 times their initial values. The difference of attitudes stays
        // below their product over that time: 3 * 3 * 0.2 * 3 axes.
        let small = apart(1e-3);
        prop_assert!(small <= 6e-6, "{small:e} apart");
        // Second order: a tenth of the perturbation gives a hundredth of the difference, except for third-order terms.
        let smaller = apart(1e-4);
        prop_assert!(smaller <= 0.02 * small + 1e-12, "{small:e} and {smaller:e} apart");
    }

    /// At rest in the air both models give the same accelerations at any attitude: only their kinematics differ.
    #[test]
    fn the_models_share_their_forces(
        start in motion(),
        speeds in prop::array::uniform4(0.0_f64..500.0),
        a in vector(3.0),
        m in vector(3.0),
    ) {
        let load = Load::new(&Parameters::PAPER, speeds, a, m);
        let paper = simplified::derivative(&simplified::vector(&start), &load);
        let full = rigid_body::derivative(&rigid_body::vector(&start), &load);
        let scale = 4.0 * 500.0 * 500.0 * 2.984e-5 / 0.486;
        prop_assert!((paper.fixed_rows::<3>(3) - full.fixed_rows::<3>(3)).amax() <= 1e-14 * scale);
        prop_assert_eq!(paper.fixed_rows::<3>(9), full.fixed_rows::<3>(10));
    }
}

/// A rotation about body z at a constant rate is a yaw at that rate, beyond +-pi, for a minute.
#[test]
fn a_flat_spin_turns_evenly() {
    let rate = 2.0;
    let start = Motion { rates_rad_s: Vector3::new(0.0, 0.0, rate), ..Motion::default() };
    let mut plant = Plant::new(PlantModel::RigidBody, start, Environment::calm(Parameters::PAPER).unwrap());
    for step in 1..=60_000_u32 {
        plant.step(&RotorSpeeds::<4>::default(), DT_S);
        if step % 1000 == 0 {
            let yaw = rate * f64::from(step) * DT_S;
            let error = plant.motion().attitude_rad.z - yaw;
            let error = error - core::f64::consts::TAU * (error / core::f64::consts::TAU).round();
            // The integration error is (rate dt / 2)^5 / 120 = 8e-18 per step, so the rounding of 60000 steps
            // dominates.
            assert!(error.abs() < 1e-11, "{error:e} rad after {step} steps");
        }
    }
}

/// The rigid body pitches through 90 degrees, where Euler angles are singular, without an effect.
#[test]
fn pitching_through_90_degrees_is_nothing_special() {
    let start = Motion { rates_rad_s: Vector3::new(0.0, 3.0, 0.0), ..Motion::default() };
    let mut plant = Plant::new(PlantModel::RigidBody, start, Environment::calm(Parameters::PAPER).unwrap());
    for step in 1..=2000_u32 {
        plant.step(&RotorSpeeds::<4>::default(), DT_S);
        let angle = 3.0 * f64::from(step) * DT_S;
        let m = plant.motion();
        let body_z = r_earth_body(&m.attitude_rad).column(2).into_owned();
        // asin loses half of the digits at 90 degrees.
        assert!((body_z - Vector3::new(angle.sin(), 0.0, angle.cos())).norm() < 1e-7, "{body_z} at {angle} rad");
        assert_eq!(m.rates_rad_s, start.rates_rad_s);
    }
}

/// Halving the step divides the method's error by 16.
#[test]
fn the_integrator_is_of_fourth_order() {
    // The equations are a linear oscillator, and dx/dt = -x^2 with the solution x(t) = 1/(1 + t).
    let linear = |x: &SVector<f64, 2>| SVector::from([x[1], -x[0]]);
    let nonlinear = |x: &SVector<f64, 1>| SVector::from([-x[0] * x[0]]);
    let errors = |steps: u32| {
        let h = 1.0 / f64::from(steps);
        let swing = (0..steps).fold(SVector::from([1.0, 0.0]), |x, _| rk4(linear, &x, h));
        let decay = (0..steps).fold(SVector::from([1.0]), |x, _| rk4(nonlinear, &x, h));
        [(swing - SVector::from([1.0_f64.cos(), -1.0_f64.sin()])).norm(), (decay[0] - 0.5).abs()]
    };
    let (coarse, fine) = (errors(20), errors(40));
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        let order = (coarse / fine).log2();
        assert!((3.9..4.1).contains(&order), "order {order}: {coarse:e}, then {fine:e}");
    }
}

/// The method's error is also divided by 16 for the vehicle with constant rotor speeds, during one second of tumbling.
#[test]
fn the_vehicle_is_integrated_to_fourth_order() {
    let start = Motion {
        rates_rad_s: Vector3::new(2.0, -1.0, 0.5),
        attitude_rad: Vector3::new(0.2, 0.1, -0.3),
        ..Motion::default()
    };
    let speeds = RotorSpeeds(Vector4::new(200.0, 202.0, 201.0, 199.0));
    for model in [PlantModel::Simplified, PlantModel::RigidBody] {
        let end = |steps: u32| {
            let mut plant = Plant::new(model, start, Environment::calm(Parameters::PAPER).unwrap());
            (0..steps).for_each(|_| plant.step(&speeds, 0.5 / f64::from(steps)));
            plant.motion()
        };
        let apart =
            |a: Motion, b: Motion| (a.attitude_rad - b.attitude_rad).norm() + (a.position_m - b.position_m).norm();
        let order = (apart(end(25), end(50)) / apart(end(50), end(100))).log2();
        assert!((3.7..4.3).contains(&order), "{}: order {order}", model.name());
    }
}
