//! Poses over the link, to vehicles with and without an IMU.

use crate::common::Bench;
use afbc_estimator::Measurement;
use afbc_flight_core::{Mode, Refusal};
use afbc_mavlink::{CommandResult, Downlink, Uplink, VehicleCommand};
use afbc_onboard::{Aged, Readings, Report};
use afbc_types::{Pose, PoseSigmas, Setpoint, State};
use nalgebra::Vector3;

/// Position and heading of the vehicle.
const PLACE_M: Vector3<f32> = Vector3::new(3.0, -2.0, 0.5);
const YAW_RAD: f32 = 0.7;
/// Time in which the estimator starts \[ms\].
const START_MS: u64 = 4_000;

/// Returns pseudo-random numbers between -1 and 1, different for each time.
fn noise(ms: u64) -> Vector3<f32> {
    let number = |k: u64| ((ms * 3 + k).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f32 / (1 << 23) as f32 - 1.0;
    Vector3::new(number(0), number(1), number(2))
}

/// Returns offset \[m\] and acceleration \[m/s2\] of the motion along x: at rest, then oscillating.
fn swing(ms: u64) -> (f32, f32) {
    const RATE_RAD_S: f32 = 2.0;
    let phase = RATE_RAD_S * (ms.saturating_sub(START_MS) as f32 * 1e-3);
    let begun = if ms > START_MS { 1.0 } else { 0.0 };
    (0.5 * (1.0 - phase.cos()), begun * 0.5 * RATE_RAD_S * RATE_RAD_S * phase.cos())
}

fn state(offset_m: f32) -> State {
    let position_m = PLACE_M + Vector3::new(offset_m, 0.0, 0.0);
    State { position_m, attitude_rad: Vector3::new(0.0, 0.0, YAW_RAD), ..State::default() }
}

/// Returns an IMU sample of a level vehicle with this acceleration along the earth's x.
fn sample(ms: u64, acceleration_m_s2: f32) -> Readings {
    let force = Vector3::new(YAW_RAD.cos() * acceleration_m_s2, -YAW_RAD.sin() * acceleration_m_s2, 9.81);
    let value = [noise(ms) * 1e-3, force + noise(ms + 1_000_000) * 0.02];
    Readings { imu: Some(Aged { value, age_us: 0 }), ..Readings::NONE }
}

/// Type of the message that carries a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
enum By {
    /// A pose message.
    Pose,
    /// A state message with wrong velocities and rates: only its pose is used.
    State,
}

fn message(by: By, sent_us: u64, state: State, sigmas: PoseSigmas) -> Uplink {
    match by {
        By::Pose => Uplink::Pose { sent_us, pose: Pose::of(&state, sigmas) },
        By::State => {
            let velocity_m_s = Vector3::new(5.0, 5.0, 5.0);
            Uplink::State { sent_us, state: State { velocity_m_s, ..state }, sigmas }
        }
    }
}

/// Returns the answer to an arm command, with a setpoint at the vehicle's place.
fn arm(bench: &mut Bench, from_ms: u64) -> Option<CommandResult> {
    let setpoint = Setpoint { position_m: PLACE_M, yaw_rad: YAW_RAD, ..Setpoint::default() };
    bench.hear(Uplink::Setpoint(setpoint));
    bench.hear(Uplink::Command(VehicleCommand::Arm));
    (from_ms..from_ms + 3).find_map(|ms| {
        let (_, said) = bench.sense(&sample(ms, 0.0));
        said.into_iter().find_map(|message| match message {
            Downlink::CommandAck { answer, .. } => Some(answer),
            _ => None,
        })
    })
}

/// Poses at 50 Hz are enough for position and heading, so the vehicle can be armed.
#[test]
fn a_vehicle_knows_where_it_is() {
    for by in [By::Pose, By::State] {
        let (mut bench, mut reported) = (Bench::new(), None);
        for ms in 0..START_MS {
            // The sender's clock differs from the vehicle's.
            if ms % 20 == 0 {
                let mut measured = state(0.0);
                measured.position_m += noise(ms) * 1e-3;
                bench.hear(message(by, 1_700_000_000_000_000 + ms * 1000, measured, PoseSigmas::UNKNOWN));
            }
            reported = bench.sense(&sample(ms, 0.0)).0.estimate;
        }
        let reported = reported.expect("an estimate");
        assert!((reported.position_m - PLACE_M).amax() < 0.005, "{by:?}: {reported:?}");
        assert!((reported.attitude_rad - Vector3::new(0.0, 0.0, YAW_RAD)).amax() < 0.02, "{by:?}: {reported:?}");
        assert!(reported.velocity_m_s.amax() < 0.05, "{by:?}: {reported:?}");
        assert_eq!(arm(&mut bench, START_MS), Some(CommandResult::Accepted), "{by:?}");
    }
}

/// Without poses heading and position are unknown, and arming is refused.
#[test]
fn without_poses_it_does_not() {
    let mut bench = Bench::new();
    for ms in 0..START_MS {
        bench.sense(&sample(ms, 0.0));
    }
    assert_eq!(arm(&mut bench, START_MS), Some(CommandResult::Refused(Refusal::HeadingUnknown as i32)));
}

/// A vehicle without an IMU ignores poses, even plausible ones of a tracker in use.
#[test]
fn without_an_inertial_sensor_poses_are_ignored() {
    let mut bench = Bench::new();
    let mut other = Bench::new();
    for ms in 0..3_000 {
        bench.hear(message(By::Pose, ms * 1000 + 500, state(noise(ms).x), PoseSigmas::UNKNOWN));
        assert_eq!(bench.inputs.inbox.pose(), None);
        for bench in [&mut bench, &mut other] {
            bench.measure(&State::default());
        }
        let reports = [bench.step().0, other.step().0];
        assert_eq!(reports[0], reports[1]);
        assert_eq!((reports[0].estimate, reports[0].health.frozen_states), (None, 0));
    }
}

/// Poses arrive 5 to 155 ms late while the vehicle moves at up to 1 m/s. Each is used for its own time. The shortest
/// delay of 5 ms cannot be known, and makes an error of 5 mm.
#[test]
fn late_poses_count_for_their_own_time() {
    for by in [By::Pose, By::State] {
        let (mut bench, mut waiting, mut late) = (Bench::new(), std::collections::VecDeque::new(), 0);
        for ms in 0..12_000 {
            if ms % 10 == 0 {
                let delay_ms = 5 + (ms % 400).min(400 - ms % 400) * 3 / 4;
                let mut measured = state(swing(ms).0);
                measured.position_m += noise(ms) * 1e-3;
                waiting.push_back((ms + delay_ms, message(by, ms * 1000, measured, PoseSigmas::UNKNOWN)));
            }
            while waiting.front().is_some_and(|(arrives_ms, _)| *arrives_ms <= ms) {
                let (_, message) = waiting.pop_front().expect("there is one");
                let before = bench.inputs.inbox.state().copied();
                bench.hear(message);
                let state = bench.inputs.inbox.state().filter(|state| Some(**state) != before);
                assert!(state.is_none_or(|state| state.age_us(bench.now_us) <= 20_000), "too old to fly on");
            }
            let (offset_m, acceleration_m_s2) = swing(ms);
            let (report, said) = bench.sense(&sample(ms, acceleration_m_s2));
            if ms > START_MS + 1_000 {
                let reported = report.estimate.expect("an estimate");
                let error_m = reported.position_m - state(offset_m).position_m;
                assert!(error_m.amax() < 0.03, "{by:?}, {ms} ms: {error_m}");
            }
            for message in said {
                if let Downlink::Health(health) = message {
                    late = health.states_refused.late;
                }
            }
        }
        // Until the vehicle has an estimate, late states are refused.
        assert!(late < 10, "{by:?}: {late}");
    }
}

/// A tracker that jumps by 0.2 m to and fro is smoothed if its messages give a large standard deviation.
#[test]
fn standard_deviations_count() {
    let wander = |position_m| {
        let sigmas = PoseSigmas { position_m, attitude_rad: Some(0.01) };
        let (mut bench, mut largest) = (Bench::new(), 0.0_f32);
        for ms in 0..20_000 {
            if ms % 20 == 0 {
                let measured = state(if ms % 40 == 0 { 0.2 } else { -0.2 } + 1e-3 * noise(ms).x);
                bench.hear(message(By::Pose, ms * 1000, measured, sigmas));
            }
            let (report, _) = bench.sense(&sample(ms, 0.0));
            if ms > 15_000 {
                largest = largest.max((report.estimate.expect("an estimate").position_m - PLACE_M).x.abs());
            }
        }
        largest
    };
    let (unsure, sure) = (wander(Some(0.5)), wander(None));
    assert!(unsure < 0.1 && sure > 0.15, "{unsure} m, {sure} m");
}

/// Data that a tracker sends after the IMU has failed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Left {
    States,
    Poses,
    /// The tracker sends the same pose again and again.
    Frozen,
    /// Poses with a large standard deviation.
    Unsure,
    /// Poses that arrive too late for flying.
    Late,
    /// Positions without attitude, as read by the vehicle's own sensors.
    Positions,
    Nothing,
}

