//! Accepted ranges of named physical quantities.

use core::fmt;
use core::ops::RangeInclusive;

/// Closed interval of a named quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Range {
    /// Name with unit, as in scenario files, such as `mass_kg`.
    pub name: &'static str,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
}

impl Range {
    /// Makes a range; `min` must not exceed `max`.
    pub const fn new(name: &'static str, min: f64, max: f64) -> Self {
        Range { name, min, max }
    }

    /// Makes a range from an interval, as written in a declaration.
    pub const fn over(name: &'static str, interval: RangeInclusive<f64>) -> Self {
        Range { name, min: *interval.start(), max: *interval.end() }
    }

    /// Checks that `value` is finite and within the range, to `f32` precision: a decimal bound read from a file must
    /// pass after rounding to the controller's precision.
    ///
    /// # Errors
    /// [`OutOfRange`] if not, including for NaN.
    pub fn check(&self, value: impl Into<f64>) -> Result<(), OutOfRange> {
        let value = value.into();
        let rounded = value as f32;
        if rounded >= self.min as f32 && rounded <= self.max as f32 {
            Ok(())
        } else {
            Err(OutOfRange { value, range: *self })
        }
    }
}

/// A quantity outside its [`Range`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OutOfRange {
    /// Rejected value.
    pub value: f64,
    /// Accepted range.
    pub range: Range,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let OutOfRange { value, range: Range { name, min, max } } = self;
        write!(f, "{name} = {value} is out of range: it must lie within {min} to {max}")
    }
}

impl core::error::Error for OutOfRange {}
