//! Checks which targets pass unchanged: streams against an independent account of their misfits, and every tolerance on
//! both sides.
#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use proptest::prelude::*;

const DT_S: f32 = 1e-3;

fn vector(most: f32) -> impl Strategy<Value = Vector3<f32>> {
    (-most..most, -most..most, -most..most).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn any_complete() -> impl Strategy<Value = CompleteTarget> {
    (vector(20.0), vector(3.0), vector(2.0)).prop_map(|(position_m, velocity_m_s, acceleration_m_s2)| CompleteTarget {
        position_m,
        velocity_m_s,
        acceleration_m_s2,
    })
}

fn size(vector: Vector3<f32>) -> f32 {
    vector.norm()
}

/// Returns a vector of this length with parts along every axis.
fn oblique(length: f32) -> Vector3<f32> {
    Vector3::new(0.6, -0.48, 0.64) * length
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]

    /// Between two messages, a stream that fits together is extrapolated with constant jerk.
    #[test]
    fn a_stream_goes_on_between_messages(begin in any_complete(), jerk in vector(30.0), steps in 1..40u32) {
        let first = TargetStream {
            sent_us: 5,
            last: begin,
            present: begin,
            since_s: 0.0,
            interval_s: 0.1,
            jerk_m_s3: jerk,
            fits: true,
        };
        let mut stream = first;
        // Long steps make every term visible.
        for _ in 0..steps {
            stream.advance(&begin, 5, 0.02, 100.0);
        }
        let t = steps as f32 * 0.02;
        let CompleteTarget { position_m, velocity_m_s, acceleration_m_s2 } = stream.present;
        prop_assert!((stream.since_s - t).abs() < 1e-5);
        prop_assert!(size(acceleration_m_s2 - begin.acceleration_m_s2 - jerk * t) < 1e-3);
        let velocity = begin.velocity_m_s + begin.acceleration_m_s2 * t + jerk * (0.5 * t * t);
        prop_assert!(size(velocity_m_s - velocity) < 2e-3);
        // The integration neglects the part of the jerk within a step: hence the tolerance.
        let position = begin.position_m
            + begin.velocity_m_s * t
            + begin.acceleration_m_s2 * (0.5 * t * t)
            + jerk * (t * t * t / 6.0);
        prop_assert!(size(position_m - position) < 2e-3 + size(jerk) * t * 0.02 * 0.02);
        prop_assert_eq!((stream.last, stream.jerk_m_s3, stream.fits), (begin, jerk, true));
        // A stream that does not fit together is not extrapolated.
        let mut still = TargetStream { fits: false, ..first };
        still.advance(&begin, 5, 0.02, 100.0);
        prop_assert_eq!(still.present, begin);
    }

    /// Two messages fit if the first's motion leads to the second's position and velocity with a linear change of the
    /// acceleration. The tolerance is half of the tolerance for a passing stream. If they fit, the stream has the jerk
    /// between them.
    #[test]
    fn two_messages_fit_by_the_trapezium_rule(
        first in any_complete(), speed in vector(3.0), change in vector(1.0), interval_s in 0.005..0.49f32,
        off_share in prop_oneof![0.0..0.97f32, 1.03..3.0f32], off_speed in prop_oneof![0.0..0.97f32, 1.03..3.0f32],
    ) {
        let acceleration_m_s2 = first.acceleration_m_s2 + change;
        let off_m_s = oblique(off_speed * MISFIT_M_S);
        let mean_m_s2 = (first.acceleration_m_s2 + acceleration_m_s2) * 0.5;
        let velocity_m_s = first.velocity_m_s + mean_m_s2 * interval_s + off_m_s;
        let mean = (first.velocity_m_s + velocity_m_s) * 0.5;
        let allowed_m = 0.5 * (MISFIT_M + MISFIT_TIME_S * size(mean));
        let position_m = first.position_m + mean * interval_s + oblique(off_share * allowed_m);
        let second = CompleteTarget { position_m, velocity_m_s, acceleration_m_s2 };
        let mut stream = TargetStream::new(&first, 100);
        prop_assert_eq!((stream.last, stream.present, stream.since_s, stream.fits), (first, first, 0.0, false));
        stream.advance(&second, 200, interval_s, 7.0);
        prop_assert_eq!((stream.sent_us, stream.last, stream.present, stream.since_s), (200, second, second, 0.0));
        prop_assert_eq!(stream.interval_s, interval_s);
        let fits = off_share < 1.0 && off_speed < 1.0;
        prop_assert_eq!(stream.fits, fits, "{:?}", speed);
        let jerk = change / interval_s;
        let capped = if size(jerk) > 7.0 { jerk.normalize() * 7.0 } else { jerk };
        let expected = if fits { capped } else { Vector3::zeros() };
        let found = stream.jerk_m_s3;
        prop_assert!(size(found - expected) < 1e-2 + 1e-3 * size(jerk), "{found:?}, not {expected:?}");
    }
}

