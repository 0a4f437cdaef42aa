//! Declared parameters: [`parameters!`](crate::parameters) makes a struct of plain fields and, for each field, the
//! metadata that files, tuners, documents and ground stations need.

use crate::{Axis, OutOfRange, PerAxis, Range};
use core::fmt::{self, Write};
use core::ops::{Div, Mul, RangeInclusive};
use core::slice;
use nalgebra::Vector3;

/// Metadata of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Declaration {
    /// Short name that never changes, such as `MASS`: upper-case letters, digits and underscores.
    pub id: &'static str,
    /// Group inside the visited struct, in lower case: an axis, or a sub-table of a file. Usually empty.
    pub group: &'static str,
    /// Accepted range, with the key including the unit, as in scenario files.
    pub range: Range,
    /// Unit symbol such as `m/s2`; `1` for a plain number, `number` for a whole number or a choice, empty for a switch.
    pub unit: &'static str,
    /// True if the tuner may choose the value. Otherwise the vehicle or its task determines it.
    pub tuned: bool,
    /// Meaning, taken from the field's documentation.
    pub meaning: &'static str,
}

impl Declaration {
    /// Returns the same declaration in the group `group`.
    #[must_use]
    pub const fn in_group(self, group: &'static str) -> Self {
        Declaration { group, ..self }
    }

