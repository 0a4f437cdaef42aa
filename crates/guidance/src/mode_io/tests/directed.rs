//! Tests of the modes that follow sticks or the targets of a companion computer.

use super::*;

#[test]
fn sticks_are_between_their_ends() {
    let set = |index: usize, value: f32| {
        let mut all = [0.5; 4];
        all.get_mut(index).into_iter().for_each(|stick| *stick = value);
        let [roll, pitch, throttle, yaw] = all;
        sticks::is_plausible(&Sticks { roll, pitch, throttle, yaw })
    };
    for index in 0..4 {
        assert!(set(index, 1.0) && set(index, -1.0) && set(index, 0.0));
        assert!(!set(index, 1.01) && !set(index, -1.01) && !set(index, f32::NAN));
    }
}

fn stick() -> impl Strategy<Value = f32> {
    prop_oneof![3 => -1.0..1.0f32, 1 => -0.05..0.05f32, 1 => Just(0.0f32)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    /// Sticks command forward and right in the vehicle's frame, and yaw clockwise seen from above. Small deflections
    /// count as centred. Throttle up and down are scaled by the limits of each direction.
    #[test]
    fn sticks_mean_directions_of_the_vehicle(
        roll in stick(), pitch in stick(), throttle in stick(), yaw in stick(), heading in -3.1..3.1f32,
        actual in -3.1..3.1f32,
    ) {
        let mut stage = Stage::at(here());
        (stage.present.yaw_rad, stage.state.attitude_rad.z) = (heading, actual);
        let all = Sticks { roll, pitch, throttle, yaw };
        let output = |mode| stage.see(|inputs| sticks::fly(mode, &all, inputs, &LIFT));
        let centred = |stick: f32| if stick.abs() <= 0.03 { 0.0 } else { stick };
        let [roll, pitch, throttle, yaw] = [roll, pitch, throttle, yaw].map(centred);
        let climb = throttle * if throttle > 0.0 { 3.0 } else { 2.0 };
        let turned = |forward: f32, left: f32, heading: f32| {
            Rotation3::from_axis_angle(&Vector3::z_axis(), heading) * Vector3::new(forward, left, 0.0)
        };
        let near = |a: Vector3<f32>, b: Vector3<f32>| (a - b).norm() < 2e-3;

        let position = output(FlightMode::Position);
        let aim = limited(&position);
        let expected = turned(pitch * 4.0, -roll * 4.0, heading) + Vector3::z() * climb;
        prop_assert!(near(aim.velocity_m_s, expected), "{aim:?}, not {expected:?}");
        prop_assert!((aim.yaw_rate_rad_s + yaw * 1.5).abs() < 1e-5);
        prop_assert!(same(&aim.position_m, &NAN) && aim.speed_m_s == 4.0);

        let altitude = output(FlightMode::Altitude);
        let Shaping::Leaning(aim, [x, y]) = altitude.shaping else { panic!("{altitude:?}") };
        let lean = |stick: f32| 9.81 * (stick * 0.6).tan();
        prop_assert!(near(Vector3::new(x, y, 0.0), turned(lean(pitch), lean(-roll), heading)), "{x}, {y}");
        prop_assert!(aim.velocity_m_s.x.is_nan() && aim.velocity_m_s.y.is_nan() && aim.velocity_m_s.z == climb);
        prop_assert!((aim.yaw_rate_rad_s + yaw * 1.5).abs() < 1e-5);

        let stabilised = output(FlightMode::Stabilised);
        let Shaping::Direct(setpoint) = stabilised.shaping else { panic!("{stabilised:?}") };
        let up = (turned((pitch * 0.6).tan(), (-roll * 0.6).tan(), actual) + Vector3::z()).normalize();
        let thrust = 9.81 + throttle * if throttle > 0.0 { 25.0 - 9.81 } else { 9.81 };
        let expected = up * thrust - Vector3::z() * 9.81;
        prop_assert!(near(setpoint.acceleration_m_s2, expected), "{setpoint:?}, not {expected:?}");
        prop_assert!((setpoint.yaw_rate_rad_s + yaw * 1.5).abs() < 1e-5);
        prop_assert_eq!((setpoint.position_m, setpoint.velocity_m_s), (here(), stage.state.velocity_m_s));

        // Body rates: roll to the right and nose down are positive, a clockwise turn is negative.
        let acro = output(FlightMode::Acro);
        let Shaping::Turning(target) = acro.shaping else { panic!("{acro:?}") };
        let full = Vector3::new(all.roll * 100.0, all.pitch * 100.0, -all.yaw * 100.0).map(f32::to_radians);
        prop_assert!(near(target.rates_rad_s, full), "{target:?}");
        prop_assert!((target.thrust - thrust / 25.0).abs() < 1e-5, "{target:?}");

        for output in [position, altitude, stabilised, acro] {
            prop_assert_eq!((output.lifts, output.lands, output.done), (throttle > 0.1, false, false));
        }
    }
}

/// Rotors too weak to lift the weight give their largest thrust.
#[test]
fn weak_rotors_give_what_they_can() {
    let weak = AvailableThrust { most_m_s2: 8.0, ..LIFT };
    for throttle in [0.0, 1.0] {
        let all = Sticks { throttle, ..Sticks::default() };
        let output = Stage::at(here()).see(|inputs| sticks::fly(FlightMode::Stabilised, &all, inputs, &weak));
        let Shaping::Direct(setpoint) = output.shaping else { panic!("{output:?}") };
        assert!((setpoint.acceleration_m_s2.z - (8.0 - 9.81)).abs() < 1e-4, "{setpoint:?}");
    }
}

fn motion() -> MotionTarget {
    MotionTarget {
        position_m: NAN,
        velocity_m_s: NAN,
        acceleration_m_s2: NAN,
        yaw_rad: f32::NAN,
        yaw_rate_rad_s: f32::NAN,
        body: false,
    }
}

fn level(thrust: f32) -> AttitudeTarget {
    AttitudeTarget { attitude: UnitQuaternion::identity(), yaw_rate_rad_s: f32::NAN, thrust }
}

/// Each value is accepted up to its largest size, and NaN where it means "not given".
#[test]
fn targets_are_plausible_within_their_largest_values() {
    let with = |index: usize, value: f32| {
        let mut target = motion();
        let set = |vector: &mut Vector3<f32>, axis: usize| {
            vector.iter_mut().nth(axis).into_iter().for_each(|number| *number = value);
        };
        match index {
            0..3 => set(&mut target.position_m, index),
            3..6 => set(&mut target.velocity_m_s, index - 3),
            6..9 => set(&mut target.acceleration_m_s2, index - 6),
            9 => target.yaw_rad = value,
            _ => target.yaw_rate_rad_s = value,
        }
        offboard::is_plausible(&OffboardTarget::Motion(target))
    };
    for (index, most) in [1e5, 1e5, 1e5, 1e3, 1e3, 1e3, 1e2, 1e2, 1e2, 1e3, 1e2].into_iter().enumerate() {
        assert!(with(index, f32::NAN) && with(index, most) && with(index, -most), "{index}");
        assert!(!with(index, most * 1.01) && !with(index, -most * 1.01) && !with(index, f32::INFINITY), "{index}");
    }
    let attitude = |target: AttitudeTarget| offboard::is_plausible(&OffboardTarget::Attitude(target));
    for (thrust, plausible) in [(0.0, true), (1.0, true), (-0.01, false), (1.01, false), (f32::NAN, false)] {
        assert_eq!(attitude(level(thrust)), plausible, "{thrust}");
    }
    for (rate, plausible) in [(100.0, true), (-100.0, true), (101.0, false), (f32::NAN, true)] {
        assert_eq!(attitude(AttitudeTarget { yaw_rate_rad_s: rate, ..level(0.5) }), plausible, "{rate}");
    }
    for (squared, plausible) in [(1.0, true), (1.09, true), (0.91, true), (1.11, false), (0.89, false)] {
        let quaternion = nalgebra::Quaternion::new(0.6, 0.0, 0.8, 0.0) * f32::sqrt(squared);
        let attitude_of = AttitudeTarget { attitude: UnitQuaternion::new_unchecked(quaternion), ..level(0.5) };
        assert_eq!(attitude(attitude_of), plausible, "{squared}");
    }
}

fn aimed(stage: &Stage, targets: &mut OffboardMemory, target: MotionTarget, at_us: u64) -> (ModeOutput, LimiterTarget) {
    let stamped = Stamped { value: OffboardTarget::Motion(target), at_us };
    let output = stage.see(|inputs| targets.fly(&stamped, inputs, &LIFT));
    (output, limited(&output))
}

/// A target in the local frame reaches the limiter unchanged, with its time of sending and the largest speed.
#[test]
fn a_local_target_is_aimed_at_as_it_is() {
    let v = Vector3::new;
    let target = MotionTarget {
        position_m: v(1.0, 2.0, 3.0),
        velocity_m_s: v(0.1, f32::NAN, 0.3),
        acceleration_m_s2: v(0.4, 0.5, 0.6),
        yaw_rad: 0.7,
        yaw_rate_rad_s: 0.8,
        body: false,
    };
    for (speed_m_s, expected) in [(f32::INFINITY, 9.0), (5.0, 5.0)] {
        let stage = Stage { speed_m_s, ..Stage::at(here()) };
        let (_, aim) = aimed(&stage, &mut OffboardMemory::default(), target, 77);
        assert!(same(&aim.position_m, &target.position_m) && same(&aim.velocity_m_s, &target.velocity_m_s));
        assert_eq!((aim.acceleration_m_s2, aim.yaw_rad, aim.yaw_rate_rad_s), (v(0.4, 0.5, 0.6), 0.7, 0.8));
        assert_eq!((aim.sent_us, aim.speed_m_s, aim.up_m_s, aim.down_m_s), (Some(77), expected, 3.0, 2.0));
    }
}

/// A body-frame target is turned by the heading, and fixed relative to the vehicle at the arrival of the message.
#[test]
fn a_target_of_the_vehicles_frame_is_turned_and_fixed() {
    let target = MotionTarget {
        position_m: Vector3::new(3.0, 1.0, 2.0),
        velocity_m_s: Vector3::new(1.0, -2.0, 0.5),
        acceleration_m_s2: Vector3::new(-0.5, 0.25, 0.1),
        yaw_rad: 0.3,
        body: true,
        ..motion()
    };
    let heading = Rotation3::from_axis_angle(&Vector3::z_axis(), 1.1);
    let (mut targets, stage) = (OffboardMemory::default(), Stage::at(here()).apart(Vector3::new(0.5, 0.5, 0.5)));
    let (_, aim) = aimed(&stage, &mut targets, target, 10);
    let near = |a: Vector3<f32>, b: Vector3<f32>| (a - b).norm() < 2e-3;
    assert!(near(aim.position_m, here() + heading * target.position_m), "{aim:?}");
    assert!(near(aim.velocity_m_s, heading * target.velocity_m_s), "{aim:?}");
    assert!(near(aim.acceleration_m_s2, heading * target.acceleration_m_s2), "{aim:?}");
    assert!((aim.yaw_rad - 1.4).abs() < 1e-6 && aim.sent_us.is_none(), "{aim:?}");
    // The vehicle moves on and turns: the place stays until the next message.
    let mut later = Stage::at(here() + Vector3::new(1.0, 0.0, 0.0));
    later.present.yaw_rad = 0.2;
    let (_, again) = aimed(&later, &mut targets, target, 10);
    assert_eq!((again.position_m, again.yaw_rad), (aim.position_m, aim.yaw_rad));
    let (_, next) = aimed(&later, &mut targets, target, 11);
    let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.2) * target.position_m;
    assert!(near(next.position_m, later.state.position_m + turned) && (next.yaw_rad - 0.5).abs() < 1e-6, "{next:?}");
}

