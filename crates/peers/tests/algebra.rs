//! Single steps against formulas in `f64` and against symmetry.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod harness;

use afbc_control::{Action, FlightController, Screened, Trace};
use afbc_peers::attitude::{
    facing, geometric_error, quaternion, r_earth_body, roll_pitch, tilt_and_yaw_error, tilt_prioritised_error,
};
use afbc_peers::flatness::flat;
use afbc_peers::limits::Limits;
use afbc_peers::{Dfbc, Geometric, Indi, L1, Pid, dfbc, geometric, indi, l1, pid};
use afbc_types::{Declaration, Declared, OutOfRange, Range, Setpoint, State, Value};
use core::convert::Infallible;
use harness::{Random, SETTINGS, vehicle};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::collections::BTreeMap;

fn pid() -> Pid {
    Pid::new(vehicle(), SETTINGS, pid::Gains::PAPER_VEHICLE).unwrap()
}

fn lee() -> Geometric {
    Geometric::new(vehicle(), SETTINGS, geometric::Gains::LEE_2010).unwrap()
}

fn goodarzi() -> Geometric {
    Geometric::new(vehicle(), SETTINGS, geometric::Gains::GOODARZI_2013).unwrap()
}

fn indi() -> Indi {
    Indi::new(vehicle(), SETTINGS, indi::Gains::PAPER_VEHICLE).unwrap()
}

/// L1 on the geometric controller of [`lee`].
fn l1() -> L1 {
    let gains = l1::Gains { geometric: geometric::Gains::LEE_2010, ..l1::Gains::BY_HAND };
    L1::new(vehicle(), SETTINGS, gains).unwrap()
}

fn dfbc() -> Dfbc {
    Dfbc::new(vehicle(), SETTINGS, dfbc::Gains::PAPER_VEHICLE).unwrap()
}

/// Returns action and trace after `steps` steps with constant input.
fn after<C: FlightController>(controller: &C, steps: usize, state: &State, setpoint: &Setpoint) -> (Action, Trace) {
    let mut memory = Screened::<C::Memory>::default();
    let mut action = Action::default();
    for _ in 0..steps {
        action = controller.step(&mut memory, Some(state), setpoint);
    }
    (action, C::trace(&memory.control))
}

/// Runs `check` on the first and on a later step of every controller.
fn of_each(state: &State, setpoint: &Setpoint, check: impl Fn(&str, (Action, Trace))) {
    for steps in [1, 5] {
        check("pid", after(&pid(), steps, state, setpoint));
        check("lee", after(&lee(), steps, state, setpoint));
        check("goodarzi", after(&goodarzi(), steps, state, setpoint));
        check("indi", after(&indi(), steps, state, setpoint));
        check("l1", after(&l1(), steps, state, setpoint));
        check("dfbc", after(&dfbc(), steps, state, setpoint));
    }
}

const WEIGHT_N: f32 = 0.486 * 9.81;

#[test]
fn without_error_the_rotors_carry_the_weight_and_nothing_else() {
    for yaw_rad in [0.0, 0.7, -2.0, 3.0] {
        let mut state = State { position_m: Vector3::new(1.0, -2.0, 3.0), ..State::default() };
        state.attitude_rad.z = yaw_rad;
        let setpoint = Setpoint::hold(&state);
        of_each(&state, &setpoint, |name, (action, trace)| {
            let u = trace.inputs;
            assert!((u.thrust_n - WEIGHT_N).abs() < 2e-6, "{name}: {u:?}");
            assert!(u.roll_n.abs() < 1e-5 && u.pitch_n.abs() < 1e-5 && u.yaw_n.abs() < 1e-4, "{name}: {u:?}");
            assert_eq!(action.health, afbc_control::Health::default(), "{name}");
        });
    }
    // With the heading along x there is no rounding either.
    of_each(&State::default(), &Setpoint::default(), |name, (_, trace)| {
        if name != "indi" {
            assert_eq!(trace.inputs.thrust_n, WEIGHT_N, "{name}");
        }
        assert_eq!((trace.inputs.roll_n, trace.inputs.pitch_n, trace.inputs.yaw_n), (0.0, 0.0, 0.0), "{name}");
    });
}

