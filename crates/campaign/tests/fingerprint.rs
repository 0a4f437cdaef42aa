//! Tests of a campaign's fingerprint: every key of its files changes it, and nothing else does. The keys come from the
//! examples in the documents and from the declarations. The readers' own lists of keys show whether one is missing
//! here.

#![expect(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use afbc::Profile;
use afbc_campaign::{self as campaign, Campaign, Manifest, NamedTrajectory, Shard, Spread};
use afbc_files::read::words;
use afbc_plant::instruments::{AccelerometerModel, GyroscopeModel, ImuModel};
use afbc_scenario::Scenario;
use afbc_scenario::contender::{Contender, ControllerKind, Law};
use afbc_types::{Axis, Declaration, Declared, DeclaredValue, Mounting, Parameters};
use afbc_vehicles::Vehicle;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Reads a file of one kind and returns the fingerprint of a campaign with it.
type Read = fn(&str) -> Result<String, String>;

fn fingerprint(campaign: &Campaign) -> String {
    Manifest::new(campaign, Shard::WHOLE).fingerprint
}

/// Returns a campaign of `scenario` along the scenario's own reference.
fn of(scenario: Scenario) -> Campaign {
    let plain = campaign::parse("f", "flights = 1\nscenario = \"hover\"", "f", Path::new("")).unwrap();
    let Scenario { trajectory, initial, .. } = scenario.clone();
    Campaign { trajectories: vec![NamedTrajectory { name: "own".into(), trajectory, initial }], scenario, ..plain }
}

fn campaign_file(text: &str) -> Result<String, String> {
    let campaign = campaign::parse("f", text, "f", Path::new("")).map_err(|error| error.to_string())?;
    Ok(fingerprint(&campaign))
}

/// Returns the fingerprint of a scenario file. An example without a trajectory gets one; an example that has only other
/// instruments gets an inertial sensor.
fn scenario_file(text: &str) -> Result<String, String> {
    let hover = "\n[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
    let added = if text.contains("[trajectory]") { "" } else { hover };
    let alone = text.contains("[instruments.") && !text.contains("[instruments.imu");
    let imu = if alone { "\n[instruments.imu]\n" } else { "" };
    // An example may name a vehicle file. The file lies beside this path.
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenario/tests/f");
    let scenario =
        afbc_scenario::parse(file, &format!("{text}{added}{imu}"), "f").map_err(|error| error.to_string())?;
    Ok(fingerprint(&of(scenario)))
}

/// Returns the fingerprint of a scenario under every law, on the vehicle of the file.
fn vehicle_file(text: &str) -> Result<String, String> {
    let vehicle = afbc_vehicles::parse("f", text, "f").map_err(|error| error.to_string())?;
    on(&vehicle).map(|campaign| fingerprint(&campaign))
}

fn on(vehicle: &Vehicle) -> Result<Campaign, String> {
    let laws = ControllerKind::ALL.map(|kind| format!("\"{}\"", kind.name())).join(", ");
    let text = format!("controllers = [{laws}]\n[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n");
    let scenario = afbc_scenario::parse("f", &text, "f").unwrap();
    scenario.on(vehicle, Profile::Flight).map(of).map_err(|error| error.to_string())
}

/// A value of a file that is neither a list nor a table.
struct Leaf {
    /// Dotted name of the value's table, without list indices.
    table: String,
    key: String,
    at: Range<usize>,
    /// True if the value is not an item of a list.
    alone: bool,
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    Number,
    Switch,
    Text,
}

fn join(table: &str, key: &str) -> String {
    if table.is_empty() { key.into() } else { format!("{table}.{key}") }
}

/// Values, tables and keys of a file.
#[derive(Default)]
struct Parts {
    leaves: Vec<Leaf>,
    /// Dotted name of each table, and the range of its text.
    tables: Vec<(String, Range<usize>)>,
    /// Keys of each table.
    keys: BTreeMap<String, BTreeSet<String>>,
}

impl Parts {
    fn of(text: &str) -> Self {
        let mut parts = Parts::default();
        parts.table("", DeTable::parse(text).unwrap().get_ref());
        parts
    }

