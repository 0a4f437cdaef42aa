//! One binary for all tests: separate ones would take longer to build than to run.
#![allow(missing_docs, reason = "a test that cannot go on should say why")]

mod command_filter;
mod controller;
mod drag;
mod math;
mod mixer;
mod smoothing;
