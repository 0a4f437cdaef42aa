//! The firmware without its hardware: the vehicle that it flies, and the services between [`afbc_link`] and the flight
//! core.
//!
//! A vehicle with an inertial sensor flies on [its own estimate](Navigation), another on the states that the link
//! brings.
//!
//! There are two parts, because on the board the control tick interrupts everything else: [`Flight`] runs the control
//! tick every millisecond; [`Comms`] receives and sends messages in the remaining time. A host that runs both in turn
//! with the same bytes and times gets the same bytes as the processor.
//!
//! ```
//! use afbc_onboard::{Comms, Configuration, Flight, Readings};
//! use afbc_flight_core::Inbox;
//!
//! let mut flight = Flight::new(&Configuration::default())?;
//! let (mut comms, mut inbox) = (Comms::new(), Inbox::default());
//! inbox.post(&comms.receive(b"MAVLink, or noise"));
//! let report = flight.tick(1_000, &mut inbox.take(), &Readings::NONE);
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
mod navigation;
mod readings;

pub use afbc_estimator::Settings as Estimation;
pub use answers::{ANSWERS_MAX, ANSWERS_PER_TICK, BUSY, FORGOTTEN_US};
pub use comms::{ADDRESS, CLOCK_FAILED, Comms, REPORT_MAX, TICK_OFF};
pub use configuration::Configuration;
pub use flight::{Flight, Report};
pub use lockstep::ReplyHead;
pub use navigation::{Navigation, pose, tell};
pub use readings::{AIDS_MAX, Aged, Readings};