/// A target lifts the vehicle off if it is above it, or moves upwards without a height, or is a complete trajectory.
#[test]
fn targets_above_or_upwards_lift() {
    let stage = Stage { airborne: false, ..Stage::at(here()) };
    let lifts = |target: MotionTarget| aimed(&stage, &mut OffboardMemory::default(), target, 1).0.lifts;
    let above = |up: f32| MotionTarget { position_m: Vector3::new(f32::NAN, f32::NAN, 8.0 + up), ..motion() };
    assert!(lifts(above(0.11)) && !lifts(above(0.09)) && !lifts(above(-5.0)));
    let climbs = |up: f32| MotionTarget { velocity_m_s: Vector3::new(0.0, 0.0, up), ..motion() };
    assert!(lifts(climbs(0.06)) && !lifts(climbs(0.04)) && !lifts(climbs(-1.0)));
    let pulls = |up: f32| MotionTarget { acceleration_m_s2: Vector3::new(0.0, 0.0, up), ..motion() };
    assert!(lifts(pulls(0.06)) && !lifts(pulls(0.04)) && !lifts(pulls(-1.0)) && !lifts(motion()));
    // The height has precedence over the speed.
    assert!(!lifts(MotionTarget { velocity_m_s: Vector3::new(0.0, 0.0, 1.0), ..above(0.0) }));
    assert!(lifts(MotionTarget { velocity_m_s: Vector3::new(0.0, 0.0, -1.0), ..above(1.0) }));
    let whole = MotionTarget {
        position_m: here(),
        velocity_m_s: Vector3::zeros(),
        acceleration_m_s2: Vector3::zeros(),
        ..motion()
    };
    assert!(lifts(whole) && !lifts(MotionTarget { velocity_m_s: Vector3::new(0.0, f32::NAN, 0.0), ..whole }));
}

