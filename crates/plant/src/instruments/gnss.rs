//! GNSS receiver in simulation: noise, slow error, delay, losses.

use super::markov::{GaussMarkov, draw};
use super::schedule::{LatencyQueue, SampleClock};
use crate::dropouts::{MeasurementDropouts, SimulatedDropouts};
use crate::noise::{Noise, NoiseStream};
use crate::truth::Truth;
use afbc_types::parameters;
use alloc::vec::Vec;
use libm::sqrt;
use nalgebra::Vector3;

parameters! {
    /// Properties of a GNSS receiver, which measures in the earth frame. The default is perfect and immediate.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct GnssModel {
        /// Fixes per second.
        #[parameter(RATE, "Hz", 0.1..=1000.0)]
        pub rate_hz: f64 = 10.0,
        /// Mean delay from a motion to the arrival of its measurement.
        #[parameter(DELAY, "s", 0.0..=1.0)]
        pub delay_s: f64 = 0.0,
        /// Largest deviation of the delay, uniform; no fix arrives before its motion.
        #[parameter(JITTER, "s", 0.0..=1.0)]
        pub jitter_s: f64 = 0.0,
        /// Error of every time stamp; positive if stamps are late.
        #[parameter(STAMP, "s", -1.0..=1.0)]
        pub stamp_s: f64 = 0.0,
        /// Standard deviation of the horizontal position's slow error, a first-order Gauss-Markov process, per
        /// coordinate.
        #[parameter(HORIZONTAL, "m", 0.0..=1000.0)]
        pub horizontal_m: f64 = 0.0,
        /// Standard deviation of the height's slow error, a first-order Gauss-Markov process.
        #[parameter(VERTICAL, "m", 0.0..=1000.0)]
        pub vertical_m: f64 = 0.0,
        /// Correlation time of the slow errors.
        #[parameter(TIME, "s", 0.001..=1e5)]
        pub correlation_time_s: f64 = 60.0,
        /// Standard deviation of the position's white noise, per coordinate.
        #[parameter(NOISE, "m", 0.0..=1000.0)]
        pub noise_m: f64 = 0.0,
        /// Standard deviation of the velocity's white noise, per coordinate.
        #[parameter(VEL, "m/s", 0.0..=100.0)]
        pub velocity_m_s: f64 = 0.0,
        /// Reported standard deviations divided by the true ones; below 1 the receiver is overconfident.
        #[parameter(REPORTED, "1", 0.01..=100.0)]
        pub reported: f64 = 1.0,
        /// Intervals without fixes.
        #[group("loss")]
        pub loss: MeasurementDropouts = MeasurementDropouts::DEFAULT,
    }
}

/// Position and velocity in the earth frame, with the accuracy that the receiver reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssFix {
    /// Time of the measurement as stamped by the receiver \[s\].
    pub true_at_s: f64,
    /// Position \[m\].
    pub position_m: Vector3<f64>,
    /// Velocity \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// Reported standard deviation of x and of y \[m\].
    pub horizontal_sigma_m: f64,
    /// Reported standard deviation of z \[m\].
    pub vertical_sigma_m: f64,
    /// Reported standard deviation of the velocity, per coordinate \[m/s\].
    pub velocity_sigma_m_s: f64,
}

/// GNSS receiver in simulation.
#[derive(Clone, Debug)]
pub(super) struct SimulatedGnssReceiver {
    gnss: GnssModel,
    clock: SampleClock,
    random: Noise,
    slow: GaussMarkov,
    loss: SimulatedDropouts,
    transit: LatencyQueue<GnssFix>,
}

impl SimulatedGnssReceiver {
    pub(super) fn new(gnss: &GnssModel, seed: u64, step_s: f64) -> Self {
        let mut random = Noise::new(seed, NoiseStream::Gnss);
        let slow = Vector3::new(gnss.horizontal_m, gnss.horizontal_m, gnss.vertical_m);
        // The slow error advances once per fix.
        let period_s = (1.0 / gnss.rate_hz).max(step_s);
        SimulatedGnssReceiver {
            gnss: *gnss,
            clock: SampleClock::new(gnss.rate_hz, step_s),
            slow: GaussMarkov::new(slow, gnss.correlation_time_s, period_s, &mut random),
            random,
            loss: SimulatedDropouts::new(&gnss.loss, Noise::new(seed, NoiseStream::GnssLoss), step_s),
            transit: LatencyQueue::new(),
        }
    }

    /// Returns the fixes that arrive in this step. A new fix passes `spoil` first.
    pub(super) fn measure(&mut self, truth: &Truth, spoil: impl FnOnce(GnssFix) -> Option<GnssFix>) -> Vec<GnssFix> {
        let lost = self.loss.advance();
        if self.clock.ticks() {
            // The fix is generated even if it is lost, so that a loss does not change the errors of other fixes.
            let (fix, arrives_s) = self.take(truth);
            spoil(fix).filter(|_| !lost).into_iter().for_each(|fix| self.transit.send(arrives_s, fix));
        }
        self.transit.arrived(truth.time_s)
    }

    /// Returns the fix of this step and its arrival time. Draws the same random numbers for any settings.
    fn take(&mut self, truth: &Truth) -> (GnssFix, f64) {
        let GnssModel { horizontal_m, vertical_m, noise_m, velocity_m_s, reported, .. } = self.gnss;
        self.slow.advance(&mut self.random);
        let sigma = |slow: f64| reported * sqrt(slow * slow + noise_m * noise_m);
        let fix = GnssFix {
            true_at_s: truth.time_s + self.gnss.stamp_s,
            position_m: truth.position_m + self.slow.value + draw(&mut self.random) * noise_m,
            velocity_m_s: truth.velocity_m_s + draw(&mut self.random) * velocity_m_s,
            horizontal_sigma_m: sigma(horizontal_m),
            vertical_sigma_m: sigma(vertical_m),
            velocity_sigma_m_s: reported * velocity_m_s,
        };
        let delay_s = self.gnss.delay_s + self.gnss.jitter_s * (2.0 * self.random.uniform() - 1.0);
        (fix, truth.time_s + delay_s)
    }
}
