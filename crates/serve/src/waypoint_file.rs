//! Missions as text, `QGC WPL 110`: those of MAVProxy, Mission Planner and older QGroundControl.
//!
//! A line for each item, its twelve columns separated by tabs or blanks: number, whether it is the current one, frame,
//! command, four parameters, latitude or x, longitude or y, altitude or z, whether the mission goes on by itself. In
//! version 110 the first line is the home position, unless it is no waypoint; version 120 has none.

use afbc_files::read::{FileError, Source};
use afbc_link::MissionItem;

/// First words of every file, before its version.
const MAGIC: &str = "QGC WPL";
/// MAV_CMD_NAV_WAYPOINT, and MAV_CMD_DO_JUMP, whose first parameter is a number of a line.
const WAYPOINT: u16 = 16;
const JUMP: u16 = 177;
/// MAV_FRAME_MISSION, of items without a place; and the frames in metres from where the vehicle or its origin is.
const MISSION: u8 = 2;
const LOCAL: [u8; 8] = [1, 4, 7, 8, 9, 12, 20, 21];

/// True if the bytes of a file begin as such a mission does; a dozen are enough.
pub fn is_waypoint_file(bytes: &[u8]) -> bool {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).starts_with(MAGIC.as_bytes())
}

/// Latitude and longitude \[deg\], and the altitude above the sea, if it is known \[m\].
pub(crate) type Home = ([f64; 2], Option<f64>);

/// Reads a mission from the `text` of `file`, and its home, if it is known.
///
/// # Errors
/// One line that names the file, the line, what is wrong and what helps.
pub(crate) fn read(file: &str, text: &str) -> Result<(Vec<MissionItem>, Option<Home>), FileError> {
    let source = Source { file, text };
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
            // To one of the lines, of which home is none of the mission's.
            if !(skipped as f32..count as f32).contains(target) || target.fract() != 0.0 {
                let problem = format!("item {}: it jumps to {target}, which is no item; correct it", item.number);
                return Err(FileError::whole(file, problem));
            }
            *target -= skipped as f32;
        }
        Ok(item)
    });
    // Zeros: whoever wrote the file did not know it.
    let home = home.map(|(item, place)| (place, Some(f64::from(item.z)))).filter(|(place, _)| *place != [0.0, 0.0]);
    Ok((items.collect::<Result<_, _>>()?, home))
}

/// Reads the line of the item with this number; returns it with its coordinates as they are written.
fn item(line: &str, number: usize) -> Result<(MissionItem, [f64; 2]), String> {
    let columns: Vec<&str> = line.split_whitespace().collect();
    let Ok::<[&str; 12], _>([index, _, frame, command, a, b, c, d, x, y, z, goes_on]) = columns.as_slice().try_into()
    else {
        return Err(format!("{} columns instead of 12; write the line again", columns.len()));
    };
    if index.parse() != Ok(number) {
        return Err(format!("its number is {index:?}, not {number}; number the lines from 0 on"));
    }
    let frame: u8 = whole("frame", frame)?;
    let command: u16 = whole("command", command)?;
    let is_local = LOCAL.contains(&frame);
    let parameters = [decimal("param1", a)?, decimal("param2", b)?, decimal("param3", c)?, decimal("param4", d)?];
    let place = [finite("latitude", x)?, finite("longitude", y)?];
    let [latitude, longitude] = place;
    if !is_local && frame != MISSION && (latitude.abs() > 90.0 || longitude.abs() > 180.0) {
        return Err(format!("there is no place {latitude} {longitude}; latitude and longitude are in degrees"));
    }
    let units = if is_local { 1e4 } else { 1e7 };
    // Saturates, so that what is out of range remains so.
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

/// Parameters may be not a number: then the vehicle chooses.
fn decimal(name: &str, text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| format!("{name} is {text:?}; it must be a number"))
}

fn finite(name: &str, text: &str) -> Result<f64, String> {
    let number = decimal(name, text)?;
    if number.is_finite() { Ok(number) } else { Err(format!("{name} is {text:?}; it must be a number")) }
}