#[test]
fn after_a_pause_a_stream_begins_anew() {
    let here = CompleteTarget {
        position_m: oblique(3.0),
        velocity_m_s: Vector3::zeros(),
        acceleration_m_s2: Vector3::zeros(),
    };
    for (pause_s, goes_on) in [(INTERVAL_MAX_S, true), (INTERVAL_MAX_S * 1.001, false)] {
        let mut stream = TargetStream::new(&here, 1);
        stream.advance(&here, 2, pause_s, 100.0);
        assert_eq!((stream.fits, stream.interval_s), (goes_on, if goes_on { pause_s } else { 0.0 }));
    }
}

/// Returns a motion one step before `target` that misses it by these amounts in position, velocity and acceleration.
fn now(target: &CompleteTarget, off_m: f32, off_m_s: f32, off_m_s2: f32, misfit: Option<Misfit>) -> LimitedMotion {
    // The returned motion is compared with the target after one more step.
    let acceleration = target.acceleration_m_s2 - oblique(off_m_s2);
    let velocity = target.velocity_m_s - oblique(off_m_s) - acceleration * DT_S;
    let position = target.position_m - oblique(off_m) - (velocity + acceleration * (0.5 * DT_S)) * DT_S;
    let one = |v: Vector3<f32>| Vector1::new(v.z);
    LimitedMotion {
        horizontal: MotionState::moving(position.xy(), velocity.xy(), acceleration.xy(), Vector2::zeros()),
        vertical: MotionState::moving(one(position), one(velocity), one(acceleration), Vector1::zeros()),
        heading: Heading::new(0.0),
        misfit,
    }
}

fn passes(target: &CompleteTarget, mut now: LimitedMotion, limits: &MotionLimits, interval_s: f32) -> bool {
    let jerk = Vector3::new(1.0, 2.0, 3.0);
    let passed = now.pass(target, jerk, limits, interval_s, DT_S);
    if passed {
        let LimitedMotion { horizontal: h, vertical: v, .. } = now;
        let joined = |h: Vector2<f32>, v: Vector1<f32>| Vector3::new(h.x, h.y, v.x);
        assert_eq!(joined(h.position, v.position), target.position_m);
        assert_eq!(joined(h.velocity, v.velocity), target.velocity_m_s);
        assert_eq!(joined(h.acceleration, v.acceleration), target.acceleration_m_s2);
        assert_eq!(joined(h.jerk, v.jerk), jerk);
    }
    passed
}

fn moving(speed_m_s: f32, acceleration_m_s2: f32) -> CompleteTarget {
    CompleteTarget {
        position_m: Vector3::new(1.0, -2.0, 3.0),
        velocity_m_s: Vector3::new(0.0, 0.8, -0.6) * speed_m_s,
        acceleration_m_s2: Vector3::new(0.8, 0.6, 0.0) * acceleration_m_s2,
    }
}

const NO_MISFIT: Misfit = Misfit { position_m: Vector3::new(0.0, 0.0, 0.0), velocity_m_s: Vector3::new(0.0, 0.0, 0.0) };

/// Checks each tolerance by itself: slightly less passes, slightly more does not.
fn is_tolerance(
    target: &CompleteTarget,
    limits: &MotionLimits,
    interval_s: f32,
    misfit: Option<Misfit>,
    most: [f32; 3],
) {
    for (kind, most) in most.into_iter().enumerate() {
        for (share, expected) in [(0.0, true), (0.97, true), (1.03, false), (30.0, false)] {
            for sign in [1.0, -1.0] {
                let off: [f32; 3] = core::array::from_fn(|index| if index == kind { sign * share * most } else { 0.0 });
                let [off_m, off_m_s, off_m_s2] = off;
                let now = now(target, off_m, off_m_s, off_m_s2, misfit);
                assert_eq!(passes(target, now, limits, interval_s), expected, "{target:?}: {off:?}, {misfit:?}");
            }
        }
    }
}

