//! Flight of a scenario under one contender.

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

/// Flies `scenario` under one contender, and passes every step from t = 0 to the end to `observe`; returns when and why
/// the vehicle was lost, if it was.
///
/// # Errors
/// The first parameter, gain or setting out of range; nothing has been flown then.
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

/// Flies as [`fly`] does, until `observe` ends the flight.
///
/// # Errors
/// As there.
pub fn fly_until(
    scenario: &Scenario,
    contender: &Contender,
    mut observe: impl FnMut(&Sample) -> ControlFlow<()>,
) -> Result<Option<Lost>, OutOfRange> {
    FlightStart::of(scenario).fly(contender, &mut observe)
}

/// The start of a scenario, which every contender flies from. A vehicle's own estimate settles before it, once for all.
pub struct FlightStart<'a> {
    scenario: &'a Scenario,
    /// The world there, once it has been made.
    world: Option<World>,
}

impl<'a> FlightStart<'a> {
    /// The one of `scenario`.
    pub fn of(scenario: &'a Scenario) -> Self {
        FlightStart { scenario, world: None }
    }

    /// Flies under one contender, as [`fly_until`] does.
    ///
    /// # Errors
    /// As there.
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

    /// Returns the world for steps of `dt_s`.
    fn world(&mut self, dt_s: f64) -> Result<World, OutOfRange> {
        // Plant, sensors and estimator are made for one step: a contender with another one needs another world.
        let world = match self.world.take().filter(|world| world.dt_s() == dt_s) {
            Some(world) => world,
            None => World::new(self.scenario, dt_s)?,
        };
        // A copy, since the flight moves it and the next contender needs the start.
        Ok(self.world.insert(world).clone())
    }
}
