//! Compares a step of the heading with its law in double precision.

use super::*;
use core::f64::consts::{PI, TAU};
use proptest::prelude::*;

/// Returns the wanted acceleration in double precision. The rate settles to the rate of approach, whose derivative is
/// fed forward. The rate of approach is the one from which the heading stops in time, f(e) = sqrt(c^2 + 2 B |e|) - c,
/// up to 99 % of the largest rate.
fn acceleration(heading: &Heading, turn: &HeadingTarget, limits: &YawLimits) -> f64 {
    let (rate, most) = (f64::from(heading.rate_rad_s), 0.99 * f64::from(limits.rate_rad_s));
    let largest = f64::from(limits.acceleration_rad_s2);
    let braking = 0.7 * largest;
    let (wanted, change) = match *turn {
        HeadingTarget::By(goal_rad_s) => (f64::from(goal_rad_s).clamp(-most, most), 0.0),
        HeadingTarget::To(yaw, goal_rad_s) => {
            let goal_rad_s = f64::from(goal_rad_s);
            let e = (f64::from(yaw) - f64::from(heading.yaw_rad) + PI).rem_euclid(TAU) - PI;
            let c = braking / 2.0;
            let f = |e: f64| ((c * c + 2.0 * braking * e.abs()).sqrt() - c) * e.signum();
            let (h, shaping) = (1e-6, goal_rad_s - rate);
            let wanted = goal_rad_s + f(e);
            let change = (f(e + shaping * h) - f(e - shaping * h)) / (2.0 * h);
            if wanted.abs() <= most { (wanted, change) } else { (wanted.clamp(-most, most), 0.0) }
        }
    };
    (change + (wanted - rate) * 8.0).clamp(-largest, largest)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn a_step_is_that_of_the_law(
        yaw_rad in -3.1..3.1f32,
        rate in -1.5..1.5f32,
        turn in prop_oneof![
            (-9.0..9.0f32, -1.5..1.5f32).prop_map(|(yaw, rate)| HeadingTarget::To(yaw, rate)),
            (-9.0..9.0f32).prop_map(|yaw| HeadingTarget::To(yaw, 0.0)),
            (-2.0..2.0f32).prop_map(HeadingTarget::By),
        ],
        near in prop::option::of(-0.02..0.02f32),
        rate_max in 0.3..2.0f32,
        acceleration_max in 0.5..8.0f32,
        dt_s in prop_oneof![Just(1e-3f32), 1e-3..0.05f32],
    ) {
        let limits = YawLimits { rate_rad_s: rate_max, acceleration_rad_s2: acceleration_max };
        let before = Heading { yaw_rad, rate_rad_s: rate, acceleration_rad_s2: 9.0 };
        let turn = match (turn, near) {
            (HeadingTarget::To(_, goal_rad_s), Some(near)) => HeadingTarget::To(yaw_rad + near, goal_rad_s),
            (turn, _) => turn,
        };
        let mut heading = before;
        heading.advance(&turn, &limits, dt_s);
        if let HeadingTarget::To(yaw, goal_rad_s) = turn {
            let off = wrap_angle(yaw - yaw_rad).abs();
            let off_rad_s = (goal_rad_s - rate).abs();
            let is_near = off <= REACHED_RAD + off_rad_s * dt_s;
            let reached = off_rad_s <= REACHED_RAD_S && is_near && goal_rad_s.abs() <= rate_max;
            let hit = heading == Heading { yaw_rad: yaw, rate_rad_s: goal_rad_s, acceleration_rad_s2: 0.0 };
            prop_assert_eq!(hit, reached);
            if reached {
                return Ok(());
            }
        }
        let expected = acceleration(&before, &turn, &limits);
        let found = f64::from(heading.acceleration_rad_s2);
        // At the rate limit the feed-forward jumps, so compare with a tolerance.
        prop_assert!((found - expected).abs() < 2e-3 * (1.0 + expected.abs()), "{found}, not {expected}");
        let dt = f64::from(dt_s);
        prop_assert!((f64::from(heading.rate_rad_s - rate) - found * dt).abs() < 1e-6);
        let shaping = (f64::from(rate) + 0.5 * found * dt) * dt;
        let moved = (f64::from(heading.yaw_rad) - f64::from(yaw_rad) - shaping + PI).rem_euclid(TAU) - PI;
        prop_assert!(moved.abs() < 1e-6, "{heading:?} from {before:?}");
        prop_assert!(heading.yaw_rad.abs() <= 3.15);
    }
}

/// A heading counts as reached within the tolerances, and not beyond.
#[test]
fn it_is_reached_within_tolerances_only() {
    let limits = YawLimits { rate_rad_s: 1.0, acceleration_rad_s2: 2.0 };
    let hits = |off: f32, off_rad_s: f32, goal_rad_s: f32| {
        let mut heading = Heading { yaw_rad: 0.5 - off, rate_rad_s: goal_rad_s - off_rad_s, acceleration_rad_s2: 0.1 };
        heading.advance(&HeadingTarget::To(0.5, goal_rad_s), &limits, 1e-3);
        heading == Heading { yaw_rad: 0.5, rate_rad_s: goal_rad_s, acceleration_rad_s2: 0.0 }
    };
    for sign in [1.0, -1.0] {
        assert!(hits(sign * 0.99e-3, 0.0, 0.0) && !hits(sign * 1.02e-3, 0.0, 0.0));
        assert!(hits(0.0, sign * 4.9e-3, 0.0) && !hits(0.0, sign * 5.1e-3, 0.0));
        assert!(hits(0.0, 0.0, sign * 0.999) && !hits(0.0, 0.0, sign * 1.001), "not beyond the largest rate");
    }
    assert_eq!(Heading::new(0.3), Heading { yaw_rad: 0.3, rate_rad_s: 0.0, acceleration_rad_s2: 0.0 });
}
