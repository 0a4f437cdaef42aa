//! Builds all tests as one program: separate programs would take longer to build than to run.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    deprecated,
    unreachable_pub,
    reason = "a test that cannot go on should say why"
)]

mod channels;
mod command_parameters;
mod commands;
mod decoder;
mod frames;
mod inertial;
mod messages;
mod poses;
mod pymavlink;
mod reference;
mod signed;
mod targets;
mod transfers;
mod wire;
