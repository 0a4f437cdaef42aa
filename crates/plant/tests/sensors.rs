//! Compares the sensors with their settings.

use afbc_plant::{Deviations, MeasurementDropouts, Motion, Sensing, StateMeasurement, StateSensor};
use nalgebra::Vector3;

const STEP_S: f64 = 0.001;

fn sensors(sensing: Sensing, seed: u64) -> StateSensor {
    StateSensor::new(&sensing, seed, STEP_S).unwrap()
}

/// Returns a different motion at every step, exact in f32.
fn motion(k: u16) -> Motion {
    let v = |offset: u16| Vector3::repeat(f64::from(k + offset));
    Motion { position_m: v(0), velocity_m_s: v(1), attitude_rad: v(2), rates_rad_s: v(3) }
}

/// Returns the twelve coordinates of a measurement at zero motion.
fn numbers(measurement: &StateMeasurement) -> Vec<f64> {
    let s = &measurement.state;
    let groups = [&s.position_m, &s.velocity_m_s, &s.attitude_rad, &s.rates_rad_s];
    groups.iter().flat_map(|v| v.iter()).map(|&x| f64::from(x)).collect()
}

#[test]
fn perfect_sensors_measure_the_motion() {
    let mut sensors = sensors(Sensing::default(), 1);
    for k in 0..100 {
        let measurement = sensors.measure(&motion(k));
        assert_eq!(measurement, StateMeasurement { state: motion(k).measure(), age_s: 0.0, fresh: true, new: true });
    }
}

