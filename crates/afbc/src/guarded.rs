//! AFBC with a [monitor](crate::monitor). When the monitor trips, [integral backstepping](crate::integral) takes over
//! with the last inputs. Only a command engages AFBC again.

use crate::adaptive::{self, Adaptive, AdaptiveEstimate};
use crate::cascade::{CascadeMemory, Controller, LastStep, Settings};
use crate::integral::{IntegralBackstepping, IntegralMemory};
use crate::limits::PositionControlLimits;
use crate::model::ModelConstants;
use crate::monitor::{Monitor, MonitorBounds, MonitorFigures};
use crate::safeguards::Safeguards;
use crate::trip::Trip;
use afbc_control::{Action, Errors, FlightController, Mixer, Trace, math};
use afbc_types::{Airframe, Axis, OutOfRange, PerAxis, Range, Setpoint, State};

/// Smallest accepted Theta_max of z, in weights. With feed-forward, rotors that give 45 % of their thrust need 1.2
/// weights on the hover rule. Without feed-forward, nine rules that each hold the weight give |Theta_hat| = 3 weights,
/// or 5 for rotors that give 60 % of their thrust.
const fn hover_theta(feed_forward: bool) -> f32 {
    if feed_forward { 1.8 } else { 5.0 }
}

/// Accepted angular acceleration about body x and y near hover. The gains of the profile `flight` need half the value
/// of the paper's vehicle, and fail below 60 rad/s2 (`tests/tests/vehicles.rs`).
pub const HOVER_AUTHORITY: Range = Range::new("hover_authority_rad_s2", 80.0, 1e9);

/// Largest tilt of the fallback law \[rad\]: 45 degrees, as PX4's MPC_TILTMAX_AIR. A vehicle that swings with saturated
/// rotors calms down with it, and not with larger ones.
const FALLBACK_TILT_MAX_RAD: f32 = core::f32::consts::FRAC_PI_4;

/// AFBC with a monitor and a fallback law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarded<const N: usize = 4> {
    adaptive: Controller<Adaptive, N>,
    fallback: Controller<IntegralBackstepping, N>,
    monitor: Monitor,
}

/// Memory of the fallback law.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FallbackMemory<const N: usize> {
    cascade: CascadeMemory<IntegralMemory>,
    /// Last action. Stored here, because returning it would make the compiler build an action in memory on AFBC's path
    /// too.
    action: Action<N>,
}

/// Reason and state of a trip.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TripState {
    trip: Trip,
    /// omega of (6) after AFBC's last step \[rad/s\].
    rotor_residual_rad_s: f32,
}

/// Memory of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory<const N: usize = 4> {
    afbc: CascadeMemory<AdaptiveEstimate>,
    figures: MonitorFigures,
    trip: Option<TripState>,
    /// Memory of the fallback law, `None` before its first step.
    fallback: Option<FallbackMemory<N>>,
}

impl<const N: usize> Memory<N> {
    /// Returns the monitor's last figures of AFBC.
    pub fn figures(&self) -> &MonitorFigures {
        &self.figures
    }

    /// Returns AFBC's estimates, zero while the fallback law flies.
    pub fn estimates(&self) -> PerAxis<AdaptiveEstimate> {
        if self.trip.is_some() { PerAxis::default() } else { self.afbc.estimates }
    }

    /// Returns the reason of the trip while the fallback law flies.
    pub fn trip(&self) -> Option<Trip> {
        self.trip.map(|state| state.trip)
    }
}

impl<const N: usize> Guarded<N> {
    /// Creates AFBC with these gains, and a monitor with these bounds.
    ///
    /// # Errors
    /// Returns the first parameter, setting, gain or bound that is out of range. Also returns `rotor_force_max_n` if
    /// the rotors cannot lift the vehicle [with a margin](afbc_control::mixer::HOVER_MARGIN), `theta_max` of z if it
    /// leaves no room for a hover on weak rotors, and [`HOVER_AUTHORITY`] if the rotors turn the vehicle too slowly.
    // This function is always inlined: otherwise the result would be on the firmware's start-up stack twice.
    #[inline(always)]
    pub fn new(
        vehicle: impl Into<Airframe<N>>,
        settings: Settings,
        gains: PerAxis<adaptive::Gains>,
        bounds: MonitorBounds,
    ) -> Result<Self, OutOfRange> {
        let vehicle = vehicle.into();
        let Airframe { parameters, .. } = vehicle;
        let weight_n = parameters.weight_n();
        let mixer = settings.common.mixer(vehicle)?;
        mixer.check_hover(weight_n)?;
        let hover = Range {
            // The bound is rounded up to four decimals, so that the number in the error is short and is accepted when
            // entered.
            min: libm::ceil(f64::from(hover_theta(settings.feed_forward) * weight_n) * 1e4) / 1e4,
            ..Safeguards::THETAMAX.range
        };
        hover.check(gains.z.safeguards.theta_max)?;
        let ([roll_n, pitch_n], model) = (mixer.tilt_authority_n(weight_n), ModelConstants::new(&parameters));
        HOVER_AUTHORITY.check(roll_n * model.hover_gain(Axis::Roll))?;
        HOVER_AUTHORITY.check(pitch_n * model.hover_gain(Axis::Pitch))?;
        let fixed = gains.map(|gains| gains.into());
        let tilt_max_rad = math::min(settings.limits.tilt_max_rad, FALLBACK_TILT_MAX_RAD);
        let careful = Settings { limits: PositionControlLimits { tilt_max_rad, ..settings.limits }, ..settings };
        Ok(Guarded {
            adaptive: Controller::new(vehicle, settings, Adaptive::new(gains)?)?,
            fallback: Controller::new(vehicle, careful, IntegralBackstepping::new(&parameters, fixed)?)?,
            monitor: Monitor::new(bounds, settings.common.dt_s)?,
        })
    }

