//! Calibration of the vehicle's own sensors.

use crate::parameters;
use nalgebra::{Matrix3, Vector3};

parameters! {
    /// Corrections that flight software applies to its sensors. With the reading x, the offset o and the matrix S,
    ///
    /// ```text
    /// corrected = S (x - o)
    /// ```
    ///
    /// where S is the identity for the gyroscope, diagonal for the accelerometer and symmetric for the magnetometer.
    /// Gyroscope and accelerometer are corrected in the sensor's axes, before its [`Mounting`](crate::Mounting) turns
    /// them. The magnetometer is corrected in the body frame, since the disturbing iron is in the vehicle.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SensorCalibration {
        /// Offset of the gyroscope, sensor axes.
        #[parameter(GYRO0_OFF, "rad/s", -1.0..=1.0)]
        pub gyro_offset_rad_s: Vector3<f32> = Vector3::new(0.0, 0.0, 0.0),
        /// Offset of the accelerometer, sensor axes.
        #[parameter(ACC0_OFF, "m/s2", -5.0..=5.0)]
        pub accel_offset_m_s2: Vector3<f32> = Vector3::new(0.0, 0.0, 0.0),
        /// Scale factors of the accelerometer, applied after its offset is subtracted, sensor axes.
        #[parameter(ACC0_SCALE, "1", 0.8..=1.25)]
        pub accel_scale: Vector3<f32> = Vector3::new(1.0, 1.0, 1.0),
        /// Offset of the magnetometer, including hard iron, body frame.
        #[parameter(MAG0_OFF, "uT", -1000.0..=1000.0)]
        pub mag_offset_ut: Vector3<f32> = Vector3::new(0.0, 0.0, 0.0),
        /// Diagonal of the magnetometer's matrix, body frame.
        #[parameter(MAG0_SCALE, "1", 0.5..=2.0)]
        pub mag_scale: Vector3<f32> = Vector3::new(1.0, 1.0, 1.0),
        /// Elements xy, xz, yz of the magnetometer's matrix, body frame.
        #[parameter(MAG0_ODIAG, "1", -0.5..=0.5)]
        pub mag_off_diagonal: Vector3<f32> = Vector3::new(0.0, 0.0, 0.0),
    }
}

impl SensorCalibration {
    /// True if gyroscope and accelerometer need no correction.
    #[must_use]
    pub fn leaves_imu(&self) -> bool {
        let offsets = self.gyro_offset_rad_s.iter().chain(&self.accel_offset_m_s2);
        offsets.copied().all(|offset| offset == 0.0) && self.accel_scale.iter().all(|&scale| scale == 1.0)
    }

    /// Returns the accelerometer's corrected reading, sensor axes \[m/s2\].
    #[must_use]
    pub fn specific_force(&self, read_m_s2: &Vector3<f32>) -> Vector3<f32> {
        (read_m_s2 - self.accel_offset_m_s2).component_mul(&self.accel_scale)
    }

    /// Returns the magnetometer's corrected reading, body frame \[uT\].
    #[must_use]
    pub fn field(&self, read_ut: &Vector3<f32>) -> Vector3<f32> {
        let ([[sx, sy, sz]], [[xy, xz, yz]]) = (self.mag_scale.data.0, self.mag_off_diagonal.data.0);
        Matrix3::new(sx, xy, xz, xy, sy, yz, xz, yz, sz) * (read_ut - self.mag_offset_ut)
    }
}
