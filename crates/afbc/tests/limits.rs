//! Limits on the demands of the cascade, for every accepted limit and every plausible state and setpoint.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use crate::common;
use afbc::integral::IntegralBackstepping;
use afbc::reference::ReferenceModel;
use afbc::{Adaptive, Backstepping, Controller, PositionControlLimits, Profile, Settings, backstepping};
use afbc_control::{Errors, FlightController, Smoothing, Validated};
use afbc_types::{Axis, Declaration, Declared, Parameters, PerAxis, Setpoint, State};
use common::{Stepped, U, gains, limits, plausible, setpoint, settings, state, step};
use nalgebra::Vector3;
use proptest::prelude::*;

const GRAVITY_M_S2: f64 = 9.81;
const WEIGHT_N: f32 = 0.486 * 9.81;

/// Error of a rotation by the yaw angle: sine and cosine are off by up to 1.7e-4.
const ROTATION: f64 = 4e-4;

fn adaptive(gains: PerAxis<afbc::adaptive::Gains>, settings: Settings) -> Controller<Adaptive> {
    Controller::new(Parameters::PAPER.to_f32(), settings, Adaptive::new(gains).unwrap()).unwrap()
}

/// Returns the profile's settings without reference model and input filters.
fn direct() -> Settings {
    Settings { reference: ReferenceModel::DEFAULT, smoothing: Smoothing::DEFAULT, ..Profile::Flight.settings() }
}

fn flight(limits: PositionControlLimits) -> Controller<Adaptive> {
    adaptive(Profile::Flight.gains(), Settings { limits, ..direct() })
}

