//! All integration tests in one binary: linking each one separately takes longer than running it.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod accuracy;
mod anything;
mod common;
mod consistency;
mod faults;
mod lever;
mod rest;
mod soundness;
mod start;
mod unaided;
