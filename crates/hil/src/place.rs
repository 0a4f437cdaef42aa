//! Geographic position of a simulated flight.

use afbc_comms::services::origin::{EarthOrigin, Global};
use afbc_estimator::GeodeticOrigin;
use afbc_scenario::Scenario;

/// Returns the geographic origin of a scenario's GNSS fixes, or none for a scenario without a GNSS receiver.
#[must_use]
pub fn place(scenario: &Scenario) -> Option<GeodeticOrigin> {
    let Global { latitude_deg, longitude_deg, altitude_m } = EarthOrigin::SIMULATED;
    scenario.instruments.gnss.and_then(|_| GeodeticOrigin::new(latitude_deg, longitude_deg, altitude_m))
}
