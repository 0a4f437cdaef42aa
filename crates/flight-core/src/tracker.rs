//! Selection of a tracker, and of its states and poses. Not in the paper.
//!
//! Each sender has its own [`SourceClock`]. Only one sender is used at a time, since two trackers need not have the
//! same origin. The first sender heard is used until it has sent nothing new for [`SILENT_US`], or longer if its
//! measurements may be older.

use crate::clock::SourceClock;
use crate::supervisor::COAST_US;
use afbc_types::{Pose, Stamped, State};
use core::mem::discriminant;

/// Number of senders whose clocks are tracked. A further one replaces the one silent for longest.
pub const SENDERS_MAX: usize = 4;
/// Silence after which another sender replaces the one in use \[us\].
pub const SILENT_US: u64 = 50_000;
/// Largest age on arrival of a measurement for the vehicle's own estimator \[us\], which can fuse measurements up to
/// this old.
pub const POSE_AGE_MAX_US: u64 = 250_000;

/// Measurement sent by a tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sighting {
    /// A state.
    State(State),
    /// A pose.
    Pose(Pose),
}

/// Number of unused states and poses since power-up, by reason. Each count stops at `u32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Refused {
    /// Number out of order or duplicate.
    pub overtaken: u32,
    /// Number older than 20 ms on arrival, or than [`POSE_AGE_MAX_US`] if sent to the vehicle's own estimator.
    pub late: u32,
    /// Number from a sender that is not in use.
    pub elsewhere: u32,
}

/// Selects and stamps states and poses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tracker {
    senders: [Option<Sender>; SENDERS_MAX],
    /// Sender in use, and the time of its last new measurement \[us\].
    in_use: Option<(u16, u64)>,
    refused: Refused,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Sender {
    id: u16,
    clock: SourceClock,
    last: Sighting,
    heard_us: u64,
}

impl Tracker {
    /// Returns a state stamped with the vehicle's clock; `None` if it must not be used. `sender` measured it at
    /// `sent_us` of its own clock, and it arrived at `arrived_us`.
    pub fn stamp(&mut self, sender: u16, sent_us: u64, arrived_us: u64, state: State) -> Option<Stamped<State>> {
        let at_us = self.sight(sender, sent_us, arrived_us, Sighting::State(state), COAST_US.into())?;
        Some(Stamped { value: state, at_us })
    }

    /// As [`stamp`](Self::stamp), for a state or a pose that may be up to `age_max_us` old. Returns its time.
    pub fn sight(
        &mut self,
        sender: u16,
        sent_us: u64,
        arrived_us: u64,
        sighting: Sighting,
        age_max_us: u64,
    ) -> Option<u64> {
        let known = self.sender(sender, arrived_us, &sighting);
        let differs = known.last != sighting;
        // A state and a pose with the same stamp are the same measurement, sent twice.
        let is_kind = discriminant(&known.last) == discriminant(&sighting);
        let at_us = known.clock.stamp(sent_us, arrived_us, differs && is_kind);
        (known.last, known.heard_us) = (sighting, arrived_us);
        let silent_us = SILENT_US.max(age_max_us);
        let Refused { overtaken, late, elsewhere } = &mut self.refused;
        let refused = match (at_us, self.in_use) {
            (None, _) => overtaken,
            // The difference cannot underflow, because the clock returns no time after the arrival.
            (Some(at_us), _) if arrived_us - at_us > age_max_us => late,
            (_, Some((id, news_us))) if id != sender && arrived_us.saturating_sub(news_us) <= silent_us => elsewhere,
            (Some(at_us), in_use) => {
                // A sender that only repeats itself is frozen, and another may replace it after a while.
                if differs || in_use.is_none_or(|(id, _)| id != sender) {
                    self.in_use = Some((sender, arrived_us));
                }
                return Some(at_us);
            }
        };
        *refused = refused.saturating_add(1);
        None
    }

    /// Returns the counts of refused states and poses.
    pub fn refused(&self) -> &Refused {
        &self.refused
    }

    /// Returns the record of a sender, or a new one for an unknown sender.
    fn sender(&mut self, id: u16, now_us: u64, sighting: &Sighting) -> &mut Sender {
        let new = Sender { id, clock: SourceClock::default(), last: *sighting, heard_us: now_us };
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
