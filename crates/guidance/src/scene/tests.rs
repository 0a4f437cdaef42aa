//! What the modes want in a given scene: sticks, targets, take-off, landing, return and missions, with thresholds on
//! both sides. Their flights are in the crate's `tests`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use super::*;
use crate::course::{Hold, Land, Return, Takeoff};
use crate::lift::Lift;
use crate::mission::Mission;
use crate::mode::FlightMode;
use crate::order::{AttitudeTarget, Item, Leg, MotionTarget, Sticks, Target};
use crate::targets::{self, Targets};
use crate::{mission, sticks};
use afbc_flight_core::Stamped;
use nalgebra::{Rotation3, UnitQuaternion};
use proptest::prelude::*;

const NAN: Vector3<f32> = Vector3::new(f32::NAN, f32::NAN, f32::NAN);
const LIFT: Lift = Lift { most_m_s2: 25.0, gravity_m_s2: 9.81, given_m_s2: None };

/// Limits and speeds that all differ.
fn limits() -> Limits {
    Limits { speed_m_s: 9.0, up_m_s: 3.0, down_m_s: 2.0, yaw_rate_rad_s: 1.5, ..Limits::DEFAULT }
}

fn flying() -> Flying {
    Flying { cruise_m_s: 4.0, takeoff_m_s: 1.2, stick_tilt_rad: 0.6, within_m: 0.7, ..Flying::DEFAULT }
}

/// Vehicle and setpoint, somewhere in the air, and what is true of the rest.
#[derive(Clone, Copy, Debug)]
struct Stage {
    state: State,
    present: Setpoint,
    airborne: bool,
    home_m: Vector3<f32>,
    speed_m_s: f32,
    ceiling_m: f32,
}

impl Stage {
    /// Both at a place, with different headings.
    fn at(position_m: Vector3<f32>) -> Self {
        let mut state = State { position_m, ..State::default() };
        state.attitude_rad = Vector3::new(0.1, -0.2, 0.8);
        let present = Setpoint { position_m, yaw_rad: 1.1, ..Setpoint::default() };
        let home_m = Vector3::new(1.0, 2.0, 0.5);
        Stage { state, present, airborne: true, home_m, speed_m_s: f32::INFINITY, ceiling_m: f32::INFINITY }
    }

    fn moving(self, velocity_m_s: Vector3<f32>) -> Self {
        Stage { present: Setpoint { velocity_m_s, ..self.present }, ..self }
    }

    /// The setpoint moved away from the vehicle.
    fn apart(self, by_m: Vector3<f32>) -> Self {
        Stage { present: Setpoint { position_m: self.state.position_m + by_m, ..self.present }, ..self }
    }

    fn see<T>(&self, look: impl FnOnce(&Scene<'_>) -> T) -> T {
        let (flying, limits) = (flying(), limits());
        look(&Scene {
            flying: &flying,
            limits: &limits,
            dt_s: 1e-3,
            state: &self.state,
            present: &self.present,
            airborne: self.airborne,
            home_m: self.home_m,
            speed_m_s: self.speed_m_s,
            ceiling_m: self.ceiling_m,
        })
    }
}

fn here() -> Vector3<f32> {
    Vector3::new(10.0, -5.0, 8.0)
}

fn along(axis: usize, size: f32) -> Vector3<f32> {
    Vector3::from_fn(|row, _| if row == axis { size } else { 0.0 })
}

/// Equal to the bit, NaN included.
fn same(a: &Vector3<f32>, b: &Vector3<f32>) -> bool {
    a.iter().zip(b.iter()).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
}

fn limited(wish: &Wish) -> Aim {
    let Way::Limited(aim) = wish.way else { panic!("{wish:?}") };
    aim
}

// --- The scene. ---

#[test]
fn the_usual_speed_is_the_cruise_or_what_was_ordered() {
    for (speed_m_s, expected) in [(f32::INFINITY, 4.0), (2.0, 2.0), (6.0, 4.0)] {
        let aim = Stage { speed_m_s, ..Stage::at(here()) }.see(|scene| scene.stop());
        assert_eq!((aim.speed_m_s, aim.up_m_s, aim.down_m_s), (expected, 3.0, 2.0));
        assert!(same(&aim.position_m, &NAN) && same(&aim.velocity_m_s, &NAN) && aim.yaw_rad.is_nan());
        let to = Stage { speed_m_s, ..Stage::at(here()) }.see(|scene| scene.to(Vector3::new(1.0, 2.0, 3.0)));
        assert_eq!((to.position_m, to.speed_m_s), (Vector3::new(1.0, 2.0, 3.0), expected));
    }
}

/// It lands slowly below a height above home, twice as high as fast as it may, in between in proportion.
#[test]
fn it_descends_the_slower_the_lower() {
    let Flying { land_m_s, land_slow_m, .. } = flying();
    let sinks = |above_m: f32| {
        let place = Vector3::new(10.0, -5.0, 0.5 + above_m);
        let aim = Stage::at(place).see(|scene| scene.down(Vector3::new(3.0, 4.0, 99.0)));
        assert!(same(&aim.position_m, &Vector3::new(3.0, 4.0, f32::NAN)));
        assert!(aim.velocity_m_s.x.is_nan() && aim.velocity_m_s.y.is_nan());
        -aim.velocity_m_s.z
    };
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a}, not {b}");
    for (height, share) in [(0.0, 0.0), (0.9, 0.0), (1.0, 0.0), (1.25, 0.25), (1.8, 0.8), (2.0, 1.0), (9.0, 1.0)] {
        close(sinks(height * land_slow_m), land_m_s + (2.0 - land_m_s) * share);
    }
}

