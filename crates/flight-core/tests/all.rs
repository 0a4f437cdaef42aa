//! One binary for all tests: separate ones would take longer to build than to run.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod clock;
mod dshot_reply;
mod engage;
mod faults;
mod inbox;
mod motor;
mod numbering;
mod observer;
mod pulse;
mod rate;
mod rest;
mod safety;
mod supervisor;
mod tick;
