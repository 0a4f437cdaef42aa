//! All integration tests in one binary: linking each one separately takes longer than running it.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a test that cannot go on should say why")]

mod ahead;
mod cascade;
mod common;
mod disturbance;
mod forward;
mod fuzzy;
mod guarded;
mod integral;
mod law;
mod limits;
mod make_up;
mod model;
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
