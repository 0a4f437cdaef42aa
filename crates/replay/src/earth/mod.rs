//! The earth's magnetic field from NOAA's World Magnetic Model.

mod synthesis;

use synthesis::WorldMagneticModel;

/// First and last day that the models cover, counted from 1970: 2020 to 2029.
const DAYS: (f64, f64) = (18_262.0, 21_914.0);
/// First day of 2025, from which the second model is used.
const SECOND_DAY: f64 = 20_089.0;
const DAYS_A_YEAR: f64 = 365.25;
/// Range of heights that the models cover \[m\].
const HEIGHT_M: (f64, f64) = (-1_000.0, 850_000.0);
/// Beyond this latitude, about a kilometre from a pole, north is hardly defined \[degree\].
const LATITUDE_MAX_DEG: f64 = 89.99;

/// The earth's field at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EarthField {
    /// Declination, positive to the east \[rad\].
    pub(crate) declination_rad: f32,
    /// Horizontal and downward part of the field \[gauss\].
    pub(crate) horizontal_gauss: f32,
    pub(crate) down_gauss: f32,
}

/// Returns the field at a place and time; none where the model has no field, such as near the poles. A time outside the
/// models' years is moved to the nearest covered year: the declination changes by 0.2 degrees per year. Without a time,
/// the field is that of the beginning of 2020.
pub(crate) fn at(latitude_deg: f64, longitude_deg: f64, altitude_m: f64, utc_us: Option<f64>) -> Option<EarthField> {
    let days = utc_us.filter(|utc_us| utc_us.is_finite()).map_or(DAYS.0, |utc_us| utc_us / 86_400e6);
    let [north_nt, east_nt, down_nt] = at_day(latitude_deg, longitude_deg, altitude_m, days)?;
    let gauss = |nanotesla: f64| (nanotesla * 1e-5) as f32;
    Some(EarthField {
        declination_rad: east_nt.atan2(north_nt) as f32,
        horizontal_gauss: gauss(north_nt.hypot(east_nt)),
        down_gauss: gauss(down_nt),
    })
}

/// Returns the field north, east and down \[nT\] at a place, `days` days after the beginning of 1970.
fn at_day(latitude_deg: f64, longitude_deg: f64, altitude_m: f64, days: f64) -> Option<[f64; 3]> {
    // NaN makes this false.
    let is_covered = latitude_deg.abs() <= LATITUDE_MAX_DEG
        && longitude_deg.abs() <= 360.0
        && (HEIGHT_M.0..=HEIGHT_M.1).contains(&altitude_m);
    if !is_covered {
        return None;
    }
    let days = days.clamp(DAYS.0, DAYS.1);
    let (table, epoch) = if days < SECOND_DAY {
        (include_str!("wmm2020.cof"), DAYS.0)
    } else {
        (include_str!("wmm2025.cof"), SECOND_DAY)
    };
    let years = (days - epoch) / DAYS_A_YEAR;
    Some(WorldMagneticModel::read(table)?.field(
        latitude_deg.to_radians(),
        longitude_deg.to_radians(),
        altitude_m,
        years,
    ))
}

#[cfg(test)]
mod tests {
    use super::{at, at_day};

    /// In Zurich the field's strength is 0.48 gauss, and its horizontal part 0.21 gauss. The declination is within 0.3
    /// degrees of the values stored in two vehicles' logs: 3.32 in Zurich, 3.99 in Trondheim.
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
        // The times are before and after the models' years, or unknown.
        for utc_us in [Some(0.0), Some(1e18), Some(f64::NAN), None] {
            assert!(at(47.0, 8.0, 0.0, utc_us).is_some_and(|field| field.declination_rad > 0.03));
        }
        for [latitude, longitude, altitude] in
            [[f64::NAN, 8.0, 0.0], [90.0, 8.0, 0.0], [47.0, f64::INFINITY, 0.0], [47.0, 8.0, 1e7]]
        {
            assert_eq!(at(latitude, longitude, altitude, None), None);
        }
    }

    /// The field agrees within 2 nT with the crate `world_magnetic_model` 1.2025.0, which computes in `f32`. The places
    /// are on all sides of the earth, deep and high, and in both models' years.
    #[test]
    fn another_implementation_says_the_same() {
        for (latitude, longitude, height_m, days, expected_nt) in [
            (47.3977, 8.5456, 488.0, 19800.0, [21526.6, 1291.5, 43225.1]),
            (63.417, 10.408, 0.0, 18519.0, [13561.3, 950.0, 50229.2]),
            (-33.9, 151.2, 30.0, 20089.0, [24010.3, 5454.1, -51433.7]),
            (0.0, -78.5, 2850.0, 20089.0, [26505.9, -2211.6, 9884.8]),
            (40.0, -105.3, 1655.0, 21000.0, [20578.7, 2752.3, 46556.4]),
            (-77.8, 166.7, 20.0, 18262.0, [-8111.3, 6489.6, -61443.2]),
            (80.0, -0.1, 0.0, 21914.0, [6480.3, 434.6, 54945.9]),
            (35.7, 139.7, 100000.0, 20500.0, [28695.4, -3795.0, 33970.1]),
            (-54.8, -68.3, 50.0, 19999.0, [19158.2, 4010.2, -24343.3]),
            (1.3, 103.8, 15.0, 18900.0, [41005.5, 75.1, -9809.3]),
            (89.5, 30.0, 0.0, 20300.0, [1484.1, 1345.3, 56827.7]),
            (10.0, 180.0, -100.0, 20700.0, [31304.5, 5041.7, 8320.4]),
        ] {
            let field = at_day(latitude, longitude, height_m, days).unwrap_or_default();
            for (found, expected) in field.iter().zip(expected_nt) {
                let off: f64 = found - expected;
                assert!(off.abs() < 2.0, "{latitude} {longitude}, day {days}: {field:?}, not {expected_nt:?}");
            }
        }
    }
}
