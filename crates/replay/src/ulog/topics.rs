//! Interprets PX4's topics in their old and new layouts.

use super::table::{
    ACTUATOR_ARMED, MessageRow, SENSOR_BARO, SENSOR_COMBINED, SENSOR_GPS, SENSOR_MAG, TopicFields, TopicTables,
    VEHICLE_AIR_DATA, VEHICLE_ATTITUDE, VEHICLE_GPS_POSITION, VEHICLE_LAND_DETECTED, VEHICLE_LOCAL_POSITION,
    VEHICLE_MAGNETOMETER,
};
use crate::aids::{self, ReceiverFix};
use crate::earth::EarthField;
use crate::order::rising;
use crate::recording::{AidingSample, LoggedReset, LoggedState, Recording, SampleSource, Sensor, flip, flip_rotation};
use crate::{compass, earth, states};
use afbc_estimator::{GeodeticOrigin, ImuSample};

/// Delay of a receiver that the log does not state \[ms\]: PX4's default.
const GNSS_DELAY_MS: f64 = 110.0;
/// A relative time in old layouts that marks a sample as absent.
const NOTHING: f64 = i32::MAX as f64;

/// Returns the recording in the tables.
///
/// # Errors
/// A message, if the log has no IMU samples.
pub(super) fn recording(tables: &TopicTables) -> Result<Recording, String> {
    let mut recording =
        Recording { format: "PX4 ULog", notes: tables.notes.clone(), knows_origin: true, ..Recording::default() };
    recording.sources.push(imu(tables, &mut recording.imu)?);
    let fixes = ReceiverFixes::read(tables, &mut recording.notes);
    let first = aids::begin(&fixes.fixes).copied();
    recording.origin = reference(tables).or_else(|| {
        let [latitude, longitude, altitude] = first?.place;
        GeodeticOrigin::new(latitude, longitude, altitude)
    });
    let delay_us =
        |name: &str, usual_ms: f64| (tables.parameter(name).unwrap_or(usual_ms).clamp(0.0, 1000.0) * 1e3) as u64;
    let gnss = match &recording.origin {
        Some(origin) => aids::gnss(&fixes.fixes, origin, delay_us("EKF2_GPS_DELAY", GNSS_DELAY_MS)),
        None => Vec::new(),
    };
    let mut aiding = Vec::new();
    recording.sources.push(aids::collect(&mut aiding, Sensor::Gnss, fixes.topic, fixes.raw, gnss));
    recording.sources.push(barometer(tables, &mut aiding, delay_us("EKF2_BARO_DELAY", 0.0)));
    recording.sources.push(magnetometer(tables, &mut aiding, delay_us("EKF2_MAG_DELAY", 0.0)));
    aiding.sort_by_key(|aiding| aiding.arrived_us);
    recording.aiding = aiding;
    let earth = first.and_then(|fix| earth::at(fix.place[0], fix.place[1], fix.place[2], fixes.utc_us));
    recording.declination_rad = declination(tables, earth.as_ref(), &mut recording.notes);

    let (attitudes, source) = attitudes(tables);
    recording.sources.push(source);
    let (motions, source) = motions(tables, recording.origin.as_ref());
    recording.sources.push(source);
    recording.states = states::merged(attitudes, motions);
    compass::doubt(&mut recording, earth.as_ref());
    recording.resets = resets(tables);
    let flags = |topic: TopicFields, of: &dyn Fn(&MessageRow) -> bool| {
        let values = tables.first(topic).iter().map(|row| (row.timestamp_us(), of(row))).collect();
        rising(values, |(at_us, _)| *at_us).0
    };
    recording.landed = flags(VEHICLE_LAND_DETECTED, &|row| row.get("landed") > 0.0);
    recording.disarmed = flags(ACTUATOR_ARMED, &|row| row.get("armed") == 0.0);
    Ok(recording)
}

