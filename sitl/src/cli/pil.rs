//! `sitl pil`: the processor in the loop.

use super::in_the_loop::{Flying, Recorder, outcome};
use super::target::Target;
use super::terminal::{Failure, print};
use afbc_sim::flight::Sample;
use afbc_sim::in_the_loop::{Comparison, Pace, Station, Twins, fly};
use clap::Args;
use pil::{Emulator, Image};
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

impl Pil {
    /// Builds, flies, prints.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let scenario = self.flying.scenario(&self.scenario)?;
        let mut recorder = Recorder::new(&scenario, &self.flying)?;
        let image = self.image.map_or_else(|| Image::Pil.build(), Ok)?;
        let mut twins = Twins::new(Emulator::start(&image)?)?;

        let start = Instant::now();
        let observe = |sample: &Sample| recorder.observe(sample);
        let end = fly(&scenario, &mut Station::new(), &mut twins, Pace::LOCKSTEP, observe)?;
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
