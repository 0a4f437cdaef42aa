//! Tests logs of arbitrary ticks through rings of any size, read by the specification of ULog.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

mod strict;

use afbc_drivers::esc_telemetry::EscReading;
use afbc_estimator::{ImuSample, Measurement};
use afbc_flight_core::{Mode, Stamped};
use afbc_guidance::{BatteryReading, FlightMode, Sticks};
use afbc_log::ulog::{BesideTick, BlackBox, LogRing, LogStart, TOPICS};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{
    Aged, Configuration, ControlInputs, EscTelemetry, Flight, Readings, Report, RotorFailure, TickDetails, TickInputs,
    TickRecord,
};
use afbc_store::RecordName;
use afbc_types::{RotorSpeeds, Setpoint, State};
use nalgebra::{SVector, Vector3};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use strict::{StrictLog, read};

/// Time between two ticks \[us\].
const TICK_US: u64 = 1_000;

/// A vehicle with its log, and the bytes taken from the ring so far.
#[derive(Clone)]
struct Logged<const R: usize> {
    flight: Flight,
    table: ParameterTable,
    log: BlackBox,
    ring: Box<LogRing<R>>,
    kept: Vec<u8>,
    now_us: u64,
}

impl<const R: usize> Logged<R> {
    fn new() -> Self {
        let configuration = Configuration::default();
        let table = ParameterTable::new(configuration.clone());
        let start = LogStart { vehicle: "paper", law: "afbc", hardware: "test", ..LogStart::default() };
        let log = BlackBox::new(&start, &table);
        let flight = Flight::new(&configuration).unwrap();
        Logged { flight, table, log, ring: Box::default(), kept: Vec::new(), now_us: 0 }
    }

    /// Runs a tick with an inertial sample, and with a height if `height` is true.
    fn tick(&mut self, height: bool) -> (Report, TickDetails) {
        self.now_us += TICK_US;
        let noise = 1e-3 * (self.now_us / TICK_US % 7) as f32;
        let imu = Some(Aged { value: [Vector3::new(0.0, noise, 0.0), Vector3::new(noise, 0.0, 9.81)], age_us: 0 });
        let aid = Aged { value: Measurement::Height { height_m: 1.5, sigma_m: 0.5 }, age_us: 300 };
        let readings = Readings { imu, aids: [height.then_some(aid), None] };
        let (mut messages, inputs) =
            (ControlInputs::EMPTY, TickInputs { time_us: self.now_us, readings, ..TickInputs::default() });
        let before = self.flight.before(&messages);
        let report = self.flight.tick(inputs.time_us, &mut messages, &readings);
        let details = self.flight.details(&inputs, &before, &messages);
        let tick = TickRecord { report: &report, details: &details };
        self.log.tick(&tick, &BesideTick::default(), &self.table, &mut self.ring);
        (report, details)
    }

    fn change(&mut self, name: &str, value: f32) {
        let name = RecordName::new(name).unwrap();
        let value = self.table.set(name, value).unwrap().value;
        self.log.change(&self.table, RecordChange::Set(name, Some(value)), &mut self.ring);
    }

    /// Takes at most this many bytes from the ring.
    fn keep(&mut self, mut bytes: usize) {
        while bytes > 0 && !self.ring.is_empty() {
            let front = &self.ring.front()[..bytes.min(self.ring.front().len())];
            self.kept.extend_from_slice(front);
            let length = front.len();
            self.ring.consume(length);
            bytes -= length;
        }
    }

    fn end(mut self) -> Vec<u8> {
        self.keep(usize::MAX);
        self.kept
    }
}

/// One action of a random test.
#[derive(Clone, Copy, Debug)]
enum Step {
    Ticks(u16),
    Keep(usize),
    Change(f32),
    Restore,
    Text(u8),
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        4 => (1_u16..60).prop_map(Step::Ticks),
        4 => (0_usize..9_000).prop_map(Step::Keep),
        1 => (3.0_f32..9.0).prop_map(Step::Change),
        1 => Just(Step::Restore),
        1 => (0_u8..12).prop_map(Step::Text),
    ]
}