#[test]
fn a_target_at_rest_is_caught_up_with_to_a_tenth_of_a_millimetre() {
    let limits = MotionLimits::DEFAULT;
    is_tolerance(&moving(0.0, 0.0), &limits, 0.02, None, [STANDS_M, STANDS_M_S, STANDS_M_S2]);
}

/// The tolerances of a moving target grow with its speed and acceleration, and with the change by the largest jerk
/// between two messages.
#[test]
fn a_moving_target_is_caught_up_with_within_its_tolerances() {
    let limits = MotionLimits { jerk_max_m_s3: 20.0, ..MotionLimits::DEFAULT };
    for (speed, acceleration, interval_s) in [(1.5, 0.0, 0.0), (0.0, 2.0, 0.1), (2.0, 4.0, 0.03)] {
        let target = moving(speed, acceleration);
        let jerk = 1.25 * 20.0 * f32::max(interval_s, DT_S);
        let caught = [CAUGHT_M + CAUGHT_TIME_S * speed, CAUGHT_M_S + CAUGHT_TIME_S * acceleration, MISFIT_M_S2 + jerk];
        is_tolerance(&target, &limits, interval_s, None, caught);
        let passing = [MISFIT_M + MISFIT_TIME_S * speed, MISFIT_M_S, MISFIT_M_S2 + jerk];
        is_tolerance(&target, &limits, interval_s, Some(NO_MISFIT), passing);
    }
}

/// The misfits of a passing stream add up and decay with their time constant. A steady misfit passes as long as its sum
/// stays below the limit.
#[test]
fn misfits_add_up_and_fade() {
    let limits = MotionLimits::DEFAULT;
    let target = moving(1.0, 0.0);
    let steps = MISFIT_S / DT_S;
    for (most, of) in [(MISFIT_M + MISFIT_TIME_S, 0), (MISFIT_M_S, 1)] {
        for share in [0.9, 1.1] {
            // In the long run, the sum is `steps` times the misfit of one step.
            let off = share * most / steps;
            let (mut misfit, mut ended) = (Some(NO_MISFIT), None);
            for tick in 0..5000 {
                let (off_m, off_m_s) = if of == 0 { (off, 0.0) } else { (0.0, off) };
                let mut now = now(&target, off_m, off_m_s, 0.0, misfit);
                if !now.pass(&target, Vector3::zeros(), &limits, 0.02, DT_S) {
                    ended = Some(tick);
                    break;
                }
                misfit = now.misfit;
            }
            assert_eq!(ended.is_some(), share > 1.0, "{of}: {ended:?}");
            // 1 - exp(-t/T) = 1/1.1.
            assert!(ended.is_none_or(|tick| (tick as f32 / steps - 2.4).abs() < 0.1), "{of}: {ended:?}");
        }
    }
}

/// A target beyond a limit does not pass, for each axis and direction.
#[test]
fn what_passes_is_within_the_limits() {
    let limits = MotionLimits {
        speed_m_s: 5.0,
        up_m_s: 2.0,
        down_m_s: 1.0,
        acceleration_max_m_s2: 4.0,
        vertical_acceleration_m_s2: 3.0,
        ..MotionLimits::DEFAULT
    };
    let zero = Vector3::zeros();
    let ok = |velocity_m_s: Vector3<f32>, acceleration_m_s2: Vector3<f32>| {
        let target = CompleteTarget { position_m: Vector3::new(1.0, 2.0, 3.0), velocity_m_s, acceleration_m_s2 };
        let is_allowed = allowed(&target, &limits);
        assert_eq!(passes(&target, now(&target, 0.0, 0.0, 0.0, Some(NO_MISFIT)), &limits, 0.02), is_allowed);
        is_allowed
    };
    assert!(ok(Vector3::new(3.0, -3.99, 0.0), zero) && !ok(Vector3::new(3.0, -4.01, 0.0), zero));
    assert!(ok(Vector3::new(0.0, 0.0, 1.99), zero) && !ok(Vector3::new(0.0, 0.0, 2.01), zero));
    assert!(ok(Vector3::new(0.0, 0.0, -0.99), zero) && !ok(Vector3::new(0.0, 0.0, -1.01), zero));
    assert!(ok(zero, Vector3::new(2.4, -3.19, 0.0)) && !ok(zero, Vector3::new(2.4, -3.21, 0.0)));
    for sign in [1.0, -1.0] {
        assert!(ok(zero, Vector3::new(0.0, 0.0, sign * 2.99)) && !ok(zero, Vector3::new(0.0, 0.0, sign * 3.01)));
    }
}

