//! Desired roll and pitch point the thrust along the acceleration, and their derivatives agree with finite differences
//! in double precision.

use afbc::tilt::Tilt;
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

/// Returns roll and pitch of a thrust along `a` with this yaw, by rotating `a` into the plane of the heading.
fn angles(a: &Vector3<f64>, yaw_rad: f64) -> [f64; 2] {
    let a = Rotation3::from_axis_angle(&Vector3::z_axis(), -yaw_rad) * a;
    [(-a.y).atan2(a.x.hypot(a.z)), a.x.atan2(a.z)]
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

proptest! {
    #[test]
    fn derivatives_are_those_of_finite_differences(
        across in vector(12.0), jerk in vector(15.0), snap in vector(40.0),
        yaw in -3.0..3.0_f64, turn in -2.0..2.0_f64, turn_dot in -5.0..5.0_f64,
    ) {
        let force = Vector3::new(across.x, across.y, 9.81 + 0.4 * across.z);
        // Path through these derivatives at t = 0.
        let at = |t: f64| {
            let a = force + jerk * t + snap * (0.5 * t * t);
            angles(&a, yaw + turn * t + 0.5 * turn_dot * t * t)
        };
        let dt = 1e-4;
        let [before, now, after] = [at(-dt), at(0.0), at(dt)];
        let psi = [yaw.sin() as f32, yaw.cos() as f32];
        let tilt = Tilt::new(force.x as f32, force.y as f32, psi, (1.0 / force.z) as f32);
        let [rates, accelerations] = tilt.turned(&jerk.cast(), &snap.cast(), [turn as f32, turn_dot as f32]);
        for i in 0..2 {
            let rate = (after[i] - before[i]) / (2.0 * dt);
            let acceleration = (after[i] - 2.0 * now[i] + before[i]) / (dt * dt);
            let near = |is: f32, should: f64, scale: f64| (f64::from(is) - should).abs() < 1e-3 * (1.0 + scale);
            prop_assert!(near(tilt.rad[i], now[i], 1.0), "{i}: {} {}", tilt.rad[i], now[i]);
            prop_assert!(near(rates[i], rate, rate.abs()), "{i}: {} {rate}", rates[i]);
            let scale = acceleration.abs() + 10.0;
            prop_assert!(near(accelerations[i], acceleration, scale), "{i}: {} {acceleration}", accelerations[i]);
        }
    }
}
