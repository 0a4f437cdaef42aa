//! Low-pass filter of second order that also gives the derivative of the filtered signal.
//!
//! AFBC's [`CommandFilter`] w^2 / (s + w)^2 gives the filtered signal and its exact derivative, without a difference
//! quotient. Filters with equal w delay two signals equally, on which INDI relies. The -3 dB frequency is 0.64 w, the
//! delay at low frequencies 2 / w. White noise with the standard deviation sigma per sample becomes noise of sigma
//! sqrt(dt w^3 / 4) on the derivative.

use afbc_control::command_filter::{CommandFilter, Filtered};
use afbc_types::OutOfRange;
use nalgebra::Vector3;

/// Filter of the three coordinates of a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Differentiator(CommandFilter);

/// State of the filter. It starts at the first sample with zero derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DifferentiatorMemory {
    axes: Option<[Filtered; 3]>,
}

impl DifferentiatorMemory {
    /// Returns the filtered signal, in its unit; 0 before the first sample.
    #[inline]
    pub fn value(&self) -> Vector3<f32> {
        self.axes.map_or(Vector3::zeros(), |[x, y, z]| Vector3::new(x.angle, y.angle, z.angle))
    }

    /// Returns the derivative of the filtered signal, per second; 0 before the first sample.
    #[inline]
    pub fn derivative(&self) -> Vector3<f32> {
        self.axes.map_or(Vector3::zeros(), |[x, y, z]| Vector3::new(x.rate, y.rate, z.rate))
    }
}

impl Differentiator {
    /// Creates a filter with this w \[rad/s\], advanced every `dt_s` seconds.
    ///
    /// # Errors
    /// Returns an error if w is outside [`afbc_control::command_filter::BANDWIDTH`].
    pub fn new(bandwidth_rad_s: f32, dt_s: f32) -> Result<Self, OutOfRange> {
        CommandFilter::new(bandwidth_rad_s, dt_s).map(Differentiator)
    }

    /// Filters the sample of this step.
    #[inline]
    pub fn advance(&self, smooth: &mut DifferentiatorMemory, sample: &Vector3<f32>) {
        let start = |angle| Filtered { angle, rate: 0.0 };
        let [x, y, z] = smooth.axes.unwrap_or([start(sample.x), start(sample.y), start(sample.z)]);
        smooth.axes = Some([self.0.advance(&x, sample.x), self.0.advance(&y, sample.y), self.0.advance(&z, sample.z)]);
    }

    /// Returns the second derivative with the input `sample`, per second squared; 0 before the first sample.
    #[inline]
    pub fn second_derivative(&self, smooth: &DifferentiatorMemory, sample: &Vector3<f32>) -> Vector3<f32> {
        smooth.axes.map_or(Vector3::zeros(), |[x, y, z]| {
            Vector3::new(
                self.0.acceleration(&x, sample.x),
                self.0.acceleration(&y, sample.y),
                self.0.acceleration(&z, sample.z),
            )
        })
    }
}
