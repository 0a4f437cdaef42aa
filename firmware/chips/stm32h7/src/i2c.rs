//! Restarts an I2C controller that a broken transfer has left stuck.

use embassy_stm32::pac::i2c::I2c;

/// Resets a controller; it keeps its settings.
pub fn restart(i2c: I2c) {
    i2c.cr1().modify(|cr1| cr1.set_pe(false));
    // The controller must be off for three clocks, which the read-back takes.
    while i2c.cr1().read().pe() {}
    i2c.cr1().modify(|cr1| cr1.set_pe(true));
}
