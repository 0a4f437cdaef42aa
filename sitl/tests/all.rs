//! All tests in one program, since building a program per test file would take longer than running the tests.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod again;
mod bring_up;
mod campaign;
mod cli;
mod cluster;
mod common;
mod compare;
mod exact;
mod folders;
mod interrupted;
mod machine;
mod outputs;
mod params;
mod plot;
mod replay;
mod serve;
mod shell;
mod suites;
mod tune;
mod ulog;
mod vehicles;
