//! Replays a board's exact log on this machine, and compares every bit.

use crate::check::check;
use afbc_log::exact::{Frames, ReplayStep, Replayer};
use afbc_onboard::Configuration;
use std::error::Error;

/// Replays a log of the image's default vehicle, and fails at the first tick that differs.
pub fn check_log(log: &[u8]) -> Result<(), Box<dyn Error>> {
    let mut replayer = Replayer::new(Configuration::default())?;
    let mut frames = Frames::default();
    let (mut ticks, mut flown) = (0_u32, 0_u32);
    for record in log.iter().filter_map(|byte| frames.take(*byte)) {
        match replayer.take(&record) {
            ReplayStep::Nothing => {}
            ReplayStep::Same(report) => {
                ticks += 1;
                flown += u32::from(report.mode.armed());
            }
            ReplayStep::Differs(difference, _) => return Err(format!("after {ticks} ticks: {difference:?}").into()),
        }
    }
    println!("{ticks} ticks, {flown} of them armed, give the same results again to the last bit");
    check(frames.damaged() == 0, &format!("{} damaged frames of the log", frames.damaged()))?;
    // An empty log has no difference either, so a minimum number of ticks is required.
    check(ticks > 1_000, "a log")
}
