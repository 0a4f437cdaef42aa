//! Bring-up of a board with the propellers off: a fixed list of MAVLink requests and manual actions, each with a
//! verdict. The log of all answers can be sent to others. Nothing is armed and no parameter is changed.
//!
//! # Reading order
//!
//! 1. [`bring_up`]: runs the list. Its steps are in `steps` and `turns`.
//! 2. [`BringUpLog`]: the results, and their text.
//! 3. `conversation`: drives a [`Client`](crate::Client) over an [`ByteExchange`] in steps of one millisecond. It reads
//!    no clock, so the same vehicle in lockstep gives the same log.

mod conversation;
mod error;
mod latest;
mod log;
mod run;
mod statistics;
mod steps;
mod turns;

pub use conversation::ByteExchange;
pub use error::{Error, ExchangeError};
pub use log::{BringUpLog, BringUpStep, Verdict};
pub use run::{BringUpOptions, bring_up};
