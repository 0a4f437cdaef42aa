//! Selection of the tracker, and of its states. Not in the paper.
//!
//! Each sender has its own [`SourceClock`]. One sender is used at a time: the first one heard, until it has sent
//! nothing new for [`SILENT_US`]. Two trackers need not have the same origin.

use crate::clock::SourceClock;
use crate::inbox::Stamped;
use crate::supervisor::COAST_US;
use afbc_types::State;

/// Number of senders whose clocks are tracked; a further one replaces the one that has been silent longest.
pub const SENDERS_MAX: usize = 4;
/// Silence of the sender in use after which another one replaces it \[us\].
pub const SILENT_US: u64 = 50_000;

/// States that were not used, since power-up. Each count stops at `u32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Refused {
    /// Out of order or duplicate.
    pub overtaken: u32,
    /// Older than 20 ms on arrival.
    pub late: u32,
    /// From another sender than the one in use.
    pub elsewhere: u32,
}

/// Selects and stamps states.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tracker {
    senders: [Option<Sender>; SENDERS_MAX],
    /// The sender in use, and when it last sent something new \[us\].
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
    /// Returns the state that `sender` measured at `sent_us` of its own clock and that arrived at `arrived_us`, stamped
    /// with the vehicle's clock; none if it must not be used.
    pub fn stamp(&mut self, sender: u16, sent_us: u64, arrived_us: u64, state: State) -> Option<Stamped<State>> {
        let known = self.sender(sender, arrived_us, &state);
        let differs = known.last != state;
        let at_us = known.clock.stamp(sent_us, arrived_us, differs);
        (known.last, known.heard_us) = (state, arrived_us);
        let Refused { overtaken, late, elsewhere } = &mut self.refused;
        let refused = match (at_us, self.in_use) {
            (None, _) => overtaken,
            (Some(at_us), _) if arrived_us - at_us > COAST_US.into() => late,
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

    /// Returns the counts of refused states.
    pub fn refused(&self) -> &Refused {
        &self.refused
    }

    /// Returns the record of a sender, a new one if it is unknown.
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
