//! Presets of known parts, with the source of each figure.
//!
//! Data sheets state limits or typical deviations of offset, scale and cross-axis sensitivity; here each counts as
//! three standard deviations. They do not state bias instability and drift in flight, so those figures are estimated.
//! Effects of the vehicle, such as vibration, hard iron and propeller wash, are left out or marked as estimated.

use super::barometer::BarometerModel;
use super::gnss::GnssModel;
use super::imu::{AccelerometerModel, GyroscopeModel, ImuModel};
use super::magnetometer::MagnetometerModel;
use super::tracker::TrackerModel;
use core::f64::consts::PI;

/// One degree \[rad\].
const DEG: f64 = PI / 180.0;
/// Standard gravity \[m/s2\].
const G: f64 = 9.806_65;
/// Height per pressure near sea level \[m/Pa\].
const M_PA: f64 = 0.083;

/// Named part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset<T> {
    /// Name used in files.
    pub name: &'static str,
    /// Properties of the part.
    pub settings: T,
}

impl ImuModel {
    /// TDK InvenSense ICM-42688-P at 2000 deg/s and 16 g.
    ///
    /// Data sheet DS-000347, Table 1 (gyroscope: 0.0028 deg/s/rtHz, 16.4 LSB per deg/s, zero-rate 0.5 deg/s, scale 0.5
    /// %, cross-axis 1.25 %) and Table 2 (accelerometer: 70 ug/rtHz, 2048 LSB/g, zero-g 20 mg, scale 0.5 %, cross-axis
    /// 1 %). The anti-alias filter is set to 258 Hz, one of its options.
    pub const ICM_42688_P: Self = ImuModel {
        gyro: GyroscopeModel {
            noise_rad_s_rthz: 0.0028 * DEG,
            instability_rad_s: 0.002 * DEG,
            walk_rad_s2_rthz: 1e-5,
            bias_rad_s: 0.5 / 3.0 * DEG,
            scale: 0.005 / 3.0,
            misalignment_rad: 0.0125 / 3.0,
            range_rad_s: 2000.0 * DEG,
            lsb_rad_s: DEG / 16.4,
            cutoff_hz: 258.0,
            ..GyroscopeModel::DEFAULT
        },
        accel: AccelerometerModel {
            noise_m_s2_rthz: 70e-6 * G,
            instability_m_s2: 40e-6 * G,
            walk_m_s3_rthz: 1e-4,
            bias_m_s2: 0.02 / 3.0 * G,
            scale: 0.005 / 3.0,
            misalignment_rad: 0.01 / 3.0,
            range_m_s2: 16.0 * G,
            lsb_m_s2: G / 2048.0,
            cutoff_hz: 258.0,
            ..AccelerometerModel::DEFAULT
        },
        ..ImuModel::DEFAULT
    };

    /// Bosch Sensortec BMI270 at 2000 deg/s and 16 g.
    ///
    /// Data sheet BST-BMI270-DS000: gyroscope 0.007 deg/s/rtHz in performance mode, 16.384 LSB per deg/s, zero-rate 0.5
    /// deg/s; accelerometer 160 ug/rtHz, 2048 LSB/g, zero-g 20 mg. Estimated: scale 0.4 % after component retrimming,
    /// cross-axis 1 %, a filter of 250 Hz (up to 751 Hz can be set).
    pub const BMI270: Self = ImuModel {
        gyro: GyroscopeModel {
            noise_rad_s_rthz: 0.007 * DEG,
            instability_rad_s: 0.003 * DEG,
            walk_rad_s2_rthz: 2e-5,
            bias_rad_s: 0.5 / 3.0 * DEG,
            scale: 0.004 / 3.0,
            misalignment_rad: 0.01 / 3.0,
            range_rad_s: 2000.0 * DEG,
            lsb_rad_s: DEG / 16.384,
            cutoff_hz: 250.0,
            ..GyroscopeModel::DEFAULT
        },
        accel: AccelerometerModel {
            noise_m_s2_rthz: 160e-6 * G,
            instability_m_s2: 60e-6 * G,
            walk_m_s3_rthz: 2e-4,
            bias_m_s2: 0.02 / 3.0 * G,
            scale: 0.004 / 3.0,
            misalignment_rad: 0.01 / 3.0,
            range_m_s2: 16.0 * G,
            lsb_m_s2: G / 2048.0,
            cutoff_hz: 250.0,
            ..AccelerometerModel::DEFAULT
        },
        ..ImuModel::DEFAULT
    };

    /// InvenSense MPU-6000 at 2000 deg/s and 16 g.
    ///
    /// Product specification PS-MPU-6000A-00, revision 3.4, section 6.1 (gyroscope: 0.005 deg/s/rtHz, 16.4 LSB per
    /// deg/s, zero-rate 20 deg/s, scale 3 %, cross-axis 2 %, filter 256 Hz) and section 6.2 (accelerometer:
    /// 400 ug/rtHz, 2048 LSB/g, zero-g 50 mg in x and y, scale 3 %, cross-axis 2 %, filter 260 Hz).
    pub const MPU_6000: Self = ImuModel {
        gyro: GyroscopeModel {
            noise_rad_s_rthz: 0.005 * DEG,
            instability_rad_s: 0.005 * DEG,
            walk_rad_s2_rthz: 4e-5,
            bias_rad_s: 20.0 / 3.0 * DEG,
            scale: 0.03 / 3.0,
            misalignment_rad: 0.02 / 3.0,
            range_rad_s: 2000.0 * DEG,
            lsb_rad_s: DEG / 16.4,
            cutoff_hz: 256.0,
            ..GyroscopeModel::DEFAULT
        },
        accel: AccelerometerModel {
            noise_m_s2_rthz: 400e-6 * G,
            instability_m_s2: 100e-6 * G,
            walk_m_s3_rthz: 5e-4,
            bias_m_s2: 0.05 / 3.0 * G,
            scale: 0.03 / 3.0,
            misalignment_rad: 0.02 / 3.0,
            range_m_s2: 16.0 * G,
            lsb_m_s2: G / 2048.0,
            cutoff_hz: 260.0,
            ..AccelerometerModel::DEFAULT
        },
        ..ImuModel::DEFAULT
    };