#[test]
fn a_heading_is_towards_a_place_that_is_not_near() {
    let towards = |x: f32, y: f32, z: f32| {
        Stage::at(here())
            .apart(Vector3::new(0.3, 0.4, 0.0))
            .see(|scene| scene.towards(&(scene.present.position_m + Vector3::new(x, y, z))))
    };
    for (x, y) in [(3.0, 4.0), (-3.0, 4.0), (0.8, -0.8), (-9.0, -1.0)] {
        assert!((towards(x, y, 5.0) - f32::atan2(y, x)).abs() < 1e-5, "{x}, {y}");
    }
    assert!(towards(0.7, 0.7, 5.0).is_nan() && towards(0.0, 0.0, 9.0).is_nan(), "within a metre");
}

#[test]
fn it_stands_if_neither_speed_nor_acceleration_is_left() {
    for axis in 0..3 {
        let stands = |speed: f32, acceleration: f32| {
            let stage = Stage::at(here()).moving(along(axis, speed));
            let present = Setpoint { acceleration_m_s2: along(axis, acceleration), ..stage.present };
            Stage { present, ..stage }.see(|scene| scene.stands())
        };
        assert!(stands(0.0, 0.0) && stands(0.049, 0.19) && stands(-0.049, -0.19));
        assert!(!stands(0.051, 0.0) && !stands(0.0, -0.21) && !stands(-3.0, 4.0));
    }
}

/// Both vehicle and setpoint are at a place, within a circle and a height.
#[test]
fn at_a_place_are_vehicle_and_setpoint() {
    let place = here();
    let is_at = |vehicle: Vector3<f32>, setpoint: Vector3<f32>| {
        Stage::at(place + vehicle).apart(setpoint - vehicle).see(|scene| scene.is_at(&place, 2.0))
    };
    let zero = Vector3::zeros();
    for (off, at) in [
        (Vector3::new(1.99, 0.0, 0.0), true),
        (Vector3::new(0.0, -2.01, 0.0), false),
        (Vector3::new(1.41, -1.41, 1.99), true),
        (Vector3::new(1.42, 1.42, 0.0), false),
        (Vector3::new(0.0, 0.0, 2.01), false),
        (Vector3::new(0.0, 0.0, -2.01), false),
    ] {
        assert_eq!((is_at(off, zero), is_at(zero, off), is_at(off, off)), (at, at, at), "{off:?}");
    }
}

