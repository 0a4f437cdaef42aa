//! Converts a sender's time stamps to the vehicle's clock. Not in the paper.
//!
//! The zero of a sender's clock is unknown, and the clock may be slewed, stepped, wrapped or coarse. The offset of a
//! message is its arrival minus its stamp: the difference of the two clocks plus the message's delay. The smallest
//! offset of the last half to whole second ([`WINDOW_US`]) belongs to the fastest message. Any other message is late by
//! the difference between its offset and this smallest offset. Thus the age of a delayed message includes its delay.
//! The delay of the fastest message itself is unknown, and a delay longer than the window becomes part of the offset.
//!
//! | stamp | interpretation |
//! |---|---|
//! | up to 2 ms ahead of the fastest | a faster message, now the smallest offset; also tracks a gaining clock |
//! | further ahead | an outlier, taken as sent on arrival; repeated, a step ahead |
//! | not above the previous one | out of order, refused; repeated and increasing, a step back or a wrap |
//! | equal to the previous one, other content | coarse clock: counts as sent on arrival |
//! | any, after 3 s of silence | a new clock |
//!
//! A clock that sends equal stamps counts as coarse for 1 s. During this time, a stamp that is early by up to the
//! clock's resolution does not mean a delay.
//!
//! The clock counts as stepped ahead after five stamps in a row, or after two among a sender's first messages. The
//! clock counts as stepped back after three stamps in a row that increase over 15 ms with offsets within 3 ms.

/// Half of the window in which the fastest message is found \[us\].
pub const WINDOW_US: u64 = 500_000;
/// A stamp may lie at most this long ahead of the fastest message \[us\].
pub const AHEAD_US: u64 = 2_000;
/// The clock counts as stepped ahead after this many messages in a row beyond [`AHEAD_US`].
pub const AHEAD_COUNT: u8 = 5;
/// The clock counts as stepped back after this many messages in a row behind the previous stamp, over [`BACK_US`].
pub const BACK_COUNT: u8 = 3;
/// Smallest duration of the messages counted by [`BACK_COUNT`] \[us\].
pub const BACK_US: u64 = 15_000;
/// Largest spread of the offsets of the messages counted by [`BACK_COUNT`] \[us\].
pub const BACK_SPREAD_US: u64 = 3_000;
/// Like [`AHEAD_COUNT`], for the first [`NEW_COUNT`] messages of a sender, which may all have been late.
pub const AHEAD_COUNT_NEW: u8 = 2;
/// Number of a sender's first messages to which [`AHEAD_COUNT_NEW`] applies.
pub const NEW_COUNT: u8 = 10;
/// Silence after which the offsets are forgotten \[us\]. By then no flight depends on the sender
/// ([`crate::supervisor::GIVE_UP_US`]).
pub const SILENCE_US: u64 = 3_000_000;

/// Tracks one sender's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SourceClock {
    known: Option<KnownOffset>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct KnownOffset {
    sent_us: u64,
    arrived_us: u64,
    /// Number of messages heard, up to 255.
    heard: u8,
    /// Smallest offset of the present and of the previous half window \[us\].
    least_us: [i128; 2],
    /// Start of the present half window \[us\].
    half_since_us: u64,
    step: Option<ClockStep>,
    /// Smallest time between two stamps \[us\], and time until which the clock counts as coarse \[us\].
    tick_us: u64,
    coarse_until_us: u64,
}

/// Consecutive messages that may indicate a step of the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ClockStep {
    ahead: bool,
    count: u8,
    since_us: u64,
    sent_us: u64,
    /// Largest offset of messages ahead, or first offset of messages behind \[us\].
    offset_us: i128,
}

