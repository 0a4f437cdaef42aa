//! All tests in one program: separate programs would take longer to build than to run.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    deprecated,
    unreachable_pub,
    reason = "a test that cannot go on should say why"
)]

mod answers;
mod arming;
mod calibration;
mod command_parameters;
mod commands;
mod common;
mod dialect;
mod escs;
mod failsafes;
mod fence;
mod flood;
mod frames;
mod ftp;
mod inertial;
mod kept_clock;
mod line;
mod log_server;
mod log_stream;
mod log_transfer;
mod memory;
mod missions;
mod parameters;
mod places;
mod poses;
mod rate;
mod receiver;
mod reports;
mod requests;
mod settings;
mod signing;
mod telemetry;
mod transfers;
mod transmitter;
mod trip;
