//! Reader of campaign files. `docs/campaigns.md` describes each key.

use crate::plan::{Campaign, NamedTrajectory, Spread};
use crate::quantity::{QUANTITIES, Quantity};
use afbc_files::read::words::out_of_range;
use afbc_files::read::{Example, FileError, Table};
use afbc_plant::InstrumentSuite;
use afbc_scenario::contender::Contender;
use afbc_scenario::{DURATION, Scenario, built_in, similar_built_in};
use afbc_types::Range;
use std::path::{Path, PathBuf};

const SAMPLE: Example = Example {
    command: "campaigns robustness",
    text: "flights = 1\n[scenario.trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n",
};

/// Accepted numbers of flights.
const FLIGHTS: Range = Range::new("flights", 1.0, 1e7);
/// Accepted seeds: whole numbers up to 2^53 - 1, which no tool rounds.
const SEED: Range = Range::new("seed", 0.0, 9_007_199_254_740_991.0);

/// Reads and checks a campaign from its `text`. `file` is its path in error messages, `name` its name unless the text
/// gives one. Paths of scenario files are relative to `folder`.
///
/// # Errors
/// All mistakes, one line each.
pub fn parse(file: &str, text: &str, name: &str, folder: &Path) -> Result<Campaign, FileError> {
    afbc_files::read::document(file, text, SAMPLE, |mut root| {
        let [name, description] = afbc_files::read::title(&mut root, name)?;
        let flights = root.whole(&FLIGHTS)?.ok_or_else(|| root.missing(FLIGHTS.name, "add the number of flights"))?;
        let seed = root.whole(&SEED)?.unwrap_or(1);
        let duration_s = root.number(&DURATION)?;
        let trajectories = trajectories(&mut root, folder)?;
        let mut scenario = scenario(&mut root, folder, trajectories.first())?;
        scenario.duration_s = duration_s.unwrap_or(scenario.duration_s);
        let own = scenario.contenders.clone();
        let is_free = |named: &Contender| own.iter().all(|other| other.name != named.name);
        let named =
            |own: &Contender| Some(own.clone().named_as_printed()).filter(is_free).unwrap_or_else(|| own.clone());
        scenario.contenders = own.iter().map(named).collect();
        let trajectories = if trajectories.is_empty() { vec![trajectory(scenario.clone())] } else { trajectories };
        let spreads = match root.table("spread")? {
            Some(table) => spreads(table, &scenario)?,
            None => Vec::new(),
        };
        let campaign = Campaign { name, description, flights, seed, scenario, trajectories, spreads };
        root.finish()?;
        if let Err(error) = campaign.check() {
            root.clash("spread", &[], format!("the spread causes {}; narrow the spread", out_of_range(&error)))?;
        }
        Ok(campaign)
    })
}

/// Reads the scenario, given by name or as a table. A table needs no trajectory of its own if `trajectory` is given.
fn scenario(root: &mut Table<'_>, folder: &Path, trajectory: Option<&NamedTrajectory>) -> Result<Scenario, FileError> {
    if let Some(table) = root.table_if("scenario")? {
        return afbc_scenario::read(table, "own", trajectory.map(|named| &named.trajectory));
    }
    let Some(name) = root.text("scenario")? else {
        return Err(root.missing("scenario", "name a scenario, as in scenario = \"hardware\""));
    };
    named(root, "scenario", name, folder)
}

fn trajectory(Scenario { name, trajectory, initial, .. }: Scenario) -> NamedTrajectory {
    NamedTrajectory { name, trajectory, initial }
}

/// Reads the scenarios listed under `trajectories` and returns their trajectories.
fn trajectories(root: &mut Table<'_>, folder: &Path) -> Result<Vec<NamedTrajectory>, FileError> {
    let Some(names) = root.texts("trajectories")? else {
        // If the list has mistakes, any trajectory will do, so that the scenario is not blamed for lacking one.
        let any = (!root.knows("trajectories")).then(|| built_in("hover")?.read().ok()).flatten();
        return Ok(any.map(trajectory).into_iter().collect());
    };
    let (mut trajectories, mut wrong) = (Vec::<NamedTrajectory>::new(), None::<FileError>);
    for name in names {
        let twice = |name: &str| root.fault_at("trajectories", format!("\"{name}\" is listed twice; once is enough"));
        match named(root, "trajectories", name, folder).map(trajectory) {
            Ok(next) if trajectories.iter().all(|other| other.name != next.name) => trajectories.push(next),
            read => {
                let error = read.map_or_else(|error| error, |next| twice(&next.name));
                wrong = Some(wrong.map_or(error.clone(), |wrong| wrong.and(error)));
            }
        }
    }
    if let Some(wrong) = wrong {
        return Err(wrong);
    }
    if trajectories.is_empty() {
        return Err(root.fault_at("trajectories", "the list is empty; name a scenario, or leave the list out"));
    }
    Ok(trajectories)
}

