//! Tests the flight core's pose observer against the plant, a different model in `f64`. The vehicle rolls, pitches,
//! yaws and climbs. A motion-capture system of 100 Hz with 12 ms delay tracks it.
#![allow(clippy::unwrap_used, missing_docs)] // tests

use afbc_control::Mixer;
use afbc_flight_core::Stamped;
use afbc_flight_core::dead_reckoning::DeadReckoning;
use afbc_flight_core::motor::Response;
use afbc_flight_core::observer::PoseObserver;
use afbc_scenario::parse;
use afbc_types::{Inputs, Parameters, Pose, PoseSigmas, State};
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Root mean square errors from 2 s on.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    position_m: f64,
    velocity_m_s: f64,
    attitude_rad: f64,
    rates_rad_s: f64,
}

/// Returns pseudo-random numbers of a roughly normal distribution.
fn noise(seed: &mut u64) -> Vector3<f32> {
    let mut uniform = || {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 40) as f32 / (1 << 24) as f32 - 0.5
    };
    Vector3::from_fn(|_, _| (0..12).map(|_| uniform()).sum())
}

/// Flies for 10 s with rotors of 20 ms lag, under a law of this test that knows the truth.
fn flown(scenario: &str, position_sigma_m: f32, attitude_sigma_rad: f32) -> Errors {
    on_rotors(0.02, &Response::DEFAULT, scenario, [position_sigma_m, attitude_sigma_rad])
}

/// Flies with rotors of this lag; `known` is the rotor response that the flight software assumes.
fn on_rotors(lag_s: f32, known: &Response, scenario: &str, sigmas: [f32; 2]) -> Errors {
    let [position_sigma_m, attitude_sigma_rad] = sigmas;
    let text = format!(
        "rotors = {{ time_constant_s = {lag_s}, delay_s = 0.001, force_max_n = 3.0 }}\n{scenario}\n\
         [trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 20]\n[initial]\nposition_m = [0, 0, 20]\n"
    );
    let mut plant = parse("observer", &text, "observer").unwrap().plant(1e-3).unwrap();
    let nominal = Parameters::PAPER.to_f32();
    let mixer = Mixer::<4>::new(nominal, 3.0).unwrap();
    let blind = DeadReckoning::new(&nominal, known, 1e-3);
    let hover = Inputs { thrust_n: nominal.weight_n(), ..Inputs::default() };
    let start = State { position_m: Vector3::new(0.0, 0.0, 20.0), ..State::default() };
    let (mut reckoning, mut observer) = (blind.start(&start), PoseObserver::new(&start, &hover, 0));
    let (mut applied, mut waiting, mut seed) = (hover, VecDeque::new(), 1);
    let (mut sums, mut steps) = (Errors::default(), 0.0);
    for ms in 0..10_000_u64 {
        let (now_us, t) = (1_000 * (ms + 1), 1e-3 * ms as f32);
        let truth = plant.motion();
        let (p, v) = (truth.position_m.cast::<f32>(), truth.velocity_m_s.cast::<f32>());
        let (eta, w) = (truth.attitude_rad.cast::<f32>(), plant.truth().rates_rad_s.cast::<f32>());
        if ms % 10 == 0 {
            let tracked = State {
                position_m: p + noise(&mut seed) * position_sigma_m,
                attitude_rad: eta + noise(&mut seed) * attitude_sigma_rad,
                ..State::default()
            };
            waiting.push_back(Stamped { value: Pose::of(&tracked, PoseSigmas::UNKNOWN), at_us: now_us });
        }
        observer.advance(&blind, &reckoning, &applied);
        let arrives = |pose: &Stamped<Pose>| pose.age_us(now_us) >= 12_000;
        if waiting.front().is_some_and(arrives)
            && let Some(pose) = waiting.pop_front()
        {
            observer.correct(&pose, now_us);
        }
        let seen = observer.state().unwrap();
        blind.advance(&mut reckoning, &applied);
        blind.measure(&mut reckoning, &seen);
        if ms >= 2_000 {
            let square = |error: Vector3<f32>| f64::from(error.norm_squared());
            sums.position_m += square(seen.position_m - p);
            sums.velocity_m_s += square(seen.velocity_m_s - v);
            sums.attitude_rad += square(seen.attitude_rad - eta);
            sums.rates_rad_s += square(seen.rates_rad_s - w);
            steps += 1.0;
        }

        // Swing about each axis with a different period.
        let wanted = Vector3::new(0.3 * (3.0 * t).sin(), 0.25 * (2.3 * t).sin(), 0.4 * (1.1 * t).sin());
        let (stiffness, damping) = (Vector3::new(60.0, 60.0, 6.0), Vector3::new(16.0, 16.0, 5.0));
        let turning = stiffness.component_mul(&(wanted - eta)) - damping.component_mul(&w);
        let moment = turning.component_div(&nominal.effectiveness());
        let climb_m_s2 = 1.5 * (1.7 * t).sin() - 2.0 * (p.z - 20.0) - 2.0 * v.z;
        let level = eta.x.cos() * eta.y.cos();
        let thrust_n = nominal.mass_kg * (nominal.gravity_m_s2 + climb_m_s2) / level;
        let asked = Inputs { thrust_n, roll_n: moment.x, pitch_n: moment.y, yaw_n: moment.z };
        let action = mixer.action(&asked);
        plant.step(&action.speeds, 1e-3);
        applied = action.given;
        blind.trim(&mut reckoning, &applied);
    }
    let root = |sum: f64| (sum / steps).sqrt();
    Errors {
        position_m: root(sums.position_m),
        velocity_m_s: root(sums.velocity_m_s),
        attitude_rad: root(sums.attitude_rad),
        rates_rad_s: root(sums.rates_rad_s),
    }
}

#[test]
fn velocity_and_rates_are_those_of_the_plant() {
    let perfect = flown("", 0.0, 0.0);
    let noisy = flown("", 0.001, 0.0035);
    let windy = flown("drag = {}\nwind = { steady_m_s = [3.0, 1.0, 0.0], turbulence = \"light\" }", 0.001, 0.0035);
    let weak = flown("change = [{ parameter = \"thrust-factor\", factor = 0.8, start_s = 0.0 }]", 0.001, 0.0035);
    // Without compensation of its delay, a pose of 12 ms ago would be off by 0.011 rad at this flight's 0.9 rad/s, and
    // by 0.012 m at its 1 m/s.
    assert!(perfect.attitude_rad < 1e-3 && perfect.rates_rad_s < 0.03, "{perfect:?}");
    // The bounds are a tenth of the flown velocities, a fifth of the rates, and the tracker's attitude noise, which is
    // 0.006 rad over three axes.
    for errors in [perfect, noisy, windy, weak] {
        assert!(errors.position_m < 0.01 && errors.velocity_m_s < 0.15, "{errors:?}");
        assert!(errors.attitude_rad < 0.007 && errors.rates_rad_s < 0.15, "{errors:?}");
    }
}

/// The vehicle has the rotor lag of the Crazyflie, then of the racer. The observer assumes the true lag, then the
/// paper's.
#[test]
fn rates_are_observed_better_with_the_vehicles_own_rotors() {
    for (lag_s, gain) in [(0.072, 1.3), (0.033, 1.04)] {
        let rates = |time_constant_s| on_rotors(lag_s, &Response { time_constant_s }, "", [0.0, 0.0]).rates_rad_s;
        let (own, papers) = (rates(lag_s), rates(Response::DEFAULT.time_constant_s));
        assert!(own * gain < papers, "{lag_s} s: {own} rad/s, and {papers} rad/s with the paper's");
    }
}
