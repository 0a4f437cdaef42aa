//! Detects rest of the vehicle, and averages the sensors during it.

use crate::RawSample;
use nalgebra::Vector3;

/// Largest difference between samples at rest, per axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestLimits {
    pub(crate) rates_rad_s: f32,
    pub(crate) specific_force_m_s2: f32,
}

impl RestLimits {
    /// Limits on the ground. Means over 20 ms of an MPU-6000, the noisiest sensor simulated here, differ by 0.005 rad/s
    /// and 0.15 m/s2 in thousands of samples.
    pub(crate) const STANDING: Self = RestLimits { rates_rad_s: 0.03, specific_force_m_s2: 0.5 };
    /// Limits when held by hand.
    pub(crate) const HELD: Self = RestLimits { rates_rad_s: 0.3, specific_force_m_s2: 1.5 };
}

/// Sums of the samples since the vehicle came to rest.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RestSamples {
    since_us: u64,
    now_us: u64,
    samples: f32,
    /// Smallest, largest and sum of the rates and of the specific force.
    rates: [Vector3<f32>; 3],
    force: [Vector3<f32>; 3],
}

impl RestSamples {
    /// Takes a sample. Returns false if the vehicle has moved; the rest then starts again with this sample.
    pub(crate) fn add(&mut self, sample: &RawSample, limits: &RestLimits) -> bool {
        let mut with = *self;
        with.now_us = sample.at_us;
        with.samples += 1.0;
        let rests = extend(&mut with.rates, &sample.rates_rad_s) <= limits.rates_rad_s
            && extend(&mut with.force, &sample.specific_force_m_s2) <= limits.specific_force_m_s2;
        if rests && self.samples > 0.0 {
            *self = with;
            return true;
        }
        // The first sample starts the rest and shows no motion.
        let moved = self.samples > 0.0;
        let (rates, force) = ([sample.rates_rad_s; 3], [sample.specific_force_m_s2; 3]);
        *self = RestSamples { since_us: sample.at_us, now_us: sample.at_us, samples: 1.0, rates, force };
        !moved
    }

    /// Returns the time for which the vehicle has rested \[us\].
    pub(crate) fn elapsed_us(&self) -> u64 {
        self.now_us.saturating_sub(self.since_us)
    }

    /// Returns the mean rates \[rad/s\].
    pub(crate) fn rates_rad_s(&self) -> Vector3<f32> {
        let [.., sum] = self.rates;
        sum / self.samples.max(1.0)
    }

    /// Returns the mean specific force \[m/s2\].
    pub(crate) fn specific_force_m_s2(&self) -> Vector3<f32> {
        let [.., sum] = self.force;
        sum / self.samples.max(1.0)
    }
}

/// Adds a value; returns the largest difference between values on one axis.
fn extend([least, most, sum]: &mut [Vector3<f32>; 3], value: &Vector3<f32>) -> f32 {
    *least = least.inf(value);
    *most = most.sup(value);
    *sum += value;
    (*most - *least).max()
}
