//! Compares the attitude errors by rotation with quaternions and finite differences in double precision.

use afbc::model::RollPitch;
use afbc::rotation::{AttitudeTracking, error};
use afbc_types::State;
use nalgebra::{Matrix3, Rotation3, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Draws roll, pitch and yaw within the flown range.
fn attitude() -> impl Strategy<Value = Vector3<f64>> {
    (-1.2_f64..1.2, -1.2_f64..1.2, -3.0_f64..3.0).prop_map(|(roll, pitch, yaw)| Vector3::new(roll, pitch, yaw))
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn quaternion(eta: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(eta.x, eta.y, eta.z)
}

fn matrix(q: &UnitQuaternion<f64>) -> Matrix3<f32> {
    q.to_rotation_matrix().matrix().cast()
}

fn roll_pitch(eta: &Vector3<f64>) -> RollPitch {
    RollPitch::new(&State { attitude_rad: eta.cast(), ..State::default() })
}

fn heading(eta: &Vector3<f64>) -> [f32; 2] {
    [eta.z.sin() as f32, eta.z.cos() as f32]
}

/// Returns Omega for angles that change at `eta_dot`, from the change of the attitude within `h` seconds.
fn turning(eta: &Vector3<f64>, eta_dot: &Vector3<f64>, h: f64) -> Vector3<f64> {
    let at = |t: f64| quaternion(&(eta + eta_dot * t));
    (at(-h).inverse() * at(h)).scaled_axis() / (2.0 * h)
}

proptest! {
    /// A tilt about any horizontal axis and a following turn about the thrust are separated.
    #[test]
    fn tilt_and_yaw_are_distinguished(direction in -3.1_f64..3.1, tilt in 0.0_f64..2.8, yaw in -2.8_f64..2.8) {
        let axis = Vector3::new(direction.cos(), direction.sin(), 0.0);
        let q = UnitQuaternion::from_scaled_axis(axis * tilt) * UnitQuaternion::from_scaled_axis(Vector3::z() * yaw);
        let expected = axis * (2.0 * (0.5 * tilt).sin()) + Vector3::z() * (2.0 * (0.5 * yaw).sin());
        let found = error(&matrix(&q)).cast::<f64>();
        prop_assert!((found - expected).norm() < 3e-5, "{found:?}, not {expected:?}");
    }

    /// A small error is the rotation vector in body axes.
    #[test]
    fn a_small_error_is_the_rotation(eta in attitude(), by in vector(0.02)) {
        let body = quaternion(&eta);
        let desired = body * UnitQuaternion::from_scaled_axis(by);
        let found = error(&matrix(&(body.inverse() * desired))).cast::<f64>();
        prop_assert!((found - by).norm() < 0.6 * by.norm_squared() + 1e-6, "{found:?}, not {by:?}");
    }

    /// No error exceeds 2 along an axis, for any rotation.
    #[test]
    fn an_error_is_bounded(axis in vector(1.0), angle in -6.3_f64..6.3) {
        prop_assume!(axis.norm() > 1e-3);
        let r = Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle);
        let found = error(&r.matrix().cast());
        prop_assert!(found.iter().all(|e| e.abs() <= 2.0005), "{found:?}");
    }

    /// The desired rates and accelerations match the motion of the desired attitude, in the axes of a turning body.
    #[test]
    fn rates_and_accelerations_are_those_of_the_desired_attitude(
        now in attitude(),
        desired in attitude(),
        omega in vector(4.0),
        eta_dot in vector(3.0),
        eta_ddot in vector(10.0),
    ) {
        let turn = AttitudeTracking::new(
            &matrix(&quaternion(&now)),
            &roll_pitch(&desired),
            heading(&desired),
            &omega.cast(),
            [&eta_dot.cast(), &eta_ddot.cast()],
        );
        // Rates of the desired attitude in body axes at time t.
        let seen = |t: f64| {
            let (eta, rate) = (desired + eta_dot * t + eta_ddot * (0.5 * t * t), eta_dot + eta_ddot * t);
            let body = quaternion(&now) * UnitQuaternion::from_scaled_axis(omega * t);
            body.inverse() * (quaternion(&eta) * turning(&eta, &rate, 1e-5))
        };
        let rates = seen(0.0);
        prop_assert!((turn.rates.cast() - rates).norm() < 2e-3 * (1.0 + rates.norm()), "{:?} {rates:?}", turn.rates);
        let accelerations = (seen(1e-4) - seen(-1e-4)) / 2e-4;
        let found = turn.accelerations.cast::<f64>();
        let scale = 1.0 + accelerations.norm() + omega.norm() * eta_dot.norm();
        prop_assert!((found - accelerations).norm() < 3e-3 * scale, "{found:?}, not {accelerations:?}");
    }

    /// Close to the desired attitude, e_1 changes by the difference of desired and body rates.
    #[test]
    fn a_small_error_changes_as_the_rates_differ(
        desired in attitude(),
        by in vector(0.01),
        omega in vector(2.0),
        eta_dot in vector(2.0),
    ) {
        let body = quaternion(&desired) * UnitQuaternion::from_scaled_axis(-by);
        let angles = body.euler_angles();
        let now = Vector3::new(angles.0, angles.1, angles.2);
        prop_assume!(now.y.abs() < 1.3);
        let turn = AttitudeTracking::new(
            &matrix(&quaternion(&now)),
            &roll_pitch(&desired),
            heading(&desired),
            &omega.cast(),
            [&eta_dot.cast(), &Vector3::zeros()],
        );
        let error_at = |t: f64| {
            let body = body * UnitQuaternion::from_scaled_axis(omega * t);
            (body.inverse() * quaternion(&(desired + eta_dot * t))).scaled_axis()
        };
        let change = (error_at(1e-4) - error_at(-1e-4)) / 2e-4;
        let expected = turn.rates.cast::<f64>() - omega;
        prop_assert!((change - expected).norm() < 0.03 * (1.0 + expected.norm()), "{change:?}, not {expected:?}");
    }
}
