//! Memory between ticks: the newest state, for how long states have been fresh and the vehicle at rest, and the flight.

use crate::armed::Armed;
use crate::dead_reckoning::DeadReckoning;
use crate::fall_check::FallCheck;
use crate::inbox::Inbox;
use crate::landing::LandDetector;
use crate::observer::{HOLD_US, PoseObserver};
use crate::rate;
use crate::supervisor::{ArmingLimits, COAST_US, Mode, REST_US};
use crate::tumble::Tumble;
use afbc_control::{FlightController, Trace};
use afbc_types::{Pose, Stamped, State};

/// Memory of the flight core between ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightCoreMemory<M> {
    pub(crate) mode: Mode,
    pub(crate) rate: rate::Counter,
    /// The newest plausible state.
    pub(crate) state: Option<Stamped<State>>,
    /// Time of the newest attitude, with or without a position \[us\].
    pub(crate) oriented_us: Option<u64>,
    /// Time for which no state has been stale \[us\].
    pub(crate) steady_us: u32,
    /// Time for which the vehicle has been at rest, with fresh states \[us\].
    pub(crate) rest_us: u32,
    /// Number of states refused because they repeated the last one in flight, or came from a distrusted tracker.
    pub(crate) frozen_states: u32,
    pub(crate) flight: Option<Armed<M>>,
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

    /// True if the vehicle has been at rest long enough to arm.
    pub fn rested(&self) -> bool {
        self.rest_us >= REST_US
    }

    /// Records that the clock has failed and another has taken over. The vehicle can then not be armed again.
    pub fn distrust_clock(&mut self) {
        self.rate.distrust();
    }

    /// Returns the controller's memory of this or the last flight; none before the first.
    pub fn control(&self) -> Option<&M> {
        self.flight.as_ref().map(|flight| &flight.control)
    }

    /// Returns the trace of the last tick with the controller `C`: inputs only in a tick without the law, zeros while
    /// disarmed.
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

impl<M: Default> FlightCoreMemory<M> {
    /// Clears the law's memory in flight, as at arming. This is needed for a change of the law.
    pub fn forget_law(&mut self) {
        if let Some(flight) = &mut self.flight {
            flight.control = M::default();
        }
    }
}

/// Extrapolates the state by `age_us` with its velocities and rates. As in the paper's model, body rates stand for the
/// derivatives of the angles.
pub(crate) fn extrapolated(state: &State, age_us: u32) -> State {
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
    /// Stores the inbox's state. Ignores the state if it is not newer than the present state, or from a frozen tracker.
    /// Also ignores a stale state, where a delay that all states have does not count as age. Returns true if it was
    /// stored.
    pub(crate) fn take_state(&mut self, inbox: &Inbox, now_us: u64) -> bool {
        // An observed state is stamped now, so let states from the link, which are always a little older, replace it.
        let gives_way = self.is_observing() && !inbox.is_own();
        let newer = |state: &&Stamped<State>| {
            state.age_us(now_us) <= COAST_US && (gives_way || self.state.is_none_or(|held| state.at_us > held.at_us))
        };
        let Some(state) = inbox.state().filter(newer) else { return false };
        let armed = self.mode.armed();
        // The vehicle's own estimator monitors its trackers itself, and its position may converge to them faster than
        // its velocity.
        let watched = armed && !inbox.is_own();
        if let Some(flight) = self.flight.as_mut().filter(|flight| watched && flight.landing.airborne()) {
            // Two states nearly always differ in the first number compared, which is cheaper than comparing them all.
            let repeated = self
                .state
                .is_some_and(|held| held.value.rates_rad_s.x == state.value.rates_rad_s.x && held.value == state.value);
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

    /// Stores a state observed from poses that no estimator has used, unless the inbox had a newer state (`is_new`).
    /// Returns true if there is one.
    #[inline]
    pub(crate) fn observe(&mut self, dead_reckoning: &DeadReckoning, inbox: &Inbox, now_us: u64, is_new: bool) -> bool {
        // A working estimator takes all poses.
        (inbox.pose().is_some() || self.is_observing()) && self.observe_pose(dead_reckoning, inbox, now_us, is_new)
    }

    /// As [`observe`](Self::observe), if there is a pose or an observer.
    #[cold]
    #[inline(never)]
    fn observe_pose(&mut self, dead_reckoning: &DeadReckoning, inbox: &Inbox, now_us: u64, is_new: bool) -> bool {
        let armed = self.mode.armed();
        let (Some(flight), Some(held)) = (self.flight.as_mut().filter(|_| armed), self.state) else { return false };
        let age_us = held.age_us(now_us);
        // Complete states from the link are preferred, also in the ticks between two of them.
        let is_linked = is_new || flight.observer.is_none() && !inbox.is_own() && age_us <= COAST_US;
        // A distrusted tracker's poses are no better than its states.
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

    /// Updates the time of the newest attitude.
    pub(crate) fn orient(&mut self, inbox: &Inbox) {
        let newest = inbox.position_lost().map(|state| state.at_us).max(self.state.map(|state| state.at_us));
        // `None` compares as less than any time.
        self.oriented_us = self.oriented_us.max(newest);
    }

    /// Updates the detectors with a fresh state, a state without a position, or none, and with the inbox's marks.
    pub(crate) fn watch(
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
                match inbox.rates() {
                    None => flight.tumble.advance(state, gap_us),
                    // A pilot who commands rates may turn the vehicle over.
                    Some(_) => flight.tumble = Tumble::default(),
                }
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

/// Runs the fall check on the vehicle's own estimate. It is not inlined, to keep ticks without an own estimate fast.
#[inline(never)]
fn check_fall(fall: &mut FallCheck, landing: &mut LandDetector, thrust_n: f32, state: &State, dt_s: f32) {
    if fall.stands(&state.velocity_m_s, landing.thrust_share(thrust_n), dt_s) {
        landing.touch_down(state);
    }
}
