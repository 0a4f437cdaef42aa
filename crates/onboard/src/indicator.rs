//! Signals of a vehicle's LED and buzzer.

use crate::tick_record::Report;
use afbc_flight_core::{Mode, Refusal};

/// Length of a step of a pattern \[us\], and number of steps.
pub const STEP_US: u64 = 125_000;
const STEPS: u64 = 16;
/// Time after power-up for the set-up of sensors, in which no fault is shown \[us\].
const STARTING_US: u64 = 2_000_000;

/// State of the vehicle that LED and buzzer show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Indication {
    /// Starting up.
    #[default]
    Starting,
    /// The vehicle is disarmed and cannot be armed: it is not at rest, has no position, or the like.
    NotReady,
    /// The vehicle is disarmed and can be armed.
    Ready,
    /// Armed.
    Armed,
    /// The vehicle is armed, and either a failsafe has taken over or the vehicle should land.
    Failsafe,
    /// The vehicle is disarmed. A sensor, the clock or a task has a fault.
    Fault,
}

/// Steps of a pattern, the first one in the highest bit.
struct Pattern {
    led: u16,
    /// Pattern of the buzzer that is played once, when the indication begins.
    buzzer_once: u16,
    /// Repeated pattern of the buzzer.
    buzzer: u16,
}

/// States of LED and buzzer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndicatorSignals {
    /// True if the LED is lit.
    pub led: bool,
    /// True if the buzzer sounds.
    pub buzzer: bool,
}

impl Indication {
    /// All indications.
    pub const ALL: [Indication; 6] = [
        Indication::Starting,
        Indication::NotReady,
        Indication::Ready,
        Indication::Armed,
        Indication::Failsafe,
        Indication::Fault,
    ];

    /// Returns the indication for a tick's report.
    pub fn of(report: &Report) -> Self {
        let clock_failed = report.health.rate.clock_failed;
        if report.mode.armed() {
            let takes_over = report.mode != Mode::Flying || report.health.observed || report.guided.failsafe.is_some();
            return if takes_over || clock_failed { Indication::Failsafe } else { Indication::Armed };
        }
        let broken = [Refusal::SensorFailed, Refusal::Unhealthy].iter().any(|reason| report.against.contains(*reason));
        match report.time_us {
            ..STARTING_US => Indication::Starting,
            _ if clock_failed || broken => Indication::Fault,
            _ if report.against.is_empty() => Indication::Ready,
            _ => Indication::NotReady,
        }
    }

    // No two LED patterns are alike, even if they are watched from different steps on. A test compares all shifts.
    const fn pattern(self) -> Pattern {
        match self {
            Indication::Starting => Pattern { led: 0b1000_0000_1000_0000, buzzer_once: 0, buzzer: 0 },
            Indication::NotReady => Pattern { led: 0b1010_0000_0000_0000, buzzer_once: 0, buzzer: 0 },
            Indication::Ready => Pattern { led: 0b1111_1111_0000_0000, buzzer_once: 0b1 << 15, buzzer: 0 },
            Indication::Armed => Pattern { led: 0xFFFF, buzzer_once: 0b1111 << 12, buzzer: 0 },
            Indication::Failsafe => Pattern { led: 0xCCCC, buzzer_once: 0, buzzer: 0xF0F0 },
            Indication::Fault => Pattern { led: 0xAAAA, buzzer_once: 0b1_0101 << 11, buzzer: 0 },
        }
    }
}

/// Plays the pattern of the present indication.
#[derive(Clone, Copy, Debug, Default)]
pub struct Indicator {
    shown: Indication,
    /// Start of the present indication \[us\].
    since_us: u64,
}

impl Indicator {
    /// Returns the signals for `indication` at `now_us`.
    pub fn signals(&mut self, now_us: u64, indication: Indication) -> IndicatorSignals {
        if indication != self.shown {
            *self = Indicator { shown: indication, since_us: now_us };
        }
        let step = now_us.saturating_sub(self.since_us) / STEP_US;
        let Pattern { led, buzzer_once, buzzer } = indication.pattern();
        let sounds = if step < STEPS { buzzer_once | buzzer } else { buzzer };
        let is_on = |pattern: u16| pattern << (step % STEPS) & 0x8000 != 0;
        IndicatorSignals { led: is_on(led), buzzer: is_on(sounds) }
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "tests")]
mod tests {
    extern crate std;

