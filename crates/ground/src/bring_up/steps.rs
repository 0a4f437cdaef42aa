//! Steps during which the board does not move.

use super::conversation::Conversation;
use super::error::Error;
use super::log::BringUpStep;
use super::statistics::VectorStatistics;
use crate::commands::PING;
use afbc_mavlink::{CommandResult, InertialSample, VehicleCommand};
use nalgebra::Vector3;

/// MAVLink message that the bring-up requests.
const HIGHRES_IMU: u32 = 105;
/// Requested interval \[us\]: shorter than the 20 ms between samples, so that every sample is sent.
const SAMPLE_US: i32 = 10_000;
/// Time over which the board averages each sample \[s\].
const SAMPLE_S: f64 = 0.02;
const GRAVITY_M_S2: f64 = 9.81;

/// Bits of `MAV_SYS_STATUS_SENSOR` that this firmware reports.
const SENSORS: [(u32, &str); 9] = [
    (1, "gyroscope"),
    (2, "accelerometer"),
    (4, "magnetometer"),
    (8, "barometer"),
    (0x20, "GNSS receiver"),
    (0x80, "tracker"),
    (0x8000, "motor outputs"),
    (0x20_0000, "attitude"),
    (0x0200_0000, "battery"),
];
/// Sensors that are healthy only outdoors or in view of a tracker.
const ELSEWHERE: u32 = 0x20 | 0x80;
const GYROSCOPE: u32 = 1;

/// Phrase in the text of every self-test result, and phrase in the text of a failed one.
const SELF_TEST: &str = "its self-test";
const FAILED_TEST: &str = "failed its self-test";
/// Longest wait for the next self-test result \[ms\].
const SELF_TEST_MS: u64 = 3_000;

/// Reads the version of the firmware.
pub(crate) fn version(talk: &mut Conversation<'_>) -> Result<BringUpStep, Error> {
    let mut step = BringUpStep::new("version");
    talk.command(VehicleCommand::RequestMessage { message: 148, index: 0 })?;
    talk.wait(1_000, |talk| talk.latest.version.is_some())?;
    match talk.latest.version {
        Some(version) => {
            let [major, minor, patch, _] = version.software;
            step.found("firmware", format!("{major}.{minor}.{patch}"));
            step.found("capabilities", format!("{:#x}", version.capabilities));
            if version.uid != 0 {
                step.found("serial number of the board", format!("{:#x}", version.uid));
            }
        }
        None => step.check(false, "no AUTOPILOT_VERSION"),
    }
    Ok(step)
}

/// Reads all parameters.
pub(crate) fn parameters(talk: &mut Conversation<'_>) -> Result<BringUpStep, Error> {
    let mut step = BringUpStep::new("parameters");
    talk.read_parameters()?;
    let parameters = talk.client.parameters();
    let (known, count) = (parameters.values().len(), parameters.count().unwrap_or(0));
    step.found("read", format!("{known} of {count}"));
    step.check(parameters.are_complete() && count > 0, "some parameters could not be read");
    Ok(step)
}

/// Reads which sensors are present and healthy.
pub(crate) fn sensors(talk: &mut Conversation<'_>) -> Result<BringUpStep, Error> {
    let mut step = BringUpStep::new("sensors");
    talk.wait(3_000, |talk| talk.latest.system.is_some())?;
    // Wait for a second message: some sensors may have been unhealthy at the start.
    talk.latest.system = None;
    talk.wait(3_000, |talk| talk.latest.system.is_some())?;
    let Some(system) = talk.latest.system else {
        step.check(false, "no SYS_STATUS");
        return Ok(step);
    };
    for (bit, name) in SENSORS {
        let (is_there, is_well) = (system.present & bit != 0, system.healthy & bit != 0);
        step.found(
            name,
            if is_well {
                "well"
            } else if is_there {
                "not well"
            } else {
                "not there"
            },
        );
        step.check(!is_there || is_well || bit & ELSEWHERE != 0, format_args!("{name} not well"));
    }
    Ok(step)
}

