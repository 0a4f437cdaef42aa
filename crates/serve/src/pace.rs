//! Pacing of steps to real time, or to a multiple of it.

use std::time::Duration;

/// A delay above this is not caught up.
pub const BEHIND_MAX: Duration = Duration::from_millis(500);
/// Shortest time ahead of the pace for which sleeping is worth it.
const AHEAD_MIN: Duration = Duration::from_micros(200);

/// Tells when the next step is due. Deadlines count from the start, not from the last step, so the pace does not drift.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Time between two steps; `None`: as fast as possible.
    period: Option<Duration>,
    /// Start of counting, and steps since then.
    start: Duration,
    steps: u32,
}

/// How long to wait before the next step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// Go on at once.
    Not,
    /// Sleep for this time.
    For(Duration),
    /// Go on at once. This much time was lost and is not caught up.
    Lost(Duration),
}

impl Pace {
    /// Starts at `now` with `speed` times real time; 0: as fast as possible.
    pub fn new(speed: f64, now: Duration) -> Self {
        let period = (speed > 0.0).then(|| Duration::from_secs_f64(1e-3 / speed));
        Pace { period, start: now, steps: 0 }
    }

    /// Counts a step that ended at `now`.
    pub fn step(&mut self, now: Duration) -> Wait {
        let Some(period) = self.period else { return Wait::Not };
        self.steps += 1;
        // Restart the count before the product loses precision, after a million steps.
        if self.steps == 1_000_000 {
            (self.start, self.steps) = (self.start + period * self.steps, 0);
        }
        let deadline = self.start + period * self.steps;
        if let Some(behind) = now.checked_sub(deadline) {
            if behind <= BEHIND_MAX {
                return Wait::Not;
            }
            (self.start, self.steps) = (now, 0);
            return Wait::Lost(behind);
        }
        let ahead = deadline - now;
        if ahead < AHEAD_MIN { Wait::Not } else { Wait::For(ahead) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// After n steps, n periods have passed, however long the single steps and sleeps take.
    #[test]
    fn the_pace_does_not_drift() {
        for speed in [1.0, 5.0, 0.3, 3.0] {
            let (mut now, mut pace) = (Duration::ZERO, Pace::new(speed, Duration::ZERO));
            for step in 1..=2_500_000_u32 {
                // Steps of varying length, and sleeps that are never exact.
                now += Duration::from_nanos(u64::from(step % 97) * 1000);
                if let Wait::For(ahead) = pace.step(now) {
                    now += ahead + Duration::from_nanos(u64::from(step % 13) * 9000);
                }
                let exact = Duration::from_secs_f64(1e-3 / speed) * step;
                let off = now.abs_diff(exact);
                assert!(off < 2 * MS, "{speed}: {off:?} after {step} steps");
            }
        }
    }

    #[test]
    fn what_is_lost_is_reported_and_not_caught_up_with() {
        let mut pace = Pace::new(1.0, Duration::ZERO);
        assert_eq!(pace.step(MS / 2), Wait::For(MS / 2));
        // A short delay is caught up.
        assert_eq!(pace.step(100 * MS), Wait::Not);
        // A suspended machine.
        assert_eq!(pace.step(3_600_003 * MS), Wait::Lost(3_600_000 * MS));
        assert_eq!(pace.step(3_600_003 * MS), Wait::For(MS));
    }

    #[test]
    fn as_fast_as_possible_never_waits() {
        let mut pace = Pace::new(0.0, Duration::ZERO);
        assert!((0..1000).all(|step| pace.step(MS * (step % 7) * 1000) == Wait::Not));
    }
}
