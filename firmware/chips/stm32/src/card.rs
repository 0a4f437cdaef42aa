//! A memory card on SPI.

use crate::sensors::SELECT;
use afbc_log::storage::embedded_sdmmc::sdcard::spi::AcquireOpts;
use afbc_log::storage::embedded_sdmmc::{Block, BlockDevice, BlockIdx, SdCard, SdCardError};
use afbc_log::storage::{CardError, CardKeeper, LogCard};
use core::slice;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Pin, Pull};
use embassy_stm32::mode::Blocking;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, MODE_0, Spi};
use embassy_stm32::time::Hertz;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use static_cell::StaticCell;

/// Highest clock while a card starts, and afterwards \[Hz\] (SD Physical Layer Simplified Specification, 4.2.1 and
/// 6.6.6).
const START_HZ: u32 = 400_000;
const MOST_HZ: u32 = 25_000_000;
/// Number of clock bytes before the first command: at least 74 bits (6.4.1).
const WAKING: usize = 10;

/// Returns the SPI settings for a card; MISO is pulled up, since a card's answers idle high.
pub fn config(hz: u32) -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = MODE_0;
    config.frequency = Hertz(hz);
    config.miso_pull = Pull::Up;
    config
}

/// Keeps logs on a card on SPI.
pub type CardLog = CardKeeper<'static>;

/// Creates the log on the card behind a select pin. `kernel_hz` is the SPI's input clock, `core_hz` the core's clock.
/// Must be called only once.
///
/// # Panics
/// At a second call.
pub fn new(
    spi: Spi<'static, Blocking, Master>,
    select: Peri<'static, impl Pin>,
    kernel_hz: u32,
    core_hz: u32,
) -> CardLog {
    static CARD: StaticCell<SpiCard> = StaticCell::new();
    CardKeeper::new(CARD.init(SpiCard::new(spi, select, kernel_hz, core_hz)))
}

/// A card that is alone on its SPI. Every call polls until the card is done, so the calling task must have a lower
/// priority than all others.
pub struct SpiCard {
    card: SdCard<CardBus, CoreDelay>,
    kernel_hz: u32,
}

impl SpiCard {
    fn new(spi: Spi<'static, Blocking, Master>, select: Peri<'static, impl Pin>, kernel_hz: u32, core_hz: u32) -> Self {
        let bus = CardBus { spi, select: Output::new(select, Level::High, SELECT) };
        let delay = CoreDelay { cycles_per_us: core_hz / 1_000_000 };
        // A present card answers the first or the second attempt.
        let options = AcquireOpts { use_crc: true, acquire_retries: 1 };
        SpiCard { card: SdCard::new_with_options(bus, delay, options), kernel_hz }
    }

    fn call<T>(
        &self,
        call: impl FnOnce(&SdCard<CardBus, CoreDelay>) -> Result<T, SdCardError>,
    ) -> Result<T, CardError> {
        let done = call(&self.card);
        self.card.spi(CardBus::release);
        done.map_err(|error| match error {
            // An empty slot answers no command.
            SdCardError::CardNotFound | SdCardError::TimeoutCommand(_) => CardError::Absent,
            _ => CardError::Failed,
        })
    }
}

impl LogCard for SpiCard {
    fn start(&mut self) -> Result<u32, CardError> {
        // The card may have been exchanged.
        self.card.mark_card_uninit();
        let slow_hz = super::sensors::divided(self.kernel_hz, START_HZ);
        self.card.spi(|bus| bus.wake(slow_hz));
        let blocks = self.call(|card| card.num_blocks())?;
        let fast_hz = super::sensors::divided(self.kernel_hz, MOST_HZ);
        self.card.spi(|bus| bus.set_clock(fast_hz));
        Ok(blocks.0)
    }

    fn read(&mut self, number: u32, block: &mut Block) -> Result<(), CardError> {
        self.call(|card| card.read(slice::from_mut(block), BlockIdx(number)))
    }

    fn write(&mut self, number: u32, block: &Block) -> Result<(), CardError> {
        self.call(|card| card.write(slice::from_ref(block), BlockIdx(number)))
    }
}

/// The SPI bus of the card. The card stays selected between transfers, since a command, its answer and its data belong
/// together (7.2).
struct CardBus {
    spi: Spi<'static, Blocking, Master>,
    select: Output<'static>,
}

impl CardBus {
    fn set_clock(&mut self, hz: u32) {
        // These settings are always valid.
        let _ = self.spi.set_config(&config(hz));
    }

    /// Sends the clock that a card needs after power-up.
    fn wake(&mut self, hz: u32) {
        self.set_clock(hz);
        self.select.set_high();
        let _ = self.spi.blocking_write(&[0xFF_u8; WAKING]);
    }

    /// Deselects the card; it releases its line with the next byte of clock.
    fn release(&mut self) {
        self.select.set_high();
        let _ = self.spi.blocking_write(&[0xFF_u8]);
    }
}

impl ErrorType for CardBus {
    type Error = spi::Error;
}

impl SpiDevice for CardBus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        self.select.set_low();
        for operation in operations {
            match operation {
                Operation::Read(into) => {
                    // Send ones, since a card takes zeros for a command.
                    into.fill(0xFF);
                    self.spi.blocking_transfer_in_place(into)?;
                }
                Operation::Write(bytes) => self.spi.blocking_write(bytes)?,
                Operation::Transfer(into, bytes) => self.spi.blocking_transfer(into, bytes)?,
                Operation::TransferInPlace(bytes) => self.spi.blocking_transfer_in_place(bytes)?,
                // `embedded_sdmmc` requests no delays.
                Operation::DelayNs(_) => (),
            }
        }
        Ok(())
    }
}

/// Delays by counting core cycles; the delay is longer if other code runs meanwhile.
struct CoreDelay {
    cycles_per_us: u32,
}

impl DelayNs for CoreDelay {
    fn delay_ns(&mut self, ns: u32) {
        cortex_m::asm::delay(ns.div_ceil(1000).saturating_mul(self.cycles_per_us));
    }
}
