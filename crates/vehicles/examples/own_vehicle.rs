//! Reads a vehicle file with gains computed by rule: `cargo run -p afbc-vehicles --example own_vehicle`.

use afbc::Profile;
use afbc_files::read::FileError;

/// Values to be measured or taken from data sheets; `docs/vehicles.md` describes every key.
const FILE: &str = r#"
description = "a quadrotor of 0.8 kg on 10 inch propellers"

[vehicle]
mass_kg = 0.8
arm_m = 0.2
inertia_kg_m2 = [0.006, 0.006, 0.011]
rotor_inertia_kg_m2 = 6.0e-5
thrust_factor_n_s2 = 1.2e-5
drag_factor_n_m_s2 = 1.8e-7

# Front right, front left, rear left, rear right.
[[rotor]]
position_m = [0.1414, -0.1414, 0.0]
spin = "ccw"

[[rotor]]
position_m = [0.1414, 0.1414, 0.0]
spin = "cw"

[[rotor]]
position_m = [-0.1414, 0.1414, 0.0]
spin = "ccw"

[[rotor]]
position_m = [-0.1414, -0.1414, 0.0]
spin = "cw"

[rotors]
time_constant_s = 0.035
force_max_n = 4.5

[motor]
speed_max_rad_s = 650.0
linearity = 0.6
idle = 0.05
"#;

fn main() -> Result<(), FileError> {
    let vehicle = afbc_vehicles::parse("mine.toml", FILE, "mine")?;
    let gains = vehicle.gains(Profile::Flight);
    println!("{}: rotors lag by {} s", vehicle.name, vehicle.lag_s());
    println!("gains of roll: {:?}", gains.roll);
    // A mistake is reported in one line with its place and a remedy.
    let wrong = FILE.replace("mass_kg = 0.8", "mass_kg = -0.8");
    let mistake = afbc_vehicles::parse("mine.toml", &wrong, "mine").err().map(|mistake| mistake.to_string());
    println!("{}", mistake.as_deref().unwrap_or("no mistake found"));
    assert!(mistake.is_some());
    Ok(())
}
