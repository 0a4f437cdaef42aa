//! Builds and flashes firmware images, selected by the name of the board.
//!
//! ```sh
//! cargo xtask fw stm32h743 --vehicle racer --run
//! cargo xtask flash stm32f405
//! ```
#![forbid(unsafe_code)]

mod image;

use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Parser, ValueEnum};
use image::{Contents, Region, Usage, room};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::{env, fs, io};

const TARGET: &str = "thumbv7em-none-eabihf";
/// Chips for which a share of flash and RAM must stay free \[%\].
const ROOM: (&str, u64) = ("STM32F405", 25);
/// Prefix of the image names of boards that are tables, `src/bin/flight-BOARD.rs`.
const TABLE: &str = "flight-";
/// USB vendor and product of the chips' boot loader.
const BOOT_LOADER: &str = "0483:df11";

/// Builds and flashes the firmware.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", arg_required_else_help = true)]
enum Task {
    Fw(Build),
    Flash(Flash),
}

/// Build the image of a board, as ELF and Intel HEX files. Reports the use of flash and RAM.
///
/// RUSTUP_TOOLCHAIN=$(scripts/thumb-toolchain.sh) selects a compiler where rustup has no target for microcontrollers.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment, arg_required_else_help = true)]
struct Build {
    #[command(flatten)]
    image: Image,
    /// Flash the image, run it by probe-rs, and show its log.
    #[arg(long)]
    run: bool,
}

/// Build the image of a board, and flash it.
#[derive(Debug, clap::Args)]
#[command(arg_required_else_help = true)]
struct Flash {
    #[command(flatten)]
    image: Image,
    /// Programmer that flashes the image.
    #[arg(long, value_enum, default_value = "dfu")]
    by: Programmer,
}

/// Connection and program that flash an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Programmer {
    /// USB and dfu-util; the board's boot loader must be running.
    Dfu,
    /// An SWD probe and probe-rs.
    Probe,
}

/// Which image.
#[derive(Debug, clap::Args)]
struct Image {
    /// Name of a folder in firmware/boards/, or of a board table in such a folder's src/bin/.
    #[arg(value_parser = named())]
    board: String,
    /// Name in vehicles/, or path of a vehicle file [default: the environment's VEHICLE, or the paper's vehicle].
    #[arg(long)]
    vehicle: Option<String>,
    /// Further options of cargo.
    #[arg(last = true)]
    options: Vec<String>,
}

fn main() -> ExitCode {
    let result = match Task::parse() {
        Task::Fw(build) => build.run(),
        Task::Flash(flash) => flash.run(),
    };
    result.map(|()| ExitCode::SUCCESS).unwrap_or_else(|error| {
        eprintln!("xtask: {error}");
        ExitCode::FAILURE
    })
}

/// Returns a parser that accepts the names of boards.
fn named() -> PossibleValuesParser {
    // clap keeps the names for as long as the program runs, so leaking them is harmless.
    PossibleValuesParser::new(boards().into_keys().map(|name| PossibleValue::new(&*name.leak())))
}

/// Returns the names of all boards with the folders of their packages. Each folder is a board, and so is each table
/// `src/bin/flight-BOARD.rs` within it, for the same chip.
fn boards() -> BTreeMap<String, PathBuf> {
    let within = |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut boards = BTreeMap::new();
    for folder in within(&root().join("firmware/boards")).filter(|folder| folder.join("Cargo.toml").is_file()) {
        let mut add = |path: &Path, prefix| {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            boards.extend(name.strip_prefix(prefix).map(|name| (name.to_owned(), folder.clone())));
        };
        add(&folder, "");
        within(&folder.join("src/bin")).for_each(|table| add(&table, TABLE));
    }
    boards
}

/// A board as described by the manifest of its package.
struct Board {
    /// Folder of the package.
    folder: PathBuf,
    /// Name of the package.
    package: String,
    /// Name of the image.
    image: String,
    /// probe-rs's name for the chip; none for an emulated board.
    chip: Option<String>,
}

