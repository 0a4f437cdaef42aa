//! The files of `vehicles/`: each vehicle is physically possible and has enough thrust, each value has a source, and
//! the figures of `docs/vehicles.md` follow from the values.

use afbc::guarded::HOVER_AUTHORITY;
use afbc_control::mixer::HOVER_MARGIN;
use afbc_types::Parameters;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use toml::de::{DeTable, DeValue};

const GRAVITY_M_S2: f64 = 9.81;

struct Vehicle {
    text: String,
    /// Every value by path: `vehicle.mass_kg`, `rotor.0.position_m.1`.
    values: BTreeMap<String, String>,
}

/// Adds every value below `value` to `values`.
fn flatten(path: &str, value: &DeValue<'_>, values: &mut BTreeMap<String, String>) {
    let mut inner = |key: &str, value: &DeValue<'_>| flatten(&format!("{path}.{key}"), value, values);
    match value {
        DeValue::Table(table) => table.iter().for_each(|(key, value)| inner(key.get_ref(), value.get_ref())),
        DeValue::Array(array) => array.iter().enumerate().for_each(|(i, value)| inner(&i.to_string(), value.get_ref())),
        DeValue::Float(float) => drop(values.insert(path[1..].to_owned(), float.as_str().to_owned())),
        DeValue::String(text) => drop(values.insert(path[1..].to_owned(), text.to_string())),
        // Numbers must be written with a decimal point.
        other => panic!("{path}: {other:?}"),
    }
}

impl Vehicle {
    fn at(&self, path: &str) -> f64 {
        self.values[path].parse().unwrap()
    }

    fn number(&self, table: &str, key: &str) -> f64 {
        self.at(&format!("{table}.{key}"))
    }

    fn vector(&self, path: &str) -> Vector3<f64> {
        Vector3::from_fn(|i, _| self.at(&format!("{path}.{i}")))
    }

    fn inertia_kg_m2(&self) -> Vector3<f64> {
        self.vector("vehicle.inertia_kg_m2")
    }

    /// Returns position and spin of each rotor.
    fn rotors(&self) -> Vec<(Vector3<f64>, f64)> {
        let spins = (0..).map_while(|i| Some((i, self.values.get(&format!("rotor.{i}.spin"))?.as_str())));
        let rotor = |(i, spin)| {
            let spin = match spin {
                "ccw" => 1.0,
                "cw" => -1.0,
                _ => panic!("spin {spin}"),
            };
            (self.vector(&format!("rotor.{i}.position_m")), spin)
        };
        spins.map(rotor).collect()
    }

    /// Returns the force of each rotor in hover, if all are equal \[N\].
    fn hover_n(&self) -> f64 {
        self.number("vehicle", "mass_kg") * GRAVITY_M_S2 / self.rotors().len() as f64
    }

    fn hover_rad_s(&self) -> f64 {
        (self.hover_n() / self.number("vehicle", "thrust_factor_n_s2")).sqrt()
    }

    fn thrust_to_weight(&self) -> f64 {
        self.number("rotors", "force_max_n") / self.hover_n()
    }

    /// Returns the angular acceleration about each axis, with every rotor using its smaller margin up or down
    /// \[rad/s2\].
    fn authority_rad_s2(&self) -> Vector3<f64> {
        let room_n = self.hover_n().min(self.number("rotors", "force_max_n") - self.hover_n());
        let lever = self.number("vehicle", "drag_factor_n_m_s2") / self.number("vehicle", "thrust_factor_n_s2");
        let levers: Vector3<f64> =
            self.rotors().iter().map(|(at, _)| Vector3::new(at.y.abs(), at.x.abs(), lever)).sum();
        (levers * room_n).component_div(&self.inertia_kg_m2())
    }

