//! The firmware's control tick without its hardware: law, estimator and guidance, the vehicle's configuration, and its
//! parameters at run time.
//!
//! A vehicle with an inertial sensor flies on [its own estimate](EstimatorFrontEnd); without one, on states from the
//! link. [`Flight`] runs the control tick every millisecond, on [`ControlInputs`] and [`Readings`]. On the board, the
//! tick interrupts everything else, including the services of `afbc_comms` that fill the inputs from messages. A host
//! that runs the same ticks with the same inputs and times gets the same bits as the processor.
//!
//! ```
//! use afbc_onboard::{Configuration, ControlInputs, Flight, Readings};
//!
//! let mut flight = Flight::<4>::new(&Configuration::default())?;
//! let report = flight.tick(1_000, &mut ControlInputs::EMPTY.clone(), &Readings::NONE);
//! assert_eq!(report.throttles, [0; 8]); // disarmed
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

mod any_flight;
mod configuration;
mod control_inputs;
mod esc_settings;
mod esc_telemetry;
mod flight;
mod front_end;
mod guided;
mod imu_lanes;
mod imu_selector;
pub mod indicator;
mod law;
mod link;
mod lockstep;
mod notch_follower;
pub mod parameters;
mod raw_readings;
mod readings;
mod rotor_monitor;
mod sensor_timeouts;
pub mod sensors;
mod tick_record;
pub mod vibration;

pub use afbc_estimator::Settings as Estimation;
pub use afbc_flight_core::ArmingLimits;
pub use any_flight::{AnyFlight, Prepare};
pub use configuration::Configuration;
pub use control_inputs::{ControlInputs, give};
pub use esc_settings::EscSettings;
pub use esc_telemetry::EscTelemetry;
pub use flight::{Flight, Prepared};
pub use front_end::{EstimatorFrontEnd, tracker_aid};
pub use imu_lanes::OtherSensors;
pub use imu_selector::{ImuPair, ImuSelector};
pub use law::FlightLaw;
pub use link::{BAUD, Link, LogMode};
pub use lockstep::ReplyHead;
pub use notch_follower::NotchFollower;
pub use raw_readings::RawReadings;
pub use readings::{AIDS_MAX, Aged, Readings};
pub use rotor_monitor::{RotorFailure, RotorMonitor, RotorNews};
pub use tick_record::{Report, TickBefore, TickDetails, TickInputs, TickRecord};
