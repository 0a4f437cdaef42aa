//! Stands in for the status bits of the STM32F4's clock tree, which QEMU lacks.
//!
//! An image that starts its crystal waits for the ready bit, and waits for ever. So every access to the few registers
//! concerned stops the processor; it then does its load or store by a single step, and a load is given what silicon
//! would have answered to the stores seen so far. The image itself runs unchanged.

use crate::Error;
use crate::gdb::{Gdb, PC, Watch};
use std::collections::HashMap;
use std::time::Duration;

const RCC_CR: u32 = 0x4002_3800;
const RCC_CFGR: u32 = 0x4002_3808;
const RCC_APB2RSTR: u32 = 0x4002_3824;
const RCC_BDCR: u32 = 0x4002_3870;
const RCC_CSR: u32 = 0x4002_3874;
const PWR_CR: u32 = 0x4000_7000;
const FLASH_ACR: u32 = 0x4002_3C00;

/// Every register watched, with its value at reset.
const WATCHED: [(u32, u32); 7] = [
    (RCC_CR, 0x0000_0083),
    (RCC_CFGR, 0),
    (RCC_APB2RSTR, 0),
    (RCC_BDCR, 0),
    (RCC_CSR, 0x0E00_0000),
    (PWR_CR, 0x0000_4000),
    (FLASH_ACR, 0),
];

/// A boot whose clock tree stays untouched for so long is over.
const SETTLED: Duration = Duration::from_millis(300);
/// A boot that touches it more often is lost in a loop.
const ACCESSES_MAX: usize = 2000;

/// Runs a halted processor from reset until its clocks are set up, and gives the number of accesses that took. It is
/// left running.
pub(crate) fn boot(gdb: &mut Gdb) -> Result<usize, Error> {
    let mut written = HashMap::from(WATCHED);
    for (register, _) in WATCHED {
        gdb.watch(watch(register), register)?;
    }
    for accesses in 0..ACCESSES_MAX {
        let Some(address) = gdb.run(SETTLED)? else {
            return Ok(accesses);
        };
        let register = address & !3;
        let pc = gdb.register(PC)?;
        let access = Access::decode(gdb.memory(pc)?)?;
        if register == RCC_APB2RSTR {
            // QEMU 10.0 ends in an assertion when this is stored to: go past the store.
            gdb.set_register(PC, pc + access.length)?;
            continue;
        }
        // Arm's watchpoints stop before the access.
        gdb.unwatch(watch(register), register)?;
        let stored = gdb.register(access.register)?;
        gdb.step()?;
        gdb.watch(watch(register), register)?;
        if access.is_load {
            gdb.set_register(access.register, answer(register, written.get(&register).copied().unwrap_or(0)))?;
        } else {
            written.insert(register, stored);
        }
    }
    Err(Error::Protocol(format!("{ACCESSES_MAX} accesses to the clock tree, and no end")))
}

fn watch(register: u32) -> Watch {
    if register == RCC_APB2RSTR { Watch::Write } else { Watch::Access }
}

/// What silicon answers to a load after `written` was stored: every clock is ready as soon as it is on.
fn answer(register: u32, written: u32) -> u32 {
    /// `ready` follows `on`.
    fn follow(value: u32, on: u32, ready: u32) -> u32 {
        value & !(1 << ready) | (value >> on & 1) << ready
    }
    match register {
        // HSI, HSE, PLL, PLLI2S.
        RCC_CR => [0, 16, 24, 26].into_iter().fold(written, |value, on| follow(value, on, on + 1)),
        // SWS reports SW.
        RCC_CFGR => follow(follow(written, 0, 2), 1, 3),
        // LSE, LSI.
        RCC_BDCR | RCC_CSR => follow(written, 0, 1),
        _ => written,
    }
}

/// A load or store of one register.
struct Access {
    is_load: bool,
    register: u32,
    /// Of the instruction \[bytes\].
    length: u32,
}

impl Access {
    /// Decodes the Thumb forms that compilers use for device registers (Armv7-M manual, A5.2.4 and A5.3.7 to A5.3.10).
    fn decode(code: [u8; 4]) -> Result<Self, Error> {
        let [a, b, c, d] = code;
        let (first, second) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        let (is_load, register, length) = match first >> 12 {
            // LDR, STR and their byte and half-word forms with a wide encoding.
            0xF if first & 0xFE00 == 0xF800 => (first >> 4 & 1 == 1, second >> 12, 4),
            // Register plus register.
            0x5 => (first >> 9 & 7 >= 3, first & 7, 2),
            // Register plus offset.
            0x6..=0x8 => (first >> 11 & 1 == 1, first & 7, 2),
            _ => return Err(Error::Protocol(format!("no load or store: {first:04x} {second:04x}"))),
        };
        Ok(Access { is_load, register: register.into(), length })
    }
}
