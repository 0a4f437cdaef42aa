//! Tests of PWM and OneShot125 pulses against the ranges that motor controllers accept: 1000 to 2000 us and 125 to 250
//! us.

use afbc_flight_core::protocol::{MotorProtocol, MotorSignal};
use afbc_flight_core::pulse::{PulseFormat, PulseTiming};
use afbc_flight_core::timer_clock::TimerClock;
use afbc_types::Choice;
use proptest::prelude::*;

/// Clocks of the chips' timers \[Hz\].
const CLOCKS: [u32; 4] = [84_000_000, 168_000_000, 200_000_000, 240_000_000];
/// Format, with shortest pulse, longest pulse and period \[us\].
const FORMATS: [(PulseFormat, [f64; 3]); 2] =
    [(PulseFormat::PWM400, [1000.0, 2000.0, 2500.0]), (PulseFormat::ONESHOT125, [125.0, 250.0, 2000.0])];

fn timing(timer_hz: u32, format: PulseFormat) -> PulseTiming {
    PulseTiming::new(TimerClock::new(timer_hz).expect("valid"), format)
}

/// Returns the time of one count \[us\].
fn count_us(timer_hz: u32, timing: &PulseTiming) -> f64 {
    f64::from(timing.divider()) * 1e6 / f64::from(timer_hz)
}

#[test]
fn compare_values_by_hand() {
    // 84 MHz divided by 4 gives 21 counts per us: 2500 us are 52,500 counts, which fit 16 bits.
    let pwm = timing(84_000_000, PulseFormat::PWM400);
    assert_eq!((pwm.divider(), pwm.period()), (4, 52_500));
    // 1047.5 is the middle of 48 to 2047.
    let compare = [(0, 21_000), (48, 21_000), (1047, 31_495), (1048, 31_505), (2047, 42_000)];
    // 168 MHz divided by 6 gives 28 counts per us: 56,000 in 2 ms.
    let one_shot = timing(168_000_000, PulseFormat::ONESHOT125);
    assert_eq!((one_shot.divider(), one_shot.period()), (6, 56_000));
    for (throttle, counts) in compare {
        assert_eq!(pwm.compare(throttle), counts, "{throttle}");
    }
    for (throttle, counts) in [(0, 3_500), (48, 3_500), (2047, 7_000)] {
        assert_eq!(one_shot.compare(throttle), counts, "{throttle}");
    }
}

#[test]
fn every_protocol_has_a_word_and_is_its_own() {
    assert_eq!(MotorProtocol::ALL.len(), MotorProtocol::WORDS.len());
    let pulses = MotorProtocol::ALL.iter().filter(|it| matches!(it.signal(), MotorSignal::Pulses(_))).count();
    assert_eq!(pulses, 2);
    for (index, one) in MotorProtocol::ALL.iter().enumerate() {
        assert!(MotorProtocol::ALL.iter().skip(index + 1).all(|other| other.signal() != one.signal()));
    }
}

proptest! {
    /// Shortest pulse, longest pulse and period are right to half a count, which is at most a 32,000th of the period.
    #[test]
    fn ends_are_right(timer_hz in prop_oneof![prop::sample::select(&CLOCKS), 8_000_000u32..=500_000_000]) {
        for (format, [shortest_us, longest_us, period_us]) in FORMATS {
            let timing = timing(timer_hz, format);
            let count_us = count_us(timer_hz, &timing);
            let is = |counts: u16, us: f64| (f64::from(counts) * count_us - us).abs() <= 0.5001 * count_us;
            prop_assert!(is(timing.compare(0), shortest_us));
            prop_assert!(is(timing.compare(48), shortest_us));
            prop_assert!(is(timing.compare(2047), longest_us));
            prop_assert!(is(timing.period(), period_us));
            prop_assert!(timer_hz < 30_000_000 || timing.period() > 32_000);
        }
    }

    /// More throttle never gives a shorter pulse. Every pulse is in range, ends before the period, and its length is
    /// linear in the throttle.
    #[test]
    fn lengths_are_linear(timer_hz in prop::sample::select(&CLOCKS), a in 48u16..=2047, b in 48u16..=2047) {
        for (format, [shortest_us, longest_us, _]) in FORMATS {
            let timing = timing(timer_hz, format);
            let (less, more) = (timing.compare(a.min(b)), timing.compare(a.max(b)));
            prop_assert!(less <= more);
            prop_assert!(timing.compare(0) <= less && more <= timing.compare(2047) && more < timing.period());
            let share = f64::from(a - 48) / 1999.0;
            let us = shortest_us + share * (longest_us - shortest_us);
            let count_us = count_us(timer_hz, &timing);
            prop_assert!((f64::from(timing.compare(a)) * count_us - us).abs() <= 1.5 * count_us);
        }
    }

    /// An invalid throttle stops the motor.
    #[test]
    fn anything_else_is_a_stop(throttle in prop_oneof![0u16..48, 2048u16..]) {
        for (format, _) in FORMATS {
            let timing = timing(84_000_000, format);
            prop_assert_eq!(timing.compare(throttle), timing.compare(0));
        }
    }
}
