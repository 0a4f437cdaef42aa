//! What LED and buzzer show, from the links' task, which sees every tick's report, to the board's task that drives
//! them.

pub use afbc_onboard::indicator::IndicatorSignals;

use crate::vehicle::Report;
use afbc_onboard::indicator::{Indication, Indicator, STEP_US};
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_time::{Instant, Timer};

/// Without a report for so long, a task has failed \[ms\].
const SILENT_MS: u32 = 500;

/// What was reported last, as its index in [`Indication::ALL`] plus 1, and in the bits above when \[ms\]; 0 for
/// nothing.
static LAST: AtomicU32 = AtomicU32::new(0);

/// Notes a tick's report.
pub(crate) fn put(report: &Report) {
    let indication = Indication::of(report);
    let number = Indication::ALL.iter().position(|one| *one == indication).map_or(0, |at| at as u32 + 1);
    // One word, since the reader, of a lower priority, could else mix the halves of two reports.
    LAST.store(milliseconds(report.time_us) << 3 | number, Ordering::Relaxed);
}

/// Returns what is to be shown at `now_us`.
fn indication(now_us: u64) -> Indication {
    let last = LAST.load(Ordering::Relaxed);
    let Some(at) = (last & 7).checked_sub(1) else { return Indication::Starting };
    // Both wrap together.
    let age_ms = (milliseconds(now_us) << 3).wrapping_sub(last & !7) >> 3;
    if age_ms > SILENT_MS {
        return Indication::Fault;
    }
    Indication::ALL.get(at as usize).copied().unwrap_or_default()
}

fn milliseconds(us: u64) -> u32 {
    (us / 1000) as u32
}

/// Drives LED and buzzer for ever by `show`.
pub async fn run(mut show: impl FnMut(IndicatorSignals)) -> ! {
    let mut indicator = Indicator::default();
    loop {
        let now_us = Instant::now().as_micros();
        show(indicator.signals(now_us, indication(now_us)));
        // Wrapping, without a check for an overflow after 585,000 years that could panic.
        Timer::at(Instant::from_micros(now_us.wrapping_add(STEP_US / 2))).await;
    }
}
