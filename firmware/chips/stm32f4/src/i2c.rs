//! Restarts an I2C controller that a broken transfer has left stuck.

use embassy_stm32::pac::i2c::I2c;

/// Resets a controller and restores the settings of its driver, which does not set it up again. An abandoned transfer
/// or a glitch can leave the controller waiting forever.
pub fn restart(i2c: I2c) {
    let (clock, ratio, rise) = (i2c.cr2().read().freq(), i2c.ccr().read(), i2c.trise().read());
    i2c.cr1().write(|cr1| cr1.set_swrst(true));
    i2c.cr1().write(|cr1| cr1.set_swrst(false));
    i2c.cr2().write(|cr2| cr2.set_freq(clock));
    i2c.ccr().write_value(ratio);
    i2c.trise().write_value(rise);
    i2c.cr1().write(|cr1| cr1.set_pe(true));
}
