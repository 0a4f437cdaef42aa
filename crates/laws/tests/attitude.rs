//! Compares attitudes, attitude errors and rates with formulas in `f64`.

use crate::harness::Random;
use crate::harness::steps::{euler, vector};
use afbc_laws::attitude::{facing, geometric_error, quaternion, r_earth_body, roll_pitch, tilt_prioritised_error};
use afbc_laws::flatness::flat;
use afbc_laws::geometric;
use afbc_types::Setpoint;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

/// Returns R = Rz Ry Rx in `f64`, from angles that an `f32` state can hold.
fn exact(eta: &Vector3<f32>) -> Matrix3<f64> {
    *Rotation3::from_euler_angles(f64::from(eta.x), f64::from(eta.y), f64::from(eta.z)).matrix()
}

#[test]
fn attitude_errors_agree_with_their_formulas() {
    let mut random = Random(2);
    for _ in 0..2000 {
        let eta = euler(&Rotation3::from_scaled_axis(vector(&mut random, 1.5)));
        let thrust = Vector3::new(0.0, 0.0, 9.81) + vector(&mut random, 5.0);
        let yaw = vector(&mut random, 3.0).x;
        let r = r_earth_body(&eta);
        assert!((r.cast() - exact(&eta)).amax() < 3e-3);

        // R_d by its definition: z along the thrust, x perpendicular to the left of the heading.
        let desired = facing(&thrust.cast(), yaw as f32);
        let z = thrust.normalize();
        let x = Vector3::new(-yaw.sin(), yaw.cos(), 0.0).cross(&z).normalize();
        let r_d = Matrix3::from_columns(&[x, z.cross(&x), z]);
        assert!((desired.cast() - r_d).amax() < 3e-3);
        let [roll, pitch] = roll_pitch(&desired);
        let angles = Rotation3::from_matrix_unchecked(r_d).euler_angles();
        assert!((f64::from(roll) - angles.0).abs() < 3e-3 && (f64::from(pitch) - angles.1).abs() < 3e-3);
        assert!((angles.2 - yaw).abs() < 1e-9, "the yaw of R_d is psi_d");

        // Lee: e_R = (R_d' R - R' R_d)^v / 2, positive for a body turned too far.
        let e = r_d.transpose() * exact(&eta) - exact(&eta).transpose() * r_d;
        let e_r = Vector3::new(e[(2, 1)], e[(0, 2)], e[(1, 0)]) / 2.0;
        let ours = -geometric_error(&r, &desired).cast::<f64>();
        assert!((ours - e_r).amax() < 6e-3, "{ours:?} {e_r:?}");
    }
}

#[test]
fn the_tilt_comes_first_and_yaw_by_its_weight() {
    let mut random = Random(3);
    for _ in 0..2000 {
        let r = Rotation3::from_scaled_axis(vector(&mut random, 1.5));
        let r_d = Rotation3::from_scaled_axis(vector(&mut random, 1.5));
        let (a, b) = (r.matrix().cast(), r_d.matrix().cast());
        // The expected error consists of the shortest rotation of the thrust, then the remaining rotation about the
        // thrust.
        let (z, z_d) = (r * Vector3::z(), r_d * Vector3::z());
        let tilt = Rotation3::rotation_between(&z, &z_d).unwrap();
        let left: Rotation3<f64> = (tilt * r).inverse() * r_d;
        let half_yaw = left.scaled_axis().z / 2.0;
        for weight in [0.05, 0.4, 1.0] {
            let turned = tilt * r * Rotation3::from_axis_angle(&Vector3::z_axis(), 2.0 * weight * half_yaw);
            let q = nalgebra::UnitQuaternion::from_rotation_matrix(&(r.inverse() * turned));
            let q = if q.w < 0.0 { -q.into_inner() } else { q.into_inner() };
            let ours = tilt_prioritised_error(&a, &b, weight as f32).cast::<f64>();
            // At half a turn of yaw, rounding decides the direction.
            if half_yaw.abs() < 1.5 {
                assert!((ours - q.imag() * 2.0).amax() < 6e-3, "{ours:?} {q:?}");
            }
        }
    }
    // The thrusts are opposite, with different axes between them.
    for axis in [Vector3::x_axis(), Vector3::y_axis(), Unit::new_normalize(Vector3::new(1.0, 2.0, 0.0))] {
        let upside_down = Rotation3::from_axis_angle(&axis, core::f32::consts::PI);
        let e = tilt_prioritised_error(&Matrix3::identity(), upside_down.matrix(), 0.4);
        assert!((e.norm() - 2.0).abs() < 1e-3, "{e:?}");
    }
}

