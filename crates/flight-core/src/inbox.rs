//! Inputs of a tick: newest state, pose and setpoint with their times, and requests.

use crate::rate_control::RateTarget;
use crate::reasons::Reasons;
use crate::supervisor::{Refusal, Request};
use afbc_types::{Pose, ResetDelta, Setpoint, Stamped, State};
use heapless::Deque;

/// A request with a ticket that identifies its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ticketed<T> {
    /// The request.
    pub value: T,
    /// Returned with the answer, and not used otherwise.
    pub ticket: u8,
}

/// Requests in the order of arrival; each tick answers one.
pub type Queue<T> = Deque<Ticketed<T>, QUEUE_MAX>;

/// Capacity of a [`Queue`].
pub const QUEUE_MAX: usize = 4;

/// Newest inputs, written by the link and taken by the control tick. The inbox rejects implausible values, so the tick
/// need not check them.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Inbox {
    state: Option<Stamped<State>>,
    /// True if the state is the vehicle's own estimate.
    own: bool,
    position_lost: Option<Stamped<State>>,
    missing: Option<Refusal>,
    pose: Option<Stamped<Pose>>,
    setpoint: Option<Stamped<Setpoint>>,
    /// True if the vehicle idles on the ground.
    idle_on_ground: Option<bool>,
    /// Rates of this tick only, from the guidance: not merged, taken or recorded.
    #[cfg_attr(feature = "serde", serde(skip))]
    rates: Option<RateTarget>,
    /// Estimator reset of this tick only: not merged, taken or recorded.
    #[cfg_attr(feature = "serde", serde(skip))]
    reset: Option<ResetDelta>,
    inhibited: Reasons,
    requests: Queue<Request>,
}

impl Inbox {
    /// An empty inbox.
    pub const EMPTY: Self = Inbox {
        state: None,
        own: false,
        position_lost: None,
        missing: None,
        pose: None,
        setpoint: None,
        idle_on_ground: None,
        rates: None,
        reset: None,
        inhibited: Reasons::NONE,
        requests: Queue::new(),
    };

    /// Stores a measured state, stamped by a [`Tracker`](crate::Tracker), if it is [plausible](State::is_plausible).
    pub fn put_state(&mut self, state: Stamped<State>) {
        if state.value.is_plausible() {
            (self.state, self.own) = (Some(state), false);
        }
    }

    /// Stores a state of the vehicle's own estimate, which is always [plausible](State::is_plausible). It replaces any
    /// other state.
    pub fn locate(&mut self, state: Stamped<State>) {
        (self.state, self.own, self.position_lost, self.missing) = (Some(state), true, None, None);
    }

    /// Stores a state of the vehicle's own estimate without a position; `missing` says what the estimate lacks.
    /// Attitude, rates, height and vertical velocity are valid, horizontal position and velocity are not. It replaces
    /// any other state. If `state` is `None`, a state from the link stays.
    pub fn put_position_lost(&mut self, state: Option<Stamped<State>>, missing: Refusal) {
        self.position_lost = state;
        if self.position_lost.is_some() {
            self.state = None;
        }
        self.missing = Some(missing);
    }

    /// Stores a tracker's pose for the vehicle's own estimator, stamped by a [`Tracker`](crate::Tracker), if it is
    /// [plausible](Pose::is_plausible). The flight core uses a pose that the estimator does not
    /// [remove](Self::clear_pose), which happens without an inertial sensor ([`crate::observer`]).
    pub fn put_pose(&mut self, pose: Stamped<Pose>) {
        if pose.value.is_plausible() {
            self.pose = Some(pose);
        }
    }

    /// Stores a setpoint, stamped on arrival, if it is [plausible](Setpoint::is_plausible).
    pub fn put_setpoint(&mut self, setpoint: Stamped<Setpoint>) {
        if setpoint.value.is_plausible() {
            replace(&mut self.setpoint, &setpoint);
        }
    }

    /// Stores a setpoint of the vehicle's own guidance, which has checked that it is
    /// [plausible](Setpoint::is_plausible).
    pub fn put_own_setpoint(&mut self, setpoint: Stamped<Setpoint>) {
        replace(&mut self.setpoint, &setpoint);
    }

    /// Sets whether an armed vehicle idles on the ground: its motors idle and the law does not run until the mark is
    /// cleared. A vehicle that still counts as airborne, because it has just touched down, keeps the law's memory.
    pub fn set_idle_on_ground(&mut self, idle_on_ground: bool) {
        self.idle_on_ground = Some(idle_on_ground);
    }

    /// True if an armed vehicle [idles](Self::set_idle_on_ground) on the ground.
    pub fn idle_on_ground(&self) -> bool {
        self.idle_on_ground == Some(true)
    }

    /// Sets the body rates that a pilot commands in this tick instead of a setpoint, if any. A flying vehicle with a
    /// known state flies these rates, and is not checked for tumbling. Implausible rates count as none.
    #[inline]
    pub fn command_rates(&mut self, target: Option<&RateTarget>) {
        self.rates = None;
        if let Some(target) = target {
            self.rates = Some(*target).filter(RateTarget::is_plausible);
        }
    }

    /// Returns the rates that a pilot [commands](Self::command_rates).
    pub fn rates(&self) -> Option<&RateTarget> {
        self.rates.as_ref()
    }

    /// Sets the reset of the vehicle's own estimate in this tick, if there was one.
    #[inline]
    pub fn hand_over(&mut self, reset: Option<&ResetDelta>) {
        self.reset = None;
        if let Some(reset) = reset {
            self.reset = Some(*reset);
        }
    }

