//! The control tick: takes the newest inputs, supervises, controls, gates the motors and checks the tick rate.

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

/// Accepted time step of a law, equal to the tick's \[s\].
pub const DT: Range = Range::new("dt_s", 0.001, 0.001);

/// Flight core with its controller. Constant: everything that changes in flight is in [`FlightCoreMemory`].
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
    /// True if the state is [observed](crate::observer) from a tracker's poses, because the inertial sensor has failed.
    pub observed: bool,
    /// Number of states refused as frozen since power-up ([`crate::frozen_tracker`]), up to `u32::MAX`.
    pub frozen_states: u32,
}

/// Answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RequestAnswer {
    /// Ticket of the request.
    pub ticket: u8,
    /// The request.
    pub request: Request,
    /// Ok if done, otherwise the reason for refusing.
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
    /// Mode of the flight core.
    pub mode: Mode,
    /// Health of the flight core.
    pub health: TickHealth,
    /// Answer to this tick's request.
    pub answer: Option<RequestAnswer>,
    /// Reason for the end of the flight, if it ended in this tick.
    pub ended: Option<EndReason>,
    /// Reasons against arming in this tick, which decide the answer to [`Request::Arm`].
    pub against: Reasons,
}

/// Inputs of an armed vehicle's action in a tick.
struct Situation<'a> {
    mode: Mode,
    /// State of this tick, if known.
    fresh: Option<&'a State>,
    /// True if the state was measured or observed in this tick.
    measured: bool,
    /// State without a position, if no other is known.
    position_lost: Option<&'a State>,
    /// The commander's setpoint, if not stale.
    setpoint: Option<&'a Setpoint>,
    airborne: bool,
    /// True if the controller shall engage its law again.
    engages: bool,
}

impl<C: FlightController<N>, const N: usize> FlightCore<C, N> {
    /// Makes a flight core for these nominal parameters and the paper's rotors. `controller` must be built for the same
    /// parameters.
    ///
    /// # Errors
    /// The first parameter or limit out of range. Also if the controller's time step is not 1 ms, or the rotors cannot
    /// lift the vehicle [with a margin](afbc_control::mixer::HOVER_MARGIN).
    pub fn new(parameters: Parameters, limits: ArmingLimits, controller: C) -> Result<Self, OutOfRange> {
        Self::with_rotors(parameters, &Response::DEFAULT, limits, controller)
    }

    /// As [`new`](Self::new), for rotors with this response.
    ///
    /// # Errors
    /// As [`new`](Self::new), and the rotors' time constant out of range.
    // This function is always inlined: otherwise the result is twice on the stack of the firmware's start-up.
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

    /// Runs one tick. Call it every millisecond. `now_us` is the time since power-up, and never goes back. Cannot fail.
    // This function is always inlined: copying the outcome out of a call costs a hundred instructions.
    #[inline(always)]
    #[must_use = "the motors need the rotor speeds"]
    pub fn tick(&self, memory: &mut FlightCoreMemory<C::Memory>, now_us: u64, inbox: &Inbox) -> TickOutcome<N> {
        let dt_s = self.controller.dt_s();
        // Takes the newest inputs.
        // Must come first: the detectors below use the time since the last tick.
        memory.rate.tick(now_us);
        let is_new = memory.take_state(inbox, now_us);
        let observing = memory.observe(&self.dead_reckoning, inbox, now_us, is_new);
        let measured = is_new || observing;
        let state_age_us = memory.state.map_or(u32::MAX, |state| state.age_us(now_us));
        // A state may be 20 ms old, but the law must act on the vehicle's present state.
        let fresh =
            memory.state.filter(|_| state_age_us <= COAST_US).map(|state| extrapolated(&state.value, state_age_us));
        let fresh = fresh.as_ref();
        // The last state with a position is preferred while it is fresh.
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
            // Usually the queue is empty and need not be searched.
            kill: asked.is_some() && inbox.kills(),
            ready: against.verdict(),
            state_age_us,
            attitude_age_us: age_us(*oriented_us),
            steady_us: *steady_us,
            airborne: flight.as_ref().is_some_and(|flight| flight.landing.airborne()),
            stands: flight.as_ref().is_some_and(|flight| flight.landing.stands()),
            tumbled: flight.as_ref().is_some_and(|flight| flight.tumble.is_lost()),
        };
        // The request is answered for the mode before the transition. Afterwards, the request that armed the vehicle
        // would be refused.
        let answer = asked.map(|asked| {
            let result = mode.answer(asked.value, &observed);
            RequestAnswer { ticket: asked.ticket, request: asked.value, result }
        });
        let done = |request| answer.is_some_and(|answer| answer.request == request && answer.result.is_ok());
        let ended = mode.end(&observed);
        // A hovering vehicle counts as at rest. Once its motors have stopped in the air, a delayed request to arm must
        // not restart them.
        if ended.is_some() && observed.airborne {
            *rest_us = 0;
        }
        // `next` would check the end of the flight a second time.
        *mode = if ended.is_some() { Mode::Disarmed } else { mode.onward(&observed) };
        let mode = *mode;
        // The tick of arming only sets up the flight, with motors idling: a step of the law as well would take too
        // long.
        let arms = done(Request::Arm);
        // A state is always known here: without one, arming is refused.
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

