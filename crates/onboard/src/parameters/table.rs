//! The table of parameters, by name and by index.

use super::groups::{Key, Parameter};
use super::reason::Reason;
use crate::configuration::Configuration;
use crate::flight::Prepared;
use afbc_store::RecordName;
use afbc_types::{Declaration, OutOfRange, with_rotors};

/// Parameters of a vehicle, with the firmware image's values and the present values.
///
/// A value is an `f32`. An `f32` in the configuration keeps every bit of the value that was set. An `f64` gets exactly
/// this value, and is read as the nearest `f32`. A switch is 0 or 1.
#[derive(Clone, Debug)]
pub struct ParameterTable {
    image: Configuration,
    now: Configuration,
    count: u16,
    /// Prepares a flight, to find out whether the vehicle could fly.
    prepare: fn(&Configuration) -> Result<(), OutOfRange>,
}

impl ParameterTable {
    /// Creates a table with the image's values, for a vehicle with any number of rotors.
    pub fn new(image: Configuration) -> Self {
        Self::checked_by(check, image)
    }

    /// Creates a table with the image's values, for a vehicle with `N` rotors. A firmware image then needs the flight
    /// for no other number.
    pub fn for_rotors<const N: usize>(image: Configuration) -> Self {
        Self::checked_by(check_rotors::<N>, image)
    }

    fn checked_by(prepare: fn(&Configuration) -> Result<(), OutOfRange>, image: Configuration) -> Self {
        ParameterTable { count: image.parameters(), now: image.clone(), image, prepare }
    }

    /// Returns the configuration to fly. A [`Flight`](crate::Flight) accepts it if it accepts the image's.
    pub fn configuration(&self) -> &Configuration {
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
        self.could_fly(&candidate).map_err(|error| Reason::together(name, &error))?;
        self.now = candidate;
        Ok(parameter)
    }

    /// Changes one of several parameters, without regard to the others. Call [`ParameterTable::check`] after the last
    /// change.
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
        self.could_fly(&self.now)
    }

    /// Checks that the vehicle could fly with `candidate`. It is not inlined, since the firmware's budgets follow this
    /// call through a pointer by name.
    #[inline(never)]
    fn could_fly(&self, candidate: &Configuration) -> Result<(), OutOfRange> {
        (self.prepare)(candidate)
    }

    /// Resets all parameters to the image's values.
    pub fn restore(&mut self) {
        self.now.clone_from(&self.image);
    }
}

impl PartialEq for ParameterTable {
    /// Compares the values.
    fn eq(&self, other: &Self) -> bool {
        (&self.image, &self.now) == (&other.image, &other.now)
    }
}

/// Checks that a vehicle with `N` rotors could fly. It is not inlined, since the firmware's budgets follow the call of
/// it by name.
#[inline(never)]
fn check_rotors<const N: usize>(configuration: &Configuration) -> Result<(), OutOfRange> {
    Prepared::<N>::new(configuration).map(drop)
}

/// Checks that a vehicle could fly.
fn check(configuration: &Configuration) -> Result<(), OutOfRange> {
    with_rotors!(configuration.rotors.count(), N => check_rotors::<N>(configuration))
}
