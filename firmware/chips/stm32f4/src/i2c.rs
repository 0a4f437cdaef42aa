//! Restarts an I2C controller that a broken transfer has left stuck.

use embassy_stm32::pac::i2c::I2c;

/// Resets a controller that is not set up by its driver again: a transfer that was given up, or a glitch, leaves it
/// waiting for ever.
pub fn restart(i2c: I2c) {
    let (clock, ratio, rise) = (i2c.cr2().read().freq(), i2c.ccr().read(), i2c.trise().read());
    i2c.cr1().write(|cr1| cr1.set_swrst(true));
    i2c.cr1().write(|cr1| cr1.set_swrst(false));
    i2c.cr2().write(|cr2| cr2.set_freq(clock));
    i2c.ccr().write_value(ratio);
    i2c.trise().write_value(rise);
    i2c.cr1().write(|cr1| cr1.set_pe(true));
}
