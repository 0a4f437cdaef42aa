//! A flight whose sensor behaviour is being drawn.

use afbc_plant::instruments::{FailureKind, GnssModel, ImuModel, InstrumentFault, MagnetometerModel, TrackerModel};
use afbc_plant::noise::Noise;
use afbc_plant::{Environment, Gust, GustKind};
use afbc_scenario::Scenario;
use afbc_sim::metrics::SETTLED_S;
use afbc_types::{Axis, OutOfRange};
use libm::{exp, log, sqrt};
use nalgebra::Vector3;

/// Faults begin within this first fraction of the part of the flight that counts.
const EARLY: f64 = 0.5;

/// A flight whose sensor behaviour is being drawn.
pub(super) struct RoughFlightBuilder<'a> {
    pub(super) noise: &'a mut Noise,
    pub(super) scenario: &'a mut Scenario,
    pub(super) gusts: Vec<Gust>,
}

impl RoughFlightBuilder<'_> {
    /// Draws a number uniformly between two bounds.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.noise.uniform()
    }

    /// Draws a number between two bounds, uniform in its logarithm.
    pub(super) fn logarithmic(&mut self, low: f64, high: f64) -> f64 {
        exp(self.between(log(low), log(high)))
    }

    /// Draws a whole number from 1 to `most`.
    pub(super) fn count(&mut self, most: u8) -> u8 {
        1 + (self.noise.uniform() * f64::from(most)) as u8
    }

    /// Draws 1 or -1.
    pub(super) fn sign(&mut self) -> f64 {
        if self.noise.uniform() < 0.5 { 1.0 } else { -1.0 }
    }

    /// Draws a unit vector along an axis.
    pub(super) fn axis(&mut self) -> Vector3<f64> {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let place = (self.noise.uniform() * 3.0) as usize;
        axes.get(place).copied().unwrap_or_default() * self.sign()
    }

    /// Draws a unit vector in any direction.
    pub(super) fn direction(&mut self) -> Vector3<f64> {
        let drawn = Vector3::from(self.noise.normals::<3>());
        drawn / sqrt(drawn.norm_squared()).max(1e-9)
    }

    /// Draws a duration: with equal chances, from `least_s` to ten times that, or infinite.
    pub(super) fn lasting(&mut self, least_s: f64) -> f64 {
        let lasts_s = self.logarithmic(least_s, 10.0 * least_s);
        if self.noise.uniform() < 0.5 { lasts_s } else { f64::INFINITY }
    }

    /// Draws the time at which something begins \[s\].
    fn onset(&mut self) -> f64 {
        SETTLED_S + EARLY * (self.scenario.duration_s - SETTLED_S).max(0.0) * self.noise.uniform()
    }

    /// Adds a fault that lasts `lasts_s` and takes `rise_s` to grow.
    pub(super) fn fault(&mut self, failure: FailureKind, lasts_s: f64, rise_s: f64) {
        let start_s = self.onset();
        self.scenario.instrument_faults.push(InstrumentFault { failure, start_s, end_s: start_s + lasts_s, rise_s });
    }

    /// Adds a short acceleration gust.
    pub(super) fn bump(&mut self) {
        let (start_s, lasts_s) = (self.onset(), self.between(0.001, 0.005));
        let axis = [Axis::X, Axis::Y, Axis::Z].get((self.noise.uniform() * 3.0) as usize).copied().unwrap_or(Axis::Z);
        let size = self.sign() * self.between(160.0, 400.0);
        self.gusts.push(Gust { axis, kind: GustKind::Acceleration, size, start_s, end_s: start_s + lasts_s });
    }

    pub(super) fn imu(&mut self, change: impl FnOnce(&mut ImuModel)) {
        self.scenario.instruments.imu.as_mut().map(change);
    }

    pub(super) fn tracker(&mut self, change: impl FnOnce(&mut TrackerModel)) {
        self.scenario.instruments.tracker.as_mut().map(change);
    }

    pub(super) fn gnss(&mut self, change: impl FnOnce(&mut GnssModel)) {
        self.scenario.instruments.gnss.as_mut().map(change);
    }

    pub(super) fn magnetometer(&mut self, change: impl FnOnce(&mut MagnetometerModel)) {
        self.scenario.instruments.magnetometer.as_mut().map(change);
    }

    /// Puts the gusts into the flight.
    ///
    /// # Errors
    /// The first gust out of range.
    pub(super) fn finish(self) -> Result<(), OutOfRange> {
        let environment = &self.scenario.environment;
        self.scenario.environment = Environment::new(*environment.nominal(), Vec::new(), self.gusts)?;
        Ok(())
    }
}
