//! Realistic faults of a tracker's clock, each during a minute of hover. Checks the modes of the flight and the ages of
//! its states.

use afbc::{Adaptive, Controller, Profile};
use afbc_flight_core::clock::{BACK_SPREAD_US, BACK_US, NEW_COUNT, SILENCE_US};
use afbc_flight_core::supervisor::COAST_US;
use afbc_flight_core::tracker::{POSE_AGE_MAX_US, Refused, SILENT_US, Sighting};
use afbc_flight_core::{
    ArmingLimits, FlightCore, FlightCoreMemory, Inbox, Mode, Request, SourceClock, Stamped, Ticketed, Tracker,
};
use afbc_types::{Parameters, Pose, PoseSigmas, Setpoint, State};
use proptest::prelude::*;

/// Times of arming, of the clock's fault, and of the end \[us since power-up\].
const ARM_US: u64 = 2_000_000;
const EVENT_US: u64 = 10_000_000;
const END_US: u64 = 70_000_000;
/// Period of the tracker's measurements (100 Hz), and delay of their arrival \[us\].
const PERIOD_US: u64 = 10_000;
const DELAY_US: u64 = 1_000;

/// A state in transit.
struct Sent {
    sender: u16,
    measured_us: u64,
    stamp_us: u64,
    arrives_us: u64,
}

/// Result of a case.
#[derive(Debug, Default)]
struct Seen {
    /// Modes in flight, in order.
    modes: Vec<Mode>,
    /// Largest age error of a used state \[us\].
    age_error_us: u64,
    refused: Refused,
}

/// State of a hovering vehicle with a tracker's noise.
fn hovering(measured_us: u64) -> State {
    let mut state = State::default();
    state.position_m.z = (measured_us / 1000 * 7919 % 1000) as f32 * 1e-8;
    state
}

fn play(mut sent: Vec<Sent>) -> Seen {
    sent.sort_by_key(|sent| sent.arrives_us);
    let (parameters, settings) = (Parameters::PAPER.to_f32(), Profile::Flight.settings());
    let law = Adaptive::new(Profile::Flight.gains()).expect("valid");
    let controller = Controller::new(parameters, settings, law).expect("valid");
    let vehicle = FlightCore::new(parameters, ArmingLimits::default(), controller).expect("valid");
    let (mut memory, mut inbox, mut tracker) = (FlightCoreMemory::default(), Inbox::default(), Tracker::default());
    let mut sent = sent.iter().peekable();
    let mut seen = Seen::default();
    for now_us in (1000..END_US).step_by(1000) {
        while let Some(sent) = sent.next_if(|sent| sent.arrives_us <= now_us) {
            let state = hovering(sent.measured_us);
            if let Some(state) = tracker.stamp(sent.sender, sent.stamp_us, now_us, state) {
                // The clock cannot know the fastest state's delay.
                let error_us = state.at_us.abs_diff(sent.measured_us + DELAY_US);
                seen.age_error_us = seen.age_error_us.max(error_us);
                inbox.put_state(state);
            }
        }
        inbox.put_setpoint(Stamped { value: Setpoint::default(), at_us: now_us });
        if now_us == ARM_US {
            assert!(inbox.request(Ticketed { value: Request::Arm, ticket: 0 }));
        }
        let mode = vehicle.tick(&mut memory, now_us, &inbox.take()).mode;
        if now_us >= ARM_US && seen.modes.last() != Some(&mode) {
            seen.modes.push(mode);
        }
    }
    seen.refused = *tracker.refused();
    seen
}

/// Returns the states of one sender, stamped by `clock` from the true time.
fn stamped(clock: impl Fn(u64) -> u64) -> Vec<Sent> {
    let at =
        |measured_us| Sent { sender: 1, measured_us, stamp_us: clock(measured_us), arrives_us: measured_us + DELAY_US };
    (0..END_US).step_by(PERIOD_US as usize).map(at).collect()
}

/// Returns the messages of a sender whose clock steps by `by_us` at the event.
fn steps(by_us: i64) -> Vec<Sent> {
    stamped(
        move |t| if t < EVENT_US { (t + HOUR_US).wrapping_add(0) } else { (t + HOUR_US).wrapping_add_signed(by_us) },
    )
}

/// A clock with a single stamp ahead.
fn once_ahead(by_us: u64) -> Vec<Sent> {
    stamped(move |t| if t == EVENT_US { t + by_us } else { t })
}

