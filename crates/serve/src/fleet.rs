//! Scenarios adapted for vehicles that stand on the ground until they are flown.

use afbc_files::read::FileError;
use afbc_files::read::words::out_of_range;
use afbc_plant::{Motion, Realism, RotorStart, Rotors};
use afbc_scenario::Scenario;
use nalgebra::Vector3;

/// Largest number of vehicles. MAVLink has 255 system ids, and ground stations use the highest.
pub const VEHICLES_MAX: u8 = 100;
/// Distance between neighbouring vehicles at the start, to the east \[m\].
const APART_M: f64 = 3.0;
/// Vehicle whose drag, ground contact and battery are used where a scenario has none.
const PAPER: &str = "paper";

/// Returns the scenarios of `vehicles` vehicles, side by side on the ground. Place and heading come from `scenario`;
/// its trajectory, its duration and the rest of its initial motion have no effect.
///
/// # Errors
/// Fails with one line if the firmware cannot fly the scenario, or a setting is out of range.
pub fn fleet(scenario: &Scenario, vehicles: u8) -> Result<Vec<Scenario>, FileError> {
    let refused = |problem: String| FileError::whole(&scenario.name, problem);
    afbc_hil::check(scenario).map_err(|error| refused(error.to_string()))?;
    if scenario.instruments.imu.is_none() {
        let cure = "add [instruments] with an imu, or choose the scenario outdoor or mocap";
        return Err(refused(format!("the vehicle has no sensors to fly with; {cure}")));
    }
    let standing = standing(scenario)?;
    let all = (0..vehicles.min(VEHICLES_MAX)).map(|number| {
        let mut scenario = standing.clone();
        scenario.initial.position_m.y -= APART_M * f64::from(number);
        scenario.seed += u64::from(number);
        scenario
    });
    let all: Vec<Scenario> = all.collect();
    all.iter().try_for_each(Scenario::check).map_err(|error| refused(out_of_range(&error)))?;
    Ok(all)
}

/// Puts the vehicle of `scenario` on the ground, and adds drag and a battery if they are missing.
fn standing(scenario: &Scenario) -> Result<Scenario, FileError> {
    let mut scenario = scenario.clone();
    let paper = match afbc_vehicles::built_in(PAPER) {
        Some(paper) => paper.read()?.realism,
        None => Realism::default(),
    };
    let Realism { rotors, drag, contact, ground_effect, .. } = scenario.realism;
    // Disarmed motors stand still, even if the motors idle at some speed in flight.
    let rotors =
        Rotors { start: RotorStart::Idle, min_rad_s: 0.0, battery: rotors.battery.or(paper.rotors.battery), ..rotors };
    let contact = contact.or(paper.contact);
    scenario.realism = Realism { rotors, drag: drag.or(paper.drag), contact, ground_effect, ..scenario.realism };
    let height_m = contact.map_or(0.0, |contact| contact.foot_depth_m - contact.sink_m);
    let Motion { position_m, attitude_rad, .. } = scenario.initial;
    scenario.initial = Motion {
        position_m: Vector3::new(position_m.x, position_m.y, height_m),
        attitude_rad: Vector3::new(0.0, 0.0, attitude_rad.z),
        ..Motion::default()
    };
    Ok(scenario)
}