    fn table(&mut self, path: &str, entries: &DeTable<'_>) {
        for (key, entry) in entries {
            let key = key.get_ref().to_string();
            self.keys.entry(path.into()).or_default().insert(key.clone());
            self.value(path, &key, entry, true);
        }
    }

    fn value(&mut self, path: &str, key: &str, entry: &Spanned<DeValue<'_>>, alone: bool) {
        let kind = match entry.get_ref() {
            DeValue::Table(entries) => {
                self.tables.push((join(path, key), entry.span()));
                return self.table(&join(path, key), entries);
            }
            DeValue::Array(items) => return items.iter().for_each(|item| self.value(path, key, item, false)),
            DeValue::Integer(_) | DeValue::Float(_) => Kind::Number,
            DeValue::Boolean(_) => Kind::Switch,
            DeValue::String(_) => Kind::Text,
            DeValue::Datetime(_) => unreachable!("no file has a time"),
        };
        self.leaves.push(Leaf { table: path.into(), key: key.into(), at: entry.span(), alone, kind });
    }
}

fn with(text: &str, at: &Range<usize>, new: &str) -> String {
    format!("{}{new}{}", &text[..at.start], &text[at.end..])
}

/// Returns other values to try for a leaf. The reader may refuse some of them.
fn others(text: &str, leaf: &Leaf, read: Read) -> Vec<String> {
    let old = &text[leaf.at.clone()];
    match leaf.kind {
        Kind::Switch => vec![(old != "true").to_string()],
        Kind::Number => {
            let number: f64 = old.replace('_', "").parse().unwrap();
            let near = [1.01, 0.99, 1.001, 0.999, 1.2, 0.8].map(|factor| number * factor);
            let beside = [0.01, -0.01, 1.0, -1.0].map(|more| number + more);
            let others = near.into_iter().chain(beside).filter(|other| *other != number);
            others.map(|number| format!("{number:?}")).collect()
        }
        Kind::Text => {
            let unknown = read(&with(text, &leaf.at, "\"other-one\""));
            let names = unknown.err().unwrap_or_default();
            // The error lists the accepted names. A text may also name a built-in vehicle or scenario.
            let listed = names.split('"').skip(1).step_by(2).map(str::to_owned);
            let vehicles = afbc_vehicles::BUILT_IN.iter().map(|known| known.name.to_owned());
            let scenarios = afbc_scenario::BUILT_IN.iter().map(|known| known.name.to_owned());
            let all = listed.chain(vehicles).chain(scenarios).filter(|name| format!("\"{name}\"") != old);
            all.map(|name| format!("\"{name}\"")).collect()
        }
    }
}

/// True for keys that only name or describe a campaign, scenario or vehicle.
fn is_title(leaf: &Leaf) -> bool {
    ["", "scenario"].contains(&leaf.table.as_str()) && ["name", "description"].contains(&leaf.key.as_str())
}

/// Figures of the inertial sensor in a vehicle's file that the estimator does not use.
const UNUSED: [(&str, &str); 2] = [("imu.gyro", "cutoff_hz"), ("imu.accel", "cutoff_hz")];

/// Changes each value of `text`, checks that this changes the fingerprint, and returns the keys of each table.
fn each_value_counts(text: &str, read: Read) -> BTreeMap<String, BTreeSet<String>> {
    let plain = read(text).unwrap_or_else(|error| panic!("{error} in\n{text}"));
    let Parts { leaves, keys, .. } = Parts::of(text);
    for leaf in &leaves {
        let what = || format!("{} in\n{text}", join(&leaf.table, &leaf.key));
        let accepted = others(text, leaf, read).into_iter().find_map(|other| {
            let changed = with(text, &leaf.at, &other);
            read(&changed).ok().map(|fingerprint| (other, fingerprint))
        });
        match accepted {
            Some((other, fingerprint)) if is_title(leaf) => assert_eq!(fingerprint, plain, "{other}: {}", what()),
            Some((_, fingerprint)) if UNUSED.contains(&(&*leaf.table, &*leaf.key)) => {
                assert_eq!(fingerprint, plain, "it counts: {}", what());
            }
            Some((other, fingerprint)) => assert_ne!(fingerprint, plain, "{other} counts for nothing: {}", what()),
            // No other value may be accepted: another kind needs other keys, a name may be listed already, a switch may
            // only be true.
            None => assert!(matches!(leaf.kind, Kind::Text | Kind::Switch), "no other value of {}", what()),
        }
    }
    keys
}

