//! Reads missions in the text format `QGC WPL 110` of MAVProxy, Mission Planner and older QGroundControl.
//!
//! Each line is an item with twelve columns, separated by tabs or blanks: number, whether it is the current item,
//! frame, command, four parameters, latitude or x, longitude or y, altitude or z, autocontinue. In version 110 the
//! first line is the home position if it is a waypoint; version 120 has no home.

use afbc_files::read::{FileError, SourceFile};
use afbc_mavlink::MissionItem;

/// Beginning of every file, before the version.
const MAGIC: &str = "QGC WPL";
/// MAV_CMD_NAV_WAYPOINT, and MAV_CMD_DO_JUMP, whose first parameter is a line's number.
const WAYPOINT: u16 = 16;
const JUMP: u16 = 177;
/// MAV_FRAME_MISSION, for items without a place, and the frames whose coordinates are in metres.
const MISSION: u8 = 2;
const LOCAL: [u8; 8] = [1, 4, 7, 8, 9, 12, 20, 21];

/// Returns true if a file begins like a waypoint file; its first dozen bytes are enough to tell.
pub fn is_waypoint_file(bytes: &[u8]) -> bool {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).starts_with(MAGIC.as_bytes())
}

/// Home: latitude and longitude \[deg\], and the altitude above the sea \[m\] if known.
pub(crate) type PlannedHome = ([f64; 2], Option<f64>);

/// Reads the mission and, if known, its home from the `text` of `file`.
///
/// # Errors
/// Fails with one line that names the file, the line, the problem and the remedy.
pub(crate) fn read(file: &str, text: &str) -> Result<(Vec<MissionItem>, Option<PlannedHome>), FileError> {
    let source = SourceFile { file, text };
    let head = text.lines().next().unwrap_or_default();
    let version = head.trim_start_matches('\u{feff}').strip_prefix(MAGIC).unwrap_or_default().trim();
    if version != "110" && version != "120" {
        let problem = format!("{MAGIC} {version:?} is no known version; save it as {MAGIC} 110, or as a plan");
        return Err(FileError::at(source, 0, "", problem));
    }
    let mut items = Vec::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let begin = at;
        at += line.len();
        let line = line.trim();
        if begin > 0 && !line.is_empty() && !line.starts_with('#') {
            let wrong = |problem: String| FileError::at(source, begin, "", problem);
            items.push(item(line, items.len()).map_err(wrong)?);
        }
    }
    let home = items.first().filter(|(item, _)| version == "110" && item.command == WAYPOINT).copied();
    let skipped = usize::from(home.is_some());
    let count = items.len();
    let items = items.into_iter().skip(skipped).zip(0..).map(|((item, _), number)| {
        let mut item = MissionItem { number, is_current: number == 0, ..item };
        let [target, ..] = &mut item.parameters;
        if item.command == JUMP {
            // The target must be a line of the mission; the home line is not part of it.
            if !(skipped as f32..count as f32).contains(target) || target.fract() != 0.0 {
                let problem =
                    format!("item {}: the jump's target {target} does not exist; correct the target", item.number);
                return Err(FileError::whole(file, problem));
            }
            *target -= skipped as f32;
        }
        Ok(item)
    });
    // Zeros mean that the writer did not know the home position.
    let home = home.map(|(item, place)| (place, Some(f64::from(item.z)))).filter(|(place, _)| *place != [0.0, 0.0]);
    Ok((items.collect::<Result<_, _>>()?, home))
}

/// Reads the line of item `number`; returns the item and its coordinates as written.
fn item(line: &str, number: usize) -> Result<(MissionItem, [f64; 2]), String> {
    let columns: Vec<&str> = line.split_whitespace().collect();
    let Ok::<[&str; 12], _>([index, _, frame, command, a, b, c, d, x, y, z, goes_on]) = columns.as_slice().try_into()
    else {
        return Err(format!("the line has {} columns instead of 12; write the line again", columns.len()));
    };
    if index.parse() != Ok(number) {
        return Err(format!("the line's number is {index:?} instead of {number}; number the lines from 0 on"));
    }
    let frame: u8 = whole("frame", frame)?;
    let command: u16 = whole("command", command)?;
    let is_local = LOCAL.contains(&frame);
    let parameters = [decimal("param1", a)?, decimal("param2", b)?, decimal("param3", c)?, decimal("param4", d)?];
    let place = [finite("latitude", x)?, finite("longitude", y)?];
    let [latitude, longitude] = place;
    if !is_local && frame != MISSION && (latitude.abs() > 90.0 || longitude.abs() > 180.0) {
        return Err(format!("latitude {latitude} or longitude {longitude} is out of range; write both in degrees"));
    }
    let units = if is_local { 1e4 } else { 1e7 };
    // The conversion saturates, so values out of range stay out of range.
    let [x, y] = place.map(|coordinate| (coordinate * units).round() as i32);
    let goes_on = match goes_on {
        "1" => true,
        "0" => return Err("the last column (autocontinue) must be 1: a mission does not wait between items".into()),
        other => return Err(format!("the last column (autocontinue) is {other:?}; it must be 1")),
    };
    let (parameters, z) = (parameters.map(|number| number as f32), finite("altitude", z)? as f32);
    Ok((MissionItem { number: 0, command, frame, is_current: false, goes_on, parameters, x, y, z }, place))
}

fn whole<T: std::str::FromStr>(name: &str, text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("{name} is {text:?}; it must be a whole number"))
}

/// Parses a parameter; NaN is allowed and lets the vehicle choose.
fn decimal(name: &str, text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| format!("{name} is {text:?}; it must be a number"))
}

fn finite(name: &str, text: &str) -> Result<f64, String> {
    let number = decimal(name, text)?;
    if number.is_finite() { Ok(number) } else { Err(format!("{name} is {text:?}; it must be a number")) }
}
