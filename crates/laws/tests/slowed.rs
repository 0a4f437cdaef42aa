//! Gains for slower rotors: each gain scales with its power of time, here taken from its key and not from its unit.

use afbc_laws::{dfbc, geometric, indi, l1, mpc, pid, slowed};
use afbc_types::Declared;
use core::convert::Infallible;

/// Returns key, value and range of every number.
fn numbers(gains: &impl Declared) -> Vec<(&'static str, f64, [f64; 2])> {
    let mut numbers = Vec::new();
    let Ok(()) = gains.visit(&mut |declaration, value| {
        let range = declaration.range;
        numbers.extend(value.numbers().map(|number| (range.name, number, [range.min, range.max])));
        Ok::<(), Infallible>(())
    });
    numbers
}

/// Returns the exponent of time in a key's unit.
fn power(key: &str) -> i32 {
    if key.ends_with("_1_s3") {
        -3
    } else if key.ends_with("_1_s2") {
        -2
    } else if key.ends_with("_1_s4") {
        -4
    } else if key.ends_with("_1_s") || key.ends_with("_rad_s") {
        -1
    } else if ["lead_s", "tilt_lag_s", "lift_lag_s", "plan_step_s"].contains(&key) {
        1
    } else {
        0
    }
}

fn check(gains: &(impl Declared + Clone)) {
    for (slowness, lag_s) in [(1.0_f32, 0.02_f32), (1.0, 0.01), (1.65, 0.033), (3.6, 0.072)] {
        let slow = numbers(&slowed(gains.clone(), slowness, lag_s));
        for ((key, before, [min, max]), (_, after, _)) in numbers(gains).into_iter().zip(slow) {
            // The rotor model gets the rotors' lag.
            let models = key == "rotor_time_constant_s";
            let slower = before * f64::from(slowness).powi(power(key));
            let expected = if models { f64::from(lag_s) } else { slower.clamp(min, max) };
            assert!((after - expected).abs() <= 1e-6 * expected.abs(), "{key}: {after} of {before}, not {expected}");
            assert!(slowness > 1.0 || models || after == before, "{key} is {after}, not {before}");
        }
    }
    assert!(numbers(gains).iter().filter(|(key, ..)| power(key) != 0).count() >= 8);
}

#[test]
fn every_gain_slows_down_by_its_power_of_time() {
    check(&pid::Gains::TUNED);
    check(&geometric::Gains::TUNED);
    check(&indi::Gains::TUNED);
    check(&l1::Gains::TUNED);
    check(&dfbc::Gains::TUNED);
    check(&mpc::Gains::TUNED);
}