// --- Sticks. ---

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

    /// Forward and right as seen from the vehicle, clockwise as seen from above; small deflections are none; throttle
    /// up and down by the limits of each.
    #[test]
    fn sticks_mean_directions_of_the_vehicle(
        roll in stick(), pitch in stick(), throttle in stick(), yaw in stick(), heading in -3.1..3.1f32,
        actual in -3.1..3.1f32,
    ) {
        let mut stage = Stage::at(here());
        (stage.present.yaw_rad, stage.state.attitude_rad.z) = (heading, actual);
        let all = Sticks { roll, pitch, throttle, yaw };
        let wish = |mode| stage.see(|scene| sticks::fly(mode, &all, scene, &LIFT));
        let centred = |stick: f32| if stick.abs() <= 0.03 { 0.0 } else { stick };
        let [roll, pitch, throttle, yaw] = [roll, pitch, throttle, yaw].map(centred);
        let climb = throttle * if throttle > 0.0 { 3.0 } else { 2.0 };
        let turned = |forward: f32, left: f32, heading: f32| {
            Rotation3::from_axis_angle(&Vector3::z_axis(), heading) * Vector3::new(forward, left, 0.0)
        };
        let near = |a: Vector3<f32>, b: Vector3<f32>| (a - b).norm() < 2e-3;

        let position = wish(FlightMode::Position);
        let aim = limited(&position);
        let expected = turned(pitch * 4.0, -roll * 4.0, heading) + Vector3::z() * climb;
        prop_assert!(near(aim.velocity_m_s, expected), "{aim:?}, not {expected:?}");
        prop_assert!((aim.yaw_rate_rad_s + yaw * 1.5).abs() < 1e-5);
        prop_assert!(same(&aim.position_m, &NAN) && aim.speed_m_s == 4.0);

        let altitude = wish(FlightMode::Altitude);
        let Way::Leaning(aim, [x, y]) = altitude.way else { panic!("{altitude:?}") };
        let lean = |stick: f32| 9.81 * (stick * 0.6).tan();
        prop_assert!(near(Vector3::new(x, y, 0.0), turned(lean(pitch), lean(-roll), heading)), "{x}, {y}");
        prop_assert!(aim.velocity_m_s.x.is_nan() && aim.velocity_m_s.y.is_nan() && aim.velocity_m_s.z == climb);
        prop_assert!((aim.yaw_rate_rad_s + yaw * 1.5).abs() < 1e-5);

        let stabilised = wish(FlightMode::Stabilised);
        let Way::Direct(setpoint) = stabilised.way else { panic!("{stabilised:?}") };
        let up = (turned((pitch * 0.6).tan(), (-roll * 0.6).tan(), actual) + Vector3::z()).normalize();
        let thrust = 9.81 + throttle * if throttle > 0.0 { 25.0 - 9.81 } else { 9.81 };
        let expected = up * thrust - Vector3::z() * 9.81;
        prop_assert!(near(setpoint.acceleration_m_s2, expected), "{setpoint:?}, not {expected:?}");
        prop_assert!((setpoint.yaw_rate_rad_s + yaw * 1.5).abs() < 1e-5);
        prop_assert_eq!((setpoint.position_m, setpoint.velocity_m_s), (here(), stage.state.velocity_m_s));

        for wish in [position, altitude, stabilised] {
            prop_assert_eq!((wish.lifts, wish.lands, wish.done), (throttle > 0.1, false, false));
        }
    }
}

/// Rotors that do not lift the weight give what they can.
#[test]
fn weak_rotors_give_what_they_can() {
    let weak = Lift { most_m_s2: 8.0, ..LIFT };
    for throttle in [0.0, 1.0] {
        let all = Sticks { throttle, ..Sticks::default() };
        let wish = Stage::at(here()).see(|scene| sticks::fly(FlightMode::Stabilised, &all, scene, &weak));
        let Way::Direct(setpoint) = wish.way else { panic!("{wish:?}") };
        assert!((setpoint.acceleration_m_s2.z - (8.0 - 9.81)).abs() < 1e-4, "{setpoint:?}");
    }
}

// --- Targets. ---

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

/// Each number within its largest value, or NaN where that means that there is none.
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
        targets::is_plausible(&Target::Motion(target))
    };
    for (index, most) in [1e5, 1e5, 1e5, 1e3, 1e3, 1e3, 1e2, 1e2, 1e2, 1e3, 1e2].into_iter().enumerate() {
        assert!(with(index, f32::NAN) && with(index, most) && with(index, -most), "{index}");
        assert!(!with(index, most * 1.01) && !with(index, -most * 1.01) && !with(index, f32::INFINITY), "{index}");
    }
    let attitude = |target: AttitudeTarget| targets::is_plausible(&Target::Attitude(target));
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

fn aimed(stage: &Stage, targets: &mut Targets, target: MotionTarget, at_us: u64) -> (Wish, Aim) {
    let stamped = Stamped { value: Target::Motion(target), at_us };
    let wish = stage.see(|scene| targets.fly(&stamped, scene, &LIFT));
    (wish, limited(&wish))
}

/// A target of the local frame is aimed at as it is, as one of a stream, with the largest speed.
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
        let (_, aim) = aimed(&stage, &mut Targets::default(), target, 77);
        assert!(same(&aim.position_m, &target.position_m) && same(&aim.velocity_m_s, &target.velocity_m_s));
        assert_eq!((aim.acceleration_m_s2, aim.yaw_rad, aim.yaw_rate_rad_s), (v(0.4, 0.5, 0.6), 0.7, 0.8));
        assert_eq!((aim.sent_us, aim.speed_m_s, aim.up_m_s, aim.down_m_s), (Some(77), expected, 3.0, 2.0));
    }
}

/// A target of the vehicle's frame: forward and left of its heading, from where it is when the message comes.
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
    let (mut targets, stage) = (Targets::default(), Stage::at(here()).apart(Vector3::new(0.5, 0.5, 0.5)));
    let (_, aim) = aimed(&stage, &mut targets, target, 10);
    let near = |a: Vector3<f32>, b: Vector3<f32>| (a - b).norm() < 2e-3;
    assert!(near(aim.position_m, here() + heading * target.position_m), "{aim:?}");
    assert!(near(aim.velocity_m_s, heading * target.velocity_m_s), "{aim:?}");
    assert!(near(aim.acceleration_m_s2, heading * target.acceleration_m_s2), "{aim:?}");
    assert!((aim.yaw_rad - 1.4).abs() < 1e-6 && aim.sent_us.is_none(), "{aim:?}");
    // The vehicle moves on and turns: the place stays, until the next message.
    let mut later = Stage::at(here() + Vector3::new(1.0, 0.0, 0.0));
    later.present.yaw_rad = 0.2;
    let (_, again) = aimed(&later, &mut targets, target, 10);
    assert_eq!((again.position_m, again.yaw_rad), (aim.position_m, aim.yaw_rad));
    let (_, next) = aimed(&later, &mut targets, target, 11);
    let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.2) * target.position_m;
    assert!(near(next.position_m, later.state.position_m + turned) && (next.yaw_rad - 0.5).abs() < 1e-6, "{next:?}");
}

