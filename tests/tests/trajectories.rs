//! Tests of reference trajectories: derivatives compared with finite differences, continuity, and shape.
#![allow(clippy::indexing_slicing, missing_docs)] // missing data must stop the test

use afbc_scenario::trajectory::{Reference, Sine, Trajectory, Waypoint};
use nalgebra::Vector3;
use proptest::prelude::*;

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn sine() -> impl Strategy<Value = Sine> {
    (-10.0_f64..10.0, 2.0_f64..60.0, -3.0_f64..3.0).prop_map(|(amplitude_m, period_s, phase_rad)| Sine {
        amplitude_m,
        period_s,
        phase_rad,
    })
}

fn waypoints() -> impl Strategy<Value = Vec<Waypoint>> {
    prop::collection::vec((0.5_f64..20.0, vector(20.0), -3.0_f64..3.0), 1..6).prop_map(|legs| {
        let mut time_s = 0.0;
        legs.into_iter()
            .map(|(length, position_m, yaw_rad)| {
                time_s += length;
                Waypoint { time_s, position_m, yaw_rad }
            })
            .collect()
    })
}

/// Draws smooth trajectories of every kind.
fn smooth() -> impl Strategy<Value = Trajectory> {
    prop_oneof![
        Just(Trajectory::Paper),
        (vector(10.0), -3.0_f64..3.0).prop_map(|(position_m, yaw_rad)| Trajectory::Hover { position_m, yaw_rad }),
        (vector(10.0), 0.0_f64..20.0, 2.0_f64..60.0, -3.0_f64..3.0).prop_map(
            |(centre_m, radius_m, period_s, yaw_rad)| Trajectory::Circle { centre_m, radius_m, period_s, yaw_rad }
        ),
        (vector(10.0), [sine(), sine(), sine()], -3.0_f64..3.0)
            .prop_map(|(centre_m, sines, yaw_rad)| Trajectory::Lissajous { centre_m, sines, yaw_rad }),
        waypoints().prop_map(Trajectory::Waypoints),
    ]
}

/// Returns \[x, y, z, yaw\] and their first and second derivatives.
fn orders(r: &Reference) -> [[f64; 4]; 3] {
    let four = |v: Vector3<f64>, yaw| [v.x, v.y, v.z, yaw];
    [
        four(r.position_m, r.yaw_rad),
        four(r.velocity_m_s, r.yaw_rate_rad_s),
        four(r.acceleration_m_s2, r.yaw_acceleration_rad_s2),
    ]
}

/// Returns the longest and the shortest time scale of the trajectory, for bounds on its derivatives.
fn pace(trajectory: &Trajectory) -> (f64, f64) {
    match trajectory {
        Trajectory::Paper => (60.0, 60.0),
        Trajectory::Hover { .. } | Trajectory::Step { .. } => (1.0, 1.0),
        Trajectory::Circle { period_s, .. } => (*period_s, *period_s),
        Trajectory::Lissajous { sines, .. } => {
            let periods = sines.map(|sine| sine.period_s);
            (periods.into_iter().fold(0.0, f64::max), periods.into_iter().fold(f64::INFINITY, f64::min))
        }
        Trajectory::Waypoints(waypoints) => {
            let legs = waypoints.windows(2).map(|pair| pair[1].time_s - pair[0].time_s);
            (legs.clone().fold(0.5, f64::max), legs.fold(20.0, f64::min))
        }
        // This test draws no polynomials. `crates/scenario/tests/paths.rs` tests them.
        Trajectory::Polynomials(_) => (1.0, 1.0),
    }
}

