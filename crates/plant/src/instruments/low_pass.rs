//! Anti-alias filter.

use core::f64::consts::{PI, SQRT_2};
use libm::{sqrt, tan};
use nalgebra::Vector3;

/// Second-order Butterworth low-pass of three coordinates, by the bilinear transform with the exact cut-off. A cut-off
/// at or above half the sampling rate does not filter the samples.
#[derive(Clone, Debug)]
pub(super) struct LowPass {
    /// Cut-off, infinite without a filter.
    cutoff_hz: f64,
    /// b0 = b2 = b1/2, a1, a2; `None` passes everything.
    weights: Option<[f64; 3]>,
    /// State of the transposed direct form II, `None` before the first value.
    state: Option<[Vector3<f64>; 2]>,
}

impl LowPass {
    /// Creates a filter; a cut-off of 0 means no filter.
    pub(super) fn new(cutoff_hz: f64, step_s: f64) -> Self {
        let weights = (cutoff_hz > 0.0 && cutoff_hz * step_s < 0.5).then(|| {
            let k = tan(PI * cutoff_hz * step_s);
            let scale = 1.0 / (1.0 + SQRT_2 * k + k * k);
            [k * k * scale, 2.0 * (k * k - 1.0) * scale, (1.0 - SQRT_2 * k + k * k) * scale]
        });
        LowPass { cutoff_hz: if cutoff_hz > 0.0 { cutoff_hz } else { f64::INFINITY }, weights, state: None }
    }

    /// Returns the filtered value. The filter starts as if the first value had always been there.
    pub(super) fn pass(&mut self, value: Vector3<f64>) -> Vector3<f64> {
        let Some([b, a1, a2]) = self.weights else { return value };
        let [first, second] = self.state.unwrap_or([value * (1.0 - b), value * (b - a2)]);
        let out = value * b + first;
        self.state = Some([value * (2.0 * b) - out * a1 + second, value * b - out * a2]);
        out
    }

    /// Returns the gain of the analogue filter at this frequency.
    #[inline]
    pub(super) fn share(&self, frequency_hz: f64) -> f64 {
        let ratio = frequency_hz / self.cutoff_hz;
        1.0 / sqrt(1.0 + ratio * ratio * ratio * ratio)
    }
}