/// A target lifts the vehicle off if it is above it, or upwards where no height is given, or a whole trajectory.
#[test]
fn targets_above_or_upwards_lift() {
    let stage = Stage { airborne: false, ..Stage::at(here()) };
    let lifts = |target: MotionTarget| aimed(&stage, &mut Targets::default(), target, 1).0.lifts;
    let above = |up: f32| MotionTarget { position_m: Vector3::new(f32::NAN, f32::NAN, 8.0 + up), ..motion() };
    assert!(lifts(above(0.11)) && !lifts(above(0.09)) && !lifts(above(-5.0)));
    let climbs = |up: f32| MotionTarget { velocity_m_s: Vector3::new(0.0, 0.0, up), ..motion() };
    assert!(lifts(climbs(0.06)) && !lifts(climbs(0.04)) && !lifts(climbs(-1.0)));
    let pulls = |up: f32| MotionTarget { acceleration_m_s2: Vector3::new(0.0, 0.0, up), ..motion() };
    assert!(lifts(pulls(0.06)) && !lifts(pulls(0.04)) && !lifts(pulls(-1.0)) && !lifts(motion()));
    // The height counts before the speed.
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
    /// An attitude and a share of the thrust accelerate along the attitude's z; the heading is the attitude's, or turns
    /// at a rate.
    #[test]
    fn an_attitude_target_accelerates_along_its_z(
        roll in -1.2..1.2f32, pitch in -1.2..1.2f32, yaw in -3.1..3.1f32, rate in prop::option::of(-2.0..2.0f32),
        thrust in 0.0..1.0f32,
    ) {
        let attitude = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        let target = AttitudeTarget { attitude, yaw_rate_rad_s: rate.unwrap_or(f32::NAN), thrust };
        let stamped = Stamped { value: Target::Attitude(target), at_us: 1 };
        let stage = Stage::at(here());
        let wish = stage.see(|scene| Targets::default().fly(&stamped, scene, &LIFT));
        let Way::Direct(setpoint) = wish.way else { panic!("{wish:?}") };
        let expected = attitude * Vector3::z() * (25.0 * thrust) - Vector3::z() * 9.81;
        prop_assert!((setpoint.acceleration_m_s2 - expected).norm() < 1e-3, "{setpoint:?}, not {expected:?}");
        let (heading, turns) = rate.map_or((yaw, 0.0), |rate| (0.8, rate));
        prop_assert!((setpoint.yaw_rad - heading).abs() < 1e-3 && setpoint.yaw_rate_rad_s == turns, "{setpoint:?}");
        prop_assert_eq!(setpoint.position_m, here());
        prop_assert_eq!((wish.lifts, wish.lands, wish.done), (25.0 * thrust > 0.8 * 9.81, false, false));
    }
}

// --- Hold, take-off, landing and return. ---

/// It stops first, and then holds the place where it stands.
#[test]
fn a_hold_is_where_it_comes_to_stand() {
    let mut hold = Hold::default();
    let fast = Stage::at(here()).moving(Vector3::new(1.0, 0.0, 0.0));
    assert!(same(&fast.see(|scene| hold.fly(scene)).position_m, &NAN));
    let stands = Stage::at(here()).apart(Vector3::new(0.2, 0.0, 0.0));
    let at_m = here() + Vector3::new(0.2, 0.0, 0.0);
    assert_eq!(stands.see(|scene| hold.fly(scene)).position_m, at_m);
    let later = Stage::at(Vector3::zeros()).see(|scene| hold.fly(scene));
    assert!(later.position_m == at_m && later.yaw_rad.is_nan() && later.speed_m_s == 4.0, "{later:?}");
    // What was ordered.
    let mut ordered = Hold { at_m: Some(here()), yaw_rad: Some(0.4), speed_m_s: Some(7.0) };
    let aim = Stage { speed_m_s: 8.0, ..Stage::at(Vector3::zeros()) }.see(|scene| ordered.fly(scene));
    assert_eq!((aim.position_m, aim.yaw_rad, aim.speed_m_s), (here(), 0.4, 7.0));
    assert_eq!(Stage { speed_m_s: 3.0, ..Stage::at(here()) }.see(|scene| ordered.fly(scene)).speed_m_s, 3.0);
}

