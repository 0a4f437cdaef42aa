//! Tracker in simulation: a motion-capture system with noise, delay, outliers and dropouts.

use super::markov::draw;
use super::schedule::{LatencyQueue, SampleClock};
use crate::dropouts::{MeasurementDropouts, SimulatedDropouts};
use crate::noise::{Noise, NoiseStream};
use crate::truth::Truth;
use afbc_types::parameters;
use alloc::vec::Vec;
use libm::{cos, sin, sqrt};
use nalgebra::{Quaternion, Vector3};

parameters! {
    /// Properties of a tracker. The default is perfect and immediate.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct TrackerModel {
        /// Fixes per second.
        #[parameter(RATE, "Hz", 0.1..=1000.0)]
        pub rate_hz: f64 = 100.0,
        /// Mean delay from a motion to the arrival of its measurement.
        #[parameter(DELAY, "s", 0.0..=1.0)]
        pub delay_s: f64 = 0.0,
        /// Largest deviation of the delay, uniform; no fix arrives before its motion.
        #[parameter(JITTER, "s", 0.0..=1.0)]
        pub jitter_s: f64 = 0.0,
        /// Error of every time stamp; positive if stamps are late.
        #[parameter(STAMP, "s", -1.0..=1.0)]
        pub stamp_s: f64 = 0.0,
        /// Standard deviation of each time stamp.
        #[parameter(STAMP_NOISE, "s", 0.0..=0.1)]
        pub stamp_noise_s: f64 = 0.0,
        /// Standard deviation of the position's white noise, per coordinate.
        #[parameter(POS, "m", 0.0..=100.0)]
        pub position_m: f64 = 0.0,
        /// Standard deviation of the attitude's white noise, about each body axis.
        #[parameter(ATT, "rad", 0.0..=1.0)]
        pub attitude_rad: f64 = 0.0,
        /// Share of the fixes that are outliers.
        #[parameter(OUTLIER, "1", 0.0..=1.0)]
        pub outliers: f64 = 0.0,
        /// Standard deviation of an outlier's position, per coordinate.
        #[parameter(OUTLIER_POS, "m", 0.0..=100.0)]
        pub outlier_m: f64 = 1.0,
        /// Standard deviation of an outlier's attitude, about each body axis.
        #[parameter(OUTLIER_ATT, "rad", 0.0..=10.0)]
        pub outlier_rad: f64 = 0.5,
        /// Position of the earth frame's origin in the tracker's frame.
        #[parameter(FRAME, "m", -1000.0..=1000.0)]
        pub frame_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0),
        /// Yaw of the earth frame in the tracker's frame.
        #[parameter(FRAME_YAW, "rad", -7.0..=7.0)]
        pub frame_yaw_rad: f64 = 0.0,
        /// Intervals without fixes.
        #[group("loss")]
        pub loss: MeasurementDropouts = MeasurementDropouts::DEFAULT,
        /// Intervals in which the tracker repeats its last pose with new time stamps.
        #[group("freeze")]
        pub freeze: MeasurementDropouts = MeasurementDropouts::DEFAULT,
    }
}

/// Measured pose in the tracker's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerFix {
    /// Time of the measurement as stamped by the tracker \[s\].
    pub true_at_s: f64,
    /// Position \[m\].
    pub position_m: Vector3<f64>,
    /// Unit quaternion from the body to the tracker's frame.
    pub attitude: Quaternion<f64>,
}

/// Tracker in simulation.
#[derive(Clone, Debug)]
pub(super) struct SimulatedTracker {
    tracker: TrackerModel,
    clock: SampleClock,
    random: Noise,
    loss: SimulatedDropouts,
    freeze: SimulatedDropouts,
    /// Last pose that was not frozen.
    last: Option<TrackerFix>,
    transit: LatencyQueue<TrackerFix>,
}

impl SimulatedTracker {
    pub(super) fn new(tracker: &TrackerModel, seed: u64, step_s: f64) -> Self {
        SimulatedTracker {
            tracker: *tracker,
            clock: SampleClock::new(tracker.rate_hz, step_s),
            random: Noise::new(seed, NoiseStream::Tracker),
            loss: SimulatedDropouts::new(&tracker.loss, Noise::new(seed, NoiseStream::TrackerLoss), step_s),
            freeze: SimulatedDropouts::new(&tracker.freeze, Noise::new(seed, NoiseStream::TrackerFreeze), step_s),
            last: None,
            transit: LatencyQueue::new(),
        }
    }

    /// Returns the fixes that arrive in this step. A new fix passes `spoil` first.
    pub(super) fn measure(
        &mut self,
        truth: &Truth,
        spoil: impl FnOnce(TrackerFix) -> Option<TrackerFix>,
    ) -> Vec<TrackerFix> {
        let (lost, frozen) = (self.loss.advance(), self.freeze.advance());
        if self.clock.ticks() {
            let (fix, arrives_s) = self.take(truth);
            let held = self.last.filter(|_| frozen).unwrap_or(fix);
            self.last = Some(held);
            let sent = spoil(TrackerFix { true_at_s: fix.true_at_s, ..held }).filter(|_| !lost);
            sent.into_iter().for_each(|fix| self.transit.send(arrives_s, fix));
        }
        self.transit.arrived(truth.time_s)
    }

    /// Returns the pose of this step and its arrival time. Draws the same random numbers for any settings.
    fn take(&mut self, truth: &Truth) -> (TrackerFix, f64) {
        let TrackerModel { frame_m, frame_yaw_rad, .. } = self.tracker;
        let random = &mut self.random;
        let mut position = draw(random) * self.tracker.position_m;
        let mut turn = draw(random) * self.tracker.attitude_rad;
        let is_outlier = random.uniform() < self.tracker.outliers;
        let (far, turned) = (draw(random) * self.tracker.outlier_m, draw(random) * self.tracker.outlier_rad);
        if is_outlier {
            (position, turn) = (position + far, turn + turned);
        }
        let delay_s = self.tracker.delay_s + self.tracker.jitter_s * (2.0 * random.uniform() - 1.0);
        let stamp_s = self.tracker.stamp_s + self.tracker.stamp_noise_s * random.normal();
        let (c, s) = (cos(frame_yaw_rad), sin(frame_yaw_rad));
        let [[x, y, z]] = truth.position_m.data.0;
        let yaw = Quaternion::new(cos(0.5 * frame_yaw_rad), 0.0, 0.0, sin(0.5 * frame_yaw_rad));
        let fix = TrackerFix {
            true_at_s: truth.time_s + stamp_s,
            position_m: frame_m + Vector3::new(c * x - s * y, s * x + c * y, z) + position,
            attitude: yaw * truth.attitude * rotation(&turn),
        };
        (fix, truth.time_s + delay_s)
    }
}

/// Returns the unit quaternion of a rotation vector.
fn rotation(vector: &Vector3<f64>) -> Quaternion<f64> {
    let angle = sqrt(vector.norm_squared());
    // sin(a/2)/a, whose limit is 1/2.
    let per_angle = if angle > 1e-9 { sin(0.5 * angle) / angle } else { 0.5 };
    Quaternion::from_parts(cos(0.5 * angle), vector * per_angle)
}
