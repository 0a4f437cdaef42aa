//! Topic of the geographic position.

use crate::ulog::layout::message;
use crate::ulog::moment::Moment;

message! {
    /// The place on the earth.
    "vehicle_global_position" VehicleGlobalPosition {
        timestamp_sample: u64 = "us",
        lat: f64 = "degrees",
        lon: f64 = "degrees",
        alt: f32 = "m",
        eph: f32 = "m",
        epv: f32 = "m",
        dead_reckoning: bool = "",
    }
}

impl VehicleGlobalPosition {
    /// Returns none unless position and origin are known.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let estimate = moment.details.estimate.filter(|estimate| estimate.validity.position)?;
        let place_m = estimate.state.position_m + moment.details.origin_m?;
        let [lat, lon, alt] = moment.beside.origin?.global(&place_m);
        let sigmas = estimate.sigmas.position_m;
        Some(VehicleGlobalPosition {
            timestamp: moment.now_us(),
            timestamp_sample: estimate.at_us,
            lat,
            lon,
            alt: alt as f32,
            eph: sigmas.x.max(sigmas.y),
            epv: sigmas.z,
            dead_reckoning: moment.report.health.observed,
        })
    }
}
