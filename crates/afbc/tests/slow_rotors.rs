//! Gains and settings for rotors with more lag than the rotors of the paper's vehicle.

use afbc::disturbance::DisturbanceObserver;
use afbc::{LAG_S, Profile, Settings, slowness};
use afbc_types::{Axis, Declared, Parameters};
use core::convert::Infallible;

fn close(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-6 * b.abs()
}

#[test]
fn quick_rotors_change_nothing_and_slow_ones_change_every_gain_by_its_power_of_time() {
    let paper = Parameters::PAPER.to_f32();
    let (base, settings) = (Profile::Flight.gains(), Profile::Flight.settings());
    for quick in [0.0, 0.5 * LAG_S, LAG_S] {
        assert_eq!(slowness(quick), 1.0);
        assert_eq!(Profile::Flight.gains_for(&paper, quick), base);
        // The observers use the rotors' own lag.
        let disturbance = DisturbanceObserver { disturbance_lag_s: quick, ..settings.disturbance };
        assert_eq!(Profile::Flight.settings_for(3.0, quick), Settings { disturbance, ..settings });
    }
    for lag_s in [0.033_f32, 0.072, 0.2] {
        let k = slowness(lag_s);
        // Of the loop's 50 ms on the paper's vehicle, 20 are its rotors'.
        assert!(close(k, (lag_s + 0.03) / 0.05), "{k}");
        let (gains, slow) = (Profile::Flight.gains_for(&paper, lag_s), Profile::Flight.settings_for(2.0, lag_s));
        assert_eq!(slow.disturbance.disturbance_lag_s, lag_s);
        assert!(close(slow.disturbance.disturbance_rad_s, settings.disturbance.disturbance_rad_s / k));
        assert!(close(slow.disturbance.disturbance_tilt_rad_s, settings.disturbance.disturbance_tilt_rad_s / k));
        for axis in Axis::ALL {
            let (g, b) = (&gains[axis], &base[axis]);
            assert!(close(g.backstepping.alpha1, b.backstepping.alpha1 / k), "{}", axis.name());
            assert!(close(g.backstepping.alpha2, b.backstepping.alpha2 / k), "{}", axis.name());
            assert!(close(g.gamma, b.gamma / (k * k)) && close(g.eta, b.eta / (k * k)), "{}", axis.name());
            assert!(close(g.epsilon, b.epsilon * k), "{}", axis.name());
            assert!(close(g.safeguards.sigma, b.safeguards.sigma / k), "{}", axis.name());
            // Disturbances do not slow down.
            assert_eq!(g.safeguards.theta_max, b.safeguards.theta_max);
            assert_eq!(g.safeguards.delta_max, b.safeguards.delta_max);
            assert_eq!(g.membership, b.membership);
            // Near zero the robust term has the gain delta_hat/epsilon, which slows down like alpha_2.
            let robust = |gains: &afbc::adaptive::Gains| gains.safeguards.delta_max / gains.epsilon;
            assert!(close(robust(g) / robust(b), g.backstepping.alpha2 / b.backstepping.alpha2), "{}", axis.name());
        }
        assert!(close(slow.command_filter_rad_s, settings.command_filter_rad_s / k));
        assert!(close(slow.limits.tilt_rate_max_rad_s, settings.limits.tilt_rate_max_rad_s / k));
        assert_eq!(slow.common.rotor_force_max_n, 2.0);
        assert_eq!(slow.limits.speed_max_m_s, settings.limits.speed_max_m_s);
    }
}

/// Each setting is scaled by the power of time in its unit, which its key shows. The time step and the task's limits of
/// speed, acceleration and turning stay.
#[test]
fn every_setting_slows_down_by_its_power_of_time() {
    let numbers = |settings: &Settings| {
        let mut numbers = Vec::new();
        let Ok(()) = settings.visit(&mut |declaration, value| {
            numbers.extend(value.numbers().map(|number| (declaration.range.name, number)));
            Ok::<(), Infallible>(())
        });
        numbers
    };
    let power = |key: &str| match key {
        // The observer along z finds the age of the states itself, of which the rotor lag is a part.
        "dt_s" | "reference_yaw_rate_rad_s" | "disturbance_z_rad_s" => 0,
        key if key.ends_with("_rad_s") => -1,
        key if key.ends_with("_lag_s") || key == "lead_s" => 1,
        _ => 0,
    };
    let settings = Profile::Flight.settings();
    for slowness in [1.0_f32, 1.65, 3.6] {
        let lag_s = 0.05 * slowness - 0.03;
        let slow = numbers(&settings.slowed(slowness, lag_s));
        for ((key, before), (_, after)) in numbers(&settings).into_iter().zip(slow) {
            let slower = before * f64::from(slowness).powi(power(key));
            let expected = if key == "disturbance_lag_s" { f64::from(lag_s) } else { slower };
            assert!((after - expected).abs() <= 1e-6 * expected.abs(), "{key}: {after} of {before}, not {expected}");
        }
    }
    assert!(numbers(&settings).iter().filter(|(key, before)| power(key) != 0 && *before > 0.0).count() >= 10);
}

/// The profile `paper` assumes rotors without lag, whatever the vehicle's rotors are.
#[test]
fn the_printed_gains_do_not_slow_down() {
    let paper = Parameters::PAPER.to_f32();
    assert_eq!(Profile::Paper.gains_for(&paper, 0.1), Profile::Paper.gains());
    assert_eq!(Profile::Paper.settings_for(1.0, 0.1), Profile::Paper.settings());
}
