#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test that panics has failed")]

use super::*;
use crate::claims::Claim;
use afbc::Profile;
use afbc_plant::{Environment, Gust, GustKind, PlantModel, PlantParameter, PlantParameterChange};
use afbc_scenario::case::{Case, Reading};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::paper::scenario;
use afbc_scenario::{Scenario, built_in};
use afbc_sim::run::FlightResult;
use nalgebra::Vector3;
use std::collections::{BTreeMap, HashSet};
use std::{fs, io};

/// A separate folder for each test, removed afterwards.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        Scratch(std::env::temp_dir().join(format!("sitl-output-{name}-{}", std::process::id())))
    }

    /// Opens the folder as a command's own.
    fn open(&self) -> Folder {
        Folder::open(&self.0, "test", "it", false).unwrap()
    }

    /// Returns every file by name, except the file that marks the folder's owner.
    fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let entries = fs::read_dir(&self.0).unwrap().map(|entry| entry.unwrap());
        let named = entries.map(|entry| (entry.file_name().into_string().unwrap(), entry.path()));
        let results = named.filter(|(name, _)| !name.starts_with(".sitl."));
        results.map(|(name, path)| (name, fs::read(path).unwrap())).collect()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn fly(scenario: &Scenario, kind: ControllerKind) -> ScenarioFlight {
    ScenarioFlight {
        run: FlightResult::fly(scenario, scenario.contender(kind).unwrap(), 9).unwrap(),
        scenario: scenario.clone(),
    }
}

fn both(scenario: &Scenario) -> Vec<ScenarioFlight> {
    ControllerKind::PAPER.map(|kind| fly(scenario, kind)).into()
}

fn paper(reading: Reading, duration_s: f64) -> Scenario {
    let case = Case { reading: Some(reading), ..Case::DEFAULT };
    Scenario { duration_s, ..scenario(PlantModel::RigidBody, case).unwrap() }
}

fn claims() -> Vec<Claim> {
    vec![
        Claim { statement: "It flies".into(), holds: true, evidence: "it does".into() },
        Claim { statement: "It <swims>".into(), holds: false, evidence: "word ".repeat(60) },
    ]
}

/// Checks that every SVG is well-formed and small; returns their number.
fn check_svgs(files: &BTreeMap<String, Vec<u8>>) -> usize {
    let svgs = files.iter().filter(|(name, _)| name.ends_with(".svg"));
    svgs.inspect(|(name, bytes)| {
        let text = str::from_utf8(bytes).unwrap();
        let svg = roxmltree::Document::parse(text).map_err(|e| format!("{name}: {e}")).unwrap();
        assert_eq!(svg.root_element().tag_name().name(), "svg");
        assert!(bytes.len() < 400_000, "{name}: {} bytes", bytes.len());
        assert!(!text.contains("NaN") && !text.contains("inf\""), "{name}");
    })
    .count()
}

#[test]
fn writes_everything_twice_the_same() {
    let flown = both(&paper(Reading::Persistent, 9.0));
    let (first, second) = (Scratch::new("first"), Scratch::new("second"));
    let paths = write(&first.open(), &flown, &claims()).unwrap();
    write(&second.open(), &flown, &claims()).unwrap();
    // Write a second time over existing files.
    write(&second.open(), &flown, &claims()).unwrap();
    let files = first.files();
    assert_eq!(files, second.files());
    assert_eq!(check_svgs(&files), 5);
    let expected = [
        "fig4-trajectory.svg",
        "fig5-outputs.svg",
        "fig6-attitude.svg",
        "fig7-errors.svg",
        "fig8-inputs.svg",
        "paper-afbc.csv",
        "paper-backstepping.csv",
        "report.html",
        "summary.json",
    ];
    assert_eq!(files.keys().collect::<Vec<_>>(), expected);
    assert_eq!(paths.len(), expected.len());

    let report = str::from_utf8(&files["report.html"]).unwrap();
    assert!(!report.contains("http") && !report.contains("src=") && !report.contains("<link"));
    assert_eq!(report.matches("<svg").count(), 5);
    assert_eq!(report.matches("data-explore=").count(), 5);
    assert!(report.contains("It &lt;swims&gt;"));
}

