//! Declared parameters: [`parameters!`](crate::parameters) makes a struct of plain fields and, for each field, the
//! metadata that files, tuners, documents and ground stations need.

use crate::{Axis, OutOfRange, PerAxis, Range};
use core::fmt::{self, Write};
use core::ops::{Div, Mul};
use nalgebra::Vector3;

/// Metadata of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Declaration {
    /// Short name that never changes, such as `MASS`: upper-case letters, digits and underscores.
    pub id: &'static str,
    /// Group inside the visited struct, in lower case: an axis, or a sub-table of a file. Usually empty.
    pub group: &'static str,
    /// Key with unit, as in scenario files, and accepted range.
    pub range: Range,
    /// Unit symbol such as `m/s2`; `1` for a plain number, `number` for a whole one, empty for a switch.
    pub unit: &'static str,
    /// True if the tuner may choose the value; otherwise the vehicle or its task determines it.
    pub tuned: bool,
    /// Meaning, from the field's documentation.
    pub meaning: &'static str,
}

impl Declaration {
    /// Returns the same declaration in the group `group`; an empty name changes nothing.
    #[must_use]
    pub const fn in_group(self, group: &'static str) -> Self {
        if group.is_empty() { self } else { Declaration { group, ..self } }
    }

    /// True if the value is a whole number, such as that of an action.
    pub const fn is_whole(&self) -> bool {
        matches!(self.unit.as_bytes(), b"number")
    }

    /// Returns the name on a ground station and in flash, at most 16 characters: `prefix`, group, id and, for a vector,
    /// the coordinate. Examples: `V_MASS`, `V_INERTIA_X`, `A_ROLL_GAMMA`.
    pub const fn name(&self, prefix: &'static str, coordinate: Option<char>) -> Name {
        Name { prefix, group: self.group, id: self.id, coordinate }
    }
}

/// Full name of a parameter, made by [`Declaration::name`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    prefix: &'static str,
    group: &'static str,
    id: &'static str,
    coordinate: Option<char>,
}

impl Name {
    /// Returns the name's characters.
    pub fn chars(&self) -> impl Iterator<Item = char> {
        let group = self.group.chars().map(|c| c.to_ascii_uppercase());
        let group = group.chain((!self.group.is_empty()).then_some('_'));
        let coordinate = self.coordinate.into_iter().flat_map(|coordinate| ['_', coordinate]);
        self.prefix.chars().chain(group).chain(self.id.chars()).chain(coordinate)
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.chars().try_for_each(|c| f.write_char(c))
    }
}

/// Mutable access to a parameter's value.
#[derive(Debug, PartialEq)]
pub enum Value<'a> {
    /// One number, or the three of a vector, in `f32`.
    Single(&'a mut [f32]),
    /// One number, or the three of a vector, in `f64`.
    Double(&'a mut [f64]),
    /// On or off.
    Switch(&'a mut bool),
}

impl Value<'_> {
    /// Returns the one number, or the three of a vector; nothing for a switch.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        let (single, double): (&[f32], &[f64]) = match self {
            Value::Single(numbers) => (numbers, &[]),
            Value::Double(numbers) => (&[], numbers),
            Value::Switch(_) => (&[], &[]),
        };
        single.iter().map(|&number| f64::from(number)).chain(double.iter().copied())
    }
}