/// Reads the IMU samples. Each sample is the mean over its integration time, so its time is the middle of that.
pub(super) fn imu(tables: &TopicTables, samples: &mut Vec<ImuSample>) -> Result<SampleSource, String> {
    let (topic, rows) = (SENSOR_COMBINED.0, tables.first(SENSOR_COMBINED));
    let sample = |row: &MessageRow| {
        let integral = row.get("gyro_integral_dt");
        // The integration time is in microseconds; in old layouts in seconds.
        let integral_us = if integral < 1.0 { integral * 1e6 } else { integral };
        let half_us = if (0.0..=1e5).contains(&integral_us) { (0.5 * integral_us) as u64 } else { 0 };
        ImuSample {
            at_us: row.timestamp_us().saturating_sub(half_us),
            rates_rad_s: flip(row.vector(["gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"])),
            specific_force_m_s2: flip(row.vector([
                "accelerometer_m_s2[0]",
                "accelerometer_m_s2[1]",
                "accelerometer_m_s2[2]",
            ])),
        }
    };
    let plausible: Vec<_> = rows.iter().map(sample).filter(ImuSample::is_plausible).collect();
    let (kept, _) = rising(plausible, |sample| sample.at_us);
    if kept.is_empty() {
        let damage = tables.notes.join(" ");
        let cure = match damage.is_empty() {
            true => "log that topic (SDLOG_PROFILE with the default topics), or give another log".to_owned(),
            false => format!("copy the log from the vehicle again ({damage})"),
        };
        return Err(match rows.len() {
            0 => format!("the log has no samples of an inertial sensor: topic {topic} is missing; {cure}"),
            count => format!("none of the {count} samples of the inertial sensor in topic {topic} is usable; {cure}"),
        });
    }
    *samples = kept;
    Ok(SampleSource {
        sensor: Sensor::Imu,
        topic: topic.into(),
        used: samples.len(),
        skipped: rows.len() - samples.len(),
    })
}

/// Fixes of the receiver that has the most.
struct ReceiverFixes {
    topic: &'static str,
    fixes: Vec<ReceiverFix>,
    raw: usize,
    /// UTC time of the last message that states it \[us\].
    utc_us: Option<f64>,
}

impl ReceiverFixes {
    /// Reads the fixes from `vehicle_gps_position`, which EKF2 used, from one receiver or several. Logs without that
    /// topic have the receivers' `sensor_gps`.
    fn read(tables: &TopicTables, notes: &mut Vec<String>) -> Self {
        let mut best = ReceiverFixes { topic: VEHICLE_GPS_POSITION.0, fixes: Vec::new(), raw: 0, utc_us: None };
        for topic in [VEHICLE_GPS_POSITION, SENSOR_GPS] {
            let instances = tables.instances(topic);
            let mut used = 0;
            for (instance, rows) in &instances {
                let fixes: Vec<_> = rows.iter().filter_map(fix).collect();
                if fixes.len() > best.fixes.len() || best.raw == 0 {
                    let utc_us = rows.iter().map(|row| row.get("time_utc_usec")).rfind(|utc_us| *utc_us > 0.0);
                    best = ReceiverFixes { topic: topic.0, fixes, raw: rows.len(), utc_us };
                    used = *instance;
                }
            }
            if !best.fixes.is_empty() {
                if instances.len() > 1 {
                    let count = instances.len();
                    notes.push(format!("{} has {count} receivers; receiver number {used} is used.", topic.0));
                }
                break;
            }
        }
        best
    }
}

/// Returns the row as a fix, if it is three-dimensional.
fn fix(row: &MessageRow) -> Option<ReceiverFix> {
    // New layouts have degrees and metres, old ones 1e-7 degrees and millimetres.
    let either = |new: &str, old: &str, scale: f64| {
        let new = row.get(new);
        if new.is_finite() { new } else { row.get(old) * scale }
    };
    let place = [
        either("latitude_deg", "lat", 1e-7),
        either("longitude_deg", "lon", 1e-7),
        either("altitude_msl_m", "alt", 1e-3),
    ];
    let velocity_m_s = row.vector(["vel_n_m_s", "vel_e_m_s", "vel_d_m_s"]);
    // NaN makes this true: in a layout without the flag every velocity is valid.
    let is_valid = velocity_m_s.iter().all(|speed| speed.is_finite()) && row.get("vel_ned_valid") != 0.0;
    let fix = ReceiverFix {
        arrived_us: row.timestamp_us(),
        place,
        velocity_m_s: is_valid.then_some(velocity_m_s),
        horizontal_m: row.get("eph"),
        vertical_m: row.get("epv"),
        speed_m_s: row.get("s_variance_m_s"),
    };
    (row.get("fix_type") >= 3.0 && fix.is_place()).then_some(fix)
}

/// Returns the first reference of the log's local position, so that both estimates have the same origin.
fn reference(tables: &TopicTables) -> Option<GeodeticOrigin> {
    tables.first(VEHICLE_LOCAL_POSITION).iter().find_map(own_origin)
}

fn own_origin(row: &MessageRow) -> Option<GeodeticOrigin> {
    let [latitude, longitude, altitude] = row.vector(["ref_lat", "ref_lon", "ref_alt"]);
    // In old layouts the reference is zero until it is set.
    GeodeticOrigin::new(latitude, longitude, altitude).filter(|_| (latitude, longitude) != (0.0, 0.0))
}

