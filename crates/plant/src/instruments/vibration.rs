//! Vibration of the body at the rotor frequencies.

use super::low_pass::LowPass;
use crate::frame::PerRotor;
use crate::noise::{Noise, NoiseStream};
use crate::truth::Truth;
use core::f64::consts::TAU;
use libm::{cos, floor, sin, sincos};
use nalgebra::Vector3;

/// Number of harmonics of each rotor's frequency.
const HARMONICS: usize = 3;

/// Cosine and sine of a phase.
type CosineSine = (f64, f64);

/// Vibration as a sum over the rotors of A_k (omega/omega_hover)^2 cos(k theta + phi) on each axis, with the rotor
/// angle theta and random constant phases phi. The force of an unbalanced rotor is proportional to omega^2, hence the
/// square.
#[derive(Clone, Debug)]
pub(super) struct SimulatedVibration {
    /// Angle of each rotor, within 0 to 2 pi \[rad\].
    angle: PerRotor,
    /// Rotor speeds at the last step.
    speeds_rad_s: Option<PerRotor>,
    /// Phases by rotor, harmonic, sensor (gyroscope, accelerometer) and axis.
    phases: [[[[CosineSine; 3]; 2]; HARMONICS]; afbc_types::ROTORS_MAX],
    /// Relative amplitudes of the harmonics.
    harmonics: Vector3<f64>,
    /// Amplitude of a rotor's first harmonic at hover, by sensor.
    amplitudes: [f64; 2],
    step_s: f64,
}

impl SimulatedVibration {
    /// Creates the vibration with the amplitudes `[rad/s, m/s2]`.
    pub(super) fn new(amplitudes: [f64; 2], harmonics: Vector3<f64>, seed: u64, step_s: f64) -> Self {
        let mut random = Noise::new(seed, NoiseStream::Vibration);
        let angle = PerRotor::from_fn(|_, _| TAU * random.uniform());
        let mut phases = [[[[(1.0, 0.0); 3]; 2]; HARMONICS]; afbc_types::ROTORS_MAX];
        phases.as_flattened_mut().as_flattened_mut().as_flattened_mut().iter_mut().for_each(|phase| {
            let phi = TAU * random.uniform();
            *phase = (cos(phi), sin(phi));
        });
        SimulatedVibration { angle, speeds_rad_s: None, phases, harmonics, amplitudes, step_s }
    }

    /// Returns the vibration as `[angular rate, specific force]` after the sensors' filters.
    pub(super) fn advance(&mut self, truth: &Truth, filters: [&LowPass; 2]) -> [Vector3<f64>; 2] {
        let mut sum = [Vector3::zeros(); 2];
        if self.amplitudes == [0.0; 2] || truth.hover_rad_s == 0.0 {
            return sum;
        }
        let now = truth.rotor_speeds_rad_s;
        let mean = (self.speeds_rad_s.unwrap_or(now) + now) * 0.5;
        self.speeds_rad_s = Some(now);
        let turning = self.angle.as_mut_slice().iter_mut().zip(mean.as_slice()).zip(now.as_slice());
        let rotors = turning.zip(&self.phases);
        for (((angle, mean), speed), phases) in rotors {
            if *speed == 0.0 && *mean == 0.0 {
                continue;
            }
            let turned = *angle + mean * self.step_s;
            *angle = if (0.0..TAU).contains(&turned) { turned } else { turned - TAU * floor(turned / TAU) };
            let (s, c) = sincos(*angle);
            let growth = (speed / truth.hover_rad_s) * (speed / truth.hover_rad_s);
            // Cosine and sine of k theta.
            let (mut ck, mut sk, mut k) = (1.0, 0.0, 0.0);
            for (phases, relative) in phases.iter().zip(self.harmonics.iter()) {
                (ck, sk, k) = (ck * c - sk * s, sk * c + ck * s, k + 1.0);
                let frequency_hz = k * speed / TAU;
                let sensors = sum.iter_mut().zip(phases).zip(self.amplitudes).zip(filters);
                for (((sum, [x, y, z]), amplitude), filter) in sensors {
                    let size = amplitude * relative * growth * filter.share(frequency_hz);
                    let part = |(cos_phi, sin_phi): &CosineSine| ck * cos_phi - sk * sin_phi;
                    *sum += Vector3::new(part(x), part(y), part(z)) * size;
                }
            }
        }
        sum
    }
}
