//! Converts the drivers' readings to measurements for the estimator.

use afbc_drivers::{GnssReading, MagneticReading, PressureReading};
use afbc_estimator::{GeodeticOrigin, Measurement};
use nalgebra::{Matrix3, Vector3};

/// Standard deviation of a barometer's height, from noise and wind pressure but without drift \[m\].
const HEIGHT_SIGMA_M: f32 = 0.3;
/// Standard deviation of a magnetometer's field near the motors' currents \[uT\].
const FIELD_SIGMA_UT: f32 = 1.0;

/// Returns the height in the standard atmosphere, h = T0/L (1 - (p/p0)^(R L/g)) (ICAO Doc 7488) \[m\]. Height
/// differences are off by 1 % for every 3 degrees by which the air is warmer or colder than standard.
#[must_use]
pub fn height(reading: &PressureReading) -> Measurement {
    let height_m = 44_330.77 * (1.0 - libm::powf(reading.pressure_pa / 101_325.0, 0.190_263_2));
    Measurement::Height { height_m, sigma_m: HEIGHT_SIGMA_M }
}

/// Returns the field in the body frame \[uT\]. `to_body` rotates the sensor's axes into the body frame.
#[must_use]
pub fn field(reading: &MagneticReading, to_body: &Matrix3<f32>) -> Measurement {
    Measurement::MagneticField { field: to_body * reading.field_ut, sigma: FIELD_SIGMA_UT }
}

/// Number of consecutive near fixes that are believed: a single fix may be on another continent.
const BELIEVED: u8 = 5;
/// Largest distance between consecutive near fixes \[m\].
const NEAR_M: f32 = 200.0;

/// Local frame of a receiver's fixes. Its origin is the first believed fix.
#[derive(Clone, Copy, Debug)]
pub struct FixFrame {
    /// Last fix, and number of consecutive near fixes. Once fixes are believed, the frame's origin.
    near: Option<(GeodeticOrigin, u8)>,
}

impl FixFrame {
    /// No fix yet.
    pub const NEW: Self = FixFrame { near: None };

    /// Returns the frame's origin, once fixes are believed.
    pub fn origin(&self) -> Option<GeodeticOrigin> {
        self.near.filter(|(_, count)| *count >= BELIEVED).map(|(origin, _)| origin)
    }

    /// Converts a fix to a measurement, with true for the first one. Returns none for impossible coordinates, and until
    /// five fixes in a row are each within 200 m of the previous one.
    pub fn measure(&mut self, fix: &GnssReading) -> Option<(Measurement, bool)> {
        let GnssReading { latitude_deg, longitude_deg, altitude_m, .. } = *fix;
        let here = GeodeticOrigin::new(latitude_deg, longitude_deg, altitude_m)?;
        let (origin, mut count) = self.near.unwrap_or((here, 0));
        let known = count >= BELIEVED;
        let mut position_m = origin.local(latitude_deg, longitude_deg, altitude_m);
        if !known {
            count = if position_m.norm() > NEAR_M { 1 } else { count + 1 };
            position_m = Vector3::zeros();
            self.near = Some((here, count));
            if count < BELIEVED {
                return None;
            }
        }
        let [north, east, down] = fix.velocity_ned_m_s.into();
        let measurement = Measurement::Gnss {
            position_m,
            // The local frame's axes are north, west and up.
            velocity_m_s: Vector3::new(north, -east, -down),
            horizontal_sigma_m: fix.horizontal_sigma_m,
            vertical_sigma_m: fix.vertical_sigma_m,
            speed_sigma_m_s: fix.speed_sigma_m_s,
            climb_sigma_m_s: fix.climb_sigma_m_s,
        };
        Some((measurement, !known))
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, clippy::panic, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;

    #[test]
    fn the_standard_atmosphere() {
        // Altitude and pressure from ICAO Doc 7488.
        for (height_m, pressure_pa) in [(-500.0, 107_478.0), (0.0, 101_325.0), (1000.0, 89_874.6), (5000.0, 54_019.9)] {
            let Measurement::Height { height_m: read_m, .. } =
                height(&PressureReading { pressure_pa, temperature_c: 15.0 })
            else {
                panic!("a height")
            };
            // Geopotential and geometric altitude differ by 0.08 % at 5 km.
            assert!((read_m - height_m).abs() < 0.5 + 1e-3 * f32::abs(height_m), "{read_m} for {height_m}");
        }
    }

    #[test]
    fn fixes_are_local_to_the_first() {
        let first = GnssReading {
            latitude_deg: 47.0,
            longitude_deg: 8.0,
            altitude_m: 500.0,
            velocity_ned_m_s: Vector3::new(1.0, 2.0, 3.0),
            horizontal_sigma_m: 1.5,
            vertical_sigma_m: 2.5,
            speed_sigma_m_s: 0.2,
            climb_sigma_m_s: 0.3,
            satellites: 9,
        };
        let mut frame = FixFrame::NEW;
        assert_eq!(frame.measure(&GnssReading { latitude_deg: 91.0, ..first }), None);
        // Fixes that are far away, before or among the others, are ignored.
        let wild = GnssReading { latitude_deg: -20.0, longitude_deg: 100.0, ..first };
        for fix in [wild, first, first, wild, first, first, first, first] {
            assert_eq!(frame.measure(&fix), None);
        }
        let (measurement, is_first) = frame.measure(&first).expect("possible");
        let velocity = Vector3::new(1.0, -2.0, -3.0);
        assert!(is_first);
        assert!(matches!(measurement, Measurement::Gnss { position_m, velocity_m_s, horizontal_sigma_m: 1.5, .. }
            if position_m == Vector3::zeros() && velocity_m_s == velocity));
        assert!(matches!(measurement, Measurement::Gnss { speed_sigma_m_s: 0.2, climb_sigma_m_s: 0.3, .. }));
        let (measurement, is_first) = frame
            .measure(&GnssReading { latitude_deg: 47.001, longitude_deg: 8.001, altitude_m: 510.0, ..first })
            .expect("near");
        assert!(!is_first);
        assert!(matches!(measurement, Measurement::Gnss { position_m, .. }
            if (position_m - Vector3::new(111.18, -76.06, 10.0)).norm() < 0.05));
    }
}
