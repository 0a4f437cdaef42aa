//! Why a step decided as it did, for logs and figures.

use crate::command_filter::Filtered;
use afbc_types::{Inputs, PerAxis};
use nalgebra::Matrix3;

/// What the last step wanted, and why; all zero before the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Trace {
    /// U1..U4 as the law wants them, before rotor limits.
    pub inputs: Inputs,
    /// u5, u6: wanted acceleration along x and y \[m/s2\].
    pub virtual_m_s2: [f32; 2],
    /// Desired roll and pitch \[rad\].
    pub desired_rad: [f32; 2],
    /// Desired roll and pitch behind the command filter: what roll and pitch track.
    pub filtered: [Filtered; 2],
    /// Errors of each subsystem.
    pub errors: PerAxis<Errors>,
}

/// Tracking errors of one subsystem, in m or rad, and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Errors {
    /// e_1 (9)
    pub e1: f32,
    /// d e_1/dt = d x_1d/dt - x_2
    pub e1_dot: f32,
    /// e_2 (12); 0 for a law that has none.
    pub e2: f32,
}

/// What one subsystem has learnt. Starts at zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    /// Theta_hat, one consequent parameter per rule, a row for each Gaussian of the first input, a column for each of the
    /// second; in the subsystem's input.
    pub theta: Matrix3<f32>,
    /// delta_hat: estimated bound of approximation error and disturbance; in the subsystem's input.
    pub delta: f32,
}
