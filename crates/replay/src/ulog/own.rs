//! Reads logs of this project's own black box. They hold more than PX4's logs: each measurement as offered to the
//! estimator, and the estimator's settings. So the replayed estimator repeats what it did in flight.

use super::table::{AFBC_AID, AFBC_ESTIMATOR, MessageRow, SENSOR_COMBINED, TopicTables, VEHICLE_LOCAL_POSITION};
use super::topics;
use crate::order::rising;
use crate::recording::{AidingSample, LoggedState, Recording, SampleSource, Sensor, flip};
use crate::states;
use afbc_estimator::{Measurement, Settings, Stamped};
use afbc_onboard::Configuration;
use afbc_onboard::parameters::ParameterTable;
use afbc_store::RecordName;

/// Number of numbers that a logged measurement has.
const NUMBERS: usize = Measurement::NUMBERS;
/// Prefix of the estimator's parameters.
const ESTIMATOR: &str = "EST_";

/// Returns the recording in the tables; none if the log is not this firmware's.
///
/// # Errors
/// A message, if the log has no IMU samples.
pub(super) fn recording(tables: &TopicTables) -> Result<Option<Recording>, String> {
    if !tables.announces(AFBC_ESTIMATOR) {
        return Ok(None);
    }
    // A damaged log may have lost its IMU samples: that is reported with the damage, below.
    if tables.first(SENSOR_COMBINED).is_empty() && tables.notes.is_empty() {
        return Err("the log has no samples of an inertial sensor: the vehicle flew on states from outside; log a \
             vehicle that has an inertial sensor, as in sitl fly mocap"
            .into());
    }
    let settings = settings(tables);
    let mut recording = Recording {
        format: "ULog of this firmware",
        notes: tables.notes.clone(),
        knows_origin: true,
        declination_rad: settings.declination_rad,
        settings: Some(settings),
        ..Recording::default()
    };
    recording.sources.push(topics::imu(tables, &mut recording.imu)?);
    let rows = tables.first(AFBC_AID);
    recording.aiding = rows.iter().filter_map(aiding).collect();
    recording.aiding.sort_by_key(|aiding| aiding.arrived_us);
    for sensor in [Sensor::Tracker, Sensor::Gnss, Sensor::Barometer, Sensor::Magnetometer] {
        let of = |aiding: &&AidingSample| sensor_of(&aiding.measurement.value) == sensor;
        let used = recording.aiding.iter().filter(of).count();
        if used > 0 {
            recording.sources.push(SampleSource { sensor, topic: AFBC_AID.0.into(), used, skipped: 0 });
        }
    }
    let (attitudes, source) = topics::attitudes(tables);
    recording.sources.push(source);
    let (motions, source) = motions(tables);
    recording.sources.push(source);
    recording.states = states::merged(attitudes, motions);
    recording.resets = topics::resets(tables);
    let on_ground =
        tables.first(AFBC_ESTIMATOR).iter().map(|row| (row.timestamp_us(), row.get("on_ground") > 0.0)).collect();
    recording.landed = rising(on_ground, |(at_us, _)| *at_us).0;
    Ok(Some(recording))
}

/// Returns the estimator's settings from the log's parameters.
fn settings(tables: &TopicTables) -> Settings {
    let mut table = ParameterTable::new(Configuration::default());
    for (name, value) in tables.parameters().filter(|(name, _)| name.starts_with(ESTIMATOR)) {
        // A parameter that this version does not have is ignored.
        let _ = RecordName::new(name).map(|name| table.put(name, value as f32));
    }
    table.configuration().estimation
}

/// Returns a measurement as the estimator was offered it; none if its kind is unknown.
fn aiding(row: &MessageRow) -> Option<AidingSample> {
    let names: [&str; NUMBERS] = [
        "numbers[0]",
        "numbers[1]",
        "numbers[2]",
        "numbers[3]",
        "numbers[4]",
        "numbers[5]",
        "numbers[6]",
        "numbers[7]",
        "numbers[8]",
        "numbers[9]",
    ];
    let value = Measurement::of_numbers(row.get("kind") as u8, names.map(|name| row.get(name) as f32))?;
    let at_us = row.get("timestamp_sample") as u64;
    Some(AidingSample { arrived_us: row.timestamp_us(), measurement: Stamped { value, at_us } })
}

fn sensor_of(measurement: &Measurement) -> Sensor {
    match measurement {
        Measurement::Pose { .. } | Measurement::Position { .. } => Sensor::Tracker,
        Measurement::Gnss { .. } => Sensor::Gnss,
        Measurement::Height { .. } => Sensor::Barometer,
        Measurement::MagneticField { .. } | Measurement::Heading { .. } => Sensor::Magnetometer,
    }
}

/// Returns velocities and positions in the measurements' local frame.
fn motions(tables: &TopicTables) -> (Vec<LoggedState>, SampleSource) {
    let rows = tables.first(VEHICLE_LOCAL_POSITION);
    let state = |row: &MessageRow| {
        let valid = |names: [&str; 2]| names.iter().all(|name| row.get(name) > 0.0);
        let of = |names, valid| Some(flip(row.vector(names))).filter(|_| valid);
        states::motion(
            row.sampled_us(),
            of(["vx", "vy", "vz"], valid(["v_xy_valid", "v_z_valid"])),
            of(["x", "y", "z"], valid(["xy_valid", "z_valid"])),
        )
    };
    let states = rows.iter().filter_map(state).collect();
    states::collect(states, rows.len(), Sensor::Motion, VEHICLE_LOCAL_POSITION.0)
}
