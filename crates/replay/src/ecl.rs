//! Reads the CSV of PX4-ECL's replay tests, with lines `time_us,kind,values`. A second file in the same folder has
//! EKF2's estimate.

use crate::aids::{self, ReceiverFix};
use crate::order::rising;
use crate::recording::{LoggedState, Recording, SampleSource, Sensor, flip, flip_rotation};
use crate::{earth, states};
use afbc_estimator::{GeodeticOrigin, ImuSample};
use std::collections::HashMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

/// Delay of the GNSS receiver \[us\]: PX4's default.
const GNSS_DELAY_US: u64 = 110_000;
/// Kinds of lines in the CSV.
const KINDS: [&str; 13] =
    ["imu", "gps", "baro", "mag", "landed", "airspeed", "flow", "range", "vio", "ev", "drag", "terrain", "wind"];
/// Number of characters of a bad file that the error message quotes.
const EXCERPT: usize = 40;

/// Times and values of all lines of one kind.
type KindLines = Vec<(u64, Vec<f64>)>;

/// Reads a log and its estimate. The estimate's file has the log's name with `_ekf2` appended, as in `flight_ekf2.csv`.
///
/// # Errors
/// A message that says what is wrong with the log and what to do.
pub(crate) fn read(bytes: &[u8], path: &Path) -> Result<Recording, String> {
    let mut lines = lines(bytes)?;
    let mut of = |kind: &str| lines.kinds.remove(kind).unwrap_or_default();
    let mut recording = Recording { format: "PX4-ECL CSV", ..Recording::default() };
    let vector = |values: &[f64], from: usize| {
        let part = |index: usize| values.get(from + index).copied().unwrap_or(f64::NAN);
        [part(0), part(1), part(2)]
    };
    let imu = of("imu");
    let sample = |(at_us, values): &(u64, Vec<f64>)| ImuSample {
        at_us: *at_us,
        rates_rad_s: flip(vector(values, 3)),
        specific_force_m_s2: flip(vector(values, 0)),
    };
    let samples: Vec<_> = imu.iter().map(sample).filter(ImuSample::is_plausible).collect();
    recording.imu = rising(samples, |sample| sample.at_us).0;
    let used = recording.imu.len();
    if used == 0 {
        let what =
            if imu.is_empty() { "the log has no line of kind imu" } else { "the log has no usable line of kind imu" };
        return Err(format!(
            "{what}; such a line is time_us,imu and six numbers, first the accelerometer, then the gyroscope"
        ));
    }
    let skipped = imu.len() - used;
    recording.sources.push(SampleSource { sensor: Sensor::Imu, topic: "imu".into(), used, skipped });

    let gps = of("gps");
    let fix = |(at_us, values): &(u64, Vec<f64>)| {
        let [altitude, latitude, longitude] = vector(values, 0);
        let velocity_m_s = vector(values, 3);
        let fix = ReceiverFix {
            arrived_us: *at_us,
            place: [latitude * 1e-7, longitude * 1e-7, altitude * 1e-3],
            velocity_m_s: velocity_m_s.iter().all(|speed| speed.is_finite()).then_some(velocity_m_s),
            horizontal_m: 0.0,
            vertical_m: 0.0,
            speed_m_s: 0.0,
        };
        fix.is_place().then_some(fix)
    };
    let mut fixes: Vec<ReceiverFix> = gps.iter().filter_map(fix).collect();
    // The declination belongs to the place as written, as EKF2 used it.
    let written = aids::begin(&fixes).copied();
    if are_exchanged(&fixes) {
        fixes
            .iter_mut()
            .for_each(|ReceiverFix { place: [latitude, longitude, _], .. }| std::mem::swap(latitude, longitude));
        recording
            .notes
            .push("Latitude and longitude were swapped, since only then do they agree with the velocity.".into());
    }
    let first = aids::begin(&fixes).copied();
    if let Some(ReceiverFix { place: [latitude, longitude, altitude], .. }) = first {
        recording.origin = GeodeticOrigin::new(latitude, longitude, altitude);
    }
    if let Some(ReceiverFix { place: [latitude, longitude, altitude], .. }) = written {
        let field = earth::at(latitude, longitude, altitude, None);
        recording.declination_rad = field.map_or(0.0, |field| field.declination_rad);
    }
    let gnss = recording.origin.map_or(Vec::new(), |origin| aids::gnss(&fixes, &origin, GNSS_DELAY_US));
    let first_of = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
    let (baro, mag) = (of("baro"), of("mag"));
    let heights = baro.iter().map(|(at_us, values)| aids::height(*at_us, *at_us, first_of(values), 0)).collect();
    let fields = mag.iter().map(|(at_us, values)| aids::field(*at_us, *at_us, vector(values, 0), 0)).collect();
    let mut aiding = Vec::new();
    recording.sources.push(aids::collect(&mut aiding, Sensor::Gnss, "gps", gps.len(), gnss));
    recording.sources.push(aids::collect(&mut aiding, Sensor::Barometer, "baro", baro.len(), heights));
    recording.sources.push(aids::collect(&mut aiding, Sensor::Magnetometer, "mag", mag.len(), fields));
    aiding.sort_by_key(|aiding| aiding.arrived_us);
    recording.aiding = aiding;
    let landed = of("landed").into_iter().map(|(at_us, values)| (at_us, first_of(&values) > 0.0)).collect();
    recording.landed = rising(landed, |(at_us, _)| *at_us).0;
    if let Some((count, first)) = lines.bad {
        recording.notes.push(format!("{count} lines were skipped; the first is line {first}."));
    }
    beside(path, &mut recording);
    Ok(recording)
}

