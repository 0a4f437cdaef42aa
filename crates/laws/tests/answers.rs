//! Response of a single step to an error: its direction, its symmetry, and its size by formulas in `f64`.

use crate::harness::steps::{WEIGHT_N, after, dfbc, euler, goodarzi, indi, l1, lee, mpc, pid, vector};
use crate::harness::{Random, vehicle};
use afbc_control::{Action, Trace};
use afbc_laws::attitude::{facing, tilt_and_yaw_error, tilt_prioritised_error};
use afbc_laws::flatness::flat;
use afbc_laws::limits::SpecificForceLimits;
use afbc_laws::{dfbc, indi};
use afbc_types::{Setpoint, State};
use nalgebra::{Rotation3, Vector3};

/// Runs `check` on the first and on a later step of every controller.
fn of_each(state: &State, setpoint: &Setpoint, check: impl Fn(&str, (Action, Trace))) {
    for steps in [1, 5] {
        check("pid", after(&pid(), steps, state, setpoint));
        check("lee", after(&lee(), steps, state, setpoint));
        check("goodarzi", after(&goodarzi(), steps, state, setpoint));
        check("indi", after(&indi(), steps, state, setpoint));
        check("l1", after(&l1(), steps, state, setpoint));
        check("dfbc", after(&dfbc(), steps, state, setpoint));
        check("mpc", after(&mpc(), steps, state, setpoint));
    }
}

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
    // A vehicle below the setpoint gets more thrust, and a rising one gets less.
    of_each(&moved(|s| s.position_m.z = -0.1), &hold, |name, (_, c)| assert!(c.inputs.thrust_n > WEIGHT_N, "{name}"));
    of_each(&moved(|s| s.velocity_m_s.z = 0.1), &hold, |name, (_, c)| assert!(c.inputs.thrust_n < WEIGHT_N, "{name}"));
    // Behind the setpoint along x: a positive pitch (nose down) tilts the thrust forward. Along y: a negative roll.
    of_each(&moved(|s| s.position_m.x = -0.1), &hold, |name, (_, c)| {
        assert!(c.desired_rad[1] > 0.0 && c.desired_rad[0] == 0.0 && c.inputs.pitch_n >= 0.0, "{name}: {c:?}");
    });
    of_each(&moved(|s| s.position_m.y = -0.1), &hold, |name, (_, c)| {
        assert!(c.desired_rad[0] < 0.0 && c.desired_rad[1] == 0.0 && c.inputs.roll_n <= 0.0, "{name}: {c:?}");
    });
    of_each(&moved(|s| s.velocity_m_s.x = 0.1), &hold, |name, (_, c)| assert!(c.desired_rad[1] < 0.0, "{name}: {c:?}"));
    // A positive angle or rate is reduced. INDI and MPC take a tilt without acceleration for leaning into the wind.
    let tilted = |name: &str, u: f32| {
        assert!(if ["indi", "mpc"].contains(&name) { u.abs() < 1e-3 } else { u < -1e-2 }, "{name}: {u}")
    };
    of_each(&moved(|s| s.attitude_rad.x = 0.1), &hold, |name, (_, c)| tilted(name, c.inputs.roll_n));
    of_each(&moved(|s| s.attitude_rad.y = 0.1), &hold, |name, (_, c)| tilted(name, c.inputs.pitch_n));
    of_each(&moved(|s| s.attitude_rad.z = 0.1), &hold, |name, (_, c)| assert!(c.inputs.yaw_n < -1e-3, "{name}"));
    of_each(&moved(|s| s.rates_rad_s.x = 0.1), &hold, |name, (_, c)| assert!(c.inputs.roll_n < -1e-3, "{name}"));
    of_each(&moved(|s| s.rates_rad_s.y = 0.1), &hold, |name, (_, c)| assert!(c.inputs.pitch_n < -1e-3, "{name}"));
    of_each(&moved(|s| s.rates_rad_s.z = 0.1), &hold, |name, (_, c)| assert!(c.inputs.yaw_n < -1e-3, "{name}"));
    // Yaw takes the shorter way round.
    let beyond = Setpoint { yaw_rad: -3.1, ..hold };
    of_each(&moved(|s| s.attitude_rad.z = 3.1), &beyond, |name, (_, c)| assert!(c.inputs.yaw_n > 0.0, "{name}"));
    // Feed-forward: a desired acceleration gives a tilt.
    let sideways = Setpoint { acceleration_m_s2: Vector3::new(1.0, 0.0, 0.0), ..hold };
    of_each(&State::default(), &sideways, |name, (_, c)| {
        assert!(c.desired_rad[1] > 0.0 && c.desired_rad[0] == 0.0, "{name}: {c:?}");
    });
}

#[test]
fn turning_the_scene_about_the_vertical_changes_nothing_for_the_body() {
    let mut random = Random(1);
    for _ in 0..300 {
        // The errors are small enough that rounding cannot make a limit active in only one of the frames.
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
            // The bound is four times the sine's error of 1.2e-3, times the stiffest loop's gain of 330 1/s2.
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
            same(after(&mpc(), steps, &state, &setpoint), after(&mpc(), steps, &turned_state, &turned_setpoint), "mpc");
        }
    }
}

/// PID tilts along \[a_x, a_y, g\], so the height error does not change the tilt. The thrust compensates the loss of
/// vertical force by the tilt.
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

/// Compares the demands of DFBC and INDI with the formulas in `dfbc.rs` and `indi.rs` in `f64`. On the first step the
/// filters are empty and the rotors are at hover.
#[test]
fn demanded_accelerations_are_those_of_the_formulas() {
    let effectiveness = Vector3::new(65.789_47, 65.789_47, 1.425_1);
    let limits = SpecificForceLimits::new(&vehicle(), 12.0, 1.0);
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
        // Returns R' R_d Omega_d for a specific force, and its derivative by the product rule.
        let fed_forward = |s: Vector3<f32>| {
            let flat = flat([s, setpoint.jerk_m_s3, setpoint.snap_m_s4], &setpoint);
            let to_body = r.transpose() * flat.r_earth_desired.cast::<f64>();
            let rates = to_body * flat.rates_rad_s.cast::<f64>();
            (rates, to_body * flat.rates_dot_rad_s2.cast::<f64>() - omega.cross(&rates))
        };
        let check = |name: &str, trace: &Trace, expected: Vector3<f64>| {
            let u = trace.inputs;
            let demanded = Vector3::new(u.roll_n, u.pitch_n, u.yaw_n).cast::<f64>().component_mul(&effectiveness);
            // Allowed error: the sine error, 1.2e-3, for angles times 250 1/s2, rates of 3 rad/s and accelerations.
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