    use super::*;
    use crate::configuration::Configuration;
    use crate::control_inputs::ControlInputs;
    use crate::flight::Flight;
    use crate::readings::Readings;
    use afbc_guidance::notice::FailsafeCause;
    use std::string::String;
    use std::vec::Vec;

    /// Returns the report of a disarmed vehicle.
    fn report() -> Report {
        let mut flight = Flight::<4>::new(&Configuration::default()).expect("valid");
        flight.tick(1_000, &mut ControlInputs::EMPTY.clone(), &Readings::NONE)
    }

    #[test]
    fn a_report_comes_to_what_it_means() {
        use afbc_flight_core::Reasons;
        let mut report = report();
        assert_eq!(Indication::of(&report), Indication::Starting);
        report.time_us = 5_000_000;
        for (reasons, expected) in [
            (Reasons::NONE, Indication::Ready),
            (Refusal::NotAtRest.into(), Indication::NotReady),
            (Refusal::PositionUnknown.into(), Indication::NotReady),
            (Refusal::SensorFailed.into(), Indication::Fault),
            (Reasons::from(Refusal::Unhealthy).and(Refusal::NotAtRest.into()), Indication::Fault),
        ] {
            report.against = reasons;
            assert_eq!(Indication::of(&report), expected, "{reasons:?}");
        }
        report.against = Reasons::NONE;
        report.health.rate.clock_failed = true;
        assert_eq!(Indication::of(&report), Indication::Fault);
        report.mode = Mode::Flying;
        assert_eq!(Indication::of(&report), Indication::Failsafe);
        report.health.rate.clock_failed = false;
        // While armed, neither reasons against arming nor the time matter.
        (report.against, report.time_us) = (Refusal::AlreadyArmed.into(), 1_000);
        assert_eq!(Indication::of(&report), Indication::Armed);
        report.guided.failsafe = Some(FailsafeCause::Station);
        assert_eq!(Indication::of(&report), Indication::Failsafe);
        report.guided.failsafe = None;
        for mode in [Mode::Coasting, Mode::Descending] {
            report.mode = mode;
            assert_eq!(Indication::of(&report), Indication::Failsafe, "{mode:?}");
        }
    }

    /// Returns LED and buzzer in the first `steps` steps of an indication.
    fn shown(indication: Indication, steps: u64) -> [String; 2] {
        let other = if indication == Indication::Armed { Indication::Ready } else { Indication::Armed };
        let (mut indicator, from_us) = (Indicator::default(), 7_654_321);
        indicator.signals(from_us - 1, other);
        let signals: Vec<_> = (0..steps).map(|step| indicator.signals(from_us + step * STEP_US, indication)).collect();
        let line = |is_on: fn(&IndicatorSignals) -> bool| {
            signals.iter().map(|signals| if is_on(signals) { '#' } else { '.' }).collect()
        };
        [line(|signals| signals.led), line(|signals| signals.buzzer)]
    }

    /// The patterns match the table of docs/reference/firmware.md, in steps of 1/8 s.
    #[test]
    fn patterns_are_as_documented() {
        for (indication, led, once, again) in [
            (Indication::Starting, "#.......#.......", "................", "................"),
            (Indication::NotReady, "#.#.............", "................", "................"),
            (Indication::Ready, "########........", "#...............", "................"),
            (Indication::Armed, "################", "####............", "................"),
            (Indication::Failsafe, "##..##..##..##..", "####....####....", "####....####...."),
            (Indication::Fault, "#.#.#.#.#.#.#.#.", "#.#.#...........", "................"),
        ] {
            let [lit, sounds] = shown(indication, 48);
            assert_eq!(lit, [led, led, led].concat(), "{indication:?}");
            assert_eq!(sounds, [once, again, again].concat(), "{indication:?}");
        }
    }

    /// Two seconds of the LED's pattern, from any step on, identify the indication.
    #[test]
    fn no_two_are_alike_from_any_moment_on() {
        let turned = |indication, by: usize| {
            let [lit, _] = shown(indication, 32);
            String::from(&lit[by..by + 16])
        };
        for (at, one) in Indication::ALL.into_iter().enumerate() {
            for other in Indication::ALL.into_iter().skip(at + 1) {
                assert!((0..16).all(|by| turned(one, 0) != turned(other, by)), "{one:?} {other:?}");
            }
        }
    }

    #[test]
    fn any_time_is_a_step() {
        let mut indicator = Indicator::default();
        for now_us in [0, 1, u64::MAX, 5] {
            for indication in Indication::ALL {
                indicator.signals(now_us, indication);
            }
        }
    }
}
