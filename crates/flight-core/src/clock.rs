//! When a message was sent, on the vehicle's clock, from the time that its sender stamped on it. Ours.
//!
//! The zero of a sender's clock is unknown, and the clock may be slewed, stepped, wrapped or coarse. What is known of a
//! message is its offset, arrival minus stamp: the difference of the two clocks plus the message's delay. The least offset
//! of the last half to whole second ([`WINDOW_US`]) belongs to the fastest message; any other was late by what its own is
//! more. So a message that was held up on its way is as old as it is, not as old as its arrival. The delay of the fastest
//! message itself cannot be known, and a delay that stays longer than the window becomes part of it.
//!
//! | the stamp | is taken for |
//! |---|---|
//! | up to 2 ms ahead of the fastest | a faster message: the new least offset, which also follows a clock that gains |
//! | further ahead | an outlier: sent when it arrived. Five in a row are a clock that stepped ahead; of a sender's first messages, two |
//! | not above the last one's | overtaken on its way: refused. Three in a row that rise among themselves for 15 ms, with the same offset to 3 ms, are a clock that stepped back or wrapped |
//! | equal to the last one's on another message | a coarse clock's: it tells nothing, and the next ones no more than its resolution allows |
//! | anything after 3 s of silence | a new clock's |

/// Half of the window over which the fastest message is sought \[us\].
pub const WINDOW_US: u64 = 500_000;
/// How far ahead of the fastest message another one is believed at once \[us\].
pub const AHEAD_US: u64 = 2_000;
/// Messages in a row that are further ahead than that until the clock is taken to have stepped.
pub const AHEAD_COUNT: u8 = 5;
/// Messages in a row behind the last one, and how long they have to go on \[us\], until the clock is taken to have stepped.
pub const BACK_COUNT: u8 = 3;
/// See [`BACK_COUNT`].
pub const BACK_US: u64 = 15_000;
/// How far apart the offsets of these messages may lie \[us\].
pub const BACK_SPREAD_US: u64 = 3_000;
/// The same among the first [`NEW_COUNT`] messages of a sender: its very first ones may have been slow.
pub const AHEAD_COUNT_NEW: u8 = 2;
/// See [`AHEAD_COUNT_NEW`].
pub const NEW_COUNT: u8 = 10;
/// After a silence of this long everything is forgotten \[us\]: no flight depends on it by then
/// ([`crate::supervisor::GIVE_UP_US`]).
pub const SILENCE_US: u64 = 3_000_000;

/// What is known of a sender's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SourceClock {
    known: Option<Known>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Known {
    sent_us: u64,
    arrived_us: u64,
    /// Messages heard, up to 255.
    heard: u8,
    /// Least offset of the present half window and of the one before \[us\].
    least_us: [i128; 2],
    /// When the present half window began \[us\].
    half_since_us: u64,
    step: Option<Step>,
    /// Least time between two stamps \[us\], and until when stamps count as coarse as that.
    tick_us: u64,
    coarse_until_us: u64,
}

/// Messages in a row that look like a clock that was stepped.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    ahead: bool,
    count: u8,
    since_us: u64,
    sent_us: u64,
    /// Of those ahead the largest, of those behind the first.
    offset_us: i128,
}

impl SourceClock {
    /// The time \[us\] on the vehicle's clock of a message stamped `sent_us`, which arrived at `arrived_us` of the vehicle's
    /// clock; never after its arrival. `differs` tells whether it says anything else than the last one.
    ///
    /// `None` if it is the last one once more, or a later one overtook it: drop it.
    pub fn stamp(&mut self, sent_us: u64, arrived_us: u64, differs: bool) -> Option<u64> {
        let heard_lately = |known: &&mut Known| arrived_us.saturating_sub(known.arrived_us) <= SILENCE_US;
        let Some(known) = self.known.as_mut().filter(heard_lately) else {
            self.known = Some(Known::new(sent_us, arrived_us));
            return Some(arrived_us);
        };
        let (old, goes_on_back) = (sent_us < known.sent_us, known.goes_on_back(sent_us, arrived_us));
        if (old || goes_on_back) && known.steps_back(sent_us, arrived_us) {
            return Some(arrived_us);
        }
        if old {
            return None;
        }
        if known.is_far_ahead(sent_us, arrived_us) {
            known.steps_ahead(sent_us, arrived_us);
            return Some(arrived_us);
        }
        if sent_us == known.sent_us {
            if !differs {
                return None;
            }
            known.coarse_until_us = arrived_us.saturating_add(2 * WINDOW_US);
            known.arrived_us = arrived_us;
            return Some(arrived_us);
        }
        known.tick_us = known.tick_us.min(sent_us - known.sent_us);
        let at_us = known.stamp(sent_us, arrived_us);
        if !goes_on_back {
            known.step = None;
        }
        Some(at_us)
    }
}

