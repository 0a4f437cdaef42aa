//! Every declared parameter is listed in `docs/parameters.md`, with a name that fits ground stations and never changes.
//! Parameters of scenario files are also listed in `docs/reference/scenario-keys.md`.
//!
//! `WRITE=1 cargo test -p flight-tests --test all parameters::` writes the first page, and the parameters' rows of the
//! second.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc::Profile;
use afbc::monitor::MonitorBounds;
use afbc_files::read::words::{self, number};
use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::{Curve, Response};
use afbc_flight_core::protocol::MotorOutputs;
use afbc_onboard::parameters::ParameterTable;
use afbc_onboard::{Configuration, EscSettings, Link};
use afbc_plant::instruments::{
    AccelerometerModel, BarometerModel, GnssModel, GyroscopeModel, ImuModel, MagnetometerModel, TrackerModel,
};
use afbc_plant::{
    BatteryModel, Contact, Deviations, Drag, GroundEffect, MeasurementDropouts, Rotors, Sensing, Turbulence, Wind,
};
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_types::{Declaration, Declared, DeclaredValue, Mounting, OutOfRange, Parameters, Range, SensorCalibration};
use core::convert::Infallible;
use core::fmt::Write;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// A parameter, or an element of a vector.
struct Row {
    name: String,
    /// Value in each of the group's columns.
    values: Vec<String>,
    /// Accepted values; for a choice, with their numbers.
    accepted: String,
    declaration: Declaration,
}

/// Parameters that share a prefix.
struct Group {
    title: String,
    prefix: &'static str,
    /// Headings of the value columns: "default", or the profiles' names.
    columns: Vec<&'static str>,
    rows: Vec<Row>,
    /// For each column, an error if its values are out of range.
    valid: Vec<Result<(), OutOfRange>>,
}

/// Returns a group whose parameters have a single default.
fn group(title: impl Into<String>, prefix: &'static str, parameters: impl Declared) -> Group {
    columns(title, prefix, [("default", parameters)])
}

/// Returns a group whose parameters have a default in each profile.
fn profiles<G: Declared>(title: impl Into<String>, prefix: &'static str, of: impl Fn(Profile) -> G) -> Group {
    columns(title, prefix, Profile::ALL.map(|profile| (profile.name(), of(profile))))
}

/// Returns a parameter's value, element by element, as in a scenario file.
fn shown(value: &DeclaredValue<'_>) -> Vec<String> {
    match value {
        DeclaredValue::Single(numbers) => numbers.iter().map(|number| format!("{number:?}")).collect(),
        DeclaredValue::Double(numbers) => numbers.iter().map(|number| format!("{number:?}")).collect(),
        DeclaredValue::Whole(number) => vec![number.to_string()],
        DeclaredValue::Switch(on) => vec![on.to_string()],
        DeclaredValue::Choice(index, words) => vec![words[*index].to_owned()],
    }
}

/// Returns the accepted values, in words.
fn accepted(range: &Range, value: &DeclaredValue<'_>) -> String {
    match value {
        DeclaredValue::Switch(_) => "true, false".into(),
        DeclaredValue::Choice(_, words) => {
            let numbered =
                words.iter().enumerate().map(|(index, word)| format!("{} {word}", index + range.min as usize));
            numbered.collect::<Vec<_>>().join(", ")
        }
        DeclaredValue::Whole(_) => format!("{} to {}", range.min, range.max),
        _ => format!("{:?} to {:?}", range.min, range.max),
    }
}