/// Adds the keys that the reader says it knows in each table of `text` to `known`.
fn ask_for_keys(text: &str, read: Read, known: &mut BTreeMap<String, BTreeSet<String>>) {
    const STRANGE: &str = "q9w8q9w8q9w8";
    let Parts { leaves, keys, tables } = Parts::of(text);
    for path in keys.keys().map(String::as_str).chain([""]) {
        // An unknown key is tried after a value, after a header, at the end of an inline table, and under a new header.
        let after = leaves.iter().filter(|leaf| leaf.table == path && leaf.alone).map(|leaf| leaf.at.end);
        let inside = tables.iter().filter(|(table, _)| table == path).flat_map(|(_, at)| [at.end, at.end - 1]);
        let gaps = |at| ["\n", ", "].map(|gap| with(text, &(at..at), &format!("{gap}{STRANGE} = 1")));
        let beside = after.chain(inside).flat_map(gaps);
        let headed = [format!("{text}\n[{path}]\n{STRANGE} = 1\n"), format!("{STRANGE} = 1\n{text}")];
        let own = format!("{}: unknown key; known here: ", join(path, STRANGE));
        // A table of dotted keys gets the unknown key beside a value of its parent.
        let (parent, key) = path.rsplit_once('.').unwrap_or(("", path));
        let parents = leaves.iter().filter(|leaf| leaf.table == parent && leaf.alone).map(|leaf| leaf.at.end);
        let dotted = parents.map(|at| with(text, &(at..at), &format!("\n{key}.{STRANGE} = 1")));
        let errors: Vec<_> = beside.chain(headed).chain(dotted).map(|text| read(&text).unwrap_err()).collect();
        let reported = errors.iter().find_map(|error| Some(error.split_once(&own)?.1));
        let reported = reported.unwrap_or_else(|| panic!("[{path}] has any key, {errors:?}, in\n{text}"));
        known.entry(path.into()).or_default().extend(reported.split(", ").map(str::to_owned));
    }
}

/// Keys that the readers know only to refuse them, since their values come from elsewhere.
const REFUSED: [(&str, &str); 4] = [
    ("rotors", "max_rad_s"),
    ("gains.flight.cascade", "dt_s"),
    ("gains.flight.cascade", "rotor_force_max_n"),
    ("estimator", "gravity_m_s2"),
];

/// Changes every value of every text, and checks that each key known to the reader is in at least one text.
fn each_key_counts<'t>(texts: impl IntoIterator<Item = &'t str>, read: Read) {
    let (mut known, mut seen) = (BTreeMap::new(), BTreeMap::<String, BTreeSet<String>>::new());
    for text in texts {
        for (table, keys) in each_value_counts(text, read) {
            seen.entry(table).or_default().extend(keys);
        }
        ask_for_keys(text, read, &mut known);
    }
    let none = BTreeSet::new();
    let unseen = known.iter().flat_map(|(table, keys)| {
        let unseen = keys.difference(seen.get(table).unwrap_or(&none)).map(String::as_str);
        unseen.map(|key| (table.as_str(), key)).filter(|key| !REFUSED.contains(key))
    });
    let missing: Vec<_> = unseen.map(|(table, key)| join(table, key)).collect();
    assert!(missing.is_empty(), "no text here has {missing:?}");
}

/// Returns the declared parameters of a group as lines of a file, with their values.
fn lines(parameters: &impl Declared, group: &str) -> String {
    let mut lines = String::new();
    let Ok(()) = parameters.visit(&mut |declaration: &Declaration, value: DeclaredValue<'_>| {
        if declaration.group == group {
            writeln!(lines, "{} = {}", declaration.range.name, words::value(&value)).unwrap();
        }
        Ok::<(), Infallible>(())
    });
    lines
}

/// Returns the TOML examples of a page.
fn examples(page: &'static str) -> Vec<&'static str> {
    page.split("```toml\n").skip(1).map(|part| part.split("```").next().unwrap()).collect()
}

/// Returns the groups of gains of a law: the axes for a law in the cascade, one unnamed group for others.
fn groups(kind: ControllerKind) -> Vec<&'static str> {
    if kind.in_cascade() { Axis::ALL.map(Axis::name).to_vec() } else { vec![""] }
}

