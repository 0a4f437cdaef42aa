//! An I2C bus that is recovered before its first transfer and after each failed or abandoned transfer.

use crate::line::Line;
use afbc_drivers::{I2cLine, I2cLines, RecoveringI2c};
use embassy_stm32::i2c::{I2c, Master};
use embassy_stm32::mode::Async;
use embassy_time::{Duration, block_for};

/// Half a clock period during recovery \[us\]: 100 kHz, which every part supports.
const HALF_CLOCK_US: u64 = 5;

/// An I2C bus with recovery.
pub type Bus = RecoveringI2c<I2c<'static, Async, Master>, Lines>;

/// Lines of an I2C controller, and the function that resets it and restores its settings.
pub struct Lines {
    clock: Line,
    data: Line,
    restart: fn(),
}

/// Makes a bus with recovery. `restart` resets the controller and restores its settings.
pub fn bus(controller: I2c<'static, Async, Master>, [clock, data]: [Line; 2], restart: fn()) -> Bus {
    RecoveringI2c::new(controller, Lines { clock, data, restart })
}

impl I2cLines for Lines {
    fn take(&mut self) {
        for line in [self.clock, self.data] {
            line.set(true);
            line.take();
        }
    }

    fn drive(&mut self, line: I2cLine, is_released: bool) {
        let line = match line {
            I2cLine::Clock => self.clock,
            I2cLine::Data => self.data,
        };
        // The pin stays open-drain.
        line.set(is_released);
        block_for(Duration::from_micros(HALF_CLOCK_US));
    }

    fn is_clock_high(&self) -> bool {
        self.clock.is_high()
    }

    fn restart(&mut self) {
        // Give the lines back first: a controller that is reset while its lines are low considers the bus busy.
        self.clock.give_back();
        self.data.give_back();
        (self.restart)();
    }
}
