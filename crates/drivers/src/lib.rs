//! Drivers for the sensors of flight controllers.
//!
//! A [`SensorPart`] is data and arithmetic: the scripts that set the part up and read it, as [`ScriptStep`]s on its
//! registers, and the decoding of its answers. A [`Driver`] runs the scripts over any `embedded-hal-async` bus
//! ([`SpiRegisters`], [`I2cRegisters`]), stamps each reading with the time of the part's interrupt, and monitors the
//! part:
//!
//! | fault | detected by | reaction |
//! |---|---|---|
//! | wrong part | identity, at set-up | set-up again after 0.1 s |
//! | nothing answers | all bits equal in an answer of three bytes or more | set-up after 10 faults |
//! | settings lost (reset, brown-out) | one register read back every 16 readings | set-up after 10 faults |
//! | transfer fails or never ends | bus error, or 10 ms and 8 us per byte | set-up after 10 faults; [`RecoveringI2c`] |
//! | no interrupt | twice the sample time | set-up after 10 faults, or reading by the clock ([`data_ready`]) |
//! | never ready | 100 cycles | set-up after 10 faults |
//! | readings do not change | [`SensorPart::STUCK_AFTER`] equal answers | set-up after 10 faults |
//! | answers that no working part gives | [`SensorPart::take`] | set-up after 10 faults |
//!
//! Every fault is returned; none is hidden by a repeated reading.
//!
//! | sensor | modules |
//! |---|---|
//! | IMU | [`bmi270`], [`icm426xx`], [`mpu`] |
//! | IMU and magnetometer | [`ak8963`] |
//! | barometer | [`bmp280`], [`bmp3`], [`dps310`], [`ms5611`] |
//! | magnetometer | [`ist8310`], [`lis3mdl`], [`qmc5883l`] |
//! | GNSS receiver | [`ublox`], [`nmea`] |
//! | battery | [`battery`] |
//! | ESC telemetry | [`esc_telemetry`] |
#![no_std]
#![forbid(unsafe_code)]

pub mod ak8963;
pub mod alignment;
pub mod battery;
pub mod bmi270;
pub mod bmp280;
pub mod bmp3;
mod bus;
pub mod data_ready;
pub mod dps310;
mod driver;
pub mod esc_telemetry;
mod i2c_recovery;
pub mod icm426xx;
pub mod ist8310;
pub mod lis3mdl;
pub mod mpu;
pub mod ms5611;
pub mod nmea;
mod part;
pub mod qmc5883l;
mod reading;
pub mod self_test;
pub mod ublox;

pub use bus::{BusError, I2cRegisters, READ_MAX, Registers, SpiFormat, SpiRegisters};
pub use driver::{Driver, FAULTS_MAX, PAUSE_US, PartTiming};
pub use i2c_recovery::{I2cLine, I2cLines, RecoveringI2c};
pub use part::{PartFault, ScriptStep, SensorPart};
pub use reading::{GnssReading, InertialReading, MagneticReading, PressureReading};
