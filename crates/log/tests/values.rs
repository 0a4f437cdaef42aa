//! Tests the logged estimate, measurements and modes for PX4's frames, units and numbers.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

#[allow(dead_code, reason = "other tests need the rest")]
mod strict;

use afbc_estimator::{AidSource, Estimate, GeodeticOrigin, Measurement, Validity};
use afbc_flight_core::{Mode, Stamped};
use afbc_guidance::FlightMode;
use afbc_guidance::notice::FailsafeCause;
use afbc_log::ulog::{BesideTick, BlackBox, LogRing, LogStart};
use afbc_onboard::parameters::ParameterTable;
use afbc_onboard::{Aged, Configuration, ControlInputs, Flight, Report, TickDetails, TickInputs, TickRecord};
use afbc_types::{Axis, Pose, PoseSigmas, Setpoint, State};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use strict::{StrictLog, read};

/// Time of the tested tick \[us\].
const NOW_US: u64 = 5_000_000;

/// A tick that a test changes.
struct Tick {
    report: Report,
    details: TickDetails,
    origin: Option<GeodeticOrigin>,
}

impl Tick {
    /// Creates a tick of a vehicle that has just been switched on.
    fn new() -> Self {
        let mut flight = Flight::<4>::new(&Configuration::default()).unwrap();
        let (mut messages, inputs) = (ControlInputs::EMPTY, TickInputs { time_us: 1_000, ..TickInputs::default() });
        let before = flight.before(&messages);
        let mut report = flight.tick(inputs.time_us, &mut messages, &inputs.readings);
        report.time_us = NOW_US;
        Tick { report, details: flight.details(&inputs, &before, &messages), origin: None }
    }

    /// Sets readings of aiding sensors, and what the estimator is offered of them (`local`).
    fn reads(&mut self, aids: [Option<Measurement>; 2], local: [Option<Measurement>; 2], age_us: u32) {
        self.details.inputs.readings.aids = aids.map(|aid| aid.map(|value| Aged { value, age_us }));
        (self.details.local, self.details.offers) = (local, true);
    }
}

/// Returns a log of these ticks, one millisecond apart.
fn log_of(ticks: &[Tick], start: &LogStart<'_>) -> StrictLog {
    let table = ParameterTable::new(Configuration::default());
    let (mut log, mut ring) = (BlackBox::new(start, &table), Box::<LogRing<65_536>>::default());
    for (tick, number) in ticks.iter().zip(0..) {
        let Tick { report, details, origin } = tick;
        let report = Report { time_us: report.time_us + 1_000 * number, ..*report };
        let beside = BesideTick { escs: None, origin: *origin };
        log.tick(&TickRecord { report: &report, details }, &beside, &table, &mut ring);
    }
    let mut bytes = Vec::new();
    while !ring.is_empty() {
        bytes.extend_from_slice(ring.front());
        ring.consume(ring.front().len());
    }
    read(&bytes)
}

/// Returns the log of one tick.
fn told(change: impl FnOnce(&mut Tick)) -> StrictLog {
    let mut tick = Tick::new();
    change(&mut tick);
    log_of(&[tick], &LogStart::default())
}

/// Checks the last message of a topic.
fn has(log: &StrictLog, topic: &str, wanted: &[(&str, f64)]) {
    for (name, wanted) in wanted {
        let is = *log.field(topic, name).last().unwrap_or_else(|| panic!("{topic}"));
        let same = (is - wanted).abs() < 1e-6 * wanted.abs().max(1.0) || is.is_nan() && wanted.is_nan();
        assert!(same, "{topic}.{name}: {is}, not {wanted}");
    }
}

/// Checks the elements of an array field.
fn has_all(log: &StrictLog, topic: &str, name: &str, wanted: &[f64]) {
    for (index, wanted) in wanted.iter().enumerate() {
        has(log, topic, &[(&format!("{name}[{index}]"), *wanted)]);
    }
}

