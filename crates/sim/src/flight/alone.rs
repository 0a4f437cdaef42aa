//! A law alone, as it is compared with others.

use super::pilot::Pilot;
use super::sample::Sample;
use super::world::World;
use afbc_control::{FlightController, Screened};
use core::convert::Infallible;

/// A controller that turns the rotors itself.
pub struct Alone<C: FlightController> {
    controller: C,
    memory: Screened<C::Memory>,
}

impl<C: FlightController> Alone<C> {
    /// `controller`, which has not flown yet.
    pub fn new(controller: C) -> Self {
        Alone { controller, memory: Screened::default() }
    }
}

impl<C: FlightController> Pilot for Alone<C> {
    type Error = Infallible;

    // Always: copying a sample in and out of calls costs a fifth of the loop.
    #[inline(always)]
    fn step(&mut self, world: &mut World) -> Result<Sample, Infallible> {
        let view = world.look();
        let action = self.controller.step(&mut self.memory, view.state.as_ref(), &view.reference.setpoint());
        let Screened { control, .. } = &self.memory;
        Ok(view.sample(action, C::trace(control), C::learnt(control)))
    }
}
