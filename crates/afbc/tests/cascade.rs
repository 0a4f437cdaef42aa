//! Composition of the cascade: the context and tracking of each subsystem, the use of its input, and the memory between
//! steps. `law.rs` and `integral.rs` compare the laws themselves with their equations.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use crate::common::step;
use afbc::desired::desired_attitude;
use afbc::integral::IntegralBackstepping;
use afbc::law::{StepContext, SubsystemTracking};
use afbc::model::{ModelConstants, RollPitch};
use afbc::{Adaptive, Backstepping, Controller, PositionControlLimits, Profile, Settings, SubsystemLaw};
use afbc_control::command_filter::Filtered;
use afbc_control::{FlightController, Validated};
use afbc_types::{Axis, Inputs, Parameters, PerAxis, Setpoint, State};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

/// Time step for differentiating the acceleration's path \[s\].
const STEP_S: f64 = 1e-4;
const GRAVITY_M_S2: f64 = 9.81;
const WEIGHT_N: f64 = 0.486 * 9.81;

/// Error of a rotation by the yaw angle: sine and cosine are off by up to 1.7e-4.
const ROTATION: f64 = 4e-4;

fn vector(size: f32) -> impl Strategy<Value = Vector3<f32>> {
    prop::array::uniform3(-size..size).prop_map(Vector3::from)
}

fn near() -> impl Strategy<Value = (State, Setpoint)> {
    let state = (vector(0.5), vector(0.5), vector(0.4), vector(1.0), -3.0_f32..3.0).prop_map(
        |(position_m, velocity_m_s, lean, rates_rad_s, yaw)| State {
            position_m,
            velocity_m_s,
            attitude_rad: Vector3::new(lean.x, lean.y, yaw),
            rates_rad_s,
        },
    );
    let setpoint = (vector(0.5), vector(0.5), vector(1.0), (vector(3.0), vector(10.0)), vector(1.0)).prop_map(
        |(position_m, velocity_m_s, acceleration_m_s2, (jerk_m_s3, snap_m_s4), yaw)| Setpoint {
            position_m,
            velocity_m_s,
            acceleration_m_s2,
            jerk_m_s3,
            snap_m_s4,
            yaw_rad: 3.0 * yaw.x,
            yaw_rate_rad_s: yaw.y,
            yaw_acceleration_rad_s2: yaw.z,
        },
    );
    (state, setpoint)
}

/// Draws the paper's settings with random switches, and limits that may cut the desired attitude.
fn settings() -> impl Strategy<Value = Settings> {
    let limits = (0.3_f32..1.5, 1.0_f32..20.0).prop_map(|(tilt_max_rad, acceleration_max_m_s2)| {
        PositionControlLimits { tilt_max_rad, acceleration_max_m_s2, ..PositionControlLimits::NONE }
    });
    (limits, any::<[bool; 4]>(), [10.0_f32..100.0, 5.0_f32..50.0], prop_oneof![Just(3.0_f32), Just(1.5)]).prop_map(
        |(limits, switches, [command_filter_rad_s, forward_rad_s], force_n)| {
            let [tilt_by_thrust, anti_windup, bumpless, feed_forward] = switches;
            let settings =
                Settings { limits, tilt_by_thrust, anti_windup, bumpless, feed_forward, ..Settings::DEFAULT };
            Settings { command_filter_rad_s, forward_rad_s, ..settings.with_rotor_force_max_n(force_n) }
        },
    )
}

/// Returns roll and pitch of a thrust along this acceleration \[m/s2\] in the earth frame, at this yaw.
fn leaning(ahead: [f64; 2], vertical: f64, yaw_rad: f64) -> [f64; 2] {
    let thrust = Rotation3::from_euler_angles(0.0, 0.0, -yaw_rad) * Vector3::new(ahead[0], ahead[1], vertical);
    [(-thrust.y / thrust.norm()).asin(), thrust.x.atan2(thrust.z)]
}

/// Integrates the filter equation d^2 x/dt^2 = w^2 (command - x) - 2 w dx/dt over a step in `f64`, in a hundred
/// substeps.
fn filtered([mut x, mut v]: [f64; 2], command: f64, w: f64) -> [f64; 2] {
    let h = 1e-5;
    for _ in 0..100 {
        let a = w * w * (command - x) - 2.0 * w * v;
        let jerk = -w * w * v - 2.0 * w * a;
        x += h * (v + 0.5 * h * a);
        v += h * (a + 0.5 * h * jerk);
    }
    [x, v]
}

