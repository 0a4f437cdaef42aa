//! What the vehicle does for stations: each service a state machine without input and output of its own. Those that it
//! does not have answer every question with a refusal, so that nobody waits.

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