/// Done is a take-off in the air, with a setpoint that stands at its end and a vehicle that is hardly below.
#[test]
fn a_takeoff_ends_at_its_height() {
    let from = Vector3::new(3.0, 4.0, 2.0);
    for (height, short) in [(2.0, 0.3), (10.0, 1.0)] {
        let takeoff = Stage::at(from).see(|scene| Takeoff::new(scene, height));
        let to = from + Vector3::new(0.0, 0.0, height);
        assert_eq!(takeoff.to_m, to);
        // The vehicle below the end, and the setpoint above or below it.
        let wish = |below: f32, off: f32, stage: fn(Stage) -> Stage| {
            let at = Stage::at(to - along(2, below)).apart(along(2, below + off));
            stage(at).see(|scene| takeoff.fly(scene))
        };
        let plain = wish(0.0, 0.0, |stage| stage);
        let aim = limited(&plain);
        assert_eq!((aim.position_m, aim.up_m_s, aim.speed_m_s, plain.lifts, plain.lands), (to, 1.2, 4.0, true, false));
        assert!(plain.done && wish(-5.0, 0.0, |stage| stage).done);
        assert!(wish(short - 0.01, 0.0, |stage| stage).done && !wish(short + 0.01, 0.0, |stage| stage).done);
        assert!(wish(0.0, 0.049, |stage| stage).done && !wish(0.0, 0.051, |stage| stage).done);
        assert!(wish(0.0, -0.049, |stage| stage).done && !wish(0.0, -0.051, |stage| stage).done);
        assert!(!wish(0.0, 0.0, |stage| Stage { airborne: false, ..stage }).done);
        assert!(!wish(0.0, 0.0, |stage| stage.moving(Vector3::new(0.1, 0.0, 0.0))).done);
    }
}

/// It lands where its setpoint has stopped, however fast it sinks.
#[test]
fn a_landing_is_where_it_stops() {
    let mut land = Land::default();
    for (velocity, stops) in [([0.06, 0.0, 0.0], false), ([0.0, -0.06, 0.0], false), ([0.03, 0.03, -1.5], true)] {
        let wish = Stage::at(here()).moving(velocity.into()).see(|scene| land.fly(scene));
        assert_eq!((wish.lands, wish.lifts, wish.done, land.over_m.is_some()), (true, false, false, stops));
        let over = if stops { here().x } else { f32::NAN };
        assert!(same(&limited(&wish).position_m, &Vector3::new(over, if stops { here().y } else { over }, f32::NAN)));
    }
    let wish = Stage::at(Vector3::zeros()).see(|scene| land.fly(scene));
    assert_eq!(limited(&wish).position_m.xy(), here().xy(), "it stays there");
}

/// It climbs to the return height above home, unless it is near, higher, or under a ceiling; flies there, heading for
/// home; and descends over it.
#[test]
fn a_return_climbs_flies_and_descends() {
    let Flying { near_home_m, return_height_m, .. } = flying();
    let home = Stage::at(here()).home_m;
    let safe = home.z + return_height_m;
    let climbs = |place: Vector3<f32>, ceiling_m: f32| {
        let stage = Stage { ceiling_m, ..Stage::at(place) };
        let wish = stage.see(|scene| Return::new(scene).fly(scene));
        assert_eq!((wish.lands, wish.lifts, wish.done), (false, false, false));
        assert_eq!(limited(&wish).position_m.xy(), place.xy());
        limited(&wish).position_m.z
    };
    let far = |z: f32| Vector3::new(home.x + 0.8 * near_home_m, home.y + 0.7 * near_home_m, z);
    let near = |z: f32| Vector3::new(home.x + 0.7 * near_home_m, home.y - 0.7 * near_home_m, z);
    assert_eq!(climbs(far(3.0), f32::INFINITY), safe);
    assert_eq!(climbs(far(safe + 7.0), f32::INFINITY), safe + 7.0);
    assert_eq!(climbs(far(3.0), 9.0), 9.0);
    assert_eq!(climbs(near(3.0), f32::INFINITY), 3.0);

    // While it stops it climbs already.
    let mut back = Stage::at(far(3.0)).see(Return::new);
    let stops = Stage::at(far(3.0)).moving(Vector3::new(2.0, 0.0, 0.0)).see(|scene| back.fly(scene));
    assert!(same(&limited(&stops).position_m, &Vector3::new(f32::NAN, f32::NAN, safe)));
    // The climb is over if the setpoint is nearly there, and the vehicle within a metre.
    for (setpoint, vehicle, over) in [(0.29, 0.99, true), (0.31, 0.9, false), (0.2, 1.01, false), (-3.0, -3.0, true)] {
        let mut back = Stage::at(far(3.0)).see(Return::new);
        let stage = Stage::at(far(safe - vehicle)).apart(along(2, vehicle - setpoint));
        let _ = stage.see(|scene| back.fly(scene));
        let aim = limited(&stage.see(|scene| back.fly(scene)));
        let towards = f32::atan2(home.y - far(0.0).y, home.x - far(0.0).x);
        assert_eq!(aim.position_m.xy() == home.xy(), over, "{setpoint}, {vehicle}");
        assert!(!over || (aim.yaw_rad - towards).abs() < 1e-5 && aim.position_m.z == safe, "{aim:?}");
        if over {
            // Over home, slowly, it descends.
            for (off, speed, descends) in [(1.02, 0.0, false), (0.9, 0.31, false), (0.98, 0.29, true)] {
                let over_home = Vector3::new(home.x, home.y, safe);
                let stage = Stage::at(over_home + along(0, off)).moving(along(1, speed));
                let flies = stage.see(|scene| back.fly(scene));
                assert!(!flies.lands);
                let wish = stage.see(|scene| back.fly(scene));
                assert_eq!(wish.lands, descends, "{off} m, {speed} m/s");
                if descends {
                    assert!(same(&limited(&wish).position_m, &Vector3::new(home.x, home.y, f32::NAN)));
                }
            }
        }
    }
}

