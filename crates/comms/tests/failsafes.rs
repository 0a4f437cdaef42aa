//! Failsafes are reported once as text, and in at least one heartbeat.

use crate::common::Bench;
use afbc_estimator::{AidSet, AidSource};
use afbc_flight_core::{EndReason, Mode};
use afbc_guidance::FailsafeCause;
use afbc_mavlink::{Downlink, MavSeverity, Uplink};
use afbc_onboard::Report;
use afbc_types::{Setpoint, State};
use proptest::prelude::*;

const WARNING: MavSeverity = MavSeverity::MAV_SEVERITY_WARNING;
const INFO: MavSeverity = MavSeverity::MAV_SEVERITY_INFO;
const CRITICAL: MavSeverity = MavSeverity::MAV_SEVERITY_CRITICAL;
const EMERGENCY: MavSeverity = MavSeverity::MAV_SEVERITY_EMERGENCY;

fn notices(said: &[Downlink]) -> Vec<(MavSeverity, String)> {
    let notice = |message: &Downlink| match message {
        Downlink::Text { severity, text } => Some((*severity, text.to_str().expect("words").to_owned())),
        _ => None,
    };
    said.iter().filter_map(notice).collect()
}

/// Returns whether the heartbeat reports a failsafe, if there is a heartbeat.
fn critical(said: &[Downlink]) -> Option<bool> {
    let heartbeat = |message: &Downlink| match message {
        Downlink::Heartbeat { failsafe, .. } => Some(*failsafe),
        _ => None,
    };
    said.iter().find_map(heartbeat)
}

/// Runs ticks with or without states and setpoints. Returns the texts and the failsafe flags of the heartbeats.
fn fly(bench: &mut Bench, ticks: u32, states: bool, setpoints: bool) -> (Vec<(MavSeverity, String)>, Vec<bool>) {
    let (mut received, mut heartbeats) = (Vec::new(), Vec::new());
    for _ in 0..ticks {
        if states {
            bench.measure(&State::default());
        }
        if setpoints {
            bench.hear(Uplink::Setpoint(Setpoint::default()));
        }
        let (_, said) = bench.step();
        received.extend(notices(&said));
        heartbeats.extend(critical(&said));
    }
    (received, heartbeats)
}

#[test]
fn losing_the_state_is_reported_step_by_step() {
    let mut bench = Bench::flying();
    let (received, heartbeats) = fly(&mut bench, 5000, false, true);
    let severities: Vec<_> = received.iter().map(|(severity, _)| *severity).collect();
    assert_eq!(severities, [WARNING, CRITICAL, EMERGENCY, INFO], "{received:?}");
    let words = ["state for 20 ms: coasting", "state for 0.25 s: descending", "motors stopped", "hold: disarmed"];
    for ((_, text), words) in received.iter().zip(words) {
        assert!(text.contains(words), "{text}");
    }
    // The failsafe lasts until 2.25 s, and heartbeats show it for one more second.
    assert_eq!(heartbeats.iter().filter(|critical| **critical).count(), 3, "{heartbeats:?}");
    assert_eq!(heartbeats.last(), Some(&false));
}

/// The state is missing for 30 ms at different times between two heartbeats.
#[test]
fn a_short_gap_shows_in_the_next_heartbeat() {
    for before in [1, 100, 500, 850, 899, 960, 990] {
        let mut bench = Bench::flying();
        assert_eq!(fly(&mut bench, before, true, true).0, []);
        let (received, mut heartbeats) = fly(&mut bench, 30, false, true);
        assert!(matches!(received.as_slice(), [(WARNING, text)] if text.contains("coasting")), "{received:?}");
        let (received, after) = fly(&mut bench, 3000, true, true);
        assert_eq!(received, []);
        heartbeats.extend(after);
        let critical = heartbeats.iter().filter(|critical| **critical).count();
        assert!((1..=2).contains(&critical), "{before} ms after: {heartbeats:?}");
        assert_eq!(heartbeats.last(), Some(&false));
    }
}

#[test]
fn losing_the_setpoint_is_reported_each_time() {
    let mut bench = Bench::flying();
    for _ in 0..3 {
        let (received, _) = fly(&mut bench, 2000, true, false);
        assert!(matches!(received.as_slice(), [(WARNING, text)] if text.contains("no targets")), "{received:?}");
        // The vehicle holds until Offboard mode is selected again.
        let (_, heartbeats) = fly(&mut bench, 1000, true, true);
        assert_eq!(heartbeats, [true]);
        bench.follow();
        let (received, heartbeats) = fly(&mut bench, 3000, true, true);
        assert!(matches!(received.as_slice(), [(INFO, text)] if text.contains("offboard")), "{received:?}");
        assert_eq!(heartbeats, [true, false, false]);
    }
}

#[test]
fn a_disarmed_vehicle_reports_no_failsafe() {
    let mut bench = Bench::new();
    assert_eq!(fly(&mut bench, 5000, false, false), (vec![], vec![false; 5]));
}

