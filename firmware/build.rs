//! The vehicle that the firmware flies: `VEHICLE=racer cargo fw` takes `vehicles/racer.toml`, `VEHICLE=./mine.toml` a
//! file of one's own, relative to the workspace's root. Read and checked here, so that the image holds numbers only,
//! and a vehicle that cannot fly makes no image.

use std::path::{Path, PathBuf};
use std::{env, fs, process};

/// The vehicle of the paper.
const DEFAULT: &str = "paper";

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace's root");
    let asked = env::var("VEHICLE").ok().filter(|name| !name.is_empty()).unwrap_or(DEFAULT.into());
    // No vehicle's name has one of these.
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
    fs::write(&out, vehicle.image()).expect("cargo's own folder can be written");
}
