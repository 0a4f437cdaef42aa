//! All tests in one program: a program for each would take longer to build than to run.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod instruments;
mod levers;
mod losses;
mod mounting;
mod observer;
mod start;