#[test]
fn every_error_is_answered_in_the_right_direction() {
    let hold = Setpoint::hold(&State::default());
    let moved = |change: fn(&mut State)| {
        let mut state = State::default();
        change(&mut state);
        state
    };
    // Below the setpoint: more thrust. Rising: less.
    of_each(&moved(|s| s.position_m.z = -0.1), &hold, |name, (_, c)| assert!(c.inputs.thrust_n > WEIGHT_N, "{name}"));
    of_each(&moved(|s| s.velocity_m_s.z = 0.1), &hold, |name, (_, c)| assert!(c.inputs.thrust_n < WEIGHT_N, "{name}"));
    // Behind the setpoint along x: pitch up to tilt the thrust forward; along y: roll negatively.
    of_each(&moved(|s| s.position_m.x = -0.1), &hold, |name, (_, c)| {
        assert!(c.desired_rad[1] > 0.0 && c.desired_rad[0] == 0.0 && c.inputs.pitch_n >= 0.0, "{name}: {c:?}");
    });
    of_each(&moved(|s| s.position_m.y = -0.1), &hold, |name, (_, c)| {
        assert!(c.desired_rad[0] < 0.0 && c.desired_rad[1] == 0.0 && c.inputs.roll_n <= 0.0, "{name}: {c:?}");
    });
    of_each(&moved(|s| s.velocity_m_s.x = 0.1), &hold, |name, (_, c)| assert!(c.desired_rad[1] < 0.0, "{name}: {c:?}"));
    // A positive angle or rate is reduced; but to INDI, a tilt without acceleration is leaning into a wind.
    let tilted = |name: &str, u: f32| assert!(if name == "indi" { u.abs() < 1e-3 } else { u < -1e-2 }, "{name}: {u}");
    of_each(&moved(|s| s.attitude_rad.x = 0.1), &hold, |name, (_, c)| tilted(name, c.inputs.roll_n));
    of_each(&moved(|s| s.attitude_rad.y = 0.1), &hold, |name, (_, c)| tilted(name, c.inputs.pitch_n));
    of_each(&moved(|s| s.attitude_rad.z = 0.1), &hold, |name, (_, c)| assert!(c.inputs.yaw_n < -1e-3, "{name}"));
    of_each(&moved(|s| s.rates_rad_s.x = 0.1), &hold, |name, (_, c)| assert!(c.inputs.roll_n < -1e-3, "{name}"));
    of_each(&moved(|s| s.rates_rad_s.y = 0.1), &hold, |name, (_, c)| assert!(c.inputs.pitch_n < -1e-3, "{name}"));
    of_each(&moved(|s| s.rates_rad_s.z = 0.1), &hold, |name, (_, c)| assert!(c.inputs.yaw_n < -1e-3, "{name}"));
    // Yaw takes the short way round.
    let beyond = Setpoint { yaw_rad: -3.1, ..hold };
    of_each(&moved(|s| s.attitude_rad.z = 3.1), &beyond, |name, (_, c)| assert!(c.inputs.yaw_n > 0.0, "{name}"));
    // Feed-forward: a desired acceleration gives a tilt.
    let sideways = Setpoint { acceleration_m_s2: Vector3::new(1.0, 0.0, 0.0), ..hold };
    of_each(&State::default(), &sideways, |name, (_, c)| {
        assert!(c.desired_rad[1] > 0.0 && c.desired_rad[0] == 0.0, "{name}: {c:?}");
    });
}

/// Euler angles of a rotation; nalgebra's are of the same z-y-x sequence.
fn euler(r: &Rotation3<f64>) -> Vector3<f32> {
    let (roll, pitch, yaw) = r.euler_angles();
    Vector3::new(roll as f32, pitch as f32, yaw as f32)
}

fn vector(random: &mut Random, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * (2.0 * random.uniform() - 1.0))
}

