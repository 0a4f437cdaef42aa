//! Random intervals in which something fails.

use crate::noise::Noise;
use afbc_types::parameters;
use libm::exp;

parameters! {
    /// Intervals without measurements, as a two-state Markov chain (E. N. Gilbert 1960, *Capacity of a burst-noise
    /// channel*).
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct MeasurementDropouts {
        /// Rate at which dropouts begin while there is none.
        #[parameter(RATE, "Hz", 0.0..=1000.0)]
        pub rate_hz: f64 = 0.0,
        /// Mean length of a dropout.
        #[parameter(MEAN, "s", 0.0..=60.0)]
        pub mean_s: f64 = 0.02,
    }
}

/// Dropouts in simulation.
#[derive(Clone, Debug)]
pub(crate) struct SimulatedDropouts {
    random: Noise,
    /// Probabilities per step that a dropout begins, and that it ends.
    begins: f64,
    ends: f64,
    now: bool,
}

impl SimulatedDropouts {
    pub(crate) fn new(dropouts: &MeasurementDropouts, random: Noise, step_s: f64) -> Self {
        SimulatedDropouts {
            random,
            begins: 1.0 - exp(-dropouts.rate_hz * step_s),
            // With a mean length of zero a dropout ends with probability 1.
            ends: 1.0 - exp(-step_s / dropouts.mean_s),
            now: false,
        }
    }

    /// Returns true if the next step is in a dropout.
    #[inline]
    pub(crate) fn advance(&mut self) -> bool {
        let chance = self.random.uniform();
        self.now = if self.now { chance >= self.ends } else { chance < self.begins };
        self.now
    }
}