/// Runs the built-in self-tests of the sensors that have one.
pub(crate) fn self_tests(talk: &mut Conversation<'_>) -> Result<BringUpStep, Error> {
    let mut step = BringUpStep::new("self-tests");
    let told = talk.client.vehicle().texts.len();
    let results = |talk: &Conversation<'_>| -> Vec<String> {
        talk.texts_after(told).filter(|text| text.contains(SELF_TEST)).map(str::to_owned).collect()
    };
    let answer = talk.command(VehicleCommand::SelfTest)?;
    match answer {
        Some((CommandResult::Accepted, _)) => (),
        Some((CommandResult::Unsupported, _)) => return Ok(step.skipped("this vehicle has no self-tests")),
        Some((answer, _)) => return Ok(step.skipped(format_args!("refused: {answer:?}"))),
        None => {
            step.check(false, "no answer");
            return Ok(step);
        }
    }
    // Wait until no further result comes.
    let mut count = 0;
    while talk.wait(SELF_TEST_MS, |talk| results(talk).len() > count)? {
        count = results(talk).len();
    }
    let results = results(talk);
    if results.is_empty() {
        return Ok(step.skipped("no sensor reported a self-test"));
    }
    for (number, text) in (1..).zip(&results) {
        step.found(&format!("result {number}"), text);
        step.check(!text.contains(FAILED_TEST), text);
    }
    Ok(step)
}

/// Measures tick times, and noise at rest.
pub(crate) fn at_rest(talk: &mut Conversation<'_>, rest_s: u32, add: &mut dyn FnMut(BringUpStep)) -> Result<(), Error> {
    let senses = senses(talk);
    show_samples(talk, true)?;
    let before = talk.latest.health.unwrap_or_default();
    let (restarts, attitudes) = (talk.latest.restarts, talk.latest.attitudes);
    talk.latest.samples.clear();
    talk.latest.altitudes_m.clear();
    talk.listen(1_000 * u64::from(rest_s))?;
    let after = talk.latest.health.unwrap_or_default();
    let samples = std::mem::take(&mut talk.latest.samples);

    let mut ticks = BringUpStep::new("ticks");
    let elapsed_s = after.time_us.saturating_sub(before.time_us) as f64 * 1e-6;
    ticks.found("measured for", format!("{elapsed_s:.1} s of the board's clock"));
    ticks.found("rate", format!("{:.0} Hz", after.rate_hz));
    ticks.found("duration of the last tick", format!("{:.1} us", after.tick_us));
    ticks.found("longest since power-up", format!("{:.1} us", after.tick_max_us));
    ticks.found("ticks late or early meanwhile", after.late_ticks.wrapping_sub(before.late_ticks));
    ticks.found("ticks late or early since power-up", after.late_ticks);
    ticks.found("attitudes", format!("{:.1} Hz", rate(talk.latest.attitudes - attitudes, elapsed_s)));
    ticks.found("stack", "not in telemetry; docs/budgets.md has the computed size");
    ticks.check(talk.latest.restarts == restarts, "the board has restarted");
    ticks.check((997.0..=1003.0).contains(&after.rate_hz), "the rate is not 1000 Hz");
    ticks.check(after.late_ticks == before.late_ticks, "ticks late or early");
    ticks.check(after.tick_max_us < 1_000.0, "a tick longer than its period");
    ticks.check(elapsed_s > 0.0, "no health array");
    add(ticks);

    let mut noise = BringUpStep::new("noise at rest");
    noise.found("temperature", "not in telemetry");
    if !senses {
        add(noise.skipped("no inertial sensor"));
        return Ok(());
    }
    inertial_noise(&mut noise, &samples, elapsed_s);
    let altitudes = talk.latest.altitudes_m.iter().map(|&altitude_m| Vector3::new(altitude_m, 0.0, 0.0));
    let altitude_m = VectorStatistics::of(altitudes).deviation().x;
    noise.found("altitude, deviation", format!("{altitude_m:.2} m"));
    add(noise);
    add(level(&samples));
    add(field(&samples));
    Ok(())
}

