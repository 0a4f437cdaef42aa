//! What a tick works from: the newest of everything, and when it was measured.

use crate::supervisor::Request;
use airframe::{Setpoint, State};

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

/// Newest inputs. The link writes it, the control tick takes it. What is not plausible does not get in: the tick trusts
/// what it finds here.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inbox {
    state: Option<Stamped<State>>,
    setpoint: Option<Stamped<Setpoint>>,
    request: Option<Request>,
}

impl Inbox {
    /// Nothing yet.
    pub const EMPTY: Self = Inbox { state: None, setpoint: None, request: None };

    /// Takes in a measured state, stamped by a [`SourceClock`]; does nothing with one that is not
    /// [plausible](State::is_plausible).
    pub fn measure(&mut self, state: Stamped<State>) {
        if state.value.is_plausible() {
            self.state = Some(state);
        }
    }

    /// Takes in a setpoint, stamped on arrival; does nothing with one that is not [plausible](Setpoint::is_plausible).
    pub fn aim(&mut self, setpoint: Stamped<Setpoint>) {
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

    /// What was asked for since the last tick.
    pub fn request(&self) -> Option<Request> {
        self.request
    }

    /// Adds `news` to what the next tick will work from.
    pub fn post(&mut self, news: &Inbox) {
        self.state = news.state.or(self.state);
        self.setpoint = news.setpoint.or(self.setpoint);
        if let Some(request) = news.request {
            self.ask(request);
        }
    }

    /// Leaves `request` for the next tick. Of two that meet in one tick, disarming wins.
    pub fn ask(&mut self, request: Request) {
        if self.request != Some(Request::Disarm) {
            self.request = Some(request);
        }
    }

    /// What the next tick works from: a copy of everything, and the request is done with.
    pub fn take(&mut self) -> Inbox {
        Inbox { request: self.request.take(), ..*self }
    }
}

/// How fast two clocks may drift apart: 100 us in a second, 100 ppm.
const DRIFT_DIVISOR: u64 = 10_000;
/// A sender whose time jumps back after a silence of this long was restarted \[us\]. By then no flight depends on it
/// ([`crate::supervisor::GIVE_UP_US`]): what comes with old times sooner is old.
pub const RESTART_US: u64 = 3_000_000;

/// When a message was sent, on the vehicle's clock.
///
/// The sender stamps with its own clock, whose zero is unknown. The fastest message so far tells the difference of the
/// two clocks (plus that message's delay, which nobody can know); every message slower than that one was late by the
/// rest. So a state that was held up on its way is as old as it is, not as old as its arrival.
/// A difference is forgotten at 100 ppm, so that clocks may drift. Times must rise from message to message: a sender that
/// does not stamp is not heard.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SourceClock {
    last: Option<Last>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Last {
    sent_us: u64,
    arrived_us: u64,
    fastest: Fastest,
}

/// The fastest message so far.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fastest {
    /// Arrival minus sending, modulo 2^64.
    offset_us: u64,
    arrived_us: u64,
}

impl SourceClock {
    /// The time \[us\] on the vehicle's clock of a message sent at `sent_us` of the sender's clock, which arrived at
    /// `arrived_us` of the vehicle's; never after its arrival. `None` if a later one arrived before it: drop it.
    pub fn stamp(&mut self, sent_us: u64, arrived_us: u64) -> Option<u64> {
        let this = Fastest { offset_us: arrived_us.wrapping_sub(sent_us), arrived_us };
        let restarted = |last: &Last| sent_us < last.sent_us && arrived_us.saturating_sub(last.arrived_us) > RESTART_US;
        let (fastest, offset_us) = match self.last.filter(|last| !restarted(last)) {
            None => (this, this.offset_us),
            Some(last) if sent_us <= last.sent_us => return None,
            Some(Last { fastest, .. }) => {
                let drift_us = arrived_us.saturating_sub(fastest.arrived_us) / DRIFT_DIVISOR;
                let relaxed_us = fastest.offset_us.wrapping_add(drift_us);
                // The smaller of two numbers modulo 2^64 that lie close together.
                let faster = (this.offset_us.wrapping_sub(relaxed_us) as i64) <= 0;
                if faster { (this, this.offset_us) } else { (fastest, relaxed_us) }
            }
        };
        self.last = Some(Last { sent_us, arrived_us, fastest });
        Some(sent_us.wrapping_add(offset_us))
    }
}