/// Returns the tangent of the angle between vertical and thrust in the desired attitude.
fn tilt_tangent(command: &Stepped) -> f64 {
    let [phi, theta] = command.trace.desired_rad.map(f64::from);
    let cosine = phi.cos() * theta.cos();
    // Uses 1 - cos^2 = sin^2 phi + cos^2 phi sin^2 theta, which is accurate near zero.
    (phi.sin().powi(2) + (phi.cos() * theta.sin()).powi(2)).sqrt() / cosine
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn tilt_and_tilt_rate_stay_within_their_limits(
        gains in gains(),
        settings in settings(),
        inputs in prop::collection::vec((state(plausible), setpoint(plausible)), 20),
    ) {
        let controller = adaptive(gains, settings);
        let mut memory = Validated::default();
        let PositionControlLimits { tilt_max_rad, tilt_rate_max_rad_s, .. } = settings.limits;
        let tangent_max = f64::from(tilt_max_rad).tan() * (1.0 + ROTATION);
        let rate_max = f64::from(tilt_rate_max_rad_s);
        let mut before = None;
        for (state, setpoint) in inputs {
            let command = step(&controller, &mut memory, &state, &setpoint);
            let tangent = tilt_tangent(&command);
            // 90 degrees is 1.5708, where the tangent is ill-conditioned.
            prop_assert!(tangent <= tangent_max * (1.0 + 4.0 * U * tangent_max), "{tangent} beyond {tangent_max}");
            for (now, then) in command.trace.filtered.iter().zip(before.unwrap_or(command.trace.filtered)) {
                prop_assert!(f64::from(now.rate).abs() <= rate_max, "{now:?}");
                let travel = (f64::from(now.angle) - f64::from(then.angle)).abs();
                let rounding = 4.0 * U * (f64::from(then.angle).abs() + 1.0);
                prop_assert!(
                    travel <= rate_max * f64::from(settings.common.dt_s) * (1.0 + 4.0 * U) + rounding,
                    "{travel} rad in a step"
                );
            }
            before = Some(command.trace.filtered);
        }
    }

    /// (40) gives the accelerations (u5, u6), reduced to the limits in the same direction, with the vertical part of
    /// the commanded thrust, at any yaw.
    #[test]
    fn limits_cut_the_size_and_keep_the_direction(
        state in state(plausible),
        setpoint in setpoint(plausible),
        limits in limits(),
        yaw_rad in -9.0_f32..9.0,
        by_thrust: bool,
    ) {
        let attitude_rad = Vector3::new(state.attitude_rad.x, state.attitude_rad.y, yaw_rad);
        let state = State { attitude_rad, ..state };
        let settings = Settings { limits, tilt_by_thrust: by_thrust, ..direct() };
        let command = step(&adaptive(Profile::Flight.gains(), settings), &mut Validated::default(), &state, &setpoint);

        let [u5, u6] = command.trace.virtual_m_s2.map(f64::from);
        let cosine = f64::from(afbc_control::math::tilt_cosine(attitude_rad.x, attitude_rad.y));
        let thrust = command.trace.inputs.thrust_n.min(4.0 * settings.common.rotor_force_max_n);
        let upward = f64::from(thrust) * cosine / f64::from(WEIGHT_N);
        let vertical = if by_thrust { GRAVITY_M_S2 * upward.max(0.3) } else { GRAVITY_M_S2 };
        // Height comes first: at the largest tilt the rotors still give the vertical thrust that the law asks for, up
        // to 1.1 times the hover thrust and half of it more per m/s of a descent, or leave a horizontal margin of three
        // tenths.
        let enough = 1.1 + 0.5 * f64::from(-state.velocity_m_s.z).max(0.0);
        let most_n = 0.95 * 4.0 * f64::from(settings.common.rotor_force_max_n);
        let asked_n = (f64::from(command.trace.inputs.thrust_n) * cosine).min(enough * f64::from(WEIGHT_N));
        let kept_n = asked_n.min(most_n * 0.91_f64.sqrt());
        let room = (most_n * most_n - kept_n * kept_n).sqrt() / kept_n;
        let room = if by_thrust && kept_n > 0.0 { room } else { f64::INFINITY };
        let tilt = f64::from(limits.tilt_max_rad).tan().min(room);
        let max = (vertical * tilt).min(f64::from(limits.acceleration_max_m_s2));
        let size = u5.hypot(u6);
        let scale = if size > max { max / size } else { 1.0 };

        let [phi, theta] = command.trace.desired_rad.map(f64::from);
        let (forward, left) = (vertical * theta.tan(), -vertical * phi.tan() / theta.cos());
        // With `by_rotation`, roll and pitch belong to an attitude with the setpoint's yaw.
        let (sin, cos) = f64::from(if settings.by_rotation { setpoint.yaw_rad } else { yaw_rad }).sin_cos();
        let got = [forward * cos - left * sin, forward * sin + left * cos];
        // The tolerance covers errors of the rotation, and the rounding of angles near 90 degrees, amplified by their
        // tangent.
        let steep = (scale * size / vertical).powi(2) + 1.0;
        let allowed = scale * size * ROTATION + 8.0 * U * vertical * steep;
        prop_assert!(
            (got[0] - scale * u5).hypot(got[1] - scale * u6) <= allowed,
            "{got:?} of {u5}, {u6} scaled by {scale}"
        );
    }

    /// (12) with e_1 of x, y and z cut so that the approach speed stays within the limit, in addition to the
    /// reference's speed. The approach speed is alpha_1 e_1, or with feed-forward the position gain divided by the rate
    /// gain, times e_1. Within the limit e_1 is the distance.
    // At the limit, e_2 uses the approach speed per error for alpha_1.
    #[test]
    fn errors_ask_for_no_more_than_the_speed_limit(
        gains in gains(),
        limits in limits(),
        state in state(plausible),
        setpoint in setpoint(plausible),
        feed_forward: bool,
    ) {
        let settings = Settings { limits, feed_forward, ..direct() };
        let command = step(&adaptive(gains, settings), &mut Validated::default(), &state, &setpoint);
        let PositionControlLimits { speed_max_m_s, climb_max_m_s, .. } = limits;
        for (i, axis, max) in [(0, Axis::X, speed_max_m_s), (1, Axis::Y, speed_max_m_s), (2, Axis::Z, climb_max_m_s)] {
            let backstepping::Gains { alpha1, alpha2, stiffness } = gains[axis].backstepping;
            let [alpha1, alpha2, c, max] = [alpha1, alpha2, stiffness, max].map(f64::from);
            let Errors { e1, e1_dot, e2 } = command.trace.errors[axis];
            let gain = alpha2 * if axis == Axis::Z { 1.0 / 0.486 } else { 1.0 };
            let approach = if feed_forward { (c + alpha1 * gain) / (alpha1 + gain) } else { alpha1 };
            let (distance, x1d_dot, x2) =
                (setpoint.position_m[i] - state.position_m[i], setpoint.velocity_m_s[i], state.velocity_m_s[i]);
            let speed = approach * f64::from(distance);
            let asked = speed.clamp(-max, max);
            let slope = if e1 == distance { alpha1 } else { approach };
            let wanted = f64::from(x1d_dot) + slope * f64::from(e1) - f64::from(x2);
            let size = f64::from(x1d_dot).abs() + slope * f64::from(e1).abs() + f64::from(x2).abs();
            prop_assert!((f64::from(e2) - wanted).abs() <= 10.0 * U * size, "{axis:?}: {e2} for {wanted}");
            prop_assert!(
                (approach * f64::from(e1) - asked).abs() <= 8.0 * U * asked.abs(),
                "{axis:?}: {e1} m of {distance} m"
            );
            prop_assert!(e1 == distance || speed.abs() > max * (1.0 - 8.0 * U), "{axis:?}: {e1} m of {distance} m");
            prop_assert_eq!(e1_dot, x1d_dot - x2);
        }
    }

    /// Whole turns added to the setpoint's yaw change nothing, and the yaw error is wrapped to +-pi.
    #[test]
    fn the_yaw_error_is_wrapped(yaw in -3.0_f32..3.0, wanted in -3.0_f32..3.0, turns in -20_i32..20) {
        let error = |yaw_rad: f32, wanted_rad: f32| {
            let state = State { attitude_rad: Vector3::new(0.0, 0.0, yaw_rad), ..State::default() };
            let setpoint = Setpoint { yaw_rad: wanted_rad, ..Setpoint::default() };
            step(&flight(PositionControlLimits::NONE), &mut Validated::default(), &state, &setpoint).trace.errors.yaw.e1
        };
        let turn = core::f32::consts::TAU * turns as f32;
        let short = error(yaw, wanted);
        prop_assert!(short.abs() <= core::f32::consts::PI);
        prop_assume!(short.abs() < 3.1);
        for other in [error(yaw, wanted + turn), error(yaw + turn, wanted)] {
            // Sine and cosine of many turns are off by up to 1.7e-4.
            prop_assert!((other - short).abs() < 4e-4, "{other} for {short}");
        }
    }
}

