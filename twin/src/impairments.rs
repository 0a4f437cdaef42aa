//! What can be wrong with the parts of a board, whichever they are.

use rigless::edge::Condition;
use serde::{Deserialize, Serialize};

/// Of an inertial sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImuImpairment {
    /// It does not answer.
    pub silent: bool,
    pub rate: Condition<3>,
    pub force: Condition<3>,
}

/// Of a barometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BarometerImpairment {
    /// It does not answer.
    pub silent: bool,
    pub pressure: Condition<1>,
}

/// Of a compass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CompassImpairment {
    /// It does not answer.
    pub silent: bool,
    pub field: Condition<3>,
}

/// Of a GNSS receiver, and of its wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReceiverImpairment {
    /// It says nothing.
    pub silent: bool,
    /// Words in a million that arrive with noise, and with a framing error.
    pub noise_errors: u32,
    pub framing_errors: u32,
}

/// Of a board's. What a board does not have cannot be wrong with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Impairments {
    /// The first and the second.
    pub imus: [ImuImpairment; 2],
    pub barometer: BarometerImpairment,
    /// The one that is used.
    pub compass: CompassImpairment,
    pub receiver: ReceiverImpairment,
}
