//! What boards of all STM32 share. A chip's name is a feature of `embassy-stm32` that the board sets.
#![no_std]

pub mod answers;
pub mod battery;
pub mod boot_loader;
pub mod candidates;
pub mod card;
pub mod crystal;
pub mod escs;
pub mod faults;
pub mod i2c;
pub mod indicator;
pub mod line;
pub mod link;
pub mod log_flash;
pub mod motors;
pub mod receiver;
pub mod sd_card;
pub mod sensor_set;
pub mod sensors;
pub mod usb;

use embassy_stm32::Peri;
use embassy_stm32::wdg::{self, IndependentWatchdog};

/// The watchdog resets the chip if it is not fed for this long \[us\], by its own oscillator, whose nominal 32 kHz may
/// be 17 to 47. Motor controllers stop sooner if the processor hangs, after some 20 ms without a frame.
const WATCHDOG_US: u32 = 20_000;

/// Prepares the watchdog, which is yet to be unleashed.
pub fn watchdog<T: wdg::Instance>(peripheral: Peri<'static, T>) -> IndependentWatchdog<'static, T> {
    IndependentWatchdog::new(peripheral, WATCHDOG_US)
}