/// Missing velocities and accelerations of a target with a position are zero. A target without a position is not
/// complete.
#[test]
fn a_target_with_a_position_is_complete() {
    let aim = LimiterTarget::stop(1.0, 1.0, 1.0);
    assert_eq!(complete(&aim), None);
    let place = Vector3::new(1.0, 2.0, 3.0);
    for missing in 0..3 {
        let mut position_m = place;
        position_m.iter_mut().nth(missing).into_iter().for_each(|value| *value = f32::NAN);
        assert_eq!(complete(&LimiterTarget { position_m, velocity_m_s: place, ..aim }), None);
    }
    let half = Vector3::new(f32::NAN, 4.0, f32::NAN);
    let whole = complete(&LimiterTarget { position_m: place, velocity_m_s: half, ..aim }).unwrap();
    let zero = Vector3::zeros();
    let expected =
        CompleteTarget { position_m: place, velocity_m_s: Vector3::new(0.0, 4.0, 0.0), acceleration_m_s2: zero };
    assert_eq!(whole, expected);
}

/// An acceleration counts by itself only if neither position nor velocity is given.
#[test]
fn a_goal_is_what_is_given() {
    let (nan, one, two) = (Vector2::new(1.0, f32::NAN), Vector2::new(1.0, 2.0), Vector2::new(3.0, 4.0));
    let zero = Vector2::zeros();
    let goals = [
        (goal(nan, nan, two), MotionGoal { position: None, velocity: None, acceleration: two, jerk: zero }),
        (goal(nan, nan, nan), MotionGoal { position: None, velocity: Some(zero), acceleration: zero, jerk: zero }),
        (goal(one, nan, two), MotionGoal { position: Some(one), velocity: Some(zero), acceleration: two, jerk: zero }),
        (goal(nan, two, nan), MotionGoal { position: None, velocity: Some(two), acceleration: zero, jerk: zero }),
        (goal(one, two, two), MotionGoal { position: Some(one), velocity: Some(two), acceleration: two, jerk: zero }),
    ];
    for (found, expected) in goals {
        assert_eq!(found, expected);
    }
}

/// The limiter starts at the vehicle with its velocity within the limits, or at rest. `follow` follows the vehicle
/// horizontally only. A change of limits does not interrupt the motion.
#[test]
fn it_begins_and_goes_on_at_the_vehicle() {
    let limits = MotionLimits { speed_m_s: 5.0, up_m_s: 2.0, down_m_s: 1.0, ..MotionLimits::DEFAULT };
    let state = State {
        position_m: Vector3::new(1.0, -2.0, 3.0),
        velocity_m_s: Vector3::new(6.0, -8.0, 0.5),
        attitude_rad: Vector3::new(0.1, 0.2, 0.7),
        ..State::default()
    };
    let mut limiter = Limiter::new(limits).unwrap();
    assert_eq!(limiter.setpoint(), None);
    let climbing = |climb: f32| State { velocity_m_s: Vector3::new(6.0, -8.0, climb), ..state };
    for (climb, expected) in [(0.5, 0.5), (3.0, 2.0), (-0.5, -0.5), (-3.0, -1.0)] {
        limiter.anchor(&climbing(climb));
        let setpoint = limiter.setpoint().unwrap();
        assert_eq!((setpoint.position_m, setpoint.yaw_rad), (state.position_m, 0.7));
        assert!((setpoint.velocity_m_s - Vector3::new(3.0, -4.0, expected)).norm() < 1e-5, "{setpoint:?}");
    }
    // A motion in which every derivative differs from zero.
    let aim = LimiterTarget {
        velocity_m_s: Vector3::new(1.0, 2.0, 0.5),
        yaw_rate_rad_s: 0.4,
        ..LimiterTarget::stop(9.0, 9.0, 9.0)
    };
    (0..300).for_each(|_| limiter.advance(&aim, DT_S));
    let before = limiter.setpoint().unwrap();
    assert!(before.jerk_m_s3.norm() > 0.1 && before.acceleration_m_s2.z != 0.0 && before.yaw_rate_rad_s > 0.1);
    limiter.set(MotionLimits { speed_m_s: 4.0, ..limits });
    assert_eq!(limiter.setpoint(), Some(before));
    let there = State { position_m: Vector3::new(7.0, 8.0, 9.0), ..climbing(1.0) };
    limiter.follow(&there);
    let followed = limiter.setpoint().unwrap();
    let flat = |v: Vector3<f32>, z: f32| Vector3::new(v.x, v.y, z);
    assert_eq!(followed.position_m, flat(there.position_m, before.position_m.z));
    let capped = Vector3::new(2.4, -3.2, before.velocity_m_s.z);
    assert!((followed.velocity_m_s - capped).norm() < 1e-5, "by the new limit: {followed:?}");
    assert_eq!(followed.acceleration_m_s2, flat(Vector3::zeros(), before.acceleration_m_s2.z));
    assert_eq!((followed.yaw_rad, followed.yaw_rate_rad_s), (before.yaw_rad, before.yaw_rate_rad_s));
    limiter.rest(&there);
    let rests = limiter.setpoint().unwrap();
    assert_eq!(rests, Setpoint { position_m: there.position_m, yaw_rad: 0.7, ..Setpoint::default() });
}

