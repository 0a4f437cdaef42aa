//! Drives a serial NOR flash chip with the commands that all makers share. The commands are named as in the data sheet
//! of Winbond's W25Q128JV (revision F, section 8).

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

/// Bits of the status register: busy programming or erasing, and write enabled.
const BUSY: u8 = 1 << 0;
const ENABLED: u8 = 1 << 1;
/// Longest wait \[us\]: twice the longest erasure of a block, 2 s. A page takes at most 3 ms (section 9.6).
const PATIENCE_US: u64 = 4_000_000;
/// Accepted values of the third byte n of the identification, which means 2^n bytes. The smallest is 128 KiB.
const SIZES: RangeInclusive<u8> = 0x11..=0x22;
/// Value of that byte for the largest size that three address bytes reach.
const REACH: u8 = 0x18;

/// A chip on an SPI bus.
#[derive(Debug)]
pub struct NorChip<D> {
    device: D,
    /// Returns the time \[us\].
    now_us: fn() -> u64,
}

impl<D: SpiDevice> NorChip<D> {
    /// Creates the driver, for a bus of at most 50 MHz in mode 0 or 3. `now_us` returns the time \[us\].
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

    /// Waits until the chip neither programs nor erases.
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

/// Returns a command followed by an address of three bytes.
fn addressed(command: u8, address: u32) -> [u8; 4] {
    let [_, high, middle, low] = address.to_be_bytes();
    [command, high, middle, low]
}

impl<D: SpiDevice + Send> LogFlash for NorChip<D> {
    fn start(&mut self) -> Result<u32, FlashFailed> {
        self.call(&mut [Operation::Write(&[RELEASE_POWER_DOWN])])?;
        // After a reset of the processor, the chip first finishes an earlier command.
        self.finish()?;
        let mut id = [0; 3];
        self.call(&mut [Operation::Write(&[JEDEC_ID]), Operation::Read(&mut id)])?;
        let [maker, _, size] = id;
        // Without a chip the line reads all zeros or all ones.
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