#[test]
fn csv_holds_every_logged_step() {
    let flown = fly(&paper(Reading::Persistent, 1.0), ControllerKind::Afbc);
    let mut bytes = Vec::new();
    csv::write(&mut bytes, &flown).unwrap();
    let mut reader = ::csv::Reader::from_reader(bytes.as_slice());
    let header = reader.headers().unwrap().clone();
    assert_eq!(header.iter().collect::<HashSet<_>>().len(), header.len(), "each name once");
    let column = |name: &str| header.iter().position(|n| n == name).unwrap();
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), flown.run.log.len());
    let value = |row: usize, name: &str| rows[row][column(name)].parse::<f64>().unwrap();
    for (row, sample) in flown.run.log.iter().enumerate() {
        assert_eq!(value(row, "time_s"), sample.time_s);
        assert_eq!(value(row, "z_m"), sample.motion.position_m.z);
        assert_eq!(value(row, "f3_n") as f32, sample.action.forces.0[2]);
    }
    // z - z_d = -1.5 m at rest, alpha_1 = 3, g_4 = 1/m: V = 1.5^2/2 + (3 * 1.5)^2/2 * 0.486.
    assert!((value(0, "e2_z_m_s") - 4.5).abs() < 1e-6);
    assert!((value(0, "lyapunov_z") - (1.125 + 10.125 * 0.486)).abs() < 1e-5);
    let sum: f64 = afbc_types::Axis::ALL.iter().map(|axis| value(0, &format!("lyapunov_{}", axis.name()))).sum();
    assert!((value(0, "lyapunov_sum") - sum).abs() < 1e-5);
}

#[test]
fn summary_has_the_agreed_keys() {
    let mut flown = both(&paper(Reading::Forces, 20.0));
    flown.push(fly(&paper(Reading::Persistent, 6.0), ControllerKind::Backstepping));
    flown.push(fly(&Scenario { case: None, ..paper(Reading::Persistent, 0.1) }, ControllerKind::Backstepping));
    let mut bytes = Vec::new();
    summary::write(&mut bytes, &flown).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    let lost = &summary[1];
    assert_eq!(lost["controller"], "backstepping");
    assert_eq!(lost["reading"], "forces");
    assert_eq!(lost["inertia_sign"], "+");
    assert_eq!(lost["thrust_sign"], "-");
    assert_eq!(lost["plant"], "rigid-body");
    assert_eq!(lost["profile"], "paper");
    assert_eq!(lost["lost_at_s"], flown[1].run.lost.unwrap().time_s);
    let flown_well = &summary[2];
    assert!(flown_well["lost_at_s"].is_null() && flown_well["lost_reason"].is_null());
    for figures in ["rmse", "max_abs", "final_error"] {
        for output in ["x_m", "y_m", "z_m", "psi_rad"] {
            assert!(flown_well[figures][output].is_number(), "{figures}.{output}");
        }
    }
    assert_eq!(flown_well["mean_abs_delta_u_n"].as_array().unwrap().len(), 4);
    let short = &summary[3];
    assert!(short["reading"].is_null() && short["rmse"].is_null() && short["final_error"]["z_m"].is_number());
}

#[test]
fn table_fits_and_says_who_was_lost() {
    let mut flown = both(&paper(Reading::Forces, 20.0));
    let text = table(&flown, &claims());
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    assert!(text.contains("s: tilted beyond 90 degrees"), "{text}");
    assert!(text.contains("  holds ") && text.contains("  does not hold "), "{text}");
    flown.truncate(0);
    assert!(table(&flown, &[]).starts_with("Nothing was flown."));
}

#[test]
fn unusual_flights_have_figures() {
    let calm = Scenario { name: "".into(), ..paper(Reading::Persistent, 0.1) };
    // Many events at once, under a name that must be escaped in file names and markup.
    let gust = |axis, size| Gust { axis, kind: GustKind::Force, size, start_s: 1.0, end_s: 1.5 };
    let gusts = afbc_types::Axis::ALL.map(|axis| gust(axis, 0.001)).to_vec();
    let change =
        PlantParameterChange { quantity: PlantParameter::Mass, factor: 1.013, start_s: 0.5, end_s: f64::INFINITY };
    let stormy = Scenario {
        name: "../a <b> & \"c\" ⟨d⟩".into(),
        environment: Environment::new(calm.vehicle, vec![change], gusts).unwrap(),
        ..paper(Reading::Persistent, 2.0)
    };
    let mut flown = vec![fly(&calm, ControllerKind::Afbc), fly(&stormy, ControllerKind::Backstepping)];
    flown.extend(both(&paper(Reading::Forces, 20.0)));
    // This vehicle's log contains NaN and infinity.
    let mut broken = fly(&Scenario { name: "broken".into(), ..calm.clone() }, ControllerKind::Afbc);
    for sample in broken.run.log.iter_mut().skip(2) {
        sample.motion.position_m = Vector3::repeat(f64::NAN);
        sample.motion.velocity_m_s.x = f64::INFINITY;
    }
    broken.run.metrics.final_error.x = f64::NAN;
    flown.push(broken.clone());
    let mut empty = ScenarioFlight { scenario: Scenario { name: "empty".into(), ..calm }, ..broken };
    empty.run.log.clear();
    flown.push(empty);

    let scratch = Scratch::new("odd");
    write(&scratch.open(), &flown, &[]).unwrap();
    assert_eq!(check_svgs(&scratch.files()), 5 * 5);
    assert!(table(&flown, &[]).contains("mass +1.3 %"));
}