fn drifts(ppm: i64) -> Vec<Sent> {
    stamped(move |t| t.wrapping_add_signed(HOUR_US as i64 + t as i64 * ppm / 1_000_000))
}

/// Returns messages stamped by a clock of this resolution.
fn coarse(resolution_us: u64) -> Vec<Sent> {
    stamped(move |t| (t + 12_345) / resolution_us * resolution_us)
}

/// Arrivals delayed by pseudo-random times up to `by_us`.
fn jitters(by_us: u64) -> Vec<Sent> {
    let mut sent = stamped(|t| t);
    for (n, sent) in sent.iter_mut().enumerate() {
        sent.arrives_us += n as u64 * 7919 % 1009 * by_us / 1009;
    }
    sent
}

/// Returns the messages of two senders with separate clocks. The first sender falls silent at `until_us`.
fn two(until_us: u64) -> Vec<Sent> {
    let mut sent = stamped(|t| t);
    sent.retain(|sent| sent.measured_us < until_us);
    let mut other = stamped(|t| t / 3 + 77 * HOUR_US);
    for sent in &mut other {
        // The second sender sends as often as the first, between its states. Its clock has another zero.
        sent.stamp_us = sent.measured_us + 77 * HOUR_US;
        sent.sender = 2;
        sent.measured_us += 4_000;
        sent.arrives_us += 4_000;
        sent.stamp_us += 4_000;
    }
    sent.extend(other);
    sent
}

const HOUR_US: u64 = 3_600_000_000;
/// A Saturday in 2026, in microseconds since 1970.
const WALL_US: u64 = 1_795_000_000_000_000;

use Mode::{Coasting, Flying};

/// Name of the clock fault, its states, the resulting modes, and the largest age error \[us\].
type Case = (&'static str, fn() -> Vec<Sent>, &'static [Mode], u64);

#[rustfmt::skip]
const CASES: &[Case] = &[
    ("a good clock", || stamped(|t| t), &[Flying], 0),
    ("one stamp 11 ms ahead", || once_ahead(11_000), &[Flying], 0),
    ("one stamp 19 ms ahead", || once_ahead(19_000), &[Flying], 0),
    ("one stamp 30 ms ahead", || once_ahead(30_000), &[Flying], 0),
    ("one stamp an hour ahead", || once_ahead(HOUR_US), &[Flying], 0),
    ("one stamp 5 ms back", || stamped(|t| if t == EVENT_US { t - 5_000 } else { t }), &[Flying], 5_000),
    ("one stamp an hour back", || stamped(|t| if t == EVENT_US { 1 } else { t }), &[Flying], 0),
    ("every tenth stamp 15 ms ahead", || stamped(|t| if t % 100_000 == 50_000 { t + 15_000 } else { t }), &[Flying], 0),
    ("a step of 5 ms ahead", || steps(5_000), &[Flying], 0),
    ("a step of 25 ms ahead", || steps(25_000), &[Flying], 0),
    ("a step of an hour ahead", || steps(HOUR_US as i64), &[Flying], 0),
    ("a step of 5 ms back", || steps(-5_000), &[Flying], 5_000),
    ("a step of 9 ms back", || steps(-9_000), &[Flying], 9_000),
    ("a step of 25 ms back", || steps(-25_000), &[Flying, Coasting, Flying], 0),
    ("a step of half an hour back", || steps(-(HOUR_US as i64) / 2), &[Flying, Coasting, Flying], 0),
    ("32 bits of microseconds that wrap", || stamped(|t| (t + (1 << 32) - EVENT_US) % (1 << 32)),
        &[Flying, Coasting, Flying], 0),
    ("200 ppm fast", || drifts(200), &[Flying], 200),
    ("200 ppm slow", || drifts(-200), &[Flying], 200),
    ("1000 ppm fast", || drifts(1000), &[Flying], 1_100),
    ("1000 ppm slow", || drifts(-1000), &[Flying], 1_100),
    ("slewed by 500 ppm for 20 s", || stamped(|t| t + t.clamp(EVENT_US, 3 * EVENT_US) / 2000), &[Flying], 600),
    ("slewed back by 500 ppm for 20 s",
        || stamped(|t| HOUR_US + t - t.clamp(EVENT_US, 3 * EVENT_US) / 2000), &[Flying], 600),
    ("a resolution of 1 ms", || coarse(1_000), &[Flying], 1_000),
    ("a resolution of 15.625 ms", || coarse(15_625), &[Flying], 15_625),
    ("a resolution of 1 s", || coarse(1_000_000), &[Flying], 10_000),
    ("no stamps at all", || stamped(|_| 0), &[Flying], 0),
    ("a clock that stops", || stamped(|t| t.min(EVENT_US)), &[Flying], 0),
    ("a wall clock", || stamped(|t| t + WALL_US), &[Flying], 0),
    ("a wall clock that is set by NTP in flight", || stamped(|t| if t < EVENT_US { t } else { t + WALL_US }),
        &[Flying], 0),
    ("nanoseconds sent as microseconds", || stamped(|t| t * 1000), &[Flying], 0),
    ("jitter of 8 ms", || jitters(8_000), &[Flying], 1_000),
    ("two senders", || two(END_US), &[Flying], 0),
    ("two senders, one of which falls silent", || two(EVENT_US), &[Flying, Coasting, Flying], 0),
];

