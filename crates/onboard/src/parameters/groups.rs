//! The groups of parameters: the one list of what a station sees.

use super::encoding::Kind;
use super::reason::Reason;
use crate::configuration::Configuration;
use afbc_store::RecordName;
use afbc_types::{Declaration, Declared, Range, Value};

/// A parameter: one number of a configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name, as in `docs/parameters.md`.
    pub name: RecordName,
    /// Place in the list.
    pub place: u16,
    /// Type on the link.
    pub kind: Kind,
    /// Value: of a switch, 0 or 1.
    pub value: f32,
    /// Accepted range.
    pub range: Range,
}

/// Which parameter is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Key {
    Name(RecordName),
    Place(u16),
}

/// A walk over the list to one parameter, to read it or to change it.
///
/// Not a visitor: a function for each of its uses, with every parameter in it, would take 100 KB of flash.
struct Walk {
    key: Key,
    /// Value to be set.
    value: Option<f32>,
    /// Number of parameters passed.
    passed: u16,
    found: Option<Result<Parameter, Reason>>,
}

/// The parameter has been found.
struct Found;

impl<const N: usize> Configuration<N> {
    /// Walks over every parameter, in the order of the list, which is that of this function and of the declarations.
    /// Places may change with the image, names do not.
    #[inline(never)]
    fn walk(&mut self, walk: &mut Walk) -> Result<(), Found> {
        let Configuration { airframe, settings, gains, curve, response, imu, estimation, arming, guidance, link } =
            self;
        walk.group("V_", &mut airframe.parameters)?;
        walk.group("MOT_", curve)?;
        walk.group("MOT_", response)?;
        walk.group("IMU_", imu)?;
        walk.group("ARM_", arming)?;
        walk.group("EST_", estimation)?;
        walk.group("", guidance)?;
        walk.group("", link)?;
        walk.group("C_", settings)?;
        walk.group("A_", gains)
    }

    /// Returns the number of parameters.
    pub(crate) fn parameters(&mut self) -> u16 {
        let mut walk = Walk { key: Key::Place(u16::MAX), value: None, passed: 0, found: None };
        let _ = self.walk(&mut walk);
        walk.passed
    }

    /// Returns a parameter.
    pub(crate) fn parameter(&mut self, key: Key) -> Option<Parameter> {
        let mut walk = Walk { key, value: None, passed: 0, found: None };
        let _ = self.walk(&mut walk);
        walk.found?.ok()
    }

    /// Sets a parameter, if the value is in its range; returns what it is then.
    pub(crate) fn put(&mut self, name: RecordName, value: f32) -> Result<Parameter, Reason> {
        let mut walk = Walk { key: Key::Name(name), value: Some(value), passed: 0, found: None };
        let _ = self.walk(&mut walk);
        walk.found.unwrap_or_else(|| Err(Reason::on(name, "no such parameter")))
    }
}

impl Walk {
    /// Walks over a group.
    fn group(&mut self, prefix: &'static str, group: &mut impl Declared) -> Result<(), Found> {
        group.visit_mut(&mut |declaration: &Declaration, value: Value<'_>| self.value(prefix, declaration, value))
    }

    /// Passes one number or the three of a vector.
    #[inline(never)]
    fn value(&mut self, prefix: &'static str, declaration: &Declaration, mut value: Value<'_>) -> Result<(), Found> {
        let length = match &value {
            Value::Single(numbers) => numbers.len(),
            Value::Double(numbers) => numbers.len(),
            Value::Switch(_) => 1,
        };
        for (index, coordinate) in (0..length).zip(['X', 'Y', 'Z']) {
            let coordinate = (length > 1).then_some(coordinate);
            // Names fit: tests/tests/parameters.rs. One that did not would be left out of the list.
            let Some(name) = RecordName::of(declaration.name(prefix, coordinate).chars()) else { continue };
            let place = self.passed;
            self.passed += 1;
            if self.key == Key::Name(name) || self.key == Key::Place(place) {
                let whole = matches!(value, Value::Switch(_)) || declaration.is_whole();
                let kind = if whole { Kind::Int32 } else { Kind::Real32 };
                let parameter = Parameter { name, place, kind, value: 0.0, range: declaration.range };
                self.found = Some(parameter.read_or_set(&mut value, index, self.value));
                return Err(Found);
            }
        }
        Ok(())
    }
}

impl Parameter {
    /// Sets the number at `index`, if there is a value to be set that is in range; returns the parameter.
    fn read_or_set(mut self, at: &mut Value<'_>, index: usize, value: Option<f32>) -> Result<Self, Reason> {
        if let Some(value) = value {
            self.range.check(value).map_err(|error| Reason::range(self.name, &error))?;
            if self.kind == Kind::Int32 && value as i32 as f32 != value {
                return Err(Reason::on(self.name, "must be a whole number"));
            }
            match at {
                Value::Single(numbers) => numbers.get_mut(index).into_iter().for_each(|number| *number = value),
                Value::Double(numbers) => numbers.get_mut(index).into_iter().for_each(|number| *number = value.into()),
                Value::Switch(switch) => **switch = value != 0.0,
            }
        }
        self.value = match at {
            Value::Single(numbers) => numbers.get(index).copied().unwrap_or_default(),
            Value::Double(numbers) => numbers.get(index).copied().unwrap_or_default() as f32,
            Value::Switch(switch) => f32::from(u8::from(**switch)),
        };
        Ok(self)
    }
}