/// Action on each visited parameter; an error ends the visit. Implemented by closures and called statically, so that
/// the firmware's stack analysis can follow the call.
pub trait Visit<E>: FnMut(&Declaration, Value<'_>) -> Result<(), E> {}

impl<E, F: FnMut(&Declaration, Value<'_>) -> Result<(), E>> Visit<E> for F {}

/// A struct made by [`parameters!`](crate::parameters), or one such struct per axis.
pub trait Declared: Clone {
    /// Calls `visit` with every parameter, in the order of declaration, to read or to change it.
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn visit_mut<E>(&mut self, visit: &mut impl Visit<E>) -> Result<(), E>;

    /// Calls `visit` with every parameter; changes that `visit` makes are lost.
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn visit<E>(&self, visit: &mut impl Visit<E>) -> Result<(), E> {
        self.clone().visit_mut(visit)
    }

    /// Checks parameters that limit one another; each must already be in its own range.
    ///
    /// # Errors
    /// The first parameter outside the range that another one sets.
    fn together(&self) -> Result<(), OutOfRange>;

    /// Checks every parameter's range, then the parameters that limit one another.
    ///
    /// # Errors
    /// The first parameter out of range.
    fn validate(&self) -> Result<(), OutOfRange> {
        self.visit(&mut |declaration, value| value.numbers().try_for_each(|number| declaration.range.check(number)))?;
        self.together()
    }
}

impl<G: Declared> Declared for PerAxis<G> {
    fn visit_mut<E>(&mut self, visit: &mut impl Visit<E>) -> Result<(), E> {
        Axis::ALL.into_iter().try_for_each(|axis| {
            let in_axis =
                &mut |declaration: &Declaration, value: Value<'_>| visit(&declaration.in_group(axis.name()), value);
            self[axis].visit_mut(in_axis)
        })
    }

    fn together(&self) -> Result<(), OutOfRange> {
        Axis::ALL.into_iter().try_for_each(|axis| self[axis].together())
    }
}

/// A type that a declared parameter may have.
pub trait Field {
    /// Calls `visit` with the parameter, once per axis if it has several.
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn show<E>(&mut self, declaration: &Declaration, visit: &mut impl Visit<E>) -> Result<(), E>;
}

/// Number type of a parameter: `f32` in the controller, `f64` in the plant model.
pub trait Number: nalgebra::Scalar + Copy + Into<f64> + Mul<Output = Self> + Div<Output = Self> {
    /// Wraps one number, or the three of a vector, as a [`Value`].
    fn values(numbers: &mut [Self]) -> Value<'_>;
}

impl Number for f32 {
    fn values(numbers: &mut [Self]) -> Value<'_> {
        Value::Single(numbers)
    }
}

impl Number for f64 {
    fn values(numbers: &mut [Self]) -> Value<'_> {
        Value::Double(numbers)
    }
}

impl<T: Number> Field for T {
    fn show<E>(&mut self, declaration: &Declaration, visit: &mut impl Visit<E>) -> Result<(), E> {
        visit(declaration, T::values(core::slice::from_mut(self)))
    }
}

impl<T: Number> Field for Vector3<T> {
    fn show<E>(&mut self, declaration: &Declaration, visit: &mut impl Visit<E>) -> Result<(), E> {
        visit(declaration, T::values(self.as_mut_slice()))
    }
}

impl Field for bool {
    fn show<E>(&mut self, declaration: &Declaration, visit: &mut impl Visit<E>) -> Result<(), E> {
        visit(declaration, Value::Switch(self))
    }
}

impl<T: Field> Field for PerAxis<T> {
    fn show<E>(&mut self, declaration: &Declaration, visit: &mut impl Visit<E>) -> Result<(), E> {
        Axis::ALL.into_iter().try_for_each(|axis| self[axis].show(&declaration.in_group(axis.name()), visit))
    }
}

