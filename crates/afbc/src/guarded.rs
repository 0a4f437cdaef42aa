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

/// A flight under the law that stands in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StandIn {
    cascade: Cascade<Integral>,
    /// Its last command. Kept here: coming back from a call, it would have a command put together in memory on AFBC's
    /// path, too.
    command: Command,
    /// The attitude behind that, and its rates: what AFBC would go on from.
    attitude_rad: Vector3<f32>,
    rates_rad_s: Vector3<f32>,
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
        let State { attitude_rad, rates_rad_s, .. } = *state;
        let stand_in = memory.get_or_insert_with(|| {
            let hover_thrust_n = Some(self.adaptive.hover_thrust_n(afbc));
            let resume = |axis| Integral { value: 0.0, resume: Some(*tripped.inputs.get(axis)), hover_thrust_n };
            let cascade = afbc.handed_over(PerAxis::from_fn(resume));
            StandIn { cascade, command: Command::default(), attitude_rad, rates_rad_s }
        });
        let mut command = self.fallback.cascade(&mut stand_in.cascade, state, setpoint, fresh);
        command.health.trip = Some(tripped.trip);
        *stand_in = StandIn { command, attitude_rad, rates_rad_s, ..*stand_in };
        &stand_in.command
    }

    /// AFBC goes on from the inputs of the law that stood in.
    fn resumed(&self, stand_in: &StandIn) -> Cascade<Estimate> {
        let StandIn { cascade, command, attitude_rad: eta, rates_rad_s: eta_dot } = stand_in;
        let inputs = command.per_axis();
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

    fn engage(&self, memory: &mut Memory) -> bool {
        let afbc = match memory {
            Memory { stand_in: Some(stand_in), .. } => self.resumed(stand_in),
            // Nobody has stood in yet: AFBC goes on from where it is.
            Memory { tripped: Some(_), afbc, .. } => *afbc,
            _ => return false,
        };
        *memory = Memory { afbc, ..Memory::default() };
        true
    }

    /// Zero while the other law flies.
    fn learnt(memory: &Memory) -> PerAxis<Estimate> {
        if memory.tripped.is_some() { PerAxis::default() } else { memory.afbc.estimates }
    }
}
