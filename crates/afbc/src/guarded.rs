//! AFBC under its [monitor](crate::monitor): when that trips, [integral backstepping](crate::integral) flies on from the
//! very inputs at hand, and AFBC takes over again on command only.

use crate::adaptive::{self, Adaptive, Estimate};
use crate::cascade::{Cascade, Command, Controller, Settings};
use crate::flight_controller::FlightController;
use crate::integral::{Integral, IntegralBackstepping};
use crate::monitor::{Bounds, Figures, Monitor, Trip};
use airframe::{Axis, OutOfRange, Parameters, PerAxis, Setpoint, State};
use nalgebra::Vector3;

/// AFBC with a monitor and a law to fall back on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarded {
    adaptive: Controller<Adaptive>,
    fallback: Controller<IntegralBackstepping>,
    monitor: Monitor,
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
    /// The last step: the inputs that AFBC would go on from, and the attitude with its rates.
    inputs: PerAxis<f32>,
    attitude_rad: Vector3<f32>,
    rates_rad_s: Vector3<f32>,
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
        })
    }

    /// One step of the law that stands in.
    #[cold]
    #[inline(never)]
    fn stand_in(&self, memory: &mut StandIn, state: &State, setpoint: &Setpoint, fresh: bool) -> Command {
        let mut command = self.fallback.cascade(&mut memory.cascade, state, setpoint, fresh);
        command.health.trip = Some(memory.trip);
        memory.inputs = command.per_axis();
        (memory.attitude_rad, memory.rates_rad_s) = (state.attitude_rad, state.rates_rad_s);
        command
    }

    /// The law that stands in goes on from `inputs`, in the next step.
    #[cold]
    #[inline(never)]
    fn fall_back(&self, trip: Trip, cascade: &Cascade<Estimate>, inputs: PerAxis<f32>, state: &State) -> Pilot {
        let hover_thrust_n = Some(self.adaptive.hover_thrust_n(cascade));
        let resume = |axis| Integral { value: 0.0, resume: Some(*inputs.get(axis)), hover_thrust_n };
        let State { attitude_rad, rates_rad_s, .. } = *state;
        let cascade = cascade.handed_over(PerAxis::from_fn(resume));
        Pilot::StandIn(StandIn { trip, cascade, inputs, attitude_rad, rates_rad_s })
    }

    /// AFBC goes on from the last inputs.
    fn resumed(&self, stand_in: &StandIn) -> Cascade<Estimate> {
        let StandIn { cascade, inputs, attitude_rad: eta, rates_rad_s: eta_dot, .. } = stand_in;
        let estimate = |axis| {
            let x = match axis {
                Axis::Roll => [eta.x, eta_dot.x],
                Axis::Pitch => [eta.y, eta_dot.y],
                _ => [eta.z, eta_dot.z],
            };
            let norm_max = self.monitor.theta_start(axis);
            self.adaptive.law().resumed(axis, *inputs.get(axis), x, cascade.errors.get(axis), norm_max)
        };
        cascade.handed_over(PerAxis::from_fn(estimate))
    }
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
                // On the ground a law may ask for less than nothing, for as long as it likes.
                if self.adaptive.stands(cascade) {
                    return command;
                }
                let saturated = command.health.saturated;
                if let Some(trip) = self.monitor.watch(figures, cascade, &inputs, saturated) {
                    *pilot = self.fall_back(trip, cascade, inputs, state);
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
        if let Pilot::StandIn(stand_in) = &memory.pilot {
            *memory = Memory { pilot: Pilot::Afbc(self.resumed(stand_in)), figures: Figures::default() };
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
