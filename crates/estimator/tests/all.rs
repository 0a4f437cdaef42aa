//! All tests in one program: one each takes longer to build than to run.
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
