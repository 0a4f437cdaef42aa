//! `sitl replay`: runs a recorded flight through the estimator.

use super::comparison_output::show;
use super::exact::ExactReplayArgs;
use super::interrupt;
use super::json::JsonArgs;
use super::output_folder::OutputFolderArgs;
use super::terminal::CommandError;
use afbc_estimator::Settings;
use afbc_files::read::FileError;
use afbc_replay::EstimatorStart;
use afbc_report::replay as report;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Run a recorded flight through the estimator, and compare with the estimate in the log; or, with --exact, through all
/// of the firmware's code, to the last bit
///
/// The log is a PX4 ULog, or the CSV of PX4-ECL's replay tests with its estimate beside it in <name>_ekf2.csv. What it
/// lacks is reported; only the inertial sensor's samples must be there. With --exact it is an exact log of this
/// firmware, see docs/exact-log.md; exits with 1 if a tick gives something else than in the log.
#[derive(Args, Debug)]
pub(crate) struct ReplayArgs {
    /// Path of the log
    log: PathBuf,

    /// Compare from this time of the log on [default: 10 s after the estimator has started, or half of a shorter rest]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "exact")]
    from: Option<f64>,

    /// Error of the heading that the vehicle's own field makes, as a standard deviation; 0 for a magnetometer that is
    /// calibrated perfectly [default: what the log's field shows]
    #[arg(long, value_name = "RAD", value_parser = compass_error, conflicts_with = "exact")]
    compass_error: Option<f32>,

    #[command(flatten)]
    exact: ExactReplayArgs,

    #[command(flatten)]
    place: OutputFolderArgs,

    #[command(flatten)]
    json: JsonArgs,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds: Option<f64> = text.parse().ok().filter(|seconds: &f64| *seconds >= 0.0 && seconds.is_finite());
    seconds.ok_or_else(|| "it must be a number of seconds, 0 or more".to_owned())
}

fn compass_error(text: &str) -> Result<f32, String> {
    let range = Settings::MAG_SLOW.range;
    let error = text.parse().ok().filter(|error: &f32| (range.min..=range.max).contains(&f64::from(*error)));
    error.ok_or_else(|| format!("it must be a number of rad, {} to {}", range.min, range.max))
}

impl ReplayArgs {
    /// Reads and replays the log, writes the results and prints them.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        interrupt::ends_it()?;
        if self.exact.exact {
            return self.exact.run(&self.log, &self.place, self.json);
        }
        let shown = self.log.display().to_string();
        let mut recording = afbc_replay::read(&self.log)?;
        recording.mag_slow_rad = self.compass_error.or(recording.mag_slow_rad);
        let replayed = afbc_replay::fly(&recording, self.from)?;
        if let EstimatorStart::Never(why) = replayed.start {
            let problem = format!("the estimator never started ({why}), and the log has no attitude to start from");
            return Err(FileError::whole(&shown, format!("{problem}; record from rest on")).into());
        }
        let name = self.log.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        let folder = self.place.open(&report::folder_name(&name))?;
        interrupt::is_too_late();
        let replay = report::ReplayedRecording { name: &name, recording: &recording, replayed: &replayed };
        let written = report::write(&folder, &replay)?;
        show(&folder, written.len(), self.json, |out| report::json(out, &replay), || report::table(&replay))?;
        Ok(ExitCode::SUCCESS)
    }
}
