//! Logs the cause of the reset.

use embassy_stm32::pac::RCC;

/// Logs the cause.
pub fn log() {
    let rsr = RCC.rsr().read();
    // The flags persist until cleared, also across resets.
    RCC.rsr().modify(|rsr| rsr.set_rmvf(true));
    // In this order: power-up sets the brown-out's flag, too, and every reset the pin's (RM0433, RCC_RSR).
    let cause = match () {
        () if rsr.iwdg1rstf() => "the watchdog: no control ticks, or a panic or fault",
        () if rsr.sftrstf() => "software, or a debugger",
        () if rsr.porrstf() => "power-up",
        () if rsr.borrstf() => "a supply below the brown-out level",
        () => "the reset pin",
    };
    defmt::info!("started by {=str}", cause);
}
