//! `sitl pil`: flight of the firmware in the emulator.

use crate::cli::in_the_loop::{InTheLoopArgs, LoopRecorder, outcome};
use crate::cli::interrupt;
use crate::cli::terminal::{CommandError, print};
use afbc_hil::{Host, MessagePeriods, Station};
use afbc_scenario::Scenario;
use afbc_sim::flight::Sample;
use pil::{Emulator, FirmwareImage, LockstepComparison, LockstepPair};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Flies `scenario` with `image`, or with an image built from this source, and prints the results.
pub(super) fn fly(
    scenario: &Scenario,
    flying: &InTheLoopArgs,
    image: Option<PathBuf>,
) -> Result<ExitCode, CommandError> {
    let output = flying.output()?;
    let image = match image {
        Some(image) => image,
        None => FirmwareImage::Pil.build(flying.on.for_firmware()?.as_deref())?,
    };
    let host = scenario.vehicle_file.as_ref().map_or_else(Host::new, Host::for_vehicle)?;
    interrupt::ends_it()?;
    let mut lockstep = LockstepPair::new(Emulator::start(&image)?, host);
    let mut recorder = LoopRecorder::new(scenario, output.as_ref())?;

    let start = Instant::now();
    let observe = |sample: &Sample| recorder.observe(sample);
    let end = afbc_hil::fly(scenario, &mut Station::new(), &mut lockstep, MessagePeriods::LOCKSTEP, observe)?;
    let seconds = start.elapsed().as_secs_f64();
    let comparison = lockstep.comparison();
    interrupt::is_too_late();
    let metrics = recorder.finish()?;

    print(&format!(
        "{}: {} s, {} plant, the firmware on an emulated Cortex-M4F in lockstep\n\n{}\n{}",
        scenario.name,
        scenario.duration_s,
        scenario.model.name(),
        figures(comparison, seconds),
        outcome(scenario, &metrics, &end)?,
    ))?;
    let good = comparison.differing_bits == 0 && end.lost.is_none();
    Ok(ExitCode::from(u8::from(!good)))
}

fn figures(comparison: &LockstepComparison, seconds: f64) -> String {
    let LockstepComparison { ticks, armed_ticks, bits, differing_ticks, differing_bits, .. } = comparison;
    let LockstepComparison { first_difference, instructions, late_ticks, stack_bytes, .. } = comparison;
    let first = first_difference.map_or(String::new(), |tick| format!(", the first is tick {tick}"));
    let [min, mean, max] = [instructions.min(), instructions.mean(), instructions.max()];
    let rate = *ticks as f64 / seconds;
    format!(
        "ticks                {ticks}, {armed_ticks} of them armed, {rate:.0} per second\n\
         differing ticks      {differing_ticks}{first}\n\
         differing bits       {differing_bits} of {bits}\n\
         instructions/tick    min {min:.0}, mean {mean:.0}, max {max:.0}\n\
         late ticks           {late_ticks}\n\
         stack used           {stack_bytes} bytes\n"
    )
}
