//! The firmware without its hardware: the vehicle that it flies, and the services between [`afbc_link`] and the flight
//! core.
//!
//! There are two parts, because on the board the control tick interrupts everything else: [`Flight`] runs the control
//! tick every millisecond; [`Comms`] receives and sends messages in the remaining time. A host that runs both in turn
//! with the same bytes and times gets the same bytes as the processor.
//!
//! ```
//! use afbc_onboard::{Comms, Configuration, Flight};
//! use afbc_flight_core::Inbox;
//!
//! let mut flight = Flight::new(&Configuration::default())?;
//! let (mut comms, mut inbox) = (Comms::new(), Inbox::default());
//! inbox.post(&comms.receive(b"MAVLink, or noise"));
//! let report = flight.tick(1_000, &inbox.take());
//! assert_eq!(report.throttles, [0; 4]); // disarmed
//! comms.report(&report, 0, |_bytes| ());
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

mod answers;
mod comms;
mod configuration;
mod failsafes;
mod flight;
mod lockstep;

pub use answers::{ANSWERS_MAX, ANSWERS_PER_TICK, BUSY, FORGOTTEN_US};
pub use comms::{ADDRESS, CLOCK_FAILED, Comms, REPORT_MAX, TICK_OFF};
pub use configuration::Configuration;
pub use flight::{Flight, Report};
pub use lockstep::ReplyHead;
