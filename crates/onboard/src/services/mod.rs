//! What the vehicle does for stations: each service a state machine without input and output of its own.

pub mod commands;
pub mod control;
pub mod health;
pub mod mission;
pub mod modes;
pub mod origin;
pub mod picture;
pub mod streams;
pub mod telemetry;
pub(crate) mod texts;
pub mod timesync;
