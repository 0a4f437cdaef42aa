//! A signal and its derivative through the same second-order low-pass filter.
//!
//! AFBC's [`CommandFilter`] w^2 / (s + w)^2 gives the filtered signal together with its exact derivative, without a
//! difference quotient. Two signals through filters of equal w are delayed equally, which INDI relies on. The -3 dB
//! frequency is 0.64 w, the delay at low frequencies 2 / w. White noise of standard deviation sigma per sample becomes
//! noise of sigma sqrt(dt w^3 / 4) on the derivative.

use afbc_control::command_filter::{CommandFilter, Filtered};
use afbc_types::OutOfRange;
use nalgebra::Vector3;

/// Filter of the three coordinates of a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Differentiator(CommandFilter);

/// State of the filter; starts at the first sample, at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Smooth {
    axes: Option<[Filtered; 3]>,
}

impl Smooth {
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
    /// Makes a filter of the given w \[rad/s\], advanced every `dt_s` seconds.
    ///
    /// # Errors
    /// If w is outside [`afbc_control::command_filter::BANDWIDTH`].
    pub fn new(bandwidth_rad_s: f32, dt_s: f32) -> Result<Self, OutOfRange> {
        CommandFilter::new(bandwidth_rad_s, dt_s).map(Differentiator)
    }

    /// Feeds the sample of this step.
    #[inline]
    pub fn advance(&self, smooth: &mut Smooth, sample: &Vector3<f32>) {
        let start = |angle| Filtered { angle, rate: 0.0 };
        let [x, y, z] = smooth.axes.unwrap_or([start(sample.x), start(sample.y), start(sample.z)]);
        smooth.axes = Some([self.0.advance(&x, sample.x), self.0.advance(&y, sample.y), self.0.advance(&z, sample.z)]);
    }

    /// Returns the second derivative under the input `sample`, per second squared; 0 before the first sample.
    #[inline]
    pub fn second_derivative(&self, smooth: &Smooth, sample: &Vector3<f32>) -> Vector3<f32> {
        smooth.axes.map_or(Vector3::zeros(), |[x, y, z]| {
            Vector3::new(
                self.0.acceleration(&x, sample.x),
                self.0.acceleration(&y, sample.y),
                self.0.acceleration(&z, sample.z),
            )
        })
    }
}
