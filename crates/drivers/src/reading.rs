//! What parts read, in SI units and the part's own axes.

use crate::part::PartFault;
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

/// What a GNSS receiver reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixReading {
    /// Latitude, north positive \[degrees\].
    pub latitude_deg: f64,
    /// Longitude, east positive \[degrees\].
    pub longitude_deg: f64,
    /// Altitude above mean sea level \[m\].
    pub altitude_m: f64,
    /// Velocity to the north, east and down \[m/s\].
    pub velocity_ned_m_s: Vector3<f32>,
    /// Standard deviation of the position to the north, and to the east \[m\].
    pub horizontal_sigma_m: f32,
    /// Standard deviation of the altitude \[m\].
    pub vertical_sigma_m: f32,
    /// Standard deviation of the velocity to the north, and to the east \[m/s\].
    pub speed_sigma_m_s: f32,
    /// Standard deviation of the velocity down \[m/s\].
    pub climb_sigma_m_s: f32,
    /// Satellites in use.
    pub satellites: u8,
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

/// Passes a barometer's reading that is within the ranges of its data sheet.
pub(crate) fn in_range(
    reading: PressureReading,
    [min_pa, max_pa]: [f32; 2],
    [min_c, max_c]: [f32; 2],
) -> Result<Option<PressureReading>, PartFault> {
    let PressureReading { pressure_pa, temperature_c } = reading;
    let is_right = (min_pa..=max_pa).contains(&pressure_pa) && (min_c..=max_c).contains(&temperature_c);
    if is_right { Ok(Some(reading)) } else { Err(PartFault::Range) }
}