    /// Every preset.
    pub const PRESETS: [Preset<Self>; 3] = [
        Preset { name: "icm-42688-p", settings: Self::ICM_42688_P },
        Preset { name: "bmi270", settings: Self::BMI270 },
        Preset { name: "mpu-6000", settings: Self::MPU_6000 },
    ];
}

impl TrackerModel {
    /// Motion-capture system of 100 Hz on a local network: 1 mm, 0.2 degrees, 10 +- 2 ms late. These are no product's
    /// figures, but those for which the estimator's accuracy is stated.
    pub const MOCAP_100: Self = TrackerModel {
        rate_hz: 100.0,
        delay_s: 0.01,
        jitter_s: 0.002,
        position_m: 0.001,
        attitude_rad: 0.2 * DEG,
        ..Self::DEFAULT
    };

    /// Every preset.
    pub const PRESETS: [Preset<Self>; 1] = [Preset { name: "mocap-100", settings: Self::MOCAP_100 }];
}

impl GnssModel {
    /// u-blox M10, four constellations at 10 Hz.
    ///
    /// Data sheet of the module MAX-M10S, UBX-20035208, table of performance: position 1.5 m CEP, which is 1.27 m per
    /// coordinate, and velocity 0.05 m/s. The position error is split into a slow part of 1.2 m and noise of 0.4 m.
    /// Estimated: that split, a height error 1.5 times larger, the correlation time, and a delay of 120 ms.
    pub const M10: Self = GnssModel {
        rate_hz: 10.0,
        delay_s: 0.12,
        jitter_s: 0.01,
        horizontal_m: 1.2,
        vertical_m: 1.8,
        correlation_time_s: 120.0,
        noise_m: 0.4,
        velocity_m_s: 0.05,
        ..Self::DEFAULT
    };

    /// Every preset.
    pub const PRESETS: [Preset<Self>; 1] = [Preset { name: "m10", settings: Self::M10 }];
}

impl BarometerModel {
    /// Infineon DPS310 at 50 Hz, eight times oversampled.
    ///
    /// Data sheet DPS310: precision 0.4 Pa at this oversampling, 14.8 ms per measurement, relative accuracy 6 Pa, used
    /// as the standard deviation of the drift. The wash is estimated.
    pub const DPS310: Self = BarometerModel {
        rate_hz: 50.0,
        delay_s: 0.015,
        noise_m: 0.4 * M_PA,
        drift_m: 6.0 * M_PA,
        wash_m: 0.5,
        ..Self::DEFAULT
    };

    /// Bosch Sensortec BMP388 at 50 Hz, eight times oversampled.
    ///
    /// Data sheet BST-BMP388-DS001: relative accuracy 8 Pa, used as the standard deviation of the drift. Estimated: a
    /// noise of 1.2 Pa without the part's filter, 20 ms per measurement, and the wash.
    pub const BMP388: Self = BarometerModel {
        rate_hz: 50.0,
        delay_s: 0.02,
        noise_m: 1.2 * M_PA,
        drift_m: 8.0 * M_PA,
        wash_m: 0.5,
        ..Self::DEFAULT
    };

    /// Every preset.
    pub const PRESETS: [Preset<Self>; 2] =
        [Preset { name: "dps310", settings: Self::DPS310 }, Preset { name: "bmp388", settings: Self::BMP388 }];
}

impl MagnetometerModel {
    /// iSentek IST8310 at 50 Hz.
    ///
    /// Data sheet IST8310: 0.3 uT/LSB, range 1600 uT in x and y. Estimated: noise, delay, and the hard iron, soft iron
    /// and motor field that remain after calibration.
    pub const IST8310: Self = MagnetometerModel {
        rate_hz: 50.0,
        delay_s: 0.01,
        noise_ut: 0.5,
        hard_iron_ut: 0.5,
        soft_iron: 0.01,
        motor_ut: nalgebra::Vector3::new(0.3, 0.3, 0.6),
        range_ut: 1600.0,
        lsb_ut: 0.3,
        ..Self::DEFAULT
    };

    /// QST QMC5883L at 50 Hz and 8 G.
    ///
    /// Data sheet QMC5883L: 3000 LSB/G, field resolution 2 mG, used as the noise. Estimated: delay, and the hard iron,
    /// soft iron and motor field that remain after calibration.
    pub const QMC5883L: Self =
        MagnetometerModel { noise_ut: 0.2, range_ut: 800.0, lsb_ut: 100.0 / 3000.0, ..Self::IST8310 };

    /// Every preset.
    pub const PRESETS: [Preset<Self>; 2] =
        [Preset { name: "ist8310", settings: Self::IST8310 }, Preset { name: "qmc5883l", settings: Self::QMC5883L }];
}
