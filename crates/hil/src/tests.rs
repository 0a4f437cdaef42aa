//! Tests the loop with the host as autopilot, in lockstep.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, reason = "tests")]

use super::*;
use afbc_scenario::contender::Law;
use afbc_scenario::trajectory::Trajectory;
use afbc_scenario::{Scenario, built_in};
use afbc_sim::columns::MOTION;
use afbc_sim::metrics::{Accumulator, Metrics};
use afbc_sim::run::FlightResult;
use core::ops::ControlFlow;
use nalgebra::Vector3;

fn scenario(name: &str, duration_s: f64) -> Scenario {
    Scenario { duration_s, ..built_in(name).unwrap().read().unwrap() }
}

fn fly_host(scenario: &Scenario) -> (LoopEnd, Metrics) {
    let (mut station, mut host, mut metrics) = (Station::new(), Host::new().unwrap(), Accumulator::default());
    let end = fly(scenario, &mut station, &mut host, MessagePeriods::LOCKSTEP, |sample| {
        metrics.add(sample);
        ControlFlow::Continue(())
    });
    (end.unwrap(), metrics.finish())
}

#[test]
fn the_link_hardly_changes_the_metrics() {
    let scenario = scenario("paper", 60.0);
    let (end, looped) = fly_host(&scenario);
    assert_eq!(end, LoopEnd { lost: None, interrupted: false, disarmed: true });
    let plain = FlightResult::fly(&scenario, &firmware(&scenario).unwrap(), u64::MAX).unwrap().metrics;
    // The link rounds the attitude to an f32 quaternion, and has no yaw acceleration.
    assert!((looped.rmse - plain.rmse).amax() < 1e-3, "{} {}", looped.rmse, plain.rmse);
    assert!((looped.max_abs - plain.max_abs).amax() < 5e-3, "{} {}", looped.max_abs, plain.max_abs);
}

#[test]
fn a_flight_is_the_same_every_time() {
    let scenario = scenario("paper", 8.0);
    assert_eq!(fly_host(&scenario), fly_host(&scenario));
}

#[test]
fn what_the_firmware_does_not_hold_is_refused() {
    let mut heavier = scenario("hover", 1.0);
    heavier.vehicle.mass_kg *= 2.0;
    let mut livelier = scenario("hover", 1.0);
    if let Law::Afbc(gains) = &mut livelier.contenders[0].law {
        gains.z.gamma *= 2.0;
    }
    let mut slower = scenario("hover", 1.0);
    slower.contenders[0].settings.command_filter_rad_s = 20.0;
    let mut baseline = scenario("hover", 1.0);
    baseline.contenders.remove(0);
    for (scenario, what) in
        [(heavier, "another vehicle"), (livelier, "other gains"), (slower, "other settings"), (baseline, "another law")]
    {
        let error = check(&scenario).unwrap_err().to_string();
        assert!(error.contains(what) && !error.contains('\n'), "{error}");
    }
    assert!(check(&scenario("hover", 1.0)).is_ok());
}

#[test]
fn a_vehicle_that_does_not_arm_says_why() {
    let mut tilted = scenario("hover", 1.0);
    tilted.initial.attitude_rad.x = 0.5;
    let error = fly(&tilted, &mut Station::new(), &mut Host::new().unwrap(), MessagePeriods::LOCKSTEP, |_| {
        ControlFlow::Continue(())
    });
    assert_eq!(error.unwrap_err().to_string(), "the vehicle did not arm: arming refused: tilt too large");
}

#[test]
fn a_dead_line_is_noticed() {
    struct Nobody;
    impl Autopilot for Nobody {
        fn exchange(&mut self, _: &[u8], _: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
            Ok(())
        }
    }
    let scenario = scenario("hover", 1.0);
    let error =
        fly(&scenario, &mut Station::new(), &mut Nobody, MessagePeriods::LOCKSTEP, |_| ControlFlow::Continue(()));
    assert!(matches!(error, Err(Error::Silent)));
}

/// Without the instruments' readings, the flight is refused: the station's states would replace the estimate under
/// test.
#[test]
fn instruments_that_nobody_reads_are_refused() {
    struct Elsewhere;
    impl Autopilot for Elsewhere {
        fn exchange(&mut self, _: &[u8], _: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
            Ok(())
        }
    }
    let scenario = scenario("mocap", 1.0);
    let error =
        fly(&scenario, &mut Station::new(), &mut Elsewhere, MessagePeriods::LOCKSTEP, |_| ControlFlow::Continue(()));
    assert!(error.unwrap_err().to_string().contains("[instruments]"));
}

/// The firmware flies on its own estimate. Without a tracker it reports what is missing, and does not arm.
#[test]
fn the_firmware_flies_on_its_own_estimate() {
    let mut scenario = scenario("mocap", 8.0);
    let mut off_m: f64 = 0.0;
    let end = fly(&scenario, &mut Station::new(), &mut Host::new().unwrap(), MessagePeriods::LOCKSTEP, |sample| {
        let distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
        off_m = if sample.time_s < 5.0 { 0.0 } else { off_m.max(distance_m) };
        ControlFlow::Continue(())
    });
    assert_eq!(end.unwrap(), LoopEnd { lost: None, interrupted: false, disarmed: true });
    assert!(off_m > 0.0 && off_m < 0.02, "{off_m} m");
    scenario.outages = vec![afbc_scenario::Outage { start_s: -10.0, end_s: 20.0 }];
    let error = fly(&scenario, &mut Station::new(), &mut Host::new().unwrap(), MessagePeriods::LOCKSTEP, |_| {
        ControlFlow::Continue(())
    });
    assert_eq!(error.unwrap_err().to_string(), "the vehicle did not arm: arming refused: estimator has no heading");
}

