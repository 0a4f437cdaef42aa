//! An I2C bus that is recovered after failures.
//!
//! If the processor was reset during a read, or a glitch cost a part a clock pulse, the part holds the data line low
//! until it is clocked. No controller begins a transfer meanwhile. A controller whose transfer was aborted may also
//! block: the STM32F4's waits forever, and its driver sends no STOP.

use embedded_hal_async::i2c::{ErrorType, I2c, Operation};

/// Clock pulses after which a part has sent the rest of a byte and has seen that nobody acknowledges it.
const CLOCKS: u32 = 9;
/// Largest number of half clocks for which a part may stretch the clock.
const STRETCHES: u32 = 10;

/// A line of an I2C bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum I2cLine {
    /// SCL.
    Clock,
    /// SDA.
    Data,
}

/// Lines of an I2C controller, driven by software.
pub trait I2cLines {
    /// Takes both lines from the controller and releases them.
    fn take(&mut self);

    /// Pulls a line low or releases it, then waits for half a clock.
    fn drive(&mut self, line: I2cLine, is_released: bool);

    /// True if the clock line is high.
    fn is_clock_high(&self) -> bool;

    /// Gives the lines back to the controller and resets it.
    fn restart(&mut self);
}

/// An I2C bus that is recovered before its first transfer, and after each transfer that failed or was aborted.
#[derive(Debug)]
pub struct RecoveringI2c<C, L> {
    controller: C,
    lines: L,
    /// True if the last transfer succeeded.
    is_in_order: bool,
}

impl<C, L: I2cLines> RecoveringI2c<C, L> {
    /// Creates the bus from a controller and its lines, whatever state they and the parts are in.
    pub fn new(controller: C, lines: L) -> Self {
        RecoveringI2c { controller, lines, is_in_order: false }
    }

    /// Recovers the bus if needed. Marks it as needing recovery until the transfer succeeds, since an aborted transfer
    /// never reports back.
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

/// Frees the lines and restarts the controller. The first START aborts a write to a part, so that it does not take the
/// clock pulses for data. The clock pulses end a read from a part. START and STOP leave the bus idle.
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

/// Sends a START. Expects both lines released; leaves the clock low and the data line released.
fn start(lines: &mut dyn I2cLines) {
    lines.drive(I2cLine::Data, false);
    lines.drive(I2cLine::Clock, false);
    lines.drive(I2cLine::Data, true);
}

/// Releases the clock line and waits while a part stretches the clock.
fn release_clock(lines: &mut dyn I2cLines) {
    for _ in 0..STRETCHES {
        lines.drive(I2cLine::Clock, true);
        if lines.is_clock_high() {
            return;
        }
    }
}