#[test]
fn ordinary_clocks_end_no_flight() {
    let mut failures = String::new();
    for (name, sent, modes, age_error_us) in CASES {
        let seen = play(sent());
        println!("{name:<45} {:?} {} us, {:?}", seen.modes, seen.age_error_us, seen.refused);
        // Ticks process arrivals once per millisecond.
        if seen.modes != *modes || seen.age_error_us > age_error_us + 1_000 {
            failures += &format!("{name}: expected {modes:?} within {age_error_us} us, saw {seen:?}\n");
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}

/// Milliseconds sent as microseconds look like a delay that grows by 10 ms per state, so the vehicle does not arm.
#[test]
fn a_clock_that_counts_milliseconds_prevents_arming() {
    assert_eq!(play(stamped(|t| t / 1000)).modes, [Mode::Disarmed]);
}

#[test]
fn refused_states_are_counted_by_reason() {
    assert_eq!(play(stamped(|t| t)).refused, Refused::default());
    let refused = play(two(END_US)).refused;
    assert!(u64::from(refused.elsewhere) > END_US / PERIOD_US - 5, "{refused:?}");
    let mut twice = stamped(|t| t);
    twice.extend(stamped(|t| t));
    let refused = play(twice).refused;
    assert!(u64::from(refused.overtaken) > END_US / PERIOD_US - 5, "{refused:?}");
    let mut held_up = stamped(|t| t);
    held_up.iter_mut().filter(|sent| sent.measured_us % 1_000_000 == 0).for_each(|sent| sent.arrives_us += 100_000);
    let refused = play(held_up).refused;
    assert!((60..=70).contains(&refused.overtaken), "{refused:?}");
}

#[test]
fn another_sender_takes_over_after_a_silence_only() {
    let mut tracker = Tracker::default();
    let mut says = |sender, now_us| tracker.stamp(sender, now_us, now_us, hovering(now_us)).is_some();
    assert!(says(1, 0));
    assert!(!says(2, SILENT_US));
    assert!(says(2, SILENT_US + 1));
    assert!(!says(1, 2 * SILENT_US), "then the other one is in use");
    assert!((3..9).all(|sender| !says(sender, 2 * SILENT_US)), "however many there are");
    assert!(says(2, 2 * SILENT_US + 1));
}

/// A pose may be up to 250 ms old, a state 20 ms.
#[test]
fn a_pose_may_be_older_than_a_state() {
    for (late_us, as_state, as_pose) in
        [(19_000, true, true), (21_000, false, true), (250_000, false, true), (250_001, false, false)]
    {
        let send = |sighting: fn(u64) -> Sighting, age_max_us| {
            let mut tracker = Tracker::default();
            let mut says = |sent_us, arrived_us| tracker.sight(1, sent_us, arrived_us, sighting(sent_us), age_max_us);
            assert_eq!((says(0, 1_000_000), says(10_000, 1_010_000)), (Some(1_000_000), Some(1_010_000)));
            let late = says(20_000, 1_020_000 + late_us);
            assert!(late.is_none_or(|at_us| at_us == 1_020_000), "{late:?}");
            assert_eq!(tracker.refused().late, u32::from(late.is_none()));
            late.is_some()
        };
        assert_eq!(send(|us| Sighting::State(hovering(us)), COAST_US.into()), as_state, "{late_us}");
        assert_eq!(send(posed, POSE_AGE_MAX_US), as_pose, "{late_us}");
    }
}

fn posed(measured_us: u64) -> Sighting {
    Sighting::Pose(Pose::of(&hovering(measured_us), PoseSigmas::UNKNOWN))
}

/// A tracker that sends each measurement as state and as pose is used once per measurement. Its clock does not count as
/// coarse, so a late measurement is recognised as late.
#[test]
fn a_state_and_a_pose_of_one_moment_are_one() {
    let mut tracker = Tracker::default();
    for us in (0..1_000_000).step_by(10_000) {
        let state = Sighting::State(hovering(us));
        assert_eq!(tracker.sight(1, us, us, state, POSE_AGE_MAX_US), Some(us));
        assert_eq!(tracker.sight(1, us, us, posed(us), POSE_AGE_MAX_US), None);
    }
    assert_eq!(tracker.refused().overtaken, 100);
    assert_eq!(tracker.sight(1, 1_000_000, 1_030_000, posed(1_000_000), POSE_AGE_MAX_US), Some(1_000_000));
}

/// Slow trackers do not alternate: a sender stays in use as long as its poses may be old.
#[test]
fn a_slow_tracker_stays_in_use() {
    let mut tracker = Tracker::default();
    let mut says = |sender, now_us| tracker.sight(sender, now_us, now_us, posed(now_us), POSE_AGE_MAX_US).is_some();
    for round in 0..10 {
        assert!(says(1, round * 200_000));
        assert!(!says(2, round * 200_000 + 100_000));
    }
    assert!(!says(2, 1_800_000 + POSE_AGE_MAX_US));
    assert!(says(2, 1_800_001 + POSE_AGE_MAX_US));
}

/// A sender that repeats the same state counts as silent.
#[test]
fn a_frozen_sender_gives_way() {
    let mut tracker = Tracker::default();
    for now_us in (0..100_000).step_by(10_000) {
        assert!(tracker.stamp(1, now_us, now_us, State::default()).is_some());
    }
    assert!(tracker.stamp(2, 5, 100_000, hovering(1)).is_some());
}

#[test]
fn delay_beyond_the_fastest_message_is_age() {
    // The sender's clock is 1 s ahead. Messages take 2 ms, one of them 50 ms.
    let mut clock = SourceClock::default();
    for (sent, arrived, stamp) in [
        (1_000_000, 2_000, Some(2_000)),
        (1_010_000, 12_000, Some(12_000)),
        (1_020_000, 70_000, Some(22_000)),
        (1_030_000, 71_000, Some(32_000)),
        (1_080_000, 82_000, Some(82_000)),
        (1_079_000, 83_000, None), // out of order
        (1_080_000, 84_000, None), // duplicate
        (1_081_000, 85_000, Some(83_000)),
    ] {
        assert_eq!(clock.stamp(sent, arrived, sent != 1_080_000 || arrived < 84_000), stamp, "sent at {sent}");
    }
}

#[test]
fn a_faster_message_corrects_the_difference() {
    let mut clock = SourceClock::default();
    assert_eq!(clock.stamp(0, 40_000, true), Some(40_000), "the first one cannot be known to be late");
    assert_eq!(clock.stamp(10_000, 11_000, true), Some(11_000));
    assert_eq!(clock.stamp(20_000, 21_000, true), Some(21_000), "two of the first ones are believed");
    assert_eq!(clock.stamp(30_000, 50_000, true), Some(31_000));
}

#[test]
fn after_a_long_silence_a_clock_is_new() {
    let mut clock = SourceClock::default();
    assert_eq!(clock.stamp(9_000_000, 1_000, true), Some(1_000));
    assert_eq!(clock.stamp(5, 1_000 + SILENCE_US, true), None, "might be an old one");
    assert_eq!(clock.stamp(6, 1_001 + SILENCE_US, true), Some(1_001 + SILENCE_US));
    assert_eq!(clock.stamp(7, 1_002 + SILENCE_US, true), Some(1_002 + SILENCE_US));
}

/// Returns a clock heard for a long time, whose messages arrive without delay, and its next stamp.
fn steady() -> (SourceClock, u64) {
    let mut clock = SourceClock::default();
    for us in (0..1_000_000).step_by(10_000) {
        assert_eq!(clock.stamp(us, us, true), Some(us));
    }
    (clock, 1_000_000)
}

/// Five stamps in a row, in increasing order, are a step ahead. A decreasing stamp restarts the count. After the step
/// the slowest of them is the reference, so none of them counts as late. The next step again takes five.
#[test]
fn a_step_ahead_takes_five_stamps_in_a_row() {
    let ahead = |offs_us: &[u64]| {
        let (mut clock, now_us) = steady();
        for (index, off_us) in offs_us.iter().enumerate() {
            let arrived_us = now_us + index as u64 * 10_000;
            assert_eq!(clock.stamp(HOUR_US + off_us, arrived_us, true), Some(arrived_us), "taken as sent on arrival");
        }
        // Once the clock counts as stepped, the old clock's stamps are out of order.
        let next_us = now_us + offs_us.len() as u64 * 10_000;
        let mut old = clock;
        let stepped = old.stamp(next_us, next_us, true).is_none();
        (clock, next_us, stepped)
    };
    assert!(!ahead(&[0, 10_000, 20_000, 30_000]).2);
    assert!(ahead(&[0, 10_000, 20_000, 30_000, 40_000]).2);
    assert!(!ahead(&[0, 30_000, 20_000, 40_000, 50_000]).2, "back in between");
    assert!(ahead(&[0, 30_000, 20_000, 40_000, 50_000, 60_000, 70_000]).2);
    assert!(ahead(&[0, 0, 0, 0, 0]).2, "the same again is not back");

    // The third was 8 ms slower. The next may be just as slow without counting as late.
    let (mut clock, next_us, stepped) = ahead(&[0, 10_000, 12_000, 30_000, 40_000]);
    assert!(stepped);
    let said = clock.stamp(HOUR_US + 50_000 - 8_000, next_us, true);
    assert_eq!(said, Some(next_us), "as slow as the slowest");
    // The sender is no longer new, so two stamps are not enough for another step.
    for index in 1..=2 {
        assert!(clock.stamp(3 * HOUR_US, next_us + index * 10_000, true).is_some());
    }
    let later_us = next_us + 30_000;
    assert!(clock.stamp(HOUR_US + 80_000 - 8_000, later_us, true).is_some(), "not stepped");
}

/// Among a sender's first ten messages two are enough; from the eleventh on they are not.
#[test]
fn a_new_sender_steps_ahead_with_two() {
    for heard in 1..=14_u64 {
        let mut clock = SourceClock::default();
        for index in 0..heard {
            assert!(clock.stamp(index * 10_000, index * 10_000, true).is_some());
        }
        let now_us = heard * 10_000;
        for index in 0..2 {
            assert!(clock.stamp(HOUR_US + index * 10_000, now_us + index * 10_000, true).is_some());
        }
        let stepped = clock.stamp(now_us + 20_000, now_us + 20_000, true).is_none();
        assert_eq!(stepped, heard < u64::from(NEW_COUNT), "after {heard}");
    }
}

/// A step back takes three stamps that increase and fit each other, over 15 ms. Others are out of order.
#[test]
fn a_step_back_takes_three_that_increase() {
    let back = |messages: &[(u64, u64)]| {
        let (mut clock, now_us) = steady();
        messages.iter().any(|(sent_us, after_us)| clock.stamp(500_000 + sent_us, now_us + after_us, true).is_some())
    };
    assert!(back(&[(0, 0), (8_000, 8_000), (BACK_US, BACK_US)]));
    assert!(!back(&[(0, 0), (8_000, 8_000), (BACK_US - 1, BACK_US - 1)]), "too short");
    assert!(!back(&[(0, 0), (BACK_US, BACK_US)]), "two");
    assert!(!back(&[(0, 0), (16_000, 16_000), (15_500, 18_000)]), "back among them");
    assert!(!back(&[(0, 0), (8_000, 8_000), (8_000, 16_000)]), "the same again");
    // All offsets must be within 3 ms of the first offset.
    assert!(back(&[(0, 0), (8_000, 8_000), (16_000, 16_000 + BACK_SPREAD_US)]));
    assert!(!back(&[(0, 0), (8_000, 8_000), (16_000, 16_001 + BACK_SPREAD_US)]));
    assert!(back(&[(0, 0), (8_000, 8_000), (16_000 + BACK_SPREAD_US, 16_000)]));
    assert!(!back(&[(0, 0), (8_000, 8_000), (16_001 + BACK_SPREAD_US, 16_000)]));
}

/// Four senders' clocks are tracked. A fifth sender replaces the one silent for longest.
#[test]
fn the_sender_that_is_silent_longest_is_forgotten() {
    for silent in 1..=4_u16 {
        let mut tracker = Tracker::default();
        let says = |tracker: &mut Tracker, sender: u16, sent_us: u64, arrived_us: u64| {
            // The count of late states tells whether this state was late, since another sender is in use.
            let late = tracker.refused().late;
            let _ = tracker.stamp(sender, sent_us, arrived_us, hovering(sent_us));
            tracker.refused().late > late
        };
        let order = [1, 2, 3, 4].into_iter().cycle().skip(silent.into()).take(4);
        for (index, sender) in [1_u16, 2, 3, 4].into_iter().enumerate() {
            says(&mut tracker, sender, index as u64 * 1_000, index as u64 * 1_000);
        }
        // Each is heard once more, in an order that starts after `silent`.
        for (index, sender) in order.enumerate() {
            let now_us = 20_000 + index as u64 * 1_000;
            says(&mut tracker, if sender == silent { 1 + silent % 4 } else { sender }, now_us, now_us);
        }
        says(&mut tracker, 5, 30_000, 30_000);
        for sender in 1..=5 {
            // The message was sent 30 ms ago. It is late only for a sender whose clock is known.
            let late = says(&mut tracker.clone(), sender, 40_000, 70_000);
            assert_eq!(late, sender != silent, "sender {sender}, silent {silent}");
        }
    }
}

proptest! {
    /// No times cause a panic or a time after the arrival.
    #[test]
    fn any_times(times in prop::collection::vec((any::<u64>(), any::<u64>(), any::<bool>()), 0..50)) {
        let mut clock = SourceClock::default();
        for (sent, arrived, differs) in times {
            prop_assert!(clock.stamp(sent, arrived, differs).is_none_or(|at| at <= arrived));
        }
    }

    /// With a good clock and any delays, a state's age is overestimated by no more than its delay.
    #[test]
    fn an_age_is_no_more_than_the_delay(
        steps in prop::collection::vec((1u64..50_000, 0u64..300_000), 1..100),
        ahead in 0u64..1 << 60,
    ) {
        let mut clock = SourceClock::default();
        let (mut sent, mut arrived) = (ahead, 0);
        for (period, delay) in steps {
            sent += period;
            arrived = arrived.max(sent - ahead + delay);
            if let Some(at) = clock.stamp(sent, arrived, true) {
                prop_assert!(at <= arrived && arrived - at <= arrived - (sent - ahead));
            }
        }
    }

    /// A single wrong stamp in any direction does not end the flight.
    #[test]
    fn a_single_wrong_stamp_is_tolerated(wrong in any::<u64>(), at in 200u64..400) {
        let (mut clock, mut worst_us) = (SourceClock::default(), 0);
        for n in 0..1000u64 {
            let (sent, arrived) = (HOUR_US + n * PERIOD_US, n * PERIOD_US + 500);
            let said = if n == at { wrong } else { sent };
            match clock.stamp(said, arrived, true) {
                Some(at_us) => worst_us = worst_us.max(arrived - at_us),
                None => prop_assert!(n == at, "state {n} was refused"),
            }
        }
        // A stamp slightly behind counts as late.
        prop_assert!(worst_us <= PERIOD_US + 2_000, "{worst_us} us");
    }

    /// After any step of a clock, states are used again within 50 ms. A step back by less than a period overestimates
    /// their age by at most that step.
    #[test]
    fn the_flight_continues_after_any_step(step in any::<i64>(), period_us in 1_000u64..20_000) {
        let mut clock = SourceClock::default();
        let mut last_us = 0;
        for n in 0..40_000_000 / period_us {
            let (sent, arrived) = ((1 << 62) + n * period_us, n * period_us + 500);
            let said = if n * period_us < EVENT_US { sent } else { sent.wrapping_add_signed(step / 2) };
            if let Some(at_us) = clock.stamp(said, arrived, true) {
                prop_assert!(arrived - at_us <= period_us);
                prop_assert!(arrived - last_us <= 50_000 + period_us, "{} us without a state", arrived - last_us);
                last_us = arrived;
            }
        }
    }
}
