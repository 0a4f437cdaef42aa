//! Why the chip was started, and at what supply voltage it would be reset: for the log.

use embassy_stm32::pac::{FLASH, RCC};

/// The brown-out level \[option bytes\] that this clock asks for: the flash keeps up with 168 MHz above 2.7 V only, and
/// this level resets the chip below. The factory leaves the level at [`OFF`], where the chip runs on down to 1.8 V.
const LEVEL_2_7_V: u8 = 0b00;
/// No brown-out reset.
const OFF: u8 = 0b11;

/// Logs both.
pub(crate) fn log() {
    let csr = RCC.csr().read();
    // The flags stay until they are cleared, through resets too.
    RCC.csr().modify(|csr| csr.set_rmvf(true));
    let cause = match () {
        () if csr.wdgrstf() => "the watchdog: the control tick stood still, or a panic or fault",
        () if csr.sftrstf() => "software, or a debugger",
        () if csr.porrstf() => "power-up",
        () if csr.borrstf() => "a supply below the brown-out level",
        () => "the reset pin",
    };
    defmt::info!("started by {=str}", cause);
    match FLASH.optcr().read().bor_lev() {
        LEVEL_2_7_V => (),
        OFF => defmt::warn!("no brown-out reset: below 2.7 V anything may happen; docs/firmware.md says how to set it"),
        _ => defmt::warn!("the brown-out level is below 2.7 V; docs/firmware.md says how to set it"),
    }
}
