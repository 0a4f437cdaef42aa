//! Allocation of U1..U4 to rotor forces and rotor speeds, and back.

use crate::math;
use airframe::{Inputs, OutOfRange, Parameters, Range, RotorForces, RotorSpeeds};
use nalgebra::Vector4;

/// Accepted largest force of one rotor \[N\].
pub const FORCE_MAX: Range = Range::new("rotor_force_max_n", 1e-3, 1e4);

/// The mixer of the plus frame described in [`airframe`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixer {
    /// b
    thrust_factor: f32,
    /// 1/b
    inverse_thrust_factor: f32,
    force_max: f32,
}

/// Forces within the rotors' limits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Allocation {
    /// What the rotors can give of what was asked.
    pub forces: RotorForces,
    /// True if a rotor was asked for less than nothing or more than its limit.
    pub saturated: bool,
}

impl Mixer {
    /// The mixer for a vehicle whose rotors give 0 to `force_max_n`.
    ///
    /// # Errors
    /// If a parameter or the limit is out of range.
    pub fn new(vehicle: &Parameters, force_max_n: f32) -> Result<Self, OutOfRange> {
        vehicle.validate()?;
        FORCE_MAX.check(force_max_n)?;
        let b = vehicle.thrust_factor_n_s2;
        Ok(Mixer { thrust_factor: b, inverse_thrust_factor: 1.0 / b, force_max: force_max_n })
    }

    /// Rotor forces that give `inputs`, each clipped to the rotor's limits. A NaN becomes 0.
    #[inline]
    pub fn allocate(&self, inputs: &Inputs) -> Allocation {
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = *inputs;
        let wanted = Vector4::new(
            0.25 * (thrust_n + yaw_n) - 0.5 * roll_n,
            0.25 * (thrust_n - yaw_n) - 0.5 * pitch_n,
            0.25 * (thrust_n + yaw_n) + 0.5 * roll_n,
            0.25 * (thrust_n - yaw_n) + 0.5 * pitch_n,
        );
        // max before min: f32::max drops a NaN.
        let forces = wanted.map(|force| force.max(0.0).min(self.force_max));
        Allocation { forces: RotorForces(forces), saturated: forces != wanted }
    }

    /// omega_i = sqrt(F_i / b), for forces that are not negative.
    #[inline]
    pub fn speeds(&self, forces: &RotorForces) -> RotorSpeeds {
        RotorSpeeds(forces.0.map(|force| math::sqrt(force * self.inverse_thrust_factor)))
    }

    /// F_i = b omega_i^2.
    #[inline]
    pub fn forces(&self, speeds: &RotorSpeeds) -> RotorForces {
        RotorForces(speeds.0.map(|speed| self.thrust_factor * speed * speed))
    }

    /// U1..U4 of rotor forces, (6).
    #[inline]
    pub fn inputs(forces: &RotorForces) -> Inputs {
        let [f1, f2, f3, f4] = forces.0.into();
        Inputs { roll_n: f3 - f1, pitch_n: f4 - f2, yaw_n: f1 - f2 + f3 - f4, thrust_n: f1 + f2 + f3 + f4 }
    }
}
