//! Health of the inertial sensors, and the filter on the body rates.

use crate::measurement::ImuSample;
use crate::settings::Settings;
use afbc_control::math::{abs_max, sqrt, tan};
use nalgebra::Vector3;

/// Time without a sample after which the IMU is missing \[us\].
pub const MISSING_US: u64 = 20_000;
/// Time that clipping is reported after a clipped sample \[us\].
const CLIPPED_US: u32 = 200_000;
/// Share of the squared change that a sample replaces.
const SHARE: f32 = 0.01;

/// Health of the inertial sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuHealth {
    /// No sample for 20 ms, or none yet.
    pub missing: bool,
    /// The same numbers for too long.
    pub stuck: bool,
    /// A coordinate was at the end of its range within the last 200 ms.
    pub clipped: bool,
    /// Changes more from sample to sample than a vehicle can.
    pub noisy: bool,
    /// Samples refused, up to `u32::MAX`: not finite, absurd, or of a time that goes back, stands still or lies in the
    /// future.
    pub refused: u32,
    /// Change of the specific force from sample to sample, root mean square \[m/s2\].
    pub vibration_m_s2: f32,
}

impl ImuHealth {
    /// True if attitude and rates can be taken from it.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        !(self.missing || self.stuck)
    }
}

/// Which of the two sensors is at the end of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Clipped {
    pub(crate) gyro: bool,
    pub(crate) accel: bool,
}

/// Watches the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Monitor {
    last: Option<ImuSample>,
    /// Since when the numbers are the same \[us\].
    same_us: u64,
    clipped_us: Option<u64>,
    /// Mean squared changes of rates and specific force.
    rates_change: f32,
    force_change: f32,
    refused: u32,
    /// Refused one after the other.
    in_a_row: u32,
}

impl Monitor {
    /// Time of the last sample taken \[us\].
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

    /// True if so many were refused that the time itself must have changed.
    pub(crate) fn is_lost(&self) -> bool {
        self.in_a_row >= 500
    }

    /// True if the numbers have been the same for longer than `stuck_us`.
    #[inline]
    fn is_stuck(&self, stuck_us: u64) -> bool {
        self.last.as_ref().is_some_and(|last| last.at_us.saturating_sub(self.same_us) > stuck_us)
    }

    /// True if a sample only repeats those of a stuck sensor, and counts as missing.
    pub(crate) fn repeats(&self, sample: &ImuSample, stuck_us: u64) -> bool {
        let same = |last: &ImuSample| {
            last.rates_rad_s == sample.rates_rad_s && last.specific_force_m_s2 == sample.specific_force_m_s2
        };
        // The time first: six numbers take longer to compare.
        self.is_stuck(stuck_us) && self.last.as_ref().is_some_and(same)
    }

    /// Takes a sample that is not refused, nor repeats those of a stuck sensor. Returns what of it is clipped.
    pub(crate) fn take(&mut self, sample: &ImuSample, settings: &Settings) -> Clipped {
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
        let clipped = Clipped {
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

/// Low-pass filter of second order (Butterworth, bilinear transform) for one kilohertz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LowPass {
    /// b0, a1, a2; b1 = 2 b0, b2 = b0. None for no filter.
    coefficients: Option<(f32, f32, f32)>,
}

/// Memory of a [`LowPass`]: the transposed direct form's two sums, and the output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Smoothed {
    sums: Option<(Vector3<f32>, Vector3<f32>)>,
    pub(crate) output: Vector3<f32>,
}

impl LowPass {
    pub(crate) fn new(cutoff_hz: f32) -> Self {
        let k = tan(core::f32::consts::PI * cutoff_hz * 1e-3);
        let norm = 1.0 / (1.0 + core::f32::consts::SQRT_2 * k + k * k);
        let a1 = 2.0 * (k * k - 1.0) * norm;
        let a2 = (1.0 - core::f32::consts::SQRT_2 * k + k * k) * norm;
        LowPass { coefficients: (cutoff_hz > 0.0).then_some((k * k * norm, a1, a2)) }
    }

    /// Filters one more sample; the first one passes as it is.
    #[inline]
    pub(crate) fn advance(&self, memory: &mut Smoothed, input: &Vector3<f32>) {
        let Some((b0, a1, a2)) = self.coefficients else {
            memory.output = *input;
            return;
        };
        // Those of an input that has always been the same: starting from zero, the output would swing up to it.
        let (first, second) = memory.sums.unwrap_or((input * (1.0 - b0), input * (b0 - a2)));
        let output = input * b0 + first;
        memory.sums = Some((input * (2.0 * b0) - output * a1 + second, input * b0 - output * a2));
        memory.output = output;
    }
}