    /// Returns the name for ground stations and flash, at most 16 characters: `prefix`, group, id and, for a vector,
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

/// Value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DeclaredValue<'a> {
    /// One number, or the three numbers of a vector, in `f32`.
    Single(&'a [f32]),
    /// One number, or the three numbers of a vector, in `f64`.
    Double(&'a [f64]),
    /// A whole number.
    Whole(u32),
    /// On or off.
    Switch(bool),
    /// One of several words, as an index into the words. The parameter's number is the index plus the smallest number
    /// of the range.
    Choice(usize, &'static [&'static str]),
}

/// Mutable access to a parameter's value.
#[derive(Debug, PartialEq)]
pub enum DeclaredValueMut<'a> {
    /// See [`DeclaredValue::Single`].
    Single(&'a mut [f32]),
    /// See [`DeclaredValue::Double`].
    Double(&'a mut [f64]),
    /// See [`DeclaredValue::Whole`].
    Whole(&'a mut u32),
    /// See [`DeclaredValue::Switch`].
    Switch(&'a mut bool),
    /// See [`DeclaredValue::Choice`]. An index beyond the words changes nothing.
    Choice(&'a mut usize, &'static [&'static str]),
}

impl DeclaredValue<'_> {
    /// Returns the number, or the three numbers of a vector; nothing for a switch or a choice.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        let (single, double, whole): (&[f32], &[f64], _) = match *self {
            DeclaredValue::Single(numbers) => (numbers, &[], None),
            DeclaredValue::Double(numbers) => (&[], numbers, None),
            DeclaredValue::Whole(number) => (&[], &[], Some(f64::from(number))),
            DeclaredValue::Switch(_) | DeclaredValue::Choice(..) => (&[], &[], None),
        };
        single.iter().map(|&number| f64::from(number)).chain(double.iter().copied()).chain(whole)
    }
}

/// Action on each visited parameter. An error ends the visit. Closures implement it and are called statically, so that
/// the firmware's stack analysis can follow the call.
pub trait Visitor<E>: FnMut(&Declaration, DeclaredValue<'_>) -> Result<(), E> {}

impl<E, F: FnMut(&Declaration, DeclaredValue<'_>) -> Result<(), E>> Visitor<E> for F {}

/// As [`Visitor`], with mutable access.
pub trait VisitorMut<E>: FnMut(&Declaration, DeclaredValueMut<'_>) -> Result<(), E> {}

impl<E, F: FnMut(&Declaration, DeclaredValueMut<'_>) -> Result<(), E>> VisitorMut<E> for F {}

/// Checks the range of a parameter. It is not inlined and stores the error in `refused`, so that the code exists only
/// once instead of once per parameter.
#[inline(never)]
fn in_range(
    declaration: &Declaration,
    value: &DeclaredValue<'_>,
    refused: &mut Result<(), OutOfRange>,
) -> Result<(), ()> {
    *refused = value.numbers().try_for_each(|number| declaration.range.check(number));
    if refused.is_ok() { Ok(()) } else { Err(()) }
}

/// Calls `visit` with a parameter of a group. It is not inlined: a copy of the declaration for each parameter would
/// fill the flash.
///
/// # Errors
/// The error that `visit` returns.
#[inline(never)]
pub fn show_in_group<E>(
    group: &'static str,
    declaration: &Declaration,
    value: DeclaredValue<'_>,
    visit: &mut impl Visitor<E>,
) -> Result<(), E> {
    visit(&declaration.in_group(group), value)
}

/// A struct made by [`parameters!`](crate::parameters), or one such struct per axis.
pub trait Declared {
    /// Calls `visit` with every parameter, in the order of declaration.
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn visit<E>(&self, visit: &mut impl Visitor<E>) -> Result<(), E>;

    /// As [`visit`](Self::visit), to change parameters.
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn visit_mut<E>(&mut self, visit: &mut impl VisitorMut<E>) -> Result<(), E>;

    /// Checks parameters that limit each other. Each must already be in its own range.
    ///
    /// # Errors
    /// The first parameter outside the range set by another one.
    fn together(&self) -> Result<(), OutOfRange>;

    /// Checks every parameter's range, then the parameters that limit each other.
    ///
    /// # Errors
    /// The first parameter out of range.
    fn validate(&self) -> Result<(), OutOfRange> {
        let mut refused = Ok(());
        // The visit's error only ends the visit. The reason is in `refused`.
        let _ = self.visit(&mut |declaration, value| in_range(declaration, &value, &mut refused));
        refused?;
        self.together()
    }
}

impl<G: Declared> Declared for PerAxis<G> {
    fn visit<E>(&self, visit: &mut impl Visitor<E>) -> Result<(), E> {
        Axis::ALL.into_iter().try_for_each(|axis| {
            self[axis].visit(&mut |declaration: &Declaration, value: DeclaredValue<'_>| {
                show_in_group(axis.name(), declaration, value, visit)
            })
        })
    }

    fn visit_mut<E>(&mut self, visit: &mut impl VisitorMut<E>) -> Result<(), E> {
        Axis::ALL.into_iter().try_for_each(|axis| {
            self[axis].visit_mut(&mut |declaration: &Declaration, value: DeclaredValueMut<'_>| {
                visit(&declaration.in_group(axis.name()), value)
            })
        })
    }

    fn together(&self) -> Result<(), OutOfRange> {
        Axis::ALL.into_iter().try_for_each(|axis| self[axis].together())
    }
}

/// A type that a declared parameter may have.
pub trait ParameterType {
    /// Calls `visit` with the parameter, once per axis if it has several.
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn show<E>(&self, declaration: &Declaration, visit: &mut impl Visitor<E>) -> Result<(), E>;

    /// As [`show`](Self::show), with mutable access.
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn show_mut<E>(&mut self, declaration: &Declaration, visit: &mut impl VisitorMut<E>) -> Result<(), E>;
}

/// Number type of a parameter: `f32` in the controller, `f64` in the plant model.
pub trait ParameterNumber: nalgebra::Scalar + Copy + Into<f64> + Mul<Output = Self> + Div<Output = Self> {
    /// Wraps one number, or the three numbers of a vector, as a [`DeclaredValue`].
    fn value(numbers: &[Self]) -> DeclaredValue<'_>;

    /// Wraps one number, or the three numbers of a vector, as a [`DeclaredValueMut`].
    fn value_mut(numbers: &mut [Self]) -> DeclaredValueMut<'_>;
}

impl ParameterNumber for f32 {
    fn value(numbers: &[Self]) -> DeclaredValue<'_> {
        DeclaredValue::Single(numbers)
    }

    fn value_mut(numbers: &mut [Self]) -> DeclaredValueMut<'_> {
        DeclaredValueMut::Single(numbers)
    }
}

impl ParameterNumber for f64 {
    fn value(numbers: &[Self]) -> DeclaredValue<'_> {
        DeclaredValue::Double(numbers)
    }

    fn value_mut(numbers: &mut [Self]) -> DeclaredValueMut<'_> {
        DeclaredValueMut::Double(numbers)
    }
}

/// Implements [`ParameterType`] for a type, given its value and mutable value.
macro_rules! field {
    ([$($T:ident)?] $Type:ty, |$this:ident| $value:expr, $value_mut:expr) => {
        impl $(<$T: ParameterNumber>)? ParameterType for $Type {
            fn show<E>(&self, declaration: &Declaration, visit: &mut impl Visitor<E>) -> Result<(), E> {
                let $this = self;
                visit(declaration, $value)
            }

            fn show_mut<E>(&mut self, declaration: &Declaration, visit: &mut impl VisitorMut<E>) -> Result<(), E> {
                let $this = self;
                visit(declaration, $value_mut)
            }
        }
    };
}

field!([T] T, |this| T::value(slice::from_ref(this)), T::value_mut(slice::from_mut(this)));
field!([T] Vector3<T>, |this| T::value(this.as_slice()), T::value_mut(this.as_mut_slice()));
field!([] u32, |this| DeclaredValue::Whole(*this), DeclaredValueMut::Whole(this));
field!([] bool, |this| DeclaredValue::Switch(*this), DeclaredValueMut::Switch(this));

impl<T: ParameterType> ParameterType for PerAxis<T> {
    fn show<E>(&self, declaration: &Declaration, visit: &mut impl Visitor<E>) -> Result<(), E> {
        Axis::ALL.into_iter().try_for_each(|axis| self[axis].show(&declaration.in_group(axis.name()), visit))
    }

