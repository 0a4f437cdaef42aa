//! Compares attitude and thrust setpoints with rotation matrices in double precision.

use super::*;
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

const G: f32 = 9.81;

fn vector(most: f32) -> impl Strategy<Value = Vector3<f32>> {
    (-most..most, -most..most, -most..most).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn lift(most: f32) -> AvailableThrust {
    AvailableThrust { most_m_s2: most, gravity_m_s2: G, given_m_s2: None }
}

proptest! {
    /// The computed tilt matches the direction of the thrust.
    #[test]
    fn the_tilt_is_that_of_the_thrust(roll in -1.2..1.2f32, pitch in -1.2..1.2f32, yaw in -3.1..3.1f32) {
        let up = Rotation3::from_euler_angles(f64::from(roll), f64::from(pitch), f64::from(yaw)) * Vector3::z();
        let expected = up.xy() / up.z.max(0.2);
        let found = tilt(&Vector3::new(roll, pitch, yaw)).map(f64::from);
        // The crate's sines are accurate to 1e-4.
        prop_assert!((found - expected).norm() < 1e-3 * (1.0 + expected.norm()), "{found:?}, not {expected:?}");
    }

    /// The acceleration is thrust minus gravity, with the thrust limited to the rotors' range. The rest is the
    /// vehicle's own.
    #[test]
    fn a_setpoint_is_thrust_less_gravity(
        position_m in vector(9.0), velocity_m_s in vector(3.0), yaw in -3.0..3.0f32, up in vector(1.0),
        thrust in -5.0..30.0f32,
        most in -1.0..25.0f32,
    ) {
        prop_assume!(up.norm() > 0.1);
        let attitude_rad = Vector3::new(0.1, 0.2, yaw);
        let state = State { position_m, velocity_m_s, attitude_rad, ..State::default() };
        let up = up.normalize();
        let setpoint = lift(most).setpoint(&state, up, thrust);
        let given = thrust.min(most).max(0.0);
        let acceleration = up * given - Vector3::z() * G;
        prop_assert!((setpoint.acceleration_m_s2 - acceleration).norm() < 1e-4);
        let expected = Setpoint {
            position_m, velocity_m_s, yaw_rad: yaw, acceleration_m_s2: setpoint.acceleration_m_s2, ..Setpoint::default()
        };
        prop_assert_eq!(setpoint, expected);
    }

    /// The vertical acceleration is limited to that which reaches the limit of climb or sink rate in 0.25 s. The tilt
    /// stays the same, unless too little vertical thrust is left to compute it. The horizontal acceleration never
    /// grows.
    #[test]
    fn climb_and_sink_rate_are_limited(
        acceleration in vector(15.0), climb in -6.0..6.0f32, up in 0.5..4.0f32, down in 0.5..4.0f32,
        most in 1.0..30.0f32,
    ) {
        let limits = MotionLimits { up_m_s: up, down_m_s: down, ..MotionLimits::DEFAULT };
        let state = State { velocity_m_s: Vector3::new(1.0, 2.0, climb), ..State::default() };
        let setpoint = Setpoint { acceleration_m_s2: acceleration, yaw_rad: 0.4, ..Setpoint::default() };
        let found = lift(most).limited(&setpoint, &state, &limits);
        let least = ((-down - climb) * 4.0).min(most);
        let within = acceleration.z.clamp(least, least.max((up - climb) * 4.0));
        let rest = Setpoint { acceleration_m_s2: acceleration, ..found };
        prop_assert_eq!(rest, setpoint);
        if (within - acceleration.z).abs() < 1e-4 {
            prop_assert!((found.acceleration_m_s2 - acceleration).norm() < 1e-2);
            return Ok(());
        }
        let (was, is) = (acceleration.z + G, (within + G).max(0.0));
        let share = (is / was.max(0.2 * G)).min(1.0);
        let expected = Vector3::new(acceleration.x * share, acceleration.y * share, is - G);
        prop_assert!((found.acceleration_m_s2 - expected).norm() < 1e-3, "{found:?}, not {expected:?}");
    }

    /// The correction integrates the errors of tilt and thrust, each within its limit.
    #[test]
    fn a_trim_integrates_what_is_lacking(
        steps in prop::collection::vec(
            (vector(4.0), -0.6..0.6f32, -0.6..0.6f32, -3.0..3.0f32, prop::option::of(0.0..25.0f32)), 1..60,
        ),
        dt_s in prop_oneof![Just(1e-3f32), 0.005..0.09f32, Just(0.2f32)],
    ) {
        let mut trim = AccelerationTrim::default();
        let (mut expected, mut sideways, mut upwards) = (None, nalgebra::Vector2::<f64>::zeros(), 0.0_f64);
        let (dt, mut errors) = (f64::from(dt_s), 0.0);
        for (acceleration_m_s2, roll, pitch, yaw, given_m_s2) in steps {
            let attitude_rad = Vector3::new(roll, pitch, yaw);
            let state = State { attitude_rad, ..State::default() };
            let setpoint = Setpoint { acceleration_m_s2, yaw_rad: 0.4, ..Setpoint::default() };
            let found = trim.advance(&AvailableThrust { given_m_s2, ..lift(20.0) }, &state, &setpoint, dt_s);

            let thrust = acceleration_m_s2.map(f64::from) + Vector3::z() * f64::from(G);
            let vertical = thrust.z.max(0.2 * f64::from(G));
            let up = Rotation3::from_euler_angles(f64::from(roll), f64::from(pitch), f64::from(yaw)) * Vector3::z();
            let tilt = up.xy() / up.z;
            let before = expected.unwrap_or(tilt);
            let follows = before + (thrust.xy() / vertical - before) * (dt / 0.1).min(1.0);
            expected = Some(follows);
            sideways += (follows - tilt) * (vertical * dt / 0.3);
            if sideways.norm() > 5.0 {
                sideways = sideways.normalize() * 5.0;
            }
            let lacks = given_m_s2.map_or(0.0, |given| thrust.norm() - f64::from(given));
            upwards = (upwards + lacks * dt / 0.2).clamp(-5.0, 5.0);
            let corrected = acceleration_m_s2.map(f64::from) + Vector3::new(sideways.x, sideways.y, upwards);
            let off = found.acceleration_m_s2.map(f64::from) - corrected;
            // The errors of the sines accumulate.
            errors += 1e-3 * (1.0 + vertical * dt / 0.3);
            prop_assert!(off.norm() < errors, "{found:?}, not {corrected:?}");
            prop_assert_eq!(Setpoint { acceleration_m_s2, ..found }, setpoint);
        }
    }
}

#[test]
fn rotors_are_exhausted_near_their_most() {
    let gives = |given_m_s2| AvailableThrust { given_m_s2, ..lift(20.0) }.is_exhausted();
    assert!(gives(Some(18.1)) && !gives(Some(17.9)) && !gives(Some(0.0)) && !gives(None));
}