/// Flies a vehicle that hovers at its place, is armed after 4 s and loses its IMU one second later. Returns the modes,
/// the texts after the failure, and the last report.
fn outlives(left: Left) -> (Vec<Mode>, Vec<String>, Report) {
    let (mut bench, place) = (Bench::new(), state(0.0));
    let (mut modes, mut texts, mut last) = (Vec::new(), Vec::new(), None);
    let dies_ms = START_MS + 1_000;
    for ms in 1..START_MS + 4_000 {
        let dead = ms > dies_ms;
        // A tracker never repeats a state exactly.
        let noise_ms = if dead && left == Left::Frozen { dies_ms } else { ms };
        let reported = State { position_m: place.position_m + noise(noise_ms) * 1e-4, ..place };
        let bad = PoseSigmas { position_m: Some(0.2), attitude_rad: Some(0.01) };
        let sigmas = if dead && left == Left::Unsure { bad } else { PoseSigmas::UNKNOWN };
        let sent_us = bench.now_us;
        let mut readings = if dead { Readings::NONE } else { sample(ms, 0.0) };
        match left {
            Left::States => bench.hear(Uplink::State { sent_us, state: reported, sigmas }),
            Left::Nothing | Left::Positions | Left::Late if dead => (),
            _ => bench.hear(Uplink::Pose { sent_us, pose: Pose::of(&reported, sigmas) }),
        }
        if dead && left == Left::Late {
            // The pose is put into the sensor readings, not sent over the link, whose clock would adapt to the constant
            // delay.
            let Pose { position_m, attitude, .. } = Pose::of(&reported, sigmas);
            let value = Measurement::Pose { position_m, attitude, position_sigma_m: 0.003, attitude_sigma_rad: 0.01 };
            readings.aids = [Some(Aged { value, age_us: 60_000 }), None];
        }
        if dead && left == Left::Positions {
            let value = Measurement::Position { position_m: reported.position_m, sigma_m: 0.003 };
            readings.aids = [Some(Aged { value, age_us: 1_000 }), None];
        }
        bench.hear(Uplink::Setpoint(Setpoint { position_m: PLACE_M, yaw_rad: YAW_RAD, ..Setpoint::default() }));
        if ms == START_MS {
            bench.follow();
            bench.hear(Uplink::Command(VehicleCommand::Arm));
        }
        let (report, said) = bench.sense(&readings);
        modes.push(report.mode);
        last = Some(report);
        texts.extend(said.into_iter().filter_map(|message| match message {
            Downlink::Text { text, .. } if dead => Some(text.to_str().expect("words").to_owned()),
            _ => None,
        }));
    }
    (modes, texts, last.expect("flown"))
}

