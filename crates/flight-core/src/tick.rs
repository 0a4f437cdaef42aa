//! The control tick: takes the newest inputs, supervises, controls, gates the motors, checks the rate.

use crate::dead_reckoning::{DeadReckoning, Reckoning};
use crate::descent::{Descent, Drift};
use crate::fall_check::FallCheck;
use crate::frozen_tracker::FrozenTrackerCheck;
use crate::inbox::Inbox;
use crate::landing::LandDetector;
use crate::motor::Response;
use crate::observer::{HOLD_US, PoseObserver};
use crate::rate;
use crate::reasons::Reasons;
use crate::supervisor::{
    ArmingInputs, ArmingLimits, COAST_US, EndReason, Mode, REST_US, Refusal, Request, SETPOINT_STALE_US,
    SupervisorInputs,
};
use crate::tumble::Tumble;
use afbc_control::{Action, FlightController, Trace};
use afbc_types::{
    Declared, Inputs, OutOfRange, Parameters, Pose, Range, RotorForces, RotorSpeeds, Setpoint, Stamped, State,
};
use nalgebra::Vector3;

/// Accepted time step of a law: the tick's \[s\].
pub const DT: Range = Range::new("dt_s", 0.001, 0.001);

/// A vehicle with its controller. Constant; everything that changes in flight is in [`FlightCoreMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightCore<C, const N: usize = 4> {
    controller: C,
    dead_reckoning: DeadReckoning,
    limits: ArmingLimits,
    weight_n: f32,
}

/// State of a vehicle that persists between ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightCoreMemory<M> {
    mode: Mode,
    rate: rate::Counter,
    /// The newest plausible state.
    state: Option<Stamped<State>>,
    /// Time of the newest attitude, with or without a position \[us\].
    oriented_us: Option<u64>,
    /// Time for which no state has been stale \[us\].
    steady_us: u32,
    /// Time for which the vehicle has been at rest, with fresh states \[us\].
    rest_us: u32,
    /// Number of states refused because they repeated the last one in flight, or came from a distrusted tracker.
    frozen_states: u32,
    flight: Option<Armed<M>>,
}

/// State of one flight, from arming on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Armed<M> {
    control: M,
    reckoning: Reckoning,
    /// Motion observed from a tracker's poses, without an inertial sensor.
    observer: Option<PoseObserver>,
    /// Inputs last applied to the rotors.
    applied: Inputs,
    /// Inputs of the last tick, if it had no step of the law.
    open_loop: Option<Inputs>,
    /// True if it rests on the ground, and the controller's memory is as at take-off.
    idle_on_ground: bool,
    guide: Guide,
    landing: LandDetector,
    /// Whether it falls, if the state is an estimate by an inertial sensor.
    fall: FallCheck,
    tumble: Tumble,
    witness: FrozenTrackerCheck,
    /// True if the tracker contradicted itself or the thrust: its states are ignored for the rest of the flight.
    distrusts: bool,
}

/// Setpoints for times without one from the commander.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Guide {
    /// Setpoint to hold while there is no other.
    hold: Option<Setpoint>,
    descent: Option<Descent>,
    /// Motion and descent of a vehicle that does not know where it is.
    position_lost: Option<(Drift, Descent)>,
}

impl<M> FlightCoreMemory<M> {
    /// Returns the flight mode.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Returns the newest plausible state.
    pub fn state(&self) -> Option<&State> {
        self.state.as_ref().map(|state| &state.value)
    }

    /// True if the vehicle is armed and in the air.
    pub fn airborne(&self) -> bool {
        self.mode.armed() && self.flight.as_ref().is_some_and(|flight| flight.landing.airborne())
    }

    /// True if the vehicle has been at rest for as long as arming wants it.
    pub fn rested(&self) -> bool {
        self.rest_us >= REST_US
    }

    /// Records that the clock has failed and another has taken over: the vehicle is not armed again.
    pub fn distrust_clock(&mut self) {
        self.rate.distrust();
    }

    /// Returns the controller's memory of this or the last flight; none before the first.
    pub fn control(&self) -> Option<&M> {
        self.flight.as_ref().map(|flight| &flight.control)
    }

