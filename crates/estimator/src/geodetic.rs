//! Conversion between geodetic coordinates and the local frame.

use nalgebra::Vector3;

/// Origin of the local frame: x north, y west, z up, as in [`afbc_types`] and on the MAVLink side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeodeticOrigin {
    latitude_deg: f64,
    longitude_deg: f64,
    altitude_m: f64,
    /// Metres per degree of latitude and of longitude.
    north_m_per_deg: f64,
    east_m_per_deg: f64,
}

impl GeodeticOrigin {
    /// Creates the origin for a latitude within +-89 degrees, a longitude within +-180 degrees (north and east
    /// positive) and an altitude within +-20 km; returns `None` otherwise.
    #[must_use]
    pub fn new(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Option<Self> {
        // WGS 84.
        const RADIUS_M: f64 = 6_378_137.0;
        const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;
        // Near a pole a degree of longitude has no length, and `global` would divide by zero.
        let valid = latitude_deg.abs() <= 89.0 && longitude_deg.abs() <= 180.0 && altitude_m.abs() <= 2e4;
        let (sine, cosine) = libm::sincos(latitude_deg.to_radians());
        let flattened = 1.0 - ECCENTRICITY_SQUARED * sine * sine;
        // Radii of curvature in the meridian and in the prime vertical.
        let vertical_m = RADIUS_M / libm::sqrt(flattened);
        let meridian_m = vertical_m * (1.0 - ECCENTRICITY_SQUARED) / flattened;
        let per_degree = core::f64::consts::PI / 180.0;
        valid.then_some(GeodeticOrigin {
            latitude_deg,
            longitude_deg,
            altitude_m,
            north_m_per_deg: (meridian_m + altitude_m) * per_degree,
            east_m_per_deg: (vertical_m + altitude_m) * cosine * per_degree,
        })
    }

    /// Returns the local coordinates of a place \[m\], on the plane that touches the ellipsoid. The curvature of the
    /// earth is neglected: at 4 km (and 50 degrees of latitude) 1 m of height and less than 1 m horizontally.
    ///
    /// ```
    /// let origin = afbc_estimator::GeodeticOrigin::new(47.0, 8.0, 500.0).unwrap();
    /// let place = origin.local(47.001, 8.001, 510.0);
    /// // 111.2 m north, 76.1 m east, 10 m up.
    /// assert!((place - nalgebra::Vector3::new(111.18, -76.06, 10.0)).norm() < 0.05);
    /// ```
    #[must_use]
    pub fn local(&self, latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Vector3<f32> {
        // The difference is taken in f64, because an f32 in degrees does not resolve centimetres.
        let mut east_deg = longitude_deg - self.longitude_deg;
        // The shorter way across the date line.
        if east_deg > 180.0 {
            east_deg -= 360.0;
        } else if east_deg < -180.0 {
            east_deg += 360.0;
        }
        Vector3::new(
            ((latitude_deg - self.latitude_deg) * self.north_m_per_deg) as f32,
            (-east_deg * self.east_m_per_deg) as f32,
            (altitude_m - self.altitude_m) as f32,
        )
    }

    /// Returns latitude and longitude \[degrees\] and altitude \[m\] of a position in the local frame. This is the
    /// inverse of [`local`](Self::local).
    ///
    /// ```
    /// let origin = afbc_estimator::GeodeticOrigin::new(47.0, 8.0, 500.0).unwrap();
    /// let [latitude, longitude, altitude] = origin.global(&origin.local(47.001, 8.001, 510.0));
    /// assert!((latitude - 47.001).abs() < 1e-9 && (longitude - 8.001).abs() < 1e-9);
    /// assert!((altitude - 510.0).abs() < 1e-5);
    /// ```
    #[must_use]
    pub fn global(&self, position_m: &Vector3<f32>) -> [f64; 3] {
        let [[x, y, z]] = position_m.cast::<f64>().data.0;
        let longitude_deg = self.longitude_deg - y / self.east_m_per_deg;
        let turns = if longitude_deg > 180.0 {
            1.0
        } else if longitude_deg < -180.0 {
            -1.0
        } else {
            0.0
        };
        [self.latitude_deg + x / self.north_m_per_deg, longitude_deg - 360.0 * turns, self.altitude_m + z]
    }
}
