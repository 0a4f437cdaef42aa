//! Minimum, mean and maximum of a series of numbers.

/// Accumulates numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    count: u64,
    sum: f64,
    min: f64,
    max: f64,
}

impl Extremes {
    /// Adds a number.
    pub fn add(&mut self, value: f64) {
        (self.min, self.max) =
            if self.count == 0 { (value, value) } else { (self.min.min(value), self.max.max(value)) };
        self.count += 1;
        self.sum += value;
    }

    /// Returns the number of numbers added.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the minimum, or 0 without any numbers.
    pub fn min(&self) -> f64 {
        self.min
    }

    /// Returns the mean, or 0 without any numbers.
    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }

    /// Returns the maximum, or 0 without any numbers.
    pub fn max(&self) -> f64 {
        self.max
    }
}
