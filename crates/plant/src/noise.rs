//! Seeded random numbers with the same bits on every machine.
//!
//! Bits come from xoshiro256++ (Blackman, Vigna 2021, *Scrambled linear pseudorandom number generators*). Normal
//! numbers come from the ziggurat (Marsaglia, Tsang 2000, *The ziggurat method for generating random variables*, J.
//! Stat. Softw. 5(8)) with 256 layers. The ziggurat is implemented here because the logarithm of a library version
//! would depend on the features that other crates enable; this one always uses `libm`.

use core::fmt;
use libm::{exp, log};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// User of a stream of random numbers. Streams of one seed do not overlap: each begins 2^128 draws after the previous
/// one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseStream {
    /// Turbulence.
    Wind,
    /// Measurement noise and bias.
    Sensors,
    /// Dropouts of measurements.
    Dropouts,
    /// Quantities drawn by a campaign: parameters, winds, faults.
    Scenario,
    /// Gyroscope and accelerometer.
    Imu,
    /// Phases of the rotors' vibration.
    Vibration,
    /// Errors and delays of a tracker.
    Tracker,
    /// Dropouts of a tracker.
    TrackerLoss,
    /// Freezes of a tracker.
    TrackerFreeze,
    /// Errors and delays of a GNSS receiver.
    Gnss,
    /// Losses of a GNSS receiver.
    GnssLoss,
    /// Barometer.
    Barometer,
    /// Magnetometer.
    Magnetometer,
    /// Noise of failed instruments.
    Failures,
}

/// A stream of random numbers.
#[derive(Clone, PartialEq, Eq)]
pub struct Noise {
    bits: Xoshiro256PlusPlus,
}

// The generator's internal state is not informative.
impl fmt::Debug for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Noise")
    }
}

impl Noise {
    /// Creates the random numbers of `stream` with `seed`.
    pub fn new(seed: u64, stream: NoiseStream) -> Self {
        let mut bits = Xoshiro256PlusPlus::seed_from_u64(seed);
        // By the order of the variants: a new one must go last, so that the others keep their numbers.
        for _ in 0..stream as usize {
            bits.jump();
        }
        Noise { bits }
    }

    /// Draws a uniform number in \[0, 1), a multiple of 2^-53.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
        (self.bits.next_u64() >> 11) as f64 * STEP
    }

    /// Draws a normal number with mean 0 and variance 1.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        let [x] = self.normals();
        x
    }

    /// Draws N normal numbers, the same as one after the other, but faster.
    #[inline]
    pub fn normals<const N: usize>(&mut self) -> [f64; N] {
        // A copy whose address no call takes stays in registers.
        let mut stream = self.clone();
        let numbers = core::array::from_fn(|_| {
            loop {
                let bits = stream.bits.next_u64();
                // The lowest eight bits select the layer, the highest 53 the position in it, so no bit is used twice.
                let Some(layer) = LAYERS.get((bits & 0xff) as usize) else { continue };
                let x = (bits.cast_signed() >> 11) as f64 * layer.step;
                if x.abs() < layer.width_above {
                    return x;
                }
                let (after, accepted) = stream.clone().beyond(layer, x);
                stream = after;
                if let Some(x) = accepted {
                    return x;
                }
            }
        });
        *self = stream;
        numbers
    }

    /// Handles the 1.2 % outside of every layer's core: the tail, or the part near the curve. Also returns the advanced
    /// stream.
    #[cold]
    #[inline(never)]
    fn beyond(mut self, layer: &ZigguratLayer, x: f64) -> (Self, Option<f64>) {
        if layer.height == LAYERS_BASE_HEIGHT {
            let far = self.tail().copysign(x);
            return (self, Some(far));
        }
        let y = layer.height + (layer.height_above - layer.height) * self.uniform();
        (self, (y < exp(-0.5 * x * x)).then_some(x))
    }

    /// Draws a normal number beyond R (Marsaglia 1964).
    fn tail(&mut self) -> f64 {
        loop {
            // In (0, 1], so both logarithms are finite.
            let (x, y) = (-log(1.0 - self.uniform()) / R, -log(1.0 - self.uniform()));
            if 2.0 * y > x * x {
                return R + x;
            }
        }
    }
}

