//! The trajectory limiter keeps its limits, its outputs are consistent, it arrives without overshoot, and a feasible
//! stream passes unchanged.

use afbc_guidance::{Limiter, LimiterTarget, MotionLimits};
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;
use proptest::prelude::*;

const DT_S: f32 = 1e-3;

/// Limits of vehicles from agile to slow.
fn limits() -> impl Strategy<Value = MotionLimits> {
    (0.5_f32..20.0, 0.3_f32..6.0, 0.2_f32..4.0, 0.5_f32..10.0, 0.5_f32..8.0, 0.3_f32..5.0).prop_map(
        |(speed_m_s, up_m_s, down_m_s, acceleration_m_s2, vertical_acceleration_m_s2, jerk_s)| MotionLimits {
            speed_m_s,
            up_m_s,
            down_m_s,
            acceleration_m_s2,
            acceleration_max_m_s2: 2.0 * acceleration_m_s2,
            vertical_acceleration_m_s2,
            jerk_m_s3: (jerk_s * acceleration_m_s2).max(0.5),
            jerk_max_m_s3: 400.0,
            ..MotionLimits::DEFAULT
        },
    )
}

fn place(most_m: f32) -> impl Strategy<Value = Vector3<f32>> {
    [-most_m..most_m, -most_m..most_m, -most_m..most_m].prop_map(Vector3::from)
}

fn aim(limits: &MotionLimits) -> LimiterTarget {
    LimiterTarget::stop(limits.speed_m_s, limits.up_m_s, limits.down_m_s)
}

fn anchored(limits: MotionLimits, state: &State) -> Limiter {
    let mut limiter = Limiter::new(limits).unwrap();
    limiter.anchor(state);
    limiter
}

/// Checks a setpoint against the limits, and its derivatives against the setpoint before.
fn check(limits: &MotionLimits, last: &Setpoint, next: &Setpoint) -> Result<(), TestCaseError> {
    let hair = 1.0 + 1e-4;
    let Setpoint { velocity_m_s: v, acceleration_m_s2: a, jerk_m_s3: j, .. } = next;
    prop_assert!(next.is_plausible());
    prop_assert!(v.xy().norm() <= limits.speed_m_s * hair, "{v:?}");
    prop_assert!(v.z <= limits.up_m_s * hair && v.z >= -limits.down_m_s * hair, "{v:?}");
    prop_assert!(a.xy().norm() <= limits.acceleration_max_m_s2 * hair, "{a:?}");
    prop_assert!(a.z.abs() <= limits.vertical_acceleration_m_s2 * hair, "{a:?}");
    prop_assert!(j.xy().norm() <= limits.jerk_max_m_s3 * hair && j.z.abs() <= limits.jerk_max_m_s3 * hair, "{j:?}");
    prop_assert!(next.yaw_rate_rad_s.abs() <= limits.yaw_rate_rad_s * hair);
    prop_assert!(next.yaw_acceleration_rad_s2.abs() <= limits.yaw_acceleration_rad_s2 * hair);
    // A step of constant jerk. The tolerances cover single precision and the moment of arrival.
    let size_m = last.position_m.map(f32::abs).max().max(1.0);
    let off_m = next.position_m - last.position_m - (last.velocity_m_s + last.acceleration_m_s2 * (0.5 * DT_S)) * DT_S;
    prop_assert!(off_m.norm() < 1.5e-4 + 4e-7 * size_m, "{last:?} {next:?}");
    let off_m_s = next.velocity_m_s - last.velocity_m_s - (last.acceleration_m_s2 + j * (0.5 * DT_S)) * DT_S;
    prop_assert!(off_m_s.norm() < 2e-3, "{last:?} {next:?}");
    let off_m_s2 = next.acceleration_m_s2 - last.acceleration_m_s2 - j * DT_S;
    prop_assert!(off_m_s2.norm() < 0.02, "{last:?} {next:?}");
    Ok(())
}