/// Takes heights from the first topic that has any.
fn barometer(tables: &TopicTables, all: &mut Vec<AidingSample>, delay_us: u64) -> SampleSource {
    let air = |row: &MessageRow| {
        let height_m = row.get("baro_alt_meter");
        if height_m.is_finite() { height_m } else { height_of(row.get("baro_pressure_pa")) }
    };
    let sensor = |row: &MessageRow| {
        let height_m = row.get("altitude");
        // Pressure is in pascals; in old layouts in hectopascals.
        let pressure = row.get("pressure");
        let pressure_pa = if pressure < 2000.0 { 100.0 * pressure } else { pressure };
        if height_m.is_finite() { height_m } else { height_of(pressure_pa) }
    };
    let own = |value: &dyn Fn(&MessageRow) -> f64, topic: TopicFields| -> Vec<AidingSample> {
        let rows = tables.first(topic).iter();
        rows.map(|row| aids::height(row.timestamp_us(), row.sampled_us(), value(row), delay_us)).collect()
    };
    let combined = |row: &MessageRow| {
        let at_us = relative(row, "baro_timestamp_relative")?;
        Some(aids::height(row.timestamp_us(), at_us, row.get("baro_alt_meter"), delay_us))
    };
    let mut candidates = vec![
        (VEHICLE_AIR_DATA, own(&air, VEHICLE_AIR_DATA)),
        (SENSOR_COMBINED, tables.first(SENSOR_COMBINED).iter().filter_map(combined).collect()),
        (SENSOR_BARO, own(&sensor, SENSOR_BARO)),
    ];
    first_usable(&mut candidates, all, Sensor::Barometer)
}

/// Takes fields from the first topic that has any, less the bias that EKF2 had learned before the flight, if the log
/// has it.
fn magnetometer(tables: &TopicTables, all: &mut Vec<AidingSample>, delay_us: u64) -> SampleSource {
    const GAUSS: [&str; 3] = ["magnetometer_ga[0]", "magnetometer_ga[1]", "magnetometer_ga[2]"];
    let learned = tables.parameter("EKF2_MAGBIAS_ID").is_some_and(|id| id != 0.0);
    let bias = ["EKF2_MAGBIAS_X", "EKF2_MAGBIAS_Y", "EKF2_MAGBIAS_Z"]
        .map(|name| tables.parameter(name).filter(|_| learned).unwrap_or_default());
    let gauss = |row: &MessageRow, names: [&str; 3]| {
        let ([x, y, z], [dx, dy, dz]) = (row.vector(names), bias);
        [x - dx, y - dy, z - dz]
    };
    let own = |names: [&str; 3], topic: TopicFields| -> Vec<AidingSample> {
        let rows = tables.first(topic).iter();
        rows.map(|row| aids::field(row.timestamp_us(), row.sampled_us(), gauss(row, names), delay_us)).collect()
    };
    let combined = |row: &MessageRow| {
        let at_us = relative(row, "magnetometer_timestamp_relative")?;
        Some(aids::field(row.timestamp_us(), at_us, gauss(row, GAUSS), delay_us))
    };
    let mut candidates = vec![
        (VEHICLE_MAGNETOMETER, own(GAUSS, VEHICLE_MAGNETOMETER)),
        (SENSOR_COMBINED, tables.first(SENSOR_COMBINED).iter().filter_map(combined).collect()),
        (SENSOR_MAG, own(["x", "y", "z"], SENSOR_MAG)),
    ];
    first_usable(&mut candidates, all, Sensor::Magnetometer)
}

/// Takes the first topic with a usable measurement. If there is none, PX4's current topic is reported as missing.
fn first_usable(
    candidates: &mut [(TopicFields, Vec<AidingSample>)],
    all: &mut Vec<AidingSample>,
    sensor: Sensor,
) -> SampleSource {
    let usable = |aiding: &AidingSample| aiding.measurement.value.is_plausible();
    let found = candidates.iter().position(|(_, aiding)| aiding.iter().any(usable)).unwrap_or(0);
    match candidates.get_mut(found) {
        Some((topic, aiding)) => aids::collect(all, sensor, topic.0, aiding.len(), std::mem::take(aiding)),
        None => SampleSource { sensor, topic: String::new(), used: 0, skipped: 0 },
    }
}

/// Returns the time of a sensor's sample in an old layout's `sensor_combined`; none if the row has no new sample.
fn relative(row: &MessageRow, name: &str) -> Option<u64> {
    let relative_us = row.get(name);
    let at_us = row.get("timestamp") + relative_us;
    (relative_us < NOTHING && relative_us.abs() < 1e6 && at_us >= 0.0).then_some(at_us as u64)
}

