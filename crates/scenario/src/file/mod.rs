//! Reads scenario files. `docs/reference/scenario-keys.md` describes each key.

mod contenders;
mod control;
mod environment;
mod instruments;
mod motion;
mod path;
mod realism;
mod reference;
mod sensors;
mod trajectory;
mod vehicle;

#[cfg(test)]
mod tests;

use super::definition::{DURATION, Scenario};
use crate::contender::Contender;
use crate::trajectory::Trajectory;
use afbc_files::read::words::out_of_range;
use afbc_files::read::{Example, FileError, Table};
use afbc_plant::{PlantModel, Realism, RotorLayout, Sensing};
use afbc_types::{PLUS, ROTORS, Range};
use afbc_vehicles::parts;
use contenders::FlownVehicle;
use std::path::Path;

/// Default duration of a flight \[s\].
const DURATION_S: f64 = 60.0;
/// Accepted seeds.
const SEED: Range = Range::new("seed", 0.0, 1e9);
const SAMPLE: Example = Example { command: "scenarios hover", text: include_str!("../../scenarios/hover.toml") };

/// Reads and checks the scenario file at `path`.
///
/// # Errors
/// The first mistake, as one line.
pub fn load(path: &Path) -> Result<Scenario, FileError> {
    let text = afbc_files::read::text(path, "scenario")?;
    let stem = path.file_stem().map_or("".into(), |stem| stem.to_string_lossy());
    parse(&path.display().to_string(), &text, &stem)
}

/// Reads and checks a scenario from its `text`. `file` is its path in errors; `name` is its name if the text gives
/// none.
///
/// # Errors
/// Every mistake, each as one line.
pub fn parse(file: &str, text: &str, name: &str) -> Result<Scenario, FileError> {
    afbc_files::read::document(file, text, SAMPLE, |root| read(root, name, None))
}

/// Reads the scenario in `root`; `name` and `trajectory` are defaults.
///
/// # Errors
/// The first mistake, as one line. [`afbc_files::read::document`] then looks for further mistakes.
pub fn read(mut root: Table<'_>, name: &str, trajectory: Option<&Trajectory>) -> Result<Scenario, FileError> {
    let [name, description] = afbc_files::read::title(&mut root, name)?;
    let duration_s = root.number(&DURATION)?.unwrap_or(DURATION_S);
    let models = [PlantModel::Simplified, PlantModel::RigidBody];
    let seed = root.whole(&SEED)?.unwrap_or(0);
    let model = root.choice("plant", &models, PlantModel::name)?.unwrap_or(PlantModel::RigidBody);

    let table = root.table("vehicle")?;
    let is_known = root.knows("vehicle") && table.as_ref().is_none_or(|table| table.knows("name"));
    let (vehicle_file, vehicle) = vehicle::read(table)?;
    let truth = parts::parameters(root.table("truth")?, vehicle)?;
    let flown = vehicle_file.as_ref().map_or(FlownVehicle::Paper(&vehicle), FlownVehicle::File);
    let contenders = contenders::read(&mut root, flown)?;
    let trajectory = match (root.table("trajectory")?, trajectory) {
        (Some(table), _) => trajectory::read(table)?,
        (None, Some(trajectory)) => trajectory.clone(),
        (None, None) => {
            let cure = "add [trajectory] with kind = \"hover\" and position_m = [0, 0, 1]";
            return Err(root.missing("trajectory", cure));
        }
    };
    let initial = motion::initial(root.table("initial")?, &trajectory.at(0.0))?;
    let environment = environment::read(&mut root, truth)?;
    let step_s = contenders.first().map_or(afbc_control::Settings::DT.range.max, Contender::step_s);
    let rotors = vehicle_file.as_ref().map_or(PLUS.map(|rotor| rotor.to_f64()).to_vec(), |file| file.rotors.clone());
    let frame = RotorLayout::new(&rotors).map_err(|error| root.fault_at("vehicle", out_of_range(&error)))?;
    let real = vehicle_file.as_ref().map_or(Realism::default(), |file| file.realism.clone());
    let count = if is_known { frame.count() } else { ROTORS.max as usize };
    let realism = realism::read(&mut root, &real, &truth, (&frame, count), step_s)?;
    let sensing = sensors::read(root.table("sensors")?)?;
    let sensor_faults = sensors::faults(&mut root)?;
    let instruments = instruments::read(root.table("instruments")?)?;
    let told = instruments::told(&mut root, &instruments, vehicle_file.as_ref())?;
    let instrument_faults = instruments::faults(&mut root, &instruments)?;
    if instruments.imu.is_some() && (sensing != Sensing::default() || !sensor_faults.is_empty()) {
        let key = if sensor_faults.is_empty() { "sensors" } else { "sensor_fault" };
        let problem = "this table has no effect on a vehicle that estimates its state; leave out the table, or the \
             inertial sensor";
        root.clash(key, &["instruments", "sensors", "sensor_fault"], problem)?;
    }
    let outages = environment::outages(&mut root)?;
    let flight_core = root.boolean("flight_core")?.unwrap_or(false);

    let scenario = Scenario {
        name,
        description,
        case: None,
        duration_s,
        model,
        vehicle,
        rotors,
        vehicle_file,
        environment,
        realism,
        sensing,
        sensor_faults,
        instruments,
        told,
        instrument_faults,
        outages,
        flight_core,
        seed,
        initial,
        trajectory,
        contenders,
    };
    root.finish()?;
    // The flight core is checked separately and first, so that the error can name leaving out `flight_core` as a cure.
    if let Err(error) = scenario.check_flight_core() {
        let problem = format!(
            "the vehicle cannot fly with {}; change that parameter, or leave flight_core out",
            out_of_range(&error)
        );
        let with = &["initial", "trajectory", "settings", "contender", "controllers", "profile", "vehicle"];
        root.clash("flight_core", with, problem)?;
    }
    // Final check of combinations that the tables accept one by one.
    if let Err(error) = scenario.check() {
        root.clash(error.range.name, &[], format!("{}; change it", out_of_range(&error)))?;
    }
    Ok(scenario)
}
