//! Geographic position of a simulated flight.

use afbc_comms::services::origin::{EarthOrigin, Global};
use afbc_estimator::Origin;
use afbc_scenario::Scenario;

/// Returns the geographic origin of a scenario's GNSS fixes, or none for a scenario without a GNSS receiver.
#[must_use]
pub fn place(scenario: &Scenario) -> Option<Origin> {
    let Global { latitude_deg, longitude_deg, altitude_m } = EarthOrigin::SIMULATED;
    scenario.instruments.gnss.and_then(|_| Origin::new(latitude_deg, longitude_deg, altitude_m))
}
