//! Tests rotors that do not turn as commanded, and the notch that follows the rotors.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_estimator::VelocityNotch;
use afbc_flight_core::motor::{Curve, Response};
use afbc_onboard::{EscSettings, NotchFollower, RotorFailure, RotorMonitor};
use afbc_types::Stamped;
use proptest::prelude::*;

const TICK_US: u64 = 1_000;

/// Four rotors that follow their commands, one measured every 3 ms in turn, with one millisecond delay.
struct Bench {
    monitor: RotorMonitor,
    speeds: [f32; 4],
    late: [f32; 4],
    tau_s: f32,
    /// Share of the commanded speed that the rotors reach.
    sag: f32,
    stopped: Option<usize>,
    now_us: u64,
    news: Vec<(u64, u8, Option<RotorFailure>)>,
}

impl Bench {
    fn new(tau_s: f32, sag: f32) -> Self {
        let monitor = RotorMonitor::new(&Response { time_constant_s: 0.03 }, &Curve::DEFAULT);
        let stopped = None;
        Bench { monitor, speeds: [0.0; 4], late: [0.0; 4], tau_s, sag, stopped, now_us: 0, news: Vec::new() }
    }

    fn tick(&mut self, armed: bool, commands: [f32; 4]) {
        self.now_us += TICK_US;
        self.monitor.commanded(self.now_us, armed, &commands);
        self.late = self.speeds;
        for (rotor, (speed, command)) in self.speeds.iter_mut().zip(commands).enumerate() {
            let target = if self.stopped == Some(rotor) || !armed { 0.0 } else { self.sag * command.max(50.0) };
            *speed += (target - *speed) * 1e-3 / self.tau_s;
        }
        let tick = self.now_us / TICK_US;
        if tick.is_multiple_of(3) {
            let rotor = (tick / 3 % 4) as u8;
            let speed = Stamped { value: self.late[usize::from(rotor)], at_us: self.now_us };
            if let Some(news) = self.monitor.measured(rotor, speed) {
                self.news.push((self.now_us, news.rotor, news.failure));
            }
        }
    }
}

proptest! {
    /// Rotors with half to twice the configured time constant, down to three quarters of the voltage, raise no alarm
    /// for any commands. A rotor that stops is reported within 100 ms while it is commanded more than its idle speed.
    #[test]
    fn only_stopped_rotors_are_told(
        steps in proptest::collection::vec((1..150_u64, prop::array::uniform4(0.0..900.0_f32)), 40),
        slow in 0.5..2.0_f32, sag in 0.75..1.1_f32, stopped in 0..4_usize,
    ) {
        let mut bench = Bench::new(0.03 * slow, sag);
        for (ms, commands) in &steps {
            (0..*ms).for_each(|_| bench.tick(true, *commands));
        }
        prop_assert!(bench.news.is_empty(), "{:?}", bench.news);
        prop_assert!(!bench.monitor.has_failed());
        (0..300).for_each(|_| bench.tick(true, [400.0; 4]));
        bench.stopped = Some(stopped);
        let from_us = bench.now_us;
        (0..400).for_each(|_| bench.tick(true, [400.0; 4]));
        let (at_us, rotor, _) = bench.news[0];
        // From full to half speed a rotor takes 0.7 time constants of 0.03 s, and twice that if it is slow.
        prop_assert!(at_us - from_us <= 100_000, "{} us", at_us - from_us);
        prop_assert_eq!(usize::from(rotor), stopped);
        prop_assert_eq!(bench.news.last().unwrap().2, Some(RotorFailure::Stopped));
        prop_assert!(bench.news.iter().all(|(_, rotor, _)| usize::from(*rotor) == stopped));
        // The rotor turns again.
        bench.stopped = None;
        (0..1_000).for_each(|_| bench.tick(true, [400.0; 4]));
        prop_assert_eq!(bench.news.last().unwrap().2, None);
        prop_assert!(!bench.monitor.has_failed());
    }

    /// The notch follows the rotors within its bounds, and stays at the configured speed if their speed is unknown.
    #[test]
    fn the_notch_is_where_the_rotors_are(
        home in 70.0..300.0_f32, speeds in prop::array::uniform4(0.0..900.0_f32), age_us in 0..200_000_u64,
        follows in any::<bool>(), missing in any::<bool>(),
    ) {
        let home_notch = VelocityNotch::at(home);
        let mut follower = NotchFollower::new(home_notch);
        let now_us = 1_000_000;
        let stamped = speeds.map(|value| Some(Stamped { value, at_us: now_us - age_us }));
        let all = if missing { [stamped[0], None, stamped[2], stamped[3]] } else { stamped };
        let moved = follower.look(now_us, follows, all).map(|notch| notch.centre_rad_s());
        let mean: f32 = speeds.iter().sum::<f32>() / 4.0;
        let wanted = mean.clamp(0.5 * home, 2.0 * home);
        let known = follows && !missing && age_us <= 100_000;
        let stays = (wanted - home).abs() <= 0.01 * home || !(62.9..=628.0).contains(&wanted);
        prop_assert_eq!(moved.is_some(), known && !stays, "{:?} {}", moved, wanted);
        if let Some(moved) = moved {
            prop_assert!((moved - wanted).abs() < 1e-3 * wanted);
            // The notch moves at most a hundred times per second, and returns to the configured speed when the rotors
            // fall silent.
            prop_assert_eq!(follower.look(now_us + 9_000, true, [None; 4]), None);
            prop_assert_eq!(follower.look(now_us + 10_000, true, [None; 4]), home_notch);
            prop_assert_eq!(follower.look(now_us + 30_000, true, [None; 4]), None);
        }
    }
}

