//! All integration tests in one binary: linking each one separately takes longer than running it.
#![allow(
    clippy::float_cmp,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod actuators;
mod common;
mod conservation;
mod contact;
mod drag;
mod environment;
mod frame;
mod ideal;
mod imu;
mod instruments;
mod noise;
mod outdoor_instruments;
mod realism;
mod rising_faults;
mod sensor_fault;
mod sensors;
mod tracker;
mod truth;
mod wind;
