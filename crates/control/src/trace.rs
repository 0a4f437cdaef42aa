//! Internal signals of a control step, for logs and figures.

use crate::command_filter::Filtered;
use afbc_types::{Inputs, PerAxis};

/// Internal signals of the last step; all zero before the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Trace {
    /// Demanded U1..U4, before rotor limits.
    pub inputs: Inputs,
    /// Virtual controls u5, u6: demanded accelerations along x and y \[m/s2\].
    pub virtual_m_s2: [f32; 2],
    /// Desired roll and pitch \[rad\].
    pub desired_rad: [f32; 2],
    /// Desired roll and pitch after the command filter: the reference of the attitude loops.
    pub filtered: [Filtered; 2],
    /// Tracking errors of each subsystem.
    pub errors: PerAxis<Errors>,
}

/// Tracking errors of one subsystem, in m or rad, and their rates per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Errors {
    /// Tracking error e_1 of (9).
    pub e1: f32,
    /// Its derivative, d e_1/dt = d x_1d/dt - x_2.
    pub e1_dot: f32,
    /// Error e_2 of (12); 0 for laws without it.
    pub e2: f32,
}
