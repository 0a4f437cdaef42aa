//! Drivers of the sensors that flight controllers have.
//!
//! A [`SensorPart`] is data and arithmetic: the scripts that set it up and read it, as [`Step`]s on its registers, and
//! what the answers mean. A [`Driver`] runs the scripts over any `embedded-hal-async` bus ([`SpiRegisters`],
//! [`I2cRegisters`]), stamps each reading with the time of the part's interrupt, and watches the part:
//!
//! | fault | found by | then |
//! |---|---|---|
//! | another part | identity, at set-up | set-up again after 0.1 s |
//! | nothing answers | all bits of an answer of three bytes or more are equal | set-up after 10 faults |
//! | set-up lost (reset, brown-out) | one register that was set is read back every 16 readings | the same |
//! | transfer fails or never ends | the bus, 10 ms and 8 us a byte | the same; [I2C is recovered](RecoveringI2c) |
//! | no interrupt | twice the time of a sample | set-up after 10 faults; or read by the clock ([`data_ready`]) |
//! | never ready | 100 cycles | the same |
//! | readings do not change | [`SensorPart::STUCK_AFTER`] equal answers | the same |
//! | answers that no working part gives | [`SensorPart::take`] | the same |
//!
//! Every fault is returned; none is hidden by a repeated reading.
//!
//! | what | parts |
//! |---|---|
//! | IMU | [`bmi270`], [`icm426xx`], [`mpu`] |
//! | IMU and magnetometer | [`ak8963`] |
//! | barometer | [`bmp280`], [`bmp3`], [`dps310`], [`ms5611`] |
//! | magnetometer | [`ist8310`], [`lis3mdl`], [`qmc5883l`] |
//! | GNSS receiver | [`ublox`], [`nmea`] |
//! | battery | [`battery`] |
//! | motor controllers | [`esc_telemetry`] |
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
pub use part::{PartFault, SensorPart, Step};
pub use reading::{FixReading, InertialReading, MagneticReading, PressureReading};
