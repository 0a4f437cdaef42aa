//! The firmware without its hardware: the vehicle that it flies, and the services between [`afbc_link`] and the flight
//! core.
//!
//! A vehicle with an inertial sensor flies on [its own estimate](EstimatorFrontEnd), another on the states that the
//! link brings.
//!
//! There are two parts, because on the board the control tick interrupts everything else: [`Flight`] runs the control
//! tick every millisecond; [`Comms`] receives and sends messages in the remaining time. A host that runs both in turn
//! with the same bytes and times gets the same bytes as the processor.
//!
//! ```
//! use afbc_onboard::{Comms, Configuration, ControlInputs, Flight, Readings};
//!
//! let mut flight = Flight::new(&Configuration::default())?;
//! let (mut comms, mut inputs, mut taken) = (Comms::new(), ControlInputs::EMPTY, ControlInputs::EMPTY);
//! inputs.merge(&comms.receive(b"MAVLink, or noise"));
//! inputs.take_into(&mut taken);
//! let report = flight.tick(1_000, &mut taken, &Readings::NONE);
//! assert_eq!(report.throttles, [0; 4]); // disarmed
//! comms.report(&report, 0.0, |_bytes| ());
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

mod comms;
mod configuration;
mod control_inputs;
mod dispatcher;
mod failsafes;
mod flight;
mod front_end;
mod guided;
mod lockstep;
pub mod parameters;
mod readings;
mod sensor_timeouts;
pub mod services;
mod setup;

pub use afbc_estimator::Settings as Estimation;
pub use afbc_flight_core::ArmingLimits;
pub use comms::{CLOCK_FAILED, Comms, REPORT_MAX, TICK_OFF};
pub use configuration::Configuration;
pub use control_inputs::ControlInputs;
pub use flight::{Flight, Prepared, Report};
pub use front_end::{EstimatorFrontEnd, pose, publish};
pub use guided::GuidanceResult;
pub use lockstep::ReplyHead;
pub use readings::{AIDS_MAX, Aged, Readings};
pub use services::commands::{ANSWERS_MAX, ANSWERS_PER_TICK, BUSY, FORGOTTEN_US, NO_ORIGIN, NOT_IN_CONTROL, NOT_KNOWN};
pub use services::status::AuxSensors;
pub use setup::{Link, Setup};
