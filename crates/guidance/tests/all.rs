//! One binary for all tests: separate ones would take longer to build than to run.
#![allow(
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod bench;
mod endings;
mod failsafe;
mod fixture;
mod fuzz;
mod items;
mod limiter;
mod modes;
mod outages;
mod resets;
mod table;
mod tick;