/// The law as printed in the paper climbs away from its hover and is lost 52 m up, while backstepping stays 50 m below
/// it in the same panel. The figure writes this height and does not mark another place. In the panels of x, y and psi
/// the cross is at the loss.
#[test]
fn a_loss_beyond_a_panel_is_reported_and_not_marked_elsewhere() {
    let contenders = ControllerKind::PAPER.map(|kind| Contender::of(kind, Profile::Paper)).to_vec();
    let hover = Scenario { duration_s: 200.0, contenders, ..built_in("hover").unwrap().read().unwrap() };
    let flown = both(&hover);
    assert!(flown[0].run.lost.is_some() && flown[1].run.lost.is_none());
    let height_m = flown[0].run.log.last().unwrap().motion.position_m.z;
    assert!(height_m > 51.0, "{height_m}");
    let figures = figures::flights::draw(&flown.iter().collect::<Vec<_>>());
    let svg = |name: &str| &figures.iter().find(|figure| figure.name == name).unwrap().svg;
    // Two strokes make a cross.
    let strokes = |name: &str| svg(name).matches(r#"stroke-width="8""#).count();
    assert!(svg("fig5-outputs").contains(&format!("↑ {height_m:.1}")), "{height_m}");
    assert_eq!((strokes("fig4-trajectory"), strokes("fig5-outputs")), (0, 3 * 2));
}

#[test]
fn file_names_stay_apart() {
    let rigid = paper(Reading::Persistent, 0.1);
    let simple = Scenario { model: PlantModel::Simplified, ..rigid.clone() };
    let pulses = Scenario { name: "PAPER".into(), ..paper(Reading::Pulses, 0.1) };
    let longer = Scenario { duration_s: 0.2, ..rigid.clone() };
    let mut flown = Vec::new();
    for scenario in [&rigid, &simple, &pulses, &longer] {
        flown.extend(both(scenario));
    }
    flown.push(flown[0].clone());
    let groups = groups::groups(&flown);
    let names: Vec<_> = groups.iter().flat_map(|group| &group.csv_names).map(|name| name.to_lowercase()).collect();
    assert_eq!(names.iter().collect::<HashSet<_>>().len(), flown.len(), "{names:?}");
    assert_eq!(groups[1].figure_prefix, "paper-simplified-");
}

#[test]
fn nothing_flown_is_no_error() {
    let scratch = Scratch::new("nothing");
    write(&Folder::open(&scratch.0.join("deep/er"), "test", "it", false).unwrap(), &[], &[]).unwrap();
    assert_eq!(fs::read(scratch.0.join("deep/er/summary.json")).unwrap(), b"[]\n");
}

#[test]
fn an_error_names_the_path_and_the_cure() {
    let scratch = Scratch::new("error");
    let taken = scratch.0.join("taken");
    fs::create_dir_all(taken.join("summary.json/full")).unwrap();
    let error = Folder::open(&taken, "test", "it", false).unwrap_err().to_string();
    assert!(
        error.contains("taken: the folder is not empty") && error.contains("--out") && error.contains("--force"),
        "{error}"
    );
    assert_eq!(fs::read_dir(&taken).unwrap().count(), 1, "nothing is touched");
    let error = write(&Folder::open(&taken, "test", "it", true).unwrap(), &[], &[]).unwrap_err().to_string();
    assert!(error.contains("summary.json") && error.contains("--out"), "{error}");
    assert_eq!(fs::read_dir(&taken).unwrap().count(), 3, "the marker and the lock, no temporary file");

    fs::write(scratch.0.join("file"), "").unwrap();
    let error = Folder::open(&scratch.0.join("file"), "test", "it", false).unwrap_err().to_string();
    assert!(error.contains("file: ") && error.contains("--out"), "{error}");
}

/// The message contains the system's error, whichever library writes the file.
#[test]
fn a_full_disk_says_free_some_space() {
    let scratch = Scratch::new("full");
    let folder = scratch.open();
    let flown = fly(&paper(Reading::Persistent, 0.1), ControllerKind::Afbc);
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    // Write to a full disk; `wrap` wraps the error as the library does.
    let fill = |name: &str, wrap: &dyn Fn(&mut dyn io::Write) -> io::Result<()>| {
        let mut disk = afbc_files::CheckedFile { file: full(), failure: None };
        let failed = wrap(&mut disk).unwrap_err();
        folder.error(name, disk.cause(failed)).to_string()
    };
    for said in [
        fill("log.csv", &|out| csv::write(out, &flown)),
        fill("summary.json", &|out| summary::write(out, std::slice::from_ref(&flown))),
        fill("odd", &|out| out.write_all(b"x").map_err(|error| io::Error::other(format!("wrapped: {error}")))),
    ] {
        assert!(said.contains("free some space") && said.contains("No space left"), "{said}");
    }
}

/// Earlier files of the same command are removed; other files stay.
#[test]
fn stale_files_are_removed_and_foreign_ones_kept() {
    let scratch = Scratch::new("stale");
    let [afbc, other] = ControllerKind::PAPER.map(|kind| fly(&paper(Reading::Persistent, 6.0), kind));
    write(&scratch.open(), &[afbc.clone(), other], &[]).unwrap();
    let both = scratch.files();
    fs::write(scratch.0.join("notes.csv"), "mine").unwrap();
    write(&scratch.open(), std::slice::from_ref(&afbc), &[]).unwrap();
    let one = scratch.files();
    assert!(both.contains_key("paper-backstepping.csv") && !one.contains_key("paper-backstepping.csv"));
    assert_eq!(one["notes.csv"], b"mine");
    assert_eq!(one.len(), both.len());

    // A link that `sitl` has not created has the name of a result. It is replaced only on request.
    fs::remove_file(scratch.0.join("paper-afbc.csv")).unwrap();
    write(&scratch.open(), &[], &[]).unwrap();
    std::os::unix::fs::symlink("nowhere", scratch.0.join("paper-afbc.csv")).unwrap();
    let error = write(&scratch.open(), std::slice::from_ref(&afbc), &[]).unwrap_err().to_string();
    assert!(error.contains("paper-afbc.csv: a file that is not from `sitl test` is in the way"), "{error}");
    assert!(fs::symlink_metadata(scratch.0.join("paper-afbc.csv")).unwrap().is_symlink());
    write(&Folder::open(&scratch.0, "test", "it", true).unwrap(), &[afbc], &[]).unwrap();
    assert!(fs::symlink_metadata(scratch.0.join("paper-afbc.csv")).unwrap().is_file());
    assert!(!scratch.0.join("nowhere").exists());

    // A folder of another command is refused. So is a marker file with any single bit flipped.
    let refused = || Folder::open(&scratch.0, "other", "that", false).unwrap_err().to_string();
    assert!(refused().contains("the folder holds the results of `sitl test` for it;"), "{}", refused());
    let marker = scratch.0.join(".sitl.json");
    let bytes = fs::read(&marker).unwrap();
    for (at, bit) in (0..bytes.len()).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1 << bit;
        fs::write(&marker, flipped).unwrap();
        let error = Folder::open(&scratch.0, "test", "it", false).unwrap_err().to_string();
        assert!(error.contains(".sitl.json: the file is damaged"), "{error}");
    }
}

