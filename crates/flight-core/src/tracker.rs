//! Whose states are flown on, and which of them. Ours.
//!
//! Each sender has a [`SourceClock`] of its own, and one sender is flown on at a time: the first one heard, until it has had
//! nothing new to say for [`SILENT_US`]. Two trackers need not agree on where the origin is.

use crate::clock::SourceClock;
use crate::inbox::Stamped;
use crate::supervisor::COAST_US;
use afbc_types::State;

/// Senders whose clocks are known at once; another one takes the place of the one that was silent for longest.
pub const SENDERS_MAX: usize = 4;
/// How long the sender in use has nothing new to say before another one takes its place \[us\].
pub const SILENT_US: u64 = 50_000;

/// States that were not flown on, since power-up. Each count stops at `u32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Refused {
    /// A later one had overtaken it, or it came twice.
    pub overtaken: u32,
    /// It was older than 20 ms when it came.
    pub late: u32,
    /// Another sender is in use.
    pub elsewhere: u32,
}

/// Chooses and stamps states.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tracker {
    senders: [Option<Sender>; SENDERS_MAX],
    /// Who is flown on, and when it last had something new to say \[us\].
    in_use: Option<(u16, u64)>,
    refused: Refused,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Sender {
    id: u16,
    clock: SourceClock,
    last: State,
    heard_us: u64,
}

impl Tracker {
    /// The state that `sender` measured at `sent_us` of its own clock and that arrived at `arrived_us`, stamped on the
    /// vehicle's clock; none if it is not to be flown on.
    pub fn stamp(&mut self, sender: u16, sent_us: u64, arrived_us: u64, state: State) -> Option<Stamped<State>> {
        let known = self.sender(sender, arrived_us, &state);
        let differs = known.last != state;
        let at_us = known.clock.stamp(sent_us, arrived_us, differs);
        (known.last, known.heard_us) = (state, arrived_us);
        let Refused { overtaken, late, elsewhere } = &mut self.refused;
        let refused = match (at_us, self.in_use) {
            (None, _) => overtaken,
            (Some(at_us), _) if arrived_us - at_us > COAST_US => late,
            (_, Some((id, news_us))) if id != sender && arrived_us.saturating_sub(news_us) <= SILENT_US => elsewhere,
            (Some(at_us), in_use) => {
                if differs || in_use.is_none_or(|(id, _)| id != sender) {
                    self.in_use = Some((sender, arrived_us));
                }
                return Some(Stamped { value: state, at_us });
            }
        };
        *refused = refused.saturating_add(1);
        None
    }

    /// What was refused so far.
    pub fn refused(&self) -> &Refused {
        &self.refused
    }

    /// What is known of a sender; of a new one, nothing.
    fn sender(&mut self, id: u16, now_us: u64, state: &State) -> &mut Sender {
        let new = Sender { id, clock: SourceClock::default(), last: *state, heard_us: now_us };
        let place = |place: &Option<Sender>| match place {
            Some(sender) if sender.id == id => (0, 0),
            None => (1, 0),
            Some(sender) => (2, sender.heard_us),
        };
        let [first, rest @ ..] = &mut self.senders;
        let place = rest.iter_mut().fold(first, |best, other| if place(other) < place(best) { other } else { best });
        if place.is_some_and(|sender| sender.id != id) {
            *place = None;
        }
        place.get_or_insert(new)
    }
}