/// Returns true if the vehicle has an inertial sensor.
pub(crate) fn senses(talk: &Conversation<'_>) -> bool {
    talk.latest.system.is_some_and(|system| system.present & GYROSCOPE != 0)
}

/// Starts or stops the inertial samples.
pub(crate) fn show_samples(talk: &mut Conversation<'_>, shows: bool) -> Result<(), Error> {
    let interval_us = if shows { SAMPLE_US } else { 0 };
    talk.command(VehicleCommand::SetInterval { message: HIGHRES_IMU, interval_us })?;
    Ok(())
}

fn rate(count: u32, elapsed_s: f64) -> f64 {
    if elapsed_s > 0.0 { f64::from(count) / elapsed_s } else { 0.0 }
}

/// Checks the noise of the inertial sensors at rest. The limits are some ten times the data sheets' values, and allow
/// for a hand's tremor.
fn inertial_noise(step: &mut BringUpStep, samples: &[InertialSample], elapsed_s: f64) {
    const RATES_MAX_RAD_S: f64 = 0.02;
    const FORCE_MAX_M_S2: f64 = 0.2;
    const BIAS_MAX_RAD_S: f64 = 0.2;
    let rates = VectorStatistics::of(samples.iter().map(|sample| sample.rates_rad_s));
    let force = VectorStatistics::of(samples.iter().map(|sample| sample.specific_force_m_s2));
    step.found(
        "samples, each a mean over 20 ms",
        format!("{}, {:.1} Hz", samples.len(), rate(samples.len() as u32, elapsed_s)),
    );
    step.found("gyroscope, mean [rad/s]", three(rates.mean()));
    step.found("gyroscope, deviation [rad/s]", three(rates.deviation()));
    // White noise of density n, averaged over T, has the deviation n / sqrt(2 T).
    let density = |deviation: Vector3<f64>| deviation * (2.0 * SAMPLE_S).sqrt();
    step.found("gyroscope, density [rad/s/sqrt(Hz)]", three(density(rates.deviation())));
    step.found("accelerometer, mean [m/s2]", three(force.mean()));
    step.found("accelerometer, deviation [m/s2]", three(force.deviation()));
    step.found("accelerometer, density [m/s2/sqrt(Hz)]", three(density(force.deviation())));
    step.check(rate(samples.len() as u32, elapsed_s) > 25.0, "fewer than half of the samples");
    for (name, deviation, most) in
        [("gyroscope", rates.deviation(), RATES_MAX_RAD_S), ("accelerometer", force.deviation(), FORCE_MAX_M_S2)]
    {
        step.check(deviation.iter().all(|it| *it > 0.0), format_args!("{name}: an axis is stuck"));
        step.check(deviation.max() < most, format_args!("{name}: noise above {most}; leave the board at rest"));
    }
    step.check(rates.mean().norm() < BIAS_MAX_RAD_S, "the gyroscope's offset is above 0.2 rad/s: calibrate it");
}

/// Checks that the specific force at rest is 9.81 m/s² upward.
fn level(samples: &[InertialSample]) -> BringUpStep {
    const TILT_MAX_RAD: f64 = 0.26;
    let mut step = BringUpStep::new("level");
    let force = VectorStatistics::of(samples.iter().map(|sample| sample.specific_force_m_s2)).mean();
    let tilt_rad = force.angle(&Vector3::z());
    step.found("specific force", format!("{:.2} m/s2", force.norm()));
    step.found("tilt", format!("{:.1} degrees", tilt_rad.to_degrees()));
    step.check(
        (force.norm() - GRAVITY_M_S2).abs() < 0.5,
        "the specific force is not 9.81 m/s2: calibrate the accelerometer",
    );
    step.check(
        tilt_rad < TILT_MAX_RAD,
        "the board does not stand level, or the sensor's alignment or IMU_ATT_* is wrong",
    );
    step
}

