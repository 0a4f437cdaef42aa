//! Sampling times and delays of measurements.

use alloc::vec::Vec;

/// Tolerance when comparing times, far below any step \[s\].
const TIME_SLACK_S: f64 = 1e-9;

/// Sampling clock of a sensor with any rate: the first step, then the first step after each period.
#[derive(Clone, Debug)]
pub(super) struct SampleClock {
    /// Samples per step.
    per_step: f64,
    steps: u64,
    taken: u64,
}

impl SampleClock {
    pub(super) fn new(rate_hz: f64, step_s: f64) -> Self {
        SampleClock { per_step: rate_hz * step_s, steps: 0, taken: 0 }
    }

    /// Returns true if the sensor samples in this step. Call it in every step.
    pub(super) fn ticks(&mut self) -> bool {
        // The time is computed from the count of steps, because a sum of periods would drift.
        let due = (self.steps as f64 * self.per_step + TIME_SLACK_S) as u64 + 1;
        self.steps += 1;
        let ticks = due > self.taken;
        self.taken = due;
        ticks
    }
}

/// Measurements under way, which arrive in the order of their arrival times.
#[derive(Clone, Debug)]
pub(super) struct LatencyQueue<T> {
    /// Measurements with their arrival times \[s\], sorted by arrival.
    waiting: Vec<(f64, T)>,
}

impl<T> LatencyQueue<T> {
    pub(super) fn new() -> Self {
        LatencyQueue { waiting: Vec::new() }
    }

    /// Sends a measurement that arrives at `arrives_s`.
    pub(super) fn send(&mut self, arrives_s: f64, fix: T) {
        // After those with the same arrival time, which were sent earlier.
        let place = self.waiting.partition_point(|(earlier_s, _)| *earlier_s <= arrives_s);
        self.waiting.insert(place, (arrives_s, fix));
    }

    /// Returns the measurements that have arrived by `now_s`.
    #[inline]
    pub(super) fn arrived(&mut self, now_s: f64) -> Vec<T> {
        let count = self.waiting.partition_point(|(arrives_s, _)| *arrives_s <= now_s + TIME_SLACK_S);
        // Avoids an allocation in most steps.
        if count == 0 { Vec::new() } else { self.waiting.drain(..count).map(|(_, fix)| fix).collect() }
    }
}