/// Returns true if the fixes agree with the integrated velocity only after latitude and longitude are exchanged. Some
/// of PX4-ECL's logs were written in that order.
fn are_exchanged(fixes: &[ReceiverFix]) -> bool {
    let (mut way, mut straight, mut exchanged) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut flown = [0.0; 2];
    let Some(first) = fixes.first() else { return false };
    let local = |order: fn(&[f64; 3]) -> (f64, f64), fix: &ReceiverFix| {
        let (from, to) = (order(&first.place), order(&fix.place));
        let origin = GeodeticOrigin::new(from.0, from.1, 0.0)?;
        let place = origin.local(to.0, to.1, 0.0);
        Some([f64::from(place.x), f64::from(-place.y)])
    };
    for (fix, next) in fixes.iter().zip(fixes.iter().skip(1)) {
        let (Some([north, east, _]), true) = (fix.velocity_m_s, next.arrived_us > fix.arrived_us) else { continue };
        // Across a long gap a single velocity does not tell the distance flown.
        let dt_s = ((next.arrived_us - fix.arrived_us) as f64 * 1e-6).min(2.0);
        flown = [flown[0] + north * dt_s, flown[1] + east * dt_s];
        let off =
            |place: Option<[f64; 2]>| place.map_or(f64::INFINITY, |[x, y]| libm::hypot(x - flown[0], y - flown[1]));
        way = way.max(libm::hypot(flown[0], flown[1]));
        straight = straight.max(off(local(|place| (place[0], place[1]), next)));
        exchanged = exchanged.max(off(local(|place| (place[1], place[0]), next)));
    }
    way > 5.0 && exchanged < 0.3 * way && straight > 0.3 * way && exchanged < 0.5 * straight
}

/// Lines of a file, by kind.
struct LinesByKind {
    kinds: HashMap<String, KindLines>,
    /// Number of unreadable lines, and the line number of the first.
    bad: Option<(usize, u64)>,
}

