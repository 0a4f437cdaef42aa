//! Interface between the simulation loop and whatever flies the vehicle.

use super::sample::Sample;
use super::world::World;

/// Commands the rotors once per step.
pub trait Pilot {
    /// Error of the pilot.
    type Error;

    /// Runs one step: reads the world's sensors, and decides. A pilot that has to be started first may read them
    /// repeatedly, while the vehicle is held.
    ///
    /// # Errors
    /// If the pilot has failed, or does not start.
    fn step(&mut self, world: &mut World) -> Result<Sample, Self::Error>;

    /// True if a failsafe brings the vehicle down.
    fn descends(&self) -> bool {
        false
    }

    /// Returns why it has given up, if it has.
    fn gave_up(&self) -> Option<&'static str> {
        None
    }
}