    /// Returns the action of an armed vehicle. `last` is its newest state of any age.
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
                // The vehicle has touched the ground, but the landing is not confirmed, so the law keeps its memory.
                flight.applied = Inputs::default();
            } else {
                flight.rest(&self.dead_reckoning, fresh.or(position_lost));
            }
            return self.open_loop(flight, Inputs::default());
        }
        if let Some(reset) = inbox.reset() {
            flight.guide.shift(reset);
        }
        // Otherwise, a law that observes moments would compensate the ground's reaction on the feet, and tip over on
        // leaving the ground.
        if mem::take(&mut flight.idle_on_ground) && !airborne {
            self.controller.on_ground(&mut flight.control);
        }
        // Extrapolated states have the rates of the last measurement, and would set the reckoning back.
        flight.reckon(&self.dead_reckoning, fresh.filter(|_| measured).or(position_lost));
        if engages && self.controller.engage(&mut flight.control) {
            // No step of the law in the tick of engaging: the rotors keep their inputs.
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
                // The inbox contains plausible values only.
                self.controller.decide(&mut flight.control, state, target, true)
            }
            (None, Some(state)) => {
                // Use the estimate's horizontal velocity, which `upright` removes, as the start of the drift.
                let state = inbox.position_lost().map_or(state, |position_lost| &position_lost.value);
                let (state, target) = flight.guide.down(state, last.map(|last| &last.value), dt_s);
                self.controller.position_lost(&mut flight.control);
                self.controller.decide(&mut flight.control, &state, target, true)
            }
            (None, None) => {
                // Do not update the trim, from which these inputs are made: a blind descent would lower it further and
                // further.
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

    /// Returns the action that flies a pilot's body rates. The law restarts afterwards.
    // The function is not inlined, so that the law's ticks stay fast.
    #[cold]
    #[inline(never)]
    fn turn(&self, flight: &mut Armed<C::Memory>, state: &State, target: &RateTarget) -> Action<N> {
        // Clears the law's memory, with the notice that it is on the ground: the law will restart in the air.
        if !mem::replace(&mut flight.turns, true) {
            flight.forget();
            flight.turning = RateMemory::default();
        }
        let action = self.rate_control.advance(self.controller.mixer(), &mut flight.turning, state, target);
        (flight.open_loop, flight.applied) = (Some(action.given), action.given);
        action
    }

    /// Returns the action without any state.
    #[inline(always)]
    fn blind_action<M>(&self, flight: &mut Armed<M>, mode: Mode) -> Action<N> {
        // When states return, the descent restarts at the vehicle, not at the last known place.
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

/// Returns a fresh state without a position, with horizontal position and velocity set to zero. Thus nothing drives the
/// vehicle sideways except what the law has learnt of the wind.
fn upright(state: &Stamped<State>, now_us: u64) -> Option<State> {
    (state.age_us(now_us) <= COAST_US).then(|| {
        let State { position_m, velocity_m_s, .. } = state.value;
        let vertical = |v: Vector3<f32>| Vector3::new(0.0, 0.0, v.z);
        State { position_m: vertical(position_m), velocity_m_s: vertical(velocity_m_s), ..state.value }
    })
}
