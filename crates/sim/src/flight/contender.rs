//! Flight of a scenario under one contender.

use super::in_flight_core::InFlightCore;
use super::law_only::LawOnly;
use super::lockstep::{Lost, lockstep};
use super::sample::Sample;
use super::world::World;
use afbc_control::FlightController;
use afbc_scenario::Scenario;
use afbc_scenario::contender::{Contender, Task, decimal};
use afbc_types::OutOfRange;
use core::ops::ControlFlow;

/// Flies `scenario` under one contender, and passes every step from t = 0 to the end to `observe`; returns when and why
/// the vehicle was lost, if it was.
///
/// # Errors
/// The first parameter, gain or setting out of range; nothing has been flown then.
pub fn fly(
    scenario: &Scenario,
    contender: &Contender,
    observe: impl FnMut(&Sample),
) -> Result<Option<Lost>, OutOfRange> {
    contender.build(&scenario.vehicle, &scenario.rotors, Fly { scenario, observe })
}

struct Fly<'a, O> {
    scenario: &'a Scenario,
    observe: O,
}

impl<O: FnMut(&Sample)> Task for Fly<'_, O> {
    type Output = Option<Lost>;

    fn with<C: FlightController<N>, const N: usize>(self, controller: C) -> Result<Option<Lost>, OutOfRange> {
        let Fly { scenario, mut observe } = self;
        let mut world = World::new(scenario, decimal(controller.dt_s()))?;
        let observe = |sample: &Sample| {
            observe(sample);
            ControlFlow::Continue(())
        };
        let Ok(end) = if scenario.flight_core {
            let mut aboard = InFlightCore::new(scenario.vehicle.to_f32(), &scenario.response(), controller)?;
            lockstep(&mut world, &mut aboard, scenario.duration_s, observe)
        } else {
            lockstep(&mut world, &mut LawOnly::new(controller), scenario.duration_s, observe)
        };
        Ok(end.lost)
    }
}
