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

/// Run a recorded flight through the estimator, and compare with the estimate in the log; with --exact, run it through
/// all of the firmware's code, and compare to the last bit
///
/// The log is a PX4 ULog, or a CSV of PX4-ECL's replay tests with PX4's estimate in <name>_ekf2.csv. The log must have
/// the inertial sensor's samples; other missing data is reported. With --exact, the log is an exact log of this
/// firmware (docs/exact-log.md); exits with 1 if a tick's result differs from the log.
#[derive(Args, Debug)]
pub(crate) struct ReplayArgs {
    /// Path of the log
    log: PathBuf,

    /// Time of the log from which on the estimates are compared [default: 10 s after the estimator has started; half of
    /// the remaining log if that is shorter]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "exact")]
    from: Option<f64>,

    /// Heading error caused by the vehicle's own magnetic field, as a standard deviation; 0 for a perfectly calibrated
    /// magnetometer [default: computed from the field in the log]
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
    seconds.ok_or_else(|| "the time must be a number of seconds, 0 or more".to_owned())
}

fn compass_error(text: &str) -> Result<f32, String> {
    let range = Settings::MAG_SLOW.range;
    let error = text.parse().ok().filter(|error: &f32| (range.min..=range.max).contains(&f64::from(*error)));
    error.ok_or_else(|| format!("the error must be a number of rad, {} to {}", range.min, range.max))
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
            return Err(FileError::whole(&shown, format!("{problem}; record a log that begins at rest")).into());
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
