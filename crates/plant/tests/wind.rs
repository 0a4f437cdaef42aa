//! Compares wind with MIL-F-8785C: gusts by their shape, turbulence by statistics of long samples.
//!
//! In a sample of length T of a stationary Gaussian process with autocorrelation rho, the autocovariance at any lag has
//! a variance of at most 2/T times the integral of rho^2 over all lags (Bartlett 1946), in units of the process's
//! variance squared. That integral is L/V for the longitudinal velocity and 5/8 L/V for the others. Bounds are five
//! standard errors.

use afbc_plant::{CosineGust, Environment, Gust, GustKind, Motion, Plant, PlantModel, Realism, Turbulence, Wind};
use afbc_types::{Axis, Parameters, RotorSpeeds};
use nalgebra::Vector3;

const FOOT_M: f64 = 0.3048;
const P: Parameters<f64> = Parameters::PAPER;

/// Returns a vehicle that floats in place: weight compensated, rotors off, no drag.
fn floating(height_m: f64, wind: Wind, seed: u64, step_s: f64) -> Plant {
    let lift =
        Gust { axis: Axis::Z, kind: GustKind::Acceleration, size: -P.gravity_m_s2, start_s: 0.0, end_s: f64::INFINITY };
    let environment = Environment::new(P, vec![], vec![lift]).unwrap();
    let initial = Motion { position_m: Vector3::new(0.0, 0.0, height_m), ..Motion::default() };
    let realism = Realism { wind, seed, ..Realism::default() };
    Plant::with_realism(PlantModel::Simplified, initial, environment, &realism, step_s).unwrap()
}

fn air(plant: &mut Plant, step_s: f64) -> Vector3<f64> {
    plant.step(&RotorSpeeds::<4>::default(), step_s);
    plant.telemetry().unwrap().wind_m_s
}

#[test]
fn a_gust_rises_and_falls_as_one_minus_cosine() {
    let peak = Vector3::new(4.0, -2.0, 1.0);
    let gust = CosineGust { velocity_m_s: peak, start_s: 1.0, rise_s: 0.5, hold_s: 2.0 };
    // The shares are V/2 (1 - cos(pi x)) at x = 0, 1/3, 1/2, 2/3 and 1, calculated by hand.
    for (since, share) in [(-1.0, 0.0), (0.0, 0.0), (0.5 / 3.0, 0.25), (0.25, 0.5), (1.0 / 3.0, 0.75), (0.5, 1.0)] {
        assert!((gust.at(1.0 + since) - peak * share).amax() < 1e-12);
        assert!((gust.at(4.0 - since) - peak * share).amax() < 1e-12, "falls as it rose");
    }
    assert_eq!(gust.at(2.0), peak);
    assert_eq!(gust.at(5.0), Vector3::zeros());
    let forever = CosineGust { hold_s: f64::INFINITY, ..gust };
    assert_eq!(forever.at(1e6), peak);

    let other = CosineGust { velocity_m_s: Vector3::x(), start_s: 0.0, rise_s: 1.0, hold_s: 0.0 };
    let wind = Wind { steady_m_s: Vector3::new(0.0, 3.0, 0.0), gusts: vec![gust, other], turbulence: None };
    let mut plant = floating(10.0, wind, 0, 0.01);
    for k in 0..500 {
        let t = f64::from(k) * 0.01;
        let expected = Vector3::new(0.0, 3.0, 0.0) + gust.at(t) + other.at(t);
        assert!((air(&mut plant, 0.01) - expected).amax() < 1e-12);
    }
}

#[test]
fn turbulence_has_the_specifications_strength_and_size() {
    let turbulence = Turbulence { wind_20ft_m_s: 10.0, airspeed_floor_m_s: 1.0 };
    // At 1,000 ft, the upper end of the model, turbulence is isotropic: L = 1,000 ft, sigma = 0.1 W20.
    let top = turbulence.at(1000.0 * FOOT_M);
    assert!((top.horizontal_length_m - 304.8).abs() < 1e-9 && (top.vertical_length_m - 304.8).abs() < 1e-9);
    assert!((top.horizontal_m_s - 1.0).abs() < 1e-12 && (top.vertical_m_s - 1.0).abs() < 1e-12);
    // At 100 ft: 0.177 + 0.0823 = 0.2593; L = 100/0.2593^1.2 = 505.2 ft, sigma = 1/0.2593^0.4 = 1.7161.
    let low = turbulence.at(100.0 * FOOT_M);
    assert!((low.horizontal_length_m / FOOT_M - 505.2).abs() < 0.1, "{}", low.horizontal_length_m / FOOT_M);
    assert!((low.horizontal_m_s - 1.7161).abs() < 1e-3 && (low.vertical_m_s - 1.0).abs() < 1e-12);
    assert_eq!(turbulence.at(-5.0), turbulence.at(10.0 * FOOT_M));
    assert_eq!(turbulence.at(5000.0), top);
    assert!((Turbulence::MODERATE.wind_20ft_m_s - 15.43).abs() < 0.01);
}

