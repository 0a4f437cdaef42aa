//! The vehicle that the firmware flies: `VEHICLE=racer cargo fw` takes `vehicles/racer.toml`, `VEHICLE=./mine.toml` a
//! file of one's own, relative to the workspace's root. Read and checked here, so that the image holds numbers only,
//! and a vehicle that cannot fly makes no image.

use afbc::Profile;
use afbc_types::{Airframe, with_rotors};
use afbc_vehicles::Vehicle;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::{env, fs, process};

/// The vehicle of the paper.
const DEFAULT: &str = "paper";

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace's root");
    let asked = env::var("VEHICLE").ok().filter(|name| !name.is_empty()).unwrap_or(DEFAULT.into());
    let path = if asked.contains(['/', '\\', '.']) {
        root.join(&asked)
    } else {
        root.join("vehicles").join(format!("{asked}.toml"))
    };
    println!("cargo::rerun-if-env-changed=VEHICLE");
    println!("cargo::rerun-if-changed={}", path.display());
    let vehicle = afbc_vehicles::load(&path).unwrap_or_else(|error| {
        // One line that cargo shows, whatever else it shows of a build script that fails.
        println!("cargo::error=VEHICLE={asked}: {error}");
        process::exit(1)
    });
    let out = PathBuf::from(env::var("OUT_DIR").expect("set by cargo")).join("vehicle.rs");
    fs::write(&out, source(&vehicle)).expect("cargo's own folder can be written");
}

/// The vehicle as Rust.
fn source(vehicle: &Vehicle) -> String {
    let count = vehicle.rotors.len();
    let airframe = with_rotors!(count, N => {
        literal(&Airframe::<N>::new(&vehicle.parameters, &vehicle.rotors).expect("counted"))
    });
    let (settings, gains) = (vehicle.settings(Profile::Flight), vehicle.gains(Profile::Flight));
    format!(
        "/// Name of the vehicle.\n\
         pub const NAME: &str = {name:?};\n\
         /// Number of its rotors.\n\
         pub const ROTORS: usize = {count};\n\
         /// What its file says.\n\
         pub const CONFIGURATION: Configuration = afbc_onboard::Configuration {{\n\
         airframe: {airframe},\nsettings: {settings},\ngains: {gains},\ncurve: {curve},\n\
         response: {response},\nimu: {imu},\n\
         estimation: {estimation},\n    arming: afbc_onboard::ArmingLimits::DEFAULT,\n\
         guidance: afbc_guidance::Settings::DEFAULT,\n    link: afbc_onboard::Link::DEFAULT,\n}};\n",
        name = vehicle.name,
        settings = literal(&settings),
        gains = literal(&gains),
        curve = literal(&vehicle.curve),
        response = literal(&vehicle.response()),
        imu = literal(&vehicle.imu.to_f32()),
        // The estimator calls its settings `Settings`; the image imports them as `Estimation`.
        estimation = literal(&vehicle.estimation).replace("Settings", "Estimation"),
    )
}

/// What derives `Debug` prints itself as it is written in Rust, but for the paths of types and for vectors.
fn literal(value: &impl Debug) -> String {
    format!("{value:?}")
        .replace("common: Settings", "common: afbc_control::Settings")
        .replace("backstepping: Gains", "backstepping: backstepping::Gains")
        .replace("[[", "Vector3::new(")
        .replace("]]", ")")
}