/// Abscissa at which the tail begins.
const R: f64 = 3.654_152_885_361_009;
/// Area of each layer under exp(-x^2/2), the lowest including the tail.
const AREA: f64 = 4.928_673_233_974_655e-3;

/// Horizontal layer under exp(-x^2/2).
#[derive(Clone, Copy)]
struct ZigguratLayer {
    /// Half width divided by 2^52, one step of the position. The half width is the curve's abscissa at the lower edge;
    /// the lowest layer is widened to include the tail's area.
    step: f64,
    /// Half width of the next layer up. Within it, every height of this layer is under the curve.
    width_above: f64,
    /// The curve's height at the half width.
    height: f64,
    /// The curve's height at `width_above`.
    height_above: f64,
}

/// Number of positions between the middle of a layer and its edge.
const STEPS: f64 = (1_u64 << 52) as f64;

/// Height of the lowest layer, whose lower edge is not on the curve.
const LAYERS_BASE_HEIGHT: f64 = 0.0;

static LAYERS: [ZigguratLayer; 256] = layers();

#[expect(clippy::indexing_slicing, reason = "evaluated when compiled")]
const fn layers() -> [ZigguratLayer; 256] {
    let (mut x, mut y) = (R, gauss(R));
    let base = ZigguratLayer { step: AREA / y / STEPS, width_above: R, height: LAYERS_BASE_HEIGHT, height_above: y };
    let mut layers = [base; 256];
    let mut i = 1;
    while i < 256 {
        // Each layer has the same area, x (y_above - y). The topmost ends at the peak.
        let (x_above, y_above) = if i == 255 { (0.0, 1.0) } else { (gauss_inverse(y + AREA / x, x), y + AREA / x) };
        layers[i] = ZigguratLayer { step: x / STEPS, width_above: x_above, height: y, height_above: y_above };
        (x, y) = (x_above, y_above);
        i += 1;
    }
    layers
}

/// Returns exp(-x^2/2) from the series at a 64th of the exponent, squared six times.
const fn gauss(x: f64) -> f64 {
    let small = -0.5 * x * x / 64.0;
    let (mut sum, mut term, mut n) = (1.0, 1.0, 1.0);
    while n < 16.0 {
        term *= small / n;
        sum += term;
        n += 1.0;
    }
    let mut squarings = 0;
    while squarings < 6 {
        sum *= sum;
        squarings += 1;
    }
    sum
}

/// Returns x > 0 with exp(-x^2/2) = y by Newton's method, starting at `x`, which must be slightly too large.
const fn gauss_inverse(y: f64, mut x: f64) -> f64 {
    let mut round = 0;
    while round < 20 {
        x += (gauss(x) - y) / (x * gauss(x));
        round += 1;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_lie_on_the_curve_and_share_one_area() {
        let close = |a: f64, b: f64, what| assert!((a - b).abs() < 1e-13, "{what}: {a} != {b}");
        for pair in LAYERS.windows(2) {
            let [below, above] = pair else { unreachable!() };
            let width = above.step * STEPS;
            assert!(above.step < below.step && above.height > below.height);
            close(below.width_above, width, "width");
            close(below.height_above, above.height, "height");
            close(exp(-0.5 * width * width), above.height, "curve");
            close(width * (above.height_above - above.height), AREA, "area");
        }
        assert_eq!(LAYERS.last().map(|top| top.height_above), Some(1.0));
        // The lowest layer: R exp(-R^2/2) plus the tail sqrt(pi/2) erfc(R / sqrt 2).
        let tail = libm::sqrt(core::f64::consts::FRAC_PI_2) * libm::erfc(R * core::f64::consts::FRAC_1_SQRT_2);
        close(R * exp(-0.5 * R * R) + tail, AREA, "base");
    }
}