/// Returns autocovariances of turbulence alone, along, across and up, for a vehicle in steady wind along +y.
fn autocovariances(height_m: f64, wind_m_s: f64, step_s: f64, samples: usize, lags: &[[usize; 3]]) -> Vec<[f64; 3]> {
    let steady_m_s = Vector3::new(0.0, wind_m_s, 0.0);
    let wind = Wind { steady_m_s, gusts: vec![], turbulence: Some(Turbulence::MODERATE) };
    let mut plant = floating(height_m, wind, 17, step_s);
    let mut series = [const { Vec::new() }; 3];
    for _ in 0..samples {
        let eddies = air(&mut plant, step_s) - steady_m_s;
        // The three directions are along the wind (+y), to its left (-x), and up.
        for (series, value) in series.iter_mut().zip([eddies.y, -eddies.x, eddies.z]) {
            series.push(value);
        }
    }
    let at = |axis: usize, lag: usize| {
        let x: &[f64] = &series[axis];
        x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>() / (x.len() - lag) as f64
    };
    let cross = series[0].iter().zip(&series[1]).map(|(a, b)| a * b).sum::<f64>() / samples as f64;
    let mut found: Vec<_> = lags.iter().map(|lag| [at(0, lag[0]), at(1, lag[1]), at(2, lag[2])]).collect();
    found.push([cross; 3]);
    found
}

fn check_turbulence(height_m: f64, wind_m_s: f64, step_s: f64) {
    let samples = 2_000_000;
    let i = Turbulence::MODERATE.at(height_m);
    let tau = [i.horizontal_length_m, i.horizontal_length_m, i.vertical_length_m].map(|length| length / wind_m_s);
    let sigma = [i.horizontal_m_s, i.horizontal_m_s, i.vertical_m_s];
    let multiples = [0.0, 0.1, 0.5, 1.0, 2.0, 3.0];
    let lags: Vec<_> = multiples.iter().map(|m| tau.map(|tau| (m * tau / step_s).round() as usize)).collect();
    let found = autocovariances(height_m, wind_m_s, step_s, samples, &lags);
    let duration_s = samples as f64 * step_s;
    for (lag, found) in lags.iter().zip(&found) {
        for axis in 0..3 {
            let x = lag[axis] as f64 * step_s / tau[axis];
            // Longitudinal exp(-x); lateral and vertical exp(-x) (1 - x/2): the transforms of the Dryden spectra.
            let (rho, integral) =
                if axis == 0 { ((-x).exp(), tau[axis]) } else { ((-x).exp() * (1.0 - 0.5 * x), 0.625 * tau[axis]) };
            let bound = 5.0 * (2.0 * integral / duration_s).sqrt();
            assert!(bound < 0.1, "a sample too short says nothing: {bound}");
            let error = found[axis] / (sigma[axis] * sigma[axis]) - rho;
            assert!(error.abs() < bound, "axis {axis}, lag {x} L/V: off by {error}, bound {bound}");
        }
    }
    let cross = found[lags.len()][0] / (sigma[0] * sigma[1]);
    assert!(cross.abs() < 5.0 * (tau[0] / duration_s).sqrt(), "along and across are correlated: {cross}");
}

#[test]
fn turbulence_at_30_m_has_the_dryden_autocovariance() {
    check_turbulence(30.0, 40.0, 0.02);
}

#[test]
fn turbulence_near_the_ground_has_the_dryden_autocovariance() {
    check_turbulence(2.0, 8.0, 0.01);
}

/// The discretisation is exact, so even steps as long as the length scale give the right variance.
#[test]
fn coarse_steps_have_the_dryden_autocovariance() {
    check_turbulence(1.0, 50.0, 0.02);
}