/// Returns the parameters as lines, except the keys in `elsewhere`, which the file must not set.
fn lines_but(elsewhere: &[&str], parameters: &impl Declared, group: &str) -> String {
    let all = lines(parameters, group);
    all.lines()
        .filter(|line| !elsewhere.iter().any(|key| line.starts_with(key)))
        .map(|line| format!("{line}\n"))
        .collect()
}

#[test]
fn every_key_of_a_scenario_file_counts() {
    // These texts add alternatives that the page's examples leave out.
    let mut contenders = String::new();
    for kind in ControllerKind::ALL {
        let Contender { law, settings, .. } = Contender::of(kind, Profile::Flight);
        let name = kind.name();
        writeln!(contenders, "[[contender]]\nname = \"my {name}\"\ncontroller = \"{name}\"").unwrap();
        for group in groups(kind) {
            let path = format!("contender.gains.{group}");
            writeln!(contenders, "[{}]\n{}", path.trim_end_matches('.'), lines(&law, group)).unwrap();
        }
        writeln!(contenders, "[contender.settings]\n{}", lines_but(&["dt_s"], &settings, "")).unwrap();
        writeln!(contenders, "[contender.limits]\n{}", lines(&settings, "limits")).unwrap();
    }
    let afbc = Law::of(ControllerKind::Afbc, Profile::Flight);
    let gains: String =
        Axis::ALL.map(|axis| format!("[gains.{}]\n{}", axis.name(), lines(&afbc, axis.name()))).concat();
    let truth = format!("[truth]\n{}", lines(&Parameters::PAPER, ""));
    let parts = "[instruments]\nimu = \"bmi270\"\ntracker = { part = \"mocap-100\" }\ngnss = { part = \"m10\" }\n\
                 barometer = { part = \"bmp388\" }\nmagnetometer = { part = \"qmc5883l\" }\n";
    let circle = "[trajectory]\nkind = \"circle\"\ncentre_m = [0, 0, 2]\nradius_m = 2.0\nacceleration_m_s2 = 1.0\n";
    let vehicle = "flight_core = true\n[vehicle]\nname = \"iris\"\n";
    let page = examples(include_str!("../../../docs/reference/scenario-keys.md"));
    each_key_counts(page.into_iter().chain([&contenders, &gains, &truth, parts, circle, vehicle]), scenario_file);
}

#[test]
fn every_key_of_a_vehicle_file_counts() {
    let racer = afbc_vehicles::built_in("racer").unwrap();
    let vehicle = racer.read().unwrap();
    // These keys add what this file leaves out.
    let bare = racer.text.split("# Gains found by").next().unwrap();
    let mut all = format!("name = \"racer\"\n{bare}\n");
    for (table, keys) in [
        ("[vehicle]\n", "gravity_m_s2 = 9.8\n"),
        ("[rotors]\n", "delay_s = 0.001\nstart = \"hover\"\n"),
        ("[battery]\n", "initial_charge = 0.9\n"),
        ("[drag]\n", "air_density_kg_m3 = 1.2\n"),
        ("[ground]\n", "sink_m = 0.004\ndamping_ratio = 0.6\nfriction = 0.5\nground_effect = true\n"),
    ] {
        all = all.replace(table, &format!("{table}{keys}"));
    }
    write!(all, "[arming]\n{}[guidance]\n{}", lines(&vehicle.arming, ""), lines(&vehicle.guidance, "")).unwrap();
    write!(all, "[estimator]\n{}", lines_but(&["gravity_m_s2"], &vehicle.estimation, "")).unwrap();
    for kind in ControllerKind::ALL {
        let law = Law::on(kind, &vehicle, Profile::Flight).unwrap();
        for group in groups(kind) {
            let path = format!("gains.flight.{}.{group}", kind.name());
            write!(all, "[{}]\n{}", path.trim_end_matches('.'), lines(&law, group)).unwrap();
        }
    }
    let settings = vehicle.settings(Profile::Flight);
    let cascade = lines_but(&["dt_s", "rotor_force_max_n"], &settings, "") + &lines(&settings, "limits");
    write!(all, "[gains.flight.cascade]\n{cascade}").unwrap();
    // With a named part, the estimator's settings follow from the part unless the file states them.
    let part = bare.replace("[imu]\n", "[imu]\npart = \"bmi270\"\n");
    let imu = ImuModel::PRESETS[0].settings;
    // These errors are large enough to stand out from the other errors, and from the least accepted value.
    let gyro = GyroscopeModel { vibration_rad_s: 0.02, bias_rad_s: 0.1, ..imu.gyro };
    let accel = AccelerometerModel { vibration_m_s2: 0.5, lsb_m_s2: 0.5, ..imu.accel };
    let imu = ImuModel { gyro, accel, ..imu };
    let mut figures = bare.replace("[imu]\n", &format!("[imu]\n{}", lines_but(&["lever_m"], &imu, "")));
    write!(figures, "[imu.gyro]\n{}[imu.accel]\n{}", lines(&imu, "gyro"), lines(&imu, "accel")).unwrap();
    let texts = afbc_vehicles::BUILT_IN.iter().map(|known| known.text);
    each_key_counts(texts.chain([all.as_str(), &part, &figures]), vehicle_file);
}

