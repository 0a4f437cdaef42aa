//! What a tick works from: the newest of everything, when it was measured, and what is asked for.

use crate::supervisor::Request;
use afbc_types::{Setpoint, State};

/// A value and the time it belongs to, on the vehicle's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stamped<T> {
    /// The value.
    pub value: T,
    /// Time since power-up \[us\].
    pub at_us: u64,
}

impl<T> Stamped<T> {
    /// How long ago, at `now_us`. A stamp from the future is no measurement: it counts as infinitely old.
    pub fn age_us(&self, now_us: u64) -> u64 {
        now_us.checked_sub(self.at_us).unwrap_or(u64::MAX)
    }
}

/// A request, and the ticket by which whoever asked knows its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    /// What is asked for.
    pub request: Request,
    /// Comes back with the answer; nothing else is done with it.
    pub ticket: u8,
}

/// Most requests that wait at once.
pub const REQUESTS_MAX: usize = 4;

/// Newest inputs. The link writes it, the control tick takes it. What is not plausible does not get in: the tick trusts
/// what it finds here.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inbox {
    state: Option<Stamped<State>>,
    setpoint: Option<Stamped<Setpoint>>,
    /// In the order in which they came, none behind an empty place.
    requests: [Option<Asked>; REQUESTS_MAX],
}

impl Inbox {
    /// Nothing yet.
    pub const EMPTY: Self = Inbox { state: None, setpoint: None, requests: [None; REQUESTS_MAX] };

    /// Takes in a measured state, stamped by a [`Tracker`](crate::Tracker); does nothing with one that is not
    /// [plausible](State::is_plausible).
    pub fn put_state(&mut self, state: Stamped<State>) {
        if state.value.is_plausible() {
            self.state = Some(state);
        }
    }

    /// Takes in a setpoint, stamped on arrival; does nothing with one that is not [plausible](Setpoint::is_plausible).
    pub fn put_setpoint(&mut self, setpoint: Stamped<Setpoint>) {
        if setpoint.value.is_plausible() {
            self.setpoint = Some(setpoint);
        }
    }

    /// Newest plausible state.
    pub fn state(&self) -> Option<&Stamped<State>> {
        self.state.as_ref()
    }

    /// Newest plausible setpoint.
    pub fn setpoint(&self) -> Option<&Stamped<Setpoint>> {
        self.setpoint.as_ref()
    }

    /// The oldest request, which the next tick answers.
    pub fn asked(&self) -> Option<Asked> {
        self.requests.first().copied().flatten()
    }

    /// True if one of the requests is [`Request::Kill`]: it does not wait for those before it.
    pub fn kills(&self) -> bool {
        self.requests.iter().flatten().any(|asked| asked.request == Request::Kill)
    }

    /// Adds `news` to what the next tick will work from.
    pub fn post(&mut self, news: &Inbox) {
        self.state = news.state.or(self.state);
        self.setpoint = news.setpoint.or(self.setpoint);
        for asked in news.requests.iter().flatten() {
            self.request(*asked);
        }
    }

    /// Leaves a request for the next ticks, each of which answers one. False if [`REQUESTS_MAX`] wait already: it is not
    /// left then, unless it is [`Request::Kill`], which takes the newest one's place.
    pub fn request(&mut self, asked: Asked) -> bool {
        let free = self.requests.iter().position(Option::is_none);
        let newest = (asked.request == Request::Kill).then_some(REQUESTS_MAX - 1);
        match free.or(newest).and_then(|place| self.requests.get_mut(place)) {
            Some(place) => {
                *place = Some(asked);
                true
            }
            None => false,
        }
    }

    /// What the next tick works from: a copy of everything, and the oldest request is done with.
    pub fn take(&mut self) -> Inbox {
        let taken = *self;
        // By hand: turning a slice round costs a hundred instructions.
        let [_, second, third, fourth] = self.requests;
        self.requests = [second, third, fourth, None];
        taken
    }
}
