//! Faults of a board's parts, in terms that fit every board.

use rigless::edge::Condition;
use serde::{Deserialize, Serialize};

/// Faults of an inertial sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImuImpairment {
    /// The sensor does not answer.
    pub silent: bool,
    pub rate: Condition<3>,
    pub force: Condition<3>,
}

/// Faults of a barometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BarometerImpairment {
    /// The sensor does not answer.
    pub silent: bool,
    pub pressure: Condition<1>,
}

/// Faults of a compass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CompassImpairment {
    /// The sensor does not answer.
    pub silent: bool,
    pub field: Condition<3>,
}

/// Faults of a GNSS receiver and its wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReceiverImpairment {
    /// The receiver sends nothing.
    pub silent: bool,
    /// Words per million that arrive with noise, and with a framing error.
    pub noise_errors: u32,
    pub framing_errors: u32,
}

/// Faults of all parts. Those of parts that a board lacks have no effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Impairments {
    /// First and second inertial sensor.
    pub imus: [ImuImpairment; 2],
    pub barometer: BarometerImpairment,
    /// Compass that the firmware uses.
    pub compass: CompassImpairment,
    pub receiver: ReceiverImpairment,
}