/// Reads a scenario by name. A plain name means a built-in scenario, anything else a file.
pub(crate) fn named(root: &Table<'_>, key: &str, name: &str, folder: &Path) -> Result<Scenario, FileError> {
    if !name.contains(['/', '\\', '.']) {
        let built_in = built_in(name).ok_or_else(|| {
            let cure = match similar_built_in(name) {
                Some(known) => format!("did you mean \"{}\"?", known.name),
                None => "`sitl scenarios` lists the built-in scenarios; the name of a file ends in .toml".into(),
            };
            root.fault_at(key, format!("\"{name}\" is no built-in scenario; {cure}"))
        })?;
        return built_in.read();
    }
    let path: PathBuf = folder.join(name);
    afbc_scenario::load(&path).map_err(|error| root.through(key, error))
}

fn spreads(mut table: Table<'_>, scenario: &Scenario) -> Result<Vec<Spread>, FileError> {
    let mut spreads = Vec::new();
    let mut wanted: Vec<&str> = Vec::new();
    for (index, quantity) in QUANTITIES.iter().enumerate() {
        let Quantity { range, whole, needs, .. } = quantity;
        let Some(ends) = table.interval(range)? else { continue };
        if *whole && ends.iter().any(|end| end.fract() != 0.0) {
            return Err(table.fault_at(range.name, "only whole numbers can be drawn; make both ends whole numbers"));
        }
        if let Some(needed) = needs.filter(|needed| !wanted.contains(needed)) {
            table.clash(range.name, &[], format!("the spread has no effect without {needed}; add {needed}"))?;
        }
        if let Some(problem) = idle(range.name, scenario) {
            table.clash(range.name, &["scenario"], problem)?;
        }
        wanted.push(range.name);
        spreads.push(Spread { quantity: index, ends });
    }
    table.finish()?;
    Ok(spreads)
}

/// Returns the reason why drawing this quantity would have no effect, if there is one.
fn idle(name: &str, scenario: &Scenario) -> Option<&'static str> {
    let still = afbc_plant::Deviations::default();
    let InstrumentSuite { imu, tracker, gnss, barometer, magnetometer } = &scenario.instruments;
    let lacks = |there: bool, cure| (!there).then_some(cure);
    match name {
        "imu_part" => lacks(imu.is_some(), "the scenario has no inertial sensor; add imu to its [instruments]"),
        "vibration_ratio" if imu.is_none_or(|imu| imu.gyro.vibration_rad_s + imu.accel.vibration_m_s2 == 0.0) => {
            Some("the scenario has no vibration to multiply; add it to [instruments.imu]")
        }
        "barometer_part" => lacks(barometer.is_some(), "the scenario has no barometer; add one to its [instruments]"),
        "magnetometer_part" => {
            lacks(magnetometer.is_some(), "the scenario has no magnetometer; add one to its [instruments]")
        }
        "aiding" if tracker.is_none() || gnss.is_none() => {
            Some("the scenario does not have both sources; add tracker and gnss to its [instruments]")
        }
        name if name.starts_with("tracker_") => {
            lacks(tracker.is_some(), "the scenario has no tracker; add one to its [instruments]")
        }
        name if name.starts_with("gnss_") => {
            lacks(gnss.is_some(), "the scenario has no GNSS receiver; add gnss to its [instruments]")
        }
        "sensor_delay_s" | "dropout_rate_hz" if imu.is_some() => Some(
            "the spread has no effect on a vehicle that estimates its own state; vary an instrument instead, by a \
             key such as tracker_delay_s",
        ),
        "wind_m_s" | "wind_20ft_m_s" if scenario.realism.drag.is_none() => {
            Some("wind has no effect on a vehicle without drag; add [drag] to the scenario")
        }
        "noise_ratio" if scenario.sensing.noise == still => {
            Some("the scenario has no noise to multiply; add [sensors] with noise to it")
        }
        "bias_ratio" if scenario.sensing.bias == still => {
            Some("the scenario has no bias to multiply; add [sensors] with bias to it")
        }
        _ => None,
    }
}
