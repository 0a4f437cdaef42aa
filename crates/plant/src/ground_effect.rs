//! More thrust near the ground.

use afbc_types::OutOfRange;

/// Thrust near the ground over thrust far from it, at the same rotor speed: 1 / (1 - (R/4z)^2).
///
/// I. C. Cheeseman, W. E. Bennett 1955, *The effect of the ground on a helicopter rotor in forward flight*, ARC R&M 3021,
/// in hover: one rotor of radius R at height z, its source and its image. It holds from z = R/2 up; below, the ratio
/// stays at its value there, 4/3. The level rotor plane stands for all rotors, and drag moments are left alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundEffect {
    /// R \[m\].
    pub rotor_radius_m: f64,
    /// Rotors above the centre of mass \[m\].
    pub rotor_height_m: f64,
}

/// Accepted range of each setting.
#[expect(missing_docs, reason = "named after the field that each bounds")]
pub mod limits {
    use afbc_types::Range;
    pub const ROTOR_RADIUS: Range = Range::new("rotor_radius_m", 0.001, 10.0);
    pub const ROTOR_HEIGHT: Range = Range::new("rotor_height_m", -10.0, 10.0);
}

impl GroundEffect {
    /// A guess for the paper's vehicle: propellers of 10 inches.
    pub const PAPER: Self = GroundEffect { rotor_radius_m: 0.127, rotor_height_m: 0.02 };

    /// Checks every setting.
    ///
    /// # Errors
    /// The first one out of range, by name.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        limits::ROTOR_RADIUS.check(self.rotor_radius_m)?;
        limits::ROTOR_HEIGHT.check(self.rotor_height_m)
    }

    /// The ratio for a vehicle whose centre of mass is at `height_m`.
    #[inline]
    pub fn thrust_ratio(&self, height_m: f64) -> f64 {
        let z = (height_m + self.rotor_height_m).max(0.5 * self.rotor_radius_m);
        let q = self.rotor_radius_m / (4.0 * z);
        1.0 / (1.0 - q * q)
    }
}
