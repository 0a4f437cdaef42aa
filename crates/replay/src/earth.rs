//! The earth's magnetic field by NOAA's World Magnetic Model.

use world_magnetic_model::GeomagneticField;
use world_magnetic_model::time::{Date, Duration};
use world_magnetic_model::uom::si::angle::{degree, radian};
use world_magnetic_model::uom::si::f32::{Angle, Length};
use world_magnetic_model::uom::si::length::meter;
use world_magnetic_model::uom::si::magnetic_flux_density::gauss;

/// The years that the model covers, as days since 1970: 2020 to 2029.
const DAYS: (i64, i64) = (18_262, 21_914);

/// The earth's field at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Field {
    /// Direction of its horizontal part, positive to the east \[rad\].
    pub(crate) declination_rad: f32,
    /// Its horizontal part and its part downwards \[gauss\].
    pub(crate) horizontal_gauss: f32,
    pub(crate) down_gauss: f32,
}

/// Returns the field at a place and time; none where the model has none, near the poles. A time beyond the model's
/// counts as its end: the declination changes by 0.2 degrees in a year.
pub(crate) fn at(latitude_deg: f64, longitude_deg: f64, altitude_m: f64, utc_us: Option<f64>) -> Option<Field> {
    let days = utc_us.filter(|utc_us| utc_us.is_finite()).map_or(DAYS.0, |utc_us| (utc_us / 86_400e6) as i64);
    let epoch = Date::from_ordinal_date(1970, 1).ok()?;
    let date = epoch.checked_add(Duration::days(days.clamp(DAYS.0, DAYS.1)))?;
    let field = GeomagneticField::new(
        Length::new::<meter>(altitude_m as f32),
        Angle::new::<degree>(latitude_deg as f32),
        Angle::new::<degree>(longitude_deg as f32),
        date,
    );
    let field = field.ok()?;
    let declination_rad = field.declination().get::<radian>();
    let (horizontal_gauss, down_gauss) = (field.h().get::<gauss>(), field.z().get::<gauss>());
    let found = Field { declination_rad, horizontal_gauss, down_gauss };
    (declination_rad + horizontal_gauss + down_gauss).is_finite().then_some(found)
}

#[cfg(test)]
mod tests {
    use super::at;

    /// The strength is 0.48 gauss in Zurich, of which 0.21 level. The declination is within 0.3 degrees of what two
    /// vehicles had stored in their logs: 3.32 in Zurich, 3.99 in Trondheim.
    #[test]
    fn is_that_of_the_place() {
        let zurich = at(47.3977, 8.5456, 488.0, Some(1.7107e15)).map(|field| field.declination_rad.to_degrees());
        assert!(zurich.is_some_and(|deg| (deg - 3.32).abs() < 0.3), "{zurich:?}");
        let trondheim = at(63.417, 10.408, 0.0, Some(1.6e15)).map(|field| field.declination_rad.to_degrees());
        assert!(trondheim.is_some_and(|deg| (deg - 3.99).abs() < 0.3), "{trondheim:?}");
        let level = at(47.3977, 8.5456, 488.0, Some(1.7107e15)).map(|field| (field.horizontal_gauss, field.down_gauss));
        assert!(
            level.is_some_and(|(level, down)| (level - 0.21).abs() < 0.01 && (down - 0.43).abs() < 0.01),
            "{level:?}"
        );
        // Before and after the model, and without a time.
        for utc_us in [Some(0.0), Some(1e18), Some(f64::NAN), None] {
            assert!(at(47.0, 8.0, 0.0, utc_us).is_some_and(|field| field.declination_rad > 0.03));
        }
        assert_eq!(at(f64::NAN, 8.0, 0.0, None), None);
    }
}
