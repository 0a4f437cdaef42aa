//! The data about a vehicle that stay the same during a flight; a page receives them once.

use crate::ServedVehicle;
use crate::command::COMMANDS;
use afbc_plant::InstrumentSuite;
use afbc_scenario::contender::ControllerKind;
use serde::Serialize;
use serde_json::Value;

/// The vehicle, and what can be done with it.
#[derive(Clone, Debug, Serialize)]
pub struct VehicleDescription {
    /// Type of the message: always `hello`.
    pub kind: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Explanation of the frames.
    pub frames: &'static str,
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// Weight \[N\].
    pub weight_n: f64,
    /// Distance from the centre of mass to a rotor shaft \[m\].
    pub arm_m: f64,
    /// Largest force of one rotor that the law assumes \[N\].
    pub force_max_n: f64,
    /// Positions of the rotors, in the order of their numbers.
    pub rotors: Vec<RotorPosition>,
    /// Laws that can fly the vehicle.
    pub laws: Vec<PageLaw>,
    /// Names of the vehicle's instruments, as in the command `fault`.
    pub instruments: Vec<&'static str>,
    /// Commands of the text protocol: name, arguments, meaning.
    pub lines: &'static [[&'static str; 3]],
    /// Metadata of every parameter (range, unit, meaning), in the format of PX4's `parameters.json`.
    pub parameters: Value,
}

/// Position of a rotor, body frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RotorPosition {
    /// Position forward and left of the centre of mass \[m\].
    pub position_m: [f64; 2],
    /// True if the rotor turns clockwise, seen from above.
    pub clockwise: bool,
}

/// A control law.
#[derive(Clone, Debug, Serialize)]
pub struct PageLaw {
    /// Name in commands and files.
    pub name: &'static str,
    /// Name to display.
    pub title: &'static str,
}

/// Explanation of the frames.
const FRAMES: &str = "earth: x north, y west, z up; body: x forward, y left, z up; angles to the left are positive";
/// Name of the metadata file with the parameters.
const PARAMETERS: &str = "parameters.json";

impl VehicleDescription {
    /// Describes a vehicle.
    pub fn new(vehicle: &ServedVehicle) -> Self {
        let scenario = vehicle.scenario();
        let parameters = &scenario.vehicle;
        let rotor = |rotor: &afbc_types::Rotor<f64>| RotorPosition {
            position_m: [rotor.x * parameters.arm_m, rotor.y * parameters.arm_m],
            clockwise: rotor.pushes_left,
        };
        let files = vehicle.host().metadata().files;
        let metadata = files.iter().find(|(name, _)| name == PARAMETERS);
        let metadata: Value = metadata.and_then(|(_, bytes)| serde_json::from_slice(bytes).ok()).unwrap_or_default();
        VehicleDescription {
            kind: "hello",
            version: env!("CARGO_PKG_VERSION"),
            scenario: scenario.name.clone(),
            vehicle: scenario.vehicle_file.as_ref().map_or("paper".into(), |file| file.name.clone()),
            frames: FRAMES,
            mass_kg: parameters.mass_kg,
            weight_n: parameters.weight_n(),
            arm_m: parameters.arm_m,
            force_max_n: force_max_n(vehicle),
            rotors: scenario.rotors.iter().map(rotor).collect(),
            laws: ControllerKind::all().into_iter().map(|it| PageLaw { name: it.name(), title: it.title() }).collect(),
            instruments: instruments(&scenario.instruments),
            lines: &COMMANDS,
            parameters: metadata.get("parameters").cloned().unwrap_or_default(),
        }
    }
}

/// Returns the largest force of one rotor \[N\]: AFBC's limit, or the weight if the scenario has no AFBC.
fn force_max_n(vehicle: &ServedVehicle) -> f64 {
    let scenario = vehicle.scenario();
    let common = scenario.contender(ControllerKind::Afbc).map(|afbc| afbc.settings.common.rotor_force_max_n);
    common.map_or(scenario.vehicle.weight_n(), f64::from)
}

fn instruments(suite: &InstrumentSuite) -> Vec<&'static str> {
    let all = [
        ("imu", suite.imu.is_some()),
        ("gnss", suite.gnss.is_some()),
        ("barometer", suite.barometer.is_some()),
        ("magnetometer", suite.magnetometer.is_some()),
        ("tracker", suite.tracker.is_some()),
    ];
    all.into_iter().filter(|(_, there)| *there).map(|(name, _)| name).collect()
}
