//! What parts read, in SI units and the part's own axes.

use nalgebra::Vector3;

/// What an IMU reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialReading {
    /// Rates about the part's axes \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
    /// Specific force along them, upwards at rest \[m/s2\].
    pub specific_force_m_s2: Vector3<f32>,
    /// Temperature of the part \[degrees C\].
    pub temperature_c: f32,
}

/// What a barometer reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureReading {
    /// Static pressure \[Pa\].
    pub pressure_pa: f32,
    /// Temperature of the part \[degrees C\].
    pub temperature_c: f32,
}

/// What a magnetometer reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagneticReading {
    /// Field along the part's axes \[uT\].
    pub field_ut: Vector3<f32>,
}

/// Returns three numbers of two bytes each, the higher first.
pub(crate) fn big(bytes: [u8; 6]) -> Vector3<f32> {
    let [a, b, c, d, e, f] = bytes;
    Vector3::new(i16::from_be_bytes([a, b]), i16::from_be_bytes([c, d]), i16::from_be_bytes([e, f])).map(f32::from)
}

/// Returns three numbers of two bytes each, the lower first.
pub(crate) fn little(bytes: [u8; 6]) -> Vector3<f32> {
    let [a, b, c, d, e, f] = bytes;
    Vector3::new(i16::from_le_bytes([a, b]), i16::from_le_bytes([c, d]), i16::from_le_bytes([e, f])).map(f32::from)
}
