//! Logs the cause of the reset and the brown-out level.

use embassy_stm32::pac::{FLASH, RCC};

/// Brown-out level \[option bytes\] required at this clock: the flash needs 2.7 V at 168 MHz, and this level resets the
/// chip below. Chips are delivered with [`OFF`], with which they run down to 1.8 V.
const LEVEL_2_7_V: u8 = 0b00;
/// No brown-out reset.
const OFF: u8 = 0b11;

/// Logs cause and level.
pub fn log() {
    let csr = RCC.csr().read();
    // The flags persist until cleared, also across resets.
    RCC.csr().modify(|csr| csr.set_rmvf(true));
    // In this order: power-up sets the brown-out's flag, too, and every reset the pin's (RM0090, RCC_CSR).
    let cause = match () {
        () if csr.wdgrstf() => "the watchdog: no control ticks, or a panic or fault",
        () if csr.sftrstf() => "software, or a debugger",
        () if csr.porrstf() => "power-up",
        () if csr.borrstf() => "a supply below the brown-out level",
        () => "the reset pin",
    };
    defmt::info!("started by {=str}", cause);
    match FLASH.optcr().read().bor_lev() {
        LEVEL_2_7_V => (),
        OFF => defmt::warn!("no brown-out reset: undefined behaviour below 2.7 V; docs/firmware.md says how to set it"),
        _ => defmt::warn!("the brown-out level is below 2.7 V; docs/firmware.md says how to set it"),
    }
}