impl SourceClock {
    /// Returns the time of a message on the vehicle's clock \[us\], never after its arrival. `sent_us` is the sender's
    /// stamp, `arrived_us` the arrival on the vehicle's clock. `differs` is true if the content differs from the
    /// previous message's.
    ///
    /// `None` if the message is a duplicate or out of order, and must be dropped.
    pub fn stamp(&mut self, sent_us: u64, arrived_us: u64, differs: bool) -> Option<u64> {
        let heard_lately = |known: &&mut KnownOffset| arrived_us.saturating_sub(known.arrived_us) <= SILENCE_US;
        let Some(known) = self.known.as_mut().filter(heard_lately) else {
            self.known = Some(KnownOffset::new(sent_us, arrived_us));
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
        // The difference cannot underflow, because older and equal stamps have returned above.
        known.tick_us = known.tick_us.min(sent_us - known.sent_us);
        let at_us = known.stamp(sent_us, arrived_us);
        if !goes_on_back {
            known.step = None;
        }
        Some(at_us)
    }
}

/// Returns arrival minus stamp \[us\].
fn offset_us(sent_us: u64, arrived_us: u64) -> i128 {
    // Senders may stamp anything, and the difference of two u64 does not fit i64.
    i128::from(arrived_us) - i128::from(sent_us)
}

impl KnownOffset {
    fn new(sent_us: u64, arrived_us: u64) -> Self {
        KnownOffset {
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

    /// Returns the smallest offset in the window.
    fn fastest_us(&self) -> i128 {
        let [present_us, before_us] = self.least_us;
        present_us.min(before_us)
    }

    fn is_far_ahead(&self, sent_us: u64, arrived_us: u64) -> bool {
        self.fastest_us() - offset_us(sent_us, arrived_us) > AHEAD_US.into()
    }

    /// Returns the time of a message that is newer than the previous message, and not far ahead.
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
        // The delay is never negative, because this offset is in the window. Beyond u64, it is as late as can be.
        let late_us = u64::try_from(offset_us - self.fastest_us()).unwrap_or(u64::MAX);
        // A coarse stamp may be early by up to the clock's resolution, which does not mean a delay.
        let doubt_us = if arrived_us < self.coarse_until_us { self.tick_us } else { 0 };
        arrived_us.saturating_sub(late_us.saturating_sub(doubt_us))
    }

    /// Counts a message that is too far ahead. The message that completes a step starts a new window.
    fn steps_ahead(&mut self, sent_us: u64, arrived_us: u64) {
        let offset_us = offset_us(sent_us, arrived_us);
        let goes_on = |step: &ClockStep| step.ahead && sent_us >= step.sent_us;
        let new = ClockStep { ahead: true, count: 0, since_us: arrived_us, sent_us, offset_us };
        let step = self.step.filter(goes_on).unwrap_or(new);
        // Use the offset of the slowest message. With that of the fastest, one outlier would make all later messages
        // look late.
        let slowest_us = step.offset_us.max(offset_us);
        // The count cannot overflow, because the step is complete at the fifth message.
        let (count, needed) = (step.count + 1, if self.heard < NEW_COUNT { AHEAD_COUNT_NEW } else { AHEAD_COUNT });
        // Do not keep an outlier's stamp: the next correct one would count as out of order.
        self.arrived_us = arrived_us;
        self.step = Some(ClockStep { count, sent_us, offset_us: slowest_us, ..step });
        if count >= needed {
            let heard = self.heard.saturating_add(count);
            *self = KnownOffset { heard, least_us: [slowest_us; 2], ..KnownOffset::new(sent_us, arrived_us) };
        }
    }

    /// True if a message continues a series of messages of a clock that was set back.
    fn goes_on_back(&self, sent_us: u64, arrived_us: u64) -> bool {
        self.step.is_some_and(|step| {
            // Messages that were held up arrive together, so their offsets differ by the times between their stamps.
            let spread_us = (offset_us(sent_us, arrived_us) - step.offset_us).unsigned_abs();
            !step.ahead && sent_us > step.sent_us && spread_us <= BACK_SPREAD_US.into()
        })
    }

    /// Counts a message that is older than the previous message, or that follows such a message. Returns true if the
    /// clock was stepped back.
    fn steps_back(&mut self, sent_us: u64, arrived_us: u64) -> bool {
        let offset_us = offset_us(sent_us, arrived_us);
        let new = ClockStep { ahead: false, count: 0, since_us: arrived_us, sent_us, offset_us };
        let step = self.step.filter(|_| self.goes_on_back(sent_us, arrived_us)).unwrap_or(new);
        let count = step.count.saturating_add(1);
        self.step = Some(ClockStep { count, sent_us, ..step });
        let stepped = count >= BACK_COUNT && arrived_us.saturating_sub(step.since_us) >= BACK_US;
        if stepped {
            *self = KnownOffset::new(sent_us, arrived_us);
        }
        stepped
    }
}