// --- Missions. ---

fn leg(number: u16, item: Item) -> Leg {
    Leg { number, upload: 1, item, is_last: false }
}

fn waypoint(position_m: Vector3<f32>) -> Item {
    Item::Waypoint { position_m, yaw_rad: f32::NAN, hold_s: 0.0, within_m: 0.0, fly_through: false }
}

fn progress(mission: &mut Mission, stage: &Stage, leg: &Leg) -> mission::Progress {
    stage.see(|scene| mission.fly(Some(leg), scene, |place| place.x.abs() < 1e3))
}

/// A mission that wants this item.
fn wanting(number: u16) -> Mission {
    let mut mission = Mission::default();
    mission.resume(number);
    mission
}

/// A waypoint is reached within its distance or that of the parameters, slowly unless it is flown through, and left
/// after its time.
#[test]
fn waypoints_are_reached_within_their_distance() {
    let place = here();
    let item = |within_m: f32, fly_through: bool, hold_s: f32| Item::Waypoint {
        position_m: place,
        yaw_rad: f32::NAN,
        hold_s,
        within_m,
        fly_through,
    };
    for (within_m, fly_through, off, speed, reached) in [
        (0.0, false, 0.69, 0.0, true),
        (0.0, false, 0.71, 0.0, false),
        (2.0, false, 1.99, 0.29, true),
        (2.0, false, 1.99, 0.31, false),
        (2.0, true, 1.99, 3.0, true),
        (2.0, true, 2.01, 0.0, false),
    ] {
        let stage = Stage::at(place + along(0, off)).moving(along(1, speed));
        let mut mission = wanting(3);
        let step = progress(&mut mission, &stage, &leg(3, item(within_m, fly_through, 0.0)));
        let case = (within_m, fly_through, off, speed);
        assert_eq!((step.reached, step.wish.done, step.refused), (reached.then_some(3), false, false), "{case:?}");
        assert_eq!(mission.wanted, if reached { 4 } else { 3 }, "{case:?}");
        let aim = limited(&step.wish);
        assert_eq!((aim.position_m, aim.speed_m_s), (place, 4.0));
        // The last one ends the mission, and the first is wanted again.
        let mut mission = wanting(3);
        let last = Leg { is_last: true, ..leg(3, item(within_m, fly_through, 0.0)) };
        assert_eq!(progress(&mut mission, &stage, &last).wish.done, reached, "{case:?}");
        assert_eq!(mission.wanted, if reached { 0 } else { 3 }, "{case:?}");
    }
    // It stays for its time from then on, wherever it drifts; one that is flown through does not.
    for (hold_s, fly_through, ticks) in [(0.05, false, 50), (0.05, true, 1), (0.0, false, 1)] {
        let mut mission = wanting(0);
        let one = leg(0, item(0.0, fly_through, hold_s));
        let mut stage = Stage::at(place);
        let steps = (1..200).find(|_| {
            let done = progress(&mut mission, &stage, &one).reached.is_some();
            stage = Stage::at(place + along(0, 5.0));
            done
        });
        assert!(steps.is_some_and(|steps| i32::abs(steps - ticks) <= 1), "{hold_s} s: {steps:?}");
    }
}

