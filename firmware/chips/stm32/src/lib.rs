//! Code shared by boards with any STM32. The board selects the chip by a feature of `embassy-stm32`.
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

/// The watchdog resets the chip if it is not fed for this long \[us\]. Its own oscillator has a nominal 32 kHz, in fact
/// 17 to 47 kHz. If the processor hangs, motor controllers stop sooner, some 20 ms after the last frame.
const WATCHDOG_US: u32 = 20_000;

/// Prepares the watchdog without starting it.
pub fn watchdog<T: wdg::Instance>(peripheral: Peri<'static, T>) -> IndependentWatchdog<'static, T> {
    IndependentWatchdog::new(peripheral, WATCHDOG_US)
}