/// Returns the height of a pressure in the standard atmosphere \[m\].
fn height_of(pressure_pa: f64) -> f64 {
    44_330.8 * (1.0 - libm::pow(pressure_pa / 101_325.0, 0.190_263))
}

/// Returns the modelled declination at the first fix; without a fix, the declination stored in the vehicle.
fn declination(tables: &TopicTables, earth: Option<&EarthField>, notes: &mut Vec<String>) -> f32 {
    let stored = tables.parameter("EKF2_MAG_DECL").map(|degrees| degrees.to_radians() as f32);
    let modelled = earth.map(|field| field.declination_rad);
    modelled.or(stored.filter(|angle| angle.abs() <= core::f32::consts::PI)).unwrap_or_else(|| {
        notes.push("The declination is unknown: the heading is magnetic.".into());
        0.0
    })
}

pub(super) fn attitudes(tables: &TopicTables) -> (Vec<LoggedState>, SampleSource) {
    let rows = tables.first(VEHICLE_ATTITUDE);
    let state = |row: &MessageRow| {
        let q = flip_rotation(["q[0]", "q[1]", "q[2]", "q[3]"].map(|name| row.get(name)))?;
        Some(LoggedState { at_us: row.sampled_us(), attitude: Some(q), ..LoggedState::default() })
    };
    states::collect(rows.iter().filter_map(state).collect(), rows.len(), Sensor::Attitude, VEHICLE_ATTITUDE.0)
}

fn motions(tables: &TopicTables, origin: Option<&GeodeticOrigin>) -> (Vec<LoggedState>, SampleSource) {
    let rows = tables.first(VEHICLE_LOCAL_POSITION);
    let state = |row: &MessageRow| {
        let valid = |names: [&str; 2]| names.iter().all(|name| row.get(name) > 0.0);
        let velocity = flip(row.vector(["vx", "vy", "vz"]));
        // The position is relative to this row's reference, which may change in flight.
        let reference = || {
            let own = own_origin(row).and(origin)?;
            let [latitude, longitude, altitude] = row.vector(["ref_lat", "ref_lon", "ref_alt"]);
            Some(own.local(latitude, longitude, altitude))
        };
        let position = reference().map(|from| from + flip(row.vector(["x", "y", "z"])));
        states::motion(
            row.sampled_us(),
            Some(velocity).filter(|_| valid(["v_xy_valid", "v_z_valid"])),
            position.filter(|_| valid(["xy_valid", "z_valid"])),
        )
    };
    let states = rows.iter().filter_map(state).collect();
    states::collect(states, rows.len(), Sensor::Motion, VEHICLE_LOCAL_POSITION.0)
}

/// A reset counter, the counted quantity, the fields of the jump's coordinates, and their unit.
type ResetCounter = (&'static str, &'static str, &'static [&'static str], &'static str);

const COUNTERS: [ResetCounter; 4] = [
    ("xy_reset_counter", "position", &["delta_xy[0]", "delta_xy[1]"], "m"),
    ("z_reset_counter", "height", &["delta_z"], "m"),
    ("vxy_reset_counter", "velocity", &["delta_vxy[0]", "delta_vxy[1]"], "m/s"),
    ("vz_reset_counter", "vertical velocity", &["delta_vz"], "m/s"),
];

/// Returns the jumps of the log's own estimate.
pub(super) fn resets(tables: &TopicTables) -> Vec<LoggedReset> {
    let mut resets = Vec::new();
    let mut count = |rows: &[MessageRow], counter: &str, what, unit, by: &dyn Fn(&MessageRow) -> f64| {
        for (before, row) in rows.iter().zip(rows.iter().skip(1)) {
            let (old, new) = (before.get(counter), row.get(counter));
            if old.is_finite() && new.is_finite() && old != new {
                resets.push(LoggedReset { at_us: row.timestamp_us(), what, by: by(row), unit });
            }
        }
    };
    let motion = tables.first(VEHICLE_LOCAL_POSITION);
    for (counter, what, parts, unit) in COUNTERS {
        let size = |row: &MessageRow| libm::sqrt(parts.iter().map(|part| row.get(part) * row.get(part)).sum());
        count(motion, counter, what, unit, &size);
    }
    // The angle of a rotation from its quaternion's w.
    let turn = |row: &MessageRow| 2.0 * libm::acos(row.get("delta_q_reset[0]").abs().min(1.0)).to_degrees();
    count(tables.first(VEHICLE_ATTITUDE), "quat_reset_counter", "attitude", "degrees", &turn);
    resets.sort_by_key(|reset| reset.at_us);
    resets
}
