//! The rate's limits, and late ticks.

use proptest::prelude::*;
use vehicle::rate::{Counter, Report};

/// The report after ticks every `period_us` for `seconds`.
fn after(period_us: f64, seconds: f64) -> Report {
    let mut counter = Counter::default();
    let ticks = (seconds * 1e6 / period_us) as u64;
    (0..=ticks).map(|tick| counter.tick((tick as f64 * period_us) as u64)).last().unwrap_or_default()
}

#[test]
fn unknown_until_a_second_has_passed() {
    let report = after(1000.0, 0.999);
    assert_eq!(report, Report { rate_hz: None, late_ticks: 0 });
    assert!(!report.healthy(), "no arming yet");
    assert!(report.may_feed_watchdog(), "no reset yet");
}

#[test]
fn lockstep_time_is_1000_hz() {
    let report = after(1000.0, 5.0);
    assert_eq!(report, Report { rate_hz: Some(1000), late_ticks: 0 });
    assert!(report.healthy() && report.may_feed_watchdog());
}

#[test]
fn accepts_997_to_1003() {
    for (rate_hz, healthy) in [(990, false), (996, false), (997, true), (1003, true), (1004, false), (1010, false)] {
        let report = after(1e6 / f64::from(rate_hz), 3.5);
        assert_eq!(report.rate_hz, Some(rate_hz));
        assert_eq!(report.healthy(), healthy, "{rate_hz}");
        assert_eq!(report.may_feed_watchdog(), healthy, "{rate_hz}");
    }
}

#[test]
fn recovers_with_the_next_good_second() {
    let mut counter = Counter::default();
    let mut now_us = 0;
    let mut run = |period_us, ticks| {
        (0..ticks).fold(Report::default(), |_, _| {
            now_us += period_us;
            counter.tick(now_us)
        })
    };
    assert!(run(1000, 2002).healthy());
    assert!(!run(1010, 2000).healthy());
    assert!(run(1000, 2002).healthy());
}

#[test]
fn late_ticks_are_counted_one_by_one() {
    let mut counter = Counter::default();
    let late: Vec<u32> =
        [0, 1000, 2100, 3100, 4201, 5000, 9000, 9001].into_iter().map(|now| counter.tick(now).late_ticks).collect();
    assert_eq!(late, [0, 0, 0, 0, 1, 1, 2, 2]);
}

proptest! {
    /// No times whatever panic it; a clock that stands still or goes back never makes it healthy.
    #[test]
    fn any_times(times in prop::collection::vec(any::<u64>(), 0..200)) {
        let mut counter = Counter::default();
        for now_us in times {
            prop_assert!(!counter.tick(now_us).healthy());
        }
    }
}
