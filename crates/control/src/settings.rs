//! What every controller has to know besides its vehicle and its gains.

use crate::mixer::FORCE_MAX;
use afbc_types::{OutOfRange, Range};

/// Accepted time between steps \[s\].
pub const DT: Range = Range::new("dt_s", 1e-4, 0.02);

/// What every controller has to know besides its vehicle and its gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Time between steps \[s\].
    pub dt_s: f32,
    /// Largest force of one rotor \[N\].
    pub rotor_force_max_n: f32,
}

impl Settings {
    /// Checks both.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        DT.check(self.dt_s)?;
        FORCE_MAX.check(self.rotor_force_max_n)
    }
}
