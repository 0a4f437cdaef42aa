//! Where on the earth a simulated flight is.

use afbc_estimator::Origin;
use afbc_scenario::Scenario;
use afbc_station::services::origin::{EarthOrigin, Global};

/// Returns the place that fixes of a scenario's GNSS receiver are measured from; none without a receiver: indoors
/// nobody knows.
#[must_use]
pub fn place(scenario: &Scenario) -> Option<Origin> {
    let Global { latitude_deg, longitude_deg, altitude_m } = EarthOrigin::SIMULATED;
    scenario.instruments.gnss.and_then(|_| Origin::new(latitude_deg, longitude_deg, altitude_m))
}
