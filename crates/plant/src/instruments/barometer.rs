//! Barometer in simulation: noise, offset, drift, propeller wash, delay.

use super::markov::GaussMarkov;
use super::schedule::{LatencyQueue, SampleClock};
use crate::noise::{Noise, NoiseStream};
use crate::truth::Truth;
use afbc_types::parameters;
use alloc::vec::Vec;
use libm::{exp, rint};
use nalgebra::Vector3;

parameters! {
    /// Properties of a barometer, in metres of height: 1 Pa is 0.083 m near sea level. The default is perfect and
    /// immediate.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct BarometerModel {
        /// Measurements per second.
        #[parameter(RATE, "Hz", 0.1..=1000.0)]
        pub rate_hz: f64 = 50.0,
        /// Delay from a motion to the arrival of its measurement.
        #[parameter(DELAY, "s", 0.0..=1.0)]
        pub delay_s: f64 = 0.0,
        /// Standard deviation of white noise.
        #[parameter(NOISE, "m", 0.0..=100.0)]
        pub noise_m: f64 = 0.0,
        /// Standard deviation of a constant offset, drawn once per flight.
        #[parameter(OFFSET, "m", 0.0..=1000.0)]
        pub offset_m: f64 = 0.0,
        /// Standard deviation of the drift of sensor and weather, a first-order Gauss-Markov process.
        #[parameter(DRIFT, "m", 0.0..=1000.0)]
        pub drift_m: f64 = 0.0,
        /// Correlation time of the drift.
        #[parameter(DRIFT_TIME, "s", 0.001..=1e5)]
        pub drift_time_s: f64 = 600.0,
        /// Height error on the ground caused by the pressure under the rotors, when thrust equals weight. The measured
        /// height is too low, and the error grows with the thrust.
        #[parameter(WASH, "m", -100.0..=100.0)]
        pub wash_m: f64 = 0.0,
        /// Height at which the error by the rotors' pressure has fallen to 1/e.
        #[parameter(WASH_HEIGHT, "m", 0.01..=100.0)]
        pub wash_height_m: f64 = 0.3,
        /// Resolution of the output; 0 for no rounding.
        #[parameter(LSB, "m", 0.0..=10.0)]
        pub lsb_m: f64 = 0.0,
    }
}

/// Measured height above the origin of the earth frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarometerReading {
    /// Time of the measurement \[s\].
    pub true_at_s: f64,
    /// Height \[m\].
    pub height_m: f64,
}

/// Barometer in simulation.
#[derive(Clone, Debug)]
pub(super) struct SimulatedBarometer {
    barometer: BarometerModel,
    clock: SampleClock,
    random: Noise,
    offset_m: f64,
    drift: GaussMarkov,
    transit: LatencyQueue<BarometerReading>,
}

impl SimulatedBarometer {
    pub(super) fn new(barometer: &BarometerModel, seed: u64, step_s: f64) -> Self {
        let mut random = Noise::new(seed, NoiseStream::Barometer);
        // The drift advances once per measurement, and there is at most one measurement per step.
        let period_s = (1.0 / barometer.rate_hz).max(step_s);
        SimulatedBarometer {
            barometer: *barometer,
            clock: SampleClock::new(barometer.rate_hz, step_s),
            offset_m: random.normal() * barometer.offset_m,
            drift: GaussMarkov::new(Vector3::z() * barometer.drift_m, barometer.drift_time_s, period_s, &mut random),
            random,
            transit: LatencyQueue::new(),
        }
    }

    /// Returns the heights that arrive in this step. A new measurement passes `spoil` first.
    pub(super) fn measure(
        &mut self,
        truth: &Truth,
        spoil: impl FnOnce(BarometerReading) -> Option<BarometerReading>,
    ) -> Vec<BarometerReading> {
        if self.clock.ticks() {
            let fix = BarometerReading { true_at_s: truth.time_s, height_m: self.height_m(truth) };
            let arrives_s = truth.time_s + self.barometer.delay_s;
            spoil(fix).into_iter().for_each(|fix| self.transit.send(arrives_s, fix));
        }
        self.transit.arrived(truth.time_s)
    }

    fn height_m(&mut self, truth: &Truth) -> f64 {
        let BarometerModel { noise_m, wash_m, wash_height_m, lsb_m, .. } = self.barometer;
        self.drift.advance(&mut self.random);
        let height = truth.position_m.z;
        let wash = wash_m * truth.thrust_share * exp(-height.max(0.0) / wash_height_m);
        let sensed = height - wash + self.offset_m + self.drift.value.z + self.random.normal() * noise_m;
        if lsb_m > 0.0 { rint(sensed / lsb_m) * lsb_m } else { sensed }
    }
}