#[test]
fn turning_the_scene_about_the_vertical_changes_nothing_for_the_body() {
    let mut random = Random(1);
    for _ in 0..300 {
        // Small enough that no limit is active in one frame and not in the other because of rounding.
        let (position, velocity) = (vector(&mut random, 0.5), vector(&mut random, 0.5));
        let attitude = Rotation3::from_scaled_axis(vector(&mut random, 0.4));
        let rates: Vector3<f32> = vector(&mut random, 0.5).cast();
        let (setpoint_velocity, acceleration) = (vector(&mut random, 0.5), vector(&mut random, 0.5));
        let (yaw, turn) = (0.3 * (2.0 * random.uniform() - 1.0), 6.0 * random.uniform() - 3.0);
        let scene = |turn: f64| {
            let about_z = Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
            let state = State {
                position_m: (about_z * position).cast(),
                velocity_m_s: (about_z * velocity).cast(),
                attitude_rad: euler(&(about_z * attitude)),
                rates_rad_s: rates,
            };
            let setpoint = Setpoint {
                velocity_m_s: (about_z * setpoint_velocity).cast(),
                acceleration_m_s2: (about_z * acceleration).cast(),
                yaw_rad: (yaw + turn) as f32,
                yaw_rate_rad_s: 0.2,
                ..Setpoint::default()
            };
            (state, setpoint)
        };
        let ((state, setpoint), (turned_state, turned_setpoint)) = (scene(0.0), scene(turn));
        let same = |(_, a): (Action, Trace), (_, b): (Action, Trace), name: &str| {
            let difference = Vector3::new(
                (a.inputs.roll_n - b.inputs.roll_n) * 65.8,
                (a.inputs.pitch_n - b.inputs.pitch_n) * 65.8,
                (a.inputs.yaw_n - b.inputs.yaw_n) * 1.43,
            );
            // Four times the error of a sine, 1.2e-3, times the stiffest loop's 330 1/s2.
            assert!(difference.amax() < 1.6, "{name}: {difference:?} after a turn of {turn}");
            assert!((a.inputs.thrust_n - b.inputs.thrust_n).abs() < 0.03, "{name}: {a:?} {b:?}");
        };
        for steps in [1, 5] {
            same(after(&pid(), steps, &state, &setpoint), after(&pid(), steps, &turned_state, &turned_setpoint), "pid");
            same(after(&lee(), steps, &state, &setpoint), after(&lee(), steps, &turned_state, &turned_setpoint), "lee");
            same(
                after(&indi(), steps, &state, &setpoint),
                after(&indi(), steps, &turned_state, &turned_setpoint),
                "indi",
            );
            same(after(&l1(), steps, &state, &setpoint), after(&l1(), steps, &turned_state, &turned_setpoint), "l1");
            same(
                after(&dfbc(), steps, &state, &setpoint),
                after(&dfbc(), steps, &turned_state, &turned_setpoint),
                "dfbc",
            );
        }
    }
}

/// Returns R = Rz Ry Rx in `f64`, from angles that an `f32` state can hold.
fn exact(eta: &Vector3<f32>) -> Matrix3<f64> {
    *Rotation3::from_euler_angles(f64::from(eta.x), f64::from(eta.y), f64::from(eta.z)).matrix()
}

#[test]
fn attitude_errors_agree_with_their_formulas() {
    let mut random = Random(2);
    for _ in 0..2000 {
        let eta = euler(&Rotation3::from_scaled_axis(vector(&mut random, 1.5)));
        let thrust = Vector3::new(0.0, 0.0, 9.81) + vector(&mut random, 5.0);
        let yaw = vector(&mut random, 3.0).x;
        let r = r_earth_body(&eta);
        assert!((r.cast() - exact(&eta)).amax() < 3e-3);

        // R_d by its definition: z along the thrust, x perpendicular to the left of the heading.
        let desired = facing(&thrust.cast(), yaw as f32);
        let z = thrust.normalize();
        let x = Vector3::new(-yaw.sin(), yaw.cos(), 0.0).cross(&z).normalize();
        let r_d = Matrix3::from_columns(&[x, z.cross(&x), z]);
        assert!((desired.cast() - r_d).amax() < 3e-3);
        let [roll, pitch] = roll_pitch(&desired);
        let angles = Rotation3::from_matrix_unchecked(r_d).euler_angles();
        assert!((f64::from(roll) - angles.0).abs() < 3e-3 && (f64::from(pitch) - angles.1).abs() < 3e-3);
        assert!((angles.2 - yaw).abs() < 1e-9, "the yaw of R_d is psi_d");

        // Lee: e_R = (R_d' R - R' R_d)^v / 2; positive for a body turned too far.
        let e = r_d.transpose() * exact(&eta) - exact(&eta).transpose() * r_d;
        let e_r = Vector3::new(e[(2, 1)], e[(0, 2)], e[(1, 0)]) / 2.0;
        let ours = -geometric_error(&r, &desired).cast::<f64>();
        assert!((ours - e_r).amax() < 6e-3, "{ours:?} {e_r:?}");
    }
}

#[test]
fn the_tilt_comes_first_and_yaw_by_its_weight() {
    let mut random = Random(3);
    for _ in 0..2000 {
        let r = Rotation3::from_scaled_axis(vector(&mut random, 1.5));
        let r_d = Rotation3::from_scaled_axis(vector(&mut random, 1.5));
        let (a, b) = (r.matrix().cast(), r_d.matrix().cast());
        // By geometry: the shortest rotation of the thrust, then the remaining rotation about the thrust.
        let (z, z_d) = (r * Vector3::z(), r_d * Vector3::z());
        let tilt = Rotation3::rotation_between(&z, &z_d).unwrap();
        let left: Rotation3<f64> = (tilt * r).inverse() * r_d;
        let half_yaw = left.scaled_axis().z / 2.0;
        for weight in [0.05, 0.4, 1.0] {
            let turned = tilt * r * Rotation3::from_axis_angle(&Vector3::z_axis(), 2.0 * weight * half_yaw);
            let q = nalgebra::UnitQuaternion::from_rotation_matrix(&(r.inverse() * turned));
            let q = if q.w < 0.0 { -q.into_inner() } else { q.into_inner() };
            let ours = tilt_prioritised_error(&a, &b, weight as f32).cast::<f64>();
            // At half a turn of yaw, rounding decides the direction.
            if half_yaw.abs() < 1.5 {
                assert!((ours - q.imag() * 2.0).amax() < 6e-3, "{ours:?} {q:?}");
            }
        }
    }
    // Opposite thrusts with any axis between them.
    for axis in [Vector3::x_axis(), Vector3::y_axis(), Unit::new_normalize(Vector3::new(1.0, 2.0, 0.0))] {
        let upside_down = Rotation3::from_axis_angle(&axis, core::f32::consts::PI);
        let e = tilt_prioritised_error(&Matrix3::identity(), upside_down.matrix(), 0.4);
        assert!((e.norm() - 2.0).abs() < 1e-3, "{e:?}");
    }
}

