//! Simulation in lockstep: flights of scenarios ([`flight`]) and their results ([`run`], [`metrics`]).
#![forbid(unsafe_code)]

pub mod columns;
pub mod flight;
pub mod flown;
pub mod metrics;
pub mod run;
