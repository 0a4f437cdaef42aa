//! `sitl replay --exact`: replays an exact log with the firmware's code.

use super::comparison_output::show;
use super::interrupt;
use super::json::{self, JsonArgs};
use super::output_folder::OutputFolderArgs;
use super::progress::CommandProgress;
use super::terminal::{CommandError, print, say};
use afbc_replay::exact::{SettingChange, replay};
use afbc_report::exact as report;
use afbc_report::exact::{ReplayedLog, problem, table, write};
use afbc_scenario::vehicle_named;
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Unit of progress \[bytes\].
const KB: u64 = 1024;
/// Logs up to this size, about three minutes of flight, show no progress.
const QUIET_KB: u64 = 16 * 1024;

/// Options of an exact replay.
#[derive(Args, Debug)]
pub(super) struct ExactReplayArgs {
    /// Replay an exact log: run the firmware's own code over the log, and compare every motor command
    #[arg(long)]
    pub(super) exact: bool,

    /// Show the commands that another setting would have given for the same inputs: PARAMETER=VALUE, or law=NAME; may
    /// be repeated
    #[arg(long = "change", value_name = "KEY=VALUE", requires = "exact")]
    changes: Vec<SettingChange>,

    /// Path of the vehicle's file, if the log is not from a built-in vehicle
    #[arg(long, value_name = "VEHICLE", requires = "exact")]
    vehicle: Option<PathBuf>,
}

impl ExactReplayArgs {
    /// Replays the log, writes the results and prints them.
    pub(super) fn run(&self, path: &Path, place: &OutputFolderArgs, json: JsonArgs) -> Result<ExitCode, CommandError> {
        let vehicle = self.vehicle.as_deref().map(vehicle_named).transpose()?;
        let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        let all = path.metadata().map_or(0, |metadata| metadata.len()) / KB;
        let progress =
            if all > QUIET_KB { CommandProgress::new(&name, "KB", all, 0) } else { CommandProgress::hidden() };
        let mut rest = 0;
        let replayed = replay(path, vehicle.as_ref(), &self.changes, |bytes| {
            rest += bytes;
            progress.add(rest / KB);
            rest %= KB;
        })?;
        drop(progress);
        let log = ReplayedLog { name: &name, replay: &replayed };
        if replayed.comparison.is_some() {
            let folder = place.open(&afbc_report::replay::folder_name(&name))?;
            interrupt::is_too_late();
            let written = write(&folder, &log)?;
            show(&folder, written.len(), json, |out| report::json(out, &log), || table(&log))?;
        } else if json.json {
            json::print_written(|out| report::json(out, &log))?;
        } else {
            print(&table(&log))?;
        }
        let problem = problem(&log);
        if let Some(problem) = &problem {
            say(&format!("{}: {problem}", path.display()));
        }
        Ok(ExitCode::from(u8::from(problem.is_some())))
    }
}