    /// Runs one step of the fallback law. The first call initialises it, because the step that trips has no time for
    /// that.
    #[cold]
    #[inline(never)]
    fn fallback_step<'a>(
        &self,
        memory: &'a mut Option<FallbackMemory<N>>,
        afbc: &CascadeMemory<AdaptiveEstimate>,
        trip: &TripState,
        state: &State,
        setpoint: &Setpoint,
        fresh: bool,
    ) -> &'a Action<N> {
        let FallbackMemory { cascade, action } = memory.get_or_insert_with(|| {
            let hover_thrust_n = Some(self.adaptive.hover_thrust_n(afbc));
            let resume = |axis| IntegralMemory { value: 0.0, resume: Some(afbc.last.inputs[axis]), hover_thrust_n };
            let cascade = afbc.handed_over(PerAxis::from_fn(resume), trip.rotor_residual_rad_s);
            FallbackMemory { cascade, action: Action::default() }
        });
        *action = self.fallback.cascade(cascade, state, setpoint, fresh);
        action.health.fallback = Some(trip.trip.reason());
        action
    }

    /// Returns `cascade` with estimates with which AFBC continues from the last inputs. With feed-forward, u_a becomes
    /// the learnt part of either law, since both have the same known part.
    fn resumed<E>(
        &self,
        cascade: &CascadeMemory<E>,
        learnt: impl Fn(Axis, [f32; 2], &Errors, &E) -> f32,
    ) -> CascadeMemory<AdaptiveEstimate> {
        let LastStep { inputs, errors, eta, eta_dot, .. } = &cascade.last;
        let law = self.adaptive.law();
        let estimates = PerAxis::from_fn(|axis| {
            let x = match axis {
                Axis::Roll => [eta.x, eta_dot.x],
                Axis::Pitch => [eta.y, eta_dot.y],
                // Of z, x, y and yaw, only yaw uses this value, because the fuzzy systems of z, x and y take the errors
                // as inputs.
                _ => [eta.z, eta_dot.z],
            };
            let errors = &errors[axis];
            let fuzzy = if self.adaptive.feeds_forward() {
                learnt(axis, x, errors, &cascade.estimates[axis])
            } else {
                inputs[axis] - law.proportional(axis, errors)
            };
            law.resumed(axis, fuzzy, x, errors, self.monitor.theta_start(axis))
        });
        // AFBC does not use the rotor residual.
        cascade.handed_over(estimates, 0.0)
    }
}

impl<const N: usize> FlightController<N> for Guarded<N> {
    type Memory = Memory<N>;

    fn dt_s(&self) -> f32 {
        self.adaptive.dt_s()
    }

    fn mixer(&self) -> &Mixer<N> {
        self.adaptive.mixer()
    }

    #[inline(always)]
    fn decide(&self, memory: &mut Memory<N>, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        let Memory { afbc, figures, trip, fallback } = memory;
        if let Some(trip) = trip {
            return *self.fallback_step(fallback, afbc, trip, state, setpoint, fresh);
        }
        let action = self.adaptive.cascade(afbc, state, setpoint, fresh);
        // On the ground a law may demand negative thrust forever, so the monitor is off.
        if !self.adaptive.is_standing(afbc)
            && let Some(reason) = self.monitor.watch(figures, afbc, action.health.saturated)
        {
            let rotor_residual_rad_s = self.adaptive.mixer().residual_rad_s(&action.speeds);
            // AFBC's action is used once more: a tick has no time for a step of both laws.
            *trip = Some(TripState { trip: reason, rotor_residual_rad_s });
        }
        action
    }

    // Until the fallback law's first step, AFBC's memory takes these notices and hands them over.
    fn on_ground(&self, memory: &mut Memory<N>) {
        match &mut memory.fallback {
            Some(fallback) => self.fallback.on_ground(&mut fallback.cascade),
            None => self.adaptive.on_ground(&mut memory.afbc),
        }
    }

    fn position_lost(&self, memory: &mut Memory<N>) {
        match &mut memory.fallback {
            Some(fallback) => self.fallback.position_lost(&mut fallback.cascade),
            None => self.adaptive.position_lost(&mut memory.afbc),
        }
    }

    fn trace(memory: &Memory<N>) -> Trace {
        match &memory.fallback {
            Some(fallback) => fallback.cascade.trace(),
            None => memory.afbc.trace(),
        }
    }

    fn engage(&self, memory: &mut Memory<N>) -> bool {
        let Memory { afbc, trip: Some(_), fallback, .. } = memory else { return false };
        let afbc = match fallback {
            Some(FallbackMemory { cascade, .. }) => self.resumed(cascade, |_, _, _, integral| integral.value),
            None => self.resumed(afbc, |axis, x, errors, own| self.adaptive.law().fuzzy(axis, x, errors, own)),
        };
        // The monitor starts with new figures, because a mean that has tripped is still beyond its bound.
        *memory = Memory { afbc, ..Memory::default() };
        true
    }
}
