//! All integration tests in one binary: linking each one separately takes longer than running it.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod answers;
mod attitude;
mod flights;
mod gains;
mod harness;
mod hostile;
mod learning;
mod mpc;
mod slowed;