/// Outdoors, the local frame's origin is the vehicle's position at the start. Whatever the receiver's error is then,
/// the vehicle arms and flies the reference from there. The remaining error is the change of the receiver's error: at
/// most some 5 m, for standard deviations of 1.2 m, 1.2 m and 1.8 m at both times.
#[test]
fn a_receiver_that_is_off_at_the_start_is_no_obstacle() {
    let outdoor = scenario("outdoor", 60.0);
    let arms_and_flies = |scenario: Scenario| {
        let mut off_m: f64 = 0.0;
        let end = fly(&scenario, &mut Station::new(), &mut Host::new().unwrap(), MessagePeriods::LOCKSTEP, |sample| {
            let distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
            off_m = if sample.time_s < 5.0 { 0.0 } else { off_m.max(distance_m) };
            ControlFlow::Continue(())
        });
        let flown = LoopEnd { lost: None, interrupted: false, disarmed: true };
        assert!(end.as_ref().is_ok_and(|end| *end == flown), "seed {}: {end:?}", scenario.seed);
        assert!(off_m < 5.0, "seed {}: {off_m} m", scenario.seed);
    };
    for seed in 1..=5 {
        arms_and_flies(Scenario { seed, ..outdoor.clone() });
    }
    // Starts kilometres from the scenario's origin.
    for seed in 6..=20 {
        let mut away = Scenario { seed, duration_s: 6.0, ..outdoor.clone() };
        away.initial.position_m += Vector3::new(200.0, -900.0, 30.0) * seed as f64;
        let position_m = away.initial.position_m + Vector3::new(0.0, 0.0, 1.5);
        away.trajectory = Trajectory::Hover { position_m, yaw_rad: 0.35 };
        arms_and_flies(away);
    }
}

/// The firmware's estimator uses the settings in the vehicle's file.
#[test]
fn the_firmwares_estimator_is_the_vehicle_files() {
    let paper = afbc_vehicles::built_in("paper").unwrap();
    let flown = |table: &str| {
        let vehicle = afbc_vehicles::parse("my.toml", &format!("{}\n{table}", paper.text), "my").unwrap();
        let scenario = scenario("mocap", 2.0).on(&vehicle, afbc::Profile::Flight).unwrap();
        let (mut station, mut host) = (Station::new(), Host::for_vehicle(&vehicle).unwrap());
        let end = fly(&scenario, &mut station, &mut host, MessagePeriods::LOCKSTEP, |_| ControlFlow::Continue(()));
        end.map(|end| end.lost).map_err(|error| error.to_string())
    };
    assert_eq!(flown(""), Ok(None));
    let unstarted = flown("[estimator]\nalign_s = 30.0");
    assert_eq!(unstarted.unwrap_err(), "the vehicle did not arm: arming refused: estimator has no attitude yet");
}

#[test]
fn the_observer_can_break_off() {
    let scenario = scenario("hover", 5.0);
    let mut steps = 0;
    let end = fly(&scenario, &mut Station::new(), &mut Host::new().unwrap(), MessagePeriods::LOCKSTEP, |_| {
        steps += 1;
        if steps == 100 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(end.unwrap(), LoopEnd { lost: None, interrupted: true, disarmed: true });
    assert_eq!(steps, 100);
}

/// Outages apply to the firmware, too: the vehicle descends, and reports that its motors are off.
#[test]
fn a_link_that_stays_down_ends_the_flight() {
    let mut scenario = scenario("hover", 20.0);
    scenario.outages = vec![afbc_scenario::Outage { start_s: 2.0, end_s: 20.0 }];
    let (end, _) = fly_host(&scenario);
    let lost = end.lost.expect("it cannot go on");
    assert!(lost.time_s > 2.0, "{lost:?}");
    scenario.outages.clear();
    assert_eq!(fly_host(&scenario).0.lost, None);
}

/// The log has the columns of every log, then the rotors', and a row for every 10 ms.
#[test]
fn the_log_has_the_columns_of_every_log() {
    let scenario = scenario("hover", 0.5);
    let path = std::env::temp_dir().join(format!("afbc-loop-log-{}.csv", std::process::id()));
    let (mut station, mut host, mut log) =
        (Station::new(), Host::new().unwrap(), Log::new(std::fs::File::create(&path).unwrap(), 4).unwrap());
    let mut logged = Vec::new();
    let end = fly(&scenario, &mut station, &mut host, MessagePeriods::LOCKSTEP, |sample| {
        log.add(sample).unwrap();
        logged.push(*sample);
        ControlFlow::Continue(())
    });
    log.finish().unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert!(end.is_ok());
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let motion = MOTION.map(|(name, _)| name);
    assert_eq!(header[..motion.len()], motion);
    assert_eq!(header[motion.len()..], ["omega1_rad_s", "omega2_rad_s", "omega3_rad_s", "omega4_rad_s"]);
    let rows: Vec<Vec<f64>> = lines.map(|row| row.iter().map(|cell| cell.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), logged.len().div_ceil(10));
    for (row, sample) in rows.iter().zip(logged.iter().step_by(10)) {
        let mut expected = MOTION.map(|(_, value)| value(sample)).to_vec();
        expected.extend(sample.action.speeds.0.iter().take(4).map(|speed| f64::from(*speed)));
        // Speeds are written with the fewest digits that restore an f32.
        let same = |(a, b): (&f64, &f64)| a == b || *a as f32 == *b as f32;
        assert!(row.len() == expected.len() && row.iter().zip(&expected).all(same), "{row:?}, not {expected:?}");
    }
}
