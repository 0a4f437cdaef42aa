//! Services of the vehicle for stations, each a state machine without input or output of its own. Services that the
//! vehicle does not offer answer each request with a refusal, so that no station waits.

pub mod calibration;
pub mod commands;
pub mod control;
pub mod escs;
pub mod events;
pub mod extended;
pub mod fence;
pub mod files;
pub mod ftp;
pub mod health;
pub mod imus;
mod items;
pub mod log_stream;
pub mod log_transfer;
pub mod logs;
pub mod mission;
pub mod modes;
pub mod origin;
pub mod sensors;
pub mod serial;
pub mod signing;
pub mod status;
pub mod storage;
pub mod streams;
pub mod telemetry;
pub(crate) mod texts;
pub mod timesync;
pub mod unanswered;
