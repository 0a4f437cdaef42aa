//! All integration tests in one binary: linking each one separately takes longer than running it.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a test that cannot go on should say why")]

mod cascade;
mod common;
mod delay_compensation;
mod disturbance;
mod fuzzy;
mod guarded;
mod integral;
mod jump_filter;
mod law;
mod limits;
mod model;
mod moment_compensation;
mod moments;
mod monitor;
mod profile;
mod reference;
mod rotation;
mod safeguards;
mod slow_rotors;
mod standstill;
mod step;
mod tilt;
mod trip;
