//! Detects from the IMU whether the vehicle stands still.
//!
//! Rates and specific force are compared with their means since the vehicle came to rest, in blocks of half a second.
//! The integral of the deviation (the turn and velocity it would mean), the integral of its square and each single
//! deviation must stay small. A vehicle that hovers in calm air or is driven straight on looks the same;
//! [`Memory::stands`](crate::memory::Memory::stands) decides whether rest counts.

use crate::measurement::ImuSample;
use crate::settings::Settings;
use afbc_control::math::{abs_max, max};
use nalgebra::Vector3;

/// Length of a block \[s\].
const BLOCK_S: f32 = 0.5;
/// Number of quiet blocks that means rest. The second block is compared with the mean of the first block.
const ENOUGH: u8 = 2;
/// Number of blocks in the mean; a longer memory would miss changes of bias and temperature.
const REMEMBERED: u8 = 8;
/// Limits for a single deviation and for a block's mean deviation, as multiples of the standard deviation allowed at
/// rest, as in the alignment.
const FAR: f32 = 6.0;
const SLOW: f32 = 0.25;

/// Rest detector of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SensorRestDetector {
    /// Mean since the vehicle came to rest; before that, the first sample.
    usual: Vector3<f32>,
    /// Integrals of the deviation and of its square over the current block.
    moved: Vector3<f32>,
    squares: Vector3<f32>,
}

impl SensorRestDetector {
    /// Starts with this mean.
    fn new(usual: Vector3<f32>) -> Self {
        SensorRestDetector { usual, ..SensorRestDetector::default() }
    }

    /// Takes a sample. Returns true if it shows motion, for a standard deviation of at most `limit` at rest.
    #[inline]
    fn advance(&mut self, value: &Vector3<f32>, dt_s: f32, limit: f32, compares: bool) -> bool {
        let deviation = value - self.usual;
        self.moved += deviation * dt_s;
        self.squares += deviation.component_mul(&deviation) * dt_s;
        let differs = abs_max(&self.moved) > SLOW * limit * BLOCK_S || abs_max(&self.squares) > limit * limit * BLOCK_S;
        abs_max(&deviation) > FAR * limit || compares && differs
    }

    /// Ends a block of length `time_s`, whose mean enters the long mean with the weight `share`. Returns true if the
    /// block's standard deviation exceeds `limit`.
    fn end(&mut self, time_s: f32, limit: f32, share: f32) -> bool {
        let mean = self.moved * (1.0 / time_s);
        let variance = self.squares * (1.0 / time_s) - mean.component_mul(&mean);
        *self = SensorRestDetector::new(self.usual + mean * share);
        max(max(variance.x, variance.y), variance.z) > limit * limit
    }
}

/// Memory of the rest detector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RestDetector {
    rates: SensorRestDetector,
    force: SensorRestDetector,
    /// Length of the current block so far \[s\].
    time_s: f32,
    /// Number of quiet blocks, up to [`REMEMBERED`].
    blocks: u8,
    /// True if the vehicle has been at rest since the alignment.
    pub(crate) unmoved: bool,
}

impl RestDetector {
    /// Continues from an alignment at rest, with its mean rates and specific force.
    pub(crate) fn aligned(rates: Vector3<f32>, force: Vector3<f32>) -> Self {
        let (rates, force) = (SensorRestDetector::new(rates), SensorRestDetector::new(force));
        RestDetector { rates, force, time_s: 0.0, blocks: ENOUGH, unmoved: true }
    }

    /// Returns true if the vehicle has been at rest for long enough.
    pub(crate) fn is_still(&self) -> bool {
        self.blocks >= ENOUGH
    }

    /// Takes a sample, `dt_s` after the last sample.
    #[inline]
    pub(crate) fn advance(&mut self, sample: &ImuSample, dt_s: f32, settings: &Settings) {
        let ImuSample { rates_rad_s, specific_force_m_s2, .. } = sample;
        let (rate, force) = (settings.still_rate_rad_s, settings.still_accel_m_s2);
        let compares = self.blocks > 0;
        self.time_s += dt_s;
        // Both sensors are evaluated first: `||` might skip the second call.
        let turns = self.rates.advance(rates_rad_s, dt_s, rate, compares);
        let mut moves = self.force.advance(specific_force_m_s2, dt_s, force, compares) || turns;
        if self.time_s >= BLOCK_S && !moves {
            let share = 1.0 / (f32::from(self.blocks) + 1.0);
            let spreads = self.rates.end(self.time_s, rate, share);
            moves = self.force.end(self.time_s, force, share) || spreads;
            self.blocks = REMEMBERED.min(self.blocks + 1);
            self.time_s = 0.0;
        }
        if moves {
            (self.rates, self.force) =
                (SensorRestDetector::new(*rates_rad_s), SensorRestDetector::new(*specific_force_m_s2));
            (self.time_s, self.blocks, self.unmoved) = (0.0, 0, false);
        }
    }
}
