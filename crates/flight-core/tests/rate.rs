//! Tests of the rate supervision: limits of the rate, and ticks at wrong times.

use afbc_flight_core::rate::{Counter, EARLY_US, LATE_US, RateReport, TICKS_MAX, TICKS_MIN, WINDOW_US};
use proptest::prelude::*;

/// Returns the report after ticks every `period_us` for `seconds`.
fn after(period_us: f64, seconds: f64) -> RateReport {
    let mut counter = Counter::default();
    let ticks = (seconds * 1e6 / period_us) as u64;
    (0..=ticks).map(|tick| *counter.tick((tick as f64 * period_us) as u64)).last().unwrap_or_default()
}

/// Returns the reports of ticks with these gaps, the first tick at 0.
fn reports(gaps_us: impl IntoIterator<Item = u64>) -> Vec<RateReport> {
    let (mut counter, mut now_us) = (Counter::default(), 0);
    let first = *counter.tick(now_us);
    let rest = gaps_us.into_iter().map(|gap_us| {
        now_us += gap_us;
        *counter.tick(now_us)
    });
    std::iter::once(first).chain(rest).collect()
}

#[test]
fn unknown_until_a_second_has_passed() {
    let report = after(1000.0, 0.999);
    assert_eq!(report, RateReport { steady: true, alive: true, ..RateReport::default() });
    assert!(!report.healthy(), "no arming yet");
}

#[test]
fn lockstep_time_is_1000_hz() {
    let report = after(1000.0, 5.0);
    assert_eq!(report, RateReport { rate_hz: Some(1000), steady: true, alive: true, ..RateReport::default() });
    assert!(report.healthy());
}

#[test]
fn accepts_997_to_1003() {
    for (rate_hz, healthy) in [(990, false), (996, false), (997, true), (1003, true), (1004, false), (1010, false)] {
        let report = after(1e6 / f64::from(rate_hz), 3.5);
        assert_eq!(report.rate_hz, Some(rate_hz));
        assert_eq!(report.healthy(), healthy, "{rate_hz}");
        assert!(report.alive, "{rate_hz} Hz are better than no motors");
    }
}

#[test]
fn recovers_with_the_next_good_second() {
    let mut counter = Counter::default();
    let mut now_us = 0;
    let mut run = |period_us, ticks| {
        (0..ticks).fold(RateReport::default(), |_, _| {
            now_us += period_us;
            *counter.tick(now_us)
        })
    };
    assert!(run(1000, 2002).healthy());
    assert!(!run(1010, 2000).healthy());
    assert!(run(1000, 2002).healthy());
}

#[test]
fn ticks_at_the_wrong_time_are_counted_one_by_one() {
    let mut counter = Counter::default();
    let counts = [0, 1000, 2100, 3100, 4201, 5100, 6000, 6899, 9000, 9001].map(|now| {
        let RateReport { late_ticks, early_ticks, .. } = *counter.tick(now);
        [late_ticks, early_ticks]
    });
    let wanted = [[0, 0], [0, 0], [0, 0], [0, 0], [1, 0], [1, 1], [1, 1], [1, 2], [2, 2], [2, 3]];
    assert_eq!(counts, wanted);
}

#[test]
fn ticks_in_pairs_are_not_healthy_though_1000_hz() {
    let reports = reports([11, 1989].into_iter().cycle().take(5000));
    assert!(reports.iter().all(|report| !report.healthy()));
    assert_eq!(reports.last().and_then(|report| report.rate_hz), Some(1000));
}

#[test]
fn a_clock_that_has_failed_is_never_healthy_again() {
    let mut counter = Counter::default();
    let second = |counter: &mut Counter, from_s: u64| {
        (0..=1000).fold(RateReport::default(), |_, ms| *counter.tick(from_s * 1_000_000 + ms * 1000 + 1000))
    };
    second(&mut counter, 0);
    assert!(second(&mut counter, 1).healthy());
    counter.distrust();
    for from_s in 2..5 {
        let report = second(&mut counter, from_s);
        assert!(report.clock_failed && !report.healthy());
        assert!(report.alive, "it flies on");
    }
}

proptest! {
    /// The rate is healthy exactly if the last full second had 997 to 1003 ticks, and every gap that ended within the
    /// last second was right.
    #[test]
    fn health_depends_on_rate_and_gaps(
        stretches in prop::collection::vec(
            (prop_oneof![4 => Just(1000), 4 => 890u64..1110, 1 => 0u64..4000], 1..1500usize),
            1..8,
        ),
    ) {
        let gaps: Vec<u64> = stretches.iter().flat_map(|&(gap, times)| std::iter::repeat_n(gap, times)).collect();
        let reports = reports(gaps.iter().copied());
        let mut times = vec![0];
        for gap in &gaps {
            times.push(times.last().unwrap_or(&0) + gap);
        }
        // The expected rate is counted in windows of at least a second. Each window ends at its first tick after a
        // second, where the next window starts.
        let (mut start, mut rate) = (0, None);
        let mut last_off = None;
        for (index, (&now, report)) in times.iter().zip(&reports).enumerate() {
            if now - times[start] >= u64::from(WINDOW_US) {
                rate = Some((index - start) as u32);
                start = index;
            }
            if index > 0 && !(EARLY_US..=LATE_US).contains(&(gaps[index - 1] as u32)) {
                last_off = Some(now);
            }
            let steady = last_off.is_none_or(|off| now - off >= u64::from(WINDOW_US));
            let in_range = rate.is_some_and(|rate| (TICKS_MIN..=TICKS_MAX).contains(&rate));
            prop_assert_eq!(report.rate_hz, rate);
            prop_assert_eq!(report.steady, steady, "at {} us", now);
            prop_assert_eq!(report.healthy(), steady && in_range);
            prop_assert_eq!(report.alive, index == 0 || gaps[index - 1] > 0);
        }
    }

    /// One missing or additional tick within the last second prevents arming; an earlier one does not.
    #[test]
    fn one_wrong_gap_is_enough_to_be_unhealthy(
        at in 0usize..2000,
        wrong in prop_oneof![0..u64::from(EARLY_US), u64::from(LATE_US) + 1..2600],
    ) {
        let gaps = (0..4000).map(|index| if index == at + 500 { wrong } else { 1000 });
        let reports = reports(gaps);
        let (before, after) = (&reports[at + 500], &reports[at + 501..at + 1501]);
        prop_assert_eq!(before.off_ticks(), 0);
        prop_assert!(after.iter().all(|report| !report.healthy() && report.off_ticks() == 1));
        prop_assert!(reports.last().is_some_and(RateReport::healthy));
    }

    /// A tick is alive as long as the clock advances, at any rate.
    #[test]
    fn alive_while_time_moves(gaps in prop::collection::vec(1u64..3_000_000, 1..300)) {
        prop_assert!(reports(gaps).iter().all(|report| report.alive));
    }

    /// No times cause a panic. A clock that stands still or goes back is neither alive nor healthy.
    #[test]
    fn any_times(times in prop::collection::vec(any::<u64>(), 1..200)) {
        let mut counter = Counter::default();
        let mut last = None;
        for now_us in times {
            let report = *counter.tick(now_us);
            prop_assert!(!report.healthy());
            prop_assert_eq!(report.alive, last.is_none_or(|last| now_us > last));
            last = Some(now_us);
        }
    }
}