/// Checks the magnetometer at rest.
fn field(samples: &[InertialSample]) -> BringUpStep {
    let mut step = BringUpStep::new("magnetic field");
    let fields: Vec<_> = samples.iter().filter_map(|sample| sample.field_ut).collect();
    if fields.is_empty() {
        return step.skipped("no readings of a magnetometer");
    }
    let field = VectorStatistics::of(fields.iter().copied());
    step.found("readings", fields.len());
    step.found("mean, body frame [uT]", three(field.mean()));
    step.found("strength", format!("{:.1} uT", field.mean().norm()));
    step.found("deviation [uT]", three(field.deviation()));
    // The earth's field is 22 to 67 uT strong.
    step.check(
        (15.0..=80.0).contains(&field.mean().norm()),
        "the field is not the earth's: move the board away from iron, and calibrate the magnetometer",
    );
    step
}

fn three(vector: Vector3<f64>) -> String {
    let [x, y, z]: [f64; 3] = vector.into();
    format!("{x:.6} {y:.6} {z:.6}")
}

/// Measures how the gyroscope's offset changes when the sensor is warmed.
pub(crate) fn warmth(
    talk: &mut Conversation<'_>,
    is_attended: bool,
    tell: &mut dyn FnMut(&str),
) -> Result<BringUpStep, Error> {
    const WARMED_S: u64 = 30;
    const DRIFT_MAX_RAD_S: f64 = 0.02;
    let step = BringUpStep::new("warmth");
    if !is_attended || !senses(talk) {
        return Ok(step.skipped("nobody is there to warm the sensors, or there is no inertial sensor"));
    }
    let mean = |talk: &mut Conversation<'_>| -> Result<_, Error> {
        talk.latest.samples.clear();
        talk.listen(3_000)?;
        let samples = std::mem::take(&mut talk.latest.samples);
        Ok(VectorStatistics::of(samples.iter().map(|sample| sample.rates_rad_s)).mean())
    };
    let mut step = step;
    tell("leave the board at rest, level");
    talk.listen(5_000)?;
    let cold = mean(talk)?;
    tell(&format!("warm the sensors by a finger on the chip, without moving the board, for {WARMED_S} s"));
    talk.listen(1_000 * WARMED_S)?;
    tell("take the finger off");
    talk.listen(3_000)?;
    let drift = mean(talk)? - cold;
    step.found("gyroscope, change of the offset [rad/s]", three(drift));
    step.check(drift.norm() < DRIFT_MAX_RAD_S, "the gyroscope's offset moves by more than 0.02 rad/s");
    Ok(step)
}

/// Waits for a GNSS fix.
pub(crate) fn position(
    talk: &mut Conversation<'_>,
    is_attended: bool,
    tell: &mut dyn FnMut(&str),
) -> Result<BringUpStep, Error> {
    let mut step = BringUpStep::new("GNSS fix");
    if talk.latest.fix.is_none() {
        return Ok(step.skipped("no receiver"));
    }
    let patience_s = if is_attended { 300 } else { 10 };
    tell(&format!("waiting for a fix under open sky, {patience_s} s at most"));
    let began_ms = talk.now_ms();
    let is_fixed = talk.wait(1_000 * patience_s, |talk| talk.latest.fix.is_some_and(|fix| fix.kind >= 3))?;
    if let Some(fix) = talk.latest.fix {
        let [horizontal_mm, vertical_mm] = fix.sigma_mm;
        step.found("kind of fix", fix.kind);
        step.found("satellites", fix.satellites);
        step.found("uncertainty", format!("{horizontal_mm} mm horizontally, {vertical_mm} mm vertically"));
        step.found("waited", format!("{:.0} s", (talk.now_ms() - began_ms) as f64 * 1e-3));
    }
    if !is_fixed && !is_attended {
        return Ok(step.skipped("no fix, and nobody is there to take the board outside"));
    }
    step.check(is_fixed, "no 3D fix");
    Ok(step)
}

