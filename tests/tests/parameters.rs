//! Every declared parameter is listed in `docs/parameters.md`, with a name that suits ground stations and never
//! changes.
//!
//! `WRITE=1 cargo test -p flight-tests --test parameters` writes the page.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc::Profile;
use afbc::monitor::Bounds;
use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::Curve;
use afbc_plant::{Battery, Contact, Drag, Dropouts, GroundEffect, Rotors, Sensing, Turbulence, Wind};
use afbc_sim::contender::{ControllerKind, Law};
use afbc_types::{Declaration, Declared, OutOfRange, Parameters, Value};
use core::convert::Infallible;
use core::fmt::Write;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// One parameter, or one element of a vector.
struct Row {
    name: String,
    /// Value in each of the group's columns.
    values: Vec<String>,
    declaration: Declaration,
}

/// Parameters that share a prefix.
struct Group {
    title: String,
    prefix: &'static str,
    /// Headings of the value columns: the default, or each profile.
    columns: Vec<&'static str>,
    rows: Vec<Row>,
    /// Whether the values of each column are in range.
    valid: Vec<Result<(), OutOfRange>>,
}

/// Returns a group whose parameters have one default.
fn group(title: impl Into<String>, prefix: &'static str, parameters: impl Declared) -> Group {
    columns(title, prefix, [("default", parameters)])
}

/// Returns a group whose parameters have a default in each profile.
fn profiles<G: Declared>(title: impl Into<String>, prefix: &'static str, of: impl Fn(Profile) -> G) -> Group {
    columns(title, prefix, Profile::ALL.map(|profile| (profile.name(), of(profile))))
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
            let values: Vec<String> = match &value {
                Value::Single(numbers) => numbers.iter().map(|number| format!("{number:?}")).collect(),
                Value::Double(numbers) => numbers.iter().map(|number| format!("{number:?}")).collect(),
                Value::Switch(on) => vec![on.to_string()],
            };
            let coordinates = if values.len() == 1 { vec![None] } else { vec![Some('X'), Some('Y'), Some('Z')] };
            for (coordinate, value) in coordinates.into_iter().zip(values) {
                if rows.len() == at {
                    let name = declaration.name(prefix, coordinate).to_string();
                    rows.push(Row { name, values: Vec::new(), declaration: *declaration });
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

/// Returns AFBC's bounds for the paper's vehicle.
fn bounds(profile: Profile) -> Bounds {
    Bounds::new(&profile.gains(), &Parameters::PAPER.to_f32())
}

/// Returns the gains of a law: those of each profile, or its own for a law outside the cascade.
fn gains(kind: ControllerKind) -> Group {
    let title = kind.title();
    let title = format!("{}{}", title[..1].to_uppercase(), &title[1..]);
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
        group("Motors", "MOT_", Curve::DEFAULT),
        group("Arming", "ARM_", ArmingLimits::DEFAULT),
        profiles("Control: `[settings]`, `[limits]`", "C_", Profile::settings),
        profiles("AFBC's monitor", "M_", bounds),
    ];
    groups.extend(ControllerKind::ALL.map(gains));
    groups.extend([
        group("Simulated rotors: `[rotors]`", "ROT_", Rotors::DEFAULT),
        group("Simulated battery: `[battery]`", "BAT_", Battery::DEFAULT),
        group("Simulated drag: `[drag]`", "DRAG_", Drag::DEFAULT),
        group("Simulated wind: `[wind]`", "WIND_", Wind::DEFAULT),
        group("Simulated turbulence: `[wind.turbulence]`", "TURB_", Turbulence::DEFAULT),
        group("Simulated ground: `[ground]`", "GND_", Contact::DEFAULT),
        group("Simulated ground effect: `[ground]`", "GE_", GroundEffect::DEFAULT),
        group("Simulated sensors: `[sensors]`", "SENS_", Sensing::DEFAULT),
        group("Simulated dropouts: `[sensors.dropouts]`", "DROP_", Dropouts::DEFAULT),
    ]);
    groups
}

const HEAD: &str = "# Parameters

Every parameter as declared in the code (`parameters!` in [the types crate](../crates/types/src/declared.rs); how to add
one: [ARCHITECTURE.md](../ARCHITECTURE.md#adding-things)). This page is generated from the declarations, and
`tests/tests/parameters.rs` compares it with them:

```sh
WRITE=1 cargo test -p flight-tests --test parameters
```

**Name** is a parameter's name on a ground station and in flash: the prefix of its group, an axis or a part of the
group, its id, and X, Y or Z of a vector. A name has at most 16 characters, MAVLink's limit, and never changes. **Key**
is the name in [scenario files](scenarios.md). **Tuned** marks the parameters that `sitl tune` searches; the others
belong to the vehicle and its task. Where there are two profiles, the firmware flies `flight`, and scenario files start
from `paper`.
";

fn page() -> String {
    let mut page = HEAD.to_owned();
    for Group { title, prefix, columns, rows, .. } in groups() {
        write!(page, "\n## {title}\n\nPrefix `{prefix}`.\n\n").unwrap();
        writeln!(page, "| name | key | unit | range | {} | tuned | meaning |", columns.join(" | ")).unwrap();
        writeln!(page, "|---|---|---|---|{}---|---|", "---|".repeat(columns.len())).unwrap();
        for Row { name, values, declaration: Declaration { group, range, unit, tuned, meaning, .. } } in rows {
            let key = if group.is_empty() { range.name.to_owned() } else { format!("{group}.{}", range.name) };
            let accepted =
                if unit.is_empty() { "true, false".to_owned() } else { format!("{:?} to {:?}", range.min, range.max) };
            let (tuned, meaning) = (if tuned { "yes" } else { "" }, meaning.replace('|', "\\|"));
            let values = values.join("` | `");
            writeln!(page, "| `{name}` | `{key}` | {unit} | {accepted} | `{values}` | {tuned} | {meaning} |").unwrap();
        }
    }
    page
}

#[test]
fn the_page_lists_what_is_declared() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/parameters.md");
    let declared = page();
    if std::env::var_os("WRITE").is_some() {
        fs::write(&path, &declared).unwrap();
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    for (written, declared) in written.lines().zip(declared.lines()) {
        assert_eq!(written, declared, "run WRITE=1 cargo test -p flight-tests --test parameters");
    }
    assert_eq!(written, declared, "run WRITE=1 cargo test -p flight-tests --test parameters");
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

/// A key ends in its unit, unless it is one of the paper's letters.
#[test]
fn a_key_ends_in_its_unit() {
    const LETTERS: [&str; 3] = ["alpha1", "sigma", "lyapunov"];
    for Row { name, declaration: Declaration { range, unit, .. }, .. } in groups().into_iter().flat_map(|g| g.rows) {
        let ending: String = unit.to_lowercase().replace([' ', '/'], "_");
        // "1/s" is "_1_s"; a plain number "1" has no ending.
        let has_unit = !["1", ""].contains(&unit) && !LETTERS.contains(&range.name);
        // A unit that depends on the axis is left out.
        let has_unit = has_unit && !unit.contains("input") && !unit.contains(" or ");
        assert!(!has_unit || range.name.ends_with(&format!("_{ending}")), "{name}: {} in {unit}", range.name);
    }
}

#[test]
fn every_default_is_accepted() {
    for Group { title, valid, .. } in groups() {
        assert!(valid.iter().all(Result::is_ok), "{title}: {valid:?}");
    }
}