/// Returns acceleration, jerk and snap along x, y, z.
fn higher(r: &Reference) -> [Vector3<f64>; 3] {
    [r.acceleration_m_s2, r.jerk_m_s3, r.snap_m_s4]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn derivatives_are_those_of_the_position(trajectory in smooth(), t in 0.0_f64..80.0) {
        let h = 1e-4;
        if let Trajectory::Waypoints(waypoints) = &trajectory {
            // The third derivative jumps at a waypoint. The next test covers differences across it.
            prop_assume!(waypoints.iter().all(|waypoint| (waypoint.time_s - t).abs() > 2.0 * h));
        }
        let [back, here, ahead] = [t - h, t, t + h].map(|t| orders(&trajectory.at(t)));
        // Paths are up to 40 m long. With the shortest time T, the third derivative is at most 40 (2 pi / T)^3, or 60 *
        // 40 / T^3 for minimum jerk, and the fourth 360 * 40 / T^4 (or 40 (2 pi / T)^4). Differences have an error of
        // h^2/6 of these, and the rounding errors of 40 m and of times up to 80 s, divided by h.
        let shortest = pace(&trajectory).1;
        let third = 40.0 * 248.0 / shortest.powi(3);
        let fourth = 40.0 * 1559.0 / shortest.powi(4);
        let rounding = |speed: f64| 4.0 * f64::EPSILON * (40.0 + 80.0 * speed) / h;
        for axis in 0..4 {
            let rate = (ahead[0][axis] - back[0][axis]) / (2.0 * h);
            prop_assert!(
                (rate - here[1][axis]).abs() <= h * h / 6.0 * third + rounding(40.0 * 6.3 / shortest),
                "axis {axis}: {rate} for {}",
                here[1][axis]
            );
            let acceleration = (ahead[1][axis] - back[1][axis]) / (2.0 * h);
            prop_assert!(
                (acceleration - here[2][axis]).abs()
                    <= h * h / 6.0 * fourth + rounding(40.0 * 40.0 / (shortest * shortest)),
                "axis {axis}: {acceleration} for {}",
                here[2][axis]
            );
        }
    }

    /// Compares jerk and snap with fourth-order differences of the acceleration.
    #[test]
    fn jerk_and_snap_are_the_derivatives_of_the_acceleration(trajectory in smooth(), t in 0.0_f64..80.0) {
        let (shortest, h) = (pace(&trajectory).1, 1e-3 * pace(&trajectory).1);
        if let Trajectory::Waypoints(waypoints) = &trajectory {
            // The jerk jumps at a waypoint.
            prop_assume!(waypoints.iter().all(|waypoint| (waypoint.time_s - t).abs() > 3.0 * h));
        }
        let at = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| higher(&trajectory.at(t + k * h)));
        let [jerk, snap] = [0, 1].map(|order| {
            let [a, b, c, d] = [0, 1, 3, 4].map(|k: usize| at[k][order]);
            (a - d + (c - b) * 8.0) / (12.0 * h)
        });
        // Paths are up to 40 m long. Differences have an error of h^4/30 of the derivative five orders higher, and the
        // rounding errors of the value and of times up to 80 s, divided by h. A derivative of order n is at most 40 (2
        // pi / T)^n, or 360 * 40 / T^n.
        let bound = |order: i32| {
            let size = |n: i32| 40.0 * (6.3_f64.powi(n) + 360.0) / shortest.powi(n);
            let rounding = f64::EPSILON * (size(order) + 80.0 * size(order + 1));
            h.powi(4) / 30.0 * size(order + 5) + 4.0 * rounding / h
        };
        let [_, told_jerk, told_snap] = at[2];
        prop_assert!((jerk - told_jerk).amax() <= bound(2), "{jerk} for {told_jerk}");
        prop_assert!((snap - told_snap).amax() <= bound(3), "{snap} for {told_snap}");
    }

    #[test]
    fn waypoints_are_passed_at_rest_and_without_a_jump(waypoints in waypoints()) {
        let trajectory = Trajectory::Waypoints(waypoints.clone());
        for waypoint in &waypoints {
            let there = orders(&Reference::rest(waypoint.position_m, waypoint.yaw_rad));
            let h = 1e-6;
            for t in [waypoint.time_s - h, waypoint.time_s, waypoint.time_s + h] {
                let [position, velocity, acceleration] = orders(&trajectory.at(t));
                for axis in 0..4 {
                    // The jerk at a waypoint is at most 60 * 40 m / (0.5 s)^3 = 19200 m/s3.
                    let jerk = 19_200.0;
                    prop_assert!((position[axis] - there[0][axis]).abs() <= jerk * h * h * h + 1e-12);
                    prop_assert!(velocity[axis].abs() <= jerk * h * h + 1e-12);
                    prop_assert!(acceleration[axis].abs() <= jerk * h + 1e-9);
                }
            }
        }
        // The reference is at rest before the first and after the last waypoint.
        if let (Some(first), Some(last)) = (waypoints.first(), waypoints.last()) {
            prop_assert_eq!(trajectory.at(first.time_s - 1.0), Reference::rest(first.position_m, first.yaw_rad));
            prop_assert_eq!(trajectory.at(last.time_s + 1.0), Reference::rest(last.position_m, last.yaw_rad));
        }
    }

    /// Between two waypoints the path is straight and does not overshoot.
    #[test]
    fn a_leg_is_straight_and_monotone(a in vector(20.0), b in vector(20.0), length in 0.5_f64..20.0) {
        let at = |time_s, position_m| Waypoint { time_s, position_m, yaw_rad: 0.0 };
        let trajectory = Trajectory::Waypoints(vec![at(1.0, a), at(1.0 + length, b)]);
        let leg = b - a;
        prop_assume!(leg.norm() > 1e-3);
        let mut last = 0.0;
        for step in 0..=200_u32 {
            let p = trajectory.at(1.0 + length * f64::from(step) / 200.0).position_m - a;
            let share = p.dot(&leg) / leg.norm_squared();
            prop_assert!((p - leg * share).norm() <= 1e-12 * (1.0 + leg.norm()) * 100.0);
            prop_assert!(share >= last - 1e-12 && share <= 1.0 + 1e-12, "{share} after {last}");
            last = share;
        }
        prop_assert!((last - 1.0).abs() <= 1e-12);
    }

    #[test]
    fn a_circle_is_round_level_and_counter_clockwise(
        centre_m in vector(10.0),
        radius_m in 0.1_f64..20.0,
        period_s in 2.0_f64..60.0,
        t in 0.0_f64..80.0,
    ) {
        let circle = Trajectory::Circle { centre_m, radius_m, period_s, yaw_rad: 0.5 };
        let start = circle.at(0.0).position_m - centre_m;
        prop_assert!((start - Vector3::new(radius_m, 0.0, 0.0)).norm() <= 1e-12 * (1.0 + centre_m.norm() + radius_m));
        let r = circle.at(t);
        let arm = r.position_m - centre_m;
        prop_assert!((arm.norm() - radius_m).abs() <= 1e-12 * (10.0 + radius_m) && arm.z == 0.0);
        prop_assert!(arm.cross(&r.velocity_m_s).z > 0.0);
        let again = circle.at(t + period_s).position_m;
        prop_assert!((again - r.position_m).norm() <= 1e-11 * (10.0 + radius_m));
    }

    #[test]
    fn a_step_holds_one_pose_before_and_another_after(
        from_m in vector(10.0),
        to_m in vector(10.0),
        at_s in 0.1_f64..50.0,
        yaw_rad in -3.0_f64..3.0,
        turn_rad in -3.0_f64..3.0,
    ) {
        let step = Trajectory::Step { from_m, to_m, at_s, yaw_rad, turn_rad };
        prop_assert_eq!(step.at(0.0), Reference::rest(from_m, yaw_rad));
        prop_assert_eq!(step.at(at_s.next_down()), Reference::rest(from_m, yaw_rad));
        prop_assert_eq!(step.at(at_s), Reference::rest(to_m, yaw_rad + turn_rad));
        prop_assert_eq!(step.at(at_s + 100.0), Reference::rest(to_m, yaw_rad + turn_rad));
    }

    /// Compares the paper's trajectory with the formula printed in section IV, which has sines with phases.
    #[test]
    fn the_papers_trajectory_is_the_printed_one(t in 0.0_f64..120.0) {
        use core::f64::consts::{FRAC_PI_2, PI};
        let a = PI * t / 30.0;
        let r = Trajectory::Paper.at(t);
        let printed =
            Vector3::new(1.0 - (a + FRAC_PI_2).sin(), -2.0 * (a + PI).sin(), 5.0 - 3.0 * (a + FRAC_PI_2).sin());
        prop_assert!((r.position_m - printed).amax() <= 1e-13);
        prop_assert!((r.yaw_rad - 0.43 * (a + PI).sin()).abs() <= 1e-14);
    }

    /// The controller's setpoint is the reference, rounded once.
    #[test]
    fn the_setpoint_is_the_reference_rounded(trajectory in smooth(), t in 0.0_f64..80.0) {
        let reference = trajectory.at(t);
        let s = reference.setpoint();
        let reported: [[f32; 4]; 3] = [
            [s.position_m.x, s.position_m.y, s.position_m.z, s.yaw_rad],
            [s.velocity_m_s.x, s.velocity_m_s.y, s.velocity_m_s.z, s.yaw_rate_rad_s],
            [s.acceleration_m_s2.x, s.acceleration_m_s2.y, s.acceleration_m_s2.z, s.yaw_acceleration_rad_s2],
        ];
        prop_assert_eq!(reported, orders(&reference).map(|order| order.map(|x| x as f32)));
        let reported = [s.acceleration_m_s2, s.jerk_m_s3, s.snap_m_s4];
        prop_assert_eq!(reported, higher(&reference).map(|order| order.cast()));
    }
}
