//! What flies a vehicle, seen from the loop.

use super::sample::Sample;
use super::world::World;

/// Whoever decides, once per step, what the rotors shall do.
pub trait Pilot {
    /// Why it could not.
    type Error;

    /// One step: a look at the world, and what follows from it. A pilot that has to be started first looks as often as
    /// that takes; the vehicle is held where it is meanwhile.
    ///
    /// # Errors
    /// If the pilot is gone, or does not start.
    fn step(&mut self, world: &mut World) -> Result<Sample, Self::Error>;

    /// Why it has given the vehicle up, if it has.
    fn gave_up(&self) -> Option<&'static str> {
        None
    }
}
