//! Lists the log's topics and their rates, and fills them from a tick's data.

mod attitude;
mod battery;
mod demand;
mod escs;
mod estimator;
mod global;
mod law;
mod motors;
mod position;
mod rates;
mod sensors;
mod sticks;
mod vehicle;

pub(crate) use attitude::{VehicleAttitude, VehicleAttitudeSetpoint};
pub(crate) use battery::BatteryVoltage;
pub(crate) use demand::{ThrustDemand, TorqueDemand};
pub(crate) use escs::{ESC_REPORT, EscReport, EscStatusReport};
pub(crate) use estimator::{AidOffered, EstimatorFigures, EstimatorFlags, EstimatorVector};
pub(crate) use global::VehicleGlobalPosition;
pub(crate) use law::LawSignals;
pub(crate) use motors::{ActuatorMotors, ActuatorOutputs};
pub(crate) use position::{VehicleLocalPosition, VehicleLocalPositionSetpoint};
pub(crate) use rates::{VehicleAngularVelocity, VehicleRatesSetpoint};
pub(crate) use sensors::{
    Aiding, MeanSample, SensorCombined, VehicleAirData, VehicleGpsPosition, VehicleMagnetometer, VisualOdometry,
};
pub(crate) use sticks::ManualControl;
pub(crate) use vehicle::{ActuatorArmed, LandDetected, VehicleState};

use crate::ulog::layout::{LoggedField, Message};

/// A topic of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoggedTopic {
    /// Name of the topic: PX4's, unless it begins with `afbc_`.
    pub name: &'static str,
    /// Fields, in the order of their bytes.
    pub fields: &'static [LoggedField],
    /// Time between two messages; 0 if every tick's message is written \[us\].
    pub period_us: u32,
    /// Time between two messages in a small log; for measurements, separately for each kind \[us\].
    pub small_us: u32,
    /// True if a change of the main values is also written at once.
    pub on_change: bool,
}

/// A message whose topic is in [`TOPICS`].
pub(crate) trait Listed: Message {
    /// Number of the topic in the log, and its index in [`TOPICS`].
    const ID: u16;
}

/// Lists topics with their periods in a usual and in a small log \[us\], and whether changes are written at once.
macro_rules! topics {
    ($($type:ident: $period_us:literal, $small_us:literal $(, $on_change:ident)?;)*) => {
        #[repr(u16)]
        enum Place {
            $($type,)*
        }

        $(
            impl Listed for $type {
                const ID: u16 = Place::$type as u16;
            }
        )*

        /// All topics of a log, in the order of their numbers.
        pub const TOPICS: [LoggedTopic; [$($period_us),*].len()] = [$(LoggedTopic {
            name: $type::NAME,
            fields: $type::FIELDS,
            period_us: $period_us,
            small_us: $small_us,
            on_change: topics!(@ $($on_change)?),
        }),*];
    };
    (@) => { false };
    (@ on_change) => { true };
}

topics! {
    VehicleAttitude: 4_000, 10_000;
    VehicleAttitudeSetpoint: 4_000, 10_000;
    VehicleAngularVelocity: 4_000, 10_000;
    VehicleRatesSetpoint: 4_000, 10_000;
    VehicleLocalPosition: 20_000, 100_000;
    VehicleLocalPositionSetpoint: 20_000, 100_000;
    VehicleGlobalPosition: 100_000, 500_000;
    ThrustDemand: 4_000, 10_000;
    TorqueDemand: 4_000, 10_000;
    ActuatorMotors: 4_000, 10_000;
    ActuatorOutputs: 20_000, 100_000;
    SensorCombined: 0, 10_000;
    VehicleAirData: 0, 100_000;
    VehicleMagnetometer: 0, 100_000;
    VehicleGpsPosition: 0, 100_000;
    VisualOdometry: 0, 100_000;
    EstimatorVector: 100_000, 500_000;
    EstimatorFlags: 200_000, 1_000_000;
    BatteryVoltage: 500_000, 1_000_000;
    VehicleState: 500_000, 1_000_000, on_change;
    ActuatorArmed: 500_000, 1_000_000, on_change;
    LandDetected: 500_000, 1_000_000, on_change;
    ManualControl: 20_000, 100_000;
    LawSignals: 20_000, 100_000;
    EstimatorFigures: 100_000, 500_000, on_change;
    AidOffered: 0, 100_000;
    EscStatusReport: 20_000, 100_000;
}
