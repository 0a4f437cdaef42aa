//! Simulates flights of scenarios in lockstep ([`flight`]) and evaluates their results ([`run`], [`metrics`]).
#![forbid(unsafe_code)]

pub mod columns;
pub mod flight;
pub mod flown;
mod log_rate;
pub mod metrics;
pub mod run;

pub use log_rate::LogRate;