/// Returns an estimate with different numbers in all fields, then changed by `change`.
fn estimate(change: impl FnOnce(&mut Estimate)) -> Estimate {
    let mut estimate = Estimate::default();
    estimate.at_us = 4_999_000;
    estimate.state = State {
        position_m: Vector3::new(1.0, 2.0, 3.0),
        velocity_m_s: Vector3::new(4.0, 5.0, 6.0),
        attitude_rad: Vector3::new(0.1, 0.2, 0.3),
        rates_rad_s: Vector3::new(0.7, 0.8, 0.9),
    };
    estimate.attitude = [0.5, 0.1, -0.7, 0.5];
    estimate.gyro_bias_rad_s = Vector3::new(0.01, 0.02, 0.03);
    estimate.accel_bias_m_s2 = Vector3::new(0.1, 0.2, 0.3);
    estimate.height_offset_m = 0.4;
    estimate.sigmas.attitude_rad = Vector3::new(0.11, 0.12, 0.13);
    estimate.sigmas.velocity_m_s = Vector3::new(0.24, 0.23, 0.25);
    estimate.sigmas.position_m = Vector3::new(1.1, 1.2, 1.3);
    estimate.sigmas.gyro_bias_rad_s = Vector3::new(0.31, 0.32, 0.33);
    estimate.sigmas.accel_bias_m_s2 = Vector3::new(0.41, 0.42, 0.43);
    (estimate.resets.position, estimate.resets.velocity) = (257, 2);
    (estimate.resets.heading, estimate.resets.height) = (3, 260);
    estimate.imu.vibration_m_s2 = 0.6;
    change(&mut estimate);
    estimate
}

/// Returns the receiver's geographic origin, and the local frame's origin in the receiver's frame \[m\].
fn place() -> (GeodeticOrigin, Vector3<f32>) {
    (GeodeticOrigin::new(47.0, 8.5, 400.0).unwrap(), Vector3::new(100.0, 200.0, 10.0))
}