    /// Returns the shaft power in hover \[W\].
    fn hover_w(&self) -> f64 {
        let drag = self.number("vehicle", "drag_factor_n_m_s2");
        self.rotors().len() as f64 * drag * self.hover_rad_s().powi(3)
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns every file of `vehicles/`, by name.
fn vehicles() -> BTreeMap<String, Vehicle> {
    let files = fs::read_dir(root().join("vehicles")).unwrap().map(|entry| entry.unwrap().path());
    let vehicle = |path: std::path::PathBuf| {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        assert_eq!(path.extension().unwrap(), "toml", "{name}");
        let text = fs::read_to_string(&path).unwrap();
        let table = DeTable::parse(&text).unwrap_or_else(|error| panic!("{name}: {error}")).into_inner();
        let mut values = BTreeMap::new();
        flatten("", &DeValue::Table(table), &mut values);
        (name, Vehicle { text, values })
    };
    files.map(vehicle).collect()
}

#[test]
fn the_papers_vehicle_is_the_papers() {
    let vehicles = vehicles();
    let number = |key| vehicles["paper"].number("vehicle", key);
    assert_eq!(
        Parameters::PAPER,
        Parameters {
            mass_kg: number("mass_kg"),
            arm_m: number("arm_m"),
            inertia_kg_m2: vehicles["paper"].inertia_kg_m2(),
            rotor_inertia_kg_m2: number("rotor_inertia_kg_m2"),
            thrust_factor_n_s2: number("thrust_factor_n_s2"),
            drag_factor_n_m_s2: number("drag_factor_n_m_s2"),
            gravity_m_s2: GRAVITY_M_S2,
        }
    );
    // By `afbc_types`, rotor 1 is at -y, 2 at +x, 3 at +y, 4 at -x. Rotors 1 and 3 yaw the body positively, against
    // their spin.
    let frame: Vec<_> = vehicles["paper"].rotors().iter().map(|(at, spin)| (at.x, at.y, *spin)).collect();
    assert_eq!(frame, [(0.0, -0.25, -1.0), (0.25, 0.0, 1.0), (0.0, 0.25, -1.0), (-0.25, 0.0, 1.0)]);
}

#[test]
fn each_could_exist() {
    for (name, vehicle) in vehicles() {
        let (rotors, i) = (vehicle.rotors(), vehicle.inertia_kg_m2());
        assert!((4..=8).contains(&rotors.len()), "{name}: {} rotors", rotors.len());
        // With equal rotor forces the vehicle hovers without a moment.
        let centre: Vector3<f64> = rotors.iter().map(|(at, _)| at).sum();
        assert!(centre.xy().norm() < 1e-9, "{name}: {centre}");
        assert_eq!(rotors.iter().map(|(_, spin)| spin).sum::<f64>(), 0.0, "{name}: spin");
        let arms_m: Vec<_> = rotors.iter().map(|(at, _)| at.xy().norm()).collect();
        let (mean_m, max_m) =
            (arms_m.iter().sum::<f64>() / arms_m.len() as f64, arms_m.iter().fold(0.0, |a, b| b.max(a)));
        let mass_kg = vehicle.number("vehicle", "mass_kg");
        assert!((mean_m / vehicle.number("vehicle", "arm_m") - 1.0).abs() < 1e-3, "{name}: arm {mean_m}");
        // No moment of inertia exceeds the sum of the others, and some of the mass is not at the rotors.
        assert!(i.min() > 0.0 && 2.0 * i.max() <= i.sum() * 1.0001, "{name}: {i}");
        assert!(i.z < mass_kg * max_m * max_m, "{name}: {}", i.z);
        // Full throttle reaches the largest force.
        let (force_max_n, b) =
            (vehicle.number("rotors", "force_max_n"), vehicle.number("vehicle", "thrust_factor_n_s2"));
        let full_rad_s = vehicle.number("motor", "speed_max_rad_s");
        assert!(b * full_rad_s * full_rad_s > 0.999 * force_max_n, "{name}: {full_rad_s} rad/s");
        // The battery can supply the rotors at their largest force.
        let shaft_w = vehicle.hover_w() * vehicle.thrust_to_weight().powf(1.5);
        let taken_w = shaft_w / vehicle.number("battery", "efficiency") + vehicle.number("battery", "avionics_w");
        let given_w = vehicle.number("battery", "full_v").powi(2) / (4.0 * vehicle.number("battery", "resistance_ohm"));
        assert!(taken_w < given_w, "{name}: {taken_w} W of {given_w} W");
    }
}

#[test]
fn each_flies_with_margin() {
    for (name, vehicle) in vehicles() {
        assert!(vehicle.thrust_to_weight() > f64::from(HOVER_MARGIN), "{name}: {}", vehicle.thrust_to_weight());
        let authority = vehicle.authority_rad_s2();
        HOVER_AUTHORITY.check(authority.x.min(authority.y)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let idle_rad_s = vehicle.values.get("rotors.min_rad_s").map_or(0.0, |value| value.parse().unwrap());
        assert!(idle_rad_s < 0.5 * vehicle.hover_rad_s(), "{name}: {idle_rad_s} rad/s");
    }
}

/// Each value's line names a source listed at the top of the file, or says that the value is estimated or follows from
/// others. A comment above it in the same paragraph may do so instead.
#[test]
fn each_says_where_its_parameters_come_from() {
    for (name, vehicle) in vehicles() {
        let listed = |letter: char| vehicle.text.contains(&format!("\n# [{letter}]  "));
        let is_source = |comment: &str| {
            let cited = ('A'..='Z').filter(|letter| comment.contains(&format!("[{letter}]"))).collect::<Vec<_>>();
            assert!(cited.iter().all(|letter| listed(*letter)), "{name}: {comment}");
            let words = [
                "stimated",
                "he paper",
                "what force_max_n takes",
                "of the places below",
                "as sold",
                "manufacturer",
                "brushed",
            ];
            !cited.is_empty() || words.iter().any(|word| comment.contains(word))
        };
        let mut values = 0;
        // Gains found by a search come last, and their own comment says so.
        let text = vehicle.text.split("# Gains found by").next().unwrap();
        for paragraph in text.split("\n\n").filter(|paragraph| !paragraph.contains("description = ")) {
            // The rotors' sources are above the first rotor.
            let mut above = paragraph.starts_with("[[rotor]]");
            for line in paragraph.lines() {
                if line.starts_with('#') {
                    above |= is_source(line);
                } else if line.contains(" = ") {
                    assert!(
                        above || line.split_once('#').is_some_and(|(_, comment)| is_source(comment)),
                        "{name}: {line}"
                    );
                    values += 1;
                }
            }
        }
        assert!(values >= 30, "{name}: {values} values");
    }
}

#[test]
fn the_figures_are_those_on_the_page() {
    let page = include_str!("../../docs/vehicles.md");
    let figures = page.lines().skip_while(|line| !line.contains("--:|")).skip(1).take_while(|line| !line.is_empty());
    let cells = |line: &'static str| line.strip_prefix("| `")?.split_once("` | ");
    let mut rows: BTreeMap<_, _> = figures.map(|line| cells(line).unwrap()).collect();
    for (name, vehicle) in vehicles() {
        let number = |key| vehicle.number("vehicle", key);
        let [x, y, z]: [f64; 3] = vehicle.authority_rad_s2().into();
        let (hover, most) = (vehicle.hover_rad_s(), vehicle.number("rotors", "force_max_n"));
        let row = format!(
            "{} | {} | {} | {:.0} | {hover:.0} | {:.0} | {:.2} | {x:.0} | {y:.0} | {z:.1} | {:.0} |",
            number("mass_kg"),
            number("arm_m"),
            vehicle.rotors().len(),
            1e3 * vehicle.number("rotors", "time_constant_s"),
            (most / number("thrust_factor_n_s2")).sqrt(),
            vehicle.thrust_to_weight(),
            vehicle.hover_w(),
        );
        assert_eq!(rows.remove(name.as_str()), Some(row.as_str()), "{name}");
    }
    assert!(rows.is_empty(), "vehicles without a file: {rows:?}");
}