#[test]
fn quaternions_match_their_matrices() {
    let mut random = Random(4);
    for _ in 0..5000 {
        let r = Rotation3::from_scaled_axis(vector(&mut random, core::f64::consts::PI));
        let q = quaternion(&r.matrix().cast()).cast::<f64>();
        let back = nalgebra::UnitQuaternion::from_quaternion(q).to_rotation_matrix();
        assert!((back.matrix() - r.matrix()).amax() < 2e-6 && q.w >= 0.0);
    }
}

#[test]
fn desired_rates_are_the_derivative_of_the_desired_attitude() {
    // Specific force and heading change. The desired attitude R_d is differentiated in f64, and the desired rates are
    // Omega_d = (R_d' dR_d/dt)^v.
    for [size, pace] in [[1.0, 1.0], [2.5, 1.0], [2.5, 2.5]] {
        rates_of([size, pace]);
    }
}

/// Checks the rates for specific forces of this size and pace.
fn rates_of([size, pace]: [f64; 2]) {
    let force = |t: f64| {
        let t = pace * t;
        Vector3::new(2.0 * size * (1.3 * t).sin(), 1.5 * size * (0.9 * t).cos(), 9.81 + size * (0.7 * t).sin())
    };
    let yaw = |t: f64| 0.8 * (0.5 * t).sin();
    let attitude = |t: f64| {
        let z = force(t).normalize();
        let x = Vector3::new(-yaw(t).sin(), yaw(t).cos(), 0.0).cross(&z).normalize();
        Matrix3::from_columns(&[x, z.cross(&x), z])
    };
    let rates = |t: f64| {
        let h = 1e-5;
        let w = attitude(t).transpose() * (attitude(t + h) - attitude(t - h)) / (2.0 * h);
        Vector3::new(w[(2, 1)], w[(0, 2)], w[(1, 0)])
    };
    let derivative = |f: &dyn Fn(f64) -> Vector3<f64>, t: f64| (f(t + 1e-4) - f(t - 1e-4)) / 2e-4;
    for step in 0..100 {
        let t = 0.13 * f64::from(step);
        let force_dot = |t: f64| derivative(&force, t);
        let setpoint = Setpoint {
            yaw_rad: yaw(t) as f32,
            yaw_rate_rad_s: (0.4 * (0.5 * t).cos()) as f32,
            yaw_acceleration_rad_s2: (-0.2 * (0.5 * t).sin()) as f32,
            ..Setpoint::default()
        };
        let s = [force(t).cast(), force_dot(t).cast(), derivative(&force_dot, t).cast()];
        let desired = geometric::desired(s, &setpoint);
        let (omega, omega_dot) = (rates(t), derivative(&rates, t));
        let error = (desired.rates_rad_s.cast::<f64>() - omega).amax();
        assert!(error < 2e-3 * omega.norm().max(1.0), "{desired:?} {omega:?}");
        // With the products of rates only the sine error remains.
        let exact = flat(s, &setpoint);
        let same = (exact.r_earth_desired, exact.rates_rad_s) == (desired.r_earth_desired, desired.rates_rad_s);
        assert!(same, "{exact:?} {desired:?}");
        let error = (exact.rates_dot_rad_s2.cast::<f64>() - omega_dot).amax();
        assert!(error < 4e-3 * (1.0 + omega_dot.norm() + omega.norm_squared()), "{error} of {omega_dot:?} {omega:?}");
        // The neglected part is of second order in the rates.
        let (left_out, speed) = ((desired.rates_dot_rad_s2.cast::<f64>() - omega_dot).amax(), omega.norm());
        assert!(left_out < 5e-3 + 3.0 * speed * (speed + force_dot(t).norm() / 9.81), "{left_out} at {speed}");
    }
}