#[test]
fn quaternions_match_their_matrices() {
    let mut random = Random(4);
    for _ in 0..5000 {
        let r = Rotation3::from_scaled_axis(vector(&mut random, core::f64::consts::PI));
        let q = quaternion(&r.matrix().cast()).cast::<f64>();
        let back = nalgebra::UnitQuaternion::from_quaternion(q).to_rotation_matrix();
        assert!((back.matrix() - r.matrix()).amax() < 2e-6 && q.w >= 0.0);
    }
}

#[test]
fn desired_rates_are_the_derivative_of_the_desired_attitude() {
    // A moving specific force and heading; R_d by differences in f64, Omega_d = (R_d' dR_d/dt)^v.
    for [size, pace] in [[1.0, 1.0], [2.5, 1.0], [2.5, 2.5]] {
        rates_of([size, pace]);
    }
}

/// The same for specific forces of this size and pace.
fn rates_of([size, pace]: [f64; 2]) {
    let force = |t: f64| {
        let t = pace * t;
        Vector3::new(2.0 * size * (1.3 * t).sin(), 1.5 * size * (0.9 * t).cos(), 9.81 + size * (0.7 * t).sin())
    };
    let yaw = |t: f64| 0.8 * (0.5 * t).sin();
    let attitude = |t: f64| {
        let z = force(t).normalize();
        let x = Vector3::new(-yaw(t).sin(), yaw(t).cos(), 0.0).cross(&z).normalize();
        Matrix3::from_columns(&[x, z.cross(&x), z])
    };
    let rates = |t: f64| {
        let h = 1e-5;
        let w = attitude(t).transpose() * (attitude(t + h) - attitude(t - h)) / (2.0 * h);
        Vector3::new(w[(2, 1)], w[(0, 2)], w[(1, 0)])
    };
    let derivative = |f: &dyn Fn(f64) -> Vector3<f64>, t: f64| (f(t + 1e-4) - f(t - 1e-4)) / 2e-4;
    for step in 0..100 {
        let t = 0.13 * f64::from(step);
        let force_dot = |t: f64| derivative(&force, t);
        let setpoint = Setpoint {
            yaw_rad: yaw(t) as f32,
            yaw_rate_rad_s: (0.4 * (0.5 * t).cos()) as f32,
            yaw_acceleration_rad_s2: (-0.2 * (0.5 * t).sin()) as f32,
            ..Setpoint::default()
        };
        let s = [force(t).cast(), force_dot(t).cast(), derivative(&force_dot, t).cast()];
        let desired = geometric::desired(s, &setpoint);
        let (omega, omega_dot) = (rates(t), derivative(&rates, t));
        let error = (desired.rates_rad_s.cast::<f64>() - omega).amax();
        assert!(error < 2e-3 * omega.norm().max(1.0), "{desired:?} {omega:?}");
        // With the products of rates nothing is left but the error of a sine.
        let exact = flat(s, &setpoint);
        let same = (exact.r_earth_desired, exact.rates_rad_s) == (desired.r_earth_desired, desired.rates_rad_s);
        assert!(same, "{exact:?} {desired:?}");
        let error = (exact.rates_dot_rad_s2.cast::<f64>() - omega_dot).amax();
        assert!(error < 4e-3 * (1.0 + omega_dot.norm() + omega.norm_squared()), "{error} of {omega_dot:?} {omega:?}");
        // The neglected part is of second order in the rates.
        let (left_out, speed) = ((desired.rates_dot_rad_s2.cast::<f64>() - omega_dot).amax(), omega.norm());
        assert!(left_out < 5e-3 + 3.0 * speed * (speed + force_dot(t).norm() / 9.81), "{left_out} at {speed}");
    }
}

