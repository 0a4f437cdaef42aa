//! Flies scenarios with the firmware, or a replacement for it, as autopilot. The plant is on this side and the law on
//! the other. Only the bytes of [`afbc_mavlink`] connect them.
//!
//! # Reading order
//!
//! 1. [`Autopilot`]: receives and sends bytes once per millisecond.
//! 2. [`Host`]: the firmware's code in this process. Other implementations are an emulated processor, and a board on a
//!    serial port.
//! 3. [`Station`]: tracker, commander and ground station, at the other end of the link.
//! 4. [`fly()`]: arms, releases the vehicle, flies a scenario, disarms. [`MessagePeriods`] sets the message rates.
//!
//! The firmware has the paper's vehicle and its own law ([`firmware`]). A scenario with another vehicle or law is
//! refused ([`check`]). Plant, gusts, true parameters, start and trajectory come from the scenario.
#![forbid(unsafe_code)]

mod autopilot;
mod error;
mod extremes;
mod flight;
mod host;
mod host_black_box;
mod log;
mod log_file;
mod metadata;
mod pace;
mod place;
mod report;
mod served_files;
mod simulated_escs;
mod station;
mod stored_logs;
mod ulog_files;

#[cfg(test)]
mod tests;

pub use autopilot::Autopilot;
pub use error::Error;
pub use extremes::Extremes;
pub use flight::{LoopEnd, check, firmware, fly};
pub use host::{Host, HostTick};
pub use log::Log;
pub use log_file::LogFile;
pub use metadata::MetadataFiles;
pub use pace::MessagePeriods;
pub use place::place;
pub use report::tracking;
pub use served_files::{OpenFile, ServedFiles};
pub use simulated_escs::SimulatedEscs;
pub use station::{ReceivedMessages, Station};
pub use stored_logs::StoredLogs;
pub use ulog_files::UlogFiles;
