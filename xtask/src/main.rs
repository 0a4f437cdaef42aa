//! The firmware's images by the names of their boards.
//!
//! ```sh
//! cargo xtask fw stm32h743 --vehicle racer --run
//! ```
#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::{env, fs, io};

const HELP: &str = "\
Builds the firmware of a board.

Usage: cargo xtask fw BOARD [--vehicle VEHICLE] [--run] [-- CARGO-OPTIONS...]

  BOARD              a folder in boards/, listed below
  --vehicle VEHICLE  a name in vehicles/, or a path; without it VEHICLE of the environment, or the paper's
  --run              flashes and runs it by probe-rs, and shows its log
  -h, --help         shows this

RUSTUP_TOOLCHAIN=$(scripts/thumb-toolchain.sh) selects a compiler where rustup has no target for microcontrollers.
";
const TARGET: &str = "thumbv7em-none-eabihf";

fn main() -> ExitCode {
    match run(env::args().skip(1)) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("xtask: {error}");
            ExitCode::FAILURE
        }
    }
}

/// A board, as its folder describes it.
struct Board {
    name: String,
    /// Name of its package.
    package: String,
    /// Name of its image.
    image: String,
    /// What a probe calls its chip; none if it is emulated.
    chip: Option<String>,
}

/// What is asked for.
#[derive(Debug, Default, PartialEq)]
struct Wish {
    board: String,
    vehicle: Option<String>,
    run: bool,
    /// Further options of cargo.
    options: Vec<String>,
}

fn run(arguments: impl Iterator<Item = String>) -> Result<ExitCode, String> {
    let boards = boards().map_err(|error| format!("boards/: {error}"))?;
    let names = || boards.iter().map(|board| board.name.as_str()).collect::<Vec<_>>().join(", ");
    let Some(wish) = Wish::read(arguments)? else {
        print!("{HELP}\nBoards: {}\n", names());
        return Ok(ExitCode::SUCCESS);
    };
    let board = boards.iter().find(|board| board.name == wish.board);
    let board = board.ok_or_else(|| format!("no board is called \"{}\"; there are {}", wish.board, names()))?;
    let chip = match (&board.chip, wish.run) {
        (None, true) => return Err(format!("{} is emulated: fly it by `cargo run --release -- pil`", board.name)),
        (chip, run) => chip.as_ref().filter(|_| run),
    };

    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or("cargo".into()));
    cargo.current_dir(root()).args(["build", "--profile", "firmware", "--target", TARGET, "--package"]);
    cargo.args([&board.package, "--bin", &board.image]).args(&wish.options);
    if let Some(vehicle) = &wish.vehicle {
        cargo.env("VEHICLE", vehicle);
    }
    if !succeeds(&mut cargo, "cargo")? {
        return Ok(ExitCode::FAILURE);
    }
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    let image = target.join(TARGET).join("firmware").join(&board.image);
    println!("{}", image.display());
    let Some(chip) = chip else { return Ok(ExitCode::SUCCESS) };
    let flashed = succeeds(Command::new("probe-rs").args(["run", "--chip", chip]).arg(&image), "probe-rs")?;
    Ok(if flashed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs a command; true if it succeeds.
fn succeeds(command: &mut Command, name: &str) -> Result<bool, String> {
    command.status().map(|status| status.success()).map_err(|error| format!("{name}: {error}"))
}

impl Wish {
    /// Reads the arguments; none if they ask for help.
    fn read(mut arguments: impl Iterator<Item = String>) -> Result<Option<Self>, String> {
        let mut wish = Wish::default();
        match arguments.next().as_deref() {
            Some("fw") => (),
            Some("-h" | "--help") | None => return Ok(None),
            Some(other) => return Err(format!("\"{other}\" is no command; cargo xtask --help")),
        }
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "-h" | "--help" => return Ok(None),
                "--run" => wish.run = true,
                "--vehicle" => wish.vehicle = Some(arguments.next().ok_or("--vehicle: a name or a path is missing")?),
                "--" => wish.options.extend(arguments.by_ref()),
                option if option.starts_with('-') => return Err(format!("{option} is no option; cargo xtask --help")),
                _ if wish.board.is_empty() => wish.board = argument,
                _ => return Err(format!("one board at a time: \"{argument}\" is one too many")),
            }
        }
        if wish.board.is_empty() { Ok(None) } else { Ok(Some(wish)) }
    }
}

/// Returns all boards by name.
fn boards() -> io::Result<Vec<Board>> {
    let mut boards = Vec::new();
    for entry in fs::read_dir(root().join("boards"))? {
        let folder = entry?.path();
        let manifest = folder.join("Cargo.toml");
        if let (Some(name), true) = (folder.file_name(), manifest.is_file()) {
            boards.push(Board::read(&name.to_string_lossy(), &fs::read_to_string(manifest)?));
        }
    }
    boards.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(boards)
}

impl Board {
    fn read(name: &str, manifest: &str) -> Self {
        // The manifests are ours: a key, " = " and a text stand on one line.
        let value = |section: &str, key: &str| {
            let lines =
                manifest.lines().skip_while(|line| *line != section).skip(1).take_while(|line| !line.starts_with('['));
            let texts = lines.filter_map(|line| line.strip_prefix(key)?.strip_prefix(" = \"")?.strip_suffix('"'));
            texts.map(str::to_owned).next()
        };
        Board {
            name: name.to_owned(),
            package: value("[package]", "name").unwrap_or_default(),
            image: value("[[bin]]", "name").unwrap_or_default(),
            chip: value("[package.metadata.board]", "chip"),
        }
    }
}

/// The workspace's root.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<Option<Wish>, String> {
        Wish::read(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn every_board_has_a_package_and_an_image_of_its_own() {
        let boards = boards().expect("readable");
        assert!(boards.len() >= 3);
        for board in &boards {
            assert_eq!(board.package, format!("board-{}", board.name));
            let same = boards.iter().filter(|other| other.image == board.image).count();
            assert!(!board.image.is_empty() && same == 1, "{}: {}", board.name, board.image);
            assert_eq!(board.chip.is_none(), board.name == "emulated");
        }
    }

    #[test]
    fn wishes_are_read() {
        let wish = read("fw stm32h743 --vehicle racer --run -- --locked").expect("valid").expect("no help");
        let options = vec!["--locked".to_owned()];
        assert_eq!(wish, Wish { board: "stm32h743".into(), vehicle: Some("racer".into()), run: true, options });
        for help in ["", "--help", "fw", "fw --help", "fw stm32h743 -h"] {
            assert_eq!(read(help), Ok(None), "{help}");
        }
        for wrong in ["flash", "fw a b", "fw a --fast", "fw a --vehicle"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn an_unknown_board_is_answered_by_a_list() {
        let error = run(["fw", "stm32f1"].map(str::to_owned).into_iter()).expect_err("unknown");
        assert!(error.contains("\"stm32f1\"") && error.contains("emulated, stm32f405, stm32h743"), "{error}");
    }
}
