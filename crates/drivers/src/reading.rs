//! Readings of parts, in SI units and the part's own axes.

use crate::part::PartFault;
use core::ops::RangeInclusive;
use nalgebra::Vector3;

/// Reading of an IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialReading {
    /// Rates about the part's axes \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
    /// Specific force along the part's axes, upwards at rest \[m/s2\].
    pub specific_force_m_s2: Vector3<f32>,
    /// Temperature of the part \[degrees C\].
    pub temperature_c: f32,
}

/// Reading of a barometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureReading {
    /// Static pressure \[Pa\].
    pub pressure_pa: f32,
    /// Temperature of the part \[degrees C\].
    pub temperature_c: f32,
}

/// Reading of a magnetometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagneticReading {
    /// Field along the part's axes \[uT\].
    pub field_ut: Vector3<f32>,
}

/// Reading of a GNSS receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssReading {
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
    /// Number of satellites in use.
    pub satellites: u8,
}

/// Limits of u-blox receivers: altitude \[m\], speed along an axis \[m/s\].
const ALTITUDES_M: RangeInclusive<f64> = -10_000.0..=80_000.0;
const SPEED_MAX_M_S: f32 = 500.0;
/// Largest standard deviations of a usable fix: position \[m\], velocity \[m/s\].
const SIGMA_MAX_M: f32 = 200.0;
const SIGMA_MAX_M_S: f32 = 20.0;

impl GnssReading {
    /// Returns the fix if its numbers are possible for a receiver and it is accurate enough.
    pub(crate) fn possible(self) -> Option<Self> {
        let is_sigma = |sigma: f32, most: f32| sigma > 0.0 && sigma <= most;
        let is_possible = self.latitude_deg.abs() <= 90.0
            && self.longitude_deg.abs() <= 180.0
            && ALTITUDES_M.contains(&self.altitude_m)
            && self.velocity_ned_m_s.iter().all(|speed| speed.abs() <= SPEED_MAX_M_S)
            && is_sigma(self.horizontal_sigma_m, SIGMA_MAX_M)
            && is_sigma(self.vertical_sigma_m, SIGMA_MAX_M)
            && is_sigma(self.speed_sigma_m_s, SIGMA_MAX_M_S)
            && is_sigma(self.climb_sigma_m_s, SIGMA_MAX_M_S);
        is_possible.then_some(self)
    }
}

/// Decodes three big-endian 16-bit numbers.
pub(crate) fn big(bytes: [u8; 6]) -> Vector3<f32> {
    let [a, b, c, d, e, f] = bytes;
    Vector3::new(i16::from_be_bytes([a, b]), i16::from_be_bytes([c, d]), i16::from_be_bytes([e, f])).map(f32::from)
}

/// Decodes three little-endian 16-bit numbers.
pub(crate) fn little(bytes: [u8; 6]) -> Vector3<f32> {
    let [a, b, c, d, e, f] = bytes;
    Vector3::new(i16::from_le_bytes([a, b]), i16::from_le_bytes([c, d]), i16::from_le_bytes([e, f])).map(f32::from)
}

/// Returns a barometer's reading if it is within the ranges of its data sheet.
pub(crate) fn in_range(
    reading: PressureReading,
    [min_pa, max_pa]: [f32; 2],
    [min_c, max_c]: [f32; 2],
) -> Result<Option<PressureReading>, PartFault> {
    let PressureReading { pressure_pa, temperature_c } = reading;
    let is_right = (min_pa..=max_pa).contains(&pressure_pa) && (min_c..=max_c).contains(&temperature_c);
    if is_right { Ok(Some(reading)) } else { Err(PartFault::Range) }
}
