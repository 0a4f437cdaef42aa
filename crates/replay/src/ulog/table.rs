//! Collects the needed fields of a log's topics as numbers.

use super::format::{FieldType as Type, UlogFormat};
use super::reader::{LogReader, UlogEntry};
use super::records::{FilePiece, RecordsEnd, each};
use std::collections::{HashMap, HashSet};

/// Name of a topic and the fields that are read, in any of the topic's layouts.
pub(super) type TopicFields = (&'static str, &'static [&'static str]);

pub(super) const SENSOR_COMBINED: TopicFields = (
    "sensor_combined",
    &[
        "timestamp",
        "gyro_rad[0]",
        "gyro_rad[1]",
        "gyro_rad[2]",
        "accelerometer_m_s2[0]",
        "accelerometer_m_s2[1]",
        "accelerometer_m_s2[2]",
        "gyro_integral_dt",
        "magnetometer_ga[0]",
        "magnetometer_ga[1]",
        "magnetometer_ga[2]",
        "magnetometer_timestamp_relative",
        "baro_alt_meter",
        "baro_timestamp_relative",
    ],
);
const GNSS: &[&str] = &[
    "timestamp",
    "latitude_deg",
    "longitude_deg",
    "altitude_msl_m",
    "lat",
    "lon",
    "alt",
    "fix_type",
    "eph",
    "epv",
    "s_variance_m_s",
    "vel_n_m_s",
    "vel_e_m_s",
    "vel_d_m_s",
    "vel_ned_valid",
    "time_utc_usec",
];
pub(super) const VEHICLE_GPS_POSITION: TopicFields = ("vehicle_gps_position", GNSS);
pub(super) const SENSOR_GPS: TopicFields = ("sensor_gps", GNSS);
pub(super) const VEHICLE_MAGNETOMETER: TopicFields = (
    "vehicle_magnetometer",
    &["timestamp", "timestamp_sample", "magnetometer_ga[0]", "magnetometer_ga[1]", "magnetometer_ga[2]"],
);
pub(super) const SENSOR_MAG: TopicFields = ("sensor_mag", &["timestamp", "timestamp_sample", "x", "y", "z"]);
pub(super) const VEHICLE_AIR_DATA: TopicFields =
    ("vehicle_air_data", &["timestamp", "timestamp_sample", "baro_alt_meter", "baro_pressure_pa"]);
pub(super) const SENSOR_BARO: TopicFields = ("sensor_baro", &["timestamp", "timestamp_sample", "altitude", "pressure"]);
pub(super) const VEHICLE_ATTITUDE: TopicFields = (
    "vehicle_attitude",
    &["timestamp", "timestamp_sample", "q[0]", "q[1]", "q[2]", "q[3]", "quat_reset_counter", "delta_q_reset[0]"],
);
pub(super) const VEHICLE_LOCAL_POSITION: TopicFields = (
    "vehicle_local_position",
    &[
        "timestamp",
        "timestamp_sample",
        "x",
        "y",
        "z",
        "vx",
        "vy",
        "vz",
        "xy_valid",
        "z_valid",
        "v_xy_valid",
        "v_z_valid",
        "ref_lat",
        "ref_lon",
        "ref_alt",
        "xy_reset_counter",
        "delta_xy[0]",
        "delta_xy[1]",
        "z_reset_counter",
        "delta_z",
        "vxy_reset_counter",
        "delta_vxy[0]",
        "delta_vxy[1]",
        "vz_reset_counter",
        "delta_vz",
    ],
);
pub(super) const VEHICLE_LAND_DETECTED: TopicFields = ("vehicle_land_detected", &["timestamp", "landed"]);

pub(super) const ACTUATOR_ARMED: TopicFields = ("actuator_armed", &["timestamp", "armed"]);
pub(super) const AFBC_ESTIMATOR: TopicFields = ("afbc_estimator", &["timestamp", "on_ground"]);
pub(super) const AFBC_AID: TopicFields = (
    "afbc_aid",
    &[
        "timestamp",
        "timestamp_sample",
        "kind",
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
    ],
);

const TOPICS: [TopicFields; 13] = [
    SENSOR_COMBINED,
    VEHICLE_GPS_POSITION,
    SENSOR_GPS,
    VEHICLE_MAGNETOMETER,
    SENSOR_MAG,
    VEHICLE_AIR_DATA,
    SENSOR_BARO,
    VEHICLE_ATTITUDE,
    VEHICLE_LOCAL_POSITION,
    VEHICLE_LAND_DETECTED,
    ACTUATOR_ARMED,
    AFBC_ESTIMATOR,
    AFBC_AID,
];

/// A message: its fields in the order of its [`TopicFields`]; NaN for a field that its layout lacks.
pub(super) struct MessageRow {
    fields: &'static [&'static str],
    values: Box<[f64]>,
}

impl MessageRow {
    /// Returns a field; NaN if the message lacks it.
    pub(super) fn get(&self, name: &str) -> f64 {
        let index = self.fields.iter().position(|field| *field == name);
        index.and_then(|index| self.values.get(index)).copied().unwrap_or(f64::NAN)
    }

    /// Returns three fields as a vector.
    pub(super) fn vector(&self, names: [&str; 3]) -> [f64; 3] {
        names.map(|name| self.get(name))
    }

    /// Returns the message's time \[us\].
    pub(super) fn timestamp_us(&self) -> u64 {
        self.get("timestamp") as u64
    }

    /// Returns the time of the sample, or the message's time if the log has no sample time \[us\].
    pub(super) fn sampled_us(&self) -> u64 {
        let (sample, at) = (self.get("timestamp_sample"), self.get("timestamp"));
        // NaN makes this false: the layout has no such field.
        if sample > 0.0 && sample <= at && at - sample < 1e6 { sample as u64 } else { at as u64 }
    }
}

/// Contents of a log.
#[derive(Default)]
pub(super) struct TopicTables {
    /// Messages by topic and instance, in the order of the file.
    rows: HashMap<(&'static str, u8), Vec<MessageRow>>,
    parameters: HashMap<String, f64>,
    /// Topics that the log subscribes to, with or without messages.
    announced: HashSet<&'static str>,
    /// Remarks on the file for the report.
    pub(super) notes: Vec<String>,
}

impl TopicTables {
    /// Returns the instances of a topic that have messages, lowest first.
    pub(super) fn instances(&self, topic: TopicFields) -> Vec<(u8, &[MessageRow])> {
        let of = self.rows.iter().filter(|((name, _), _)| *name == topic.0);
        let mut instances: Vec<_> = of.map(|((_, instance), rows)| (*instance, rows.as_slice())).collect();
        instances.sort_by_key(|(instance, _)| *instance);
        instances
    }

    /// Returns true if the log has a subscription to the topic.
    pub(super) fn announces(&self, topic: TopicFields) -> bool {
        self.announced.contains(topic.0)
    }

    /// Returns all parameters in arbitrary order.
    pub(super) fn parameters(&self) -> impl Iterator<Item = (&str, f64)> {
        self.parameters.iter().map(|(name, value)| (name.as_str(), *value))
    }

    /// Returns the messages of a topic's lowest instance.
    pub(super) fn first(&self, topic: TopicFields) -> &[MessageRow] {
        self.instances(topic).first().map_or(&[], |(_, rows)| rows)
    }

    /// Returns a parameter, if the log has it and its value is finite.
    pub(super) fn parameter(&self, name: &str) -> Option<f64> {
        self.parameters.get(name).copied().filter(|value| value.is_finite())
    }
}

/// Offsets of a topic's fields in a message.
struct FieldPlaces {
    topic: TopicFields,
    places: Vec<Option<(Type, usize)>>,
}

impl FieldPlaces {
    fn of(format: &UlogFormat) -> Option<Self> {
        let topic = *TOPICS.iter().find(|(name, _)| *name == format.name)?;
        let place = |name: &&str| {
            let field = format.fields.iter().find(|field| field.name == *name)?;
            Some((field.kind, field.at))
        };
        Some(FieldPlaces { topic, places: topic.1.iter().map(place).collect() })
    }
}

/// Returns the number at an offset of a message.
fn number(data: &[u8], (kind, at): &(Type, usize)) -> Option<f64> {
    let from = data.get(*at..)?;
    Some(match kind {
        Type::Int8 => f64::from(i8::from_le_bytes(*from.first_chunk()?)),
        Type::UInt8 | Type::Bool | Type::Char => f64::from(u8::from_le_bytes(*from.first_chunk()?)),
        Type::Int16 => f64::from(i16::from_le_bytes(*from.first_chunk()?)),
        Type::UInt16 => f64::from(u16::from_le_bytes(*from.first_chunk()?)),
        Type::Int32 => f64::from(i32::from_le_bytes(*from.first_chunk()?)),
        Type::UInt32 => f64::from(u32::from_le_bytes(*from.first_chunk()?)),
        // Times in microseconds are exact up to 285 years.
        Type::Int64 => i64::from_le_bytes(*from.first_chunk()?) as f64,
        Type::UInt64 => u64::from_le_bytes(*from.first_chunk()?) as f64,
        Type::Float => f64::from(f32::from_le_bytes(*from.first_chunk()?)),
        Type::Double => f64::from_le_bytes(*from.first_chunk()?),
    })
}

/// Selects the records that are read: damage to any other record does not matter.
#[derive(Default)]
struct RecordFilter {
    ids: HashSet<[u8; 2]>,
    announced: HashSet<&'static str>,
}

impl RecordFilter {
    fn has(&mut self, record: &[u8]) -> bool {
        let topic = |name: &[u8]| TOPICS.iter().map(|(topic, _)| *topic).find(|topic| topic.as_bytes() == name);
        match record.get(2..) {
            Some([b'B' | b'P' | b'O', ..]) => true,
            Some([b'F', format @ ..]) => format.split(|byte| *byte == b':').next().and_then(topic).is_some(),
            Some([b'A', _, low, high, name @ ..]) => {
                let wanted = topic(name);
                if let Some(topic) = wanted {
                    self.ids.insert([*low, *high]);
                    self.announced.insert(topic);
                }
                wanted.is_some()
            }
            Some([b'D', low, high, ..]) => self.ids.contains(&[*low, *high]),
            _ => false,
        }
    }
}

/// Reads the [`TOPICS`] and all parameters.
///
/// # Errors
/// A message that says what is wrong with the file, if nothing can be read.
pub(super) fn read(bytes: &[u8]) -> Result<TopicTables, String> {
    let mut tables = TopicTables::default();
    let mut plans: HashMap<u16, Option<FieldPlaces>> = HashMap::new();
    let (mut dropouts, mut dropped_ms) = (0_u64, 0_u64);
    let (mut pieces, mut length, mut first) = (0_u64, 0, None);
    let (mut reader, mut wanted) = (LogReader::default(), RecordFilter::default());
    let end = each(bytes, |piece, at| {
        let entry = match piece {
            FilePiece::Record(record) if !wanted.has(record) => return,
            FilePiece::Record(record) => reader.entry(record).ok_or(record.len()),
            FilePiece::Junk(length) => Err(length),
        };
        match entry {
            Ok(UlogEntry::Message { id, topic, data }) => {
                let plan = plans.entry(id).or_insert_with(|| FieldPlaces::of(&topic.format));
                if let Some(FieldPlaces { topic: (name, fields), places }) = plan {
                    let value = |place: &Option<_>| place.as_ref().and_then(|place| number(data, place));
                    let values = places.iter().map(|place| value(place).unwrap_or(f64::NAN)).collect();
                    tables.rows.entry((*name, topic.instance)).or_default().push(MessageRow { fields, values });
                }
            }
            // Keeps the first value: a later change belongs to another flight.
            Ok(UlogEntry::Parameter { name, value, .. }) => {
                tables.parameters.entry(name.to_owned()).or_insert(value.number());
            }
            Ok(UlogEntry::Dropout(lost_ms)) => {
                dropouts += 1;
                dropped_ms += u64::from(lost_ms);
            }
            Ok(_) => {}
            Err(lost) => {
                first.get_or_insert(at);
                pieces += 1;
                length += lost;
            }
        }
    })?;
    tables.announced = wanted.announced;
    match end {
        RecordsEnd::Whole => {}
        RecordsEnd::Cut(at) => tables.notes.push(format!("The file is cut off within the record at byte {at}.")),
        RecordsEnd::Lost(at) => tables.notes.push(format!("Nothing can be read from byte {at} on.")),
    }
    if let Some(first) = first {
        let what = format!("{pieces} pieces, {length} bytes in all, the first at byte {first}");
        tables.notes.push(format!("Damaged pieces were skipped: {what}."));
    }
    if dropouts > 0 {
        tables.notes.push(format!("The logger dropped out {dropouts} times, {dropped_ms} ms in all."));
    }
    Ok(tables)
}
