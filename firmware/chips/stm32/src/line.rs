//! Accesses a pin by its registers, in addition to the driver that owns the pin.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Pin};
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::{Idr, Moder, Pupdr};

/// Registers of a pin.
#[derive(Clone, Copy)]
pub struct Line {
    port: Gpio,
    pin: usize,
}

impl Line {
    /// Returns the registers of a pin that will be given to a driver.
    pub fn of(pin: Peri<'_, impl Pin>) -> Self {
        let pin = pin.into::<AnyPin>();
        Line { port: pin.block(), pin: pin.pin().into() }
    }

    /// Takes the pin from its driver forever and holds it low.
    pub fn hold_low(self) {
        self.set(false);
        self.take();
    }

    /// Takes the pin from its driver and makes it an output with the level that was set. On an open-drain pin, high
    /// releases the line.
    pub(crate) fn take(self) {
        self.mode(Moder::OUTPUT);
    }

    /// Gives the pin back to its driver as an alternate function.
    pub(crate) fn give_back(self) {
        self.mode(Moder::ALTERNATE);
    }

    /// Sets the level.
    pub(crate) fn set(self, is_high: bool) {
        self.port.bsrr().write(|bits| if is_high { bits.set_bs(self.pin, true) } else { bits.set_br(self.pin, true) });
    }

    pub(crate) fn is_high(self) -> bool {
        self.port.idr().read().idr(self.pin) == Idr::HIGH
    }

    /// Pulls the pin down instead of up.
    pub(crate) fn pull_down(self) {
        // Interrupts are masked, because tasks of other priorities change other pins of the port.
        cortex_m::interrupt::free(|_| self.port.pupdr().modify(|pulls| pulls.set_pupdr(self.pin, Pupdr::PULL_DOWN)));
    }

    fn mode(self, mode: Moder) {
        cortex_m::interrupt::free(|_| self.port.moder().modify(|modes| modes.set_moder(self.pin, mode)));
    }
}
