//! Logs the cause of the reset.

use embassy_stm32::pac::RCC;

/// Logs the cause of the reset.
pub fn log() {
    let rsr = RCC.rsr().read();
    // The flags persist until cleared, also across resets.
    RCC.rsr().modify(|rsr| rsr.set_rmvf(true));
    // The order matters: power-up also sets the brown-out flag, and every reset sets the pin's flag (RM0433, RCC_RSR).
    let cause = match () {
        () if rsr.iwdg1rstf() => "the watchdog: no control ticks, or a panic or fault",
        () if rsr.sftrstf() => "software, or a debugger",
        () if rsr.porrstf() => "power-up",
        () if rsr.borrstf() => "a supply below the brown-out level",
        () => "the reset pin",
    };
    defmt::info!("started by {=str}", cause);
}
