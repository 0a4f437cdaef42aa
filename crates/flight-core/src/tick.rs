//! The control tick: takes the newest inputs, supervises, controls, gates the motors, checks the rate.

use crate::armed::Armed;
use crate::dead_reckoning::DeadReckoning;
use crate::inbox::Inbox;
use crate::memory::{FlightCoreMemory, extrapolated};
use crate::motor::Response;
use crate::rate;
use crate::rate_control::{RateControl, RateMemory, RateTarget};
use crate::reasons::Reasons;
use crate::supervisor::{
    ArmingInputs, ArmingLimits, COAST_US, EndReason, Mode, Refusal, Request, SETPOINT_STALE_US, SupervisorInputs,
};
use afbc_control::{Action, FlightController};
use afbc_types::{Declared, Inputs, OutOfRange, Parameters, Range, RotorForces, RotorSpeeds, Setpoint, Stamped, State};
use core::mem;
use nalgebra::Vector3;

/// Accepted time step of a law: the tick's \[s\].
pub const DT: Range = Range::new("dt_s", 0.001, 0.001);

/// A vehicle with its controller. Constant; everything that changes in flight is in [`FlightCoreMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightCore<C, const N: usize = 4> {
    controller: C,
    dead_reckoning: DeadReckoning,
    rate_control: RateControl,
    limits: ArmingLimits,
    weight_n: f32,
}

/// Health of the flight core in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickHealth {
    /// Health of the law's step.
    pub control: afbc_control::Health,
    /// Rate and timing of the ticks.
    pub rate: rate::RateReport,
    /// Age of the newest plausible state \[us\]; `u32::MAX` if there is none.
    pub state_age_us: u32,
    /// True if there is no plausible setpoint younger than 500 ms; an armed vehicle then holds its position.
    pub setpoint_stale: bool,
    /// True if the state is [observed](crate::observer) from a tracker's poses, since the inertial sensor has failed.
    pub observed: bool,
    /// States since power-up refused as frozen ([`crate::frozen_tracker`]), up to `u32::MAX`.
    pub frozen_states: u32,
}

/// The answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RequestAnswer {
    /// Ticket of the request.
    pub ticket: u8,
    /// The request.
    pub request: Request,
    /// Done, or the reason for refusing it.
    pub result: Result<(), Refusal>,
}

/// Result of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TickOutcome<const N: usize = 4> {
    /// Rotor speeds for the motors: zero if disarmed.
    pub motors: RotorSpeeds<N>,
    /// Force of each rotor \[N\].
    pub forces: RotorForces<N>,
    /// Flight mode.
    pub mode: Mode,
    /// Health of the flight core.
    pub health: TickHealth,
    /// Answer to this tick's request.
    pub answer: Option<RequestAnswer>,
    /// Why the flight ended, if it did in this tick.
    pub ended: Option<EndReason>,
    /// What spoke against arming in this tick, by which [`Request::Arm`] was or would have been answered.
    pub against: Reasons,
}

/// What an armed vehicle acts on in a tick.
struct Situation<'a> {
    mode: Mode,
    /// State of this tick, if it is known.
    fresh: Option<&'a State>,
    /// True if that is measured in this tick.
    measured: bool,
    /// State without a position, if that is all that is known.
    position_lost: Option<&'a State>,
    /// The commander's setpoint, if it is not stale.
    setpoint: Option<&'a Setpoint>,
    airborne: bool,
    /// True if the controller is asked to engage its law again.
    engages: bool,
}

impl<C: FlightController<N>, const N: usize> FlightCore<C, N> {
    /// Creates a vehicle with these nominal parameters, the paper's rotors, and `controller`, which must be built for
    /// them.
    ///
    /// # Errors
    /// The first parameter or limit out of range; also if the controller's time step is not 1 ms, or its rotors cannot
    /// lift the vehicle [with a margin](afbc_control::mixer::HOVER_MARGIN).
    pub fn new(parameters: Parameters, limits: ArmingLimits, controller: C) -> Result<Self, OutOfRange> {
        Self::with_rotors(parameters, &Response::DEFAULT, limits, controller)
    }

    /// The same with rotors that respond like this.
    ///
    /// # Errors
    /// Likewise, and the rotors' time constant.
    // Always: out of line, its result is on the stack of the firmware's start-up twice.
    #[inline(always)]
    pub fn with_rotors(
        parameters: Parameters,
        rotors: &Response,
        limits: ArmingLimits,
        controller: C,
    ) -> Result<Self, OutOfRange> {
        parameters.validate()?;
        rotors.validate()?;
        limits.validate()?;
        DT.check(controller.dt_s())?;
        let weight_n = parameters.weight_n();
        controller.mixer().check_hover(weight_n)?;
        Ok(FlightCore {
            dead_reckoning: DeadReckoning::new(&parameters, rotors, controller.dt_s()),
            rate_control: RateControl::new(&parameters, rotors, controller.dt_s()),
            controller,
            limits,
            weight_n,
        })
    }