proptest! {
    /// An attitude target with a share of the thrust accelerates along the attitude's z axis. The heading is the
    /// attitude's, or turns at the given rate.
    #[test]
    fn an_attitude_target_accelerates_along_its_z(
        roll in -1.2..1.2f32, pitch in -1.2..1.2f32, yaw in -3.1..3.1f32, rate in prop::option::of(-2.0..2.0f32),
        thrust in 0.0..1.0f32,
    ) {
        let attitude = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        let target = AttitudeTarget { attitude, yaw_rate_rad_s: rate.unwrap_or(f32::NAN), thrust };
        let stamped = Stamped { value: OffboardTarget::Attitude(target), at_us: 1 };
        let stage = Stage::at(here());
        let output = stage.see(|inputs| OffboardMemory::default().fly(&stamped, inputs, &LIFT));
        let Shaping::Direct(setpoint) = output.shaping else { panic!("{output:?}") };
        let expected = attitude * Vector3::z() * (25.0 * thrust) - Vector3::z() * 9.81;
        prop_assert!((setpoint.acceleration_m_s2 - expected).norm() < 1e-3, "{setpoint:?}, not {expected:?}");
        let (heading, turns) = rate.map_or((yaw, 0.0), |rate| (0.8, rate));
        prop_assert!((setpoint.yaw_rad - heading).abs() < 1e-3 && setpoint.yaw_rate_rad_s == turns, "{setpoint:?}");
        prop_assert_eq!(setpoint.position_m, here());
        prop_assert_eq!((output.lifts, output.lands, output.done), (25.0 * thrust > 0.8 * 9.81, false, false));
    }
}