#[test]
fn every_key_of_a_campaign_file_counts() {
    // The file varies all quantities that apply to a measured state, or to an estimated one.
    let spread = |estimated: bool| -> String {
        let mut spread = String::from("[spread]\n");
        for quantity in &campaign::QUANTITIES {
            let afbc_types::Range { name, min, max } = quantity.range;
            let ends = if quantity.whole { [min, min + 1.0] } else { [0.8, 0.9].map(|share| share * max.min(1.0)) };
            let of_state =
                ["sensor_delay_s", "noise_ratio", "bias_ratio"].contains(&name) || name.starts_with("dropout");
            let of_estimate = ["tracker_", "gnss_", "imu_", "vibration", "barometer_", "magnetometer_", "aiding"];
            let of_estimate = of_estimate.iter().any(|start| name.starts_with(start));
            if if estimated { !of_state } else { !of_estimate } {
                writeln!(spread, "{name} = {ends:?}").unwrap();
            }
        }
        spread
    };
    let head = "name = \"n\"\ndescription = \"d\"\nflights = 2\nseed = 1\nduration_s = 9.0\n";
    let state = "[scenario]\ncontrollers = [\"pid\"]\ndrag = {}\nsensors = { noise = 0.001, bias = 0.001 }\n\
                 trajectory = { kind = \"hover\", position_m = [0, 0, 1] }\n";
    let estimate = "[scenario]\ncontrollers = [\"pid\"]\ndrag = {}\n\
                    trajectory = { kind = \"hover\", position_m = [0, 0, 1] }\n\
                    [scenario.instruments]\ntracker = \"mocap-100\"\ngnss = \"m10\"\nbarometer = \"dps310\"\n\
                    magnetometer = \"ist8310\"\n[scenario.instruments.imu]\ngyro = { vibration_rad_s = 0.02 }\n";
    let texts = [format!("{head}{}{state}", spread(false)), format!("{head}{}{estimate}", spread(true))];
    let [page, ..] = examples(include_str!("../../../docs/campaigns.md")).try_into().unwrap_or([""; 1]);
    let (mut known, mut seen) = (BTreeMap::new(), BTreeSet::new());
    for text in texts.iter().map(String::as_str).chain([page]) {
        for (table, keys) in each_value_counts(text, campaign_file) {
            seen.extend(keys.iter().map(|key| join(&table, key)));
        }
        ask_for_keys(text, campaign_file, &mut known);
    }
    // The tests above cover the keys of a scenario.
    for (table, keys) in known.iter().filter(|(table, _)| !table.starts_with("scenario")) {
        for key in keys {
            assert!(seen.contains(&join(table, key)), "no text here has {}", join(table, key));
        }
    }
}

