//! Supervision of the control tick's rate and timing, after the Crazyflie's rate supervisor, which accepts the same 997
//! to 1003 loops per second.
//!
//! The mean rate alone is not sufficient: ticks alternately 11 us and 1989 us apart are also 1000 per second.
//!
//! Grades, best first:
//!
//! | | [`RateReport::healthy`] | [`RateReport::alive`] | the vehicle |
//! |---|---|---|---|
//! | 997 to 1003 Hz, and no late or early tick for a second | yes | yes | may be armed |
//! | any other rate, a tick at the wrong time, a failed clock | no | yes | continues flying, but is not armed again |
//! | no ticks, or a clock that does not advance | | no | is reset by the watchdog, which stops the motors |

/// Nominal time between ticks \[us\].
pub const PERIOD_US: u64 = 1_000;
/// Time over which ticks are counted \[us\].
pub const WINDOW_US: u32 = 1_000_000;
/// Smallest number of ticks in a window.
pub const TICKS_MIN: u32 = 997;
/// Largest number of ticks in a window.
pub const TICKS_MAX: u32 = 1_003;
/// Longest time since the previous tick; a tick after this is late \[us\].
pub const LATE_US: u32 = 1_100;
/// Shortest time since the previous tick; a tick before this is early, probably a duplicate \[us\].
pub const EARLY_US: u32 = 900;

/// Result of the rate supervision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RateReport {
    /// Ticks in the last full second \[Hz\]; `None` during the first.
    pub rate_hz: Option<u32>,
    /// Number of late ticks since power-up, up to `u32::MAX`.
    pub late_ticks: u32,
    /// Number of early ticks since power-up, up to `u32::MAX`.
    pub early_ticks: u32,
    /// True if no tick was late or early within the last second.
    pub steady: bool,
    /// True if the clock has advanced since the last tick: the condition for feeding the watchdog.
    pub alive: bool,
    /// True if the clock has [failed](Counter::distrust).
    pub clock_failed: bool,
}

impl RateReport {
    /// Condition for arming: true if the measured rate is within 997 to 1003 Hz, no tick of the last second was late or
    /// early, and the clock has not failed.
    pub fn healthy(&self) -> bool {
        let in_range = self.rate_hz.is_some_and(|rate_hz| (TICKS_MIN..=TICKS_MAX).contains(&rate_hz));
        in_range && self.steady && !self.clock_failed
    }

    /// Returns the number of late and early ticks since power-up, up to `u32::MAX`.
    pub fn off_ticks(&self) -> u32 {
        self.late_ticks.saturating_add(self.early_ticks)
    }
}

/// Counts the ticks and checks their times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counter {
    last_us: Option<u64>,
    /// Time between the last two ticks \[us\].
    gap_us: u32,
    /// Time since the start of the present window \[us\].
    window_us: u32,
    /// Ticks in the present window.
    ticks: u32,
    /// Time since the last late or early tick \[us\].
    right_us: u32,
    report: RateReport,
}

impl Default for Counter {
    /// Starts without faults.
    fn default() -> Self {
        Counter { last_us: None, gap_us: 0, window_us: 0, ticks: 0, right_us: WINDOW_US, report: RateReport::default() }
    }
}

impl Counter {
    /// Processes a tick at `now_us` since power-up. Returns the [result](Self::report).
    pub fn tick(&mut self, now_us: u64) -> &RateReport {
        let report = &mut self.report;
        let first = self.last_us.is_none();
        let last_us = self.last_us.replace(now_us).unwrap_or(now_us);
        // The gap is 0 if the clock goes back, and limited to 71 minutes.
        self.gap_us = u32::try_from(now_us.saturating_sub(last_us)).unwrap_or(u32::MAX);
        report.alive = first || self.gap_us > 0;
        self.window_us = self.window_us.saturating_add(self.gap_us);
        self.right_us = self.right_us.saturating_add(self.gap_us);
        let (late, early) = (self.gap_us > LATE_US, self.gap_us < EARLY_US && !first);
        if late || early {
            let count = if late { &mut report.late_ticks } else { &mut report.early_ticks };
            *count = count.saturating_add(1);
            self.right_us = 0;
        }
        report.steady = self.right_us >= WINDOW_US;
        if self.window_us >= WINDOW_US {
            // Excludes this tick, which is the first of the next window: 1000 Hz count as 1000, not 1001.
            report.rate_hz = Some(self.ticks);
            (self.window_us, self.ticks) = (0, 0);
        }
        self.ticks = self.ticks.saturating_add(1);
        report
    }

    /// Returns the result as of the last tick.
    pub fn report(&self) -> &RateReport {
        &self.report
    }

    /// Returns the time between the last two ticks \[us\]. Returns 0 before the second tick.
    pub fn gap_us(&self) -> u32 {
        self.gap_us
    }

    /// Records that the clock has failed and another has taken over. The rate then never counts as healthy again.
    pub fn distrust(&mut self) {
        self.report.clock_failed = true;
    }
}
