//! Ground effect: additional thrust near the ground.

use afbc_types::parameters;

parameters! {
    /// Thrust near the ground divided by thrust far from the ground, at the same rotor speed: 1 / (1 - (R/4z)^2).
    ///
    /// I. C. Cheeseman, W. E. Bennett 1955, *The effect of the ground on a helicopter rotor in forward flight*, ARC R&M
    /// 3021, in hover: one rotor of radius R at height z, its source and its image. Valid from z = R/2 up; below, the
    /// ratio stays at its value there, 4/3. The level rotor plane represents all rotors; drag moments are not changed.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct GroundEffect {
        /// R: radius of a rotor.
        #[parameter(ROT_RADIUS, "m", 0.001..=10.0)]
        pub rotor_radius_m: f64 = 0.127,
        /// Height of the rotors above the centre of mass.
        #[parameter(ROT_HEIGHT, "m", -10.0..=10.0)]
        pub rotor_height_m: f64 = 0.02,
    }
}

impl GroundEffect {
    /// Estimated for the paper's vehicle: propellers of 10 inches.
    pub const PAPER: Self = Self::DEFAULT;

    /// Returns the thrust ratio for a vehicle with its centre of mass at `height_m`.
    #[inline]
    pub fn thrust_ratio(&self, height_m: f64) -> f64 {
        let z = (height_m + self.rotor_height_m).max(0.5 * self.rotor_radius_m);
        let q = self.rotor_radius_m / (4.0 * z);
        1.0 / (1.0 - q * q)
    }
}