/// PID's tilt is that of \[a_x, a_y, g\]: whatever the height error does to the thrust, and to the thrust it adds what
/// the tilt takes from the vertical.
#[test]
fn the_height_of_pid_does_not_tilt_it_and_its_tilt_costs_no_height() {
    let mut random = Random(7);
    for _ in 0..300 {
        let (position, velocity) = (vector(&mut random, 0.5).cast::<f32>(), vector(&mut random, 0.3).cast::<f32>());
        let yaw_rad = vector(&mut random, 3.0).x as f32;
        let of = |height: f32, sideways: f32| {
            let keep = Vector3::new(sideways, sideways, height);
            let mut state = State {
                position_m: position.component_mul(&keep),
                velocity_m_s: velocity.component_mul(&keep),
                ..State::default()
            };
            state.attitude_rad.z = yaw_rad;
            after(&pid(), 1, &state, &Setpoint { yaw_rad, ..Setpoint::default() }).1
        };
        let (both, level, flat) = (of(1.0, 1.0), of(1.0, 0.0), of(0.0, 1.0));
        for (a, b) in both.desired_rad.into_iter().zip(flat.desired_rad) {
            assert!((a - b).abs() < 1e-5, "{both:?} {flat:?}");
        }
        let [roll, pitch] = both.desired_rad.map(f64::from);
        let vertical = f64::from(both.inputs.thrust_n) * roll.cos() * pitch.cos();
        assert!((vertical - f64::from(level.inputs.thrust_n)).abs() < 1e-4, "{both:?} {level:?}");
        // tan(tilt) g is the demanded acceleration.
        let tilt = (1.0 / (roll.cos() * pitch.cos()).powi(2) - 1.0).sqrt();
        let demanded = both.virtual_m_s2[0].hypot(both.virtual_m_s2[1]);
        assert!((tilt * 9.81 - f64::from(demanded)).abs() < 1e-4 * 9.81, "{both:?}");
    }
}

#[test]
fn an_integrator_does_not_wind_up_against_a_limit() {
    // Far away sideways and above for 20 s: tilt and thrust stay at their limits.
    let state = State { position_m: Vector3::new(-50.0, 0.0, 0.0), ..State::default() };
    let far = Setpoint { position_m: Vector3::new(0.0, 0.0, 500.0), ..Setpoint::default() };
    let mut memory = Screened::<pid::Memory>::default();
    for _ in 0..20_000 {
        let _ = pid().step(&mut memory, Some(&state), &far);
    }
    // 20 s of 4 1/s2 times 3 m/s would be 240 m/s2, clipped to 9.81 m/s2.
    assert!(memory.control.velocity_integral.x < 4.0, "{:?}", memory.control.velocity_integral);
    let mut memory = Screened::<geometric::Memory>::default();
    for _ in 0..20_000 {
        let _ = goodarzi().step(&mut memory, Some(&state), &far);
    }
    assert!(
        memory.control.position_integral.x == 0.0 && memory.control.position_integral.z == 0.0,
        "{:?}",
        memory.control.position_integral
    );

    // A yaw error beyond the rotors' authority: the rate integral does not move.
    let turned = Setpoint { yaw_rad: 2.5, ..Setpoint::default() };
    let mut memory = Screened::<pid::Memory>::default();
    for _ in 0..5000 {
        let _ = pid().step(&mut memory, Some(&State::default()), &turned);
    }
    assert!(memory.control.rate_integral.z < 0.1, "{:?}", memory.control.rate_integral);
    let mut memory = Screened::<geometric::Memory>::default();
    for _ in 0..5000 {
        let _ = goodarzi().step(&mut memory, Some(&State::default()), &turned);
    }
    assert!(memory.control.attitude_integral.z < 0.1, "{:?}", memory.control.attitude_integral);
}

#[test]
fn nothing_is_learnt_from_a_stale_state() {
    /// Returns what is learnt before and after a hundred steps without a plausible state.
    fn learnt<C: FlightController, L: PartialEq + core::fmt::Debug>(controller: &C, of: fn(&C::Memory) -> L) -> [L; 3] {
        let state = State { position_m: Vector3::new(-0.1, 0.2, 0.3), ..State::default() };
        let lost = State { position_m: Vector3::new(f32::NAN, 0.0, 0.0), ..State::default() };
        let mut memory = Screened::<C::Memory>::default();
        let before = of(&memory.control);
        for _ in 0..100 {
            let _ = controller.step(&mut memory, Some(&state), &Setpoint::default());
        }
        let learnt = of(&memory.control);
        for _ in 0..100 {
            assert!(controller.step(&mut memory, Some(&lost), &Setpoint::default()).health.state_rejected);
        }
        [before, learnt, of(&memory.control)]
    }
    fn check<L: PartialEq + core::fmt::Debug>([before, learnt, after]: [L; 3]) {
        assert!(before != learnt && learnt == after, "{before:?} {learnt:?} {after:?}");
    }
    check(learnt(&pid(), |memory| (memory.velocity_integral, memory.rate_integral)));
    check(learnt(&goodarzi(), |memory| (memory.position_integral, memory.attitude_integral)));
    check(learnt(&l1(), |memory| (memory.force_m_s2, memory.moment_rad_s2)));
    check(learnt(&dfbc(), |memory| memory.position_integral));
}

