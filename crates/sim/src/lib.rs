//! Simulation in lockstep: scenarios ([`scenario`]), contenders ([`contender`]), and flights with their results
//! ([`run`]).
#![forbid(unsafe_code)]

pub mod case;
pub mod columns;
pub mod contender;
pub mod flight;
pub mod flown;
pub mod in_the_loop;
mod laws;
pub mod metrics;
pub mod paper;
pub mod run;
pub mod scenario;
mod task;
pub mod trajectory;
