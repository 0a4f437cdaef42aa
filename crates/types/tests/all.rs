//! One binary for all tests: separate ones would take longer to build than to run.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod attitude;
mod declared;
mod measured;
mod plausible;
mod trigonometry;
mod vehicle;
