//! Every declared parameter: `docs/parameters.md` lists them, and their names serve a ground station for good.
//!
//! `WRITE=1 cargo test -p flight-tests --test parameters` writes the page.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::Curve;
use afbc_peers::{geometric, indi, pid};
use afbc_plant::{Battery, Contact, Drag, Dropouts, GroundEffect, Rotors, Sensing, Turbulence, Wind};
use afbc_types::{Declaration, Declared, OutOfRange, Parameters, Value};
use core::convert::Infallible;
use core::fmt::Write;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// One parameter, or one number of a vector.
struct Row {
    name: String,
    default: String,
    declaration: Declaration,
}

/// Parameters that share a prefix.
struct Group {
    title: &'static str,
    prefix: &'static str,
    rows: Vec<Row>,
    /// Whether the defaults are in range.
    valid: Result<(), OutOfRange>,
}

fn group(title: &'static str, prefix: &'static str, parameters: impl Declared) -> Group {
    let mut rows = Vec::new();
    let Ok(()) = parameters.visit(&mut |declaration, value| {
        let defaults: Vec<String> = match &value {
            Value::Single(numbers) => numbers.iter().map(|number| format!("{number:?}")).collect(),
            Value::Double(numbers) => numbers.iter().map(|number| format!("{number:?}")).collect(),
            Value::Switch(on) => vec![on.to_string()],
        };
        let coordinates = if defaults.len() == 1 { vec![None] } else { vec![Some('X'), Some('Y'), Some('Z')] };
        for (coordinate, default) in coordinates.into_iter().zip(defaults) {
            let name = declaration.name(prefix, coordinate).to_string();
            rows.push(Row { name, default, declaration: *declaration });
        }
        Ok::<(), Infallible>(())
    });
    Group { title, prefix, rows, valid: parameters.validate() }
}

/// Everything that is declared, in the order of the page.
fn groups() -> Vec<Group> {
    vec![
        group("Vehicle: `[vehicle]`, `[truth]`", "V_", Parameters::DEFAULT),
        group("Motors", "MOT_", Curve::DEFAULT),
        group("Arming", "ARM_", ArmingLimits::DEFAULT),
        group("PID: `[contender.gains]`", "PID_", pid::Gains::DEFAULT),
        group("Geometric: `[contender.gains]`", "GEO_", geometric::Gains::DEFAULT),
        group("INDI: `[contender.gains]`", "INDI_", indi::Gains::DEFAULT),
        group("Simulated rotors: `[rotors]`", "ROT_", Rotors::DEFAULT),
        group("Simulated battery: `[battery]`", "BAT_", Battery::DEFAULT),
        group("Simulated drag: `[drag]`", "DRAG_", Drag::DEFAULT),
        group("Simulated wind: `[wind]`", "WIND_", Wind::DEFAULT),
        group("Simulated turbulence: `[wind.turbulence]`", "TURB_", Turbulence::DEFAULT),
        group("Simulated ground: `[ground]`", "GND_", Contact::DEFAULT),
        group("Simulated ground effect: `[ground]`", "GE_", GroundEffect::DEFAULT),
        group("Simulated sensors: `[sensors]`", "SENS_", Sensing::DEFAULT),
        group("Simulated dropouts: `[sensors.dropouts]`", "DROP_", Dropouts::DEFAULT),
    ]
}

const HEAD: &str = "# Parameters

Every parameter, as the code declares it (`parameters!` in [the types crate](../crates/types/src/declared.rs); how to add
one: [ARCHITECTURE.md](../ARCHITECTURE.md#adding-things)). This page is written from the declarations, and
`tests/tests/parameters.rs` compares it with them:

```sh
WRITE=1 cargo test -p flight-tests --test parameters
```

**Name** is what a parameter is called on a ground station and in flash: its group's prefix, then an axis or a part of the
group, then its id, and X, Y or Z of a vector. It has at most 16 characters, as MAVLink has room for, and stays what it is.
**Key** is its name in [scenario files](scenarios.md). \"Tuned\" are those that `sitl tune` chooses; the others are for the
vehicle and its task to say.
";

fn page() -> String {
    let mut page = HEAD.to_owned();
    for Group { title, prefix, rows, .. } in groups() {
        write!(page, "\n## {title}\n\nPrefix `{prefix}`.\n\n").unwrap();
        page += "| name | key | unit | range | default | tuned | meaning |\n|---|---|---|---|---|---|---|\n";
        for Row { name, default, declaration: Declaration { group, range, unit, tuned, meaning, .. } } in rows {
            let key = if group.is_empty() { range.name.to_owned() } else { format!("{group}.{}", range.name) };
            let accepted =
                if unit.is_empty() { "true, false".to_owned() } else { format!("{:?} to {:?}", range.min, range.max) };
            let (tuned, meaning) = (if tuned { "yes" } else { "" }, meaning.replace('|', "\\|"));
            writeln!(page, "| `{name}` | `{key}` | {unit} | {accepted} | `{default}` | {tuned} | {meaning} |").unwrap();
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
    assert!(names.len() > 40, "{}", names.len());
}

/// A key ends in its unit, so that nobody has to look it up; the paper's letters, and shares of something, have none.
#[test]
fn a_key_ends_in_its_unit() {
    for Row { name, declaration: Declaration { range, unit, .. }, .. } in groups().into_iter().flat_map(|g| g.rows) {
        let ending: String = unit.to_lowercase().replace([' ', '/'], "_");
        // "1/s" is "_1_s", a plain number "1" has no ending.
        let has_unit = !["1", ""].contains(&unit);
        assert!(!has_unit || range.name.ends_with(&format!("_{ending}")), "{name}: {} in {unit}", range.name);
    }
}

#[test]
fn every_default_is_accepted() {
    for Group { title, valid, .. } in groups() {
        assert_eq!(valid, Ok(()), "{title}");
    }
}