/// A turning heading is followed at its rate. A rate alone is kept. With neither, the heading stops.
#[test]
fn headings_and_rates_are_followed() {
    let turned = |yaw_rad: f32, yaw_rate_rad_s: f32| {
        let mut limiter = Limiter::new(MotionLimits::DEFAULT).unwrap();
        limiter.anchor(&State::default());
        let aim = LimiterTarget { yaw_rad: 0.0, yaw_rate_rad_s: 0.5, ..LimiterTarget::stop(1.0, 1.0, 1.0) };
        (0..1000).for_each(|_| limiter.advance(&aim, DT_S));
        for tick in 0..4000 {
            let yaw_rad = yaw_rad + if yaw_rate_rad_s.is_nan() { 0.0 } else { tick as f32 * DT_S * yaw_rate_rad_s };
            limiter.advance(&LimiterTarget { yaw_rad, yaw_rate_rad_s, ..aim }, DT_S);
        }
        let setpoint = limiter.setpoint().unwrap();
        (setpoint.yaw_rad, setpoint.yaw_rate_rad_s)
    };
    let close = |(yaw, rate): (f32, f32), (expected, expected_rate): (f32, f32)| {
        let off = wrap(yaw - expected);
        assert!(off.abs() < 3e-3 && (rate - expected_rate).abs() < 6e-3, "{yaw}, {rate}, not {expected}");
    };
    let nan = f32::NAN;
    close(turned(1.0, nan), (1.0, 0.0));
    close(turned(0.2, 0.3), (0.2 + 4.0 * 0.3 - 0.3e-3, 0.3));
    assert!((turned(nan, -0.4).1 + 0.4).abs() < 1e-3);
    assert!(turned(nan, nan).1.abs() < 1e-3);
}

fn wrap(angle: f32) -> f32 {
    afbc_control::math::wrap_angle(angle)
}

/// Accelerations are flown only if a stream's messages fit together. Otherwise they would only drive the vehicle away.
#[test]
fn accelerations_of_what_is_no_flight_do_not_count() {
    let farthest = |interval: u32| {
        let mut limiter = Limiter::new(MotionLimits::DEFAULT).unwrap();
        limiter.anchor(&State::default());
        let mut farthest_m = 0.0_f32;
        for tick in 0..4000_u32 {
            let aim = LimiterTarget {
                position_m: Vector3::new(1.0, 0.0, 0.0),
                velocity_m_s: Vector3::zeros(),
                acceleration_m_s2: Vector3::new(5.0, 0.0, 0.0),
                sent_us: Some(u64::from(tick / interval)),
                ..LimiterTarget::stop(9.0, 9.0, 9.0)
            };
            limiter.advance(&aim, DT_S);
            farthest_m = farthest_m.max(limiter.setpoint().unwrap().position_m.x);
        }
        farthest_m
    };
    assert!(farthest(100) < 1.02, "{}", farthest(100));
    // At 1000 messages per second, a wrong acceleration changes the velocity too little per message to be detected.
    assert!(farthest(1) > 1.1, "{}", farthest(1));
}
