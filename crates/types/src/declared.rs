//! Parameters that are declared once: [`parameters!`](crate::parameters) makes a struct of plain fields, and of each
//! field what files, tuners, documents and ground stations need to know of it.

use crate::{Axis, OutOfRange, PerAxis, Range};
use core::fmt::{self, Write};
use core::ops::{Div, Mul};
use nalgebra::Vector3;

/// What is declared of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Declaration {
    /// Short name that never changes: `MASS`. Upper-case letters, digits and underscores.
    pub id: &'static str,
    /// Group within the one that is visited, in lower case: an axis, or a table of its own in a file. Usually empty.
    pub group: &'static str,
    /// Key with unit, as in scenario files, and accepted range.
    pub range: Range,
    /// Unit symbol: `m/s2`; `1` for a plain number, empty for a switch.
    pub unit: &'static str,
    /// True if the tuner may choose it; otherwise the vehicle or its task decides.
    pub tuned: bool,
    /// Meaning, from the field's documentation.
    pub meaning: &'static str,
}

impl Declaration {
    /// The same parameter in a group of this name; an empty name leaves it where it is.
    #[must_use]
    pub const fn in_group(self, group: &'static str) -> Self {
        if group.is_empty() { self } else { Declaration { group, ..self } }
    }

    /// Name on a ground station and in flash, at most 16 characters: `prefix`, group and id, and for a vector which of its
    /// three numbers it is. `V_MASS`, `V_INERTIA_X`, `A_ROLL_GAMMA`.
    pub const fn name(&self, prefix: &'static str, coordinate: Option<char>) -> Name {
        Name { prefix, group: self.group, id: self.id, coordinate }
    }
}

/// A parameter's name in full; [`Declaration::name`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    prefix: &'static str,
    group: &'static str,
    id: &'static str,
    coordinate: Option<char>,
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.prefix)?;
        if !self.group.is_empty() {
            self.group.chars().try_for_each(|c| f.write_char(c.to_ascii_uppercase()))?;
            f.write_char('_')?;
        }
        f.write_str(self.id)?;
        self.coordinate.map_or(Ok(()), |coordinate| write!(f, "_{coordinate}"))
    }
}

/// A parameter's value, in place.
#[derive(Debug, PartialEq)]
pub enum Value<'a> {
    /// One number, or the three of a vector.
    Single(&'a mut [f32]),
    /// One number, or the three of a vector.
    Double(&'a mut [f64]),
    /// On or off.
    Switch(&'a mut bool),
}

impl Value<'_> {
    /// The one number, or the three of a vector; none of a switch.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        let (single, double): (&[f32], &[f64]) = match self {
            Value::Single(numbers) => (numbers, &[]),
            Value::Double(numbers) => (&[], numbers),
            Value::Switch(_) => (&[], &[]),
        };
        single.iter().map(|&number| f64::from(number)).chain(double.iter().copied())
    }
}

/// What a visit does with each parameter; an error ends it. Implemented by closures. A call of it is static, so the proof of
/// the firmware's stack follows it.
pub trait Visit<E>: FnMut(&Declaration, Value<'_>) -> Result<(), E> {}

impl<E, F: FnMut(&Declaration, Value<'_>) -> Result<(), E>> Visit<E> for F {}

/// A group of parameters made by [`parameters!`](crate::parameters), or one for each axis.
pub trait Declared: Clone {
    /// Shows every parameter, in the order of the declaration, to read or to change.
    ///
    /// # Errors
    /// The first that `visit` returns.
    fn visit_mut<E>(&mut self, visit: &mut impl Visit<E>) -> Result<(), E>;

    /// Shows every parameter; changes that `visit` makes are lost.
    ///
    /// # Errors
    /// The first that `visit` returns.
    fn visit<E>(&self, visit: &mut impl Visit<E>) -> Result<(), E> {
        self.clone().visit_mut(visit)
    }

    /// Checks how parameters go together that are each in range.
    ///
    /// # Errors
    /// The first that is out of the range that another one sets.
    fn together(&self) -> Result<(), OutOfRange>;

    /// Checks every parameter, then how they go together.
    ///
    /// # Errors
    /// The first one out of range, by name.
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
    /// Shows the parameter, or one for each axis.
    ///
    /// # Errors
    /// The first that `visit` returns.
    fn show<E>(&mut self, declaration: &Declaration, visit: &mut impl Visit<E>) -> Result<(), E>;
}

/// `f32`, of what flies, or `f64`, of the plant.
pub trait Number: nalgebra::Scalar + Copy + Into<f64> + Mul<Output = Self> + Div<Output = Self> {
    /// One number, or the three of a vector.
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

/// Declares a struct of parameters: the one place that says what each is called and means, its unit, accepted range and
/// default, and whether it is tuned.
///
/// * `#[parameter(ID, "unit", min..=max)]`, with `, tuned` at the end if the tuner may choose it: a number, a vector whose
///   three numbers have the same range, or a [`PerAxis`](crate::PerAxis) of either.
/// * `#[switch(ID)]`: a `bool`.
/// * `#[group("")]`: a declared struct whose parameters join this one's; with a name, they are a group of their own.
/// * A field with none of these is no parameter.
///
/// The struct gets [`Declared`](crate::Declared), `DEFAULT`, [`Default`] and for each parameter a constant named by its id.
/// What `together` says is checked in addition to the ranges.
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
    // No parameter.
    (@declare $field:ident [$($doc:literal)*]) => {};
    (@declare $field:ident [$($doc:literal)*] $id:ident, $unit:literal, $range:expr, [$($tuned:ident)?]) => {
        #[doc = concat!("What is declared of `", stringify!($field), "`.")]
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
