//! Logs the cause of the reset and the brown-out level.

use embassy_stm32::pac::{FLASH, RCC};

/// Required brown-out level \[option bytes\]: the flash needs 2.7 V at 168 MHz, and this level resets the chip below
/// that voltage. Chips are delivered with [`OFF`], which lets them run down to 1.8 V.
const LEVEL_2_7_V: u8 = 0b00;
/// Brown-out level without any reset.
const OFF: u8 = 0b11;

/// Logs the cause of the reset and the brown-out level.
pub fn log() {
    let csr = RCC.csr().read();
    // The flags persist until cleared, also across resets.
    RCC.csr().modify(|csr| csr.set_rmvf(true));
    // The order matters: power-up also sets the brown-out flag, and every reset sets the pin's flag (RM0090, RCC_CSR).
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