#[test]
fn real_flights_of_many_contenders_leave_everything() {
    let mut scenario = Scenario { duration_s: 6.0, ..built_in("storm").unwrap().read().unwrap() };
    let named = |name: &str| Contender { name: name.into(), ..Contender::of(ControllerKind::Pid, Profile::Flight) };
    scenario.contenders.truncate(1);
    scenario.contenders.extend(["pid", "a/b", "a b", "<&\"'> δ = 0 of thirty-two."].map(named));
    let fly = |contender| ScenarioFlight {
        run: FlightResult::fly(&scenario, contender, 9).unwrap(),
        scenario: scenario.clone(),
    };
    let flown: Vec<_> = scenario.contenders.iter().map(fly).collect();
    let scratch = Scratch::new("many");
    write(&scratch.open(), &flown, &[]).unwrap();
    let files = scratch.files();
    assert_eq!(files.keys().filter(|name| name.ends_with(".csv")).count(), 5);
    assert_eq!(check_svgs(&files), 5);
    for name in ["storm-afbc.csv", "storm-a-b.csv", "storm-a-b-2.csv"] {
        assert!(files.contains_key(name), "{name} of {:?}", files.keys());
    }
    let header = |name: &str| files[name].split(|byte| *byte == b'\n').next().unwrap().to_vec();
    let has = |name: &str, column: &str| header(name).split(|byte| *byte == b',').any(|c| c == column.as_bytes());
    for column in ["rotor1_rad_s", "wind_x_m_s", "battery_v", "x_measured_m", "measurement_fresh"] {
        assert!(has("storm-afbc.csv", column) && has("storm-pid.csv", column), "{column}");
    }
    assert!(has("storm-afbc.csv", "delta_hat_z_n") && !has("storm-pid.csv", "delta_hat_z_n"));
    let text = table(&flown, &[]);
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    let report = str::from_utf8(&files["report.html"]).unwrap();
    assert!(report.contains("position_p_1_s") && report.contains("rotor 2 at 90 %") && report.contains("Dryden"));
}
