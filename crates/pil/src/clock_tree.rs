//! Emulates the status bits of the STM32F4's clock tree, which QEMU lacks.
//!
//! An image that starts its crystal waits for the ready bit, in QEMU forever. So the debugger stops the processor at
//! every access to these registers and single-steps the access. A load then receives the value that silicon would
//! return after the previous stores. The image itself runs unchanged.

use crate::Error;
use crate::gdb::{Gdb, PC, Watchpoint};
use std::collections::HashMap;
use std::time::Duration;

/// Clock control register (reference manual RM0090, 7.3).
pub const RCC_CR: u32 = 0x4002_3800;
/// Source and factors of the main PLL.
pub const RCC_PLLCFGR: u32 = 0x4002_3804;
/// Selection of the core's clock.
pub const RCC_CFGR: u32 = 0x4002_3808;
/// The flash's wait states, caches and prefetch (3.9.1).
pub const FLASH_ACR: u32 = 0x4002_3C00;
const RCC_CIR: u32 = 0x4002_380C;
const RCC_APB2RSTR: u32 = 0x4002_3824;
const RCC_BDCR: u32 = 0x4002_3870;
const RCC_CSR: u32 = 0x4002_3874;
const PWR_CR: u32 = 0x4000_7000;
const FLASH_OPTCR: u32 = 0x4002_3C14;
const DBGMCU_IDCODE: u32 = 0xE004_2000;
const SYST_CSR: u32 = 0xE000_E010;
/// First backup register (26.6.20), which a reset does not change.
pub const RTC_BKP0R: u32 = 0x4000_2850;
/// Register that selects the memory at address 0 (9.2.1); 1 selects the system memory.
const SYSCFG_MEMRMP: u32 = 0x4001_3800;

/// Watched registers with their reset values. Option bytes are as delivered, and the chip has revision 2.
const WATCHED: [(u32, u32); 14] = [
    (RCC_CR, 0x0000_0083),
    (RCC_PLLCFGR, 0x2400_3010),
    (RCC_CFGR, 0),
    (RCC_CIR, 0),
    (RCC_APB2RSTR, 0),
    (RCC_BDCR, 0),
    (RCC_CSR, 0x0E00_0000),
    (PWR_CR, 0x0000_4000),
    (FLASH_ACR, 0),
    (FLASH_OPTCR, 0x0FFF_AAED),
    (DBGMCU_IDCODE, 0x1007_6413),
    (SYST_CSR, 0),
    (RTC_BKP0R, 0),
    (SYSCFG_MEMRMP, 0),
];

// Bits of RCC_CR, RCC_CFGR and RCC_CIR.
const HSEON: u32 = 1 << 16;
const CSSON: u32 = 1 << 19;
const PLLON: u32 = 1 << 24;
const SW: u32 = 0b11;
const CSSF: u32 = 1 << 7;
const CSSC: u32 = 1 << 23;

/// Longest time between two accesses by the image.
const PATIENCE: Duration = Duration::from_secs(60);
/// After this many accesses the image counts as caught in a loop.
const ACCESSES_MAX: usize = 2000;

/// The watched registers as the image sees them.
#[derive(Debug)]
pub(crate) struct ClockTree {
    written: HashMap<u32, u32>,
    /// True if the crystal starts.
    crystal: bool,
}

impl ClockTree {
    /// Returns the registers in their reset state. From now on, every access to them stops the processor.
    pub(crate) fn new(gdb: &mut Gdb, crystal: bool) -> Result<Self, Error> {
        for (register, _) in WATCHED {
            gdb.watch(watch(register), register)?;
        }
        Ok(ClockTree { written: HashMap::from(WATCHED), crystal })
    }

    /// Returns the last value written to `register`, or its reset value.
    pub(crate) fn register(&self, register: u32) -> u32 {
        self.written.get(&register).copied().unwrap_or(0)
    }

    /// Runs a halted processor from reset until its clocks are set up and SysTick runs. Returns the number of accesses;
    /// the processor is halted again.
    pub(crate) fn boot(&mut self, gdb: &mut Gdb) -> Result<usize, Error> {
        self.serve(gdb, SYST_CSR, 1)
    }

    /// Runs a halted processor from a reset that left `word` in the first backup register, until the system memory is
    /// at address 0.
    pub(crate) fn boot_system_memory(&mut self, gdb: &mut Gdb, word: u32) -> Result<usize, Error> {
        self.written.insert(RTC_BKP0R, word);
        self.serve(gdb, SYSCFG_MEMRMP, 1)
    }

    /// Stops the crystal and does the hardware's part of the clock security system (RM0090, 7.2.7). Returns true if a
    /// non-maskable interrupt must be raised.
    pub(crate) fn lose_crystal(&mut self) -> bool {
        self.crystal = false;
        let watched = self.register(RCC_CR) & CSSON != 0;
        if watched {
            self.change(RCC_CR, |value| value & !(HSEON | PLLON));
            self.change(RCC_CFGR, |value| value & !SW);
            self.change(RCC_CIR, |value| value | CSSF);
        }
        watched
    }

