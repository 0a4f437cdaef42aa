//! Inertial measurement unit in simulation: gyroscope and accelerometer.

use super::mounting::MountedSensor;
use super::triad::{SimulatedTriad, TriadErrors};
use super::vibration::SimulatedVibration;
use crate::noise::{Noise, NoiseStream};
use crate::truth::Truth;
use afbc_types::{Mounting, parameters};
use nalgebra::Vector3;

parameters! {
    /// Properties of a gyroscope. The default is perfect.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct GyroscopeModel {
        /// One-sided density of white noise, as in data sheets. Before the filter, the standard deviation of a sample
        /// is this density times the square root of half the sampling rate.
        #[parameter(NOISE, "rad/s/rtHz", 0.0..=0.1)]
        pub noise_rad_s_rthz: f64 = 0.0,
        /// Standard deviation of the bias instability, a first-order Gauss-Markov process.
        #[parameter(INSTAB, "rad/s", 0.0..=1.0)]
        pub instability_rad_s: f64 = 0.0,
        /// Correlation time of the bias instability.
        #[parameter(INSTAB_T, "s", 0.001..=1e5)]
        pub instability_time_s: f64 = 100.0,
        /// Random walk of the bias, given by its standard deviation after one second, which grows with the square root
        /// of time.
        #[parameter(WALK, "rad/s2/rtHz", 0.0..=0.1)]
        pub walk_rad_s2_rthz: f64 = 0.0,
        /// Standard deviation of a constant bias, drawn once per flight.
        #[parameter(BIAS, "rad/s", 0.0..=1.0)]
        pub bias_rad_s: f64 = 0.0,
        /// Standard deviation of each axis's scale factor error, drawn once per flight.
        #[parameter(SCALE, "1", 0.0..=0.1)]
        pub scale: f64 = 0.0,
        /// Standard deviation of each axis's angles to the other two, drawn once per flight.
        #[parameter(MISALIGN, "rad", 0.0..=0.1)]
        pub misalignment_rad: f64 = 0.0,
        /// Largest rate that is measured; 0 for no limit.
        #[parameter(RANGE, "rad/s", 0.0..=1000.0)]
        pub range_rad_s: f64 = 0.0,
        /// Resolution of the output; 0 for no rounding.
        #[parameter(LSB, "rad/s", 0.0..=1.0)]
        pub lsb_rad_s: f64 = 0.0,
        /// Cut-off of the second-order anti-alias filter; 0 for none.
        #[parameter(CUTOFF, "Hz", 0.0..=10_000.0)]
        pub cutoff_hz: f64 = 0.0,
        /// Amplitude of the vibration from one hovering rotor, at the rotor's frequency. The amplitude grows with the
        /// square of the speed.
        #[parameter(VIBR, "rad/s", 0.0..=10.0)]
        pub vibration_rad_s: f64 = 0.0,
    }
}

parameters! {
    /// Properties of an accelerometer. The default is perfect.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct AccelerometerModel {
        /// One-sided density of white noise, as in data sheets. Before the filter, the standard deviation of a sample
        /// is this density times the square root of half the sampling rate.
        #[parameter(NOISE, "m/s2/rtHz", 0.0..=1.0)]
        pub noise_m_s2_rthz: f64 = 0.0,
        /// Standard deviation of the bias instability, a first-order Gauss-Markov process.
        #[parameter(INSTAB, "m/s2", 0.0..=10.0)]
        pub instability_m_s2: f64 = 0.0,
        /// Correlation time of the bias instability.
        #[parameter(INSTAB_T, "s", 0.001..=1e5)]
        pub instability_time_s: f64 = 100.0,
        /// Random walk of the bias, given by its standard deviation after one second, which grows with the square root
        /// of time.
        #[parameter(WALK, "m/s3/rtHz", 0.0..=1.0)]
        pub walk_m_s3_rthz: f64 = 0.0,
        /// Standard deviation of a constant bias, drawn once per flight.
        #[parameter(BIAS, "m/s2", 0.0..=10.0)]
        pub bias_m_s2: f64 = 0.0,
        /// Standard deviation of each axis's scale factor error, drawn once per flight.
        #[parameter(SCALE, "1", 0.0..=0.1)]
        pub scale: f64 = 0.0,
        /// Standard deviation of each axis's angles to the other two, drawn once per flight.
        #[parameter(MISALIGN, "rad", 0.0..=0.1)]
        pub misalignment_rad: f64 = 0.0,
        /// Largest specific force that is measured; 0 for no limit.
        #[parameter(RANGE, "m/s2", 0.0..=10_000.0)]
        pub range_m_s2: f64 = 0.0,
        /// Resolution of the output; 0 for no rounding.
        #[parameter(LSB, "m/s2", 0.0..=1.0)]
        pub lsb_m_s2: f64 = 0.0,
        /// Cut-off of the second-order anti-alias filter; 0 for none.
        #[parameter(CUTOFF, "Hz", 0.0..=10_000.0)]
        pub cutoff_hz: f64 = 0.0,
        /// Amplitude of the vibration from one hovering rotor, at the rotor's frequency. The amplitude grows with the
        /// square of the speed.
        #[parameter(VIBR, "m/s2", 0.0..=1000.0)]
        pub vibration_m_s2: f64 = 0.0,
    }
}

