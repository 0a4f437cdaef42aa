//! Compares quaternions with Euler angles, with `f64` rotation matrices as the reference.
#![allow(clippy::expect_used, missing_docs, reason = "a test that cannot go on should say why")]

use afbc_types::State;
use core::f32::consts::{FRAC_PI_2, PI};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Returns Rz(psi) Ry(theta) Rx(phi) from the definition in the crate's conventions, in `f64`.
fn r_earth_body(attitude: &Vector3<f32>) -> Matrix3<f64> {
    let [phi, theta, psi] = attitude.map(f64::from).into();
    let about = |axis, angle| *Rotation3::from_axis_angle(&axis, angle).matrix();
    about(Vector3::z_axis(), psi) * about(Vector3::y_axis(), theta) * about(Vector3::x_axis(), phi)
}

fn rotation_of(q: &Quaternion<f32>) -> Matrix3<f64> {
    *UnitQuaternion::from_quaternion(q.cast()).to_rotation_matrix().matrix()
}

/// Returns a state at rest at the origin.
fn with_attitude(attitude: &Quaternion<f32>) -> Option<State> {
    State::from_quaternion(Vector3::zeros(), Vector3::zeros(), attitude, Vector3::zeros())
}

/// The conventions in numbers: w comes first, angles are right-handed, x is forward, y left, z up.
#[test]
fn known_attitudes() {
    let half = core::f32::consts::FRAC_1_SQRT_2;
    let cases = [
        (Quaternion::new(1.0, 0.0, 0.0, 0.0), [0.0, 0.0, 0.0]),
        (Quaternion::new(half, half, 0.0, 0.0), [FRAC_PI_2, 0.0, 0.0]),
        (Quaternion::new(half, 0.0, 0.0, half), [0.0, 0.0, FRAC_PI_2]),
        (Quaternion::new(0.0, 1.0, 0.0, 0.0), [PI, 0.0, 0.0]),
        (Quaternion::new(0.5, 0.5, 0.5, 0.5), [FRAC_PI_2, 0.0, FRAC_PI_2]),
    ];
    for (attitude, expected) in cases {
        for sign in [1.0, -1.0] {
            let angles = with_attitude(&(attitude * sign)).expect("a rotation").attitude_rad;
            // Half a turn is the same in both directions.
            let apart = (angles - Vector3::from(expected)).map(|angle| angle.abs().min((angle.abs() - 2.0 * PI).abs()));
            assert!(apart.amax() < 1e-6, "{attitude}: {angles}");
        }
    }
    // Nose down: the thrust tilts to +x.
    let state = with_attitude(&Quaternion::new(0.1_f32.cos(), 0.0, 0.1_f32.sin(), 0.0)).expect("a rotation");
    assert!((state.attitude_rad.y - 0.2).abs() < 1e-6);
    assert!((state.quaternion() * Vector3::z()).x > 0.0);
}

#[test]
fn what_is_not_a_rotation_is_rejected() {
    let f = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1.2, 0.9, 0.5, 0.0, 1e-30];
    for value in f {
        let mut attitudes = vec![Quaternion::new(value, 0.0, 0.0, 0.0), Quaternion::new(0.0, 0.0, value, 0.0)];
        if !value.is_finite() {
            attitudes.push(Quaternion::new(1.0, value, 0.0, 0.0));
            attitudes.push(Quaternion::new(1.0, 0.0, 0.0, value));
        }
        for attitude in attitudes {
            assert_eq!(with_attitude(&attitude), None, "{attitude:?}");
        }
    }
    // A valid attitude does not excuse an implausible motion.
    let (zero, level) = (Vector3::zeros(), Quaternion::identity());
    for wrong in [f32::NAN, f32::INFINITY, 2e5] {
        let wrong = Vector3::new(0.0, wrong, 0.0);
        assert_eq!(State::from_quaternion(wrong, zero, &level, zero), None);
        assert_eq!(State::from_quaternion(zero, wrong, &level, zero), None);
        assert_eq!(State::from_quaternion(zero, zero, &level, wrong), None);
    }
}

/// Quaternions of norm 1; half of them within 1e-3 rad of a pitch of 90 degrees.
fn attitudes() -> impl Strategy<Value = Quaternion<f32>> {
    let any = prop::array::uniform4(-1.0f32..1.0)
        .prop_filter("not too short", |q| q.iter().map(|c| c * c).sum::<f32>() > 0.01)
        .prop_map(|[w, x, y, z]| Quaternion::new(w, x, y, z).normalize());
    let near_gimbal = (prop::bool::ANY, -1e-3f32..1e-3, -3.1f32..3.1, -3.1f32..3.1).prop_map(|(up, off, roll, yaw)| {
        let pitch = if up { FRAC_PI_2 } else { -FRAC_PI_2 } + off;
        let about = |axis, angle: f32| UnitQuaternion::from_axis_angle(&axis, f64::from(angle));
        let q = about(Vector3::z_axis(), yaw) * about(Vector3::y_axis(), pitch) * about(Vector3::x_axis(), roll);
        q.into_inner().cast()
    });
    prop_oneof![any, near_gimbal]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// The Euler angles are the same rotation as the quaternion at every attitude, and within their ranges.
    #[test]
    fn euler_angles_are_the_same_rotation(q in attitudes(), scale in 0.96f32..1.04) {
        let angles = with_attitude(&(q * scale)).expect("a rotation").attitude_rad;
        let difference = (r_earth_body(&angles) - rotation_of(&q)).amax();
        prop_assert!(difference < 2e-6, "{difference} at {angles}");
        prop_assert!(angles.x.abs() <= PI && angles.y.abs() <= FRAC_PI_2 && angles.z.abs() <= PI);
    }

    /// The quaternion is the same rotation as the Euler angles.
    #[test]
    fn quaternions_are_the_same_rotation(roll in -3.1f32..3.1, pitch in -1.57f32..1.57, yaw in -30.0f32..30.0) {
        let state = State { attitude_rad: Vector3::new(roll, pitch, yaw), ..State::default() };
        let difference = (rotation_of(&state.quaternion()) - r_earth_body(&state.attitude_rad)).amax();
        prop_assert!(difference < 2e-6, "{difference}");
    }

    /// A state converted to a quaternion and back is the same rotation, even close to a pitch of 90 degrees. Everything
    /// else is unchanged.
    #[test]
    fn states_survive_a_round_trip(
        q in attitudes(),
        position in prop::array::uniform3(-1e5f32..1e5),
        velocity in prop::array::uniform3(-1e3f32..1e3),
        rates in prop::array::uniform3(-1e3f32..1e3),
    ) {
        let from = |q: &Quaternion<f32>| State::from_quaternion(position.into(), velocity.into(), q, rates.into());
        let state = from(&q).expect("a plausible state");
        let again = from(&state.quaternion()).expect("a plausible state");
        prop_assert!((r_earth_body(&again.attitude_rad) - r_earth_body(&state.attitude_rad)).amax() < 4e-6);
        prop_assert_eq!(State { attitude_rad: state.attitude_rad, ..again }, state);
        prop_assert_eq!(
            (state.position_m, state.velocity_m_s, state.rates_rad_s),
            (position.into(), velocity.into(), rates.into())
        );
    }
}
