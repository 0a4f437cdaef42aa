//! Whether the control tick runs at its rate, and each tick in its time. After the Crazyflie's rate supervisor, which
//! accepts the same 997 to 1003 loops in a second.
//!
//! A mean rate alone would not do: ticks in pairs, 11 us and 1989 us apart, are 1000 in a second too.
//!
//! Three grades, from best to worst:
//!
//! | | [`Report::healthy`] | [`Report::alive`] | the vehicle |
//! |---|---|---|---|
//! | 997 to 1003 Hz, and for a second no tick late or early | yes | yes | may be armed |
//! | any other rate, a tick at the wrong time, a clock that has failed | no | yes | flies on, and is not armed again |
//! | no ticks, or a clock that stands still | | no | is reset by the watchdog, which stops the motors |

/// Nominal time between ticks \[us\].
pub const PERIOD_US: u64 = 1_000;
/// Ticks are counted over a second \[us\].
pub const WINDOW_US: u32 = 1_000_000;
/// Fewest ticks in a window.
pub const TICKS_MIN: u32 = 997;
/// Most ticks in a window.
pub const TICKS_MAX: u32 = 1_003;
/// A tick that comes longer after the last one than this is late \[us\].
pub const LATE_US: u32 = 1_100;
/// A tick that comes sooner after the last one than this is early, one of two where one should be \[us\].
pub const EARLY_US: u32 = 900;

/// What is known of the rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Ticks in the last full second \[Hz\]; none before the first has passed.
    pub rate_hz: Option<u32>,
    /// Ticks that came late since power-up, up to `u32::MAX`.
    pub late_ticks: u32,
    /// Ticks that came early since power-up, up to `u32::MAX`.
    pub early_ticks: u32,
    /// True if no tick came late or early within the last second.
    pub steady: bool,
    /// True if time has moved on since the last tick: what the watchdog is fed for.
    pub alive: bool,
    /// True if the clock that ticks are timed by has [failed](Counter::distrust).
    pub clock_failed: bool,
}

impl Report {
    /// True if the rate was measured and within 997 to 1003 Hz, each tick of the last second came at its time, and the
    /// clock is the one it should be: what arming asks for.
    pub fn healthy(&self) -> bool {
        let in_range = self.rate_hz.is_some_and(|rate_hz| (TICKS_MIN..=TICKS_MAX).contains(&rate_hz));
        in_range && self.steady && !self.clock_failed
    }

    /// Ticks that came at the wrong time since power-up, up to `u32::MAX`.
    pub fn off_ticks(&self) -> u32 {
        self.late_ticks.saturating_add(self.early_ticks)
    }
}

/// Counts ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counter {
    last_us: Option<u64>,
    /// Since the window under way began \[us\].
    window_us: u32,
    /// Ticks of that window.
    ticks: u32,
    /// Since a tick last came late or early \[us\].
    right_us: u32,
    report: Report,
}

impl Default for Counter {
    /// Nothing has been wrong so far.
    fn default() -> Self {
        Counter { last_us: None, window_us: 0, ticks: 0, right_us: WINDOW_US, report: Report::default() }
    }
}

impl Counter {
    /// To be called in every tick, with the time since power-up.
    pub fn tick(&mut self, now_us: u64) -> Report {
        let report = &mut self.report;
        report.alive = true;
        if let Some(last_us) = self.last_us {
            // 0 for a clock that goes back; an hour and more is long enough.
            let gap_us = now_us.saturating_sub(last_us).min(u64::from(u32::MAX)) as u32;
            report.alive = gap_us > 0;
            self.window_us = self.window_us.saturating_add(gap_us);
            self.right_us = self.right_us.saturating_add(gap_us);
            if gap_us > LATE_US {
                report.late_ticks = report.late_ticks.saturating_add(1);
                self.right_us = 0;
            } else if gap_us < EARLY_US {
                report.early_ticks = report.early_ticks.saturating_add(1);
                self.right_us = 0;
            }
        }
        report.steady = self.right_us >= WINDOW_US;
        if self.window_us >= WINDOW_US {
            report.rate_hz = Some(self.ticks);
            (self.window_us, self.ticks) = (0, 0);
        }
        self.ticks = self.ticks.saturating_add(1);
        self.last_us = Some(now_us);
        *report
    }

    /// The clock has failed and another has taken over: the rate is not healthy any more, whatever it reads.
    pub fn distrust(&mut self) {
        self.report.clock_failed = true;
    }
}
