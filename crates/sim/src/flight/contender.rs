//! A scenario under one contender.

use super::aboard::Aboard;
use super::alone::Alone;
use super::lockstep::{Lost, lockstep};
use super::sample::Sample;
use super::world::World;
use crate::contender::{Build, Contender, Law, Monitored, decimal};
use crate::scenario::Scenario;
use afbc::Settings;
use afbc_control::FlightController;
use afbc_types::OutOfRange;
use core::ops::ControlFlow;

/// Flies `scenario` under one contender, showing every step from t = 0 to the end; tells when the vehicle was lost, if it
/// was.
///
/// # Errors
/// The first parameter, gain or setting out of range; nothing has been flown then.
pub fn fly(
    scenario: &Scenario,
    contender: &Contender,
    observe: impl FnMut(&Sample),
) -> Result<Option<Lost>, OutOfRange> {
    let settings = &contender.settings;
    match &contender.law {
        Law::Afbc(gains) => run(scenario, settings, gains, observe),
        Law::Guarded(gains) => run(scenario, settings, &Monitored(gains), observe),
        Law::Backstepping(gains) => run(scenario, settings, gains, observe),
        Law::Pid(gains) => run(scenario, settings, gains, observe),
        Law::Geometric(gains) => run(scenario, settings, gains, observe),
        Law::Indi(gains) => run(scenario, settings, gains, observe),
    }
}

fn run(
    scenario: &Scenario,
    settings: &Settings,
    gains: &impl Build,
    mut observe: impl FnMut(&Sample),
) -> Result<Option<Lost>, OutOfRange> {
    let vehicle = scenario.vehicle.to_f32();
    let controller = gains.controller(vehicle, *settings)?;
    let mut world = World::new(scenario, decimal(controller.dt_s()))?;
    let observe = |sample: &Sample| {
        observe(sample);
        ControlFlow::Continue(())
    };
    let Ok(end) = if scenario.flight_core {
        lockstep(&mut world, &mut Aboard::new(vehicle, controller)?, scenario.duration_s, observe)
    } else {
        lockstep(&mut world, &mut Alone::new(controller), scenario.duration_s, observe)
    };
    Ok(end.lost)
}
