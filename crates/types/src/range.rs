//! Accepted intervals of physical quantities, by name.

use core::fmt;
use core::ops::RangeInclusive;

/// The closed interval that a named quantity must lie in. The name ends in the unit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Range {
    /// Name with unit, as in scenario files: `mass_kg`.
    pub name: &'static str,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
}

impl Range {
    /// A range; `min <= max`.
    pub const fn new(name: &'static str, min: f64, max: f64) -> Self {
        Range { name, min, max }
    }

    /// The range of all values in `interval`, as it is written in a declaration.
    pub const fn over(name: &'static str, interval: RangeInclusive<f64>) -> Self {
        Range { name, min: *interval.start(), max: *interval.end() }
    }

    /// `Ok` if `value` is finite and within the range, to `f32` precision: what a file may say, a controller may hold.
    ///
    /// # Errors
    /// [`OutOfRange`] otherwise, NaN included.
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
    /// What was given.
    pub value: f64,
    /// What is accepted.
    pub range: Range,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let OutOfRange { value, range: Range { name, min, max } } = self;
        write!(f, "{name} = {value} is out of range: it must lie within {min} to {max}")
    }
}

impl core::error::Error for OutOfRange {}