/// The heading is the waypoint's, or towards it as seen from where the leg began.
#[test]
fn the_heading_on_the_way_is_towards_the_waypoint() {
    let place = here() + Vector3::new(-30.0, 40.0, 0.0);
    let mut mission = wanting(0);
    let first = progress(&mut mission, &Stage::at(here()), &leg(0, waypoint(place)));
    assert!((limited(&first.wish).yaw_rad - f32::atan2(40.0, -30.0)).abs() < 1e-5);
    let aside = Stage::at(here() + along(0, 60.0));
    let then = progress(&mut mission, &aside, &leg(0, waypoint(place)));
    assert_eq!(limited(&then.wish).yaw_rad, limited(&first.wish).yaw_rad, "as the leg began");
    // Paused, it begins anew.
    mission.pause();
    let anew = progress(&mut mission, &aside, &leg(0, waypoint(place)));
    assert!((limited(&anew.wish).yaw_rad - f32::atan2(40.0, -90.0)).abs() < 1e-5);
    // Another item, too.
    mission.resume(5);
    let other = progress(&mut mission, &Stage::at(here()), &leg(5, waypoint(place)));
    assert_eq!(limited(&other.wish).yaw_rad, limited(&first.wish).yaw_rad);
    let told = Item::Waypoint { position_m: place, yaw_rad: 0.3, hold_s: 0.0, within_m: 1.0, fly_through: true };
    assert_eq!(limited(&progress(&mut wanting(0), &aside, &leg(0, told)).wish).yaw_rad, 0.3);
}

/// From the ground a waypoint begins with a climb to the take-off height, or as far as the ceiling allows.
#[test]
fn a_waypoint_on_the_ground_begins_with_a_climb() {
    let ground = Vector3::new(2.0, 3.0, 1.0);
    for (ceiling_m, top) in [(f32::INFINITY, 1.0 + flying().takeoff_height_m), (2.5, 2.5), (0.5, 1.0)] {
        let mut mission = wanting(0);
        let one = leg(
            0,
            Item::Waypoint { position_m: ground, yaw_rad: f32::NAN, hold_s: 0.0, within_m: 100.0, fly_through: true },
        );
        let stage = Stage { airborne: false, ceiling_m, ..Stage::at(ground) };
        let begins = progress(&mut mission, &stage, &one);
        assert!(begins.wish.lifts && begins.reached.is_none());
        assert!((limited(&begins.wish).position_m - Vector3::new(2.0, 3.0, top)).norm() < 1e-6, "{begins:?}");
        // At its top the climb is done, and the waypoint's turn has come.
        let climbed = Stage { ceiling_m, ..Stage::at(Vector3::new(2.0, 3.0, top)) };
        let step = progress(&mut mission, &climbed, &one);
        assert_eq!((step.reached, step.wish.done), (None, false));
        assert_eq!(progress(&mut mission, &climbed, &one).reached, Some(0));
    }
    // In the air it does not.
    let step = progress(&mut wanting(0), &Stage::at(ground), &leg(0, waypoint(ground + along(0, 50.0))));
    assert!(!step.wish.lifts);
}

/// A take-off climbs to its height where it is, or not at all if it is higher, and is reached there.
#[test]
fn a_takeoff_item_climbs_to_its_height() {
    for (z, top) in [(1.0, 6.0), (9.0, 9.0)] {
        let mut mission = wanting(0);
        let stage = Stage { airborne: false, ..Stage::at(Vector3::new(2.0, 3.0, z)) };
        let item = Item::TakeOff { height_m: 6.0 };
        let step = progress(&mut mission, &stage, &leg(0, item));
        assert!(step.wish.lifts && step.reached.is_none() && limited(&step.wish).position_m.z == top, "{step:?}");
        let there = Stage::at(Vector3::new(2.0, 3.0, top));
        assert_eq!(progress(&mut mission, &there, &leg(0, item)).reached, Some(0));
        // The place is held until the next item comes.
        let waits = progress(&mut mission, &Stage::at(here()), &leg(0, item));
        assert_eq!((waits.reached, limited(&waits.wish).position_m), (None, Vector3::new(2.0, 3.0, top)));
    }
}

/// Over its place, within a metre and slowly, a landing begins; where it is, at once.
#[test]
fn a_landing_item_flies_over_its_place() {
    let place = Vector3::new(20.0, 30.0, -7.0);
    let over = |off: Vector3<f32>, speed: f32| {
        let mut mission = wanting(2);
        let item = leg(2, Item::Land { position_m: place });
        let begins = progress(&mut mission, &Stage::at(here()), &item);
        assert!(begins.then.is_none() && limited(&begins.wish).position_m == Vector3::new(20.0, 30.0, here().z));
        let stage = Stage::at(Vector3::new(20.0, 30.0, here().z) + off).moving(along(0, speed));
        let step = progress(&mut mission, &stage, &item);
        assert_eq!(limited(&step.wish).position_m, Vector3::new(20.0, 30.0, here().z), "the height stays");
        assert!(step.then.is_none_or(|then| then == (FlightMode::Land, 2)));
        step.then.is_some()
    };
    assert!(over(Vector3::zeros(), 0.0) && over(along(1, 0.99), 0.29));
    assert!(!over(along(1, 1.01), 0.0) && !over(along(2, 1.01), 0.0) && !over(Vector3::zeros(), 0.31));
    for missing in 0..2 {
        let mut position_m = place;
        position_m.iter_mut().nth(missing).into_iter().for_each(|value| *value = f32::NAN);
        let step = progress(&mut wanting(2), &Stage::at(here()), &leg(2, Item::Land { position_m }));
        assert_eq!(step.then, Some((FlightMode::Land, 2)));
    }
    let step = progress(&mut wanting(2), &Stage::at(here()), &leg(2, Item::Return));
    assert_eq!(step.then, Some((FlightMode::Return, 2)));
}