/// Runs the steps with a ring of `R` bytes.
fn run<const R: usize>(steps: &[Step]) -> (Vec<u8>, Logged<R>) {
    let mut logged = Logged::<R>::new();
    for step in steps {
        match *step {
            Step::Ticks(ticks) => (0..ticks).for_each(|tick| {
                let _ = logged.tick(tick % 20 == 0);
            }),
            Step::Keep(bytes) => logged.keep(bytes),
            Step::Change(value) => {
                let name = if value < 6.0 { "EST_GATE" } else { "EST_REACQUIRE" };
                logged.change(name, value);
            }
            Step::Restore => {
                logged.table.restore();
                logged.log.change(&logged.table, RecordChange::Restored, &mut logged.ring);
            }
            Step::Text(severity) => {
                let Logged { log, ring, now_us, .. } = &mut logged;
                log.text(*now_us, severity, "ümläut ".repeat(1 + 3 * usize::from(severity)).as_str(), ring);
            }
        }
    }
    logged.keep(usize::MAX);
    // Writes the records that had to wait for room.
    (0..3).for_each(|_| {
        logged.tick(false);
        logged.keep(usize::MAX);
    });
    (std::mem::take(&mut logged.kept), logged)
}

/// Checks that dropouts add up to the time for which samples are missing.
fn adds_up(log: &StrictLog) {
    let times = log.times("sensor_combined");
    let (mut missing_us, mut told_ms) = (0, 0);
    // Dropouts before the first sample fall into the log's beginning.
    let before = |before: &BTreeMap<String, usize>| before.get("sensor_combined").copied().unwrap_or(0);
    let mut dropouts = log.dropouts.iter().filter(|(_, counts)| before(counts) > 0).peekable();
    for (index, pair) in times.windows(2).enumerate() {
        let mut told = false;
        while let Some((ms, _)) = dropouts.next_if(|(_, counts)| before(counts) <= index + 1) {
            (told_ms, told) = (told_ms + ms, true);
        }
        let gap_us = pair[1] - pair[0];
        assert!(gap_us == TICK_US || told, "a gap of {gap_us} us without a dropout");
        missing_us += gap_us - TICK_US;
    }
    let rest: u64 = dropouts.map(|(ms, _)| ms).sum();
    let spread_ms = log.dropouts.len() as u64 + 1;
    let missing_ms = missing_us / TICK_US;
    assert!((missing_ms..=missing_ms + spread_ms).contains(&told_ms), "{missing_ms} ms missing, {told_ms} ms told");
    assert!(rest <= spread_ms, "{rest} ms at the end");
}

/// Checks that the last parameter values in the log are the vehicle's.
fn parameters_agree(log: &StrictLog, table: &ParameterTable) {
    for parameter in table.iter() {
        let last = log.parameters.iter().rev().find(|(name, _)| name == parameter.name.as_str());
        assert_eq!(last.unwrap().1, f64::from(parameter.value), "{}", parameter.name);
    }
}

