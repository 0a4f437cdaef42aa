//! Checks what the laws learn from step to step: integrals, L1's disturbances, INDI's increments.

use crate::harness::steps::{WEIGHT_N, dfbc, goodarzi, indi, l1, pid, vector};
use crate::harness::{Random, SETTINGS, vehicle};
use afbc_control::{FlightController, Validated};
use afbc_laws::attitude::r_earth_body;
use afbc_laws::{L1, geometric, indi, l1, pid};
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;

#[test]
fn an_integrator_does_not_wind_up_against_a_limit() {
    // The vehicle is far below and beside the setpoint for 20 s. Tilt and thrust stay at their limits.
    let state = State { position_m: Vector3::new(-50.0, 0.0, 0.0), ..State::default() };
    let far = Setpoint { position_m: Vector3::new(0.0, 0.0, 500.0), ..Setpoint::default() };
    let mut memory = Validated::<pid::Memory>::default();
    for _ in 0..20_000 {
        let _ = pid().step(&mut memory, Some(&state), &far);
    }
    // 20 s of 4 1/s2 times 3 m/s would be 240 m/s2, clipped to 9.81 m/s2.
    assert!(memory.control.velocity_integral.x < 4.0, "{:?}", memory.control.velocity_integral);
    let mut memory = Validated::<geometric::Memory>::default();
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
    let mut memory = Validated::<pid::Memory>::default();
    for _ in 0..5000 {
        let _ = pid().step(&mut memory, Some(&State::default()), &turned);
    }
    assert!(memory.control.rate_integral.z < 0.1, "{:?}", memory.control.rate_integral);
    let mut memory = Validated::<geometric::Memory>::default();
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
        let mut memory = Validated::<C::Memory>::default();
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
    let mut memory = Validated::<l1::Memory>::default();
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
    // In the steps before, the vehicle stood still at hover thrust, so nothing was unexplained.
    assert!(force_m_s2.amax() < 0.1 && moment_rad_s2.amax() < 0.1, "{force_m_s2:?} {moment_rad_s2:?}");
}

/// A vehicle moves as L1's model says, with ideal rotors, plus constant accelerations. L1 estimates these within two
/// steps, up to e^(-a dt) and the bounds.
#[test]
fn l1_estimates_what_the_model_does_not_explain() {
    let gains = l1::Gains { rotor_time_constant_s: 0.0, ..l1::Gains::BY_HAND };
    let l1 = L1::new(vehicle(), SETTINGS, gains).unwrap();
    let inertia = Vector3::new(0.0038, 0.0038, 0.0076);
    let effectiveness = Vector3::new(65.789_47, 65.789_47, 1.425_1);
    let mut random = Random(6);
    for _ in 0..100 {
        let mut memory = Validated::<l1::Memory>::default();
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

/// The vehicle rotates about one axis only: d rate/dt = (d/b)/Iz U3 + disturbance, with rotor lag.
#[test]
fn increments_cancel_a_constant_moment() {
    let controller = indi();
    let mixer = afbc_control::mixer::Mixer::new(vehicle(), SETTINGS.rotor_force_max_n).unwrap();
    let mut memory = Validated::<indi::Memory>::default();
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
