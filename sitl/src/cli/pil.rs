//! `sitl pil`: the processor in the loop.

use super::target::Target;
use super::{Failure, print};
use afbc_sim::flight::Sample;
use afbc_sim::in_the_loop::{self, Comparison, End, Error, Log, Pace, Station, Twins};
use afbc_sim::metrics::{Accumulator, Metrics};
use afbc_sim::run::Run;
use afbc_sim::scenario::{DURATION, Scenario};
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pil::{Emulator, Image};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Fly the firmware on an emulated processor in lockstep, and compare every output of every tick with the host's
///
/// QEMU runs the firmware's own machine code (`cargo fw-pil` builds it, and so does this command); the plant, gusts and
/// all, is flown here, and nothing passes between the two but the link's bytes. Exits with 0 only if no bit differs and
/// the vehicle was not lost.
#[derive(Args, Debug)]
pub(crate) struct Pil {
    /// Name of a built-in scenario, or path of a scenario file
    #[arg(default_value = "paper")]
    scenario: Target,

    #[command(flatten)]
    flying: Flying,

    /// Image to fly, instead of building the one that belongs to this source
    #[arg(long, value_name = "ELF")]
    image: Option<PathBuf>,
}

/// Options of every flight in the loop.
#[derive(Args, Clone, Debug)]
pub(crate) struct Flying {
    /// Length of the flight in seconds, instead of the scenario's
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,

    /// Log the flight to this CSV file, 100 rows a second
    #[arg(long, value_name = "CSV")]
    out: Option<PathBuf>,
}

impl Pil {
    /// Builds, flies, prints.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let scenario = self.flying.scenario(&self.scenario)?;
        let mut recorder = Recorder::new(&scenario, &self.flying)?;
        let image = self.image.map_or_else(|| Image::Pil.build(), Ok)?;
        let mut twins = Twins::new(Emulator::start(&image)?)?;

        let start = Instant::now();
        let observe = |sample: &Sample| recorder.observe(sample);
        let end = in_the_loop::fly(&scenario, &mut Station::new(), &mut twins, Pace::LOCKSTEP, observe)?;
        let seconds = start.elapsed().as_secs_f64();
        let comparison = twins.comparison();
        let metrics = recorder.finish()?;

        print(&format!(
            "{}: {} s, {} plant, the firmware on an emulated Cortex-M4F in lockstep\n\n{}\n{}",
            scenario.name,
            scenario.duration_s,
            scenario.model.name(),
            figures(comparison, seconds),
            outcome(&scenario, &metrics, &end)?,
        ))?;
        let good = comparison.differing_bits == 0 && end.lost.is_none();
        Ok(ExitCode::from(u8::from(!good)))
    }
}

fn figures(comparison: &Comparison, seconds: f64) -> String {
    let Comparison { ticks, armed_ticks, bits, differing_ticks, differing_bits, .. } = comparison;
    let Comparison { first_difference, instructions, late_ticks, stack_bytes, .. } = comparison;
    let first = first_difference.map_or(String::new(), |tick| format!(", the first is tick {tick}"));
    let [min, mean, max] = [instructions.min(), instructions.mean(), instructions.max()];
    let rate = *ticks as f64 / seconds;
    format!(
        "ticks                {ticks}, {armed_ticks} of them armed, {rate:.0} a second\n\
         differing ticks      {differing_ticks}{first}\n\
         differing bits       {differing_bits} of {bits}\n\
         instructions a tick  min {min:.0}, mean {mean:.0}, max {max:.0}\n\
         late ticks           {late_ticks}\n\
         stack used           {stack_bytes} bytes\n"
    )
}

/// How the vehicle did beside a flight without a link, if it got to the end, and what else there is to say.
pub(crate) fn outcome(scenario: &Scenario, metrics: &Metrics, end: &End) -> Result<String, Failure> {
    let End { lost, interrupted, disarmed } = end;
    let mut text = match (lost, interrupted) {
        (None, false) => {
            let without_link = Run::fly(scenario, &in_the_loop::firmware(), u64::MAX)?.metrics;
            in_the_loop::tracking(scenario.duration_s, metrics, &without_link)
        }
        (Some(lost), _) => format!("The vehicle was lost at t = {:.3} s: {}.\n", lost.time_s, lost.reason),
        (None, true) => "The flight was broken off.\n".into(),
    };
    if !disarmed {
        text += "The vehicle did not confirm that it has disarmed.\n";
    }
    Ok(text)
}

impl Flying {
    /// The scenario, if the firmware can fly it.
    pub(crate) fn scenario(&self, target: &Target) -> Result<Scenario, Failure> {
        let mut scenario = target.scenario()?;
        scenario.duration_s = self.duration.unwrap_or(scenario.duration_s);
        DURATION.check(scenario.duration_s)?;
        in_the_loop::check(&scenario).map_err(|error| format!("{}: {error}", scenario.name))?;
        Ok(scenario)
    }
}

/// What is kept of a flight, and shown while it lasts.
pub(crate) struct Recorder {
    metrics: Accumulator,
    log: Option<Log>,
    progress: ProgressBar,
    failure: Option<Error>,
}

/// Steps between two looks at the progress bar.
const PROGRESS_EVERY: u64 = 100;

impl Recorder {
    /// For a flight of `scenario`.
    pub(crate) fn new(scenario: &Scenario, flying: &Flying) -> Result<Self, Failure> {
        let create = |path: &PathBuf| Log::create(path).map_err(|error| format!("{}: {error}", path.display()));
        let log = flying.out.as_ref().map(create).transpose()?;
        let steps = (scenario.duration_s * 1000.0).round() as u64;
        let progress = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr());
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %, {eta} left");
        progress.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Ok(Recorder { metrics: Accumulator::default(), log, progress, failure: None })
    }

    /// Takes one step into account; breaks the flight off if it cannot be logged.
    pub(crate) fn observe(&mut self, sample: &Sample) -> ControlFlow<()> {
        self.metrics.add(sample);
        let step = (sample.time_s * 1000.0).round() as u64;
        if step.is_multiple_of(PROGRESS_EVERY) {
            self.progress.set_position(step);
        }
        match self.log.as_mut().map_or(Ok(()), |log| log.add(sample)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.failure = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    /// The figures of merit, once the log is complete.
    pub(crate) fn finish(self) -> Result<Metrics, Error> {
        self.progress.finish_and_clear();
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        self.log.map_or(Ok(()), Log::finish)?;
        Ok(self.metrics.finish())
    }
}