fn any_ring<const R: usize>(steps: &[Step]) -> Result<(), TestCaseError> {
    let (bytes, logged) = run::<R>(steps);
    let log = read(&bytes);
    prop_assert_eq!(log.whole, if bytes.is_empty() { 0 } else { bytes.len() }, "a broken record");
    adds_up(&log);
    if R >= 4096 {
        // One format is not a topic: `esc_report`, a part of `esc_status`.
        prop_assert_eq!(log.formats.len(), TOPICS.len() + 1);
        prop_assert!(log.information.contains_key("sys_name"));
        parameters_agree(&log, &logged.table);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_steps_through_any_ring_are_a_log(steps in prop::collection::vec(step(), 1..60), ring in 0_usize..9) {
        match ring {
            0 => any_ring::<1>(&steps)?,
            1 => any_ring::<60>(&steps)?,
            2 => any_ring::<300>(&steps)?,
            3 => any_ring::<1_000>(&steps)?,
            4 => any_ring::<1_100>(&steps)?,
            5 => any_ring::<1_500>(&steps)?,
            6 => any_ring::<4_096>(&steps)?,
            7 => any_ring::<9_999>(&steps)?,
            _ => any_ring::<65_536>(&steps)?,
        }
    }
}

/// Returns a log of 600 ms.
fn short() -> Vec<u8> {
    let mut logged = Logged::<65_536>::new();
    for tick in 0..600 {
        logged.tick(tick % 20 == 0);
        if tick == 100 {
            logged.change("EST_GATE", 4.0);
        }
        logged.keep(usize::MAX);
    }
    logged.end()
}

/// A log cut at any byte is read up to the last whole record, with the same content as the whole log.
#[test]
fn a_log_cut_anywhere_is_read_up_to_there() {
    let bytes = short();
    let all = read(&bytes);
    assert!(all.dropouts.is_empty() && all.syncs == 1 && all.whole == bytes.len());
    let mut ends = 0;
    for cut in (0..bytes.len()).filter(|cut| *cut < 30_000 || cut % 11 == 0) {
        let log = read(&bytes[..cut]);
        assert!(log.whole <= cut && (log.records == 0 || log.whole > ends) || log.whole == ends, "{cut}");
        ends = log.whole;
        for (topic, messages) in &log.messages {
            let bits = |messages: &[(u64, Vec<f64>)]| -> Vec<u64> {
                messages.iter().flat_map(|(_, values)| values.iter().map(|value| value.to_bits())).collect()
            };
            assert_eq!(bits(messages), bits(&all.messages[topic][..messages.len()]), "{cut}: {topic}");
        }
        assert!(log.parameters[..] == all.parameters[..log.parameters.len()]);
    }
}

/// Every topic has its rate, and every sensor sample is logged.
#[test]
fn topics_have_their_rates() {
    let mut logged = Logged::<65_536>::new();
    for tick in 0..4_000 {
        logged.tick(tick % 20 == 0);
        logged.keep(usize::MAX);
    }
    let log = read(&logged.end());
    let count = |topic: &str| log.messages.get(topic).map_or(0, Vec::len);
    assert_eq!((count("sensor_combined"), count("vehicle_air_data"), count("afbc_aid")), (4_000, 200, 200));
    for topic in TOPICS.iter().filter(|topic| topic.period_us > 0 && count(topic.name) > 0) {
        let times = log.times(topic.name);
        let span_us = times.last().unwrap() - times[0];
        let wanted = 1 + span_us / u64::from(topic.period_us);
        let slack = if topic.on_change { 10 } else { 0 };
        let is = times.len() as u64;
        assert!((wanted..=wanted + slack).contains(&is), "{}: {is}, not {wanted}", topic.name);
    }
    for topic in ["vehicle_attitude", "vehicle_local_position", "estimator_states", "vehicle_status", "afbc_law"] {
        assert!(count(topic) > 0, "{topic}");
    }
    // Topics without any data have no messages.
    for topic in ["vehicle_gps_position", "battery_status", "manual_control_setpoint", "vehicle_rates_setpoint"] {
        assert_eq!(count(topic), 0, "{topic}");
    }
}

/// In a small log, every topic has its longer period. The inertial sensor's messages follow each other without a gap,
/// each as the mean of its samples.
#[test]
fn small_logs_have_their_rates() {
    let mut logged = Logged::<65_536>::new();
    logged.log = logged.log.small();
    for tick in 0..4_000 {
        logged.tick(tick % 20 == 0);
        logged.keep(usize::MAX);
    }
    let log = read(&logged.end());
    let count = |topic: &str| log.messages.get(topic).map_or(0, Vec::len);
    for topic in TOPICS.iter().filter(|topic| count(topic.name) > 0) {
        let times = log.times(topic.name);
        let wanted = 1 + (times.last().unwrap() - times[0]) / u64::from(topic.small_us);
        let slack = if topic.on_change { 10 } else { 1 };
        assert!((wanted - 1..=wanted + slack).contains(&(times.len() as u64)), "{}: {}", topic.name, times.len());
    }
    let counts = ["sensor_combined", "vehicle_attitude", "vehicle_air_data"].map(count);
    assert!(counts.iter().zip([350, 290, 30]).all(|(count, least)| *count > least), "{counts:?}");
    let dts_us = log.field("sensor_combined", "gyro_integral_dt");
    // Skips two messages: the first covers one sample, and the second the rest of a period.
    assert!(dts_us.iter().skip(2).all(|dt_us| *dt_us == 10_000.0), "{dts_us:?}");
    let times = log.times("sensor_combined");
    let rates = log.field("sensor_combined", "gyro_rad[1]");
    for (at_us, rate) in times.iter().zip(rates).skip(2) {
        // Ten samples, from the ticks up to the message's time.
        let middle_us = at_us - 5_000;
        let ticks = (middle_us - 4_500) / TICK_US..=(middle_us + 4_500) / TICK_US;
        let mean = ticks.map(|tick| 1e-3 * (tick % 7) as f64).sum::<f64>() / 10.0;
        assert!((rate.abs() - mean).abs() < 1e-6, "{rate} at {at_us}, not {mean}");
    }
}

/// Returns the time of each inertial sample, at the middle of its integration \[us\].
fn sampled_us(log: &StrictLog) -> Vec<u64> {
    let dts_us = log.field("sensor_combined", "gyro_integral_dt");
    log.times("sensor_combined").iter().zip(dts_us).map(|(at_us, dt_us)| at_us - dt_us as u64 / 2).collect()
}

/// With irregular inertial samples, messages stay in order, and each still states when its sample was valid.
#[test]
fn samples_have_their_times() {
    let mut logged = Logged::<65_536>::new();
    let mut wanted = Vec::new();
    for (tick, missing) in [0, 0, 1, 0, 3, 0, 0, 9, 0, 0, 0, 20, 0, 1, 0, 300, 0, 0].into_iter().enumerate() {
        logged.now_us += 1_000 * missing + 7 * tick as u64;
        logged.tick(false);
        wanted.push(logged.now_us);
        logged.keep(usize::MAX);
    }
    assert_eq!(sampled_us(&read(&logged.end())), wanted);
}

/// If only a part of a tick fits, the log contains a dropout. Topics with a rate are written in the next tick instead.
#[test]
fn what_is_missing_is_told_and_made_up_for() {
    const RING: usize = 4_096;
    /// Bytes of a text record without its text, and the longest text.
    const TEXT: (usize, usize) = (12, 128);
    let mut logged = Logged::<RING>::new();
    while !read(&logged.kept).messages.contains_key("actuator_armed") {
        logged.tick(false);
        logged.keep(usize::MAX);
    }
    // Most topics are due again after two seconds. The records in between are dropped from the test.
    let (beginning, before) = (logged.kept.len(), read(&logged.kept).dropouts.len());
    (0..1_999).for_each(|_| {
        logged.tick(false);
        logged.keep(usize::MAX);
    });
    logged.kept.truncate(beginning);
    let at_us = logged.now_us + TICK_US;
    let of = |log: &StrictLog, at_us: u64| -> Vec<String> {
        let is_there = |topic: &&String| log.times(topic).iter().any(|time_us| time_us.abs_diff(at_us) < TICK_US);
        log.messages.keys().filter(is_there).cloned().collect()
    };
    let after = |free: usize| {
        let mut logged = logged.clone();
        loop {
            let left = RING - logged.ring.len() - free;
            if left < TEXT.0 {
                break;
            }
            let length = if left >= 2 * TEXT.0 + TEXT.1 { TEXT.1 } else { (left - TEXT.0).min(TEXT.1) };
            logged.log.text(logged.now_us, 6, &"x".repeat(length), &mut logged.ring);
        }
        for _ in 0..2 {
            logged.tick(true);
            logged.keep(usize::MAX);
        }
        read(&logged.end())
    };
    let all = of(&after(RING), at_us);
    assert!(all.len() >= 10 && all.iter().any(|topic| topic == "vehicle_air_data"), "{all:?}");
    let mut partly = 0;
    for free in 0..1_400 {
        let log = after(free);
        let (now, next) = (of(&log, at_us), of(&log, at_us + TICK_US));
        let missing: Vec<_> = all.iter().filter(|topic| !now.contains(topic)).collect();
        let told: Vec<_> = log.dropouts[before..].iter().map(|(ms, _)| *ms).collect();
        assert_eq!(told, if missing.is_empty() { vec![] } else { vec![1] }, "{free} bytes, {missing:?} missing");
        assert!(missing.iter().all(|topic| next.contains(topic)), "{free} bytes, {missing:?} missing, then {next:?}");
        partly += usize::from(!missing.is_empty() && missing.len() < all.len());
    }
    assert!(partly > 500, "{partly}");
}

/// Parameter changes that do not fit wait for room, however many they are.
#[test]
fn no_change_of_a_parameter_is_lost() {
    let mut logged = Logged::<4_096>::new();
    while !read(&logged.kept).messages.contains_key("sensor_combined") {
        logged.tick(false);
        logged.keep(usize::MAX);
    }
    (0..100).for_each(|_| {
        logged.tick(false);
    });
    for (name, value) in [("EST_GATE", 4.0), ("EST_REACQUIRE", 3.0), ("EST_GATE", 5.0), ("EST_COAST", 2.0)] {
        logged.change(name, value);
    }
    (0..20).for_each(|_| {
        logged.keep(usize::MAX);
        logged.tick(false);
    });
    let table = logged.table.clone();
    parameters_agree(&read(&logged.end()), &table);
}

/// Dropouts that are too long for one record, or not of whole milliseconds, still add up.
#[test]
fn long_and_odd_dropouts_add_up() {
    let mut logged = Logged::<2_000>::new();
    while !read(&logged.kept).messages.contains_key("sensor_combined") {
        logged.tick(false);
        logged.keep(usize::MAX);
    }
    let (mut told_us, mut wanted_us) = (0, 0);
    for pause_us in [70_000_000, 400, 1_700, 900, 140_000_600] {
        // Fills the ring.
        (0..100).for_each(|_| {
            logged.tick(false);
        });
        logged.now_us += pause_us;
        logged.keep(usize::MAX);
        (0..3).for_each(|_| {
            logged.tick(false);
            logged.keep(usize::MAX);
        });
        wanted_us = 0;
        let log = read(&logged.kept);
        for pair in sampled_us(&log).windows(2) {
            wanted_us += (pair[1] - pair[0]).saturating_sub(TICK_US);
        }
        told_us = 1_000 * log.dropouts.iter().map(|(ms, _)| ms).sum::<u64>();
        // A dropout begins in the tick of the first missing record, though other records of that tick may exist.
        assert!(told_us <= wanted_us + 5 * TICK_US && told_us + 2 * TICK_US > wanted_us, "{told_us}, {wanted_us} us");
    }
    assert!(told_us > 210_000_000 && wanted_us > 210_000_000);
}

/// The logged values of a tick are in PX4's frames and units.
#[test]
fn values_are_px4s() {
    let mut logged = Logged::<65_536>::new();
    let (mut report, mut details) = logged.tick(false);
    report.time_us = 5_000_000;
    report.mode = Mode::Flying;
    report.guided.mode = FlightMode::Mission;
    (report.guided.airborne, report.guided.charge) = (true, Some(0.75));
    report.guided.setpoint = Some(Setpoint {
        position_m: Vector3::new(1.0, 2.0, 3.0),
        velocity_m_s: Vector3::new(0.1, 0.2, 0.3),
        yaw_rad: 0.4,
        ..Setpoint::default()
    });
    // The paper's rotors lie on the axes, so that output n drives rotor n.
    report.motors = RotorSpeeds::<4>(SVector::from([100.0, 200.0, 300.0, 400.0])).padded();
    report.throttles = [100, 200, 300, 400, 0, 0, 0, 0];
    details.estimate = None;
    details.state = Some(State {
        position_m: Vector3::new(4.0, 5.0, 6.0),
        velocity_m_s: Vector3::new(0.4, 0.5, 0.6),
        attitude_rad: Vector3::new(0.0, 0.0, core::f32::consts::FRAC_PI_2),
        rates_rad_s: Vector3::new(0.7, 0.8, 0.9),
    });
    details.trace.errors.pitch.e2 = 0.25;
    (details.trace.inputs.thrust_n, details.trace.inputs.pitch_n) = (2.0, 0.5);
    details.trace.filtered[1].angle = 0.1;
    details.inputs.battery = Some(BatteryReading { voltage_v: 11.1, current_a: 4.5, charge: None });
    let sticks = Sticks { roll: 0.1, pitch: -0.2, throttle: 0.3, yaw: -0.4 };
    details.sticks = Some(Stamped { value: sticks, at_us: 4_900_000 });
    let field = Measurement::MagneticField { field: Vector3::new(20.0, 5.0, -40.0), sigma: 1.0 };
    let (rates_rad_s, specific_force_m_s2) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, 2.0, 9.0));
    details.sample = Some(ImuSample { at_us: report.time_us - 250, rates_rad_s, specific_force_m_s2 });
    details.inputs.readings.aids = [Some(Aged { value: field, age_us: 2_000 }), None];
    details.local = [Some(field), None];
    let mut escs = EscTelemetry { counter: 77, poles: 14, ..EscTelemetry::default() };
    let value =
        EscReading { temperature_c: -5, voltage_cv: 1_480, current_ca: 350, consumed_mah: 12, erpm_hundreds: 700 };
    escs.readings[2] = Some(Stamped { value, at_us: 4_990_000 });
    escs.failures[2] = Some(RotorFailure::Stopped);
    let beside = BesideTick { escs: Some(&escs), origin: None };
    logged.log.tick(&TickRecord { report: &report, details: &details }, &beside, &logged.table, &mut logged.ring);
    let log = read(&logged.end());
    let near = |topic: &str, name: &str, wanted: f64| {
        let is = *log.field(topic, name).last().unwrap_or_else(|| panic!("{topic}"));
        assert!((is - wanted).abs() < 1e-6 * wanted.abs().max(1.0), "{topic}.{name}: {is}, not {wanted}");
    };
    let root = 0.5_f64.sqrt();
    for (index, q) in [root, 0.0, 0.0, -root].into_iter().enumerate() {
        near("vehicle_attitude", &format!("q[{index}]"), q);
    }
    for (name, value) in [("x", 4.0), ("y", -5.0), ("z", -6.0), ("vx", 0.4), ("vy", -0.5), ("vz", -0.6)] {
        near("vehicle_local_position", name, value);
    }
    near("vehicle_local_position", "heading", -core::f64::consts::FRAC_PI_2);
    for (name, value) in [("x", 1.0), ("y", -2.0), ("z", -3.0), ("vy", -0.2), ("yaw", -0.4)] {
        near("vehicle_local_position_setpoint", name, value);
    }
    for (index, rate) in [0.7, -0.8, -0.9].into_iter().enumerate() {
        near("vehicle_angular_velocity", &format!("xyz[{index}]"), rate);
    }
    near("vehicle_rates_setpoint", "pitch", -(0.8 + 0.25));
    near("vehicle_attitude_setpoint", "pitch_body", -0.1);
    near("vehicle_attitude_setpoint", "yaw_body", -0.4);
    // The largest thrust of four rotors, and b omega^2 of the fourth.
    let force_max_n = f64::from(logged_force_max());
    near("vehicle_attitude_setpoint", "thrust_body[2]", -2.0 / (4.0 * force_max_n));
    near("vehicle_thrust_setpoint", "xyz[2]", -2.0 / (4.0 * force_max_n));
    near("vehicle_torque_setpoint", "xyz[1]", -0.5 / (4.0 * force_max_n));
    near("actuator_motors", "control[3]", 2.984e-5 * 400.0 * 400.0 / force_max_n);
    assert!(log.field("actuator_motors", "control[4]").last().unwrap().is_nan());
    near("actuator_outputs", "output[2]", 300.0);
    near("actuator_outputs", "noutputs", 4.0);
    for (name, value) in [
        ("counter", 77.0),
        ("esc_count", 4.0),
        ("esc_connectiontype", 5.0),
        ("esc_online_flags", 4.0),
        ("esc_armed_flags", 4.0),
        ("esc.2.timestamp", 4_990_000.0),
        ("esc.2.esc_rpm", 10_000.0),
        ("esc.2.esc_voltage", 14.8),
        ("esc.2.esc_current", 3.5),
        ("esc.2.esc_temperature", -5.0),
        ("esc.2.failures", 128.0),
        ("esc.2.actuator_function", 103.0),
        ("esc.1.esc_rpm", 0.0),
        ("esc.7.timestamp", 0.0),
    ] {
        near("esc_status", name, value);
    }
    near("battery_status", "voltage_v", 11.1);
    near("battery_status", "remaining", 0.75);
    near("manual_control_setpoint", "throttle", 0.3);
    near("manual_control_setpoint", "timestamp_sample", 4_900_000.0);
    for (index, gauss) in [0.2, -0.05, 0.4].into_iter().enumerate() {
        near("vehicle_magnetometer", &format!("magnetometer_ga[{index}]"), gauss);
    }
    near("vehicle_magnetometer", "timestamp_sample", 4_998_000.0);
    for (index, (rate, force)) in [(0.1, 1.0), (-0.2, -2.0), (-0.3, -9.0)].into_iter().enumerate() {
        near("sensor_combined", &format!("gyro_rad[{index}]"), rate);
        near("sensor_combined", &format!("accelerometer_m_s2[{index}]"), force);
    }
    // AUTO_MISSION and ARMED of vehicle_status.
    near("vehicle_status", "nav_state", 3.0);
    near("vehicle_status", "arming_state", 2.0);
    near("vehicle_status", "armed_time", 5_000_000.0);
    near("actuator_armed", "armed", 1.0);
    near("vehicle_land_detected", "landed", 0.0);
}

