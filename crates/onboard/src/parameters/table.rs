//! The parameters by name and by place.

use super::groups::{Key, Parameter};
use super::reason::Reason;
use crate::configuration::Configuration;
use crate::flight::Prepared;
use afbc_store::RecordName;
use afbc_types::{Declaration, OutOfRange};

/// The parameters of a vehicle: as its image has them, and as they are now.
///
/// A value is an `f32`. Parameters of the configuration that are `f32` are what was set, to the bit; one in `f64` is
/// the exact value of the `f32`, and read as the nearest; a switch is 0 or 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterTable<const N: usize = 4> {
    image: Configuration<N>,
    now: Configuration<N>,
    count: u16,
}

impl<const N: usize> ParameterTable<N> {
    /// Makes a table in which every parameter is as in the image.
    pub fn new(image: Configuration<N>) -> Self {
        ParameterTable { count: image.parameters(), now: image.clone(), image }
    }

    /// Returns the configuration to be flown, which makes a [`Flight`](crate::Flight) if the image's does.
    pub fn configuration(&self) -> &Configuration<N> {
        &self.now
    }

    /// Returns the number of parameters, which never changes.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// Returns every parameter, in order.
    pub fn iter(&self) -> impl Iterator<Item = Parameter> {
        (0..self.count).filter_map(|place| self.at(place))
    }

    /// Returns the parameter called `name`.
    pub fn get(&self, name: RecordName) -> Option<Parameter> {
        self.now.parameter(Key::Name(name))
    }

    /// Returns the parameter at `place`.
    pub fn at(&self, place: u16) -> Option<Parameter> {
        self.now.parameter(Key::Place(place))
    }

    /// Returns the parameter called `name` as the image has it.
    pub fn default_of(&self, name: RecordName) -> Option<Parameter> {
        self.image.parameter(Key::Name(name))
    }

    /// Returns the parameter at `place` as the image has it.
    pub fn default_at(&self, place: u16) -> Option<Parameter> {
        self.image.parameter(Key::Place(place))
    }

    /// Shows the declaration of every parameter, in the order of [`iter`](Self::iter), with the words of a choice or a
    /// switch, from the smallest number of its range on.
    pub fn show_declarations(&self, mut show: impl FnMut(&Declaration, &'static [&'static str])) {
        self.image.show_declarations(&mut show);
    }

    /// Changes a parameter; returns it as it is then.
    ///
    /// # Errors
    /// The reason, and nothing has changed: no such parameter, a value out of its range, or one with which the vehicle
    /// could not fly ([`Prepared::new`]).
    pub fn set(&mut self, name: RecordName, value: f32) -> Result<Parameter, Reason> {
        let mut candidate = self.now.clone();
        let parameter = candidate.put(name, value)?;
        Prepared::new(&candidate).map_err(|error| Reason::together(name, &error))?;
        self.now = candidate;
        Ok(parameter)
    }

    /// Changes one of several values, whatever the others are; to be followed by [`ParameterTable::check`].
    ///
    /// # Errors
    /// The reason, and nothing has changed: no such parameter, or a value out of its range.
    pub fn put(&mut self, name: RecordName, value: f32) -> Result<Parameter, Reason> {
        self.now.put(name, value)
    }

    /// Checks that the vehicle could fly.
    ///
    /// # Errors
    /// Those of [`Prepared::new`].
    pub fn check(&self) -> Result<(), OutOfRange> {
        Prepared::new(&self.now).map(drop)
    }

    /// Makes every parameter as in the image.
    pub fn restore(&mut self) {
        self.now.clone_from(&self.image);
    }
}
