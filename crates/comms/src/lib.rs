//! MAVLink services of the vehicle for ground stations and companion computers, between [`afbc_mavlink`]'s messages and
//! the control tick of [`afbc_onboard`].
//!
//! [`Comms`] receives and sends messages in the time that the control tick leaves. Given the same bytes and times, a
//! host that runs both in turn sends the same bytes as the processor on board.
//!
//! ```
//! use afbc_onboard::{Configuration, ControlInputs, Flight, Readings};
//! use afbc_comms::Comms;
//!
//! let mut flight = Flight::<4>::new(&Configuration::default())?;
//! let (mut inputs, mut taken) = (ControlInputs::EMPTY, ControlInputs::EMPTY);
//! let mut comms = Comms::new();
//! let mut decoder = comms.decoder();
//! inputs.merge(&comms.receive(&mut decoder, b"MAVLink, or noise"));
//! inputs.take_into(&mut taken);
//! let report = flight.tick(1_000, &mut taken, &Readings::NONE);
//! assert_eq!(report.throttles, [0; 8]); // disarmed
//! comms.report(&report, 0.0, |_bytes| ());
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

mod comms;
mod escs;
mod failsafes;
mod ignored;
mod link_share;
mod log_server;
pub mod parameters;
mod radio;
pub mod services;
mod setup;
mod transferring;
mod transfers;

pub use afbc_mavlink::Reboot;
pub use comms::{CLOCK_FAILED, Comms, REPORT_MAX, TICK_OFF};
pub use escs::{EscAction, EscReports, EscsHeard};
pub use log_server::LogServer;
pub use radio::{RADIO_FRAME_MAX, RadioControl};
pub use services::calibration::Calibrator;
pub use services::commands::{
    ANSWERS_MAX, ANSWERS_PER_TICK, BUSY, BUSY_FROM, CALIBRATES, FORGOTTEN_US, NO_ORIGIN, NOT_IN_CONTROL, NOT_KNOWN,
};
pub use services::status::AuxSensors;
pub use setup::Setup;
pub use transferring::TransferRequests;
pub use transfers::Transfers;
