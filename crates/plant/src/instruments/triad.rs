//! Three axes of a gyroscope or accelerometer.

use super::low_pass::LowPass;
use super::markov::{GaussMarkov, draw};
use crate::noise::Noise;
use libm::{rint, sqrt};
use nalgebra::{Matrix3, Vector3};

/// Properties of a triad, in the unit of the measured quantity. Zero switches an error off.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriadErrors {
    /// One-sided density of the white noise, per root of hertz.
    pub(super) noise: f64,
    /// Stationary standard deviation of the bias instability, and its correlation time \[s\].
    pub(super) instability: f64,
    pub(super) instability_s: f64,
    /// Standard deviation of the bias's random walk after one second.
    pub(super) walk: f64,
    /// Standard deviations of bias, scale factor and misalignment, drawn once.
    pub(super) bias: f64,
    pub(super) scale: f64,
    pub(super) misalignment: f64,
    /// Largest value, and step of the output.
    pub(super) range: f64,
    pub(super) lsb: f64,
    /// Cut-off of the anti-alias filter \[Hz\].
    pub(super) cutoff_hz: f64,
}

/// Triad in simulation: scale and misalignment, bias and noise, then filter, range and quantisation.
#[derive(Clone, Debug)]
pub(super) struct SimulatedTriad {
    distortion: Matrix3<f64>,
    constant: Vector3<f64>,
    instability: GaussMarkov,
    walk: Vector3<f64>,
    walk_per_step: f64,
    white: f64,
    pub(super) filter: LowPass,
    range: f64,
    lsb: f64,
}

impl SimulatedTriad {
    pub(super) fn new(quality: &TriadErrors, random: &mut Noise, step_s: f64) -> Self {
        let constant = draw(random) * quality.bias;
        let scale = draw(random) * quality.scale;
        let mut distortion = Matrix3::from_fn(|_, _| random.normal() * quality.misalignment);
        distortion.set_diagonal(&(Vector3::repeat(1.0) + scale));
        let instability = Vector3::repeat(quality.instability);
        SimulatedTriad {
            distortion,
            constant,
            instability: GaussMarkov::new(instability, quality.instability_s, step_s, random),
            walk: Vector3::zeros(),
            walk_per_step: quality.walk * sqrt(step_s),
            // White noise of this density up to half the sampling rate.
            white: quality.noise * sqrt(0.5 / step_s),
            filter: LowPass::new(quality.cutoff_hz, step_s),
            range: if quality.range > 0.0 { quality.range } else { f64::INFINITY },
            lsb: quality.lsb,
        }
    }

    /// Returns the present bias: sum of constant part, instability and random walk.
    pub(super) fn bias(&self) -> Vector3<f64> {
        self.constant + self.instability.value + self.walk
    }

    /// Measures `truth` in sensor axes. `vibration` has already passed the filter.
    pub(super) fn measure(
        &mut self,
        truth: &Vector3<f64>,
        vibration: &Vector3<f64>,
        random: &mut Noise,
    ) -> Vector3<f64> {
        self.instability.advance(random);
        self.walk += draw(random) * self.walk_per_step;
        let analogue = self.distortion * truth + self.bias() + draw(random) * self.white;
        let (range, lsb) = (self.range, self.lsb);
        // The vibration is added after the filter, which works on samples: vibration above half the sampling rate would
        // pass it as an alias.
        (self.filter.pass(analogue) + vibration).map(|value| {
            let value = value.clamp(-range, range);
            // `rint`, because `round` takes three times as long.
            if lsb > 0.0 { rint(value / lsb) * lsb } else { value }
        })
    }
}
