//! Flies a law without the flight core.

use super::pilot::FlightSoftware;
use super::sample::{Sample, estimates};
use super::world::World;
use afbc_control::{FlightController, Validated};
use core::convert::Infallible;

/// A controller that commands the rotors directly.
pub struct LawOnly<C: FlightController<N>, const N: usize> {
    controller: C,
    memory: Validated<C::Memory>,
}

impl<C: FlightController<N>, const N: usize> LawOnly<C, N> {
    /// Creates the pilot with a controller that has not flown yet.
    pub fn new(controller: C) -> Self {
        LawOnly { controller, memory: Validated::default() }
    }
}

impl<C: FlightController<N>, const N: usize> FlightSoftware for LawOnly<C, N> {
    type Error = Infallible;

    // This function is always inlined: copying a sample into and out of calls takes a fifth of the loop's time.
    #[inline(always)]
    fn step(&mut self, world: &mut World) -> Result<Sample, Infallible> {
        let view = world.look();
        let action = self.controller.step(&mut self.memory, view.state.as_ref(), &view.reference.setpoint());
        let Validated { control, .. } = &self.memory;
        Ok(view.sample(action, C::trace(control), estimates::<N>(control)))
    }
}