/// However far the setpoint is, every law accelerates towards it, and the fixed laws do not accelerate at the speed
/// limit: beyond it e_1 (1 - alpha_1^2) of (16) must not act the other way.
#[test]
fn a_distant_setpoint_is_approached_at_the_speed_limit() {
    fn thrust<C: FlightController>(controller: &C, up_m: f32, climb_m_s: f32) -> f32 {
        let setpoint = Setpoint { position_m: Vector3::new(0.0, 0.0, up_m), ..Setpoint::default() };
        let state = State { velocity_m_s: Vector3::new(0.0, 0.0, climb_m_s), ..State::default() };
        step(controller, &mut Validated::default(), &state, &setpoint).trace.inputs.thrust_n
    }
    fn check<C: FlightController>(controller: &C) {
        for up_m in [0.3, 1.5, 5.0, 10.0, 100.0, 1e4] {
            let (up, down) = (thrust(controller, up_m, 0.0), thrust(controller, -up_m, 0.0));
            assert!(up > 1.2 * WEIGHT_N && down < 0.8 * WEIGHT_N, "{up} N for {up_m} m up, {down} N for as much down");
        }
        let climb_m_s = Profile::Flight.settings().limits.climb_max_m_s;
        for far_m in [5.0, 100.0] {
            for sign in [1.0, -1.0] {
                let at_limit = thrust(controller, sign * far_m, sign * climb_m_s);
                assert!((at_limit - WEIGHT_N).abs() < 1e-3, "{at_limit} N at the speed limit, {far_m} m away");
            }
        }
    }
    let (vehicle, settings, gains) = (Parameters::PAPER.to_f32(), direct(), Profile::Flight.gains());
    check(&flight(settings.limits));
    let fixed = PerAxis::from_fn(|axis| gains[axis].backstepping);
    check(&Controller::new(vehicle, settings, Backstepping::new(&vehicle, fixed).unwrap()).unwrap());
    let integral = gains.map(|gains| gains.into());
    check(&Controller::new(vehicle, settings, IntegralBackstepping::new(&vehicle, integral).unwrap()).unwrap());
}

/// At all angles of the attitude, including upside down, no division by the cosine of the tilt fails.
#[test]
fn no_attitude_is_singular() {
    let controller = flight(Profile::Flight.settings().limits);
    let setpoint = Setpoint { position_m: Vector3::new(3.0, -2.0, 1.0), ..Setpoint::default() };
    let tangent_max = f64::from(Profile::Flight.settings().limits.tilt_max_rad).tan() * (1.0 + ROTATION);
    for roll in -36..=36 {
        for pitch in -36..=36 {
            let angle = |step: i32| step as f32 * core::f32::consts::PI / 36.0;
            let state = State { attitude_rad: Vector3::new(angle(roll), angle(pitch), 0.0), ..State::default() };
            let command = step(&controller, &mut Validated::default(), &state, &setpoint);
            common::check_step(&command, &Profile::Flight.settings()).unwrap();
            assert!(tilt_tangent(&command) <= tangent_max, "{command:?}");
        }
    }
}

#[test]
fn limits_out_of_range_are_refused_by_name() {
    type Set = fn(&mut PositionControlLimits, f32);
    let cases: [(Declaration, Set); 5] = [
        (PositionControlLimits::TILT, |l, v| l.tilt_max_rad = v),
        (PositionControlLimits::RATE, |l, v| l.tilt_rate_max_rad_s = v),
        (PositionControlLimits::ACCEL, |l, v| l.acceleration_max_m_s2 = v),
        (PositionControlLimits::SPEED, |l, v| l.speed_max_m_s = v),
        (PositionControlLimits::CLIMB, |l, v| l.climb_max_m_s = v),
    ];
    for (Declaration { range, .. }, set) in cases {
        let with = |value| {
            let mut settings = Profile::Flight.settings();
            set(&mut settings.limits, value);
            settings.validate().map_err(|error| error.range.name)
        };
        let (min, max) = (range.min as f32, range.max as f32);
        assert_eq!((with(min), with(max)), (Ok(()), Ok(())));
        for bad in [min.next_down(), max.next_up(), 0.0, f32::NAN, f32::INFINITY] {
            assert_eq!(with(bad), Err(range.name), "{bad}");
        }
    }
}