impl Board {
    /// Returns the chip of the board, or an error if the board is emulated.
    fn chip(&self, image: &Image) -> Result<&str, String> {
        let emulated = || format!("{} only runs in the emulator: fly it by `cargo run --release -- pil`", image.board);
        self.chip.as_deref().ok_or_else(emulated)
    }

    fn read(name: &str) -> Result<Self, String> {
        let folder = boards().remove(name).ok_or_else(|| format!("{name}: no such board"))?;
        let path = folder.join("Cargo.toml");
        let of = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = fs::read_to_string(&path).map_err(|error| of(&error))?;
        let manifest: toml::Table = text.parse().map_err(|error| of(&error))?;
        let text = |value: Option<&toml::Value>| value.and_then(toml::Value::as_str).map(str::to_owned);
        let package = manifest.get("package").ok_or_else(|| of(&"no [package]"))?;
        let own = manifest.get("bin").and_then(|bins| bins.get(0)).and_then(|bin| bin.get("name"));
        let is_table = !folder.ends_with(name);
        Ok(Board {
            package: text(package.get("name")).ok_or_else(|| of(&"no name"))?,
            image: if is_table { Some(format!("{TABLE}{name}")) } else { text(own) }
                .ok_or_else(|| of(&"no [[bin]] with a name"))?,
            chip: text(package.get("metadata").and_then(|of| of.get("board")).and_then(|of| of.get("chip"))),
            folder,
        })
    }
}

impl Build {
    fn run(&self) -> Result<(), String> {
        let board = Board::read(&self.image.board)?;
        let chip = if self.run { Some(board.chip(&self.image)?) } else { None };
        let (elf, _) = self.image.build(&board)?;
        let Some(chip) = chip else { return Ok(()) };
        run(Command::new("probe-rs").args(["run", "--chip", chip]).arg(elf))
    }
}

impl Flash {
    fn run(&self) -> Result<(), String> {
        let board = Board::read(&self.image.board)?;
        let chip = board.chip(&self.image)?;
        let (elf, contents) = self.image.build(&board)?;
        if self.by == Programmer::Probe {
            run(Command::new("probe-rs").args(["download", "--chip", chip]).arg(elf))?;
            return run(Command::new("probe-rs").args(["reset", "--chip", chip]));
        }
        // Each block is flashed from its own file, so that the parameters between blocks stay.
        for (index, block) in contents.blocks.iter().enumerate() {
            let path = elf.with_extension(format!("{:08x}.bin", block.address));
            write(&path, &block.bytes)?;
            // Only the last block leaves the boot loader, which then starts the program.
            let leave = if index + 1 == contents.blocks.len() { ":leave" } else { "" };
            let place = format!("{:#010x}{leave}", block.address);
            run(Command::new("dfu-util").args(["-d", BOOT_LOADER, "-a", "0", "-s", &place, "-D"]).arg(path))?;
        }
        Ok(())
    }
}

impl Image {
    /// Builds the image. Returns the path of its ELF file and its contents.
    fn build(&self, board: &Board) -> Result<(PathBuf, Contents), String> {
        // Uses the same cargo that runs this program, so that a toolchain chosen for one counts for both.
        let mut cargo = Command::new(env::var_os("CARGO").unwrap_or("cargo".into()));
        cargo.current_dir(root()).args(["build", "--profile", "firmware", "--target", TARGET]);
        cargo.args(["--package", &board.package, "--bin", &board.image]).args(&self.options);
        if let Some(vehicle) = &self.vehicle {
            cargo.env("VEHICLE", vehicle);
        }
        run(&mut cargo)?;
        let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
        let elf = target.join(TARGET).join("firmware").join(&board.image);
        let of = |error: &dyn std::fmt::Display| format!("{}: {error}", elf.display());
        let contents = Contents::read(&fs::read(&elf).map_err(|error| of(&error))?).map_err(|error| of(&error))?;
        let hex = elf.with_extension("hex");
        write(&hex, contents.hex().map_err(|error| of(&error))?)?;
        println!("{}\n{}", elf.display(), hex.display());
        self.report(board, &contents)?;
        Ok((elf, contents))
    }

