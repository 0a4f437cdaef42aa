//! A serial NOR flash chip by the commands that all of their makers have, as the data sheet of Winbond's W25Q128JV
//! names them (revision F, section 8).

use crate::storage::flash::{FlashFailed, LogFlash, SECTOR_BYTES};
use core::ops::RangeInclusive;
use embedded_hal::spi::{Operation, SpiDevice};

const WRITE_ENABLE: u8 = 0x06;
const PAGE_PROGRAM: u8 = 0x02;
const READ_DATA: u8 = 0x03;
const READ_STATUS: u8 = 0x05;
const BLOCK_ERASE: u8 = 0xD8;
const RELEASE_POWER_DOWN: u8 = 0xAB;
const JEDEC_ID: u8 = 0x9F;

/// Status: it programs or erases; it would.
const BUSY: u8 = 1 << 0;
const ENABLED: u8 = 1 << 1;
/// Longest time that is waited for \[us\]: twice that of a sector, 2 s; a page takes 3 ms at most (9.6).
const PATIENCE_US: u64 = 4_000_000;
/// The third byte of the identification, of 2^n bytes: from 128 KiB on, and what three bytes of address reach.
const SIZES: RangeInclusive<u8> = 0x11..=0x22;
const REACH: u8 = 0x18;

/// A chip that is alone on its bus, or selected by it.
#[derive(Debug)]
pub struct NorChip<D> {
    device: D,
    /// The clock \[us\].
    now_us: fn() -> u64,
}

impl<D: SpiDevice> NorChip<D> {
    /// Creates it, for a bus of at most 50 MHz in mode 0 or 3, and a clock.
    pub fn new(device: D, now_us: fn() -> u64) -> Self {
        NorChip { device, now_us }
    }

    fn call(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), FlashFailed> {
        self.device.transaction(operations).map_err(|_| FlashFailed)
    }

    fn status(&mut self) -> Result<u8, FlashFailed> {
        let mut status = [0];
        self.call(&mut [Operation::Write(&[READ_STATUS]), Operation::Read(&mut status)])?;
        Ok(status[0])
    }

    /// Waits until it neither programs nor erases.
    fn finish(&mut self) -> Result<(), FlashFailed> {
        let since_us = (self.now_us)();
        while self.status()? & BUSY != 0 {
            if (self.now_us)().saturating_sub(since_us) > PATIENCE_US {
                return Err(FlashFailed);
            }
        }
        Ok(())
    }

    fn change(&mut self, command: u8, address: u32, bytes: &[u8]) -> Result<(), FlashFailed> {
        self.call(&mut [Operation::Write(&[WRITE_ENABLE])])?;
        if self.status()? & (BUSY | ENABLED) != ENABLED {
            return Err(FlashFailed);
        }
        self.call(&mut [Operation::Write(&addressed(command, address)), Operation::Write(bytes)])?;
        self.finish()
    }
}

/// Returns a command with its address, in three bytes.
fn addressed(command: u8, address: u32) -> [u8; 4] {
    let [_, high, middle, low] = address.to_be_bytes();
    [command, high, middle, low]
}

impl<D: SpiDevice + Send> LogFlash for NorChip<D> {
    fn start(&mut self) -> Result<u32, FlashFailed> {
        self.call(&mut [Operation::Write(&[RELEASE_POWER_DOWN])])?;
        // What it had begun before a reset of the processor it finishes.
        self.finish()?;
        let mut id = [0; 3];
        self.call(&mut [Operation::Write(&[JEDEC_ID]), Operation::Read(&mut id)])?;
        let [maker, _, size] = id;
        // A line on which nobody is rests high or low.
        if matches!(maker, 0 | 0xFF) || !SIZES.contains(&size) {
            return Err(FlashFailed);
        }
        Ok((1 << size.min(REACH)) / SECTOR_BYTES)
    }

    fn read(&mut self, address: u32, into: &mut [u8]) -> Result<(), FlashFailed> {
        self.call(&mut [Operation::Write(&addressed(READ_DATA, address)), Operation::Read(into)])
    }

    fn program(&mut self, address: u32, bytes: &[u8]) -> Result<(), FlashFailed> {
        self.change(PAGE_PROGRAM, address, bytes)
    }

    fn erase(&mut self, sector: u32) -> Result<(), FlashFailed> {
        self.change(BLOCK_ERASE, sector.saturating_mul(SECTOR_BYTES), &[])
    }
}