    /// Returns the trace of the last tick with the controller `C`: only inputs while blind, zeros while disarmed.
    pub fn trace<C: FlightController<N, Memory = M>, const N: usize>(&self) -> Trace {
        match &self.flight {
            Some(Armed { open_loop: Some(inputs), .. }) if self.mode.armed() => {
                let mut trace = Trace::default();
                trace.inputs = *inputs;
                trace
            }
            Some(Armed { control, .. }) if self.mode.armed() => C::trace(control),
            _ => Trace::default(),
        }
    }
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
        memory.rate.tick(now_us);
        let is_new = memory.take_state(inbox, now_us);
        let observing = memory.observe(&self.dead_reckoning, inbox, now_us, is_new);
        let measured = is_new || observing;
        let state_age_us = memory.state.map_or(u32::MAX, |state| state.age_us(now_us));
        let fresh =
            memory.state.filter(|_| state_age_us <= COAST_US).map(|state| extrapolated(&state.value, state_age_us));
        let fresh = fresh.as_ref();
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
            kill: asked.is_some() && inbox.kills(),
            ready: against.verdict(),
            state_age_us,
            attitude_age_us: age_us(*oriented_us),
            steady_us: *steady_us,
            airborne: flight.as_ref().is_some_and(|flight| flight.landing.airborne()),
            tumbled: flight.as_ref().is_some_and(|flight| flight.tumble.is_lost()),
        };
        let answer = asked.map(|asked| {
            let result = mode.answer(asked.value, &observed);
            RequestAnswer { ticket: asked.ticket, request: asked.value, result }
        });
        let done = |request| answer.is_some_and(|answer| answer.request == request && answer.result.is_ok());
        let ended = mode.end(&observed);
        if ended.is_some() && observed.airborne {
            *rest_us = 0;
        }
        *mode = if ended.is_some() { Mode::Disarmed } else { mode.onward(&observed) };
        let mode = *mode;
        // The tick of arming only sets up the flight, and the motors idle: a step would take too long.
        let arms = done(Request::Arm);
        if let (true, Some(state)) = (arms, fresh) {
            Armed::begin(flight, &self.dead_reckoning, self.weight_n, state, now_us);
        }

        // Controls.
        let action = match flight {
            Some(flight) if mode.armed() && !arms && inbox.idle_on_ground() => {
                if observed.airborne {
                    // It touches the ground, or the law goes on with what it knows.
                    flight.applied = Inputs::default();
                } else {
                    flight.rest(&self.dead_reckoning, fresh.or(position_lost.as_ref()));
                }
                self.open_loop(flight, Inputs::default())
            }
            Some(flight) if mode.armed() && !arms => {
                flight.idle_on_ground = false;
                flight.reckon(&self.dead_reckoning, fresh.filter(|_| measured).or(position_lost.as_ref()));
                let engaged = done(Request::Engage) && self.controller.engage(&mut flight.control);
                match (fresh, &position_lost) {
                    // Likewise, the tick of engaging has no step: the rotors keep their inputs.
                    _ if engaged => self.open_loop(flight, flight.applied),
                    (Some(state), _) => {
                        let between = (!measured).then(|| flight.reckoning.between(state));
                        let state = between.as_ref().unwrap_or(state);
                        let target = flight.guide.target(mode, state, setpoint, dt_s);
                        // The inbox only holds plausible values.
                        let action = self.controller.decide(&mut flight.control, state, target, true);
                        flight.open_loop = None;
                        flight.applied = action.given;
                        self.dead_reckoning.trim(&mut flight.reckoning, &flight.applied);
                        action
                    }
                    (None, Some(state)) => {
                        let state = inbox.position_lost().map_or(state, |position_lost| &position_lost.value);
                        let last = last.as_ref().map(|last| &last.value);
                        let (state, target) = flight.guide.down(state, last, dt_s);
                        self.controller.position_lost(&mut flight.control);
                        let action = self.controller.decide(&mut flight.control, &state, target, true);
                        flight.open_loop = None;
                        flight.applied = action.given;
                        self.dead_reckoning.trim(&mut flight.reckoning, &flight.applied);
                        action
                    }
                    (None, None) => {
                        let action = self.blind_action(flight, mode);
                        flight.applied = action.given;
                        action
                    }
                }
            }
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

    /// Returns the action without a state.
    #[inline(always)]
    fn blind_action<M>(&self, flight: &mut Armed<M>, mode: Mode) -> Action<N> {
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

/// Extrapolates the state by `age_us` with its velocities and rates; as in the paper's model, body rates replace the
/// derivatives of the angles.
fn extrapolated(state: &State, age_us: u32) -> State {
    // The vehicle's own estimate always has age 0.
    if age_us == 0 {
        return *state;
    }
    let age_s = age_us as f32 * 1e-6;
    State {
        position_m: state.position_m + state.velocity_m_s * age_s,
        attitude_rad: state.attitude_rad + state.rates_rad_s * age_s,
        ..*state
    }
}

impl<M> FlightCoreMemory<M> {
    /// Stores the inbox's state if it is newer than the present one, not already stale (states that are always late do
    /// not count as states), and not from a frozen tracker. True if it was stored.
    fn take_state(&mut self, inbox: &Inbox, now_us: u64) -> bool {
        // What is observed is stamped now, and gives way to the link's states, which are always a little older.
        let gives_way = self.is_observing() && !inbox.is_own();
        let newer = |state: &&Stamped<State>| {
            state.age_us(now_us) <= COAST_US && (gives_way || self.state.is_none_or(|held| state.at_us > held.at_us))
        };
        let Some(state) = inbox.state().filter(newer) else { return false };
        let armed = self.mode.armed();
        // An estimate watches its trackers itself, and may approach what they say faster than it moves.
        let watched = armed && !inbox.is_own();
        if let Some(flight) = self.flight.as_mut().filter(|flight| watched && flight.landing.airborne()) {
            let repeated = self.state.is_some_and(|held| held.value == state.value);
            flight.distrusts |= flight.witness.contradicts(&state.value, state.at_us);
            if repeated || flight.distrusts {
                self.frozen_states = self.frozen_states.saturating_add(1);
                return false;
            }
        }
        self.state = Some(*state);
        true
    }

    /// True if an armed vehicle has an observer.
    fn is_observing(&self) -> bool {
        self.mode.armed() && self.flight.as_ref().is_some_and(|flight| flight.observer.is_some())
    }

    /// Stores the state that is observed from poses which no estimator has taken, unless the inbox had a newer one
    /// (`is_new`). True if there is one.
    #[inline]
    fn observe(&mut self, dead_reckoning: &DeadReckoning, inbox: &Inbox, now_us: u64, is_new: bool) -> bool {
        // As long as an estimator works, it takes all poses.
        (inbox.pose().is_some() || self.is_observing()) && self.observe_pose(dead_reckoning, inbox, now_us, is_new)
    }

    /// The same, if there is a pose or an observer.
    #[cold]
    #[inline(never)]
    fn observe_pose(&mut self, dead_reckoning: &DeadReckoning, inbox: &Inbox, now_us: u64, is_new: bool) -> bool {
        let armed = self.mode.armed();
        let (Some(flight), Some(held)) = (self.flight.as_mut().filter(|_| armed), self.state) else { return false };
        let age_us = held.age_us(now_us);
        let is_linked = is_new || flight.observer.is_none() && !inbox.is_own() && age_us <= COAST_US;
        if is_linked || flight.distrusts {
            flight.observer = None;
            return false;
        }
        let Armed { observer, reckoning, applied, .. } = flight;
        let news = |pose: &&Stamped<Pose>| {
            PoseObserver::takes(pose, now_us) && observer.as_ref().is_none_or(|observer| observer.is_news(pose))
        };
        let pose = inbox.pose().filter(news);
        let observer = match (observer.as_mut().filter(|observer| observer.age_us(now_us) <= HOLD_US), pose) {
            (Some(running), pose) => {
                running.advance(dead_reckoning, reckoning, applied);
                if let Some(pose) = pose {
                    running.correct(pose, now_us);
                }
                running
            }
            (None, Some(pose)) => {
                let state = reckoning.between(&extrapolated(&held.value, age_us));
                let new = observer.insert(PoseObserver::new(&state, applied, held.at_us));
                new.correct(pose, now_us);
                new
            }
            (None, None) => return false,
        };
        let state = observer.state();
        if let Some(value) = state {
            self.state = Some(Stamped { value, at_us: now_us });
        }
        state.is_some()
    }

    /// Notes the time of the newest attitude.
    fn orient(&mut self, inbox: &Inbox) {
        let newest = inbox.position_lost().map(|state| state.at_us).max(self.state.map(|state| state.at_us));
        self.oriented_us = self.oriented_us.max(newest);
    }

    /// Updates the detectors with a fresh state, or with that of a vehicle without a position, or none, and with the
    /// inbox's marks.
    fn watch(
        &mut self,
        fresh: Option<&State>,
        position_lost: Option<&State>,
        inbox: &Inbox,
        limits: &ArmingLimits,
        dt_s: f32,
    ) {
        let gap_us = self.rate.gap_us();
        let longer = |time_us: u32, lasts| if lasts { time_us.saturating_add(gap_us) } else { 0 };
        self.steady_us = longer(self.steady_us, fresh.is_some());
        self.rest_us = longer(self.rest_us, fresh.is_some_and(|state| limits.at_rest(state)));
        let armed = self.mode.armed();
        let Some(flight) = self.flight.as_mut().filter(|_| armed) else { return };
        if inbox.idle_on_ground() && !flight.landing.airborne() {
            flight.landing.rest(fresh.or(position_lost));
            return match fresh.or(position_lost) {
                Some(state) => flight.tumble.advance(state, gap_us),
                None => flight.tumble.advance_blind(gap_us),
            };
        }
        match (fresh, position_lost) {
            (Some(state), _) => {
                flight.tumble.advance(state, gap_us);
                flight.landing.advance(state, flight.applied.thrust_n, gap_us, dt_s);
                if inbox.is_own() {
                    check_fall(&mut flight.fall, &mut flight.landing, flight.applied.thrust_n, state, dt_s);
                }
                flight.distrusts |= flight.landing.contradicts();
            }
            (None, Some(state)) => {
                flight.tumble.advance(state, gap_us);
                flight.landing.advance_adrift(state, flight.applied.thrust_n, gap_us, dt_s);
            }
            (None, None) => {
                flight.tumble.advance_blind(gap_us);
                flight.landing.advance_blind(gap_us);
            }
        }
    }
}

/// Looks for the ground by an inertial sensor's estimate. Out of line, for the ticks without one.
#[inline(never)]
fn check_fall(fall: &mut FallCheck, landing: &mut LandDetector, thrust_n: f32, state: &State, dt_s: f32) {
    if fall.stands(&state.velocity_m_s, landing.thrust_share(thrust_n), dt_s) {
        landing.touch_down(state);
    }
}

impl<M: Default> Armed<M> {
    /// Begins a flight, in the memory of the last one.
    // Out of line, so that the new memory is not built on the tick's stack and copied.
    #[cold]
    #[inline(never)]
    fn begin(flight: &mut Option<Self>, dead_reckoning: &DeadReckoning, weight_n: f32, state: &State, now_us: u64) {
        *flight = Some(Armed {
            control: M::default(),
            reckoning: dead_reckoning.start(state),
            observer: None,
            applied: Inputs::default(),
            open_loop: None,
            idle_on_ground: true,
            guide: Guide::default(),
            landing: LandDetector::new(state, weight_n),
            fall: FallCheck::default(),
            tumble: Tumble::default(),
            witness: FrozenTrackerCheck::new(state, now_us),
            distrusts: false,
        });
    }
}

impl<M: Default> Armed<M> {
    /// Rests on the ground: the law begins afresh when it takes off, as after arming.
    fn rest(&mut self, dead_reckoning: &DeadReckoning, state: Option<&State>) {
        if !self.idle_on_ground {
            self.forget();
        }
        (self.idle_on_ground, self.applied) = (true, Inputs::default());
        if let Some(state) = state {
            self.reckoning = dead_reckoning.start(state);
        }
    }

    /// Clears the controller's memory.
    #[cold]
    #[inline(never)]
    fn forget(&mut self) {
        (self.control, self.guide) = (M::default(), Guide::default());
    }
}

impl<M> Armed<M> {
    /// Advances the dead reckoning over the last period, corrected by a measurement if there is one.
    fn reckon(&mut self, dead_reckoning: &DeadReckoning, measured: Option<&State>) {
        dead_reckoning.advance(&mut self.reckoning, &self.applied);
        if let Some(state) = measured {
            dead_reckoning.measure(&mut self.reckoning, state);
        }
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

impl Guide {
    /// Returns state and setpoint of a vehicle that does not know where it is, since `last`: downwards.
    fn down(&mut self, state: &State, last: Option<&State>, dt_s: f32) -> (State, &Setpoint) {
        (self.hold, self.descent) = (None, None);
        let (drift, descent) = self.position_lost.get_or_insert_with(|| {
            let mut drift = Drift::new(last.unwrap_or(state).position_m.xy(), state);
            let begin = drift.advance(state, 0.0);
            (drift, Descent::new(&begin))
        });
        descent.advance(dt_s);
        (drift.advance(state, dt_s), descent.setpoint())
    }

    /// Returns the setpoint for a fresh `state`: the descent's, the commander's, or a hold if there is none.
    fn target<'a>(&'a mut self, mode: Mode, state: &State, setpoint: Option<&'a Setpoint>, dt_s: f32) -> &'a Setpoint {
        self.position_lost = None;
        if mode == Mode::Descending {
            let descent = self.descent.get_or_insert_with(|| Descent::new(state));
            descent.advance(dt_s);
            return descent.setpoint();
        }
        match setpoint {
            Some(setpoint) => {
                self.hold = None;
                setpoint
            }
            None => self.hold.get_or_insert_with(|| Setpoint::hold(state)),
        }
    }
}
