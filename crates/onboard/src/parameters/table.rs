//! The table of parameters, by name and by index.

use super::groups::{Key, Parameter};
use super::reason::Reason;
use crate::configuration::Configuration;
use crate::flight::Prepared;
use afbc_store::RecordName;
use afbc_types::{Declaration, OutOfRange};

/// Parameters of a vehicle, with the firmware image's values and the present values.
///
/// A value is an `f32`. An `f32` in the configuration keeps every bit of the value that was set. An `f64` gets exactly
/// this value, and is read as the nearest `f32`. A switch is 0 or 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterTable<const N: usize = 4> {
    image: Configuration<N>,
    now: Configuration<N>,
    count: u16,
}

impl<const N: usize> ParameterTable<N> {
    /// Creates a table with the image's values.
    pub fn new(image: Configuration<N>) -> Self {
        ParameterTable { count: image.parameters(), now: image.clone(), image }
    }

    /// Returns the configuration to fly. A [`Flight`](crate::Flight) accepts it if it accepts the image's.
    pub fn configuration(&self) -> &Configuration<N> {
        &self.now
    }

    /// Returns the number of parameters, which never changes.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// Returns all parameters, in order.
    pub fn iter(&self) -> impl Iterator<Item = Parameter> {
        (0..self.count).filter_map(|place| self.at(place))
    }

    /// Returns the parameter called `name`.
    pub fn get(&self, name: RecordName) -> Option<Parameter> {
        self.now.parameter(Key::Name(name))
    }

    /// Returns the parameter at index `place`.
    pub fn at(&self, place: u16) -> Option<Parameter> {
        self.now.parameter(Key::Place(place))
    }

    /// Returns the parameter called `name` with the image's value.
    pub fn default_of(&self, name: RecordName) -> Option<Parameter> {
        self.image.parameter(Key::Name(name))
    }

    /// Returns the parameter at index `place` with the image's value.
    pub fn default_at(&self, place: u16) -> Option<Parameter> {
        self.image.parameter(Key::Place(place))
    }

    /// Shows the declaration of every parameter, in the order of [`iter`](Self::iter). A choice or a switch comes with
    /// its words, from the smallest number of its range on.
    pub fn show_declarations(&self, mut show: impl FnMut(&Declaration, &'static [&'static str])) {
        self.image.show_declarations(&mut show);
    }

    /// Changes a parameter. Returns the parameter with its new value.
    ///
    /// # Errors
    /// The reason, with nothing changed: the parameter is unknown, the value is out of range, or the vehicle could not
    /// fly with it ([`Prepared::new`]).
    pub fn set(&mut self, name: RecordName, value: f32) -> Result<Parameter, Reason> {
        let mut candidate = self.now.clone();
        let parameter = candidate.put(name, value)?;
        Prepared::new(&candidate).map_err(|error| Reason::together(name, &error))?;
        self.now = candidate;
        Ok(parameter)
    }

    /// Changes one of several parameters, without regard to the others. Call [`ParameterTable::check`] after the last
    /// one.
    ///
    /// # Errors
    /// The reason, with nothing changed: the parameter is unknown, or the value is out of range.
    pub fn put(&mut self, name: RecordName, value: f32) -> Result<Parameter, Reason> {
        self.now.put(name, value)
    }

    /// Checks that the vehicle could fly.
    ///
    /// # Errors
    /// The errors of [`Prepared::new`].
    pub fn check(&self) -> Result<(), OutOfRange> {
        Prepared::new(&self.now).map(drop)
    }

    /// Resets all parameters to the image's values.
    pub fn restore(&mut self) {
        self.now.clone_from(&self.image);
    }
}
