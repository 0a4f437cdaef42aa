//! Lists the groups of parameters that a station sees.

use super::encoding::Kind;
use super::reason::Reason;
use crate::configuration::Configuration;
use afbc_store::RecordName;
use afbc_types::{Declaration, Declared, DeclaredValue, DeclaredValueMut, Range};
use core::convert::Infallible;

/// A parameter: one number of a configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name, as in `docs/parameters.md`.
    pub name: RecordName,
    /// Index in the list.
    pub place: u16,
    /// Type on the link.
    pub kind: Kind,
    /// Value; 0 or 1 for a switch.
    pub value: f32,
    /// Accepted range.
    pub range: Range,
}

/// Name or index of the parameter to find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Key {
    Name(RecordName),
    Place(u16),
}

/// Searches the list for one parameter.
///
/// Not a generic visitor: one function per use, with every parameter in it, would take 100 kB of flash.
struct Walk {
    key: Key,
    /// Number of parameters passed so far.
    passed: u16,
    found: Option<Parameter>,
}

/// Ends a walk: the parameter has been found.
struct Found;

/// Shows every group with its prefix, in the order of the list.
macro_rules! each_group {
    ($configuration:expr, |$prefix:pat_param, $group:ident| $show:expr) => {{
        let Configuration {
            parameters,
            rotors: _,
            settings,
            gains,
            curve,
            response,
            outputs,
            escs,
            imu,
            calibration,
            estimation,
            arming,
            guidance,
            radio,
            link,
        } = $configuration;
        each_group!(@ $prefix, $group, $show, ["V_" parameters, "MOT_" curve, "MOT_" response,
            "MOT_" outputs, "" escs, "IMU_" imu, "CAL_" calibration, "ARM_" arming, "EST_" estimation, "" guidance,
            "" radio, "" link, "C_" settings, "A_" gains]);
    }};
    (@ $prefix:pat_param, $group:ident, $show:expr, [$($name:literal $field:ident),*]) => {
        $(
            let ($prefix, $group) = ($name, $field);
            $show?;
        )*
    };
}

impl Configuration {
    /// Walks over all parameters, in the order of the list and of the declarations. An index may change with the
    /// firmware image; a name does not.
    #[inline(never)]
    fn walk(&self, walk: &mut Walk) -> Result<(), Found> {
        each_group!(self, |prefix, group| group.visit(&mut |declaration: &Declaration, value: DeclaredValue<'_>| {
            walk.value(prefix, declaration, value)
        }));
        Ok(())
    }

    /// Returns the number of parameters.
    pub(crate) fn parameters(&self) -> u16 {
        // No parameter has this index, so the walk counts all of them.
        let mut walk = Walk { key: Key::Place(u16::MAX), passed: 0, found: None };
        let _ = self.walk(&mut walk);
        walk.passed
    }

    /// Returns a parameter.
    pub(crate) fn parameter(&self, key: Key) -> Option<Parameter> {
        let mut walk = Walk { key, passed: 0, found: None };
        // `Found` only ends the walk early.
        let _ = self.walk(&mut walk);
        walk.found
    }

    /// Sets a parameter if the value is in its range. Returns the parameter with its new value.
    pub(crate) fn put(&mut self, name: RecordName, value: f32) -> Result<Parameter, Reason> {
        let parameter = self.parameter(Key::Name(name)).ok_or_else(|| Reason::on(name, "no such parameter"))?;
        parameter.range.check(value).map_err(|error| Reason::range(name, &error))?;
        if parameter.kind == Kind::Int32 && value as i32 as f32 != value {
            return Err(Reason::on(name, "must be a whole number"));
        }
        let _ = self.write(parameter.place, value, parameter.range.min as f32);
        // The value is read back, because an f64 is rounded to the nearest f32, and a whole number has no -0.
        self.parameter(Key::Place(parameter.place)).ok_or_else(|| Reason::on(name, "no such parameter"))
    }

    /// Writes the number at `place`. The number of a choice counts from `first` on.
    #[inline(never)]
    fn write(&mut self, place: u16, value: f32, first: f32) -> Result<(), Found> {
        let mut left = usize::from(place);
        let mut show = |_: &Declaration, at: DeclaredValueMut<'_>| {
            let length = match &at {
                DeclaredValueMut::Single(numbers) => numbers.len(),
                DeclaredValueMut::Double(numbers) => numbers.len(),
                _ => 1,
            };
            if left >= length {
                left -= length;
                return Ok(());
            }
            match at {
                DeclaredValueMut::Single(numbers) => {
                    numbers.get_mut(left).into_iter().for_each(|number| *number = value)
                }
                DeclaredValueMut::Double(numbers) => {
                    numbers.get_mut(left).into_iter().for_each(|number| *number = value.into())
                }
                DeclaredValueMut::Whole(number) => *number = value as u32,
                DeclaredValueMut::Switch(switch) => *switch = value != 0.0,
                // The index is not negative, because `put` has checked the range, which begins at `first`.
                DeclaredValueMut::Choice(index, _) => *index = (value - first) as usize,
            }
            Err(Found)
        };
        each_group!(self, |_, group| group.visit_mut(&mut show));
        Ok(())
    }
}