/// A fingerprint does not depend on file names, comments or the order of keys.
#[test]
fn comments_order_and_names_do_not_count() {
    let iris = afbc_vehicles::built_in("iris").unwrap().text;
    let vehicle = |file, text: &str, name| fingerprint(&on(&afbc_vehicles::parse(file, text, name).unwrap()).unwrap());
    let plain = vehicle("iris.toml", iris, "iris");
    assert_eq!(plain, vehicle("/elsewhere/mine.toml", iris, "mine"));
    assert_eq!(plain, vehicle("iris.toml", &reversed(iris), "iris"));
    assert_eq!(plain, vehicle("iris.toml", &format!("# another comment\n{iris}\n# and one more\n"), "iris"));

    let text = afbc_scenario::built_in("storm").unwrap().text;
    let scenario = |file, text: &str, name| fingerprint(&of(afbc_scenario::parse(file, text, name).unwrap()));
    let plain = scenario("storm.toml", text, "storm");
    let unnamed = text.replace("name = \"storm\"\n", "");
    assert_eq!(plain, scenario("/elsewhere/mine.toml", &unnamed, "mine"));
    assert_eq!(plain, scenario("storm.toml", &reversed(text), "storm"));

    let text = campaign::built_in("estimation").unwrap().text;
    let campaign = |file, text: &str, name| fingerprint(&campaign::parse(file, text, name, Path::new("")).unwrap());
    let plain = campaign("estimation.toml", text, "estimation");
    let unnamed = text.replace("name = \"estimation\"\n", "");
    assert_eq!(plain, campaign("/elsewhere/mine.toml", &unnamed, "mine"));
    assert_eq!(plain, campaign("estimation.toml", &reversed(text), "estimation"));
}

/// Returns the same file without comments, with its keys and tables in reverse order. Lists keep their order.
fn reversed(text: &str) -> String {
    fn value(entry: &DeValue<'_>) -> String {
        match entry {
            DeValue::Table(entries) => {
                let mut pairs: Vec<_> = entries
                    .iter()
                    .map(|(key, entry)| (key.span().start, format!("{} = {}", key.get_ref(), value(entry.get_ref()))))
                    .collect();
                pairs.sort();
                let pairs: Vec<_> = pairs.into_iter().rev().map(|(_, pair)| pair).collect();
                format!("{{ {} }}", pairs.join(", "))
            }
            DeValue::Array(items) => {
                format!("[{}]", items.iter().map(|item| value(item.get_ref())).collect::<Vec<_>>().join(", "))
            }
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.as_str().to_owned(),
            DeValue::Boolean(switch) => switch.to_string(),
            DeValue::String(text) => format!("{:?}", text.as_ref()),
            DeValue::Datetime(_) => unreachable!("no file has a time"),
        }
    }
    let document = DeTable::parse(text).unwrap();
    let mut entries: Vec<_> = document.get_ref().iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries.into_iter().rev().map(|(key, entry)| format!("{} = {}\n", key.get_ref(), value(entry.get_ref()))).collect()
}

/// The smallest change of a number changes the fingerprint.
#[test]
fn numbers_count_to_the_last_bit() {
    let base = campaign::built_in("robustness").unwrap().read().unwrap();
    let plain = fingerprint(&base);
    let changed = |change: &dyn Fn(&mut Campaign)| {
        let mut campaign = base.clone();
        change(&mut campaign);
        assert_ne!(fingerprint(&campaign), plain);
    };
    changed(&|it| it.scenario.vehicle.mass_kg = it.scenario.vehicle.mass_kg.next_up());
    changed(&|it| it.scenario.realism.rotors.delay_s = -0.0);
    changed(&|it| {
        it.trajectories.iter_mut().for_each(|trajectory| trajectory.initial.position_m.x += f64::MIN_POSITIVE)
    });
    changed(&|it| it.spreads.iter_mut().for_each(|Spread { ends, .. }| ends[1] = ends[1].next_down()));
    changed(&|it| {
        let settings = &mut it.scenario.contenders[0].settings;
        settings.common.rotor_force_max_n = settings.common.rotor_force_max_n.next_up();
    });
    // This includes numbers of the vehicle's file, such as the position of its inertial sensor.
    let mut vehicle = afbc_vehicles::built_in("iris").unwrap().read().unwrap();
    let plain = fingerprint(&on(&vehicle).unwrap());
    let position_m = Vector3::new(0.0, 0.0, f64::MIN_POSITIVE);
    vehicle.imu = Mounting { position_m, ..vehicle.imu };
    assert_ne!(fingerprint(&on(&vehicle).unwrap()), plain);
}
