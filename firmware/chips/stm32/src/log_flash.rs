//! A flash chip for logs on SPI.

use crate::sensors::{SELECT, divided};
use afbc_log::storage::{FlashKeeper, NorChip};
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Pin};
use embassy_stm32::mode::Blocking;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, MODE_0, Spi};
use embassy_stm32::time::Hertz;
use embassy_time::Instant;
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
use static_cell::StaticCell;

/// Highest clock \[Hz\] (W25Q128JV, revision F, 9.6, for the read command).
const MOST_HZ: u32 = 50_000_000;

/// Keeps logs in a chip that is alone on its SPI. Every call polls until the chip is done, so the calling task must
/// have a lower priority than all others.
pub type FlashLog = FlashKeeper<'static>;

type Chip = NorChip<ExclusiveDevice<Spi<'static, Blocking, Master>, Output<'static>, NoDelay>>;

/// Returns the SPI settings; `kernel_hz` is the SPI's input clock.
pub fn config(kernel_hz: u32) -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = MODE_0;
    config.frequency = Hertz(divided(kernel_hz, MOST_HZ));
    config
}

/// Creates the log in the chip behind a select pin. Must be called only once.
///
/// # Panics
/// At a second call.
pub fn new(spi: Spi<'static, Blocking, Master>, select: Peri<'static, impl Pin>) -> FlashLog {
    let Ok(device) = ExclusiveDevice::new_no_delay(spi, Output::new(select, Level::High, SELECT));
    static CHIP: StaticCell<Chip> = StaticCell::new();
    FlashKeeper::new(CHIP.init(NorChip::new(device, || Instant::now().as_micros())))
}