/// Declares a struct of parameters: name, meaning, unit, accepted range and default of each, and whether it is
/// tuned.
///
/// * `#[parameter(ID, "unit", min..=max)]`, with `, tuned` at the end if the tuner may choose it: a number, a vector
///   whose three numbers have the same range, or a [`PerAxis`](crate::PerAxis) of either.
/// * `#[switch(ID)]`: a `bool`.
/// * `#[group("")]`: a declared struct whose parameters join this struct's; with a name, they form a group.
/// * A field without any of these attributes is not a parameter.
///
/// The struct gets [`Declared`](crate::Declared), `DEFAULT`, [`Default`] and one constant per parameter, named by its
/// id. The optional `together` block is checked in addition to the ranges.
///
/// ```
/// use afbc_types::{Declared, Range, parameters};
///
/// parameters! {
///     /// A battery.
///     #[derive(Clone, Copy, Debug, PartialEq)]
///     pub struct Battery {
///         /// Voltage when full.
///         #[parameter(FULL, "V", 1.0..=100.0)]
///         pub full_v: f32 = 12.6,
///         /// Voltage when empty, no more than when full.
///         #[parameter(EMPTY, "V", 1.0..=100.0)]
///         pub empty_v: f32 = 9.9,
///     }
///     together(battery) {
///         Range { max: battery.full_v.into(), ..Battery::EMPTY.range }.check(battery.empty_v)
///     }
/// }
///
/// let error = Battery { full_v: 9.0, ..Battery::DEFAULT }.validate().unwrap_err();
/// assert_eq!(error.to_string(), "empty_v = 9.899999618530273 is out of range: it must lie within 1 to 9");
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[$meta:meta])*
        pub struct $Group:ident $(<$T:ident = $narrow:ty, $wide:ty>)? {
            $(
                $(#[doc = $doc:literal])*
                $(#[parameter($id:ident, $unit:literal, $range:expr $(, $tuned:ident)?)])?
                $(#[switch($switch:ident)])?
                $(#[group($group:literal)])?
                pub $field:ident: $type:ty = $default:expr,
            )*
        }
        $(together($this:ident) $together:block)?
    ) => {
        $(#[$meta])*
        pub struct $Group $(<$T = $narrow>)? {
            $(
                $(#[doc = $doc])*
                $(#[doc = concat!("\n\nAccepted: `", stringify!($range), "` \\[", $unit, "\\].")])?
                pub $field: $type,
            )*
        }

        impl $(<$T>)? $Group $(<$T>)? {
            $(
                $crate::parameters!(
                    @declare $field [$($doc)*] $($id, $unit, $range, [$($tuned)?])? $($switch, "", 0.0..=1.0, [])?
                );
            )*
        }

        impl $Group $(<$wide>)? {
            /// Every parameter at its default.
            pub const DEFAULT: Self = $Group { $($field: $default,)* };
        }

        impl Default for $Group $(<$wide>)? {
            fn default() -> Self {
                Self::DEFAULT
            }
        }

        impl $(<$T: $crate::Number>)? $crate::Declared for $Group $(<$T>)? {
            fn visit_mut<E>(&mut self, visit: &mut impl $crate::Visit<E>) -> Result<(), E> {
                $(
                    $( $crate::Field::show(&mut self.$field, &Self::$id, visit)?; )?
                    $( $crate::Field::show(&mut self.$field, &Self::$switch, visit)?; )?
                    $(
                        let within = &mut |declaration: &$crate::Declaration, value: $crate::Value<'_>| {
                            visit(&declaration.in_group($group), value)
                        };
                        $crate::Declared::visit_mut(&mut self.$field, within)?;
                    )?
                )*
                Ok(())
            }

            fn together(&self) -> Result<(), $crate::OutOfRange> {
                $( $( let _ = $group; $crate::Declared::together(&self.$field)?; )? )*
                $( let $this = self; $together?; )?
                Ok(())
            }
        }
    };
    // A field without attribute: not a parameter.
    (@declare $field:ident [$($doc:literal)*]) => {};
    (@declare $field:ident [$($doc:literal)*] $id:ident, $unit:literal, $range:expr, [$($tuned:ident)?]) => {
        #[doc = concat!("Declaration of `", stringify!($field), "`.")]
        pub const $id: $crate::Declaration = $crate::Declaration {
            id: stringify!($id),
            group: "",
            range: $crate::Range::over(stringify!($field), $range),
            unit: $unit,
            tuned: $crate::parameters!(@tuned $($tuned)?),
            meaning: concat!($($doc),*).trim_ascii(),
        };
    };
    (@tuned) => { false };
    (@tuned tuned) => { true };
}
