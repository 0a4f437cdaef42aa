//! The six second-order subsystems of (7).

use core::convert::Infallible;
use core::ops::{Index, IndexMut};

/// One of the six subsystems, in the paper's order i = 1..6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Axis {
    /// i = 1: phi, driven by U1.
    Roll,
    /// i = 2: theta, driven by U2.
    Pitch,
    /// i = 3: psi, driven by U3.
    Yaw,
    /// i = 4: height z, driven by U4.
    Z,
    /// i = 5: x, driven by the virtual control u5.
    X,
    /// i = 6: y, driven by the virtual control u6.
    Y,
}

impl Axis {
    /// All six subsystems, in the paper's order.
    pub const ALL: [Axis; 6] = [Axis::Roll, Axis::Pitch, Axis::Yaw, Axis::Z, Axis::X, Axis::Y];

    /// Returns the name in lower case, as in scenario files and logs.
    pub const fn name(self) -> &'static str {
        match self {
            Axis::Roll => "roll",
            Axis::Pitch => "pitch",
            Axis::Yaw => "yaw",
            Axis::Z => "z",
            Axis::X => "x",
            Axis::Y => "y",
        }
    }

    /// Returns the next axis in the paper's order; the first one after the last.
    #[must_use]
    pub const fn next(self) -> Self {
        match self {
            Axis::Roll => Axis::Pitch,
            Axis::Pitch => Axis::Yaw,
            Axis::Yaw => Axis::Z,
            Axis::Z => Axis::X,
            Axis::X => Axis::Y,
            Axis::Y => Axis::Roll,
        }
    }
}

/// One `T` for each subsystem, in the paper's order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "each field is the axis it is named after")]
pub struct PerAxis<T> {
    pub roll: T,
    pub pitch: T,
    pub yaw: T,
    pub z: T,
    pub x: T,
    pub y: T,
}

impl<T> PerAxis<T> {
    /// Makes a value for each axis by calling `make`.
    pub fn from_fn(mut make: impl FnMut(Axis) -> T) -> Self {
        let Ok(made) = Self::try_from_fn(|axis| Ok::<T, Infallible>(make(axis)));
        made
    }

    /// Makes a value for each axis by calling `make`, until one call fails.
    ///
    /// # Errors
    /// The first error of `make`.
    pub fn try_from_fn<E>(mut make: impl FnMut(Axis) -> Result<T, E>) -> Result<Self, E> {
        Ok(PerAxis {
            roll: make(Axis::Roll)?,
            pitch: make(Axis::Pitch)?,
            yaw: make(Axis::Yaw)?,
            z: make(Axis::Z)?,
            x: make(Axis::X)?,
            y: make(Axis::Y)?,
        })
    }

    /// Applies `change` to each axis' value, and returns the results.
    #[must_use]
    pub fn map<U>(&self, mut change: impl FnMut(&T) -> U) -> PerAxis<U> {
        PerAxis::from_fn(|axis| change(&self[axis]))
    }
}

impl<T> Index<Axis> for PerAxis<T> {
    type Output = T;

    fn index(&self, axis: Axis) -> &T {
        match axis {
            Axis::Roll => &self.roll,
            Axis::Pitch => &self.pitch,
            Axis::Yaw => &self.yaw,
            Axis::Z => &self.z,
            Axis::X => &self.x,
            Axis::Y => &self.y,
        }
    }
}

impl<T> IndexMut<Axis> for PerAxis<T> {
    fn index_mut(&mut self, axis: Axis) -> &mut T {
        match axis {
            Axis::Roll => &mut self.roll,
            Axis::Pitch => &mut self.pitch,
            Axis::Yaw => &mut self.yaw,
            Axis::Z => &mut self.z,
            Axis::X => &mut self.x,
            Axis::Y => &mut self.y,
        }
    }
}
