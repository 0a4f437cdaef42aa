//! `sitl mcap` and `sitl fly --mcap`: writes logs as MCAP.

use super::terminal::{CommandError, print, say};
use afbc_files::OutputFile;
use afbc_replay::mcap::convert;
use clap::Args;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Convert a ULog, from --ulog or PX4, to MCAP, for Foxglove, PlotJuggler, Rerun and ROS 2's tools
#[derive(Args, Debug)]
pub(crate) struct McapArgs {
    /// Path of the log
    log: PathBuf,

    /// New file to write [default: the log's name with .mcap, in the current folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl McapArgs {
    /// Converts the log.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let beside = || PathBuf::from(self.log.file_name().unwrap_or_default()).with_extension("mcap");
        let path = self.out.clone().unwrap_or_else(beside);
        let line = converted(&self.log, &OutputFile::new(&path, "--out")?)?;
        print(&format!("{line}\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Converts a log, and returns a line about the result. Leaves no file behind if it fails.
fn converted(log: &Path, output: &OutputFile) -> Result<String, CommandError> {
    let mut bytes = Vec::new();
    let summary = convert(log, Cursor::new(&mut bytes))?;
    output.write(|out| out.write_all(&bytes))?;
    let damaged = match summary.damaged {
        0 => String::new(),
        pieces => format!("; {pieces} pieces of the log are damaged, and left out"),
    };
    let path = output.path().display();
    Ok(format!("{path}: MCAP, {} messages of {} topics{damaged}", summary.messages, summary.topics))
}

/// MCAP file of a flight, converted from its ULog after the flight.
pub(super) struct FlightMcap {
    output: OutputFile,
    /// ULog to convert.
    ulog: PathBuf,
    /// The same ULog, if it is only temporary.
    _temporary: Option<TemporaryFile>,
}

/// File that is removed when dropped.
struct TemporaryFile(PathBuf);

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        // The file may not exist.
        let _ = fs::remove_file(&self.0);
    }
}

impl FlightMcap {
    /// Plans the MCAP file at `path`, if any. Sets `ulog` to a temporary file if the flight's ULog was not requested.
    pub(super) fn plan(path: Option<PathBuf>, ulog: &mut Option<PathBuf>) -> Result<Option<Self>, CommandError> {
        let Some(path) = path else { return Ok(None) };
        // The process id keeps two simultaneous flights from sharing the file.
        let temporary = ulog.is_none().then(|| path.with_extension(format!("{}.ulg", std::process::id())));
        let output = OutputFile::new(&path, "--mcap")?;
        let ulog = ulog.get_or_insert_with(|| temporary.clone().unwrap_or_default()).clone();
        Ok(Some(FlightMcap { output, ulog, _temporary: temporary.map(TemporaryFile) }))
    }

    /// Converts the log.
    pub(super) fn finish(self) -> Result<(), CommandError> {
        say(&converted(&self.ulog, &self.output)?);
        Ok(())
    }
}