/// Returns an upper bound of a flight's duration, including settling \[s\].
fn time_s(limits: &MotionLimits, from_m: &Vector3<f32>, to_m: &Vector3<f32>) -> f32 {
    let way_m = to_m - from_m;
    let one = |way_m: f32, speed: f32, acceleration: f32| {
        let settles_s = 40.0 * acceleration / limits.jerk_m_s3 + 2.0;
        way_m / (0.9 * speed) + 3.0 * speed / acceleration + settles_s.max(6.0)
    };
    let vertical = one(way_m.z.abs(), limits.up_m_s.min(limits.down_m_s), limits.vertical_acceleration_m_s2);
    one(way_m.xy().norm(), limits.speed_m_s, limits.acceleration_m_s2).max(vertical)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// From rest, the flight is straight, does not overshoot, and ends exactly at the place.
    #[test]
    fn a_jump_is_a_flight(limits in limits(), from_m in place(100.0), to_m in place(100.0), yaw in -7.0_f32..7.0) {
        let mut limiter = anchored(limits, &State { position_m: from_m, ..State::default() });
        let aim = LimiterTarget { position_m: to_m, yaw_rad: yaw, ..aim(&limits) };
        let (way_m, mut last) = (to_m - from_m, limiter.setpoint().unwrap());
        for _ in 0..(time_s(&limits, &from_m, &to_m) / DT_S) as u32 {
            limiter.advance(&aim, DT_S);
            let next = limiter.setpoint().unwrap();
            check(&limits, &last, &next)?;
            let at_m = next.position_m - from_m;
            let across_m = (at_m.x * way_m.y - at_m.y * way_m.x) / way_m.xy().norm().max(1e-3);
            // The tolerance covers the accumulated rounding of the direction.
            prop_assert!(across_m.abs() < 1e-3 + 2e-5 * way_m.xy().norm(), "{across_m} m beside the line");
            let beyond_m = at_m.xy().dot(&way_m.xy().normalize()) - way_m.xy().norm();
            prop_assert!(beyond_m < 0.01, "{beyond_m} m too far");
            prop_assert!((at_m.z - way_m.z) * way_m.z.signum() < 0.01, "{} m too high", at_m.z - way_m.z);
            prop_assert!(next.acceleration_m_s2.xy().norm() <= limits.acceleration_m_s2 * 1.0001);
            last = next;
        }
        prop_assert_eq!(last.position_m, to_m, "not arrived: {:?}", last);
        prop_assert_eq!(last.velocity_m_s, Vector3::zeros());
        let yaw_error = (last.yaw_rad - yaw).rem_euclid(core::f32::consts::TAU);
        prop_assert!(yaw_error.min(core::f32::consts::TAU - yaw_error) < 2e-3);
    }

    /// The limits hold for any targets, at any motion.
    #[test]
    fn limits_hold_while_targets_change(
        limits in limits(),
        velocity_m_s in place(30.0),
        changes in proptest::collection::vec((place(60.0), place(15.0), place(9.0), 0_u8..7, 1_u32..2500), 1..12),
    ) {
        let mut limiter = anchored(limits, &State { velocity_m_s, ..State::default() });
        let mut last = limiter.setpoint().unwrap();
        let none = Vector3::repeat(f32::NAN);
        for (position_m, velocity_m_s, acceleration_m_s2, kind, ticks) in changes {
            let aim = aim(&limits);
            let sent_us = Some(u64::from(ticks));
            let aim = match kind {
                0 => LimiterTarget { position_m, ..aim },
                1 => LimiterTarget { velocity_m_s, yaw_rate_rad_s: velocity_m_s.x, ..aim },
                2 => LimiterTarget { acceleration_m_s2, ..aim },
                3 => LimiterTarget { position_m: Vector3::new(f32::NAN, f32::NAN, position_m.z), velocity_m_s, ..aim },
                4 => LimiterTarget { position_m, velocity_m_s, acceleration_m_s2, ..aim },
                5 => LimiterTarget { position_m, velocity_m_s, acceleration_m_s2: none, sent_us, ..aim },
                _ => aim,
            };
            for _ in 0..ticks {
                limiter.advance(&aim, DT_S);
                let next = limiter.setpoint().unwrap();
                check(&limits, &last, &next)?;
                last = next;
            }
        }
    }

    /// A feasible trajectory, sent at any rate, is caught up with and passes to the bit, even with jitter.
    #[test]
    fn a_feasible_stream_passes_unchanged(
        radius_m in 1.0_f32..20.0,
        share in 0.1_f32..0.9,
        centre_m in place(500.0),
        interval in 1_u32..60,
        off_m in place(2.0),
        jitter in any::<bool>(),
    ) {
        let limits = MotionLimits::DEFAULT;
        let most_1_s = (limits.speed_m_s / radius_m).min((limits.acceleration_max_m_s2 / radius_m).sqrt());
        let w = share * most_1_s.min((limits.jerk_max_m_s3 * 0.1 / radius_m).cbrt());
        let climb_m = (1.0_f32 / w).min(3.0) * 0.5;
        let at = |t: f32| {
            let (s, c) = (w * t).sin_cos();
            let (s2, c2) = (0.5 * w * t).sin_cos();
            let r = radius_m;
            LimiterTarget {
                position_m: centre_m + Vector3::new(r * c, r * s, climb_m * s2),
                velocity_m_s: Vector3::new(-s * r, c * r, 0.5 * climb_m * c2) * w,
                acceleration_m_s2: Vector3::new(-c * r, -s * r, -0.25 * climb_m * s2) * w * w,
                yaw_rad: 0.3,
                ..aim(&limits)
            }
        };
        let mut limiter = anchored(limits, &State { position_m: at(0.0).position_m + off_m, ..State::default() });
        let (mut target, mut sent) = (at(0.0), 0);
        let (mut unchanged, mut messages) = (0, 0);
        let mut last = limiter.setpoint().unwrap();
        for tick in 0..40_000_u32 {
            let late = if jitter { (tick / interval * 7) % 3 } else { 0 };
            let is_news = tick >= sent + interval + late || tick == 0;
            if is_news {
                // The message describes the time of sending, up to 2 ms ago.
                (sent, target) = (tick - late, at((tick - late) as f32 * DT_S));
                target.sent_us = Some(u64::from(sent));
            }
            limiter.advance(&target, DT_S);
            let next = limiter.setpoint().unwrap();
            if tick > 20_000 {
                let truth = at(tick as f32 * DT_S);
                let most_m = 0.002 * (w * radius_m) + 0.003 + 1e-6 * 500.0;
                prop_assert!((next.position_m - truth.position_m).norm() < most_m, "{:?} {:?}", next, truth);
                if is_news {
                    messages += 1;
                    let same = next.position_m == target.position_m
                        && next.velocity_m_s == target.velocity_m_s
                        && next.acceleration_m_s2 == target.acceleration_m_s2;
                    unchanged += u32::from(same);
                }
            } else {
                prop_assert!(next.is_plausible());
            }
            last = next;
        }
        prop_assert_eq!(unchanged, messages, "{:?}", last);
    }
}