/// Sample variances of Gaussian noise have a relative standard error of sqrt(2/n); bounds are five of them.
#[test]
fn noise_and_bias_are_as_large_as_asked() {
    let noise = Deviations { position_m: 0.02, velocity_m_s: 0.05, attitude_rad: 0.003, rates_rad_s: 0.01 };
    let bias = Deviations { position_m: 0.5, velocity_m_s: 0.1, attitude_rad: 0.02, rates_rad_s: 0.03 };
    let mut sensors = sensors(Sensing { noise, bias, ..Sensing::default() }, 5);
    let n = 200_000;
    let samples: Vec<_> = (0..n).map(|_| numbers(&sensors.measure(&Motion::default()))).collect();
    let drawn = sensors.bias();
    let drawn: Vec<f64> = [drawn.position_m, drawn.velocity_m_s, drawn.attitude_rad, drawn.rates_rad_s]
        .iter()
        .flat_map(|v| v.iter().copied().collect::<Vec<_>>())
        .collect();
    let n = f64::from(n);
    for i in 0..12 {
        let std = [0.02, 0.05, 0.003, 0.01][i / 3];
        let mean = samples.iter().map(|x| x[i]).sum::<f64>() / n;
        assert!((mean - drawn[i]).abs() < 5.0 * std / n.sqrt(), "bias {i}");
        let variance = samples.iter().map(|x| (x[i] - mean).powi(2)).sum::<f64>() / n;
        assert!((variance / (std * std) - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "noise {i}");
        let next = samples.windows(2).map(|x| (x[0][i] - mean) * (x[1][i] - mean)).sum::<f64>() / n;
        assert!((next / (std * std)).abs() < 5.0 / n.sqrt(), "noise {i} is white");
        let other = samples.iter().map(|x| (x[i] - mean) * (x[(i + 1) % 12] - drawn[(i + 1) % 12])).sum::<f64>() / n;
        assert!((other / (std * [0.02, 0.05, 0.003, 0.01][(i + 1) % 12 / 3])).abs() < 5.0 / n.sqrt());
    }
}

/// Over many flights, the bias has the requested spread; within one, it is constant.
#[test]
fn bias_is_spread_over_flights() {
    let sensing = Sensing { bias: Deviations::all(0.1), ..Sensing::default() };
    let flights = 2000;
    let mut squares = 0.0;
    for seed in 0..flights {
        let mut sensors = sensors(sensing, seed);
        let first = sensors.measure(&Motion::default());
        assert_eq!(first.state, sensors.measure(&Motion::default()).state);
        squares += numbers(&first).iter().map(|x| x * x).sum::<f64>();
    }
    let n = flights as f64 * 12.0;
    assert!((squares / n / 0.01 - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
}

#[test]
fn measurements_arrive_exactly_as_many_steps_later() {
    for (delay_s, steps) in [(0.001, 1), (0.004, 4), (0.1, 100)] {
        let mut sensors = sensors(Sensing { delay_s, ..Sensing::default() }, 1);
        for k in 0..300_u16 {
            let measurement = sensors.measure(&motion(k));
            // Until the first delayed state arrives, the first state is returned.
            assert_eq!(measurement.state, motion(k.saturating_sub(steps)).measure());
            assert!(measurement.fresh && (measurement.age_s - delay_s).abs() < 1e-12);
        }
    }
}

/// At step k the measurement is the newest sample that has arrived by then, with a gyro's rates of step k.
#[test]
fn samples_arrive_once_per_period_and_stand_in_between() {
    for (period, late, gyro) in [(10, 0, false), (10, 10, true), (10, 3, true), (7, 20, false), (1, 4, true)] {
        let at = |steps: u16| f64::from(steps) * STEP_S;
        let mut sensors = sensors(Sensing { period_s: at(period), delay_s: at(late), gyro, ..Sensing::default() }, 1);
        for k in 0..300_u16 {
            let measurement = sensors.measure(&motion(k));
            let sampled = k.saturating_sub(late) / period * period;
            let mut expected = motion(sampled).measure();
            if gyro {
                expected.rates_rad_s = motion(k).measure().rates_rad_s;
            }
            assert_eq!(measurement.state, expected, "step {k}, every {period}, {late} late");
            assert!(measurement.fresh);
            let arrives = k == 0 || (k + period - late % period).is_multiple_of(period);
            assert_eq!(measurement.new, arrives || gyro, "step {k}, every {period}, {late} late");
            if k >= late {
                assert!((measurement.age_s - at(k - sampled)).abs() < 1e-9);
            }
        }
    }
}

/// Sampling draws the same noise as measuring in every step. A dropout loses the sample that would have arrived in it,
/// and the gyro's rates.
#[test]
fn samples_have_the_noise_of_their_step_and_dropouts_lose_them() {
    let noisy = Sensing { noise: Deviations::all(0.01), ..Sensing::default() };
    let sampled = Sensing { period_s: 0.01, gyro: true, ..noisy };
    let lossy = Sensing { dropouts: Some(MeasurementDropouts { rate_hz: 20.0, mean_s: 0.01 }), ..sampled };
    let run = |sensing| {
        let mut sensors = sensors(sensing, 3);
        (0..5000).map(|k| sensors.measure(&motion(k))).collect::<Vec<_>>()
    };
    let (every, sampled, lossy) = (run(noisy), run(sampled), run(lossy));
    let mut lost = 0;
    for (k, (a, b)) in sampled.iter().zip(&lossy).enumerate() {
        assert_eq!(a.state.position_m, every[k / 10 * 10].state.position_m);
        assert_eq!(a.state.rates_rad_s, every[k].state.rates_rad_s);
        assert_eq!(b.new, b.fresh);
        if b.fresh {
            assert_eq!(b.state.rates_rad_s, every[k].state.rates_rad_s);
        } else {
            assert_eq!(b.state, lossy[k - 1].state);
        }
        let taken = k - (b.age_s / STEP_S).round() as usize;
        assert_eq!(b.state.position_m, every[taken].state.position_m, "the age is the position's");
        lost += u32::from(taken.is_multiple_of(10) && taken < k / 10 * 10);
    }
    assert!(lost > 100, "{lost}");
}

/// Dropouts are a two-state chain that begins with 1 - exp(-rate dt) and ends with 1 - exp(-dt/mean) per step. Over n
/// steps, the share of time lost has a variance of p (1 - p)/n (1 + r)/(1 - r), with the chain's correlation r per
/// step.
#[test]
fn dropouts_are_as_frequent_and_as_long_as_asked() {
    let dropouts = MeasurementDropouts { rate_hz: 2.0, mean_s: 0.05 };
    let mut sensors = sensors(Sensing { dropouts: Some(dropouts), ..Sensing::default() }, 8);
    let n = 2_000_000_u32;
    let (mut lost, mut count, mut last_fresh, mut held) = (0_u32, 0_u32, true, Motion::default().measure());
    for k in 0..n {
        let m = motion((k % 50_000) as u16);
        let measurement = sensors.measure(&m);
        if measurement.fresh {
            assert_eq!((measurement.state, measurement.age_s), (m.measure(), 0.0));
            held = measurement.state;
        } else {
            assert_eq!(measurement.state, held);
            lost += 1;
            count += u32::from(last_fresh);
        }
        last_fresh = measurement.fresh;
    }
    let (begins, ends) = (1.0 - (-2.0 * STEP_S).exp(), 1.0 - (-STEP_S / 0.05).exp());
    let (p, r, n) = (begins / (begins + ends), 1.0 - begins - ends, f64::from(n));
    let share = f64::from(lost) / n;
    assert!((share - p).abs() < 5.0 * (p * (1.0 - p) / n * (1.0 + r) / (1.0 - r)).sqrt(), "{share} of {p}");
    assert!((p - 2.0 * 0.05 / (1.0 + 2.0 * 0.05)).abs() < 0.002);
    let mean_s = f64::from(lost) / f64::from(count) * STEP_S;
    assert!((mean_s * ends / STEP_S - 1.0).abs() < 5.0 / f64::from(count).sqrt(), "{mean_s}");
}

#[test]
fn age_grows_in_a_dropout() {
    let dropouts = MeasurementDropouts { rate_hz: 1000.0, mean_s: 0.01 };
    let mut sensors = sensors(Sensing { dropouts: Some(dropouts), delay_s: 0.003, ..Sensing::default() }, 2);
    assert!(sensors.measure(&motion(0)).fresh, "the first one arrives");
    let mut expected_s = 0.003;
    for k in 1..5000 {
        let measurement = sensors.measure(&motion(k));
        expected_s = if measurement.fresh { 0.003 } else { expected_s + STEP_S };
        assert!((measurement.age_s - expected_s).abs() < 1e-9);
        let steps = (measurement.age_s / STEP_S).round() as u16;
        assert_eq!(measurement.state, motion(k.saturating_sub(steps)).measure(), "the age is the state's");
    }
}

#[test]
fn the_same_seed_measures_the_same_and_dropouts_do_not_change_the_noise() {
    let sensing = Sensing { noise: Deviations::all(0.01), bias: Deviations::all(0.1), ..Sensing::default() };
    let lossy = Sensing { dropouts: Some(MeasurementDropouts { rate_hz: 100.0, mean_s: 0.01 }), ..sensing };
    let run = |sensing, seed| {
        let mut sensors = sensors(sensing, seed);
        (0..1000).map(|_| sensors.measure(&Motion::default())).collect::<Vec<_>>()
    };
    assert_eq!(run(lossy, 1), run(lossy, 1));
    assert_ne!(run(sensing, 1), run(sensing, 2));
    let (steady, lossy) = (run(sensing, 1), run(lossy, 1));
    assert!(lossy.iter().any(|m| !m.fresh));
    assert!(steady.iter().zip(&lossy).all(|(a, b)| !b.fresh || a.state == b.state));
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let refused = |sensing: Sensing| StateSensor::new(&sensing, 0, STEP_S).unwrap_err().range.name;
    let ok = Sensing::default;
    assert_eq!(
        refused(Sensing { noise: Deviations { position_m: -1.0, ..Deviations::default() }, ..ok() }),
        "position_m"
    );
    assert_eq!(
        refused(Sensing { bias: Deviations { rates_rad_s: f64::NAN, ..Deviations::default() }, ..ok() }),
        "rates_rad_s"
    );
    assert_eq!(refused(Sensing { delay_s: 1.0, ..ok() }), "delay_s");
    assert_eq!(refused(Sensing { period_s: 1.0, ..ok() }), "period_s");
    assert_eq!(
        refused(Sensing { dropouts: Some(MeasurementDropouts { rate_hz: -1.0, mean_s: 0.1 }), ..ok() }),
        "rate_hz"
    );
    assert_eq!(StateSensor::new(&ok(), 0, 0.0).unwrap_err().range.name, "step_s");
}
