//! Finds and builds the firmware's images.

use crate::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const TARGET: &str = "thumbv7em-none-eabihf";

/// One of the firmware's two images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirmwareImage {
    /// The image for the board.
    Flight,
    /// The same code, which exchanges bytes with the host once per control tick, for [`crate::Emulator`].
    Pil,
}

impl FirmwareImage {
    const fn name(self) -> &'static str {
        match self {
            FirmwareImage::Flight => "flight",
            FirmwareImage::Pil => "pil",
        }
    }

    /// Returns the path of the last build.
    ///
    /// # Errors
    /// Returns [`Error::NoImage`] if there is no build.
    pub fn find(self) -> Result<PathBuf, Error> {
        let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace().join("target"), PathBuf::from);
        let path = target.join(TARGET).join("firmware").join(self.name());
        if path.is_file() { Ok(path) } else { Err(Error::NoImage(path)) }
    }

    /// Builds the image by its cargo alias and returns its path. `vehicle` is a name in `vehicles/` or an absolute
    /// path; none selects the default vehicle. `FW_TOOLCHAIN`, if set, names the toolchain.
    ///
    /// # Errors
    /// Returns [`Error::NoTarget`] or [`Error::Build`].
    pub fn build(self, vehicle: Option<&Path>) -> Result<PathBuf, Error> {
        let libraries = toolchain("rustc").args(["--print", "target-libdir", "--target", TARGET]).output()?;
        let libraries = PathBuf::from(String::from_utf8_lossy(&libraries.stdout).trim());
        if !libraries.is_dir() {
            return Err(Error::NoTarget);
        }
        let alias = match self {
            FirmwareImage::Flight => "fw",
            FirmwareImage::Pil => "fw-pil",
        };
        let mut cargo = toolchain("cargo");
        match vehicle {
            Some(vehicle) => cargo.env("VEHICLE", vehicle),
            // The host's twin flies the default vehicle.
            None => cargo.env_remove("VEHICLE"),
        };
        let status = cargo.arg(alias).current_dir(workspace()).stdout(Stdio::null()).status()?;
        if status.success() { self.find() } else { Err(Error::Build) }
    }
}

/// Returns a command of the firmware's toolchain.
fn toolchain(tool: &str) -> Command {
    let mut command = Command::new(tool);
    if let Some(toolchain) = std::env::var_os("FW_TOOLCHAIN") {
        command.env("RUSTUP_TOOLCHAIN", toolchain);
    }
    command
}

/// Returns the workspace's root.
fn workspace() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}