impl Configuration {
    /// Shows the declaration of every parameter in the order of the list, with the words of a choice. A vector's
    /// declaration is shown three times. Used to describe parameters to stations; no firmware image needs it.
    pub(crate) fn show_declarations(&self, show: &mut dyn FnMut(&Declaration, &'static [&'static str])) {
        let mut visit = |declaration: &Declaration, value: DeclaredValue<'_>| {
            let (length, words): (_, &'static [&'static str]) = match value {
                DeclaredValue::Single(numbers) => (numbers.len(), &[]),
                DeclaredValue::Double(numbers) => (numbers.len(), &[]),
                DeclaredValue::Choice(_, words) => (1, words),
                DeclaredValue::Whole(_) => (1, &[]),
                DeclaredValue::Switch(_) => (1, &["off", "on"]),
            };
            (0..length).for_each(|_| show(declaration, words));
            Ok::<(), Infallible>(())
        };
        let mut all = || -> Result<(), Infallible> {
            each_group!(self, |_, group| group.visit(&mut visit));
            Ok(())
        };
        let Ok(()) = all();
    }
}

impl Walk {
    /// Passes one number, or the three numbers of a vector.
    #[inline(never)]
    fn value(
        &mut self,
        prefix: &'static str,
        declaration: &Declaration,
        value: DeclaredValue<'_>,
    ) -> Result<(), Found> {
        let length = match value {
            DeclaredValue::Single(numbers) => numbers.len(),
            DeclaredValue::Double(numbers) => numbers.len(),
            DeclaredValue::Whole(_) | DeclaredValue::Switch(_) | DeclaredValue::Choice(..) => 1,
        };
        // Skips parameters before the wanted index without building their names, which would take half a millisecond
        // per parameter on a board.
        let behind = self.passed.saturating_add(length as u16);
        if matches!(self.key, Key::Place(place) if place >= behind) {
            self.passed = behind;
            return Ok(());
        }
        for (index, coordinate) in (0..length).zip(['X', 'Y', 'Z']) {
            let coordinate = (length > 1).then_some(coordinate);
            // All names fit, as tests/tests/parameters.rs checks. A name that did not fit would be left out of the
            // list.
            let Some(name) = RecordName::of(declaration.name(prefix, coordinate).chars()) else { continue };
            let place = self.passed;
            self.passed += 1;
            if self.key == Key::Name(name) || self.key == Key::Place(place) {
                let (kind, value) = match value {
                    DeclaredValue::Single(numbers) => (Kind::Real32, numbers.get(index).copied().unwrap_or_default()),
                    DeclaredValue::Double(numbers) => {
                        (Kind::Real32, numbers.get(index).copied().unwrap_or_default() as f32)
                    }
                    // All whole numbers are below 2^24 and exact as `f32`.
                    DeclaredValue::Whole(number) => (Kind::Int32, number as f32),
                    DeclaredValue::Switch(switch) => (Kind::Int32, f32::from(u8::from(switch))),
                    DeclaredValue::Choice(index, _) => (Kind::Int32, declaration.range.min as f32 + index as f32),
                };
                self.found = Some(Parameter { name, place, kind, value, range: declaration.range });
                return Err(Found);
            }
        }
        Ok(())
    }
}
