//! The firmware's machine code on an emulated Cortex-M4F flies the paper's flight with gusts and uncertainty. In 60,000
//! control ticks, no bit differs from the same code on the host.
#![allow(clippy::expect_used, clippy::panic, reason = "a test that cannot go on should say why")]

use afbc_hil::{Host, LoopEnd, MessagePeriods, Station, fly};
use afbc_plant::PlantModel;
use afbc_scenario::case::Case;
use afbc_scenario::paper::scenario;
use core::ops::ControlFlow;
use pil::budget::TICK_INSTRUCTIONS_MAX;
use pil::{Emulator, FirmwareImage, LockstepPair};
use std::io::Write as _;

/// Returns the emulator. Returns none, with a message on the terminal, if the test must be skipped. Under CI nothing
/// may be skipped.
fn emulator_or_skip() -> Option<Emulator> {
    match FirmwareImage::Pil.find().and_then(|image| Emulator::start(&image)) {
        Ok(emulator) => Some(emulator),
        Err(error) if error.is_missing() && std::env::var_os("CI").is_none() => {
            // println! would not do, since the test harness captures it.
            let _ = writeln!(std::io::stderr(), "SKIPPED, nothing was tested: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn the_papers_flight_is_the_hosts_bit_for_bit() {
    let Some(emulator) = emulator_or_skip() else { return };
    let mut lockstep = LockstepPair::new(emulator, Host::new().expect("in range"));
    let paper = scenario(PlantModel::Simplified, Case::DEFAULT).expect("in range");
    let end = fly(&paper, &mut Station::new(), &mut lockstep, MessagePeriods::LOCKSTEP, |_| ControlFlow::Continue(()));
    assert_eq!(end.expect("flown"), LoopEnd { lost: None, interrupted: false, disarmed: true });

    let comparison = lockstep.comparison();
    println!("{comparison:#?}");
    assert!(comparison.armed_ticks > 60_000, "{comparison:?}");
    assert!(comparison.bits > 60_000 * 8 * 93, "every tick sends rotor commands: {comparison:?}");
    assert_eq!(
        comparison.first_difference, None,
        "unless the image is older than the source (cargo fw-pil): {comparison:?}"
    );
    assert_eq!((comparison.differing_ticks, comparison.differing_bits), (0, 0));
    assert_eq!(comparison.late_ticks, 0);
    // Checks the budget of docs/budgets.md in the flight with the most chatter. Instructions are counted, so every run
    // gives the same number.
    assert!(comparison.instructions.max() <= f64::from(TICK_INSTRUCTIONS_MAX), "{comparison:?}");
}