    fn change(&mut self, register: u32, change: impl FnOnce(u32) -> u32) {
        self.written.insert(register, change(self.register(register)));
    }

    /// Runs a halted processor until the image has switched the core to another clock. The processor is halted again.
    pub(crate) fn switch(&mut self, gdb: &mut Gdb) -> Result<usize, Error> {
        self.serve(gdb, RCC_CFGR, SW)
    }

    /// Runs a halted processor until it sets one of `bits` in the register `last`. Returns the number of accesses; the
    /// processor is halted again.
    fn serve(&mut self, gdb: &mut Gdb, last: u32, bits: u32) -> Result<usize, Error> {
        for accesses in 1..ACCESSES_MAX {
            let Some(address) = gdb.run(PATIENCE)? else {
                return Err(Error::Protocol("the image waits without accessing the clock tree".into()));
            };
            // An access may be to a single byte of the register.
            let register = address & !3;
            let pc = gdb.register(PC)?;
            let access = RegisterAccess::decode(gdb.memory(pc)?)?;
            if register == RCC_APB2RSTR {
                // Skip this store, on which QEMU 10.0 fails an assertion.
                gdb.set_register(PC, pc + access.length)?;
                continue;
            }
            // Arm's watchpoints stop before the access.
            gdb.unwatch(watch(register), register)?;
            let stored = gdb.register(access.register)?;
            gdb.step()?;
            gdb.watch(watch(register), register)?;
            if access.is_load {
                gdb.set_register(access.register, self.answer(register))?;
                continue;
            }
            self.written.insert(register, stored);
            if register == RCC_CIR && stored & CSSC != 0 {
                self.change(RCC_CIR, |value| value & !(CSSC | CSSF));
            }
            if register == last && stored & bits != 0 {
                return Ok(accesses);
            }
        }
        Err(Error::Protocol(format!("the image still accesses the clock tree after {ACCESSES_MAX} accesses")))
    }

    /// Returns silicon's answer to a load: a clock is ready as soon as it is on.
    fn answer(&self, register: u32) -> u32 {
        /// Copies the bit `on` to the bit `ready`.
        fn follow(value: u32, on: u32, ready: u32) -> u32 {
            value & !(1 << ready) | (value >> on & 1) << ready
        }
        let written = self.register(register);
        match register {
            // Ready bits of HSI, HSE, PLL and PLLI2S.
            RCC_CR => {
                let ready = [0, 16, 24, 26].into_iter().fold(written, |value, on| follow(value, on, on + 1));
                if self.crystal { ready } else { ready & !(HSEON << 1) }
            }
            // SWS reports SW.
            RCC_CFGR => follow(follow(written, 0, 2), 1, 3),
            // Ready bits of LSE and LSI.
            RCC_BDCR | RCC_CSR => follow(written, 0, 1),
            _ => written,
        }
    }
}

/// Runs a halted processor to its first store to `register` and replaces that instruction by NOPs.
pub(crate) fn skip_first_store(gdb: &mut Gdb, register: u32) -> Result<(), Error> {
    gdb.watch(Watchpoint::Write, register)?;
    gdb.run(PATIENCE)?.ok_or_else(|| Error::Protocol(format!("nothing stores to {register:#x}")))?;
    gdb.unwatch(Watchpoint::Write, register)?;
    let pc = gdb.register(PC)?;
    let access = RegisterAccess::decode(gdb.memory(pc)?)?;
    // NOP
    gdb.set_memory(pc, &[0x00, 0xBF].repeat(access.length as usize / 2))
}

fn watch(register: u32) -> Watchpoint {
    // Watch only writes, since SysTick's counter is next to this register and is read all the time.
    if [RCC_APB2RSTR, SYST_CSR].contains(&register) { Watchpoint::Write } else { Watchpoint::Access }
}

/// A load or store of one register.
struct RegisterAccess {
    is_load: bool,
    register: u32,
    /// Length of the instruction \[bytes\].
    length: u32,
}

impl RegisterAccess {
    /// Decodes the Thumb forms that compilers use for device registers (Armv7-M manual, A5.2.4 and A5.3.7 to A5.3.10).
    fn decode(code: [u8; 4]) -> Result<Self, Error> {
        let [a, b, c, d] = code;
        let (first, second) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        let (is_load, register, length) = match first >> 12 {
            // These are LDR and STR in the wide encoding, also of bytes and half-words.
            0xF if first & 0xFE00 == 0xF800 => (first >> 4 & 1 == 1, second >> 12, 4),
            // These are LDR and STR whose address is a register plus a register.
            0x5 => (first >> 9 & 7 >= 3, first & 7, 2),
            // These are LDR and STR whose address is a register plus an offset.
            0x6..=0x8 => (first >> 11 & 1 == 1, first & 7, 2),
            _ => {
                return Err(Error::Protocol(format!(
                    "the instruction {first:04x} {second:04x} is neither a load nor a store"
                )));
            }
        };
        Ok(RegisterAccess { is_load, register: register.into(), length })
    }
}
