//! Conversion between local and global coordinates.
//!
//! The local frame is tangent to the WGS 84 ellipsoid at its origin: x is north, y is west. z is the difference in
//! altitude, so z follows the curvature of the earth. Both conversions are exact except for rounding.

use afbc_mavlink::GlobalPosition;
use nalgebra::{Vector2, Vector3};

/// Semi-major axis \[m\] and squared eccentricity of WGS 84.
const AXIS_M: f64 = 6_378_137.0;
const ECCENTRICITY_2: f64 = 6.694_379_990_141_33e-3;
const DEG: f64 = core::f64::consts::PI / 180.0;

/// A place on the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Global {
    /// Latitude \[deg\].
    pub latitude_deg: f64,
    /// Longitude \[deg\].
    pub longitude_deg: f64,
    /// Altitude above the sea \[m\].
    pub altitude_m: f64,
}

/// Origin of the local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EarthOrigin {
    at: Global,
    sine: f64,
    cosine: f64,
    /// Distances from the earth's axis and from the equatorial plane \[m\].
    from_axis_m: f64,
    from_equator_m: f64,
}

impl EarthOrigin {
    /// Default origin of simulators: PX4's usual place near Zurich.
    pub const SIMULATED: Global = Global { latitude_deg: 47.397_742, longitude_deg: 8.545_594, altitude_m: 488.0 };

    /// Creates an origin at a place. Returns none within about a kilometre of a pole, or if a coordinate is out of
    /// range.
    pub fn new(at: Global) -> Option<Self> {
        let Global { latitude_deg, longitude_deg, altitude_m } = at;
        // At a pole there is no east: `global` and `chart` divide by the cosine. NaN fails the test too.
        let possible = latitude_deg.abs() < 89.99 && longitude_deg.abs() <= 180.0 && altitude_m.abs() <= 1e5;
        let (sine, cosine) = libm::sincos(latitude_deg * DEG);
        let [from_axis_m, from_equator_m] = meridian(sine, cosine, altitude_m);
        possible.then_some(EarthOrigin { at, sine, cosine, from_axis_m, from_equator_m })
    }

    /// Returns the global position of the origin.
    pub fn at(&self) -> Global {
        self.at
    }

    /// Converts a global position to the local frame \[m\].
    pub fn local(&self, place: &Global) -> Vector3<f32> {
        let [north, east] = self.tangent(place);
        Vector3::new(north as f32, -east as f32, (place.altitude_m - self.at.altitude_m) as f32)
    }

    /// Converts a local position \[m\] to a global one.
    pub fn global(&self, position_m: &Vector3<f32>) -> Global {
        let [x, y, z] = [position_m.x, position_m.y, position_m.z].map(f64::from);
        let mut place = Global { altitude_m: self.at.altitude_m + z, ..self.at };
        // Newton's method with the metric of a sphere. Four steps reach 0.1 mm at a distance of 10 km.
        for _ in 0..4 {
            let [north, east] = self.tangent(&place);
            place.latitude_deg += (x - north) / (AXIS_M * DEG);
            place.longitude_deg += (-y - east) / (AXIS_M * DEG * self.cosine);
        }
        place
    }

    /// Returns a converter for places near the origin that needs no trigonometry.
    pub fn chart(&self) -> LocalChart {
        let Global { latitude_deg, longitude_deg, altitude_m } = self.at;
        let flattened = 1.0 - ECCENTRICITY_2 * self.sine * self.sine;
        let normal_m = AXIS_M / libm::sqrt(flattened);
        let meridian_m = normal_m * (1.0 - ECCENTRICITY_2) / flattened;
        let e7_rad = DEG * 1e-7;
        LocalChart {
            at_e7: Global { latitude_deg, longitude_deg, altitude_m }.e7(),
            north_m: ((meridian_m + altitude_m) * e7_rad) as f32,
            east_m: ((normal_m + altitude_m) * self.cosine * e7_rad) as f32,
            bend_1_m: (self.sine / (self.cosine * (normal_m + altitude_m))) as f32,
        }
    }