/// Arrival minus stamp \[us\]; of any two times.
fn offset_us(sent_us: u64, arrived_us: u64) -> i128 {
    i128::from(arrived_us) - i128::from(sent_us)
}

impl Known {
    fn new(sent_us: u64, arrived_us: u64) -> Self {
        Known {
            sent_us,
            arrived_us,
            heard: 1,
            least_us: [offset_us(sent_us, arrived_us); 2],
            half_since_us: arrived_us,
            step: None,
            tick_us: u64::MAX,
            coarse_until_us: 0,
        }
    }

    /// The offset of the fastest message in the window.
    fn fastest_us(&self) -> i128 {
        let [present_us, before_us] = self.least_us;
        present_us.min(before_us)
    }

    fn is_far_ahead(&self, sent_us: u64, arrived_us: u64) -> bool {
        self.fastest_us() - offset_us(sent_us, arrived_us) > AHEAD_US.into()
    }

    /// The time of a message that is no older than the last one, and not far ahead.
    fn stamp(&mut self, sent_us: u64, arrived_us: u64) -> u64 {
        let offset_us = offset_us(sent_us, arrived_us);
        (self.sent_us, self.arrived_us) = (sent_us, arrived_us);
        self.heard = self.heard.saturating_add(1);
        let [present_us, before_us] = self.least_us;
        if arrived_us.saturating_sub(self.half_since_us) > WINDOW_US {
            self.least_us = [offset_us, present_us];
            self.half_since_us = arrived_us;
        } else {
            self.least_us = [offset_us.min(present_us), before_us];
        }
        let late_us = u64::try_from(offset_us - self.fastest_us()).unwrap_or(u64::MAX);
        let doubt_us = if arrived_us < self.coarse_until_us { self.tick_us } else { 0 };
        arrived_us.saturating_sub(late_us.saturating_sub(doubt_us))
    }

    /// Counts a message that is too far ahead. The last of them begins a new window.
    fn steps_ahead(&mut self, sent_us: u64, arrived_us: u64) {
        let offset_us = offset_us(sent_us, arrived_us);
        let goes_on = |step: &Step| step.ahead && sent_us >= step.sent_us;
        let new = Step { ahead: true, count: 0, since_us: arrived_us, sent_us, offset_us };
        let step = self.step.filter(goes_on).unwrap_or(new);
        let slowest_us = step.offset_us.max(offset_us);
        let (count, needed) = (step.count + 1, if self.heard < NEW_COUNT { AHEAD_COUNT_NEW } else { AHEAD_COUNT });
        self.arrived_us = arrived_us;
        self.step = Some(Step { count, sent_us, offset_us: slowest_us, ..step });
        if count >= needed {
            let heard = self.heard.saturating_add(count);
            *self = Known { heard, least_us: [slowest_us; 2], ..Known::new(sent_us, arrived_us) };
        }
    }

    /// True if a message goes on where messages of a clock that was set back left off.
    fn goes_on_back(&self, sent_us: u64, arrived_us: u64) -> bool {
        self.step.is_some_and(|step| {
            let spread_us = (offset_us(sent_us, arrived_us) - step.offset_us).unsigned_abs();
            !step.ahead && sent_us > step.sent_us && spread_us <= BACK_SPREAD_US.into()
        })
    }

    /// Counts a message that is older than the last one, or goes on from such; true if it shows that the clock was stepped
    /// back.
    fn steps_back(&mut self, sent_us: u64, arrived_us: u64) -> bool {
        let offset_us = offset_us(sent_us, arrived_us);
        let new = Step { ahead: false, count: 0, since_us: arrived_us, sent_us, offset_us };
        let step = self.step.filter(|_| self.goes_on_back(sent_us, arrived_us)).unwrap_or(new);
        let count = step.count.saturating_add(1);
        self.step = Some(Step { count, sent_us, ..step });
        let stepped = count >= BACK_COUNT && arrived_us.saturating_sub(step.since_us) >= BACK_US;
        if stepped {
            *self = Known::new(sent_us, arrived_us);
        }
        stepped
    }
}