/// After an outage in which the vehicle has moved, L1 does not take the jump of the state for a disturbance.
#[test]
fn l1_starts_its_prediction_again_after_an_outage() {
    let mut memory = Screened::<l1::Memory>::default();
    let state = State::default();
    for _ in 0..100 {
        let _ = l1().step(&mut memory, Some(&state), &Setpoint::default());
    }
    for _ in 0..200 {
        let _ = l1().step(&mut memory, None, &Setpoint::default());
    }
    let moved = State { velocity_m_s: Vector3::new(1.0, -1.0, -2.0), rates_rad_s: Vector3::repeat(0.5), ..state };
    let _ = l1().step(&mut memory, Some(&moved), &Setpoint::default());
    let l1::Memory { force_m_s2, moment_rad_s2, .. } = memory.control;
    // In the steps before, the vehicle stood still at hover thrust: nothing was unexplained.
    assert!(force_m_s2.amax() < 0.1 && moment_rad_s2.amax() < 0.1, "{force_m_s2:?} {moment_rad_s2:?}");
}

/// What the law of the head of `dfbc.rs` demands, and what that of `indi.rs` does, in `f64`: on the first step there is
/// nothing in the filters, and the rotors are at hover.
#[test]
fn demanded_accelerations_are_those_of_the_formulas() {
    let effectiveness = Vector3::new(65.789_47, 65.789_47, 1.425_1);
    let limits = Limits::new(&vehicle(), 12.0, 1.0);
    let mut random = Random(5);
    for _ in 0..500 {
        let attitude = Rotation3::from_scaled_axis(vector(&mut random, 0.3));
        let state = State {
            position_m: vector(&mut random, 0.1).cast(),
            velocity_m_s: vector(&mut random, 0.1).cast(),
            attitude_rad: euler(&attitude),
            rates_rad_s: vector(&mut random, 3.0).cast(),
        };
        let setpoint = Setpoint {
            acceleration_m_s2: vector(&mut random, 2.0).cast(),
            jerk_m_s3: vector(&mut random, 20.0).cast(),
            snap_m_s4: vector(&mut random, 50.0).cast(),
            yaw_rad: vector(&mut random, 0.3).x as f32,
            yaw_rate_rad_s: vector(&mut random, 1.0).x as f32,
            ..Setpoint::default()
        };
        let (r, omega) = (*attitude.matrix(), state.rates_rad_s.cast::<f64>());
        let r_single = r.cast::<f32>();
        // R' R_d Omega_d, and its derivative by that of each factor, for a specific force.
        let fed_forward = |s: Vector3<f32>| {
            let flat = flat([s, setpoint.jerk_m_s3, setpoint.snap_m_s4], &setpoint);
            let to_body = r.transpose() * flat.r_earth_desired.cast::<f64>();
            let rates = to_body * flat.rates_rad_s.cast::<f64>();
            (rates, to_body * flat.rates_dot_rad_s2.cast::<f64>() - omega.cross(&rates))
        };
        let check = |name: &str, trace: &Trace, expected: Vector3<f64>| {
            let u = trace.inputs;
            let demanded = Vector3::new(u.roll_n, u.pitch_n, u.yaw_n).cast::<f64>().component_mul(&effectiveness);
            // The error of a sine, 1.2e-3, of angles times 250 1/s2, and of rates of 3 rad/s and accelerations.
            let error = (demanded - expected).amax();
            assert!(error < 1.2 + 0.01 * expected.amax(), "{name}: {demanded:?}, not {expected:?}");
        };
        let gravity = limits.gravity();

        let gains = dfbc::Gains::PAPER_VEHICLE;
        let wanted = setpoint.acceleration_m_s2
            - state.position_m.component_mul(&Vector3::new(12.0, 12.0, 25.0))
            - state.velocity_m_s.component_mul(&Vector3::new(6.0, 6.0, 10.0));
        let desired = facing(&limits.apply(&(wanted + gravity)), setpoint.yaw_rad);
        let (rates, acceleration) = fed_forward(limits.apply(&(setpoint.acceleration_m_s2 + gravity)));
        let k_r = Vector3::new(gains.tilt_p_1_s2, gains.tilt_p_1_s2, gains.yaw_p_1_s2);
        let k_omega = Vector3::new(gains.tilt_d_1_s, gains.tilt_d_1_s, gains.yaw_d_1_s).cast::<f64>();
        let nu = tilt_and_yaw_error(&r_single, &desired).component_mul(&k_r).cast::<f64>()
            + k_omega.component_mul(&(rates - omega))
            + acceleration;
        check("dfbc", &after(&dfbc(), 1, &state, &setpoint).1, nu);

        let gains = indi::Gains::PAPER_VEHICLE;
        let velocity = -state.velocity_m_s - state.position_m.component_mul(&Vector3::new(2.0, 2.0, 3.0));
        let wanted = setpoint.acceleration_m_s2 + velocity.component_mul(&Vector3::new(4.5, 4.5, 8.0));
        let s = limits.apply(&(r_single * gravity + wanted));
        let (rates, acceleration) = fed_forward(s);
        let yaw_p = gains.yaw_p_1_s / gains.yaw_weight;
        let error = tilt_prioritised_error(&r_single, &facing(&s, setpoint.yaw_rad), gains.yaw_weight);
        let wanted =
            error.component_mul(&Vector3::new(gains.tilt_p_1_s, gains.tilt_p_1_s, yaw_p)).cast::<f64>() + rates;
        let k_w = Vector3::new(gains.tilt_rate_p_1_s, gains.tilt_rate_p_1_s, gains.yaw_rate_p_1_s).cast::<f64>();
        check("indi", &after(&indi(), 1, &state, &setpoint).1, k_w.component_mul(&(wanted - omega)) + acceleration);
    }
}

