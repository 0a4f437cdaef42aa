//! Interface between the simulation loop and the pilot, which flies the vehicle.

use super::sample::Sample;
use super::world::World;

/// Commands the rotors once per step.
pub trait FlightSoftware {
    /// Error of a pilot that cannot go on.
    type Error;

    /// Runs one step: reads the world's sensors and commands the rotors. A pilot that must start first may read the
    /// sensors repeatedly while the vehicle is held.
    ///
    /// # Errors
    /// Returns an error if the pilot has failed or does not start.
    fn step(&mut self, world: &mut World) -> Result<Sample, Self::Error>;

    /// Returns true if a failsafe brings the vehicle down.
    fn descends(&self) -> bool {
        false
    }

    /// Returns why the pilot has given up; none if it has not.
    fn gave_up(&self) -> Option<&'static str> {
        None
    }
}
