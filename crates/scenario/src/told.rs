//! What a vehicle's software is told of its instruments, which is not what they do.

use afbc_plant::InstrumentSuite;
use afbc_vehicles::Vehicle;

/// What a vehicle's software is told of its instruments.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub enum Told {
    /// What the vehicle's file says of the inertial sensor, and else what the instruments of the scenario's file do,
    /// before a campaign draws.
    #[default]
    Stated,
    /// What the instruments do, drawn or not.
    Drawn,
    /// This, whatever they do.
    Suite(Box<InstrumentSuite>),
}

/// Returns what these instruments say of themselves; of the inertial sensor what the vehicle's file says, if it does.
pub(crate) fn stated(instruments: &InstrumentSuite, vehicle: Option<&Vehicle>) -> InstrumentSuite {
    let part = vehicle.and_then(|vehicle| vehicle.imu_part);
    InstrumentSuite { imu: part.or(instruments.imu), ..*instruments }
}
