//! Options, log and output that `pil` and `hitl` share.

use super::target::TargetArg;
use super::terminal::CommandError;
use super::vehicle::VehicleArgs;
use afbc_files::OutputFile;
use afbc_hil::{Error, Log, LoopEnd};
use afbc_scenario::{DURATION, Scenario};
use afbc_sim::flight::Sample;
use afbc_sim::metrics::{Accumulator, Metrics};
use afbc_sim::run::FlightResult;
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{JoinHandle, spawn};
use std::time::Duration;

/// Options of every flight in the loop.
#[derive(Args, Clone, Debug)]
pub(crate) struct InTheLoopArgs {
    /// Length of the flight in seconds, instead of the scenario's
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,

    #[command(flatten)]
    pub(super) on: VehicleArgs,

    /// Log the flight to this new CSV file, 100 rows per second
    #[arg(long, value_name = "CSV")]
    out: Option<PathBuf>,
}

/// Formats the end of the flight and, if it was completed, its errors next to those of a flight without a link.
pub(crate) fn outcome(scenario: &Scenario, metrics: &Metrics, end: &LoopEnd) -> Result<String, CommandError> {
    let LoopEnd { lost, interrupted, disarmed } = end;
    let mut text = match (lost, interrupted) {
        (None, false) => {
            let without_link = FlightResult::fly(scenario, &afbc_hil::firmware(scenario)?, u64::MAX)?.metrics;
            afbc_hil::tracking(scenario.duration_s, metrics, &without_link)
        }
        (Some(lost), _) => format!("The vehicle was lost at t = {:.3} s: {}.\n", lost.time_s, lost.reason),
        (None, true) => "The flight was aborted.\n".into(),
    };
    if !disarmed {
        text += "The vehicle did not confirm that it has disarmed.\n";
    }
    Ok(text)
}

impl InTheLoopArgs {
    /// Returns the scenario; fails if the firmware cannot fly it.
    pub(crate) fn scenario(&self, target: &TargetArg) -> Result<Scenario, CommandError> {
        let mut scenario = self.on.put(target.scenario()?)?;
        scenario.duration_s = self.duration.unwrap_or(scenario.duration_s);
        DURATION.check(scenario.duration_s)?;
        afbc_hil::check(&scenario).map_err(|error| format!("{}: {error}", scenario.name))?;
        Ok(scenario)
    }

    /// Returns the output file of the log, if a log is requested.
    pub(crate) fn output(&self) -> Result<Option<OutputFile>, CommandError> {
        Ok(self.out.as_deref().map(|out| OutputFile::new(out, "--out")).transpose()?)
    }
}

/// Log, metrics and progress of a flight.
pub(crate) struct LoopRecorder {
    metrics: Accumulator,
    log: Option<Log>,
    progress: LiveProgress,
    failure: Option<Error>,
}

/// Progress on stderr, drawn by a separate thread, so that a stalled terminal delays no step.
struct LiveProgress {
    steps: Arc<AtomicU64>,
    end: Sender<()>,
    thread: JoinHandle<()>,
}

/// Time between updates of the progress bar.
const PROGRESS_EVERY: Duration = Duration::from_millis(100);

impl LoopRecorder {
    /// Creates the recorder of a flight of `scenario`, and its log file.
    pub(crate) fn new(scenario: &Scenario, output: Option<&OutputFile>) -> Result<Self, CommandError> {
        let create = |output: &OutputFile| Ok::<_, CommandError>(Log::new(output.create()?, scenario.rotors.len())?);
        let log = output.map(create).transpose()?;
        let steps = (scenario.duration_s * 1000.0).round() as u64;
        let progress = LiveProgress::new(steps);
        Ok(LoopRecorder { metrics: Accumulator::default(), log, progress, failure: None })
    }

    /// Records one step; aborts the flight if the step cannot be logged.
    pub(crate) fn observe(&mut self, sample: &Sample) -> ControlFlow<()> {
        self.metrics.add(sample);
        self.progress.steps.store((sample.time_s * 1000.0).round() as u64, Ordering::Relaxed);
        match self.log.as_mut().map_or(Ok(()), |log| log.add(sample)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.failure = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    /// Completes the log and returns the metrics.
    pub(crate) fn finish(self) -> Result<Metrics, Error> {
        self.progress.finish();
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        self.log.map_or(Ok(()), Log::finish)?;
        Ok(self.metrics.finish())
    }
}

impl LiveProgress {
    /// Starts drawing the progress of a flight with this many steps.
    fn new(steps: u64) -> Self {
        let (done, (end, ended)) = (Arc::new(AtomicU64::new(0)), channel());
        let seen = Arc::clone(&done);
        let thread = spawn(move || {
            let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{bar:40} {percent:>3} %, {eta} left");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            while ended.recv_timeout(PROGRESS_EVERY) == Err(RecvTimeoutError::Timeout) {
                bar.set_position(seen.load(Ordering::Relaxed));
            }
            bar.finish_and_clear();
        });
        LiveProgress { steps: done, end, thread }
    }

    /// Removes the progress bar after the flight.
    fn finish(self) {
        drop(self.end);
        // The thread has no result.
        let _ = self.thread.join();
    }
}
