//! The IMU's lever is found in flights of a rigid body that vibrates.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc_estimator::{ImuSample, LeverArmEstimator};
use core::f64::consts::TAU;
use nalgebra::Vector3;
use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

const STEP_S: f64 = 1e-3;
const G: f64 = 9.81;

struct Random(Xoshiro256PlusPlus);

impl Random {
    /// Returns a uniform number within -1 and 1.
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Returns a number with variance 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() * 0.5
    }

    fn vector(&mut self, draw: fn(&mut Self) -> f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| draw(self))
    }
}

/// A multirotor that steps from attitude to attitude as a second-order system.
struct Body {
    random: Random,
    hover_rad_s: f64,
    /// Amplitudes of one rotor's vibration \[rad/s, m/s2\], and phases by rotor, sensor and axis.
    vibration: [f64; 2],
    phases: [[Vector3<f64>; 2]; 4],
    lever_m: Vector3<f64>,
    biases: [Vector3<f64>; 2],
    aim_rad: Vector3<f64>,
    angles_rad: Vector3<f64>,
    rates: Vector3<f64>,
    velocity: Vector3<f64>,
    climb: [f64; 2],
    next_s: f64,
    steps: u64,
}

impl Body {
    fn new(seed: u64, lever_m: Vector3<f64>, hover_rad_s: f64, vibration: [f64; 2]) -> Self {
        let mut random = Random(Xoshiro256PlusPlus::seed_from_u64(seed));
        let phases = core::array::from_fn(|_| core::array::from_fn(|_| random.vector(Random::uniform) * TAU));
        let biases = [random.vector(Random::uniform) * 0.02, random.vector(Random::uniform) * 0.3];
        let zero = Vector3::zeros();
        let (aim_rad, angles_rad, rates, velocity) = (zero, zero, zero, zero);
        Body {
            random,
            hover_rad_s,
            vibration,
            phases,
            lever_m,
            biases,
            aim_rad,
            angles_rad,
            rates,
            velocity,
            climb: [0.0; 2],
            next_s: 0.0,
            steps: 0,
        }
    }

    /// Simulates one millisecond, with attitude and climb steps of these sizes.
    fn sample(&mut self, tilt_rad: f64, climb_m_s2: f64) -> ImuSample {
        let time_s = self.steps as f64 * STEP_S;
        self.steps += 1;
        if time_s >= self.next_s {
            self.next_s = time_s + 0.6 + 0.3 * self.random.uniform();
            self.aim_rad = self.random.vector(Random::uniform) * tilt_rad;
            self.climb[1] = self.random.uniform() * climb_m_s2;
        }
        // The vehicle turns as fast as a small multirotor, and more slowly about the vertical.
        let stiffness = Vector3::new(100.0, 100.0, 10.0);
        let damping = Vector3::new(16.0, 16.0, 5.0);
        let off = self.aim_rad - self.angles_rad;
        let acceleration = off.component_mul(&stiffness) - self.rates.component_mul(&damping);
        self.rates += acceleration * STEP_S;
        self.angles_rad += self.rates * STEP_S;
        self.climb[0] += (self.climb[1] - self.climb[0]) * 10.0 * STEP_S;
        // Drag is proportional to the velocity that the tilt causes.
        self.velocity +=
            (Vector3::new(G * self.angles_rad.y, -G * self.angles_rad.x, 0.0) - self.velocity * 0.3) * STEP_S;
        let force = Vector3::new(0.0, 0.0, G + self.climb[0]) - self.velocity * 0.3;
        let (r, omega) = (self.lever_m, self.rates);
        let felt = force + acceleration.cross(&r) + omega.cross(&omega.cross(&r));
        let mut read = [omega + self.biases[0], felt + self.biases[1]];
        for (rotor, phases) in self.phases.iter().enumerate() {
            let angle = self.hover_rad_s * (0.97 + 0.02 * rotor as f64) * time_s;
            for ((read, phases), amplitude) in read.iter_mut().zip(phases).zip(self.vibration) {
                for (harmonic, share) in [(1.0, 1.0), (2.0, 0.5)] {
                    *read += phases.map(|phase| (harmonic * (angle + phase)).cos()) * (amplitude * share);
                }
            }
        }
        let noise = [self.random.vector(Random::normal) * 0.002, self.random.vector(Random::normal) * 0.03];
        ImuSample {
            at_us: self.steps * 1000,
            rates_rad_s: (read[0] + noise[0]).cast(),
            specific_force_m_s2: (read[1] + noise[1]).cast(),
        }
    }
}

fn lever() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-0.05..0.05_f64).prop_map(Vector3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    /// In 10 s of manoeuvres the vertical distance is found within 1.5 cm. Only turns about the vertical show the
    /// horizontal distances well. The errors of these distances agree with their standard deviations.
    #[test]
    fn a_lever_is_found(
        seed in any::<u64>(), lever_m in lever(), hover_rad_s in 180.0..1800.0_f64, shaken in 0.0..0.05_f64,
        pushed in 0.0..2.0_f64,
    ) {
        let mut body = Body::new(seed, lever_m, hover_rad_s, [shaken, pushed]);
        let mut finder = LeverArmEstimator::new(hover_rad_s as f32);
        for _ in 0..10_000 {
            let _ = finder.correct(body.sample(0.3, 2.0), true);
        }
        let [found_m, sigma_m] = finder.found_m();
        let off_m = found_m.cast::<f64>() - lever_m;
        prop_assert!(off_m.z.abs() < 0.015, "{lever_m} {found_m} {sigma_m}");
        // The errors are within the standard deviations, apart from drag and turns so fast that the filters' delays
        // matter.
        let stated = off_m.iter().zip(&sigma_m).all(|(off_m, sigma_m)| off_m.abs() < 4.0 * f64::from(*sigma_m) + 0.003);
        prop_assert!(stated, "{lever_m} {found_m} {sigma_m}");
        // Each axis is corrected by the found lever, or not corrected yet.
        let corrected_m = finder.corrected_m();
        let mut parts = corrected_m.iter().zip(&found_m);
        let one_or_none = parts.all(|(part, found)| *part == 0.0 || (part - found).abs() < 2e-3);
        prop_assert!(one_or_none, "{corrected_m} {found_m}");
    }

    /// A hovering vehicle finds and corrects nothing, whatever its vibration.
    #[test]
    fn no_vibration_is_a_lever(
        seed in any::<u64>(), hover_rad_s in 180.0..1800.0_f64, shaken in 0.0..0.1_f64, pushed in 0.0..4.0_f64,
    ) {
        let mut body = Body::new(seed, Vector3::zeros(), hover_rad_s, [shaken, pushed]);
        let mut finder = LeverArmEstimator::new(hover_rad_s as f32);
        for _ in 0..20_000 {
            let sample = body.sample(0.02, 0.5);
            prop_assert_eq!(finder.correct(sample, true), sample);
        }
    }
}
