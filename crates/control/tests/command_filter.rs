//! Properties of the command filter at all accepted bandwidths and time steps.
#![allow(clippy::unwrap_used, missing_docs)] // a filter that cannot be built must stop the test

use afbc_control::Settings;
use afbc_control::command_filter::{BANDWIDTH, CommandFilter, Filtered};
use core::f32::consts::FRAC_PI_2;
use proptest::prelude::*;

/// Relative rounding error of one `f32` operation.
const U: f64 = 1.0 / (1 << 24) as f64;

/// Draws any accepted bandwidth and time step, log-uniform, and the bounds often.
fn bandwidth_and_step() -> impl Strategy<Value = (f32, f32)> {
    let over = |range: afbc_types::Range| {
        prop_oneof![
            4 => (range.min.ln()..=range.max.ln()).prop_map(move |x| x.exp().clamp(range.min, range.max) as f32),
            1 => Just(range.min as f32),
            1 => Just(range.max as f32),
        ]
    };
    (over(BANDWIDTH), over(Settings::DT.range))
}

fn filtered() -> impl Strategy<Value = Filtered> {
    (-1.6_f32..1.6, -20.0_f32..20.0).prop_map(|(angle, rate)| Filtered { angle, rate })
}

/// Returns the exact solution of d^2 x/dt^2 = w^2 (command - x) - 2 w dx/dt after time t, in `f64`.
fn exact(w: f64, t: f64, state: &Filtered, command: f32) -> [f64; 2] {
    let (c, v) = (f64::from(command), f64::from(state.rate));
    let offset = f64::from(state.angle) - c;
    // The general solution is c + (A + B t) exp(-w t).
    let (a, b) = (offset, v + w * offset);
    let decay = (-w * t).exp();
    [c + (a + b * t) * decay, (b - w * (a + b * t)) * decay]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn one_step_is_the_exact_solution((w, dt) in bandwidth_and_step(), state in filtered(), command in -1.6_f32..1.6) {
        let next = CommandFilter::new(w, dt).unwrap().advance(&state, command);
        let (w, dt) = (f64::from(w), f64::from(dt));
        let [angle, rate] = exact(w, dt, &state, command);
        // Sum the magnitudes of the terms |command|, |offset|, w dt |offset| and dt |rate|, with 8 roundings each. The
        // decay has a relative error of 1.2e-7, plus u w dt for its rounded argument.
        let offset = f64::from(state.angle - command).abs();
        let slope = f64::from(state.rate).abs() + w * offset;
        let decay = (-w * dt).exp();
        let relative = 8.0 * U + 1.2e-7 + U * w * dt;
        let angle_size = f64::from(command.abs()) + (offset + slope * dt) * decay;
        let rate_size = (f64::from(state.rate).abs() + w * slope * dt) * decay;
        // The offset itself is rounded: u times both angles, which enters both sums.
        let carried = U * (f64::from(state.angle.abs()) + f64::from(command.abs())) * (1.0 + w * dt) * decay;
        prop_assert!(
            (f64::from(next.angle) - angle).abs() <= relative * angle_size + carried,
            "{next:?} for {angle}, {rate}"
        );
        prop_assert!(
            (f64::from(next.rate) - rate).abs() <= relative * rate_size + w * (1.0 + w * dt) * carried,
            "{next:?} for {angle}, {rate}"
        );
    }

    /// `rate` is the derivative of `angle`, and `acceleration` that of `rate`, checked by differences of filter steps.
    #[test]
    fn rate_and_acceleration_are_derivatives(w in 1.0_f32..60.0, state in filtered(), command in -1.6_f32..1.6) {
        let dt = 1e-3_f32;
        let filter = CommandFilter::new(w, dt).unwrap();
        let next = filter.advance(&state, command);
        let (w, h) = (f64::from(w), f64::from(dt));
        let mean = |a: f32, b: f32| (f64::from(a) + f64::from(b)) / 2.0;
        let difference = |a: f32, b: f32| (f64::from(b) - f64::from(a)) / h;
        // The trapezoidal rule is off by h^2/12 of the second derivative. The third and fourth derivatives of
        // (A + B t) exp(-w t) are at most w^2 (3 B + w A) and w^3 (4 B + w A).
        let offset = f64::from(state.angle - command).abs();
        let b = f64::from(state.rate).abs() + w * offset;
        let (third, fourth) = (w * w * (3.0 * b + w * offset), w * w * w * (4.0 * b + w * offset));
        // A difference quotient amplifies the rounding errors of its operands by 1/h.
        let angle_rounding = 16.0 * U * (1.6 + offset + b * h) / h;
        let rate_rounding = 16.0 * U * (1.0 + w * h) * (f64::from(state.rate).abs() + w * (offset + 1.6)) / h;
        let rate_error = difference(state.angle, next.angle) - mean(state.rate, next.rate);
        prop_assert!(rate_error.abs() <= h * h / 12.0 * third + angle_rounding, "{rate_error:e}");
        let accelerations = mean(filter.acceleration(&state, command), filter.acceleration(&next, command));
        let acceleration_error = difference(state.rate, next.rate) - accelerations;
        prop_assert!(acceleration_error.abs() <= h * h / 12.0 * fourth + rate_rounding, "{acceleration_error:e}");
    }

    #[test]
    fn it_converges_to_the_command((w, dt) in bandwidth_and_step(), state in filtered(), command in -1.6_f32..1.6) {
        let filter = CommandFilter::new(w, dt).unwrap();
        // exp(-25) (1 + 25) is 4e-10 of the initial offset.
        let steps = (25.0 / (f64::from(w) * f64::from(dt))).ceil() as u32 + 1;
        let settled = (0..steps).fold(state, |state, _| filter.advance(&state, command));
        // The remaining error is rounding: each step rounds the command's magnitude once, and a slow filter (w dt =
        // 1e-4) accumulates the errors of one time constant, 1/(w dt) steps.
        let lasting = 2.0 * U * f64::from(command.abs()) * (1.0 + 2.0 / (f64::from(w) * f64::from(dt)));
        let left = 4e-10 * (20.0 / f64::from(w) + 4.0);
        prop_assert!(
            (f64::from(settled.angle) - f64::from(command)).abs() <= lasting + left + 1e-7,
            "{settled:?} for {command}"
        );
        prop_assert!(
            f64::from(settled.rate).abs() <= f64::from(w) * (lasting + left + 1e-7),
            "{settled:?} for {command}"
        );
    }

    /// A critically damped filter that starts at rest never overshoots, for any w dt.
    #[test]
    fn it_does_not_overshoot((w, dt) in bandwidth_and_step(), from in -1.6_f32..1.6, command in -1.6_f32..1.6) {
        let filter = CommandFilter::new(w, dt).unwrap();
        let mut state = Filtered { angle: from, rate: 0.0 };
        let (low, high) = (from.min(command) - 1e-6, from.max(command) + 1e-6);
        for _ in 0..2000 {
            state = filter.advance(&state, command);
            prop_assert!((low..=high).contains(&state.angle), "{state:?} outside {low} to {high}");
        }
    }

    /// Commands within +-pi/2, as from (40), keep angle and rate bounded in any order: the filter's impulse response
    /// w^2 t exp(-w t) is positive with area 1, and the absolute area of its derivative is 2 w / e.
    #[test]
    fn bounded_commands_keep_it_bounded(
        (w, dt) in bandwidth_and_step(),
        commands in prop::collection::vec(-FRAC_PI_2..FRAC_PI_2, 1..300),
        relay in any::<bool>(),
    ) {
        let filter = CommandFilter::new(w, dt).unwrap();
        let mut state = Filtered::default();
        for command in commands {
            let command = if relay { FRAC_PI_2.copysign(command) } else { command };
            state = filter.advance(&state, command);
            prop_assert!(state.angle.abs() <= 1.5709, "{state:?}");
            prop_assert!(
                f64::from(state.rate).abs() <= 2.0 * f64::from(w) / core::f64::consts::E * 1.5709,
                "{state:?}"
            );
        }
    }

    /// A rate limit bounds the rate and the distance per step, leaves a slower filter unchanged to the bit, and lets
    /// the filter reach its command.
    #[test]
    fn a_rate_limit_limits(
        (w, dt) in bandwidth_and_step(),
        state in filtered(),
        command in -1.6_f32..1.6,
        limit in 0.1_f32..30.0,
    ) {
        let free = CommandFilter::new(w, dt).unwrap();
        let filter = free.limited(limit).unwrap();
        let next = filter.advance(&state, command);
        prop_assert!(next.rate.abs() <= limit, "{next:?}");
        let travel = f64::from(next.angle) - f64::from(state.angle);
        prop_assert!(
            travel.abs() <= f64::from(limit) * f64::from(dt) * (1.0 + 2.0 * U) + 2.0 * U * f64::from(next.angle.abs())
        );
        let unlimited = free.advance(&state, command);
        if unlimited.rate.abs() <= limit && (unlimited.angle - state.angle).abs() <= limit * dt {
            prop_assert_eq!(next, unlimited);
        } else {
            // The limited filter moves in the direction of the unlimited filter. If the unlimited filter's rate is
            // within the limit, the limited filter moves towards the unlimited filter's next angle.
            let onward = if unlimited.rate.abs() > limit { unlimited.rate } else { unlimited.angle - state.angle };
            prop_assert_eq!(next.rate, limit.copysign(onward));
            prop_assert!((f64::from(next.angle) - f64::from(state.angle)) * f64::from(onward) >= 0.0);
        }
        // At the limit, with the command beyond it, the rate is constant.
        let pressed = Filtered { angle: command - limit - 1.0, rate: limit };
        let presses = free.acceleration(&pressed, command) > 0.0;
        prop_assert_eq!(
            filter.acceleration(&pressed, command),
            if presses { 0.0 } else { free.acceleration(&pressed, command) }
        );
        let slower = Filtered { rate: 0.5 * limit, ..pressed };
        prop_assert_eq!(filter.acceleration(&slower, command), free.acceleration(&slower, command));

        let (mut settled, start) = (Filtered { rate: 0.0, ..state }, f64::from(state.angle - command).abs());
        let steps = ((25.0 / f64::from(w) + start / f64::from(limit)) / f64::from(dt)) as u32 + 2;
        if steps < 20_000 {
            for _ in 0..steps {
                settled = filter.advance(&settled, command);
            }
            prop_assert!((settled.angle - command).abs() < 1e-3, "{settled:?} for {command}");
        }
    }
}

#[test]
fn a_rate_limit_out_of_range_is_refused_by_name() {
    for rate in [0.0, 0.09, 1.1e6, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(
            CommandFilter::new(40.0, 0.001).unwrap().limited(rate).unwrap_err().range.name,
            "tilt_rate_max_rad_s"
        );
    }
}

#[test]
fn a_bandwidth_out_of_range_is_refused_by_name() {
    for bandwidth in [0.0, 0.99, 1000.1, -40.0, f32::NAN, f32::INFINITY] {
        assert_eq!(CommandFilter::new(bandwidth, 0.001).unwrap_err().range, BANDWIDTH);
    }
}