    /// Runs one tick, to be called every millisecond. `now_us` is the time since power-up, which never goes back.
    /// Cannot fail.
    // Always: copying the outcome out of a call costs a hundred instructions.
    #[inline(always)]
    #[must_use = "the motors need its speeds"]
    pub fn tick(&self, memory: &mut FlightCoreMemory<C::Memory>, now_us: u64, inbox: &Inbox) -> TickOutcome<N> {
        let dt_s = self.controller.dt_s();
        // Takes the newest inputs.
        // First: the detectors below count with the time since the last tick.
        memory.rate.tick(now_us);
        let is_new = memory.take_state(inbox, now_us);
        let observing = memory.observe(&self.dead_reckoning, inbox, now_us, is_new);
        let measured = is_new || observing;
        let state_age_us = memory.state.map_or(u32::MAX, |state| state.age_us(now_us));
        // A state may be 20 ms old: the law is to act on where the vehicle is, not on where it was.
        let fresh =
            memory.state.filter(|_| state_age_us <= COAST_US).map(|state| extrapolated(&state.value, state_age_us));
        let fresh = fresh.as_ref();
        // For its 20 ms the last state with a position still counts.
        let position_lost = inbox.position_lost().filter(|_| fresh.is_none()).and_then(|state| upright(state, now_us));
        memory.orient(inbox);
        memory.watch(fresh, position_lost.as_ref(), inbox, &self.limits, dt_s);
        let FlightCoreMemory {
            mode, rate, state: last, steady_us, rest_us, frozen_states, oriented_us, flight, ..
        } = memory;
        let age_us = |at_us: Option<u64>| at_us.map_or(u32::MAX, |at_us| Stamped { value: (), at_us }.age_us(now_us));
        let setpoint = inbox.setpoint().filter(|s| s.age_us(now_us) <= SETPOINT_STALE_US).map(|s| &s.value);

        // Supervises.
        let against = if mode.armed() {
            Reasons::from(Refusal::AlreadyArmed)
        } else {
            let (missing, inhibited) = (inbox.missing(), inbox.inhibited());
            let (healthy, rest_us) = (rate.report().healthy(), *rest_us);
            self.limits.against(&ArmingInputs { state: fresh, missing, setpoint, healthy, rest_us, inhibited })
        };
        let asked = inbox.asked();
        let observed = SupervisorInputs {
            request: asked.map(|asked| asked.value),
            // An empty queue, which is the rule, is not searched.
            kill: asked.is_some() && inbox.kills(),
            ready: against.verdict(),
            state_age_us,
            attitude_age_us: age_us(*oriented_us),
            steady_us: *steady_us,
            airborne: flight.as_ref().is_some_and(|flight| flight.landing.airborne()),
            stands: flight.as_ref().is_some_and(|flight| flight.landing.stands()),
            tumbled: flight.as_ref().is_some_and(|flight| flight.tumble.is_lost()),
        };
        // By the mode before the transition: an armed vehicle would refuse the very request that has armed it.
        let answer = asked.map(|asked| {
            let result = mode.answer(asked.value, &observed);
            RequestAnswer { ticket: asked.ticket, request: asked.value, result }
        });
        let done = |request| answer.is_some_and(|answer| answer.request == request && answer.result.is_ok());
        let ended = mode.end(&observed);
        // A vehicle that hovered counts as at rest: once its motors have stopped in the air, a delayed request to arm
        // must not start them again.
        if ended.is_some() && observed.airborne {
            *rest_us = 0;
        }
        // Not `next`, which would look a second time for the end of the flight.
        *mode = if ended.is_some() { Mode::Disarmed } else { mode.onward(&observed) };
        let mode = *mode;
        // The tick of arming only sets up the flight, and the motors idle: a step would take too long.
        let arms = done(Request::Arm);
        // There is a state: without one, `against` refuses to arm.
        if let (true, Some(state)) = (arms, fresh) {
            Armed::begin(flight, &self.dead_reckoning, self.weight_n, state, now_us);
        }

        // Controls.
        let situation = Situation {
            mode,
            fresh,
            measured,
            position_lost: position_lost.as_ref(),
            setpoint,
            airborne: observed.airborne,
            engages: done(Request::Engage),
        };
        let action = match flight {
            Some(flight) if mode.armed() && !arms => self.act(flight, &situation, inbox, last.as_ref()),
            _ => Action::default(),
        };

        // Gates the motors.
        let (motors, forces) = if mode.armed() { (action.speeds, action.forces) } else { Default::default() };
        let setpoint_stale = setpoint.is_none();
        let health = TickHealth {
            control: action.health,
            rate: *rate.report(),
            state_age_us,
            setpoint_stale,
            observed: observing,
            frozen_states: *frozen_states,
        };
        TickOutcome { motors, forces, mode, health, answer, ended, against }
    }

