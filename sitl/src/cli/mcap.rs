//! `sitl mcap`, and `sitl fly --mcap`.

use super::terminal::{Failure, print, say};
use afbc_replay::mcap::convert;
use clap::Args;
use std::fs::{self, File, OpenOptions};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Convert a ULog, of --ulog or of PX4, to MCAP, for Foxglove, PlotJuggler, Rerun and ROS 2's tools
#[derive(Args, Debug)]
pub(crate) struct Mcap {
    /// Path of the log
    log: PathBuf,

    /// File to write, which must not exist [default: the log's name with .mcap, in the current folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Mcap {
    /// Converts.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let beside = || PathBuf::from(self.log.file_name().unwrap_or_default()).with_extension("mcap");
        let path = self.out.clone().unwrap_or_else(beside);
        let line = McapFile::create(path)?.convert(&self.log)?;
        print(&format!("{line}\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// A file that is there, and empty until a log is converted into it.
pub(super) struct McapFile {
    path: PathBuf,
    file: File,
}

impl McapFile {
    fn create(path: PathBuf) -> Result<Self, Failure> {
        let file = OpenOptions::new().write(true).create_new(true).open(&path);
        let file = file.map_err(|error| {
            let path = path.display();
            match error.kind() {
                std::io::ErrorKind::AlreadyExists => {
                    format!("{path}: exists already; choose another file for MCAP, or remove that one")
                }
                _ => format!("{path}: cannot be written ({error}); choose another file for MCAP"),
            }
        })?;
        Ok(McapFile { path, file })
    }

    /// Converts a log, and returns a line on it. Without success the file is gone.
    fn convert(self, log: &Path) -> Result<String, Failure> {
        let Self { path, file } = self;
        let summary = convert(log, BufWriter::new(file)).inspect_err(|_| drop(fs::remove_file(&path)))?;
        let damaged = match summary.damaged {
            0 => String::new(),
            pieces => format!("; {pieces} pieces of the log are damaged, and missing"),
        };
        Ok(format!("{}: MCAP, {} messages of {} topics{damaged}", path.display(), summary.messages, summary.topics))
    }
}

/// The MCAP of a flight, made of its ULog when it has ended.
pub(super) struct FlightMcap {
    file: McapFile,
    /// The log that it is made of.
    ulog: PathBuf,
    /// The same, if nobody has asked for it.
    _temporary: Option<TemporaryFile>,
}

/// A file that is removed in the end.
struct TemporaryFile(PathBuf);

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        // It may never have been there.
        let _ = fs::remove_file(&self.0);
    }
}

impl FlightMcap {
    /// Creates the file at `path`, if there is to be one; `ulog` is then where the flight's log must go.
    pub(super) fn create(path: Option<PathBuf>, ulog: &mut Option<PathBuf>) -> Result<Option<Self>, Failure> {
        let Some(path) = path else { return Ok(None) };
        // With the process's number, so that two flights at once do not share it.
        let temporary = ulog.is_none().then(|| path.with_extension(format!("{}.ulg", std::process::id())));
        let file = McapFile::create(path)?;
        let ulog = ulog.get_or_insert_with(|| temporary.clone().unwrap_or_default()).clone();
        Ok(Some(FlightMcap { file, ulog, _temporary: temporary.map(TemporaryFile) }))
    }

    /// Converts the log.
    pub(super) fn finish(self) -> Result<(), Failure> {
        say(&self.file.convert(&self.ulog)?);
        Ok(())
    }
}