/// A speed counts from its item on, up to what was ordered; another mission begins without it, at its first item.
#[test]
fn a_speed_counts_until_the_mission_is_another() {
    let mut mission = wanting(0);
    let stands = Stage::at(here());
    let step = progress(&mut mission, &stands, &leg(0, Item::Speed(2.5)));
    assert_eq!((step.reached, mission.wanted, limited(&step.wish).position_m), (Some(0), 1, here()));
    let far = waypoint(here() + along(0, 50.0));
    let speed = |mission: &mut Mission, ordered: f32, leg: &Leg| {
        limited(&progress(mission, &Stage { speed_m_s: ordered, ..stands }, leg).wish).speed_m_s
    };
    assert_eq!(speed(&mut mission, f32::INFINITY, &leg(1, far)), 2.5);
    assert_eq!(speed(&mut mission, 2.0, &leg(1, far)), 2.0);
    let other = Leg { upload: 2, ..leg(1, far) };
    let waits = progress(&mut mission, &stands, &other);
    assert_eq!((mission.wanted, waits.reached, waits.wish.done), (0, None, false), "not the item that is wanted");
    assert_eq!(speed(&mut mission, f32::INFINITY, &Leg { upload: 2, ..leg(0, far) }), 4.0);
}

/// Without the item that is wanted it stays where it is; without a mission, it is done.
#[test]
fn without_its_item_a_mission_waits_or_is_over() {
    let mut mission = wanting(4);
    let waits = progress(&mut mission, &Stage::at(here()), &leg(3, waypoint(Vector3::zeros())));
    assert_eq!((waits.wish.done, waits.reached, waits.refused, waits.then), (false, None, false, None));
    assert_eq!(limited(&waits.wish).position_m, here());
    let over = Stage::at(here()).see(|scene| mission.fly(None, scene, |_| true));
    assert!(over.wish.done && over.reached.is_none());
}

/// Items outside of the fence or with impossible numbers are refused.
#[test]
fn items_that_cannot_be_flown_are_refused() {
    let v = Vector3::new;
    let nan = f32::NAN;
    let waypoint = |position_m, yaw_rad, hold_s, within_m| Item::Waypoint {
        position_m,
        yaw_rad,
        hold_s,
        within_m,
        fly_through: false,
    };
    let ok = v(100.0, 2.0, 3.0);
    let cases = [
        (waypoint(ok, nan, 0.0, 0.0), false),
        (waypoint(ok, 1e3, 0.0, 0.0), false),
        (waypoint(ok, -1.1e3, 0.0, 0.0), true),
        (waypoint(ok, 0.0, nan, 0.0), true),
        (waypoint(ok, 0.0, 0.0, nan), true),
        (waypoint(v(1.0, 9.1e4, 3.0), 0.0, 0.0, 0.0), true),
        (waypoint(v(1.0, 8.9e4, 3.0), 0.0, 0.0, 0.0), false),
        (waypoint(v(1.0, 2.0, nan), 0.0, 0.0, 0.0), true),
        (waypoint(v(1e4, 0.0, 3.0), 0.0, 0.0, 0.0), true),
        (Item::TakeOff { height_m: 5.0 }, false),
        (Item::TakeOff { height_m: nan }, true),
        (Item::TakeOff { height_m: 9.1e4 }, true),
        (Item::Land { position_m: v(nan, nan, nan) }, false),
        (Item::Land { position_m: v(5.0, 5.0, nan) }, false),
        (Item::Land { position_m: v(5.0, -9.1e4, 0.0) }, true),
        (Item::Land { position_m: v(1e4, 5.0, 0.0) }, true),
        (Item::Return, false),
        (Item::Speed(0.1), false),
        (Item::Speed(0.0), true),
        (Item::Speed(nan), true),
    ];
    for (item, refused) in cases {
        let mut mission = wanting(0);
        let step = progress(&mut mission, &Stage::at(here()), &leg(0, item));
        assert_eq!(step.refused, refused, "{item:?}");
        assert!(!refused || step.reached.is_none() && step.then.is_none() && mission.wanted == 0);
    }
    // A take-off over a home that the fence excludes.
    let far = Stage { home_m: v(2e3, 0.0, 0.0), ..Stage::at(here()) };
    assert!(progress(&mut wanting(0), &far, &leg(0, Item::TakeOff { height_m: 5.0 })).refused);
}
