//! Requests that meet, and how old a message is.

use airframe::{Setpoint, State};
use nalgebra::Vector3;
use proptest::prelude::*;
use vehicle::inbox::RESTART_US;
use vehicle::{Inbox, Request, SourceClock, Stamped};

#[test]
fn disarming_wins_whichever_came_first() {
    for (first, second, expected) in [
        (Request::Arm, Request::Arm, Request::Arm),
        (Request::Arm, Request::Disarm, Request::Disarm),
        (Request::Disarm, Request::Arm, Request::Disarm),
    ] {
        let mut inbox = Inbox::default();
        inbox.ask(first);
        inbox.ask(second);
        assert_eq!(inbox.take().request(), Some(expected));
        assert_eq!(inbox.take().request(), None, "a request is done with");
    }
}

#[test]
fn what_is_not_plausible_does_not_get_in() {
    let good = (Stamped { value: State::default(), at_us: 1 }, Stamped { value: Setpoint::default(), at_us: 1 });
    let mut inbox = Inbox::EMPTY;
    inbox.measure(good.0);
    inbox.aim(good.1);
    for bad in [f32::NAN, f32::INFINITY, 2e5] {
        let position_m = Vector3::new(0.0, bad, 0.0);
        let mut news = Inbox::EMPTY;
        news.measure(Stamped { value: State { position_m, ..State::default() }, at_us: 2 });
        news.aim(Stamped { value: Setpoint { position_m, ..Setpoint::default() }, at_us: 2 });
        assert_eq!(news, Inbox::EMPTY, "{bad}");
        inbox.post(&news);
    }
    assert_eq!((inbox.state(), inbox.setpoint()), (Some(&good.0), Some(&good.1)), "the last good ones stay");
}

#[test]
fn a_stamp_from_the_future_is_infinitely_old() {
    let stamped = Stamped { value: (), at_us: 1000 };
    assert_eq!(stamped.age_us(1000), 0);
    assert_eq!(stamped.age_us(4000), 3000);
    assert_eq!(stamped.age_us(999), u64::MAX);
}

#[test]
fn delay_beyond_the_fastest_message_is_age() {
    // The sender's clock is 1 s ahead; messages take 2 ms, one of them 50 ms.
    let mut clock = SourceClock::default();
    for (sent, arrived, stamp) in [
        (1_000_000, 2_000, Some(2_000)),
        (1_010_000, 12_000, Some(12_000)),
        (1_020_000, 70_000, Some(22_005)), // 58 ms at 100 ppm: 5 us
        (1_030_000, 71_000, Some(32_005)),
        (1_080_000, 82_000, Some(82_000)),
        (1_079_000, 83_000, None), // overtaken
        (1_080_000, 84_000, None), // twice
        (1_081_000, 85_000, Some(83_000)),
    ] {
        assert_eq!(clock.stamp(sent, arrived), stamp, "sent at {sent}");
    }
}

#[test]
fn a_faster_message_corrects_the_difference() {
    let mut clock = SourceClock::default();
    assert_eq!(clock.stamp(0, 40_000), Some(40_000), "the first one cannot be known to be late");
    assert_eq!(clock.stamp(10_000, 11_000), Some(11_000));
    assert_eq!(clock.stamp(20_000, 50_000), Some(21_003));
}

#[test]
fn a_sender_that_restarts_is_believed_after_a_silence() {
    let mut clock = SourceClock::default();
    assert_eq!(clock.stamp(9_000_000, 1_000), Some(1_000));
    assert_eq!(clock.stamp(5, 1_000 + RESTART_US), None, "might be an old one");
    assert_eq!(clock.stamp(6, 1_001 + RESTART_US), Some(1_001 + RESTART_US));
    assert_eq!(clock.stamp(7, 1_002 + RESTART_US), Some(1_002 + RESTART_US));
}

#[test]
fn clocks_may_drift_by_100_ppm() {
    for drift_ppm in [-100.0, 100.0] {
        let mut clock = SourceClock::default();
        for message in 0..600_000u64 {
            let arrived = 1_000 + message * 1_000;
            let sent = (message as f64 * 1_000.0 * (1.0 + drift_ppm * 1e-6)) as u64;
            let age = clock.stamp(sent, arrived).map(|stamp| arrived - stamp);
            assert!(age.is_some_and(|age| age < 2_000), "{age:?} us after {message} ms, {drift_ppm} ppm");
        }
    }
}

proptest! {
    /// No times panic it. In a sane range of times no message is younger than its arrival.
    #[test]
    fn any_times(times in prop::collection::vec((any::<u64>(), any::<u64>()), 0..50)) {
        let mut clock = SourceClock::default();
        for (sent, arrived) in times {
            let _ = clock.stamp(sent, arrived);
        }
    }

    #[test]
    fn never_from_the_future(steps in prop::collection::vec((1u64..50_000, 0u64..300_000), 1..100), ahead in 0u64..1 << 60) {
        let mut clock = SourceClock::default();
        let (mut sent, mut arrived) = (ahead, 0);
        for (period, delay) in steps {
            sent += period;
            arrived = arrived.max(sent - ahead + delay);
            if let Some(stamp) = clock.stamp(sent, arrived) {
                prop_assert!(stamp <= arrived);
                prop_assert!(arrived - stamp <= 300_000 + 30);
            }
        }
    }
}
