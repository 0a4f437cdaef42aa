//! World and pilots in lockstep: what is flown ([`scenario`]), by whom ([`contender`]), and how it went ([`run`]).
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
pub mod reader;
pub mod run;
pub mod scenario;
pub mod trajectory;
