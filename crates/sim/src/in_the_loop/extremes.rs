//! Least, mean and greatest of many numbers.

/// Gathers numbers one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    count: u64,
    sum: f64,
    min: f64,
    max: f64,
}

impl Extremes {
    /// Takes one more number into account.
    pub fn add(&mut self, value: f64) {
        (self.min, self.max) =
            if self.count == 0 { (value, value) } else { (self.min.min(value), self.max.max(value)) };
        self.count += 1;
        self.sum += value;
    }

    /// How many there were.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The least; 0 of none.
    pub fn min(&self) -> f64 {
        self.min
    }

    /// The mean; 0 of none.
    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }

    /// The greatest; 0 of none.
    pub fn max(&self) -> f64 {
        self.max
    }
}
