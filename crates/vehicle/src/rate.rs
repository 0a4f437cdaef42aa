//! Whether the control tick runs at its rate. After the Crazyflie's rate supervisor, which accepts the same 997 to 1003
//! loops in a second.

/// Nominal time between ticks \[us\].
pub const PERIOD_US: u64 = 1_000;
/// Ticks are counted over a second \[us\].
pub const WINDOW_US: u64 = 1_000_000;
/// Fewest ticks in a window.
pub const TICKS_MIN: u32 = 997;
/// Most ticks in a window.
pub const TICKS_MAX: u32 = 1_003;
/// A tick that comes longer after the last one than this is late \[us\].
pub const LATE_US: u64 = 1_100;

/// What is known of the rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Ticks in the last full second \[Hz\]; none before the first has passed.
    pub rate_hz: Option<u32>,
    /// Ticks that came late since power-up, up to `u32::MAX`.
    pub late_ticks: u32,
}

impl Report {
    /// True if the rate was measured and within 997 to 1003 Hz: what arming asks for.
    pub fn healthy(&self) -> bool {
        self.rate_hz.is_some_and(|rate_hz| (TICKS_MIN..=TICKS_MAX).contains(&rate_hz))
    }

    /// True if the watchdog may be fed: the rate is healthy, or not measured yet.
    pub fn may_feed_watchdog(&self) -> bool {
        self.rate_hz.is_none() || self.healthy()
    }
}

/// Counts ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counter {
    window: Option<Window>,
    report: Report,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Window {
    start_us: u64,
    last_us: u64,
    ticks: u32,
}

impl Counter {
    /// To be called in every tick, with the time since power-up.
    pub fn tick(&mut self, now_us: u64) -> Report {
        let fresh = Window { start_us: now_us, last_us: now_us, ticks: 0 };
        let mut window = self.window.unwrap_or(fresh);
        if now_us.saturating_sub(window.last_us) > LATE_US {
            self.report.late_ticks = self.report.late_ticks.saturating_add(1);
        }
        if now_us.saturating_sub(window.start_us) >= WINDOW_US {
            self.report.rate_hz = Some(window.ticks);
            window = fresh;
        }
        window.ticks = window.ticks.saturating_add(1);
        window.last_us = now_us;
        self.window = Some(window);
        self.report
    }
}