/// A vehicle that moves as L1's model says, rotors ideal, plus constant accelerations: they are estimated within two
/// steps, up to e^(-a dt) and the bounds.
#[test]
fn l1_estimates_what_the_model_does_not_explain() {
    let gains = l1::Gains { rotor_time_constant_s: 0.0, ..l1::Gains::BY_HAND };
    let l1 = L1::new(vehicle(), SETTINGS, gains).unwrap();
    let inertia = Vector3::new(0.0038, 0.0038, 0.0076);
    let effectiveness = Vector3::new(65.789_47, 65.789_47, 1.425_1);
    let mut random = Random(6);
    for _ in 0..100 {
        let mut memory = Screened::<l1::Memory>::default();
        let (force, moment) = (vector(&mut random, 30.0), vector(&mut random, 150.0));
        let (mut velocity, mut rates) = (vector(&mut random, 1.0), vector(&mut random, 2.0));
        let attitude_rad = vector(&mut random, 0.4).cast::<f32>();
        let body_z = r_earth_body(&attitude_rad).column(2).normalize().cast::<f64>();
        for _ in 0..4 {
            let state =
                State { velocity_m_s: velocity.cast(), attitude_rad, rates_rad_s: rates.cast(), ..State::default() };
            let u = l1.step(&mut memory, Some(&state), &Setpoint::default()).given;
            let turned = Vector3::new(u.roll_n, u.pitch_n, u.yaw_n).cast::<f64>().component_mul(&effectiveness);
            let coupling = -rates.cross(&inertia.component_mul(&rates)).component_div(&inertia);
            velocity += (body_z * (f64::from(u.thrust_n) / 0.486) - Vector3::new(0.0, 0.0, 9.81) + force) * 1e-3;
            rates += (turned + coupling + moment) * 1e-3;
        }
        let left = (-5.0e-3_f64).exp();
        let close = |estimate: Vector3<f32>, true_value: Vector3<f64>, max: f64| {
            let expected = true_value.map(|x| (left * x).clamp(-max, max));
            (estimate.cast::<f64>() - expected).amax() < 2e-3 * max.min(20.0)
        };
        let l1::Memory { force_m_s2, moment_rad_s2, .. } = memory.control;
        assert!(close(force_m_s2, force, 20.0), "{force_m_s2:?} of {force:?}");
        assert!(close(moment_rad_s2, moment, 100.0), "{moment_rad_s2:?} of {moment:?}");
    }
}

