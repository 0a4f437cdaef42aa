//! Health of the IMU, and the low-pass filter of the body rates.

use crate::measurement::ImuSample;
use crate::settings::Settings;
use afbc_control::math::{abs_max, sqrt, tan};
use nalgebra::Vector3;

/// Time without a sample after which the IMU counts as missing \[us\].
pub const MISSING_US: u64 = 20_000;
/// Time for which clipping is reported after a clipped sample \[us\].
const CLIPPED_US: u32 = 200_000;
/// Weight of one sample in the mean squared change.
const SHARE: f32 = 0.01;

/// Health of the IMU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuHealth {
    /// There was no sample within the last 20 ms, or none yet.
    pub missing: bool,
    /// The samples have had the same numbers for too long.
    pub stuck: bool,
    /// A coordinate was at the end of its range within the last 200 ms.
    pub clipped: bool,
    /// Rates or specific force change more from sample to sample than a vehicle can.
    pub noisy: bool,
    /// Number of refused samples, up to `u32::MAX`: values not finite or implausible, or a time that repeats, goes back
    /// or lies in the future.
    pub refused: u32,
    /// Root mean square of the specific force's change from sample to sample \[m/s2\].
    pub vibration_m_s2: f32,
}

impl ImuHealth {
    /// Returns true if attitude and rates may use the IMU.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        !(self.missing || self.stuck)
    }
}

/// Sensors whose sample is at the end of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ClippedSensors {
    pub(crate) gyro: bool,
    pub(crate) accel: bool,
}

/// Monitor of the IMU samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ImuMonitor {
    last: Option<ImuSample>,
    /// Time of the last change of the numbers \[us\].
    same_us: u64,
    clipped_us: Option<u64>,
    /// Mean squared changes of rates and specific force.
    rates_change: f32,
    force_change: f32,
    refused: u32,
    /// Number of samples refused in a row.
    in_a_row: u32,
}

impl ImuMonitor {
    /// Returns the time of the last accepted sample \[us\].
    pub(crate) fn at_us(&self) -> Option<u64> {
        self.last.map(|last| last.at_us)
    }

    /// Forgets the last sample.
    pub(crate) fn forget(&mut self) {
        self.last = None;
    }

    pub(crate) fn refuse(&mut self) {
        self.refused = self.refused.saturating_add(1);
        self.in_a_row = self.in_a_row.saturating_add(1);
    }

    /// Returns true if so many samples in a row were refused that the sample clock must have jumped.
    pub(crate) fn is_lost(&self) -> bool {
        self.in_a_row >= 500
    }

    /// Returns true if the numbers have been the same for longer than `stuck_us`.
    #[inline]
    fn is_stuck(&self, stuck_us: u64) -> bool {
        self.last.as_ref().is_some_and(|last| last.at_us.saturating_sub(self.same_us) > stuck_us)
    }

    /// Returns true if the sample repeats those of a stuck sensor. Such a sample counts as missing.
    pub(crate) fn repeats(&self, sample: &ImuSample, stuck_us: u64) -> bool {
        let same = |last: &ImuSample| {
            last.rates_rad_s == sample.rates_rad_s && last.specific_force_m_s2 == sample.specific_force_m_s2
        };
        // The time is compared first, because comparing six numbers takes longer.
        self.is_stuck(stuck_us) && self.last.as_ref().is_some_and(same)
    }

    /// Accepts a sample that is neither refused nor a repetition of a stuck sensor. Returns what is clipped.
    pub(crate) fn take(&mut self, sample: &ImuSample, settings: &Settings) -> ClippedSensors {
        self.in_a_row = 0;
        if let Some(last) = &self.last {
            let rates = sample.rates_rad_s - last.rates_rad_s;
            let force = sample.specific_force_m_s2 - last.specific_force_m_s2;
            let (rates, force) = (rates.norm_squared(), force.norm_squared());
            if rates + force > 0.0 {
                self.same_us = sample.at_us;
            }
            self.rates_change += SHARE * (rates - self.rates_change);
            self.force_change += SHARE * (force - self.force_change);
        } else {
            self.same_us = sample.at_us;
        }
        let clipped = ClippedSensors {
            gyro: abs_max(&sample.rates_rad_s) >= 0.98 * settings.gyro_range_rad_s,
            accel: abs_max(&sample.specific_force_m_s2) >= 0.98 * settings.accel_range_m_s2,
        };
        if clipped.gyro || clipped.accel {
            self.clipped_us = Some(sample.at_us);
        }
        self.last = Some(*sample);
        clipped
    }

    #[inline]
    pub(crate) fn health(&self, now_us: u64, settings: &Settings, stuck_us: u64) -> ImuHealth {
        let at_us = self.at_us();
        let squared = |limit: f32| limit * limit;
        let since =
            |from_us: u64| at_us.map_or(0, |at_us| u32::try_from(at_us.saturating_sub(from_us)).unwrap_or(u32::MAX));
        ImuHealth {
            missing: at_us.is_none_or(|at_us| now_us.saturating_sub(at_us) > MISSING_US),
            stuck: self.is_stuck(stuck_us),
            clipped: self.clipped_us.is_some_and(|clipped_us| since(clipped_us) < CLIPPED_US),
            noisy: self.rates_change > squared(settings.gyro_noisy_rad_s)
                || self.force_change > squared(settings.accel_noisy_m_s2),
            refused: self.refused,
            vibration_m_s2: sqrt(self.force_change),
        }
    }
}

/// Second-order low-pass filter (Butterworth, bilinear transform) at one kilohertz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LowPassFilter2p {
    /// b0, a1, a2; b1 = 2 b0, b2 = b0. `None` for no filter.
    coefficients: Option<(f32, f32, f32)>,
}

/// Memory of a [`LowPassFilter2p`]: the two sums of the transposed direct form, and the output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LowPassFilter2pMemory {
    sums: Option<(Vector3<f32>, Vector3<f32>)>,
    pub(crate) output: Vector3<f32>,
}

impl LowPassFilter2p {
    pub(crate) fn new(cutoff_hz: f32) -> Self {
        let k = tan(core::f32::consts::PI * cutoff_hz * 1e-3);
        let norm = 1.0 / (1.0 + core::f32::consts::SQRT_2 * k + k * k);
        let a1 = 2.0 * (k * k - 1.0) * norm;
        let a2 = (1.0 - core::f32::consts::SQRT_2 * k + k * k) * norm;
        LowPassFilter2p { coefficients: (cutoff_hz > 0.0).then_some((k * k * norm, a1, a2)) }
    }

    /// Filters the next sample. The first one passes unchanged.
    #[inline]
    pub(crate) fn advance(&self, memory: &mut LowPassFilter2pMemory, input: &Vector3<f32>) {
        let Some((b0, a1, a2)) = self.coefficients else {
            memory.output = *input;
            return;
        };
        // Initial sums as after a long constant input; from zero, the output would have to rise first.
        let (first, second) = memory.sums.unwrap_or((input * (1.0 - b0), input * (b0 - a2)));
        let output = input * b0 + first;
        memory.sums = Some((input * (2.0 * b0) - output * a1 + second, input * b0 - output * a2));
        memory.output = output;
    }
}