/// Reads the measured battery voltage and current.
pub(crate) fn battery(talk: &Conversation<'_>) -> BringUpStep {
    let mut step = BringUpStep::new("battery");
    let Some(battery) = talk.latest.battery else { return step.skipped("no reading of a battery") };
    step.found("voltage; compare it with a meter", format!("{:.2} V", f64::from(battery.voltage_mv) * 1e-3));
    if battery.current_ca >= 0 {
        step.found("current", format!("{:.2} A", f64::from(battery.current_ca) * 1e-2));
    }
    step
}

/// Checks that all motor outputs are zero while disarmed.
pub(crate) fn motors(talk: &Conversation<'_>) -> BringUpStep {
    let mut step = BringUpStep::new("motors, disarmed");
    match talk.latest.outputs {
        Some(outputs) => {
            let throttles: Vec<_> = outputs.throttles.iter().take(outputs.active as usize).collect();
            step.found("outputs", outputs.active);
            step.check(throttles.iter().all(|throttle| **throttle == 0.0), "a motor's throttle is not zero");
        }
        None => step.check(false, "no ACTUATOR_OUTPUT_STATUS"),
    }
    step
}

/// Asks the vehicle for its arming checks, without arming it.
pub(crate) fn arming(talk: &mut Conversation<'_>) -> Result<BringUpStep, Error> {
    let mut step = BringUpStep::new("checks before arming");
    let told = talk.client.vehicle().texts.len();
    let answer = talk.command(VehicleCommand::CheckArming)?;
    talk.listen(1_500)?;
    step.check(answer.is_some(), "not answered");
    for text in talk.texts_after(told) {
        step.found("the vehicle says", text);
    }
    step.check(talk.texts_after(told).next().is_some(), "the vehicle gives no reason");
    Ok(step)
}

/// Measures the link: loss, corruption and round trip.
pub(crate) fn link(talk: &mut Conversation<'_>) -> Result<BringUpStep, Error> {
    const PINGS: u32 = 20;
    let mut step = BringUpStep::new("link");
    show_samples(talk, false)?;
    let (mut worst_ms, mut sum_ms, mut answered) = (0, 0, 0);
    for _ in 0..PINGS {
        if let Some((_, after_ms)) = talk.command(PING)? {
            (worst_ms, sum_ms, answered) = (worst_ms.max(after_ms), sum_ms + after_ms, answered + 1);
        }
        talk.listen(20)?;
    }
    let elapsed_s = talk.now_ms() as f64 * 1e-3;
    let latest = *talk.client.counters();
    step.found("bytes", format!("{}, {:.0} per second", talk.bytes(), talk.bytes() as f64 / elapsed_s));
    step.found("messages here", format!("{}, {} lost, {} corrupt", latest.received, latest.lost, latest.bad_checksum));
    if let Some(there) = talk.latest.health.map(|health| health.link) {
        let counts = format!("{}, {} lost, {} corrupt", there.received, there.lost, there.bad_checksum);
        step.found("messages at the board, on one of its links", counts);
        step.check(there.bad_checksum == 0, "corrupt messages there");
    }
    let heartbeats = talk.client.vehicle().heartbeats;
    step.found("heartbeats", format!("{heartbeats} in {elapsed_s:.1} s"));
    if answered > 0 {
        step.found("round trip", format!("mean {}, worst {worst_ms} ms", sum_ms / u64::from(answered)));
    }
    step.check(answered == PINGS, format_args!("{} questions unanswered", PINGS - answered));
    step.check(latest.bad_checksum == 0, "corrupt messages here");
    step.check(f64::from(heartbeats) > 0.8 * elapsed_s - 1.0, "heartbeats are missing");
    Ok(step)
}