fn columns<G: Declared, const N: usize>(
    title: impl Into<String>,
    prefix: &'static str,
    columns: [(&'static str, G); N],
) -> Group {
    let mut rows: Vec<Row> = Vec::new();
    for (_, parameters) in &columns {
        let mut at = 0;
        let Ok(()) = parameters.visit(&mut |declaration, value| {
            let (values, accepted) = (shown(&value), accepted(&declaration.range, &value));
            let coordinates = if values.len() == 1 { vec![None] } else { vec![Some('X'), Some('Y'), Some('Z')] };
            for (coordinate, value) in coordinates.into_iter().zip(values) {
                if rows.len() == at {
                    let name = declaration.name(prefix, coordinate).to_string();
                    let accepted = accepted.clone();
                    rows.push(Row { name, values: Vec::new(), accepted, declaration: *declaration });
                }
                rows[at].values.push(value);
                at += 1;
            }
            Ok::<(), Infallible>(())
        });
    }
    let valid = columns.iter().map(|(_, parameters)| parameters.validate()).collect();
    Group { title: title.into(), prefix, columns: columns.iter().map(|(heading, _)| *heading).collect(), rows, valid }
}

/// Returns the monitor's bounds for the paper's vehicle.
fn bounds(profile: Profile) -> MonitorBounds {
    MonitorBounds::new(&profile.gains(), &Parameters::PAPER.to_f32(), &profile.settings())
}

/// Returns the name of a control law as the beginning of a heading.
fn heading(kind: ControllerKind) -> String {
    let title = kind.title();
    format!("{}{}", title[..1].to_uppercase(), &title[1..])
}

/// Returns the gains of a law: those of each profile, or a law's own outside the cascade.
fn gains(kind: ControllerKind) -> Group {
    let title = heading(kind);
    if kind.in_cascade() {
        profiles(format!("{title}: `[gains.AXIS]`"), kind.prefix(), |profile| Law::of(kind, profile))
    } else {
        group(format!("{title}: `[contender.gains]`"), kind.prefix(), Law::of(kind, Profile::Flight))
    }
}

/// Returns all declared parameters, in the order of the page.
fn groups() -> Vec<Group> {
    let mut groups = vec![
        group("Vehicle: `[vehicle]`, `[truth]`", "V_", Parameters::DEFAULT),
        group("Motors: `[motor]` of a vehicle file", "MOT_", Curve::DEFAULT),
        group("Rotors, as flight software knows them", "MOT_", Response::DEFAULT),
        group("Outputs to the motor controllers", "MOT_", MotorOutputs::DEFAULT),
        group("Telemetry of the motor controllers", "", EscSettings::DEFAULT),
        group("Inertial sensor: `[imu]` of a vehicle file", "IMU_", Mounting::DEFAULT),
        group("Calibration of the sensors, by the vehicle itself", "CAL_", SensorCalibration::DEFAULT),
        group("Arming: `[arming]` of a vehicle file", "ARM_", ArmingLimits::DEFAULT),
        group("Estimator: `[estimator]` of a vehicle file", "EST_", afbc_estimator::Settings::DEFAULT),
        group("Guidance: `[guidance]` of a vehicle file", "", afbc_guidance::Settings::DEFAULT),
        group("Radio control", "", Configuration::default().radio),
        group("Link", "", Link::DEFAULT),
        profiles("Control: `[settings]`, `[limits]`", "C_", Profile::settings),
        profiles("AFBC's monitor", "M_", bounds),
    ];
    groups.extend(ControllerKind::ALL.map(gains));
    groups.extend([
        group("Simulated rotors: `[rotors]`", "ROT_", Rotors::DEFAULT),
        group("Simulated battery: `[battery]`", "BAT_", BatteryModel::DEFAULT),
        group("Simulated drag: `[drag]`", "DRAG_", Drag::DEFAULT),
        group("Simulated wind: `[wind]`", "WIND_", Wind::DEFAULT),
        group("Simulated turbulence: `[wind.turbulence]`", "TURB_", Turbulence::DEFAULT),
        group("Simulated ground: `[ground]`", "GND_", Contact::DEFAULT),
        group("Simulated ground effect: `[ground]`", "GE_", GroundEffect::DEFAULT),
        group("Simulated sensors: `[sensors]`", "SENS_", Sensing::DEFAULT),
        group("Simulated dropouts: `[sensors.dropouts]`", "DROP_", MeasurementDropouts::DEFAULT),
        group("Simulated inertial sensor: `[instruments.imu]`", "I_", ImuModel::DEFAULT),
        group("Simulated tracker: `[instruments.tracker]`", "TRK_", TrackerModel::DEFAULT),
        group("Simulated GNSS receiver: `[instruments.gnss]`", "GNSS_", GnssModel::DEFAULT),
        group("Simulated barometer: `[instruments.barometer]`", "BARO_", BarometerModel::DEFAULT),
        group("Simulated magnetometer: `[instruments.magnetometer]`", "MAG_", MagnetometerModel::DEFAULT),
    ]);
    groups
}

const HEAD: &str = "# Parameters

Every parameter as declared in the code (`parameters!` in [the types crate](../crates/types/src/declared.rs); how to add
one: [ARCHITECTURE.md](../ARCHITECTURE.md#adding-things)). This page is generated from the declarations, and
`tests/tests/parameters.rs` compares it with them:

```sh
WRITE=1 cargo test -p flight-tests --test all parameters::
```

**Name** is a parameter's name on a ground station and in flash: the prefix of its group, an axis or a part of the
group, its id, and X, Y or Z of a vector. A name has at most 16 characters, MAVLink's limit, and never changes. **Key**
is the name in [scenario files](scenarios.md). The groups `V_`, `MOT_`, `IMU_`, `CAL_`, `ARM_`, `EST_`, `C_`, `A_`
and those without a prefix can be set while the vehicle runs ([storage.md](storage.md)). **Tuned** marks the parameters
that `sitl tune` searches; the others belong to the vehicle and its task. Where there are two profiles, the firmware
flies `flight`, and scenario files start from `paper`.
";

fn page() -> String {
    let mut page = HEAD.to_owned();
    for Group { title, prefix, columns, rows, .. } in groups() {
        let prefix = if prefix.is_empty() { "No prefix".to_owned() } else { format!("Prefix `{prefix}`") };
        write!(page, "\n## {title}\n\n{prefix}.\n\n").unwrap();
        writeln!(page, "| name | key | unit | range | {} | tuned | meaning |", columns.join(" | ")).unwrap();
        writeln!(page, "|---|---|---|---|{}---|---|", "---|".repeat(columns.len())).unwrap();
        for Row { name, values, accepted, declaration } in rows {
            let Declaration { group, range, unit, tuned, meaning, .. } = declaration;
            let key = if group.is_empty() { range.name.to_owned() } else { format!("{group}.{}", range.name) };
            let (tuned, meaning) = (if tuned { "yes" } else { "" }, meaning.replace('|', "\\|"));
            let values = values.join("` | `");
            writeln!(page, "| `{name}` | `{key}` | {unit} | {accepted} | `{values}` | {tuned} | {meaning} |").unwrap();
        }
    }
    page
}

/// Returns the keys of one table of a scenario file, each with its row: key, range, default, meaning.
fn keys(parameters: impl Declared) -> Vec<(&'static str, [String; 4])> {
    let mut keys = Vec::new();
    let Ok(()) = parameters.visit(&mut |declaration, value| {
        let Declaration { group, range, unit, meaning, .. } = *declaration;
        let values = shown(&value);
        let (each, default) = match values.as_slice() {
            [_] => ("", words::value(&value)),
            values => (" each", format!("[{}]", values.join(", "))),
        };
        let accepted = match &value {
            DeclaredValue::Switch(_) => "`true`, `false`".to_owned(),
            DeclaredValue::Choice(_, words) => {
                words.iter().map(|word| format!("`\"{word}\"`")).collect::<Vec<_>>().join(", ")
            }
            _ => format!("{} to {}{each}", number(range.min), number(range.max)),
        };
        // The meaning becomes part of a sentence, unless it begins with a symbol or an abbreviation.
        let (first, rest) = meaning.trim_end_matches('.').split_at(1);
        let is_word = rest.starts_with(|c: char| c.is_lowercase() || c == ' ');
        let first = if is_word { first.to_lowercase() } else { first.to_owned() };
        // The meaning itself says if a parameter is in the unit of the subsystem's input.
        let is_told = is_in_key(declaration) || unit.ends_with("input");
        let unit = if is_told { String::new() } else { format!(" \\[{unit}\\]") };
        if group.is_empty() {
            let meaning = format!("{first}{rest}").replace('|', "\\|") + &unit;
            keys.push((range.name, [format!("`{}`", range.name), accepted, format!("`{default}`"), meaning]));
        }
        Ok::<(), Infallible>(())
    });
    keys
}

/// Returns the declared keys of the sections of `docs/reference/scenario-keys.md`, by heading.
fn sections() -> BTreeMap<String, Vec<(&'static str, [String; 4])>> {
    let settings = Profile::Paper.settings();
    let named = [
        ("Vehicle", keys(Parameters::DEFAULT)),
        ("Gains", keys(Profile::Paper.gains().roll)),
        ("Settings", keys(settings)),
        ("Limits", keys(settings.limits)),
        ("Rotors", keys(Rotors::DEFAULT)),
        ("Battery", keys(BatteryModel::DEFAULT)),
        ("Drag", keys(Drag::DEFAULT)),
        ("Wind", keys(Wind::DEFAULT)),
        ("Turbulence", keys(Turbulence::DEFAULT)),
        ("Ground", [keys(Contact::DEFAULT), keys(GroundEffect::DEFAULT)].concat()),
        ("Sensors", [keys(Sensing::DEFAULT), keys(Deviations::DEFAULT), keys(MeasurementDropouts::DEFAULT)].concat()),
        ("Inertial sensor", keys(ImuModel::DEFAULT)),
        ("Gyroscope", keys(GyroscopeModel::DEFAULT)),
        ("Accelerometer", keys(AccelerometerModel::DEFAULT)),
        ("Tracker", keys(TrackerModel::DEFAULT)),
        ("Losses and freezes", keys(MeasurementDropouts::DEFAULT)),
        ("GNSS receiver", keys(GnssModel::DEFAULT)),
        ("Barometer", keys(BarometerModel::DEFAULT)),
        ("Magnetometer", keys(MagnetometerModel::DEFAULT)),
    ];
    let peers = ControllerKind::ALL.into_iter().filter(|kind| !kind.in_cascade());
    let peers = peers.map(|kind| (heading(kind), keys(Law::of(kind, Profile::Paper))));
    named.map(|(heading, keys)| (heading.to_owned(), keys)).into_iter().chain(peers).collect()
}

/// Returns `page` with the rows of declared keys rewritten. A default that is described in words stays.
fn with_declared_rows(page: &str) -> String {
    let mut sections = sections();
    let mut lines: Vec<String> = Vec::new();
    let (mut heading, mut written) = ("", BTreeSet::new());
    for line in page.lines() {
        if let Some((_, title)) = line.split_once("# ").filter(|_| line.starts_with('#')) {
            heading = title;
        }
        let declared = sections.get(heading).and_then(|keys| {
            let (key, row) = keys.iter().find(|(key, _)| line.starts_with(&format!("| `{key}` |")))?;
            written.insert((heading, *key));
            let [key, accepted, default, meaning] = row;
            let default = line.split(" | ").nth(2).filter(|cell| !cell.starts_with('`')).unwrap_or(default);
            Some(format!("| {key} | {accepted} | {default} | {meaning} |"))
        });
        lines.push(declared.unwrap_or_else(|| line.to_owned()));
    }
    for (heading, keys) in &mut sections {
        keys.retain(|(key, _)| !written.contains(&(heading.as_str(), *key)));
        assert!(keys.is_empty(), "docs/reference/scenario-keys.md, {heading}: no row for {keys:?}");
    }
    lines.join("\n") + "\n"
}

/// Checks that the page `name` equals the result of `declared`, or writes it.
fn compare(name: &str, declared: impl Fn(&str) -> String) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(name);
    let written = fs::read_to_string(&path).unwrap();
    let declared = declared(&written);
    if std::env::var_os("WRITE").is_some() {
        return fs::write(&path, &declared).unwrap();
    }
    for (written, declared) in written.lines().zip(declared.lines()) {
        assert_eq!(written, declared, "run WRITE=1 cargo test -p flight-tests --test all parameters::");
    }
    assert_eq!(written, declared, "run WRITE=1 cargo test -p flight-tests --test all parameters::");
}

#[test]
fn the_page_lists_what_is_declared() {
    compare("parameters.md", |_| page());
}

#[test]
fn scenario_keys_are_documented_as_declared() {
    compare("reference/scenario-keys.md", with_declared_rows);
}

#[test]
fn names_are_unique_and_fit_mavlink() {
    let mut names = BTreeSet::new();
    for Row { name, declaration, .. } in groups().into_iter().flat_map(|group| group.rows) {
        assert!(name.len() <= 16, "{name} has {} characters", name.len());
        assert!(name.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_'), "{name}");
        assert!(!declaration.meaning.is_empty(), "{name} has no meaning");
        assert!(names.insert(name.clone()), "{name} twice");
    }
    assert!(names.len() > 150, "{}", names.len());
}

/// Every parameter that a station sees of the firmware is on the page, with the same range.
#[test]
fn what_a_station_may_set_is_declared_here() {
    let rows: BTreeMap<String, Declaration> =
        groups().into_iter().flat_map(|group| group.rows).map(|row| (row.name, row.declaration)).collect();
    let table = ParameterTable::new(Configuration::default());
    for parameter in table.iter() {
        assert_eq!(rows[parameter.name.as_str()].range, parameter.range, "{}", parameter.name);
    }
    let settable = ["", "V_", "MOT_", "IMU_", "CAL_", "ARM_", "EST_", "C_", "A_"];
    let expected: usize =
        groups().iter().filter(|group| settable.contains(&group.prefix)).map(|group| group.rows.len()).sum();
    assert_eq!(usize::from(table.count()), expected);
}

/// True if a parameter has no unit, or its key ends in the unit.
fn is_in_key(Declaration { range, unit, .. }: &Declaration) -> bool {
    let ending: String = unit.to_lowercase().replace([' ', '/'], "_");
    // "1/s" becomes "_1_s". A plain or whole number has no ending.
    ["1", "number", ""].contains(unit) || range.name.ends_with(&format!("_{ending}"))
}

/// A key ends in its unit, except for the paper's letters.
#[test]
fn a_key_ends_in_its_unit() {
    const LETTERS: [&str; 4] = ["alpha1", "stiffness", "sigma", "error"];
    for Row { name, declaration, .. } in groups().into_iter().flat_map(|group| group.rows) {
        let Declaration { range, unit, .. } = declaration;
        // Units that depend on the axis are left out.
        let is_exempt = LETTERS.contains(&range.name) || unit.contains("input") || unit.contains(" or ");
        assert!(is_exempt || is_in_key(&declaration), "{name}: {} in {unit}", range.name);
    }
}

#[test]
fn every_default_is_accepted() {
    for Group { title, valid, .. } in groups() {
        assert!(valid.iter().all(Result::is_ok), "{title}: {valid:?}");
    }
}