    fn show_mut<E>(&mut self, declaration: &Declaration, visit: &mut impl VisitorMut<E>) -> Result<(), E> {
        Axis::ALL.into_iter().try_for_each(|axis| self[axis].show_mut(&declaration.in_group(axis.name()), visit))
    }
}

/// An enum that may be a parameter: files write its words, ground stations and flash its numbers.
pub trait Choice: Copy + PartialEq + 'static {
    /// Every variant, in the order of the numbers.
    const ALL: &'static [Self];
    /// Word for each variant.
    const WORDS: &'static [&'static str];
    /// Number of the first variant.
    const FIRST: u8 = 0;

    /// Returns the variant's index in [`ALL`](Self::ALL).
    fn index(self) -> usize {
        // The variant is always found, since ALL has every variant.
        Self::ALL.iter().position(|one| *one == self).unwrap_or_default()
    }

    /// See [`ParameterType::show`].
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn show<E>(self, declaration: &Declaration, visit: &mut impl Visitor<E>) -> Result<(), E> {
        visit(declaration, DeclaredValue::Choice(self.index(), Self::WORDS))
    }

    /// See [`ParameterType::show_mut`].
    ///
    /// # Errors
    /// The first error that `visit` returns.
    fn show_mut<E>(&mut self, declaration: &Declaration, visit: &mut impl VisitorMut<E>) -> Result<(), E> {
        let mut index = self.index();
        let shown = visit(declaration, DeclaredValueMut::Choice(&mut index, Self::WORDS));
        *self = Self::ALL.get(index).copied().unwrap_or(*self);
        shown
    }
}

/// Returns the range of a choice's numbers.
pub const fn numbers<C: Choice>() -> RangeInclusive<f64> {
    let first = C::FIRST as f64;
    first..=first + C::ALL.len() as f64 - 1.0
}

/// Declares a struct of parameters, each with name, meaning, unit, accepted range, default and whether it is tuned.
///
/// * `#[parameter(ID, "unit", min..=max)]`, with `, tuned` at the end if the tuner may choose it: a number, a vector
///   with the same range for its three numbers, or a [`PerAxis`](crate::PerAxis) of either. With the unit `number`, a
///   `u32`.
/// * `#[switch(ID)]`: a `bool`.
/// * `#[choice(ID)]`: a [`Choice`](crate::Choice).
/// * `#[group("")]`: a declared struct whose parameters join this struct's. With a name, they form a group.
/// * A field without any of these attributes is not a parameter.
///
/// The struct gets [`Declared`](crate::Declared), `DEFAULT`, [`Default`] and one constant per parameter, named by its
/// id. The optional `together` block checks parameters that limit each other, after the ranges.
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
                $(#[choice($choice:ident)])?
                $(#[group($group:tt)])?
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
                    $($choice, "number", $crate::numbers::<$type>(), [])?
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

        impl $(<$T: $crate::ParameterNumber>)? $crate::Declared for $Group $(<$T>)? {
            fn visit<E>(&self, visit: &mut impl $crate::Visitor<E>) -> Result<(), E> {
                $(
                    $( $crate::ParameterType::show(&self.$field, &Self::$id, visit)?; )?
                    $( $crate::ParameterType::show(&self.$field, &Self::$switch, visit)?; )?
                    $( $crate::Choice::show(self.$field, &Self::$choice, visit)?; )?
                    $( $crate::parameters!(@group $group, visit, &self.$field, visit); )?
                )*
                Ok(())
            }

            fn visit_mut<E>(&mut self, visit: &mut impl $crate::VisitorMut<E>) -> Result<(), E> {
                $(
                    $( $crate::ParameterType::show_mut(&mut self.$field, &Self::$id, visit)?; )?
                    $( $crate::ParameterType::show_mut(&mut self.$field, &Self::$switch, visit)?; )?
                    $( $crate::Choice::show_mut(&mut self.$field, &Self::$choice, visit)?; )?
                    $( $crate::parameters!(@group $group, visit_mut, &mut self.$field, visit); )?
                )*
                Ok(())
            }

            fn together(&self) -> Result<(), $crate::OutOfRange> {
                // `let _` only mentions `$group`, so that this repeats for fields with a group only.
                $( $( let _ = $group; $crate::Declared::together(&self.$field)?; )? )*
                $( let $this = self; $together?; )?
                Ok(())
            }
        }
    };
    // A group without a name: its parameters join the struct's.
    (@group "", $visit:ident, $field:expr, $visitor:ident) => {
        $crate::Declared::$visit($field, $visitor)?;
    };
    (@group $group:literal, visit, $field:expr, $visitor:ident) => {
        let within = &mut |declaration: &$crate::Declaration, value: $crate::DeclaredValue<'_>| {
            $crate::show_in_group($group, declaration, value, $visitor)
        };
        $crate::Declared::visit($field, within)?;
    };
    (@group $group:literal, visit_mut, $field:expr, $visitor:ident) => {
        let within = &mut |declaration: &$crate::Declaration, value: $crate::DeclaredValueMut<'_>| {
            $visitor(&declaration.in_group($group), value)
        };
        $crate::Declared::visit_mut($field, within)?;
    };
    // A field without an attribute is not a parameter.
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
