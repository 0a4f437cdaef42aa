//! Local and global coordinates, compared with the definition of geodetic coordinates.

use afbc_comms::services::origin::{EarthOrigin, Global};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Semi-major axis \[m\] and squared eccentricity of WGS 84.
const AXIS_M: f64 = 6_378_137.0;
const ECCENTRICITY_2: f64 = 6.694_379_990_141_33e-3;

/// Returns a place in the earth-centred frame, by the definition of geodetic coordinates.
fn earth(place: &Global) -> nalgebra::Vector3<f64> {
    let (phi, lambda) = (place.latitude_deg.to_radians(), place.longitude_deg.to_radians());
    let normal = AXIS_M / (1.0 - ECCENTRICITY_2 * phi.sin().powi(2)).sqrt();
    let axis = (normal + place.altitude_m) * phi.cos();
    let equator = (normal * (1.0 - ECCENTRICITY_2) + place.altitude_m) * phi.sin();
    nalgebra::Vector3::new(axis * lambda.cos(), axis * lambda.sin(), equator)
}

fn places() -> impl Strategy<Value = Global> {
    (-80.0..80.0f64, -180.0..180.0f64, -100.0..4000.0f64).prop_map(|(latitude_deg, longitude_deg, altitude_m)| Global {
        latitude_deg,
        longitude_deg,
        altitude_m,
    })
}

proptest! {
    /// Distances up to 1 km agree with the true ones within 1 cm. The error is due to the rounding of `f32`, 2 mm, and
    /// the sagitta.
    #[test]
    fn distances_are_true(at in places(), x in -707.0..707.0f32, y in -707.0..707.0f32) {
        let origin = EarthOrigin::new(at).expect("possible");
        let place = origin.global(&Vector3::new(x, y, 0.0));
        let true_m = (earth(&place) - earth(&at)).norm();
        let local_m = f64::from(x).hypot(f64::from(y));
        // Local distances are along the tangent. The arc is lower by its sagitta.
        let sagitta_m = local_m * local_m / 2.0 / 6.37e6;
        prop_assert!((true_m.hypot(0.0) - local_m).abs() < 0.01 + sagitta_m * sagitta_m, "{true_m} {local_m}");
    }

    /// Distances are right across the antimeridian too.
    #[test]
    fn the_way_leads_across_the_antimeridian(
        east: bool, off_deg in 0.0..0.02f64, latitude_deg in -60.0..60.0f64, y in -5e3..5e3f32,
    ) {
        let longitude_deg = if east { 180.0 - off_deg } else { off_deg - 180.0 };
        let at = Global { latitude_deg, longitude_deg, altitude_m: 100.0 };
        let origin = EarthOrigin::new(at).expect("possible");
        let there = Vector3::new(0.0, y, 0.0);
        let mut place = origin.global(&there);
        place.longitude_deg -= 360.0 * (place.longitude_deg / 360.0).round();
        prop_assert!((origin.local(&place) - there).norm() < 2e-3, "{place:?}");
    }

    #[test]
    fn the_way_back_is_the_way(at in places(), x in -5e3..5e3f32, y in -5e3..5e3f32, z in -500.0..500.0f32) {
        let origin = EarthOrigin::new(at).expect("possible");
        let there = Vector3::new(x, y, z);
        let back = origin.local(&origin.global(&there));
        prop_assert!((back - there).norm() < 2e-3, "{there} {back}");
    }
}