/// After the IMU has failed, the vehicle continues flying on whole states of the link, or else on states observed from
/// poses, which is announced once. No other data save the vehicle.
#[test]
fn a_tracker_stands_in_for_a_dead_sensor() {
    use Left::{Frozen, Late, Nothing, Poses, Positions, States, Unsure};
    for left in [States, Poses, Frozen, Unsure, Late, Positions, Nothing] {
        let (modes, texts, last) = outlives(left);
        let at = |ms: u64| modes.get(ms as usize).copied();
        assert_eq!(at(START_MS + 900), Some(Mode::Flying), "{left:?}");
        let flies = matches!(left, States | Poses);
        assert_eq!(modes.last() == Some(&Mode::Flying), flies, "{left:?}: {:?}, {texts:?}", modes.last());
        assert_eq!(last.health.observed, left == Poses, "{left:?}");
        let reported = texts.iter().filter(|text| text.contains("IMU failed")).count();
        // A frozen tracker is recognised only after a moment.
        assert_eq!(reported, usize::from(matches!(left, Poses | Frozen)), "{left:?}: {texts:?}");
        if left == Poses {
            // The vehicle is never without a state. The guidance announces the sensor fault too.
            let others = texts.iter().filter(|text| !text.contains("IMU failed"));
            assert_eq!(others.collect::<Vec<_>>(), ["sensor fault"]);
            // Telemetry shows the observed state.
            let seen = last.estimate.expect("observed");
            assert!((seen.position_m - PLACE_M).amax() < 1e-3 && seen.velocity_m_s.amax() < 0.02, "{seen:?}");
            assert!((seen.attitude_rad - Vector3::new(0.0, 0.0, YAW_RAD)).amax() < 0.01, "{seen:?}");
        }
    }
}

/// An IMU that works again is used again, and so is the tracker.
#[test]
fn the_sensor_comes_back() {
    let (mut bench, place) = (Bench::new(), state(0.0));
    let (mut observed, mut modes) = (0, Vec::new());
    for ms in 1..START_MS + 6_000 {
        let reported = State { position_m: place.position_m + noise(ms) * 1e-4, ..place };
        bench.hear(Uplink::Pose { sent_us: bench.now_us, pose: Pose::of(&reported, PoseSigmas::UNKNOWN) });
        bench.hear(Uplink::Setpoint(Setpoint { position_m: PLACE_M, yaw_rad: YAW_RAD, ..Setpoint::default() }));
        if ms == START_MS {
            bench.follow();
            bench.hear(Uplink::Command(VehicleCommand::Arm));
        }
        let dead = (START_MS + 1_000..START_MS + 3_000).contains(&ms);
        let (report, _) = bench.sense(&if dead { Readings::NONE } else { sample(ms, 0.0) });
        observed += u32::from(report.health.observed);
        modes.push(report.mode);
        if ms > START_MS + 4_000 {
            assert!(!report.health.observed, "{ms} ms");
        }
    }
    assert!((1_950..2_200).contains(&observed), "{observed} ms");
    let armed = modes.iter().skip(START_MS as usize + 10).all(|mode| matches!(mode, Mode::Flying | Mode::Coasting));
    assert!(armed && modes.last() == Some(&Mode::Flying));
}
