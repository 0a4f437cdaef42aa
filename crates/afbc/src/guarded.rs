//! AFBC under its [monitor](crate::monitor): when that trips, [integral backstepping](crate::integral) flies on from the
//! very inputs at hand, and AFBC takes over again on command only.

use crate::adaptive::{self, Adaptive, Estimate};
use crate::cascade::{Cascade, Command, Controller, Settings};
use crate::flight_controller::FlightController;
use crate::integral::{Integral, IntegralBackstepping};
use crate::monitor::{Bounds, Figures, Monitor, Trip};
use airframe::{OutOfRange, Parameters, PerAxis, Setpoint, State};

/// AFBC with a monitor and a law to fall back on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarded {
    adaptive: Controller<Adaptive>,
    fallback: Controller<IntegralBackstepping>,
    monitor: Monitor,
    alpha2: PerAxis<f32>,
}

/// Who flies.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pilot {
    Afbc(Cascade<Estimate>),
    StandIn(StandIn),
}

/// A flight under the law that stands in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StandIn {
    trip: Trip,
    cascade: Cascade<Integral>,
    /// What AFBC would have to know to go on from the last inputs.
    learnt: PerAxis<f32>,
}

/// What changes in flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    pilot: Pilot,
    figures: Figures,
}

impl Default for Memory {
    fn default() -> Self {
        Memory { pilot: Pilot::Afbc(Cascade::default()), figures: Figures::default() }
    }
}

impl Memory {
    /// What the monitor saw of AFBC, last.
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Why AFBC does not fly, if it does not.
    pub fn trip(&self) -> Option<Trip> {
        match &self.pilot {
            Pilot::Afbc(_) => None,
            Pilot::StandIn(stand_in) => Some(stand_in.trip),
        }
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

    /// One step of the law that stands in.
    #[cold]
    #[inline(never)]
    fn stand_in(&self, memory: &mut StandIn, state: &State, setpoint: &Setpoint, fresh: bool) -> Command {
        let mut command = self.fallback.cascade(&mut memory.cascade, state, setpoint, fresh);
        command.health.trip = Some(memory.trip);
        let inputs = command.per_axis();
        memory.learnt = PerAxis::from_fn(|axis| inputs.get(axis) - self.alpha2.get(axis) * command.errors.get(axis).e2);
        command
    }
}

/// The law that stands in goes on from `inputs`, in the next step.
#[cold]
#[inline(never)]
fn fall_back(trip: Trip, cascade: &Cascade<Estimate>, inputs: PerAxis<f32>) -> Pilot {
    let resume = |axis| Integral { value: 0.0, resume: Some(*inputs.get(axis)) };
    let cascade = cascade.handed_over(PerAxis::from_fn(resume));
    Pilot::StandIn(StandIn { trip, cascade, learnt: PerAxis::default() })
}

impl FlightController for Guarded {
    type Memory = Memory;

    #[inline(always)]
    fn decide(&self, memory: &mut Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Command {
        let Memory { pilot, figures } = memory;
        match pilot {
            Pilot::Afbc(cascade) => {
                let command = self.adaptive.cascade(cascade, state, setpoint, fresh);
                let inputs = command.per_axis();
                let saturated = command.health.saturated;
                if let Some(trip) = self.monitor.watch(figures, cascade, &inputs, saturated) {
                    *pilot = fall_back(trip, cascade, inputs);
                }
                command
            }
            // Field by field: a whole command straight from the call would have to be put together in memory on the other
            // path too.
            Pilot::StandIn(stand_in) => {
                let Command { speeds, forces, inputs, virtual_m_s2, desired_rad, filtered, errors, health } =
                    self.stand_in(stand_in, state, setpoint, fresh);
                Command { speeds, forces, inputs, virtual_m_s2, desired_rad, filtered, errors, health }
            }
        }
    }

    fn engage(&self, memory: &mut Memory) {
        if let Pilot::StandIn(StandIn { cascade, learnt, .. }) = &memory.pilot {
            let estimates = PerAxis::from_fn(|axis| Estimate::of(*learnt.get(axis)));
            *memory = Memory { pilot: Pilot::Afbc(cascade.handed_over(estimates)), figures: Figures::default() };
        }
    }

    /// Zero while the other law flies.
    fn learnt(memory: &Memory) -> PerAxis<Estimate> {
        match &memory.pilot {
            Pilot::Afbc(cascade) => cascade.estimates,
            Pilot::StandIn(_) => PerAxis::default(),
        }
    }
}
