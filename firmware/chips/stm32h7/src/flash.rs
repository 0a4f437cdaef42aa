//! Stores parameters in the first two sectors of the flash's second bank. The code runs from the first bank, so writing
//! and erasing do not stop the core.
//!
//! The chip programs 256 bits at once, with a checksum, and only once after an erase. So every word of four bytes takes
//! 32 bytes of flash, and a sector of 128 KiB holds 16 KiB.

use core::arch::asm;
use cortex_m::peripheral::SCB;
use embassy_stm32::Peri;
use embassy_stm32::pac;
use embassy_stm32::peripherals::FLASH;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

/// Index and address of the second bank.
const BANK: usize = 1;
const BANK_ADDRESS: u32 = 0x0810_0000;
/// Words per program operation, of which one is used.
const WORDS: u32 = 8;
/// Size of a word \[bytes\].
const WORD: usize = 4;
/// Number of sectors, and usable size of each \[bytes\].
const SECTORS: u32 = 2;
const SECTOR: u32 = 128 * 1024 / WORDS;
/// Keys that unlock a bank.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// Bit of the configuration and control register that ignores bus faults of loads while faults are masked.
const BFHFNMIGN: u32 = 1 << 8;

/// The two sectors as words of four bytes.
pub struct WordFlash(Peri<'static, FLASH>);

impl WordFlash {
    /// Takes the flash. Must be called at the start.
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        WordFlash(flash)
    }
}

impl ErrorType for WordFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for WordFlash {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check(offset, bytes.len(), WORD)?;
        for (address, bytes) in addresses(offset).zip(bytes.chunks_mut(WORD)) {
            bytes.iter_mut().zip(load(address).to_le_bytes()).for_each(|(to, from)| *to = from);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        (SECTORS * SECTOR) as usize
    }
}

impl NorFlash for WordFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        // An end before the start wraps to a length beyond the sectors, which is refused.
        check(from, to.wrapping_sub(from) as usize, SECTOR as usize)?;
        for sector in from / SECTOR..to / SECTOR {
            unlocked(|| {
                pac::FLASH.bank(BANK).cr().modify(|cr| {
                    cr.set_ser(true);
                    cr.set_snb(sector as u8);
                });
                pac::FLASH.bank(BANK).cr().modify(|cr| cr.set_start(true));
            })?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check(offset, bytes.len(), WORD)?;
        let words = bytes.as_chunks::<WORD>().0.iter().map(|word| u32::from_le_bytes(*word));
        for (address, word) in addresses(offset).zip(words) {
            unlocked(|| {
                pac::FLASH.bank(BANK).cr().modify(|cr| cr.set_pg(true));
                store(address, word);
            })?;
        }
        Ok(())
    }
}

/// Checks that a range lies within the sectors and consists of whole units.
fn check(offset: u32, length: usize, unit: usize) -> Result<(), NorFlashErrorKind> {
    let start = offset as usize;
    if !start.is_multiple_of(unit) || !length.is_multiple_of(unit) {
        return Err(NorFlashErrorKind::NotAligned);
    }
    match start.checked_add(length) {
        Some(end) if end <= (SECTORS * SECTOR) as usize => Ok(()),
        _ => Err(NorFlashErrorKind::OutOfBounds),
    }
}

/// Returns the addresses of the words from `offset` on.
fn addresses(offset: u32) -> impl Iterator<Item = u32> {
    (BANK_ADDRESS + offset * WORDS..).step_by(WORD * WORDS as usize)
}

/// Unlocks the bank, starts an operation, waits until it is done, and locks the bank again.
fn unlocked(start: impl FnOnce()) -> Result<(), NorFlashErrorKind> {
    let bank = pac::FLASH.bank(BANK);
    for key in KEYS {
        bank.keyr().write_value(key);
    }
    start();
    // Wait until all stores have reached the flash, before reading its status.
    cortex_m::asm::dsb();
    // Only the caller waits: interrupts run meanwhile from the other bank.
    while {
        let sr = bank.sr().read();
        sr.bsy() || sr.qw()
    } {}
    let sr = bank.sr().read();
    // The flags persist until cleared and would be taken for a failure of the next operation.
    bank.ccr().write(|ccr| {
        ccr.set_clr_eop(true);
        ccr.set_clr_wrperr(true);
        ccr.set_clr_pgserr(true);
        ccr.set_clr_strberr(true);
        ccr.set_clr_incerr(true);
        ccr.set_clr_operr(true);
    });
    bank.cr().modify(|cr| {
        cr.set_pg(false);
        cr.set_ser(false);
    });
    bank.cr().modify(|cr| cr.set_lock(true));
    let failed = sr.wrperr() || sr.pgserr() || sr.strberr() || sr.incerr() || sr.operr();
    if failed { Err(NorFlashErrorKind::Other) } else { Ok(()) }
}

/// Programs a word and the seven words after it, which stay erased. The bank must be unlocked for programming.
#[expect(unsafe_code, reason = "flash is programmed by stores to its addresses")]
fn store(address: u32, word: u32) {
    for place in 0..WORDS {
        let value = if place == 0 { word } else { u32::MAX };
        // SAFETY: the addresses are aligned and within the two sectors, which hold nothing else (`addresses`,
        // memory.x).
        unsafe { (address as *mut u32).add(place as usize).write_volatile(value) };
    }
}

/// Returns a word; zero if a power cut has left its checksum wrong. Zero is neither a record nor erased flash. Loading
/// such a word is a bus fault, which would otherwise end every start.
#[expect(unsafe_code, reason = "a bus fault must be masked")]
fn load(address: u32) -> u32 {
    // SAFETY: the register exists on every Cortex-M7, and the change is undone below.
    let ccr = unsafe { &(*SCB::PTR).ccr };
    // SAFETY: only this load runs while faults are masked, for some ten cycles; its address is aligned and within the
    // sectors.
    let word = unsafe {
        asm!("cpsid f");
        ccr.modify(|value| value | BFHFNMIGN);
        cortex_m::asm::dsb();
        let word = (address as *const u32).read_volatile();
        cortex_m::asm::dsb();
        ccr.modify(|value| value & !BFHFNMIGN);
        asm!("cpsie f");
        word
    };
    let bank = pac::FLASH.bank(BANK);
    if !bank.sr().read().dbeccerr() {
        return word;
    }
    bank.ccr().write(|ccr| ccr.set_clr_dbeccerr(true));
    0
}