    /// Returns the action of an armed vehicle; `last` is its newest state, however old.
    #[inline(always)]
    fn act(
        &self,
        flight: &mut Armed<C::Memory>,
        situation: &Situation,
        inbox: &Inbox,
        last: Option<&Stamped<State>>,
    ) -> Action<N> {
        let Situation { mode, fresh, measured, position_lost, setpoint, airborne, engages } = *situation;
        let dt_s = self.controller.dt_s();
        if inbox.idle_on_ground() {
            if airborne {
                // It touches the ground, or the law goes on with what it knows.
                flight.applied = Inputs::default();
            } else {
                flight.rest(&self.dead_reckoning, fresh.or(position_lost));
            }
            return self.open_loop(flight, Inputs::default());
        }
        if let Some(reset) = inbox.reset() {
            flight.guide.shift(reset);
        }
        // Untold, a law that observes moments makes up for what the feet hold, and tips over when they let go.
        if mem::take(&mut flight.idle_on_ground) && !airborne {
            self.controller.on_ground(&mut flight.control);
        }
        // An extrapolated state has the rates of the last measurement, to which the reckoning must not be set back.
        flight.reckon(&self.dead_reckoning, fresh.filter(|_| measured).or(position_lost));
        if engages && self.controller.engage(&mut flight.control) {
            // The tick of engaging has no step: the rotors keep their inputs.
            return self.open_loop(flight, flight.applied);
        }
        if let (Some(target), Some(state), Mode::Flying) = (inbox.rates(), fresh, mode) {
            return self.turn(flight, state, target);
        }
        let action = match (fresh, position_lost) {
            (Some(state), _) => {
                let between = (!measured).then(|| flight.reckoning.between(state));
                let state = between.as_ref().unwrap_or(state);
                let target = flight.guide.target(mode, state, setpoint, dt_s);
                // The inbox only holds plausible values.
                self.controller.decide(&mut flight.control, state, target, true)
            }
            (None, Some(state)) => {
                // With its horizontal velocity, which `upright` leaves out: the drift begins with it.
                let state = inbox.position_lost().map_or(state, |position_lost| &position_lost.value);
                let (state, target) = flight.guide.down(state, last.map(|last| &last.value), dt_s);
                self.controller.position_lost(&mut flight.control);
                self.controller.decide(&mut flight.control, &state, target, true)
            }
            (None, None) => {
                // Not taken into the trim, of which these inputs are made: a blind descent would lower it ever further.
                let action = self.blind_action(flight, mode);
                flight.applied = action.given;
                return action;
            }
        };
        (flight.open_loop, flight.turns) = (None, false);
        flight.applied = action.given;
        self.dead_reckoning.trim(&mut flight.reckoning, &flight.applied);
        action
    }

    /// Returns the action that turns the vehicle as a pilot commands. The law begins afresh afterwards.
    // Out of line, for the ticks of the law.
    #[cold]
    #[inline(never)]
    fn turn(&self, flight: &mut Armed<C::Memory>, state: &State, target: &RateTarget) -> Action<N> {
        // From the ground, too, of which the law has been told: it is to end in the air.
        if !mem::replace(&mut flight.turns, true) {
            flight.forget();
            flight.turning = RateMemory::default();
        }
        let action = self.rate_control.advance(self.controller.mixer(), &mut flight.turning, state, target);
        (flight.open_loop, flight.applied) = (Some(action.given), action.given);
        action
    }

    /// Returns the action without a state.
    #[inline(always)]
    fn blind_action<M>(&self, flight: &mut Armed<M>, mode: Mode) -> Action<N> {
        // When states come back, it descends from where it is then, not from where it was seen last.
        (flight.guide.descent, flight.guide.position_lost) = (None, None);
        let inputs = match mode {
            Mode::Descending => self.dead_reckoning.descend(&flight.reckoning),
            _ => self.dead_reckoning.coast(&flight.reckoning),
        };
        self.open_loop(flight, inputs)
    }

    /// Returns the action for inputs that do not come from the law.
    #[inline(always)]
    fn open_loop<M>(&self, flight: &mut Armed<M>, inputs: Inputs) -> Action<N> {
        flight.open_loop = Some(inputs);
        self.controller.mixer().action(&inputs)
    }
}

/// Returns the state of a vehicle that does not know where it is, if it is fresh: it stands over the origin as far as
/// the law can see, so that nothing drives it sideways but what the law has learnt of the wind.
fn upright(state: &Stamped<State>, now_us: u64) -> Option<State> {
    (state.age_us(now_us) <= COAST_US).then(|| {
        let State { position_m, velocity_m_s, .. } = state.value;
        let vertical = |v: Vector3<f32>| Vector3::new(0.0, 0.0, v.z);
        State { position_m: vertical(position_m), velocity_m_s: vertical(velocity_m_s), ..state.value }
    })
}
