//! An axis: where values lie.

use crate::ticks::Ticks;

/// An axis of a panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlotAxis {
    /// Value at the lower end.
    pub low: f64,
    /// Value at the upper end.
    pub high: f64,
    /// Where the lower end is drawn.
    pub from: f64,
    /// Where the upper end is drawn.
    pub to: f64,
    /// Whether equal ratios have equal lengths; both ends are positive then.
    pub is_logarithmic: bool,
}

impl PlotAxis {
    /// Returns where a value is drawn.
    pub fn at(&self, value: f64) -> f64 {
        let share = if self.is_logarithmic {
            libm::log10(value / self.low) / libm::log10(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from + share * (self.to - self.from)
    }

    /// Returns about `most` ticks or fewer, but two at least.
    pub fn ticks(&self, most: usize) -> Ticks {
        if self.is_logarithmic {
            Ticks::logarithmic(self.low, self.high, most)
        } else {
            Ticks::linear(self.low, self.high, most)
        }
    }
}
