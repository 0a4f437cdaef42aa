//! An I2C that is brought back after trouble.
//!
//! A part that was being read when the processor was reset, or when a glitch cost it a clock, holds the data line until
//! it has been clocked, and no controller begins a transfer meanwhile. A controller whose transfer was given up may not
//! begin another one either: that of the STM32F4 waits for ever, and its driver sends no STOP.

use embedded_hal_async::i2c::{ErrorType, I2c, Operation};

/// Clocks after which a part has sent what is left of a byte, and has seen that nobody acknowledges it.
const CLOCKS: u32 = 9;
/// Half clocks for which a part may hold the clock line.
const STRETCHES: u32 = 10;

/// A line of an I2C.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum I2cLine {
    /// SCL.
    Clock,
    /// SDA.
    Data,
}

/// The lines of a controller of I2C, driven by hand.
pub trait I2cLines {
    /// Takes both lines from the controller, and releases them.
    fn take(&mut self);

    /// Pulls a line low, or releases it, and waits for half a clock.
    fn drive(&mut self, line: I2cLine, is_released: bool);

    /// True if nothing pulls the clock line low.
    fn is_clock_high(&self) -> bool;

    /// Gives the lines back to the controller, which forgets what it was doing.
    fn restart(&mut self);
}

/// A bus that is recovered before its first transfer, and before the one after each that failed or was given up.
#[derive(Debug)]
pub struct RecoveringI2c<C, L> {
    controller: C,
    lines: L,
    /// True if the last transfer came to its end.
    is_in_order: bool,
}

impl<C, L: I2cLines> RecoveringI2c<C, L> {
    /// The bus of a controller and its lines, in whatever state they and their parts are.
    pub fn new(controller: C, lines: L) -> Self {
        RecoveringI2c { controller, lines, is_in_order: false }
    }

    /// Recovers the bus if it must be. It is not in order until the transfer has ended: from one that is given up,
    /// nothing comes back.
    fn begin(&mut self) {
        if !core::mem::take(&mut self.is_in_order) {
            recover(&mut self.lines);
        }
    }
}

impl<C: ErrorType, L> ErrorType for RecoveringI2c<C, L> {
    type Error = C::Error;
}

impl<C: I2c, L: I2cLines> I2c for RecoveringI2c<C, L> {
    async fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), C::Error> {
        self.begin();
        let result = self.controller.write(address, bytes).await;
        self.is_in_order = result.is_ok();
        result
    }

    async fn write_read(&mut self, address: u8, bytes: &[u8], into: &mut [u8]) -> Result<(), C::Error> {
        self.begin();
        let result = self.controller.write_read(address, bytes, into).await;
        self.is_in_order = result.is_ok();
        result
    }

    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), C::Error> {
        self.begin();
        let result = self.controller.transaction(address, operations).await;
        self.is_in_order = result.is_ok();
        result
    }
}

/// Frees the lines and restarts the controller. The first START ends what a part was taking in, lest the clocks be
/// taken for more of it; the clocks end what one was sending; START and STOP leave the bus idle.
fn recover(lines: &mut dyn I2cLines) {
    lines.take();
    start(lines);
    for _ in 0..CLOCKS {
        release_clock(lines);
        lines.drive(I2cLine::Clock, false);
    }
    release_clock(lines);
    start(lines);
    lines.drive(I2cLine::Data, false);
    release_clock(lines);
    lines.drive(I2cLine::Data, true);
    lines.restart();
}

/// Begins a transfer, with both lines released before, and the data line after it.
fn start(lines: &mut dyn I2cLines) {
    lines.drive(I2cLine::Data, false);
    lines.drive(I2cLine::Clock, false);
    lines.drive(I2cLine::Data, true);
}

/// Releases the clock line, and waits while a part stretches the clock.
fn release_clock(lines: &mut dyn I2cLines) {
    for _ in 0..STRETCHES {
        lines.drive(I2cLine::Clock, true);
        if lines.is_clock_high() {
            return;
        }
    }
}
