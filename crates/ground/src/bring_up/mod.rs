//! First steps with a board, propellers off: a fixed list of questions over MAVLink and of things to do by hand, each
//! with a verdict, and a log of all answers that people can send back. Nothing is armed and no parameter is changed.
//!
//! # Reading order
//!
//! 1. [`bring_up`]: the list. Its steps are in `steps` and `turns`.
//! 2. [`BringUpLog`]: what it comes to, and its text.
//! 3. `conversation`: a [`Client`](crate::Client) at the end of an [`Exchange`], a millisecond at a time. It has no
//!    clock: in lockstep the same vehicle gives the same log.

mod conversation;
mod error;
mod heard;
mod log;
mod run;
mod statistics;
mod steps;
mod turns;

pub use conversation::Exchange;
pub use error::{Error, ExchangeError};
pub use log::{BringUpLog, BringUpStep, Verdict};
pub use run::{BringUpOptions, bring_up};