/// The estimate, its variances and its geographic position are logged.
#[test]
fn an_estimate_is_told() {
    let (origin, origin_m) = place();
    let log = told(|tick| {
        (tick.origin, tick.details.origin_m) = (Some(origin), Some(origin_m));
        tick.details.estimate = Some(estimate(|it| it.validity = valid([true; 5])));
        for (number, aid) in (1_u8..).zip(AidSource::ALL) {
            let aids = &mut tick.details.aids;
            let record = match aid {
                AidSource::TrackerPosition => &mut aids.tracker_position,
                AidSource::TrackerAttitude => &mut aids.tracker_attitude,
                AidSource::GnssPosition => &mut aids.gnss_position,
                AidSource::GnssHeight => &mut aids.gnss_height,
                AidSource::GnssVelocity => &mut aids.gnss_velocity,
                AidSource::Height => &mut aids.height,
                AidSource::Heading => &mut aids.heading,
            };
            (record.nis, record.scalars) = (f32::from(number) + 0.5, number);
            (record.accepted, record.rejected) = (10 + u32::from(number), 20 + u32::from(number));
        }
    });
    let states = [0.5, 0.1, 0.7, -0.5, 4.0, -5.0, -6.0, 1.0, -2.0, -3.0, 0.01, -0.02, -0.03, 0.1, -0.2, -0.3, 0.0, 0.0];
    has_all(&log, "estimator_states", "states", &states);
    let sigmas = [0.11, 0.12, 0.13, 0.24, 0.23, 0.25, 1.1, 1.2, 1.3, 0.31, 0.32, 0.33, 0.41, 0.42, 0.43, 0.0];
    has_all(&log, "estimator_states", "covariances", &sigmas.map(|sigma: f64| sigma * sigma));
    has(&log, "estimator_states", &[("timestamp_sample", 4_999_000.0), ("n_states", 16.0)]);
    has_all(&log, "vehicle_attitude", "q", &[0.5, 0.1, 0.7, -0.5]);
    has(&log, "vehicle_attitude", &[("timestamp_sample", 4_999_000.0), ("quat_reset_counter", 3.0)]);
    let flags = [
        ("pos_horiz_accuracy", 1.2),
        ("pos_vert_accuracy", 1.3),
        ("reset_count_vel_ne", 2.0),
        ("reset_count_vel_d", 2.0),
        ("reset_count_pos_ne", 1.0),
        ("reset_count_pod_d", 4.0),
        ("reset_count_quat", 3.0),
    ];
    has(&log, "estimator_status", &flags);
    let [ref_lat, ref_lon, ref_alt] = origin.global(&origin_m);
    let local = [
        ("x", 1.0),
        ("z", -3.0),
        ("vy", -5.0),
        ("heading", -0.3),
        ("eph", 1.2),
        ("epv", 1.3),
        ("evh", 0.24),
        ("evv", 0.25),
        ("xy_reset_counter", 1.0),
        ("z_reset_counter", 4.0),
        ("vxy_reset_counter", 2.0),
        ("vz_reset_counter", 2.0),
        ("heading_reset_counter", 3.0),
        ("xy_global", 1.0),
        ("z_global", 1.0),
        ("ref_lat", ref_lat),
        ("ref_lon", ref_lon),
        ("ref_alt", ref_alt),
    ];
    has(&log, "vehicle_local_position", &local);
    let [lat, lon, alt] = origin.global(&(origin_m + Vector3::new(1.0, 2.0, 3.0)));
    let global = [("lat", lat), ("lon", lon), ("alt", alt), ("eph", 1.2), ("epv", 1.3), ("dead_reckoning", 0.0)];
    has(&log, "vehicle_global_position", &global);
    has_all(&log, "afbc_estimator", "nis", &[1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5]);
    has_all(&log, "afbc_estimator", "scalars", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    has_all(&log, "afbc_estimator", "accepted", &[11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0]);
    has_all(&log, "afbc_estimator", "rejected", &[21.0, 22.0, 23.0, 24.0, 25.0, 26.0, 27.0]);
    let figures = [("heading_sigma_rad", 0.13), ("height_offset_m", 0.4), ("vibration_m_s2", 0.6), ("at_rest", 0.0)];
    has(&log, "afbc_estimator", &figures);
    // The vehicle was disarmed before the first tick.
    has(&log, "afbc_estimator", &[("on_ground", 1.0)]);
}

fn valid([attitude, heading, velocity, position, height]: [bool; 5]) -> Validity {
    Validity { attitude, heading, velocity, position, height }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// MAVLink's flags of the estimator and PX4's of the position match what is valid.
    #[test]
    fn what_is_valid_is_told(parts in prop::array::uniform5(any::<bool>()), has_origin: bool, observed: bool) {
        let [attitude, heading, velocity, position, height] = parts;
        let (origin, origin_m) = place();
        let log = told(|tick| {
            tick.details.estimate = Some(estimate(|it| it.validity = valid(parts)));
            (tick.origin, tick.details.origin_m) = (has_origin.then_some(origin), Some(origin_m));
            tick.report.health.observed = observed;
        });
        let is_global = position && has_origin;
        let vertical = velocity || height;
        let flags = [attitude, velocity, vertical, position, is_global, height];
        let sum: u32 = flags.iter().zip(0..).map(|(flag, bit)| u32::from(*flag) << bit).sum();
        has(&log, "estimator_status", &[("solution_status_flags", sum.into())]);
        let of = |flag: bool| f64::from(u8::from(flag));
        let local = [
            ("xy_valid", of(position)),
            ("z_valid", of(height)),
            ("v_xy_valid", of(velocity)),
            ("v_z_valid", of(vertical)),
            ("heading_good_for_control", of(heading)),
            ("xy_global", of(has_origin)),
            ("dead_reckoning", of(observed)),
        ];
        has(&log, "vehicle_local_position", &local);
        prop_assert_eq!(log.times("vehicle_global_position").len(), usize::from(is_global));
        has(&log, "afbc_law", &[("observed", of(observed))]);
    }
}

/// An estimator that has not started yields no state.
#[test]
fn an_estimate_that_has_not_started_is_no_state() {
    let log = told(|tick| {
        tick.details.state = Some(State::default());
        tick.details.estimate = Some(estimate(|it| it.unready = Some(Default::default())));
    });
    for topic in ["vehicle_attitude", "vehicle_local_position", "vehicle_angular_velocity", "estimator_states"] {
        assert!(log.times(topic).is_empty(), "{topic}");
    }
    assert_eq!(log.times("estimator_status"), [NOW_US]);
}

/// Fixes, poses and positions are logged with their times, and as the estimator was offered them, in the local frame.
#[test]
fn measurements_are_told() {
    let (origin, origin_m) = place();
    let [position_m, velocity_m_s] = [Vector3::new(110.0, 220.0, 30.0), Vector3::new(3.0, 4.0, 5.0)];
    let fix = Measurement::Gnss {
        position_m,
        velocity_m_s,
        horizontal_sigma_m: 0.5,
        vertical_sigma_m: 0.8,
        speed_sigma_m_s: 0.1,
        climb_sigma_m_s: 0.2,
    };
    let mut local = fix;
    if let Measurement::Gnss { position_m, .. } = &mut local {
        *position_m -= origin_m;
    }
    let q = UnitQuaternion::from_euler_angles(0.2, -0.4, 0.6).coords;
    let attitude = [q.w, q.x, q.y, q.z];
    let pose = Measurement::Pose { position_m, attitude, position_sigma_m: 0.3, attitude_sigma_rad: 0.02 };
    let runs = |tick: &mut Tick| {
        (tick.origin, tick.details.origin_m) = (Some(origin), Some(origin_m));
        tick.details.estimate = Some(estimate(|_| ()));
    };
    let log = told(|tick| {
        runs(tick);
        tick.reads([Some(fix), None], [Some(local), None], 30_000);
    });
    let [lat, lon, alt] = origin.global(&position_m);
    let receiver = [
        ("timestamp_sample", 4_970_000.0),
        ("latitude_deg", lat),
        ("longitude_deg", lon),
        ("altitude_msl_m", alt),
        ("s_variance_m_s", 0.1),
        ("eph", 0.5),
        ("epv", 0.8),
        ("vel_m_s", 5.0),
        ("vel_n_m_s", 3.0),
        ("vel_e_m_s", -4.0),
        ("vel_d_m_s", -5.0),
        ("fix_type", 3.0),
        ("vel_ned_valid", 1.0),
    ];
    has(&log, "vehicle_gps_position", &receiver);
    has_all(&log, "afbc_aid", "numbers", &[10.0, 20.0, 20.0, 3.0, 4.0, 5.0, 0.5, 0.8, 0.1, 0.2]);
    has(&log, "afbc_aid", &[("kind", 3.0), ("timestamp_sample", 4_970_000.0)]);
    let log = told(|tick| {
        runs(tick);
        tick.reads([Some(pose), None], [Some(pose), None], 7_000);
    });
    has_all(&log, "vehicle_visual_odometry", "position", &[110.0, -220.0, -30.0]);
    has_all(&log, "vehicle_visual_odometry", "q", &[q.w, q.x, -q.y, -q.z].map(f64::from));
    has_all(&log, "vehicle_visual_odometry", "position_variance", &[0.09; 3]);
    has_all(&log, "vehicle_visual_odometry", "orientation_variance", &[0.0004; 3]);
    has_all(&log, "vehicle_visual_odometry", "velocity", &[f64::NAN; 3]);
    let frames = [("timestamp_sample", 4_993_000.0), ("pose_frame", 1.0), ("velocity_frame", 0.0)];
    has(&log, "vehicle_visual_odometry", &frames);
    has(&log, "afbc_aid", &[("kind", 1.0)]);
    let position = Measurement::Position { position_m, sigma_m: 0.7 };
    let log = told(|tick| {
        runs(tick);
        let aids = [Some(position), Some(Measurement::Heading { heading_rad: 0.5, sigma_rad: 0.1 })];
        tick.reads(aids, aids, 0);
    });
    has_all(&log, "vehicle_visual_odometry", "position", &[110.0, -220.0, -30.0]);
    has_all(&log, "vehicle_visual_odometry", "position_variance", &[0.49; 3]);
    has_all(&log, "vehicle_visual_odometry", "q", &[f64::NAN; 4]);
    assert_eq!(log.field("afbc_aid", "kind"), [2.0, 6.0]);
    has_all(&log, "afbc_aid", "numbers", &[0.5, 0.1, 0.0]);
    // As long as the origin is unknown, a fix is not logged.
    let log = told(|tick| {
        tick.details.estimate = Some(estimate(|_| ()));
        tick.reads([Some(fix), None], [None; 2], 0);
    });
    assert!(log.times("vehicle_gps_position").is_empty() && log.times("afbc_aid").is_empty());
}

/// A tracker's pose from a message is logged once.
#[test]
fn a_pose_that_was_brought_is_told_once() {
    let pose = Pose { position_m: Vector3::new(1.0, 2.0, 3.0), ..Pose::of(&State::default(), PoseSigmas::UNKNOWN) };
    let ticks: Vec<_> = [Some(4_990_000), Some(4_990_000), None, Some(5_001_000)]
        .into_iter()
        .map(|at_us: Option<u64>| {
            let mut tick = Tick::new();
            tick.details.pose = at_us.map(|at_us| Stamped { value: pose, at_us });
            tick
        })
        .collect();
    let log = log_of(&ticks, &LogStart::default());
    assert_eq!(log.times("vehicle_visual_odometry"), [NOW_US, NOW_US + 3_000]);
    assert_eq!(log.field("vehicle_visual_odometry", "timestamp_sample"), [4_990_000.0, 5_001_000.0]);
    has_all(&log, "vehicle_visual_odometry", "position", &[1.0, -2.0, -3.0]);
}

/// Modes have PX4's numbers (`NAVIGATION_STATE` of vehicle_status), and failsafes are flagged.
#[test]
fn modes_have_px4s_numbers() {
    for mode in FlightMode::ALL {
        let wanted = match mode {
            FlightMode::Altitude => 1.0,
            FlightMode::Position => 2.0,
            FlightMode::Mission => 3.0,
            FlightMode::Hold => 4.0,
            FlightMode::Return => 5.0,
            FlightMode::Acro => 10.0,
            FlightMode::Offboard => 14.0,
            FlightMode::Stabilised => 15.0,
            FlightMode::Takeoff => 17.0,
            FlightMode::Land => 18.0,
        };
        for core in [Mode::Disarmed, Mode::Flying, Mode::Coasting, Mode::Descending] {
            for failsafe in [None, Some(FailsafeCause::Station)] {
                let log = told(|tick| {
                    (tick.report.mode, tick.report.guided.mode) = (core, mode);
                    tick.report.guided.failsafe = failsafe;
                });
                let descends = core == Mode::Descending;
                let fails = f64::from(u8::from(failsafe.is_some() || descends));
                let state = if descends { 12.0 } else { wanted };
                let arming = if core == Mode::Disarmed { 1.0 } else { 2.0 };
                let all = [("nav_state", state), ("failsafe", fails), ("arming_state", arming)];
                has(&log, "vehicle_status", &all);
                has(&log, "vehicle_status", &[("vehicle_type", 1.0), ("system_type", 2.0), ("system_id", 1.0)]);
                has(&log, "afbc_law", &[("core_mode", f64::from(core as u8))]);
            }
        }
    }
}

/// The times of arming and of take-off are logged while the vehicle is armed or airborne.
#[test]
fn arming_and_taking_off_have_their_times() {
    let states =
        [(false, false), (true, false), (true, false), (true, true), (true, true), (true, false), (false, false)];
    let ticks: Vec<_> = states
        .into_iter()
        .map(|(armed, airborne)| {
            let mut tick = Tick::new();
            tick.report.mode = if armed { Mode::Flying } else { Mode::Disarmed };
            tick.report.guided.airborne = airborne;
            tick
        })
        .collect();
    let log = log_of(&ticks, &LogStart::default());
    // Each change is logged at once.
    let times: Vec<_> = [0, 1, 3, 5, 6].map(|ms| NOW_US + 1_000 * ms).to_vec();
    assert_eq!(log.times("vehicle_status"), times);
    let [armed_us, airborne_us] = [NOW_US + 1_000, NOW_US + 3_000].map(|at_us| at_us as f64);
    assert_eq!(log.field("vehicle_status", "armed_time"), [0.0, armed_us, armed_us, armed_us, 0.0]);
    assert_eq!(log.field("vehicle_status", "takeoff_time"), [0.0, 0.0, airborne_us, 0.0, 0.0]);
    assert_eq!(log.field("vehicle_land_detected", "landed"), [1.0, 0.0, 1.0]);
    assert_eq!(log.field("vehicle_land_detected", "maybe_landed"), [1.0, 0.0, 1.0]);
    assert_eq!(log.field("actuator_armed", "armed"), [0.0, 1.0, 0.0]);
}

/// Setpoints are logged while armed, and the law's signals as in its trace.
#[test]
fn the_laws_signals_are_told() {
    let change = |tick: &mut Tick| {
        tick.report.mode = Mode::Flying;
        tick.report.guided.setpoint = Some(Setpoint {
            acceleration_m_s2: Vector3::new(0.1, 0.2, 0.3),
            yaw_rad: 0.3,
            yaw_rate_rad_s: 0.7,
            ..Setpoint::default()
        });
        tick.details.estimate = Some(estimate(|_| ()));
        let trace = &mut tick.details.trace;
        (trace.inputs.roll_n, trace.inputs.pitch_n) = (0.1, 0.2);
        (trace.inputs.yaw_n, trace.inputs.thrust_n) = (0.3, 4.0);
        (trace.virtual_m_s2, trace.desired_rad) = ([0.5, 0.6], [0.11, 0.12]);
        (trace.filtered[0].angle, trace.filtered[1].angle) = (0.1, -0.2);
        for (axis, number) in Axis::ALL.into_iter().zip(1..) {
            let errors = &mut trace.errors[axis];
            (errors.e1, errors.e1_dot) = (number as f32, 10.0 + number as f32);
            // Yaw has no virtual control.
            errors.e2 = if axis == Axis::Yaw { 0.0 } else { 20.0 + number as f32 };
        }
        tick.report.health.control.saturated = true;
    };
    let log = told(change);
    has_all(&log, "afbc_law", "e1", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    has_all(&log, "afbc_law", "e1_dot", &[11.0, 12.0, 13.0, 14.0, 15.0, 16.0]);
    has_all(&log, "afbc_law", "e2", &[21.0, 22.0, 0.0, 24.0, 25.0, 26.0]);
    has_all(&log, "afbc_law", "inputs", &[0.1, 0.2, 0.3, 4.0]);
    has_all(&log, "afbc_law", "virtual_m_s2", &[0.5, 0.6]);
    has_all(&log, "afbc_law", "desired_rad", &[0.11, 0.12]);
    has(&log, "afbc_law", &[("saturated", 1.0), ("fallback", 0.0)]);
    has(&log, "vehicle_rates_setpoint", &[("roll", 21.7), ("pitch", -22.8), ("yaw", -13.9)]);
    let q = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3).coords;
    has_all(&log, "vehicle_attitude_setpoint", "q_d", &[q.w, q.x, -q.y, -q.z].map(f64::from));
    let attitude = [("roll_body", 0.1), ("pitch_body", 0.2), ("yaw_body", -0.3), ("yaw_sp_move_rate", -0.7)];
    has(&log, "vehicle_attitude_setpoint", &attitude);
    has_all(&log, "vehicle_local_position_setpoint", "acceleration", &[0.1, -0.2, -0.3]);
    has(&log, "vehicle_local_position_setpoint", &[("yaw", -0.3), ("yawspeed", -0.7)]);
    let most_n = 4.0 * f64::from(Configuration::default().settings.common.rotor_force_max_n);
    let thrust = [0.0, 0.0, -4.0 / most_n];
    has_all(&log, "vehicle_rates_setpoint", "thrust_body", &thrust);
    has_all(&log, "vehicle_attitude_setpoint", "thrust_body", &thrust);
    has_all(&log, "vehicle_thrust_setpoint", "xyz", &thrust);
    has_all(&log, "vehicle_torque_setpoint", "xyz", &[0.1 / most_n, -0.2 / most_n, -0.3 / most_n]);
    has(&log, "vehicle_torque_setpoint", &[("timestamp_sample", 4_999_000.0)]);
    let log = told(|tick| {
        change(tick);
        tick.report.mode = Mode::Disarmed;
    });
    let armed = ["vehicle_rates_setpoint", "vehicle_attitude_setpoint", "vehicle_thrust_setpoint"];
    assert!(armed.iter().chain(&["vehicle_torque_setpoint"]).all(|topic| log.times(topic).is_empty()));
    has_all(&log, "actuator_motors", "control", &[f64::NAN; 12]);
}

/// The information has texts of at most 32 bytes, cut between letters, and leaves out empty ones.
#[test]
fn a_log_says_what_it_is_of() {
    let start = LogStart {
        vehicle: "a vehicle of a long name, löööööng",
        law: "afbc",
        hardware: "",
        unique: Some("0042"),
        utc_offset_s: -3_600,
    };
    let log = log_of(&[Tick::new()], &start);
    let text = |name: &str| log.information.get(name).map(|bytes| String::from_utf8(bytes.clone()).unwrap());
    assert_eq!(text("afbc_vehicle").unwrap(), "a vehicle of a long name, löö");
    assert_eq!([text("afbc_law").unwrap(), text("sys_uuid").unwrap()], ["afbc", "0042"]);
    assert_eq!((text("ver_hw"), text("ver_sw")), (None, Some(env!("CARGO_PKG_VERSION").into())));
    assert_eq!(log.information["time_ref_utc"], (-3_600_i32).to_le_bytes());
    assert_eq!(log_of(&[Tick::new()], &LogStart::default()).information.get("sys_uuid"), None);
}