/// Flying on a tracker's poses is a failsafe; vibration is not. Each is announced once each time it begins. The
/// guidance's own failsafes show in the heartbeat, and the guidance announces them itself.
#[test]
fn other_states_are_reported_once_each_time() {
    type Set = fn(&mut Report, bool);
    type Texts = &'static [(MavSeverity, &'static str)];
    let cases: [(Set, Texts, bool); 3] = [
        (
            |report, on| report.health.observed = on,
            &[(CRITICAL, "IMU failed: flying on the tracker's poses alone")],
            true,
        ),
        (|report, on| report.shaken = on, &[(WARNING, "vibration above 4.9 m/s2: check rotors and mounts")], false),
        (|report, on| report.guided.failsafe = on.then_some(FailsafeCause::Fence), &[], true),
    ];
    for (set, expected, is_failsafe) in cases {
        let mut bench = Bench::new();
        let (mut report, _) = bench.step();
        report.mode = Mode::Flying;
        // The condition is on and off in turn, for more than a second each.
        for round in 0..4 {
            let on = round % 2 == 0;
            set(&mut report, on);
            let (mut received, mut heartbeats) = (Vec::new(), Vec::new());
            for _ in 0..2500 {
                bench.now_us += 1000;
                report.time_us = bench.now_us;
                let said = bench.said(&report);
                received.extend(notices(&said));
                heartbeats.extend(critical(&said));
            }
            let expected = expected.iter().filter(|_| on).map(|(severity, text)| (*severity, (*text).to_owned()));
            assert_eq!(received, expected.collect::<Vec<_>>());
            assert_eq!(heartbeats.last(), Some(&(on && is_failsafe)), "{heartbeats:?}");
        }
    }
}

/// In the air, a sensor that the estimator ignores is announced once, also if it is ignored on and off, and once more
/// after it has been used for five seconds.
#[test]
fn an_ignored_sensor_is_announced_in_the_air() {
    let names = [
        "tracker position",
        "tracker attitude",
        "GNSS position",
        "GNSS height",
        "GNSS velocity",
        "barometer",
        "compass",
    ];
    for (aid, name) in AidSource::ALL.into_iter().zip(names) {
        let mut bench = Bench::new();
        let (mut report, _) = bench.step();
        report.mode = Mode::Flying;
        let mut fly = |airborne, ignored, ticks| {
            report.guided.airborne = airborne;
            report.ignored = if ignored { AidSet::default().with(aid) } else { AidSet::default() };
            let mut received = Vec::new();
            for _ in 0..ticks {
                bench.now_us += 1000;
                report.time_us = bench.now_us;
                received.extend(notices(&bench.said(&report)));
            }
            received
        };
        assert_eq!(fly(false, true, 100), []);
        assert_eq!(fly(true, true, 100), [(WARNING, format!("{name} disagrees with other sensors"))]);
        for _ in 0..5 {
            assert_eq!(fly(true, false, 4900), []);
            assert_eq!(fly(true, true, 100), []);
        }
        assert_eq!(fly(true, false, 5100), [(INFO, format!("{name} used again"))]);
        assert_eq!(fly(true, false, 10_000), []);
        // A landing ends it.
        assert_eq!(fly(true, true, 100).len(), 1);
        assert_eq!(fly(false, false, 10_000), []);
    }
}

fn modes() -> impl Strategy<Value = (Mode, usize)> {
    let mode = prop_oneof![Just(Mode::Disarmed), Just(Mode::Flying), Just(Mode::Coasting), Just(Mode::Descending)];
    (mode, prop_oneof![1..5usize, 1..1500usize])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// For any sequence of modes, each failsafe is reported once each time it begins. A heartbeat is critical if there
    /// was a failsafe since the previous heartbeat. A heartbeat is not critical if there was no failsafe for a second.
    #[test]
    fn each_failsafe_is_reported_once_each_time(modes in prop::collection::vec(modes(), 1..12), tumbles: bool) {
        let mut bench = Bench::new();
        let (idle, _) = bench.step();
        let (mut last, mut since, mut since_heartbeat) = (Mode::Disarmed, usize::MAX, false);
        for (mode, ticks) in modes {
            for tick in 0..ticks {
                bench.now_us += 1000;
                let given_up = last.armed() && !mode.armed();
                let end = if tumbles { EndReason::Tumbled } else { EndReason::StateLost };
                let mut report = Report { mode, ended: given_up.then_some(end), time_us: bench.now_us, ..idle };
                report.health.setpoint_stale = false;
                let said = bench.said(&report);

                let entered = tick == 0 && mode != last;
                let severities: Vec<_> = notices(&said).into_iter().map(|(severity, _)| severity).collect();
                let expected = match mode {
                    Mode::Coasting if entered => vec![WARNING],
                    Mode::Descending if entered => vec![CRITICAL],
                    Mode::Disarmed if given_up => vec![EMERGENCY],
                    _ => vec![],
                };
                prop_assert_eq!(severities, expected);

                let failsafe = matches!(mode, Mode::Coasting | Mode::Descending) || given_up;
                since = if failsafe { 0 } else { since.saturating_add(1) };
                since_heartbeat |= failsafe;
                if let Some(critical) = critical(&said) {
                    prop_assert!(critical || !since_heartbeat);
                    prop_assert!(!critical || since < 1000);
                    since_heartbeat = false;
                }
                last = mode;
            }
        }
    }
}