fn logged_force_max() -> f32 {
    Configuration::default().settings.common.rotor_force_max_n
}

/// The log contains the information, the parameters at the start, the defaults of changed ones, and each later change.
#[test]
fn parameters_and_information_are_there() {
    let mut logged = Logged::<65_536>::new();
    let name = RecordName::new("EST_GATE").unwrap();
    let built = f64::from(logged.table.get(name).unwrap().value);
    logged.table.set(name, 4.0).unwrap();
    logged.tick(false);
    logged.change("EST_GATE", 4.5);
    logged.tick(false);
    let table = logged.table.clone();
    let log = read(&logged.end());
    assert_eq!(log.initial, usize::from(table.count()));
    assert_eq!(log.defaults, [("EST_GATE".to_owned(), built)]);
    let of_gate: Vec<_> =
        log.parameters.iter().filter(|(name, _)| name == "EST_GATE").map(|(_, value)| *value).collect();
    assert_eq!(of_gate, [4.0, 4.5]);
    let text = |name: &str| String::from_utf8(log.information[name].clone()).unwrap();
    assert_eq!(
        (text("sys_name"), text("ver_hw"), text("afbc_vehicle")),
        ("AFBC".into(), "test".into(), "paper".into())
    );
    assert_eq!(log.information["ver_sw_release"], [255, 0, 1, 0]);
    assert_eq!(log.information["ver_data_format"], [2, 0, 0, 0]);
    assert_eq!(log.start_us, TICK_US);
}

