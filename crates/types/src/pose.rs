//! Measured position and attitude, and their standard deviations.

use crate::attitude::is_rotation;
use crate::motion::{POSITION_MAX_M, State, within};
use nalgebra::{Quaternion, Vector3};

/// Pose measured by an external tracker. Frames as in the crate's [conventions](crate).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// Position, earth frame \[m\].
    pub position_m: Vector3<f32>,
    /// Quaternion w, x, y, z from body to earth coordinates, of either sign, with a squared norm within 0.9 to 1.1.
    pub attitude: [f32; 4],
    /// Standard deviations of position and attitude.
    pub sigmas: PoseSigmas,
}

impl Default for Pose {
    /// Returns the level pose at the origin.
    fn default() -> Self {
        Pose { position_m: Vector3::zeros(), attitude: [1.0, 0.0, 0.0, 0.0], sigmas: PoseSigmas::UNKNOWN }
    }
}

impl Pose {
    /// Returns the pose of `state`.
    pub fn of(state: &State, sigmas: PoseSigmas) -> Self {
        let q = state.quaternion().coords;
        Pose { position_m: state.position_m, attitude: [q.w, q.x, q.y, q.z], sigmas }
    }

    /// True if every value is finite and possible: at most 1e5 m, a rotation, positive standard deviations.
    pub fn is_plausible(&self) -> bool {
        let Pose { position_m, attitude: [w, x, y, z], sigmas: PoseSigmas { position_m: position, attitude_rad } } =
            *self;
        let is_sigma = |sigma: f32| sigma > 0.0 && sigma < f32::INFINITY;
        within([(&position_m, POSITION_MAX_M)])
            && is_rotation(&Quaternion::new(w, x, y, z))
            && position.is_none_or(is_sigma)
            && attitude_rad.is_none_or(is_sigma)
    }
}

/// Standard deviations of a [`Pose`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PoseSigmas {
    /// Standard deviation of each coordinate of the position \[m\]; `None` if unknown.
    pub position_m: Option<f32>,
    /// Standard deviation of the attitude about each axis \[rad\]; `None` if unknown.
    pub attitude_rad: Option<f32>,
}

impl PoseSigmas {
    /// Unknown standard deviations.
    pub const UNKNOWN: Self = PoseSigmas { position_m: None, attitude_rad: None };

    /// Makes standard deviations from the variances along and about the three axes \[m2, rad2\]: the square root of the
    /// largest one. The result is unknown if all three variances are zero, or if one is negative or not finite.
    pub fn from_variances(position: [f32; 3], attitude: [f32; 3]) -> Self {
        PoseSigmas { position_m: largest_sigma(position), attitude_rad: largest_sigma(attitude) }
    }
}

fn largest_sigma(variances: [f32; 3]) -> Option<f32> {
    let valid = variances.iter().all(|variance| (0.0..f32::INFINITY).contains(variance));
    let largest = variances.into_iter().fold(0.0, f32::max);
    (valid && largest > 0.0).then(|| libm::sqrtf(largest))
}