/// The structure function at one millisecond gives the slope of the longitudinal spectrum: E (du)^2 = 2 sigma^2 V dt/L.
#[test]
fn a_millisecond_of_turbulence_is_as_rough_as_it_should_be() {
    let (height_m, speed, step_s, n) = (5.0, 6.0, 0.001, 1_000_000_u32);
    let wind = Wind { steady_m_s: Vector3::new(speed, 0.0, 0.0), gusts: vec![], turbulence: Some(Turbulence::LIGHT) };
    let mut plant = floating(height_m, wind, 3, step_s);
    let (mut last, mut squares) = (air(&mut plant, step_s), Vector3::zeros());
    for _ in 0..n {
        let now = air(&mut plant, step_s);
        squares += (now - last).component_mul(&(now - last)) / f64::from(n);
        last = now;
    }
    let i = Turbulence::LIGHT.at(height_m);
    let expected = |rho_drop: f64, sigma: f64| 2.0 * sigma * sigma * rho_drop;
    let (h, g) = (speed * step_s / i.horizontal_length_m, speed * step_s / i.vertical_length_m);
    let lateral = |h: f64| 1.0 - (-h).exp() * (1.0 - 0.5 * h);
    let expected = Vector3::new(
        expected(1.0 - (-h).exp(), i.horizontal_m_s),
        expected(lateral(h), i.horizontal_m_s),
        expected(lateral(g), i.vertical_m_s),
    );
    // Nearly independent squares: a relative standard error of sqrt(2/n).
    let error = squares.component_div(&expected) - Vector3::repeat(1.0);
    assert!(error.amax() < 5.0 * (2.0 / f64::from(n)).sqrt() + 1e-3, "{error}");
}

#[test]
fn a_vehicle_that_hovers_in_still_air_meets_turbulence_at_the_floors_speed() {
    let turbulence = Turbulence { airspeed_floor_m_s: 20.0, ..Turbulence::LIGHT };
    let with = |steady: f64, turbulence| {
        let wind = Wind { steady_m_s: Vector3::new(steady, 0.0, 0.0), gusts: vec![], turbulence: Some(turbulence) };
        let mut plant = floating(10.0, wind, 9, 0.01);
        (0..1000).map(|_| air(&mut plant, 0.01) - Vector3::new(steady, 0.0, 0.0)).collect::<Vec<_>>()
    };
    let hovering = with(0.0, turbulence);
    let blown = with(20.0, Turbulence::LIGHT);
    assert!(hovering.iter().zip(&blown).all(|(a, b)| (a - b).amax() < 1e-12));
}

#[test]
fn the_same_seed_gives_the_same_wind_and_another_seed_another() {
    let with = |seed| {
        let wind = Wind { turbulence: Some(Turbulence::SEVERE), ..Wind::default() };
        let mut plant = floating(10.0, wind, seed, 0.001);
        (0..500)
            .flat_map(|_| air(&mut plant, 0.001).iter().map(|x| x.to_bits()).collect::<Vec<_>>())
            .collect::<Vec<_>>()
    };
    assert_eq!(with(1), with(1));
    assert_ne!(with(1), with(2));
}

#[test]
fn wind_out_of_range_is_refused_by_name() {
    let refused = |wind: Wind| {
        let realism = Realism { wind, ..Realism::default() };
        let environment = Environment::calm(P).unwrap();
        Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, 0.001)
            .unwrap_err()
            .range
            .name
    };
    let gust = CosineGust { velocity_m_s: Vector3::x(), start_s: 0.0, rise_s: 1.0, hold_s: 0.0 };
    let gusts = |gust| Wind { gusts: vec![gust], ..Wind::default() };
    assert_eq!(refused(Wind { steady_m_s: Vector3::new(0.0, f64::NAN, 0.0), ..Wind::default() }), "steady_m_s");
    assert_eq!(refused(gusts(CosineGust { velocity_m_s: Vector3::x() * 60.0, ..gust })), "velocity_m_s");
    assert_eq!(refused(gusts(CosineGust { rise_s: 0.0, ..gust })), "rise_s");
    assert_eq!(refused(gusts(CosineGust { hold_s: -1.0, ..gust })), "hold_s");
    let turbulence = |turbulence| Wind { turbulence: Some(turbulence), ..Wind::default() };
    assert_eq!(refused(turbulence(Turbulence { wind_20ft_m_s: 60.0, ..Turbulence::LIGHT })), "wind_20ft_m_s");
    assert_eq!(refused(turbulence(Turbulence { airspeed_floor_m_s: 0.0, ..Turbulence::LIGHT })), "airspeed_floor_m_s");
}