/// Writes logs for other readers (`scripts/check-ulog`), with a list of their contents. The logs come from rings that
/// overflow, and some are cut at a byte.
#[test]
fn logs_for_other_readers() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ulog");
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    let steps = |seed: usize| -> Vec<Step> {
        let one = |index: usize| match (index * 7 + seed) % 5 {
            0 | 3 => Step::Ticks(40),
            1 => Step::Keep(6_000 + 500 * seed),
            2 => Step::Change(3.0 + (index % 6) as f32),
            _ => Step::Text(index as u8 % 8),
        };
        [Step::Ticks(3), Step::Keep(usize::MAX)].into_iter().cycle().take(20).chain((0..60).map(one)).collect()
    };
    let mut expected = String::from("log,messages,samples,dropouts_ms,texts,initial,changes\n");
    let mut told = 0;
    for seed in 0..4 {
        for (ring, whole) in [
            (2_000, run::<2_000>(&steps(seed)).0),
            (6_000, run::<6_000>(&steps(seed)).0),
            (20_000, run::<20_000>(&steps(seed)).0),
        ] {
            for cut in [whole.len(), whole.len() * 3 / 4, whole.len() / 2 + seed] {
                let bytes = &whole[..cut];
                let (name, log) = (format!("{ring}-{seed}-{cut}.ulg"), read(bytes));
                fs::write(folder.join(&name), bytes).unwrap();
                let count: usize = log.messages.values().map(Vec::len).sum();
                let dropouts: Vec<_> = log.dropouts.iter().map(|(ms, _)| ms.to_string()).collect();
                let (samples, changes) = (log.times("sensor_combined").len(), log.parameters.len() - log.initial);
                let numbers = [count, samples].map(|number| number.to_string()).join(",");
                let (texts, initial) = (log.texts.len(), log.initial);
                expected += &format!("{name},{numbers},{},{texts},{initial},{changes}\n", dropouts.join(" "));
                told += dropouts.len();
            }
        }
    }
    assert!(told > 50, "{told} dropouts");
    fs::write(folder.join("expected.csv"), expected).unwrap();
}
