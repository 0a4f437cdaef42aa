//! Reads and checks the file of the vehicle that the firmware flies, and writes its numbers as Rust source.
//! `VEHICLE=racer cargo fw` takes `vehicles/racer.toml`; `VEHICLE=./mine.toml` takes a path relative to the
//! workspace's root. A vehicle that fails the checks fails the build.

use std::path::{Path, PathBuf};
use std::{env, fs, process};

/// The paper's vehicle flies if `VEHICLE` is not set.
const DEFAULT: &str = "paper";

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace's root");
    let asked = env::var("VEHICLE").ok().filter(|name| !name.is_empty()).unwrap_or(DEFAULT.into());
    // A path contains one of these characters, the name of a shipped vehicle none.
    let path = if asked.contains(['/', '\\', '.']) {
        root.join(&asked)
    } else {
        root.join("vehicles").join(format!("{asked}.toml"))
    };
    println!("cargo::rerun-if-env-changed=VEHICLE");
    println!("cargo::rerun-if-changed={}", path.display());
    let vehicle = afbc_vehicles::load(&path).unwrap_or_else(|error| {
        // Cargo shows this line even if it hides the other output of a failed build script.
        println!("cargo::error=VEHICLE={asked}: {error}");
        process::exit(1)
    });
    let out = PathBuf::from(env::var("OUT_DIR").expect("set by cargo")).join("vehicle.rs");
    fs::write(&out, vehicle.image()).expect("cargo's own folder can be written");
}