/// Returns d eta/dt for the body rates.
fn eta_dot(state: &State) -> Vector3<f64> {
    let (eta, rates) = (state.attitude_rad.cast::<f64>(), state.rates_rad_s.cast::<f64>());
    let yaw = (rates.y * eta.x.sin() + rates.z * eta.x.cos()) / eta.y.cos();
    Vector3::new(rates.x + eta.y.sin() * yaw, rates.y * eta.x.cos() - rates.z * eta.x.sin(), yaw)
}

/// Memory of the cascade between steps.
#[derive(Clone, Copy, Default)]
struct Carried {
    /// Angles commanded to the filter.
    commanded: [f64; 2],
    filtered: Option<[Filtered; 2]>,
    /// Absorbed jumps of the jerk along x and y, with their rate, and the jerk expected next.
    followed: Option<([[f64; 2]; 2], [f64; 2])>,
    /// Second derivatives of roll, pitch and yaw after the low-pass of the predictor.
    late: Option<[f64; 3]>,
    unallocated: PerAxis<f32>,
    rotor_residual_rad_s: f32,
}

/// Flies `law` in its cascade, and compares each subsystem's errors and input with the law alone.
fn compose<L: SubsystemLaw + Copy>(
    law: L,
    settings: Settings,
    inputs: &[(State, Setpoint)],
    apart: fn(&L::Estimate, &L::Estimate) -> f32,
) -> Result<(), TestCaseError> {
    let vehicle = Parameters::PAPER.to_f32();
    let controller: Controller<L> = Controller::new(vehicle, settings, law).unwrap();
    let model = ModelConstants::new(&vehicle);
    let (mut memory, mut carried) = (Validated::default(), Carried::default());
    let mut estimates = PerAxis::default();
    let known_n = if settings.feed_forward { WEIGHT_N as f32 } else { 0.0 };
    if settings.bumpless {
        law.start(&mut estimates, WEIGHT_N as f32 - known_n);
    }
    for (state, setpoint) in inputs {
        let hover_n = law.hover_thrust_n(&estimates.z, WEIGHT_N as f32, known_n);
        let command = step(&controller, &mut memory, state, setpoint);
        let (trace, action) = (&command.trace, &command.action);
        let context = StepContext {
            state,
            roll_pitch: RollPitch::new(state),
            rotor_residual_rad_s: carried.rotor_residual_rad_s,
            dt_s: settings.common.dt_s,
            adapt: true,
            adapt_z: true,
            unallocated: &carried.unallocated,
            observed_m_s2: Vector3::zeros(),
            softness: 1.0,
            known: settings.feed_forward.then_some(&model),
        };
        // The thrust leads by the rotor lag, because there are no filters, and follows the reference.
        let lag_s = f64::from(settings.disturbance.disturbance_lag_s);
        let up = Rotation3::from_euler_angles(
            f64::from(state.attitude_rad.x),
            f64::from(state.attitude_rad.y),
            f64::from(state.attitude_rad.z),
        ) * Vector3::z();
        let along_thrust = up.dot(&setpoint.jerk_m_s3.cast());
        let ahead_n = if settings.feed_forward { lag_s * along_thrust * WEIGHT_N / GRAVITY_M_S2 } else { 0.0 };
        let seen = command.per_axis();
        let seen = PerAxis { z: (f64::from(seen.z) - ahead_n) as f32, ..seen };
        let mut check = |axis: Axis, tracking: SubsystemTracking, [error_slack, input_slack]: [f64; 2]| {
            let (u, errors) = law.input(axis, &tracking, &context, &mut estimates[axis]);
            let got = trace.errors[axis];
            for (got, wanted) in [(got.e1, errors.e1), (got.e1_dot, errors.e1_dot), (got.e2, errors.e2)] {
                prop_assert!(f64::from(got - wanted).abs() <= 1e-6 + error_slack, "{axis:?}: {got} for {wanted}");
            }
            let (got, scale) = (f64::from(seen[axis]), f64::from(u).abs() + 1.0);
            prop_assert!((got - f64::from(u)).abs() <= 1e-6 * scale + input_slack, "{axis:?}: {got} for {u}");
            // Slightly different errors give a slightly different adaptation.
            let learnt = &memory.control.estimates[axis];
            let off = f64::from(apart(&estimates[axis], learnt));
            prop_assert!(off <= 2e-6 + 1e-2 * error_slack, "{axis:?}: {learnt:?} for {:?}", estimates[axis]);
            estimates[axis] = *learnt;
            Ok(())
        };

        // The errors of the position follow directly from state and setpoint.
        for (index, axis) in [(2, Axis::Z), (0, Axis::X), (1, Axis::Y)] {
            let tracking = SubsystemTracking {
                x1: state.position_m[index],
                x2: state.velocity_m_s[index],
                e1: setpoint.position_m[index] - state.position_m[index],
                x1d_dot: setpoint.velocity_m_s[index],
                x1d_ddot: setpoint.acceleration_m_s2[index],
                approach_1_s: None,
            };
            let turned = ROTATION * lag_s * f64::from(setpoint.jerk_m_s3.norm());
            let slack = if axis == Axis::Z && settings.feed_forward { turned } else { 0.0 };
            check(axis, tracking, [0.0, slack])?;
        }

        // The desired attitude follows from (39) and (40), within the limits.
        let eta = state.attitude_rad.cast::<f64>();
        let thrust_max_n = 4.0 * f64::from(settings.common.rotor_force_max_n);
        let vertical = if settings.tilt_by_thrust {
            let upward = f64::from(seen.z).min(thrust_max_n) * eta.x.cos() * eta.y.cos();
            GRAVITY_M_S2 * (upward / f64::from(hover_n).min(thrust_max_n)).max(0.3)
        } else {
            GRAVITY_M_S2
        };
        let tilt_max = f64::from(settings.limits.tilt_max_rad);
        // Height comes first: at the largest tilt the rotors still give the vertical thrust that the law asks for, up
        // to 1.1 times the hover thrust and half of it more per m/s of a descent, or leave a horizontal margin of three
        // tenths.
        let enough = 1.1 + 0.5 * f64::from(-state.velocity_m_s.z).max(0.0);
        let upward_n = (f64::from(seen.z) * eta.x.cos() * eta.y.cos()).min(enough * f64::from(hover_n));
        let most_n = 0.95 * thrust_max_n;
        let kept_n = upward_n.min(most_n * 0.91_f64.sqrt());
        let room = (most_n.powi(2) - kept_n.powi(2)).sqrt() / kept_n;
        let room = if settings.tilt_by_thrust && kept_n > 0.0 { room } else { f64::INFINITY };
        let most = (vertical * tilt_max.tan().min(room)).min(f64::from(settings.limits.acceleration_max_m_s2));
        let asked = [f64::from(seen.x), f64::from(seen.y)];
        let scale = (most / asked[0].hypot(asked[1])).min(1.0);
        let ahead = asked.map(|u| u * scale);
        let angles = leaning(ahead, vertical, eta.z);
        for (got, wanted) in trace.desired_rad.iter().zip(angles) {
            prop_assert!((f64::from(*got) - wanted).abs() <= 2.0 * ROTATION, "{got} for {wanted}");
        }
        let angles = trace.desired_rad.map(f64::from);

        // The angles lead by the filter's lag. Their derivatives follow from jerk and snap.
        let w = f64::from(settings.command_filter_rad_s);
        // Equation (40) is differentiated along a path with this jerk and snap, and with a turning yaw.
        let along = |t: f64, [jerk, snap]: [[f64; 2]; 2]| {
            let by = |i: usize| jerk[i] * t + snap[i] * (0.5 * t * t);
            let turn =
                f64::from(setpoint.yaw_rate_rad_s) * t + f64::from(setpoint.yaw_acceleration_rad_s2) * (0.5 * t * t);
            let rising = f64::from(setpoint.jerk_m_s3.z) * t + f64::from(setpoint.snap_m_s4.z) * (0.5 * t * t);
            leaning([ahead[0] + by(0), ahead[1] + by(1)], vertical + rising, eta.z + turn)
        };
        let of = |v: &Vector3<f32>| [0, 1].map(|i| f64::from(v[i]));
        let (j, s) = (of(&setpoint.jerk_m_s3), of(&setpoint.snap_m_s4));
        // A jump of the jerk is absorbed and decays by the filter's equation.
        let w_f = f64::from(settings.forward_rad_s);
        let (then, expected) = carried.followed.unwrap_or(([[0.0; 2]; 2], j));
        let late = [0, 1].map(|i| [then[i][0], then[i][1] + j[i] - expected[i]]);
        let next = late.map(|late| filtered(late, 0.0, w_f));
        carried.followed = Some((next, [0, 1].map(|i| j[i] + 1e-3 * s[i])));
        let gradual = [[0, 1].map(|i| j[i] - late[i][1]), [0, 1].map(|i| s[i] + (late[i][1] - next[i][1]) / 1e-3)];
        let forward = match settings.feed_forward {
            true => {
                let (before, now, after) = (along(-STEP_S, gradual), along(0.0, gradual), along(STEP_S, gradual));
                // No more than the rotors can give in hover.
                let most_n = controller.mixer().tilt_authority_n(WEIGHT_N as f32);
                let most = [0, 1].map(|i| f64::from(most_n[i] * model.hover_gain([Axis::Roll, Axis::Pitch][i])));
                [0, 1].map(|i| ((after[i] - 2.0 * now[i] + before[i]) / (STEP_S * STEP_S)).clamp(-most[i], most[i]))
            }
            false => [0.0; 2],
        };
        let (before, after) = (along(-STEP_S, [j, s]), along(STEP_S, [j, s]));
        let mut commanded = angles;
        if settings.feed_forward {
            let rates = [0, 1].map(|i| (after[i] - before[i]) / (2.0 * STEP_S));
            // The command is held for a step, an average delay of half a step.
            let (lag, late) = (1.0 / w, 1.0 / w + 0.5e-3);
            commanded = [0, 1].map(|i| angles[i] + (lag + late) * rates[i] + lag * late * forward[i]);
            let size = commanded[0].hypot(commanded[1]);
            commanded = commanded.map(|angle| angle * (tilt_max / size).min(1.0));
        }
        for i in 0..2 {
            let (angle, rate) = (f64::from(trace.filtered[i].angle), f64::from(trace.filtered[i].rate));
            let start = if settings.bumpless { eta[i] } else { angles[i] };
            let [wanted, wanted_rate] = carried.filtered.map_or([start, 0.0], |then| {
                let Filtered { angle, rate } = then[i];
                filtered([angle.into(), rate.into()], carried.commanded[i], w)
            });
            // With feed-forward the commanded angle is known up to the rotation of jerk and snap.
            let slack = 3e-6 + if settings.feed_forward { ROTATION * w * 1e-3 } else { 0.0 };
            prop_assert!((angle - wanted).abs() <= slack, "{angle} for {wanted}");
            prop_assert!((rate - wanted_rate).abs() <= slack * 4.0 * w, "{rate} for {wanted_rate} rad/s");
        }

        // Attitude: from the filter and d eta/dt, which is Omega in (6).
        let turning = if settings.feed_forward { eta_dot(state) } else { state.rates_rad_s.cast() };
        // The allowed error is divided by g of roll and pitch. It covers the rounding of the filter's acceleration and
        // the rotation of the snap.
        let slack = match settings.feed_forward {
            true => [2.0 * ROTATION, 2.0 * ROTATION * 12.0],
            false => [0.0, 4e-7 * w * w / 65.0],
        };
        // The feed-forward is also shifted by the rotor lag.
        let yaw_acceleration = f64::from(setpoint.yaw_acceleration_rad_s2);
        let wanted = [forward[0], forward[1], yaw_acceleration];
        let before = carried.late.unwrap_or(wanted);
        let share = 1.0 - (-w * 1e-3).exp();
        let early = [0, 1, 2].map(|i| wanted[i] + [1.0, 1.0, 0.0][i] * lag_s * share / 1e-3 * (wanted[i] - before[i]));
        let early = if settings.feed_forward { early } else { wanted };
        carried.late = Some([0, 1, 2].map(|i| before[i] + (wanted[i] - before[i]) * share));
        for (i, axis) in [Axis::Roll, Axis::Pitch].into_iter().enumerate() {
            let Filtered { angle, rate } = trace.filtered[i];
            let filter = w * w * (commanded[i] - f64::from(angle)) - 2.0 * w * f64::from(rate);
            let tracking = SubsystemTracking {
                x1: state.attitude_rad[i],
                x2: turning[i] as f32,
                e1: angle - state.attitude_rad[i],
                x1d_dot: rate,
                x1d_ddot: if settings.feed_forward { early[i] } else { filter } as f32,
                approach_1_s: None,
            };
            check(axis, tracking, slack)?;
        }
        let turn = f64::from(setpoint.yaw_rad) - eta.z;
        let tracking = SubsystemTracking {
            x1: state.attitude_rad.z,
            x2: turning.z as f32,
            e1: (turn - core::f64::consts::TAU * (turn / core::f64::consts::TAU).round()) as f32,
            x1d_dot: setpoint.yaw_rate_rad_s,
            x1d_ddot: early[2] as f32,
            approach_1_s: None,
        };
        check(Axis::Yaw, tracking, slack)?;

        // Distances are from the setpoint for position, and the errors for attitude.
        let (distances, errors) = (&memory.control.last.distances, &trace.errors);
        let away = setpoint.position_m - state.position_m;
        prop_assert_eq!([distances.x, distances.y, distances.z], [away.x, away.y, away.z]);
        prop_assert_eq!(
            [distances.roll, distances.pitch, distances.yaw],
            [errors.roll.e1, errors.pitch.e1, errors.yaw.e1]
        );

        // The memory is updated for the next step.
        let missing = |asked: f32, given: f32| if action.health.saturated { asked - given } else { 0.0 };
        let (Inputs { roll_n, pitch_n, yaw_n, thrust_n }, given) = (trace.inputs, &action.given);
        if settings.anti_windup {
            carried.unallocated = PerAxis {
                roll: missing(roll_n, given.roll_n),
                pitch: missing(pitch_n, given.pitch_n),
                yaw: missing(yaw_n, given.yaw_n),
                z: missing(thrust_n, given.thrust_n),
                x: if scale < 1.0 { seen.x } else { 0.0 },
                y: if scale < 1.0 { seen.y } else { 0.0 },
            };
        }
        if L::USES_ROTOR_RESIDUAL {
            let [w1, w2, w3, w4] = action.speeds.0.into();
            carried.rotor_residual_rad_s = w1 - w2 + w3 - w4;
        }
        carried.filtered = Some(trace.filtered);
        carried.commanded = commanded;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn afbc_sees_what_its_subsystems_must_know(
        settings in settings(), inputs in prop::collection::vec(near(), 1..12),
    ) {
        let gains = Profile::Paper.gains().map(|gains| afbc::adaptive::Gains { epsilon: 0.5, ..*gains });
        compose(Adaptive::new(gains).unwrap(), settings, &inputs, |a, b| {
            (a.theta - b.theta).amax().max((a.delta - b.delta).abs())
        })?;
    }

    #[test]
    fn backstepping_sees_what_its_subsystems_must_know(
        settings in settings(), inputs in prop::collection::vec(near(), 1..12),
    ) {
        let vehicle = Parameters::PAPER.to_f32();
        let gains = Profile::Paper.gains().map(|gains| gains.backstepping);
        compose(Backstepping::new(&vehicle, gains).unwrap(), settings, &inputs, |(), ()| 0.0)?;
    }

    #[test]
    fn the_fallback_sees_what_its_subsystems_must_know(
        settings in settings(), inputs in prop::collection::vec(near(), 1..12),
    ) {
        let vehicle = Parameters::PAPER.to_f32();
        let gains = Profile::Paper.gains().map(|gains| gains.into());
        let law = IntegralBackstepping::new(&vehicle, gains).unwrap();
        compose(law, settings, &inputs, |a, b| (a.value - b.value).abs())?;
    }

    /// (40): at these angles the thrust has the requested horizontal acceleration and the given vertical one.
    #[test]
    fn the_desired_attitude_leans_along_the_acceleration(
        u5 in -20.0_f32..20.0, u6 in -20.0_f32..20.0, yaw_rad in -9.0_f32..9.0, vertical in 2.0_f32..20.0,
    ) {
        let got = desired_attitude(u5, u6, yaw_rad, 1.0 / vertical);
        let wanted = leaning([u5, u6].map(f64::from), f64::from(vertical), f64::from(yaw_rad));
        for (got, wanted) in got.into_iter().zip(wanted) {
            prop_assert!((f64::from(got) - wanted).abs() <= 2.0 * ROTATION, "{got} for {wanted}");
        }
    }
}

/// The speed limit cuts the error but not the distance that the monitor sees. A controller reports its time step, mixer
/// and estimates.
#[test]
fn a_controller_reports_what_others_need() {
    let (vehicle, settings) = (Parameters::PAPER.to_f32(), Profile::Paper.settings().with_dt_s(0.004));
    let limits = PositionControlLimits { speed_max_m_s: 1.0, climb_max_m_s: 1.0, ..PositionControlLimits::NONE };
    let law = Adaptive::new(Profile::Paper.gains()).unwrap();
    let controller: Controller<Adaptive> = Controller::new(vehicle, Settings { limits, ..settings }, law).unwrap();
    assert_eq!(controller.dt_s(), 0.004);
    assert_eq!(controller.mixer(), &settings.common.mixer(vehicle).unwrap());
    let mut memory = Validated::default();
    let setpoint = Setpoint { position_m: Vector3::new(30.0, -20.0, 10.0), ..Setpoint::default() };
    let trace = step(&controller, &mut memory, &State::default(), &setpoint).trace;
    let distances = memory.control.last.distances;
    assert_eq!([distances.x, distances.y, distances.z], [30.0, -20.0, 10.0]);
    assert!(trace.errors.x.e1 < 2.0 && trace.errors.y.e1 > -2.0 && trace.errors.z.e1 < 2.0);
    assert!(Axis::ALL.iter().any(|axis| memory.control.estimates[*axis].delta > 0.0));
}
