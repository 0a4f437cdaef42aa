//! Evaluates a spherical harmonic model of the earth's magnetic potential at a place.
//!
//! V = a sum_n (a/r)^(n+1) sum_m (g cos m lambda + h sin m lambda) P_n^m(sin phi), B = -grad V, with Schmidt's
//! semi-normalised associated Legendre functions P_n^m, geocentric latitude phi and radius r, longitude lambda, and
//! a = 6371.2 km (*The US/UK World Magnetic Model for 2025-2030*, NOAA, sections 1.2 to 1.4).

/// Largest degree and order.
const DEGREES: usize = 12;
/// Number of coefficient pairs (g, h): one for each degree from 1 on, and each order up to the degree.
const PAIRS: usize = DEGREES * (DEGREES + 3) / 2;
/// The model's reference radius \[m\].
const RADIUS_M: f64 = 6_371_200.0;
/// Semi-major axis of the WGS 84 ellipsoid \[m\], and the square of its eccentricity.
const AXIS_M: f64 = 6_378_137.0;
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;

/// Coefficients of a model: g, h \[nT\] and their changes \[nT/year\] for each degree and order.
pub(super) struct WorldMagneticModel([[f64; 4]; PAIRS]);

impl WorldMagneticModel {
    /// Reads NOAA's table of coefficients; none if the table is incomplete.
    pub(super) fn read(table: &str) -> Option<Self> {
        let mut rows = [[0.0; 4]; PAIRS];
        let lines = table.lines().filter(|line| !line.starts_with('#'));
        let mut wanted = (1..=DEGREES).flat_map(|n| (0..=n).map(move |m| (n, m)));
        let mut lines = lines.into_iter();
        for row in &mut rows {
            let (line, (n, m)) = (lines.next()?, wanted.next()?);
            let mut words = line.split_whitespace();
            let mut index = || words.next()?.parse::<usize>().ok();
            if (index()?, index()?) != (n, m) {
                return None;
            }
            for number in row {
                *number = words.next()?.parse().ok()?;
            }
        }
        Some(WorldMagneticModel(rows))
    }

    /// Returns the field north, east and down \[nT\] at a place above the ellipsoid, `years` years after the epoch.
    pub(super) fn field(&self, latitude_rad: f64, longitude_rad: f64, height_m: f64, years: f64) -> [f64; 3] {
        // Convert the geodetic to the geocentric position.
        let (sin, cos) = latitude_rad.sin_cos();
        let across_m = AXIS_M / (1.0 - ECCENTRICITY_SQUARED * sin * sin).sqrt();
        let level_m = (across_m + height_m) * cos;
        let up_m = (across_m * (1.0 - ECCENTRICITY_SQUARED) + height_m) * sin;
        let radius_m = level_m.hypot(up_m);
        let (sin, cos) = (up_m / radius_m, level_m / radius_m);

        let [mut north, mut east, mut down] = [0.0; 3];
        let mut rows = self.0.iter();
        let (mut functions, mut before) = ([Legendre::default(); DEGREES + 1], [Legendre::default(); DEGREES + 1]);
        functions[0] = Legendre { value: 1.0, slope: 0.0 };
        for n in 1..=DEGREES {
            (functions, before) = (next_degree(n, &functions, &before, sin, cos), functions);
            let attenuation = (RADIUS_M / radius_m).powi(n as i32 + 2);
            for (m, (Legendre { value, slope }, [g, h, g_rate, h_rate])) in
                functions.iter().zip(rows.by_ref().take(n + 1)).enumerate()
            {
                let (sin_m, cos_m) = (m as f64 * longitude_rad).sin_cos();
                let (g, h) = (g + g_rate * years, h + h_rate * years);
                let along = attenuation * (g * cos_m + h * sin_m);
                north += along * slope;
                east += attenuation * m as f64 * (g * sin_m - h * cos_m) * value / cos;
                down -= (n as f64 + 1.0) * along * value;
            }
        }
        // Rotate from the geocentric to the ellipsoid's vertical.
        let (sin, cos) = (sin.atan2(cos) - latitude_rad).sin_cos();
        [north * cos - down * sin, east, north * sin + down * cos]
    }
}

/// P_n^m and its derivative with respect to the colatitude.
#[derive(Clone, Copy, Default)]
struct Legendre {
    value: f64,
    slope: f64,
}

/// Returns the Legendre functions of degree n, computed from those of degree n - 1 (`last`) and n - 2 (`before`).
fn next_degree(
    n: usize,
    last: &[Legendre; DEGREES + 1],
    before: &[Legendre; DEGREES + 1],
    sin: f64,
    cos: f64,
) -> [Legendre; DEGREES + 1] {
    let degree = n as f64;
    let mut next = [Legendre::default(); DEGREES + 1];
    for (m, ((function, last), before)) in next.iter_mut().zip(last).zip(before).enumerate().take(n) {
        let order_squared = (m * m) as f64;
        let (ahead, behind) = (2.0 * degree - 1.0, ((degree - 1.0).powi(2) - order_squared).sqrt());
        let scale = (degree * degree - order_squared).sqrt();
        function.value = (ahead * sin * last.value - behind * before.value) / scale;
        function.slope = (ahead * (sin * last.slope - cos * last.value) - behind * before.slope) / scale;
    }
    let diagonal = if n == 1 { 1.0 } else { (1.0 - 0.5 / degree).sqrt() };
    let corner = last.get(n - 1).copied().unwrap_or_default();
    if let Some(function) = next.get_mut(n) {
        function.value = diagonal * cos * corner.value;
        function.slope = diagonal * (cos * corner.slope + sin * corner.value);
    }
    next
}
