//! AFBC under its [monitor](crate::monitor): when that trips, [integral backstepping](crate::integral) flies on from the
//! very inputs at hand, and AFBC takes over again on command only.

use crate::Health;
use crate::adaptive::{self, Adaptive, Estimate};
use crate::cascade::{Command, Controller, Memory as Cascade, Settings};
use crate::flight_controller::FlightController;
use crate::integral::{Integral, IntegralBackstepping};
use crate::monitor::{Bounds, Figures, Monitor, Trip};
use crate::screen::Screen;
use airframe::{OutOfRange, Parameters, PerAxis, Setpoint, State};

/// AFBC with a monitor and a law to fall back on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarded {
    adaptive: Controller<Adaptive>,
    fallback: Controller<IntegralBackstepping>,
    monitor: Monitor,
    alpha2: PerAxis<f32>,
}

/// What changes in flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    adaptive: Cascade<Estimate>,
    fallback: Option<Fallback>,
    figures: Figures,
    screen: Screen,
}

/// A flight under the law that stands in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fallback {
    trip: Trip,
    cascade: Cascade<Integral>,
    /// What AFBC must have learnt to go on from the last inputs.
    learnt: PerAxis<f32>,
}

impl Memory {
    /// What the monitor saw of AFBC, last.
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Why AFBC does not fly, if it does not.
    pub fn trip(&self) -> Option<Trip> {
        self.fallback.map(|fallback| fallback.trip)
    }
}

impl Guarded {
    /// AFBC with these gains, under a monitor with these bounds.
    ///
    /// # Errors
    /// The first parameter, setting, gain or bound out of range.
    pub fn new(
        vehicle: Parameters,
        settings: Settings,
        gains: PerAxis<adaptive::Gains>,
        bounds: Bounds,
    ) -> Result<Self, OutOfRange> {
        let fixed = PerAxis::from_fn(|axis| gains.get(axis).into());
        Ok(Guarded {
            adaptive: Controller::new(vehicle, settings, Adaptive::new(gains)?)?,
            fallback: Controller::new(vehicle, settings, IntegralBackstepping::new(&vehicle, fixed)?)?,
            monitor: Monitor::new(&vehicle, bounds, settings.dt_s)?,
            alpha2: PerAxis::from_fn(|axis| gains.get(axis).backstepping.alpha2),
        })
    }

    #[inline(always)]
    fn decide(&self, memory: &mut Memory, state: &State, setpoint: &Setpoint, health: Health) -> Command {
        match &mut memory.fallback {
            None => {
                let command = self.adaptive.decide(&mut memory.adaptive, state, setpoint, health);
                if let Some(trip) = self.monitor.watch(&mut memory.figures, &memory.adaptive.estimates, &command) {
                    let inputs = command.per_axis();
                    let resume = |axis| Integral { value: 0.0, resume: Some(*inputs.get(axis)) };
                    let cascade = memory.adaptive.handed_over(PerAxis::from_fn(resume));
                    memory.fallback = Some(Fallback { trip, cascade, learnt: PerAxis::default() });
                }
                command
            }
            Some(fallback) => self.stand_in(fallback, state, setpoint, health),
        }
    }

    fn stand_in(&self, fallback: &mut Fallback, state: &State, setpoint: &Setpoint, health: Health) -> Command {
        let mut command = self.fallback.decide(&mut fallback.cascade, state, setpoint, health);
        command.health.trip = Some(fallback.trip);
        let inputs = command.per_axis();
        fallback.learnt =
            PerAxis::from_fn(|axis| inputs.get(axis) - self.alpha2.get(axis) * command.errors.get(axis).e2);
        command
    }
}

impl FlightController for Guarded {
    type Memory = Memory;

    #[inline(always)]
    fn step(&self, memory: &mut Memory, state: &State, setpoint: &Setpoint) -> Command {
        let mut health = Health::default();
        match memory.screen.pass(state, setpoint, &mut health) {
            Some((state, setpoint)) => self.decide(memory, &state, &setpoint, health),
            None => Command { health, ..Command::default() },
        }
    }

    #[inline(always)]
    fn step_screened(&self, memory: &mut Memory, state: &State, setpoint: &Setpoint) -> Command {
        self.decide(memory, state, setpoint, Health::default())
    }

    fn engage(&self, memory: &mut Memory) {
        if let Some(Fallback { cascade, learnt, .. }) = memory.fallback.take() {
            memory.adaptive = cascade.handed_over(PerAxis::from_fn(|axis| Estimate::of(*learnt.get(axis))));
            memory.figures = Figures::default();
        }
    }

    fn learnt(memory: &Memory) -> PerAxis<Estimate> {
        memory.adaptive.estimates
    }
}
