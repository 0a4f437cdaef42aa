//! Magnetometer in simulation: earth's field, iron, motor currents, noise, delay.

use super::markov::draw;
use super::schedule::{LatencyQueue, SampleClock};
use crate::noise::{Noise, NoiseStream};
use crate::truth::Truth;
use afbc_types::parameters;
use alloc::vec::Vec;
use core::f64::consts::FRAC_PI_2;
use libm::{cos, rint, sin};
use nalgebra::{Matrix3, Vector3};

parameters! {
    /// Properties of a magnetometer, and the field around it. Magnetic north is along earth x, but for the declination.
    /// The default is perfect and immediate, in a field as in central Europe.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct MagnetometerModel {
        /// Measurements per second.
        #[parameter(RATE, "Hz", 0.1..=1000.0)]
        pub rate_hz: f64 = 50.0,
        /// Delay from a motion to the arrival of its measurement.
        #[parameter(DELAY, "s", 0.0..=1.0)]
        pub delay_s: f64 = 0.0,
        /// Strength of the earth's field.
        #[parameter(STRENGTH, "uT", 1.0..=100.0)]
        pub strength_ut: f64 = 49.0,
        /// Inclination of the earth's field, positive downward.
        #[parameter(INCLINATION, "rad", -FRAC_PI_2..=FRAC_PI_2)]
        pub inclination_rad: f64 = 1.15,
        /// Declination of the earth's field, positive from x toward -y, as from north toward east.
        #[parameter(DECLINATION, "rad", -7.0..=7.0)]
        pub declination_rad: f64 = 0.0,
        /// Standard deviation of white noise, per axis.
        #[parameter(NOISE, "uT", 0.0..=1000.0)]
        pub noise_ut: f64 = 0.0,
        /// Standard deviation of hard iron, a constant field in the body frame, per axis, drawn once per flight.
        #[parameter(HARD_IRON, "uT", 0.0..=1000.0)]
        pub hard_iron_ut: f64 = 0.0,
        /// Standard deviation of soft iron, for each element of the distortion matrix minus the identity, drawn once
        /// per flight.
        #[parameter(SOFT_IRON, "1", 0.0..=1.0)]
        pub soft_iron: f64 = 0.0,
        /// Field of the motors' currents when thrust equals weight, body frame; proportional to the thrust.
        #[parameter(MOTOR, "uT", -1000.0..=1000.0)]
        pub motor_ut: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0),
        /// Largest field that is measured, per axis; 0 for no limit.
        #[parameter(RANGE, "uT", 0.0..=100_000.0)]
        pub range_ut: f64 = 0.0,
        /// Resolution of the output; 0 for no rounding.
        #[parameter(LSB, "uT", 0.0..=100.0)]
        pub lsb_ut: f64 = 0.0,
    }
}

impl MagnetometerModel {
    /// Returns the earth's field, earth frame \[uT\].
    pub fn earth_field_ut(&self) -> Vector3<f64> {
        let MagnetometerModel { strength_ut, inclination_rad, declination_rad, .. } = *self;
        let level = strength_ut * cos(inclination_rad);
        Vector3::new(level * cos(declination_rad), -level * sin(declination_rad), -strength_ut * sin(inclination_rad))
    }
}

/// Measured magnetic field, body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetometerReading {
    /// Time of the measurement \[s\].
    pub true_at_s: f64,
    /// Field \[uT\].
    pub field_ut: Vector3<f64>,
}

/// Magnetometer in simulation.
#[derive(Clone, Debug)]
pub(super) struct SimulatedMagnetometer {
    magnetometer: MagnetometerModel,
    clock: SampleClock,
    random: Noise,
    earth_ut: Vector3<f64>,
    hard_ut: Vector3<f64>,
    soft: Matrix3<f64>,
    transit: LatencyQueue<MagnetometerReading>,
}

impl SimulatedMagnetometer {
    pub(super) fn new(magnetometer: &MagnetometerModel, seed: u64, step_s: f64) -> Self {
        let mut random = Noise::new(seed, NoiseStream::Magnetometer);
        SimulatedMagnetometer {
            magnetometer: *magnetometer,
            clock: SampleClock::new(magnetometer.rate_hz, step_s),
            earth_ut: magnetometer.earth_field_ut(),
            hard_ut: draw(&mut random) * magnetometer.hard_iron_ut,
            soft: Matrix3::identity() + Matrix3::from_fn(|_, _| random.normal()) * magnetometer.soft_iron,
            random,
            transit: LatencyQueue::new(),
        }
    }

    /// Returns the fields that arrive in this step. A new measurement passes `spoil` first.
    pub(super) fn measure(
        &mut self,
        truth: &Truth,
        spoil: impl FnOnce(MagnetometerReading) -> Option<MagnetometerReading>,
    ) -> Vec<MagnetometerReading> {
        if self.clock.ticks() {
            let fix = MagnetometerReading { true_at_s: truth.time_s, field_ut: self.field_ut(truth) };
            let arrives_s = truth.time_s + self.magnetometer.delay_s;
            spoil(fix).into_iter().for_each(|fix| self.transit.send(arrives_s, fix));
        }
        self.transit.arrived(truth.time_s)
    }

    fn field_ut(&mut self, truth: &Truth) -> Vector3<f64> {
        let MagnetometerModel { noise_ut, motor_ut, range_ut, lsb_ut, .. } = self.magnetometer;
        let range_ut = if range_ut > 0.0 { range_ut } else { f64::INFINITY };
        let outside = self.soft * truth.to_body(&self.earth_ut);
        let sensed = outside + self.hard_ut + motor_ut * truth.thrust_share + draw(&mut self.random) * noise_ut;
        sensed.map(|value| {
            let value = value.clamp(-range_ut, range_ut);
            if lsb_ut > 0.0 { rint(value / lsb_ut) * lsb_ut } else { value }
        })
    }
}
