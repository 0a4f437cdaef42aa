//! The firmware's images by the names of their boards.
//!
//! ```sh
//! cargo xtask fw stm32h743 --vehicle racer --run
//! ```
#![forbid(unsafe_code)]

use clap::Parser;
use clap::builder::{PossibleValue, PossibleValuesParser};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::{env, fs};

const TARGET: &str = "thumbv7em-none-eabihf";

/// Work on the firmware.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", arg_required_else_help = true)]
enum Task {
    Fw(Build),
}

/// Build the image of a board, and flash it.
///
/// RUSTUP_TOOLCHAIN=$(scripts/thumb-toolchain.sh) selects a compiler where rustup has no target for microcontrollers.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment, arg_required_else_help = true)]
struct Build {
    /// A folder in boards/.
    #[arg(value_parser = named())]
    board: String,
    /// A name in vehicles/, or a path [default: VEHICLE of the environment, or the paper's].
    #[arg(long)]
    vehicle: Option<String>,
    /// Flash and run it by probe-rs, and show its log.
    #[arg(long)]
    run: bool,
    /// Further options of cargo.
    #[arg(last = true)]
    options: Vec<String>,
}

fn main() -> ExitCode {
    let Task::Fw(build) = Task::parse();
    build.run().unwrap_or_else(|error| {
        eprintln!("xtask: {error}");
        ExitCode::FAILURE
    })
}

/// Accepts the name of a board.
fn named() -> PossibleValuesParser {
    // clap keeps names for as long as the program runs.
    PossibleValuesParser::new(boards().into_iter().map(|name| PossibleValue::new(&*name.leak())))
}

/// Returns the names of all boards.
fn boards() -> Vec<String> {
    let folders = fs::read_dir(root().join("boards")).into_iter().flatten().flatten();
    let folders = folders.filter(|folder| folder.path().join("Cargo.toml").is_file());
    let mut names: Vec<_> = folders.map(|folder| folder.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A board, as its manifest describes it.
struct Board {
    /// Name of its package.
    package: String,
    /// Name of its image.
    image: String,
    /// What a probe calls its chip; none if it is emulated.
    chip: Option<String>,
}

impl Board {
    fn read(name: &str) -> Result<Self, String> {
        let path = root().join("boards").join(name).join("Cargo.toml");
        let of = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = fs::read_to_string(&path).map_err(|error| of(&error))?;
        let manifest: toml::Table = text.parse().map_err(|error| of(&error))?;
        let text = |value: Option<&toml::Value>| value.and_then(toml::Value::as_str).map(str::to_owned);
        let package = manifest.get("package").ok_or_else(|| of(&"no [package]"))?;
        let image = manifest.get("bin").and_then(|bins| bins.get(0)).and_then(|bin| bin.get("name"));
        Ok(Board {
            package: text(package.get("name")).ok_or_else(|| of(&"no name"))?,
            image: text(image).ok_or_else(|| of(&"no [[bin]] with a name"))?,
            chip: text(package.get("metadata").and_then(|of| of.get("board")).and_then(|of| of.get("chip"))),
        })
    }
}

impl Build {
    fn run(&self) -> Result<ExitCode, String> {
        let Board { package, image, chip } = Board::read(&self.board)?;
        if self.run && chip.is_none() {
            return Err(format!("{} is emulated: fly it by `cargo run --release -- pil`", self.board));
        }
        let mut cargo = Command::new(env::var_os("CARGO").unwrap_or("cargo".into()));
        cargo.current_dir(root()).args(["build", "--profile", "firmware", "--target", TARGET]);
        cargo.args(["--package", &package, "--bin", &image]).args(&self.options);
        if let Some(vehicle) = &self.vehicle {
            cargo.env("VEHICLE", vehicle);
        }
        if !succeeds(&mut cargo, "cargo")? {
            return Ok(ExitCode::FAILURE);
        }
        let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
        let image = target.join(TARGET).join("firmware").join(&image);
        println!("{}", image.display());
        let Some(chip) = chip.filter(|_| self.run) else { return Ok(ExitCode::SUCCESS) };
        let flashed = succeeds(Command::new("probe-rs").args(["run", "--chip", &chip]).arg(&image), "probe-rs")?;
        Ok(if flashed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// Runs a command; true if it succeeds.
fn succeeds(command: &mut Command, name: &str) -> Result<bool, String> {
    command.status().map(|status| status.success()).map_err(|error| format!("{name}: {error}"))
}

/// The workspace's root.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn read(line: &str) -> Result<Build, String> {
        let words = ["xtask"].into_iter().chain(line.split_whitespace());
        Task::try_parse_from(words).map(|Task::Fw(build)| build).map_err(|error| error.to_string())
    }

    #[test]
    fn every_board_has_a_package_and_an_image_of_its_own() {
        let mut images = BTreeSet::new();
        for name in boards() {
            let board = Board::read(&name).expect("complete");
            assert_eq!(board.package, format!("board-{name}"));
            assert_eq!(board.chip.is_none(), name == "emulated");
            assert!(images.insert(board.image), "{name}");
        }
        assert!(images.len() >= 3);
    }

    #[test]
    fn arguments_are_read_or_refused_by_name() {
        let build = read("fw stm32h743 --vehicle racer --run -- --locked").expect("valid");
        assert_eq!((build.board.as_str(), build.vehicle.as_deref(), build.run), ("stm32h743", Some("racer"), true));
        assert_eq!(build.options, ["--locked"]);
        for wrong in ["", "flash", "fw", "fw stm32f405 stm32h743", "fw stm32f405 --fast", "fw stm32f405 --vehicle"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
        let error = read("fw stm32f1").expect_err("unknown");
        assert!(
            error.contains("stm32f1") && error.contains("emulated, ") && error.contains("stm32f405, stm32h743"),
            "{error}"
        );
        assert!(read("fw emulated --run").expect("read").run().is_err());
    }
}
