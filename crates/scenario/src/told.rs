//! Instrument properties that a vehicle's software is told; they may differ from the true ones.

use afbc_plant::InstrumentSuite;
use afbc_vehicles::Vehicle;

/// Source of the instrument properties that a vehicle's software is told.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub enum AssumedInstruments {
    /// The IMU properties in the vehicle's file. All others, and the IMU without such an entry, are as in the
    /// scenario's file before a campaign draws variations.
    #[default]
    Stated,
    /// The true properties, also after a campaign's draws.
    Drawn,
    /// Fixed properties, independent of the true ones.
    Suite(Box<InstrumentSuite>),
}

/// Returns the properties that these instruments state. The IMU's come from the vehicle's file, if it has any.
pub(crate) fn stated(instruments: &InstrumentSuite, vehicle: Option<&Vehicle>) -> InstrumentSuite {
    let part = vehicle.and_then(|vehicle| vehicle.imu_part);
    InstrumentSuite { imu: part.or(instruments.imu), ..*instruments }
}