/// A stream that does not fit together does not pass: small misfits add up, and jumps are flown.
#[test]
fn a_stream_that_is_no_flight_does_not_pass() {
    let limits = MotionLimits::DEFAULT;
    let mut limiter = anchored(limits, &State::default());
    for tick in 0..3000_u32 {
        // 1 cm per tick means 10 m/s, but the message says zero velocity.
        let position_m = Vector3::new(0.01 * tick as f32, 0.0, 0.0);
        let velocity_m_s = Vector3::zeros();
        limiter.advance(
            &LimiterTarget { position_m, velocity_m_s, sent_us: Some(u64::from(tick) * 1000), ..aim(&limits) },
            DT_S,
        );
    }
    let setpoint = limiter.setpoint().unwrap();
    assert!(!limiter.passes() && setpoint.acceleration_m_s2.norm() > 0.1, "{setpoint:?}");
}

/// Far from the origin, a step is smaller than the resolution of single precision.
#[test]
fn it_arrives_far_from_the_origin() {
    for far_m in [1e3, 3e4, 9e4] {
        let to_m = Vector3::new(far_m, -far_m, 50.0);
        let mut limiter =
            anchored(MotionLimits::DEFAULT, &State { position_m: to_m.map(|x| x - 7.0), ..State::default() });
        for _ in 0..20_000 {
            limiter.advance(&LimiterTarget { position_m: to_m, ..aim(&MotionLimits::DEFAULT) }, DT_S);
        }
        assert_eq!(limiter.setpoint().unwrap().position_m, to_m);
    }
}

#[test]
fn it_turns_the_short_way() {
    for (from, to, turned) in [(3.0_f32, -3.0_f32, 0.283), (-3.0, 3.0, -0.283), (0.0, 2.0, 2.0), (0.5, -1.5, -2.0)] {
        let state = State { attitude_rad: Vector3::new(0.0, 0.0, from), ..State::default() };
        let mut limiter = anchored(MotionLimits::DEFAULT, &state);
        let mut sum = 0.0;
        for _ in 0..8000 {
            limiter.advance(&LimiterTarget { yaw_rad: to, ..aim(&MotionLimits::DEFAULT) }, DT_S);
            sum += limiter.setpoint().unwrap().yaw_rate_rad_s * DT_S;
        }
        assert!((sum - turned).abs() < 5e-3, "{from} to {to}: {sum}");
        assert_eq!(limiter.setpoint().unwrap().yaw_rad, to);
    }
}

#[test]
fn limits_are_validated_by_name() {
    for (limits, name) in [
        (MotionLimits { speed_m_s: f32::NAN, ..MotionLimits::DEFAULT }, "speed_m_s"),
        (MotionLimits { acceleration_max_m_s2: 2.0, ..MotionLimits::DEFAULT }, "acceleration_max_m_s2"),
        (MotionLimits { jerk_max_m_s3: 7.0, ..MotionLimits::DEFAULT }, "jerk_max_m_s3"),
    ] {
        assert_eq!(Limiter::new(limits).unwrap_err().range.name, name);
    }
}
