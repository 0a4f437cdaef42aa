//! Flies a scenario under one contender.

use super::in_flight_core::InFlightCore;
use super::law_only::LawOnly;
use super::lockstep::{Lost, lockstep};
use super::sample::Sample;
use super::world::World;
use afbc_control::FlightController;
use afbc_scenario::contender::{Contender, decimal};
use afbc_scenario::{AnyController, Scenario};
use afbc_types::{OutOfRange, with_rotors};
use core::ops::ControlFlow;

/// Flies `scenario` under one contender and passes every step from t = 0 to the end to `observe`. Returns when and why
/// the vehicle was lost, if it was.
///
/// # Errors
/// Returns the first parameter, gain or setting that is out of range; nothing is flown then.
pub fn fly(
    scenario: &Scenario,
    contender: &Contender,
    mut observe: impl FnMut(&Sample),
) -> Result<Option<Lost>, OutOfRange> {
    fly_until(scenario, contender, |sample| {
        observe(sample);
        ControlFlow::Continue(())
    })
}

/// Flies like [`fly`], until `observe` ends the flight.
///
/// # Errors
/// The same as for [`fly`].
pub fn fly_until(
    scenario: &Scenario,
    contender: &Contender,
    mut observe: impl FnMut(&Sample) -> ControlFlow<()>,
) -> Result<Option<Lost>, OutOfRange> {
    FlightStart::of(scenario).fly(contender, &mut observe)
}

/// The start of a scenario, from which every contender flies. The vehicle's own estimate settles only once for all
/// contenders.
pub struct FlightStart<'a> {
    scenario: &'a Scenario,
    /// The world at the start, once it has been made.
    world: Option<World>,
}

impl<'a> FlightStart<'a> {
    /// Returns the start of `scenario`.
    pub fn of(scenario: &'a Scenario) -> Self {
        FlightStart { scenario, world: None }
    }

    /// Flies under one contender, like [`fly_until`].
    ///
    /// # Errors
    /// The same as for [`fly`].
    pub fn fly(
        &mut self,
        contender: &Contender,
        observe: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Result<Option<Lost>, OutOfRange> {
        let scenario = self.scenario;
        with_rotors!(scenario.rotors.len(), N => {
            let controller = contender.controller::<N>(&scenario.vehicle, &scenario.rotors)?;
            self.fly_under(controller, observe)
        })
    }

    fn fly_under<const N: usize>(
        &mut self,
        controller: AnyController<N>,
        observe: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Result<Option<Lost>, OutOfRange> {
        let (scenario, mut world) = (self.scenario, self.world(decimal(controller.dt_s()))?);
        let Ok(end) = if scenario.flight_core {
            let mut aboard = InFlightCore::new(scenario.vehicle.to_f32(), &scenario.response(), controller)?;
            lockstep(&mut world, &mut aboard, scenario.duration_s, observe)
        } else {
            lockstep(&mut world, &mut LawOnly::new(controller), scenario.duration_s, observe)
        };
        Ok(end.lost)
    }

    /// Returns the world at the start, for steps of `dt_s`.
    fn world(&mut self, dt_s: f64) -> Result<World, OutOfRange> {
        // Plant, sensors and estimator are made for one step size: a contender with another step size needs another
        // world.
        let world = match self.world.take().filter(|world| world.dt_s() == dt_s) {
            Some(world) => world,
            None => World::new(self.scenario, dt_s)?,
        };
        // Return a copy: the flight moves the world, and the next contender needs the start.
        Ok(self.world.insert(world).clone())
    }
}
