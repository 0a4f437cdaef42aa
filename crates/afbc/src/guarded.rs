//! AFBC under its [monitor](crate::monitor): when that trips, [integral backstepping](crate::integral) flies on from the
//! very inputs at hand, and AFBC takes over again on command only.

use crate::adaptive::{self, Adaptive, Estimate};
use crate::backstepping::Errors;
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

/// A flight under the law that stands in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StandIn {
    cascade: Cascade<Integral>,
    /// Its last command. Kept here: coming back from a call, it would have a command put together in memory on AFBC's
    /// path, too.
    command: Command,
}

/// How AFBC's flight ended.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tripped {
    trip: Trip,
    /// AFBC's last inputs.
    inputs: PerAxis<f32>,
}

/// What changes in flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    afbc: Cascade<Estimate>,
    figures: Figures,
    tripped: Option<Tripped>,
    /// From the first step after AFBC's last on.
    stand_in: Option<StandIn>,
}

impl Memory {
    /// What the monitor saw of AFBC, last.
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Why AFBC does not fly, if it does not.
    pub fn trip(&self) -> Option<Trip> {
        self.tripped.map(|tripped| tripped.trip)
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

    /// One step of the law that stands in, in AFBC's place. The first one takes over: the step that trips has no time to.
    #[cold]
    #[inline(never)]
    fn stand_in<'a>(
        &self,
        memory: &'a mut Option<StandIn>,
        (afbc, tripped): (&Cascade<Estimate>, &Tripped),
        (state, setpoint): (&State, &Setpoint),
        fresh: bool,
    ) -> &'a Command {
        let StandIn { cascade, command } = memory.get_or_insert_with(|| {
            let resume = |axis| Integral { value: 0.0, resume: Some(*tripped.inputs.get(axis)) };
            StandIn { cascade: afbc.handed_over(PerAxis::from_fn(resume)), command: Command::default() }
        });
        *command = self.fallback.cascade(cascade, state, setpoint, fresh);
        command.health.trip = Some(tripped.trip);
        command
    }

    /// What AFBC must have learnt to want `inputs` for these errors.
    fn learnt_from(&self, inputs: &PerAxis<f32>, errors: &PerAxis<Errors>) -> PerAxis<Estimate> {
        PerAxis::from_fn(|axis| Estimate::of(inputs.get(axis) - self.alpha2.get(axis) * errors.get(axis).e2))
    }
}

impl FlightController for Guarded {
    type Memory = Memory;

    #[inline(always)]
    fn decide(&self, memory: &mut Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Command {
        let Memory { afbc, figures, tripped, stand_in } = memory;
        if let Some(tripped) = tripped {
            return *self.stand_in(stand_in, (afbc, tripped), (state, setpoint), fresh);
        }
        let command = self.adaptive.cascade(afbc, state, setpoint, fresh);
        // On the ground a law may ask for less than nothing, for as long as it likes.
        if !self.adaptive.stands(afbc) {
            let inputs = command.per_axis();
            if let Some(trip) = self.monitor.watch(figures, afbc, &inputs, command.health.saturated) {
                *tripped = Some(Tripped { trip, inputs });
            }
        }
        command
    }

    fn engage(&self, memory: &mut Memory) {
        let afbc = match memory {
            Memory { stand_in: Some(StandIn { cascade, command }), .. } => {
                cascade.handed_over(self.learnt_from(&command.per_axis(), &command.errors))
            }
            Memory { tripped: Some(Tripped { inputs, .. }), afbc, .. } => {
                afbc.handed_over(self.learnt_from(inputs, &afbc.errors))
            }
            _ => return,
        };
        *memory = Memory { afbc, ..Memory::default() };
    }

    /// Zero while the other law flies.
    fn learnt(memory: &Memory) -> PerAxis<Estimate> {
        if memory.tripped.is_some() { PerAxis::default() } else { memory.afbc.estimates }
    }
}
