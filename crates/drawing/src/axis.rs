//! Linear and logarithmic axes that map values to lengths.

use crate::ticks::Ticks;

/// One axis of a panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlotAxis {
    /// Value at the axis's lower end.
    pub low: f64,
    /// Value at the axis's upper end.
    pub high: f64,
    /// Position of the lower end in the drawing.
    pub from: f64,
    /// Position of the upper end in the drawing.
    pub to: f64,
    /// Whether the axis is logarithmic; `low` and `high` must be positive then.
    pub is_logarithmic: bool,
}

impl PlotAxis {
    /// Returns a value's position in the drawing.
    pub fn at(&self, value: f64) -> f64 {
        let share = if self.is_logarithmic {
            libm::log10(value / self.low) / libm::log10(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from + share * (self.to - self.from)
    }

    /// Returns at least two ticks, and `most` or slightly more at most.
    pub fn ticks(&self, most: usize) -> Ticks {
        if self.is_logarithmic {
            Ticks::logarithmic(self.low, self.high, most)
        } else {
            Ticks::linear(self.low, self.high, most)
        }
    }
}