    /// Returns the distances to the north and to the east in the tangent plane, at the origin's altitude \[m\]. The far
    /// half of the earth has no place in the plane, so its distances are infinite.
    fn tangent(&self, place: &Global) -> [f64; 2] {
        let (sine, cosine) = libm::sincos(place.latitude_deg * DEG);
        // Altitudes are along the vertical of the place, so the horizontal position does not depend on them.
        let [from_axis_m, from_equator_m] = meridian(sine, cosine, self.at.altitude_m);
        let degrees = place.longitude_deg - self.at.longitude_deg;
        let turn = if degrees > 180.0 {
            degrees - 360.0
        } else if degrees < -180.0 {
            degrees + 360.0
        } else {
            degrees
        };
        let (turn_sine, turn_cosine) = libm::sincos(turn * DEG);
        if self.cosine * from_axis_m * turn_cosine + self.sine * from_equator_m < 0.0 {
            return [f64::INFINITY; 2];
        }
        let north = self.cosine * (from_equator_m - self.from_equator_m)
            - self.sine * (from_axis_m * turn_cosine - self.from_axis_m);
        [north, from_axis_m * turn_sine]
    }
}

/// Approximate conversion of places near an origin: accurate to 1 cm within 1 km, 0.2 m within 10 km, 1 m within 20 km.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalChart {
    at_e7: [i32; 2],
    /// Metres per 1e-7 degrees of latitude, and of longitude.
    north_m: f32,
    east_m: f32,
    /// Curvature of the circle of latitude \[1/m\].
    bend_1_m: f32,
}

impl LocalChart {
    /// Converts latitude and longitude \[1e-7 deg\] to the local frame \[m\].
    pub fn local(&self, [latitude_e7, longitude_e7]: [i32; 2]) -> Vector2<f32> {
        const TURN: i64 = 3_600_000_000;
        let [at_latitude, at_longitude] = self.at_e7;
        // A whole turn does not fit into 32 bits.
        let off = i64::from(longitude_e7) - i64::from(at_longitude);
        let off = off
            - if off > TURN / 2 {
                TURN
            } else if off < -TURN / 2 {
                -TURN
            } else {
                0
            };
        // The origin is rounded to 1e-7 degrees, about a centimetre.
        let north_m = (i64::from(latitude_e7) - i64::from(at_latitude)) as f32 * self.north_m;
        let east_m = off as f32 * self.east_m;
        let bent_m = east_m * self.bend_1_m;
        Vector2::new(north_m + 0.5 * bent_m * east_m, bent_m * north_m - east_m)
    }
}

/// Returns the distances of a place from the earth's axis and from the equatorial plane \[m\].
fn meridian(sine: f64, cosine: f64, altitude_m: f64) -> [f64; 2] {
    let normal_m = AXIS_M / libm::sqrt(1.0 - ECCENTRICITY_2 * sine * sine);
    [(normal_m + altitude_m) * cosine, (normal_m * (1.0 - ECCENTRICITY_2) + altitude_m) * sine]
}

impl Global {
    /// Returns latitude and longitude \[1e-7 deg\].
    pub fn e7(&self) -> [i32; 2] {
        [self.latitude_deg, self.longitude_deg].map(|degrees| libm::round(degrees * 1e7) as i32)
    }

    /// Returns the altitude \[mm\].
    pub fn altitude_mm(&self) -> i32 {
        libm::round(self.altitude_m * 1e3) as i32
    }

    /// Creates a place from coordinates in 1e-7 degrees.
    pub fn of_e7([latitude, longitude]: [i32; 2], altitude_m: f64) -> Self {
        let [latitude_deg, longitude_deg] = [latitude, longitude].map(|e7| f64::from(e7) * 1e-7);
        Global { latitude_deg, longitude_deg, altitude_m }
    }
}