fn lines(bytes: &[u8]) -> Result<LinesByKind, String> {
    const WANTED: &str = "a log is a PX4 ULog or a PX4-ECL CSV (lines of time_us,kind,values)";
    if bytes.is_empty() {
        return Err(format!("empty; {WANTED}"));
    }
    let mut read = LinesByKind { kinds: HashMap::new(), bad: None };
    // Each kind of line has its own number of values.
    let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(bytes);
    let mut record = csv::ByteRecord::new();
    let mut good = 0_usize;
    loop {
        let line = reader.position().line();
        match reader.read_byte_record(&mut record) {
            Ok(false) => break,
            Ok(true) => {
                if let Some((kind, entry)) = entry(&record) {
                    read.kinds.entry(kind).or_default().push(entry);
                    good += 1;
                    continue;
                }
            }
            Err(_) => {}
        }
        let bad = read.bad.get_or_insert((0, line));
        bad.0 += 1;
        // Give up early on a file that is no text, such as a picture or a video.
        if good == 0 && bad.0 > 1000 {
            break;
        }
    }
    if good == 0 {
        let excerpt: String = String::from_utf8_lossy(bytes).chars().take(EXCERPT).collect();
        return Err(format!("the file is not a log: it begins with \"{}\"; {WANTED}", excerpt.escape_debug()));
    }
    Ok(read)
}

/// Returns kind, time and values of a line; none if the line is bad.
fn entry(record: &csv::ByteRecord) -> Option<(String, (u64, Vec<f64>))> {
    let text = |index: usize| std::str::from_utf8(record.get(index)?).ok().map(str::trim);
    let at_us: u64 = text(0)?.parse().ok()?;
    let kind = text(1).filter(|kind| KINDS.contains(kind))?;
    let values = (2..record.len()).map(|index| text(index)?.parse().ok());
    Some((kind.to_owned(), (at_us, values.collect::<Option<Vec<f64>>>()?)))
}

/// Reads the estimate's file next to the log. A missing or bad estimate is reported as a missing source.
fn beside(path: &Path, recording: &mut Recording) {
    let file = estimate_path(path);
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let read = fs::read(&file).ok().and_then(|bytes| estimates(&bytes)).unwrap_or_default();
    let (raw, attitudes) = (read.len(), read.iter().map(|(attitude, _)| *attitude));
    let (attitudes, source) =
        states::collect(attitudes.filter(|state| state.attitude.is_some()).collect(), raw, Sensor::Attitude, &name);
    recording.sources.push(source);
    let motions = read.iter().filter_map(|(_, motion)| *motion).collect();
    let (motions, source) = states::collect(motions, raw, Sensor::Motion, &name);
    recording.sources.push(source);
    recording.states = states::merged(attitudes, motions);
}

fn estimate_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(path.file_stem().unwrap_or_default());
    name.push("_ekf2.csv");
    path.with_file_name(name)
}

/// Returns attitude and motion of each line; none if a column is missing.
fn estimates(bytes: &[u8]) -> Option<Vec<(LoggedState, Option<LoggedState>)>> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(bytes);
    let head = reader.byte_headers().ok()?.clone();
    let column = |name: &str| head.iter().position(|field| field == name.as_bytes());
    let time = column("Timestamp")?;
    let columns = (0..10).map(|index| column(&format!("state[{index}]"))).collect::<Option<Vec<_>>>()?;
    let state = |record: csv::ByteRecord| {
        let number = |index: usize| -> Option<f64> { std::str::from_utf8(record.get(index)?).ok()?.parse().ok() };
        let at_us = number(time).filter(|at_us| *at_us >= 0.0)? as u64;
        let values = columns.iter().map(|column| number(*column)).collect::<Option<Vec<f64>>>()?;
        let &[w, qx, qy, qz, vx, vy, vz, x, y, z] = values.as_slice() else { return None };
        let attitude = LoggedState { at_us, attitude: flip_rotation([w, qx, qy, qz]), ..LoggedState::default() };
        Some((attitude, states::motion(at_us, Some(flip([vx, vy, vz])), Some(flip([x, y, z])))))
    };
    Some(reader.into_byte_records().filter_map(|record| state(record.ok()?)).collect())
}
