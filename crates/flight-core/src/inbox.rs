//! Inputs of a tick: the newest state, pose and setpoint, with their times, and requests.

use crate::rate_control::RateTarget;
use crate::reasons::Reasons;
use crate::supervisor::{Refusal, Request};
use afbc_types::{Pose, ResetDelta, Setpoint, Stamped, State};
use heapless::Deque;

/// Something asked for, with a ticket that identifies its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ticketed<T> {
    /// What is asked for.
    pub value: T,
    /// Returned with the answer, and not used otherwise.
    pub ticket: u8,
}

/// Values in the order of arrival; a tick answers one.
pub type Queue<T> = Deque<Ticketed<T>, QUEUE_MAX>;

/// Largest number of values in a [`Queue`].
pub const QUEUE_MAX: usize = 4;

/// Newest inputs, written by the link and taken by the control tick. Implausible values are rejected here, so the tick
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
    /// True if the vehicle rests on the ground.
    idle_on_ground: Option<bool>,
    /// Of this tick alone, from the guidance: not merged, taken or recorded.
    #[cfg_attr(feature = "serde", serde(skip))]
    rates: Option<RateTarget>,
    /// Likewise: by how much the vehicle's own estimate has been set anew.
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

    /// Stores a state of the vehicle's own estimate, which is always [plausible](State::is_plausible), in place of any
    /// other.
    pub fn locate(&mut self, state: Stamped<State>) {
        (self.state, self.own, self.position_lost, self.missing) = (Some(state), true, None, None);
    }

    /// Stores a state of the vehicle's own estimate, which `missing` something and does not know where it is: attitude,
    /// rates, height and vertical velocity may be used, the horizontal position and velocity may not. It replaces any
    /// other state. Without one, what the link says stands.
    pub fn put_position_lost(&mut self, state: Option<Stamped<State>>, missing: Refusal) {
        self.position_lost = state;
        if self.position_lost.is_some() {
            self.state = None;
        }
        self.missing = Some(missing);
    }

    /// Stores a tracker's pose for the vehicle's own estimate, stamped by a [`Tracker`](crate::Tracker), if it is
    /// [plausible](Pose::is_plausible). The flight core uses one that the estimate [leaves](Self::clear_pose), which it
    /// does without an inertial sensor ([`crate::observer`]).
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

    /// Marks whether an armed vehicle rests on the ground: its motors idle, and the law does not fly, until the mark is
    /// taken away. A vehicle that counts as airborne, which has just touched the ground, keeps what its law has learnt.
    pub fn set_idle_on_ground(&mut self, idle_on_ground: bool) {
        self.idle_on_ground = Some(idle_on_ground);
    }

    /// True if an armed vehicle on the ground [rests](Self::set_idle_on_ground) there.
    pub fn idle_on_ground(&self) -> bool {
        self.idle_on_ground == Some(true)
    }

    /// Sets the rates that a pilot commands in this tick in place of the setpoint, if any: a flying vehicle whose state
    /// is known turns by them, and is not found tumbling. Implausible ones count as none.
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

    /// Notes by how much the vehicle's own estimate has been set anew in this tick, if it has.
    #[inline]
    pub fn hand_over(&mut self, reset: Option<&ResetDelta>) {
        self.reset = None;
        if let Some(reset) = reset {
            self.reset = Some(*reset);
        }
    }

    /// Returns by how much the vehicle's own estimate [has been set anew](Self::hand_over).
    pub fn reset(&self) -> Option<&ResetDelta> {
        self.reset.as_ref()
    }

    /// Sets what speaks against arming besides what the flight core checks itself.
    pub fn inhibit(&mut self, reasons: Reasons) {
        self.inhibited = reasons;
    }

    /// Returns what else [speaks against arming](Self::inhibit).
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

    /// Returns the newest state of a vehicle that [does not know where it is](Self::put_position_lost).
    pub fn position_lost(&self) -> Option<&Stamped<State>> {
        self.position_lost.as_ref()
    }

    /// Returns what the vehicle's estimate misses; none if it has none of its own.
    pub fn missing(&self) -> Option<Refusal> {
        self.missing
    }

    /// Returns the newest plausible pose, if it has not been [taken](Self::take) before.
    pub fn pose(&self) -> Option<&Stamped<Pose>> {
        self.pose.as_ref()
    }

    /// Removes the pose: an estimator has taken it.
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

    /// Merges `news` into this inbox.
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

    /// Queues a request; each tick answers one. False if [`QUEUE_MAX`] are queued already: then it is dropped, unless
    /// it is [`Request::Kill`], which replaces the newest one.
    pub fn request(&mut self, asked: Ticketed<Request>) -> bool {
        if asked.value == Request::Kill && self.requests.is_full() {
            self.requests.pop_back();
        }
        self.requests.push_back(asked).is_ok()
    }

    /// Returns a copy for the next tick, and removes the pose and the oldest request.
    pub fn take(&mut self) -> Inbox {
        let mut taken = Inbox::EMPTY;
        self.take_into(&mut taken);
        taken
    }

    /// Does as [`take`](Self::take), in place of the copy for the last tick.
    #[inline]
    pub fn take_into(&mut self, taken: &mut Inbox) {
        (taken.state, taken.own) = (self.state, self.own);
        // Hardly ever there: only the mark is copied.
        match &self.position_lost {
            Some(position_lost) => taken.position_lost = Some(*position_lost),
            None => taken.position_lost = None,
        }
        taken.missing = self.missing;
        // Rarely there, and only once.
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
        // Rarely there.
        if !(self.requests.is_empty() && taken.requests.is_empty()) {
            taken.requests.clone_from(&self.requests);
            self.requests.pop_front();
        }
    }
}

/// Puts a setpoint in the place of another one.
fn replace(old: &mut Option<Stamped<Setpoint>>, new: &Stamped<Setpoint>) {
    match old {
        Some(old) => {
            copy(&new.value, &mut old.value);
            old.at_us = new.at_us;
        }
        None => *old = Some(*new),
    }
}

/// Copies field by field, since the copy of a large struct is a call of a slow loop.
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
