//! Builds all tests as one program: separate programs would take longer to build than to run.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    unreachable_pub,
    reason = "a test that cannot go on should say why"
)]

mod ak8963;
mod alignment;
mod answers;
mod any_answer;
mod battery;
mod bmi270;
mod bmi270_model;
mod bmp280;
mod bmp3;
mod data_ready;
mod dps310;
mod esc_telemetry;
mod framing;
mod i2c_recovery;
mod icm426xx;
mod ist8310;
mod lis3mdl;
mod mpu;
mod ms5611;
mod nmea;
mod qmc5883l;
mod rig;
mod ublox;
mod ublox_model;
