//! Conversion between frames, compared with known attitudes and with `f64` rotation matrices.

use afbc_mavlink::frames::{Odometry, flip};
use afbc_types::State;
use core::f32::consts::{FRAC_PI_2, PI};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Returns Rz(psi) Ry(theta) Rx(phi) in `f64`, from the definition in `afbc-types`.
fn r_earth_body(attitude: &Vector3<f32>) -> Matrix3<f64> {
    let [phi, theta, psi] = attitude.map(f64::from).into();
    let about = |axis, angle| *Rotation3::from_axis_angle(&axis, angle).matrix();
    about(Vector3::z_axis(), psi) * about(Vector3::y_axis(), theta) * about(Vector3::x_axis(), phi)
}

fn rotation_of(q: &Quaternion<f32>) -> Matrix3<f64> {
    *UnitQuaternion::from_quaternion(q.cast()).to_rotation_matrix().matrix()
}

/// Returns a state at rest at the origin with this attitude.
fn with_attitude(attitude: [f32; 4]) -> Odometry {
    let zero = Vector3::zeros();
    Odometry { position_m: zero, attitude, velocity_m_s: zero, rates_rad_s: zero }
}

#[test]
fn known_attitudes() {
    let half = core::f32::consts::FRAC_1_SQRT_2;
    // Each case has the quaternion as sent, its meaning, and roll, pitch and yaw in the workspace's frames.
    let cases = [
        ([1.0, 0.0, 0.0, 0.0], "level, nose north", [0.0, 0.0, 0.0]),
        ([half, 0.0, 0.0, half], "nose east: to the right", [0.0, 0.0, -FRAC_PI_2]),
        ([half, half, 0.0, 0.0], "right side down", [FRAC_PI_2, 0.0, 0.0]),
        ([half, 0.0, half, 0.0], "nose up: negative pitch in the workspace", [0.0, -FRAC_PI_2, 0.0]),
        ([-1.0, 0.0, 0.0, 0.0], "level, the other sign", [0.0, 0.0, 0.0]),
        ([0.0, 0.0, 0.0, 1.0], "nose south", [0.0, 0.0, PI]),
    ];
    for (attitude, meaning, expected) in cases {
        let state = with_attitude(attitude).to_state().expect(meaning);
        let [roll, pitch, yaw] = state.attitude_rad.into();
        assert!((r_earth_body(&state.attitude_rad) - r_earth_body(&expected.into())).amax() < 1e-6, "{meaning}");
        assert!(roll.abs() <= PI && pitch.abs() <= FRAC_PI_2 && yaw.abs() <= PI, "{meaning}");
    }
}

#[test]
fn positive_pitch_of_ours_tilts_the_thrust_forwards() {
    let state = State { attitude_rad: Vector3::new(0.0, 0.1, 0.0), ..State::default() };
    let thrust_earth = r_earth_body(&state.attitude_rad) * Vector3::z();
    assert!(thrust_earth.x > 0.0);
    // On the wire the nose is down: the body's x axis has a component along positive z (down).
    let [w, x, y, z] = Odometry::from_state(&state).attitude;
    assert!((rotation_of(&Quaternion::new(w, x, y, z)) * Vector3::x()).z > 0.0);
}

#[test]
fn velocity_is_in_the_child_frame() {
    // The vehicle's nose points east. It flies forward at 1 m/s and sinks at 2 m/s, which is along -y and -z in the
    // workspace's frame.
    let half = core::f32::consts::FRAC_1_SQRT_2;
    let mut odometry = with_attitude([half, 0.0, 0.0, half]);
    odometry.velocity_m_s = Vector3::new(1.0, 0.0, 2.0);
    odometry.position_m = Vector3::new(1.0, 2.0, 3.0);
    odometry.rates_rad_s = Vector3::new(0.1, 0.2, 0.3);
    let state = odometry.to_state().expect("plausible");
    assert!((state.velocity_m_s - Vector3::new(0.0, -1.0, -2.0)).amax() < 1e-6);
    assert_eq!(state.position_m, Vector3::new(1.0, -2.0, -3.0));
    assert_eq!(state.rates_rad_s, Vector3::new(0.1, -0.2, -0.3));
}

#[test]
fn hover_is_exact() {
    let state = State { position_m: Vector3::new(1.5, -2.0, 3.25), ..State::default() };
    assert_eq!(Odometry::from_state(&state).to_state(), Some(state));
}

#[test]
fn what_is_no_rotation_is_refused() {
    for attitude in [[0.0; 4], [1.2, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0, 0.0], [f32::MAX; 4]] {
        assert_eq!(with_attitude(attitude).to_state(), None, "{attitude:?}");
    }
    let mut infinite = with_attitude([1.0, 0.0, 0.0, 0.0]);
    infinite.velocity_m_s.x = f32::INFINITY;
    assert_eq!(infinite.to_state(), None);
    let mut far = with_attitude([1.0, 0.0, 0.0, 0.0]);
    far.position_m.y = 2e5;
    assert_eq!(far.to_state(), None);
}

/// Returns the largest rounding error of a velocity that is rotated into the body frame and back \[m/s\].
///
/// The rotation `v + 2w(q x v) + 2q x (q x v)` rounds about ten times, each by at most half of EPSILON times the speed.
/// Twice as much comes from |q|, which is 1 within two roundings and enters squared. In total, 8 EPSILON times the
/// speed per rotation.
fn rotated_twice(state: &State) -> f32 {
    16.0 * f32::EPSILON * state.velocity_m_s.norm()
}

/// `states_survive_the_link` found this state when its bound was an absolute number.
#[test]
fn a_fast_state_survives_the_link() {
    let state = State {
        velocity_m_s: Vector3::new(-18.270386, -17.043652, 18.831186),
        attitude_rad: Vector3::new(-0.48733982, -0.8878281, -2.867579),
        ..State::default()
    };
    let crossed = Odometry::from_state(&state).to_state().expect("plausible");
    let error = (crossed.velocity_m_s - state.velocity_m_s).amax();
    assert!(error > 2e-5 && error <= rotated_twice(&state), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Conversion to the wire and back changes a state only by rounding.
    #[test]
    fn states_survive_the_link(
        position in prop::array::uniform3(-1e3f32..1e3),
        velocity in prop::array::uniform3(-20.0f32..20.0),
        attitude in (-3.1f32..3.1, -1.5f32..1.5, -3.1f32..3.1),
        rates in prop::array::uniform3(-20.0f32..20.0),
    ) {
        let state = State {
            position_m: position.into(),
            velocity_m_s: velocity.into(),
            attitude_rad: Vector3::new(attitude.0, attitude.1, attitude.2),
            rates_rad_s: rates.into(),
        };
        let crossed = Odometry::from_state(&state).to_state().expect("plausible");
        prop_assert_eq!(crossed.position_m, state.position_m);
        prop_assert_eq!(crossed.rates_rad_s, state.rates_rad_s);
        prop_assert!((crossed.velocity_m_s - state.velocity_m_s).amax() <= rotated_twice(&state));
        prop_assert!((r_earth_body(&crossed.attitude_rad) - r_earth_body(&state.attitude_rad)).amax() < 2e-6);
    }

    #[test]
    fn flipping_twice_changes_nothing(v in prop::array::uniform3(-1e5f32..1e5)) {
        let v = Vector3::from(v);
        prop_assert_eq!(flip(flip(v)), v);
        prop_assert_eq!(flip(v).cross(&flip(Vector3::x())), flip(v.cross(&Vector3::x())), "a rotation, no mirror");
    }
}