/// Rotation about one axis only: d rate/dt = (d/b)/Iz U3 + disturbance, with rotor lag.
#[test]
fn increments_cancel_a_constant_moment() {
    let controller = indi();
    let mixer = afbc_control::mixer::Mixer::new(vehicle(), SETTINGS.rotor_force_max_n).unwrap();
    let mut memory = Screened::<indi::Memory>::default();
    let mut rotors = nalgebra::Vector4::repeat(libm::sqrt(f64::from(WEIGHT_N) / 4.0 / 2.984e-5));
    let effectiveness = 3.232e-7 / 2.984e-5 / 0.0076;
    let (lag, dt_s) = (1.0 - libm::exp(-0.05), 1e-3);
    let [mut angle, mut rate, mut largest, mut late] = [0.0f64; 4];
    for step in 0..4000 {
        let disturbance = if step >= 500 { 2.0 } else { 0.0 };
        let state = State {
            attitude_rad: Vector3::new(0.0, 0.0, angle as f32),
            rates_rad_s: Vector3::new(0.0, 0.0, rate as f32),
            ..State::default()
        };
        let command = controller.step(&mut memory, Some(&state), &Setpoint::default());
        rotors += (command.speeds.0.cast::<f64>() - rotors) * lag;
        let u = mixer.inputs(&mixer.forces(&afbc_types::RotorSpeeds(rotors.cast())));
        rate += (effectiveness * f64::from(u.yaw_n) + disturbance) * dt_s;
        angle += rate * dt_s;
        largest = angle.abs().max(largest);
        if step >= 3000 {
            late = angle.abs().max(late);
        }
    }
    // Without increments the angle would stay at 2 rad/s2 / (k_w k_a) = 83 mrad.
    assert!(late < 1e-4, "left: {late}");
    assert!(largest < 0.01, "largest: {largest}");
}

/// Gains of the same key have the same name, unit and range in all controllers.
#[test]
fn gains_of_one_key_are_declared_alike() {
    let mut declared: BTreeMap<&str, Declaration> = BTreeMap::new();
    let mut shared = 0;
    let mut visit = |declaration: &Declaration, _: Value<'_>| {
        if let Some(before) = declared.insert(declaration.range.name, *declaration) {
            let same = |d: Declaration| (d.id, d.range, d.unit, d.tuned);
            assert_eq!(same(before), same(*declaration));
            shared += 1;
        }
        Ok::<(), Infallible>(())
    };
    let Ok(()) = pid::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = geometric::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = indi::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = l1::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = dfbc::Gains::DEFAULT.visit(&mut visit);
    assert!(shared > 35, "{shared}");
}

#[test]
fn gains_out_of_range_are_refused_by_name() {
    /// Sets each gain in turn to a bad value and checks that it is refused by name.
    fn refused<G: Declared + Copy>(gains: G, count: usize, build: fn(G) -> Result<(), OutOfRange>) {
        assert_eq!(build(gains), Ok(()));
        for bad in [|range: &Range| (range.max * 2.0) as f32, |_: &Range| f32::NAN, |_: &Range| -1.0] {
            for index in 0..count {
                let (mut gains, mut at, mut name) = (gains, 0, "");
                let Ok(()) = gains.visit_mut(&mut |declaration, value| {
                    if let (true, Value::Single([gain])) = (at == index, value) {
                        (*gain, name) = (bad(&declaration.range), declaration.range.name);
                    }
                    at += 1;
                    Ok::<(), Infallible>(())
                });
                assert_eq!(at, count);
                assert_eq!(build(gains).unwrap_err().range.name, name);
            }
        }
    }
    refused(pid::Gains::PAPER_VEHICLE, 25, |gains| Pid::new(vehicle(), SETTINGS, gains).map(drop));
    refused(geometric::Gains::GOODARZI_2013, 19, |gains| Geometric::new(vehicle(), SETTINGS, gains).map(drop));
    refused(indi::Gains::PAPER_VEHICLE, 18, |gains| Indi::new(vehicle(), SETTINGS, gains).map(drop));
    refused(l1::Gains::BY_HAND, 23, |gains| L1::new(vehicle(), SETTINGS, gains).map(drop));
    refused(dfbc::Gains::PAPER_VEHICLE, 18, |gains| Dfbc::new(vehicle(), SETTINGS, gains).map(drop));
    let gains = pid::Gains { tilt_max_rad: 1.5, ..pid::Gains::PAPER_VEHICLE };
    assert_eq!(gains.validate().unwrap_err().range.name, "tilt_max_rad");
    let gains = indi::Gains { rotor_time_constant_s: -0.1, ..indi::Gains::PAPER_VEHICLE };
    assert_eq!(gains.validate().unwrap_err().range.name, "rotor_time_constant_s");
    let settings = afbc_control::Settings { dt_s: 1.0, ..SETTINGS };
    assert_eq!(Indi::new(vehicle(), settings, indi::Gains::PAPER_VEHICLE).unwrap_err().range.name, "dt_s");
    let mut vehicle = vehicle();
    vehicle.mass_kg = 0.0;
    assert_eq!(Pid::new(vehicle, SETTINGS, pid::Gains::PAPER_VEHICLE).unwrap_err().range.name, "mass_kg");
}