    /// Returns the [reset](Self::hand_over) of the vehicle's own estimate.
    pub fn reset(&self) -> Option<&ResetDelta> {
        self.reset.as_ref()
    }

    /// Sets the reasons against arming found outside the flight core.
    pub fn inhibit(&mut self, reasons: Reasons) {
        self.inhibited = reasons;
    }

    /// Returns the reasons against arming [found outside the flight core](Self::inhibit).
    pub fn inhibited(&self) -> Reasons {
        self.inhibited
    }

    /// Returns the newest plausible state.
    pub fn state(&self) -> Option<&Stamped<State>> {
        self.state.as_ref()
    }

    /// True if [the state](Self::state) is the vehicle's own estimate.
    pub fn is_own(&self) -> bool {
        self.own
    }

    /// Returns the newest state [without a position](Self::put_position_lost).
    pub fn position_lost(&self) -> Option<&Stamped<State>> {
        self.position_lost.as_ref()
    }

    /// Returns what the vehicle's estimate lacks; `None` if nothing, or without an estimate of its own.
    pub fn missing(&self) -> Option<Refusal> {
        self.missing
    }

    /// Returns the newest plausible pose, if not yet [taken](Self::take).
    pub fn pose(&self) -> Option<&Stamped<Pose>> {
        self.pose.as_ref()
    }

    /// Removes the pose, after an estimator has used it.
    pub fn clear_pose(&mut self) {
        self.pose = None;
    }

    /// Returns the newest plausible setpoint.
    pub fn setpoint(&self) -> Option<&Stamped<Setpoint>> {
        self.setpoint.as_ref()
    }

    /// Returns the oldest request, which the next tick answers.
    pub fn asked(&self) -> Option<Ticketed<Request>> {
        self.requests.front().copied()
    }

    /// True if one of the requests is [`Request::Kill`], which takes precedence over earlier ones.
    pub fn kills(&self) -> bool {
        self.requests.iter().any(|asked| asked.value == Request::Kill)
    }

    /// Merges newer inputs into this inbox.
    pub fn merge(&mut self, news: &Inbox) {
        self.state = news.state.or(self.state);
        self.position_lost = news.position_lost.or(self.position_lost);
        self.missing = news.missing.or(self.missing);
        if let Some(pose) = &news.pose {
            self.pose = Some(*pose);
        }
        self.setpoint = news.setpoint.or(self.setpoint);
        self.idle_on_ground = news.idle_on_ground.or(self.idle_on_ground);
        self.inhibited = if news.inhibited.is_empty() { self.inhibited } else { news.inhibited };
        for asked in &news.requests {
            self.request(*asked);
        }
    }

    /// Queues a request; each tick answers one. If the queue is full, drops the request and returns false. A
    /// [`Request::Kill`] replaces the newest request instead.
    pub fn request(&mut self, asked: Ticketed<Request>) -> bool {
        if asked.value == Request::Kill && self.requests.is_full() {
            self.requests.pop_back();
        }
        self.requests.push_back(asked).is_ok()
    }

    /// Returns a copy for the next tick. Removes the pose and the oldest request.
    pub fn take(&mut self) -> Inbox {
        let mut taken = Inbox::EMPTY;
        self.take_into(&mut taken);
        taken
    }

    /// As [`take`](Self::take), but overwrites the copy for the last tick.
    #[inline]
    pub fn take_into(&mut self, taken: &mut Inbox) {
        (taken.state, taken.own) = (self.state, self.own);
        // A lost position is rare. Usually only the `None` is copied.
        match &self.position_lost {
            Some(position_lost) => taken.position_lost = Some(*position_lost),
            None => taken.position_lost = None,
        }
        taken.missing = self.missing;
        // Poses are rare, and each pose is taken once.
        match &self.pose {
            Some(pose) => {
                taken.pose = Some(*pose);
                self.pose = None;
            }
            None => taken.pose = None,
        }
        match &self.setpoint {
            Some(setpoint) => replace(&mut taken.setpoint, setpoint),
            None => taken.setpoint = None,
        }
        (taken.idle_on_ground, taken.inhibited) = (self.idle_on_ground, self.inhibited);
        // Requests are rare: skip the copy without any.
        if !(self.requests.is_empty() && taken.requests.is_empty()) {
            taken.requests.clone_from(&self.requests);
            self.requests.pop_front();
        }
    }
}

/// Replaces a setpoint in place.
fn replace(old: &mut Option<Stamped<Setpoint>>, new: &Stamped<Setpoint>) {
    match old {
        Some(old) => {
            copy(&new.value, &mut old.value);
            old.at_us = new.at_us;
        }
        None => *old = Some(*new),
    }
}

/// Copies field by field, since copying a large struct calls a slow loop.
fn copy(from: &Setpoint, to: &mut Setpoint) {
    let Setpoint { position_m, velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4, .. } = from;
    to.position_m = *position_m;
    to.velocity_m_s = *velocity_m_s;
    to.acceleration_m_s2 = *acceleration_m_s2;
    to.jerk_m_s3 = *jerk_m_s3;
    to.snap_m_s4 = *snap_m_s4;
    let Setpoint { yaw_rad, yaw_rate_rad_s, yaw_acceleration_rad_s2, .. } = from;
    (to.yaw_rad, to.yaw_rate_rad_s, to.yaw_acceleration_rad_s2) = (*yaw_rad, *yaw_rate_rad_s, *yaw_acceleration_rad_s2);
}