/// Converts a station's place to the local frame \[m\]. Omitted coordinates become NaN; x and y are both NaN if one of
/// them is omitted. Heights may be relative to `home_m` or to `here_m`.
pub fn resolve(origin: &EarthOrigin, place: &GlobalPosition, home_m: f32, here_m: f32) -> Vector3<f32> {
    use afbc_mavlink::Datum;
    let height = f64::from(place.height.metres);
    let z = match place.height.above {
        Datum::Sea => (height - origin.at.altitude_m) as f32,
        Datum::Home => place.height.metres + home_m,
        Datum::Here => place.height.metres + here_m,
    };
    let given = [place.latitude_e7, place.longitude_e7];
    if given.contains(&GlobalPosition::AS_IT_IS) {
        return Vector3::new(f32::NAN, f32::NAN, z);
    }
    let local = origin.local(&Global::of_e7(given, origin.at.altitude_m));
    Vector3::new(local.x, local.y, z)
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;
    use afbc_mavlink::{Datum, Height};

    /// North is x and west is y.
    #[test]
    fn axes_point_north_and_west() {
        let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
        let north = Global { latitude_deg: EarthOrigin::SIMULATED.latitude_deg + 0.001, ..EarthOrigin::SIMULATED };
        let east = Global { longitude_deg: EarthOrigin::SIMULATED.longitude_deg + 0.001, ..EarthOrigin::SIMULATED };
        // Lengths of 0.001 degrees at 47.4 degrees: 111.178 m and 75.46 m (Bureau international de l'heure).
        let [n, e] = [north, east].map(|place| origin.local(&place));
        assert!((n.x - 111.18).abs() < 0.05 && n.y.abs() < 1e-2, "{n}");
        assert!((e.y + 75.46).abs() < 0.05 && e.x.abs() < 1e-2, "{e}");
    }

    #[test]
    fn the_date_line_is_crossed() {
        let origin = EarthOrigin::new(Global { latitude_deg: 0.0, longitude_deg: 179.9999, altitude_m: 0.0 });
        let east = Global { latitude_deg: 0.0, longitude_deg: -179.9999, altitude_m: 0.0 };
        let local = origin.expect("possible").local(&east);
        assert!((local.y + 22.26).abs() < 0.05, "{local}");
    }

    #[test]
    fn poles_and_nonsense_are_no_origins() {
        for (latitude_deg, longitude_deg) in [(90.0, 0.0), (f64::NAN, 0.0), (0.0, f64::INFINITY), (0.0, 181.0)] {
            assert_eq!(EarthOrigin::new(Global { latitude_deg, longitude_deg, altitude_m: 0.0 }), None);
        }
    }

    #[test]
    fn heights_count_from_what_they_say() {
        let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
        let z = |above| {
            let height = Height { metres: 490.0, above };
            let place = GlobalPosition { latitude_e7: GlobalPosition::AS_IT_IS, longitude_e7: 0, height };
            let resolved = resolve(&origin, &place, 5.0, 7.0);
            assert!(resolved.x.is_nan() && resolved.y.is_nan());
            resolved.z
        };
        assert_eq!([Datum::Sea, Datum::Home, Datum::Here].map(z), [2.0, 495.0, 497.0]);
    }

    #[test]
    fn origins_reach_up_to_their_limits() {
        let at = |latitude_deg, longitude_deg, altitude_m| Global { latitude_deg, longitude_deg, altitude_m };
        for good in [at(89.98, 180.0, 1e5), at(-89.98, -180.0, -1e5), at(0.0, 0.0, 0.0)] {
            assert_eq!(EarthOrigin::new(good).map(|origin| origin.at()), Some(good));
        }
        for bad in [
            at(89.99, 0.0, 0.0),
            at(-89.99, 0.0, 0.0),
            at(0.0, -180.1, 0.0),
            at(0.0, 0.0, 100_001.0),
            at(0.0, 0.0, -1e6),
        ] {
            assert_eq!(EarthOrigin::new(bad), None, "{bad:?}");
        }
    }

    /// Global coordinates are rounded to the units of MAVLink, and converted back.
    #[test]
    fn units_are_those_of_the_wire() {
        for (altitude_m, mm) in [(488.0, 488_000), (-12.3456, -12_346), (0.0006, 1), (0.0004, 0)] {
            assert_eq!(Global { altitude_m, ..EarthOrigin::SIMULATED }.altitude_mm(), mm);
        }
        let place = Global { latitude_deg: -12.345_678_94, longitude_deg: 123.456_789_06, altitude_m: 3.0 };
        assert_eq!(place.e7(), [-123_456_789, 1_234_567_891]);
        let back = Global::of_e7([-123_456_789, 1_234_567_891], 7.5);
        assert!((back.latitude_deg + 12.345_678_9).abs() < 1e-9 && (back.longitude_deg - 123.456_789_1).abs() < 1e-9);
        assert_eq!(back.altitude_m, 7.5);
    }

    /// Each place's local distance agrees with its great-circle distance, or is beyond any distance that is flown. No
    /// far place is taken for one near the origin.
    #[test]
    fn no_place_is_folded_onto_another() {
        for at in [[47.4, 8.5], [0.0, 0.0], [-33.9, 151.2], [89.9, 10.0], [-89.9, -170.0], [60.0, 179.9]] {
            let [latitude_deg, longitude_deg] = at;
            let origin = EarthOrigin::new(Global { latitude_deg, longitude_deg, altitude_m: 0.0 }).expect("possible");
            for (latitude, longitude) in
                (-90..=90).flat_map(|x| (-180..=180).map(move |y| (f64::from(x), f64::from(y))))
            {
                let local = origin.local(&Global { latitude_deg: latitude, longitude_deg: longitude, altitude_m: 0.0 });
                let turn = (longitude - longitude_deg) * DEG;
                let (a, b) = (latitude_deg * DEG, latitude * DEG);
                let cosine = a.sin() * b.sin() + a.cos() * b.cos() * turn.cos();
                let over_m = 6_371_000.0 * cosine.clamp(-1.0, 1.0).acos();
                let near = local.xy().norm() < 9e4;
                assert!(!near || over_m < 1e5, "{at:?}: {latitude} {longitude} at {local}, {over_m} m off");
                assert!(near || over_m > 8e4, "{at:?}: {latitude} {longitude} at {local}, {over_m} m off");
            }
        }
    }

    /// Heights above the origin are converted both ways. The date line is crossed to the west too.
    #[test]
    fn heights_and_the_date_line_have_two_sides() {
        let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
        let above = origin.global(&Vector3::new(0.0, 0.0, 12.5));
        assert_eq!(above.altitude_m, 500.5);
        assert_eq!(origin.local(&above).z, 12.5);
        let east = Global { latitude_deg: 0.0, longitude_deg: -179.9999, altitude_m: 0.0 };
        let west = Global { longitude_deg: 179.9999, ..east };
        let local = EarthOrigin::new(east).expect("possible").local(&west);
        assert!((local.y - 22.26).abs() < 0.05, "{local}");
    }

    /// A place with both coordinates is resolved with its height. A place with only one has no horizontal position.
    #[test]
    fn a_place_of_a_station_is_resolved() {
        let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
        let there = Vector3::new(300.0, -200.0, 0.0);
        let [latitude_e7, longitude_e7] = origin.global(&there).e7();
        for (above, z) in [(Datum::Sea, 12.0), (Datum::Home, 505.0), (Datum::Here, 507.0)] {
            let place = GlobalPosition { latitude_e7, longitude_e7, height: Height { metres: 500.0, above } };
            let local = resolve(&origin, &place, 5.0, 7.0);
            assert!((local - Vector3::new(300.0, -200.0, z)).norm() < 0.02, "{local}");
            let half = resolve(&origin, &GlobalPosition { longitude_e7: GlobalPosition::AS_IT_IS, ..place }, 5.0, 7.0);
            assert!(half.x.is_nan() && half.y.is_nan() && half.z == z);
        }
    }
}