parameters! {
    /// Properties of an inertial measurement unit, which is read in every step. The default is perfect.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct ImuModel {
        /// Gyroscope.
        #[group("gyro")]
        pub gyro: GyroscopeModel = GyroscopeModel::DEFAULT,
        /// Accelerometer.
        #[group("accel")]
        pub accel: AccelerometerModel = AccelerometerModel::DEFAULT,
        /// Amplitudes of the vibration at one, two and three times a rotor's frequency, relative to the first.
        #[parameter(HARMONICS, "1", 0.0..=10.0)]
        pub harmonics: Vector3<f64> = Vector3::new(1.0, 0.5, 0.25),
        /// Offset of the true sensor position from its mounting, body frame. Flight software only knows the mounting.
        #[parameter(LEVER, "m", -0.2..=0.2)]
        pub lever_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0),
        /// Position and orientation on the vehicle.
        pub mounting: Mounting<f64> = Mounting::DEFAULT,
    }
    together(imu) {
        imu.mounting.validate()
    }
}

/// Sample of the IMU in sensor axes ([`Mounting`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuReading {
    /// Time of the sample \[s\].
    pub at_s: f64,
    /// Angular rate \[rad/s\].
    pub rates_rad_s: Vector3<f64>,
    /// Specific force, +g upward at rest \[m/s2\].
    pub specific_force_m_s2: Vector3<f64>,
}

/// True biases of an IMU in sensor axes: sum of constant part, instability and random walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuBias {
    /// Bias of the gyroscope \[rad/s\].
    pub rates_rad_s: Vector3<f64>,
    /// Bias of the accelerometer \[m/s2\].
    pub specific_force_m_s2: Vector3<f64>,
}

impl GyroscopeModel {
    fn quality(&self) -> TriadErrors {
        TriadErrors {
            noise: self.noise_rad_s_rthz,
            instability: self.instability_rad_s,
            instability_s: self.instability_time_s,
            walk: self.walk_rad_s2_rthz,
            bias: self.bias_rad_s,
            scale: self.scale,
            misalignment: self.misalignment_rad,
            range: self.range_rad_s,
            lsb: self.lsb_rad_s,
            cutoff_hz: self.cutoff_hz,
        }
    }
}

impl AccelerometerModel {
    fn quality(&self) -> TriadErrors {
        TriadErrors {
            noise: self.noise_m_s2_rthz,
            instability: self.instability_m_s2,
            instability_s: self.instability_time_s,
            walk: self.walk_m_s3_rthz,
            bias: self.bias_m_s2,
            scale: self.scale,
            misalignment: self.misalignment_rad,
            range: self.range_m_s2,
            lsb: self.lsb_m_s2,
            cutoff_hz: self.cutoff_hz,
        }
    }
}

/// IMU in simulation.
#[derive(Clone, Debug)]
pub(super) struct SimulatedImu {
    mounted: MountedSensor,
    gyro: SimulatedTriad,
    accel: SimulatedTriad,
    vibration: SimulatedVibration,
    random: Noise,
}

impl SimulatedImu {
    pub(super) fn new(imu: &ImuModel, seed: u64, step_s: f64) -> Self {
        let mut random = Noise::new(seed, NoiseStream::Imu);
        let amplitudes = [imu.gyro.vibration_rad_s, imu.accel.vibration_m_s2];
        SimulatedImu {
            mounted: MountedSensor::new(&imu.mounting, &imu.lever_m),
            gyro: SimulatedTriad::new(&imu.gyro.quality(), &mut random, step_s),
            accel: SimulatedTriad::new(&imu.accel.quality(), &mut random, step_s),
            vibration: SimulatedVibration::new(amplitudes, imu.harmonics, seed, step_s),
            random,
        }
    }

    /// Returns the sample of this step.
    pub(super) fn sample(&mut self, truth: &Truth) -> ImuReading {
        let [rates, force] = self.mounted.feel(truth);
        let [shaken, pushed] = self.vibration.advance(truth, [&self.gyro.filter, &self.accel.filter]);
        ImuReading {
            at_s: truth.time_s,
            rates_rad_s: self.gyro.measure(&rates, &shaken, &mut self.random),
            specific_force_m_s2: self.accel.measure(&force, &pushed, &mut self.random),
        }
    }

    pub(super) fn bias(&self) -> ImuBias {
        ImuBias { rates_rad_s: self.gyro.bias(), specific_force_m_s2: self.accel.bias() }
    }
}