/// A rotor that turns too fast, or at a third of its speed, is desynchronised. A single wrong reading is ignored.
#[test]
fn one_out_of_step_is_told() {
    for wrong in [150.0, 900.0] {
        let mut monitor = RotorMonitor::new(&Response { time_constant_s: 0.02 }, &Curve::DEFAULT);
        let mut news = Vec::new();
        for ms in 0..3_000_u64 {
            monitor.commanded(1_000 * ms, true, &[400.0; 4]);
            if ms % 12 == 0 {
                let glitch = ms == 1_200;
                let value = if glitch || ms > 2_000 { wrong } else { 390.0 };
                news.extend(monitor.measured(2, Stamped { value, at_us: 1_000 * ms }).map(|news| (ms, news)));
            }
        }
        let [(ms, told)] = news[..] else { panic!("{news:?}") };
        assert_eq!((told.rotor, told.failure), (2, Some(RotorFailure::Desynchronised)));
        assert!((2_000..2_050).contains(&ms), "{ms}");
    }
}

/// A rotor that never starts is reported once its starting time is over. Nothing is reported while disarmed.
#[test]
fn one_that_never_starts_is_told() {
    let mut bench = Bench::new(0.03, 1.0);
    bench.stopped = Some(1);
    (0..2_000).for_each(|_| bench.tick(false, [0.0; 4]));
    assert_eq!(bench.news, []);
    (0..2_000).for_each(|_| bench.tick(true, [200.0; 4]));
    let (at_us, rotor, failure) = bench.news[0];
    assert_eq!((rotor, failure), (1, Some(RotorFailure::Stopped)));
    assert!((3_500_000..3_600_000).contains(&at_us), "{at_us}");
    // Disarming ends the failure.
    bench.tick(false, [0.0; 4]);
    assert_eq!(bench.monitor.failures(), [None; 8]);
}

#[test]
fn numbers_that_are_none_do_no_harm() {
    let mut monitor = RotorMonitor::new(&Response::DEFAULT, &Curve::DEFAULT);
    for ms in 0..3_000_u64 {
        let command = if ms % 2 == 0 { f32::NAN } else { -1.0 };
        monitor.commanded(1_000 * ms, true, &[command; 4]);
        assert_eq!(monitor.measured((ms % 9) as u8, Stamped { value: 0.0, at_us: 1_000 * ms }), None);
    }
    assert_eq!(EscSettings::DEFAULT.poles, 14);
}
