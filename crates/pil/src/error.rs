//! Errors between host and emulator.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

/// Reason for which an image could not be built, started or flown.
#[derive(Debug)]
pub enum Error {
    /// QEMU for Arm is not installed.
    NoQemu,
    /// This QEMU does not emulate a suitable STM32F405.
    NoMachine,
    /// The Rust toolchain cannot compile for the processor.
    NoTarget,
    /// The image has not been built.
    NoImage(PathBuf),
    /// Building the image failed; cargo printed the cause.
    Build,
    /// The emulator ended by itself.
    Exited(String),
    /// The firmware gave no answer for this long.
    Silent(Duration),
    /// Unexpected data from the emulator, its debugger or the image.
    Protocol(String),
    /// An operation on files, sockets or processes of the host failed.
    Io(std::io::Error),
}

impl Error {
    /// Returns true if something must be installed or built first: tests may be skipped then.
    pub fn is_missing(&self) -> bool {
        matches!(self, Error::NoQemu | Error::NoMachine | Error::NoTarget | Error::NoImage(_))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::NoQemu => write!(f, "qemu-system-arm is missing: install it; on Debian, scripts/qemu.sh does"),
            Error::NoMachine => {
                write!(f, "this qemu-system-arm is too old: install 8.2 or newer; on Debian, scripts/qemu.sh does")
            }
            Error::NoTarget => write!(
                f,
                "the compiler's target is missing: run rustup target add thumbv7em-none-eabihf; without rustup, set \
                 FW_TOOLCHAIN=$(scripts/thumb-toolchain.sh)"
            ),
            Error::NoImage(path) => write!(f, "{} is missing: build it with cargo fw or cargo fw-pil", path.display()),
            Error::Build => write!(f, "the firmware does not build"),
            Error::Exited(status) => write!(f, "the emulator ended: {status}"),
            Error::Silent(time) => write!(f, "the firmware did not answer for {} s", time.as_secs()),
            Error::Protocol(what) => write!(f, "unexpected answer: {what}"),
            Error::Io(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Error {}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Error::Io(error)
    }
}