    /// Prints the image's usage of the board's memory. Fails if the chip's required share is not free.
    fn report(&self, board: &Board, contents: &Contents) -> Result<(), String> {
        let own = board.folder.join("memory.x");
        let path = if own.is_file() { own } else { root().join("memory.x") };
        let script = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let usage = contents.usage(&Region::of_script(&script));
        usage.iter().for_each(|usage| println!("{usage}"));
        let (chip, percent) = ROOM;
        let (flash, ram): (Vec<&Usage>, Vec<&Usage>) = usage.iter().partition(|usage| usage.region.name == "FLASH");
        for (what, usage) in [("flash", flash), ("RAM", ram)] {
            let room = room(&usage);
            println!("{what}: {room}");
            if room.percent < percent && board.chip.as_deref().is_some_and(|name| name.starts_with(chip)) {
                return Err(format!("{}: {what} {room}, but {percent} % must stay free", self.board));
            }
        }
        Ok(())
    }
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), String> {
    fs::write(path, bytes).map_err(|error| format!("{}: {error}", path.display()))
}

/// Runs a command. Returns an error that names the program if it fails or is not installed.
fn run(command: &mut Command) -> Result<(), String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let name = Path::new(&name).file_stem().unwrap_or_default().to_string_lossy();
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{name}: {status}")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(format!("{name} is not installed: docs/firmware.md, \"Build and flash\", says where it comes from"))
        }
        Err(error) => Err(format!("{name}: {error}")),
    }
}

/// Returns the root folder of the workspace.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new("."))
}

#[cfg(test)]
#[allow(clippy::expect_used, clippy::panic, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn read(line: &str) -> Result<Task, String> {
        let words = ["xtask"].into_iter().chain(line.split_whitespace());
        Task::try_parse_from(words).map_err(|error| error.to_string())
    }

    #[test]
    fn every_board_has_a_package_and_an_image_of_its_own() {
        let mut images = BTreeSet::new();
        for (name, folder) in boards() {
            let board = Board::read(&name).expect("complete");
            assert_eq!(board.package, format!("board-{}", folder.file_name().expect("named").display()));
            assert!(board.image.starts_with("flight") != (name == "emulated"), "{name}: {}", board.image);
            assert_eq!(board.chip.is_none(), name == "emulated");
            assert!(images.insert(board.image), "{name}");
        }
        assert!(images.len() >= 10 && images.contains("flight") && images.contains("flight-matek-f405-se"));
    }

    #[test]
    fn arguments_are_read_or_refused_by_name() {
        let Ok(Task::Fw(Build { image, run })) = read("fw stm32h743 --vehicle racer --run -- --locked") else {
            panic!()
        };
        assert_eq!((image.board.as_str(), image.vehicle.as_deref(), run), ("stm32h743", Some("racer"), true));
        assert_eq!(image.options, ["--locked"]);
        for (line, by) in [("flash stm32f405", Programmer::Dfu), ("flash stm32f405 --by probe", Programmer::Probe)] {
            assert!(matches!(read(line), Ok(Task::Flash(flash)) if flash.by == by), "{line}");
        }
        for wrong in
            ["", "burn", "fw", "flash", "fw stm32f405 stm32h743", "fw stm32f405 --fast", "fw stm32f405 --vehicle"]
        {
            assert!(read(wrong).is_err(), "{wrong}");
        }
        assert!(read("flash stm32f405 --by magic").is_err());
        let error = read("fw stm32f1").expect_err("unknown");
        assert!(
            error.contains("stm32f1") && error.contains("emulated, ") && error.contains("stm32f405, stm32h743"),
            "{error}"
        );
        for line in ["fw emulated --run", "flash emulated"] {
            let result = match read(line).expect("read") {
                Task::Fw(build) => build.run(),
                Task::Flash(flash) => flash.run(),
            };
            assert!(result.expect_err("it has no chip").contains("emulated"));
        }
    }

    #[test]
    fn a_missing_program_is_named() {
        let error = run(&mut Command::new("no-such-programmer")).expect_err("missing");
        assert!(error.contains("no-such-programmer is not installed"), "{error}");
    }
}
