//! Indication of the vehicle's state by LED and buzzer. The link task stores the state of each tick; a task of the
//! board shows it.

pub use afbc_onboard::indicator::IndicatorSignals;

use afbc_onboard::Report;
use afbc_onboard::indicator::{Indication, Indicator, STEP_US};
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_time::{Instant, Timer};

/// A task counts as failed after this time without a report \[ms\].
const SILENT_MS: u32 = 500;

/// Newest indication: in the lowest three bits its index in [`Indication::ALL`] plus 1, above them its time \[ms\]. 0
/// until the first report.
static LAST: AtomicU32 = AtomicU32::new(0);

/// Stores what LED and buzzer must show, according to a tick's report.
pub(crate) fn put(report: &Report) {
    let indication = Indication::of(report);
    let number = Indication::ALL.iter().position(|one| *one == indication).map_or(0, |at| at as u32 + 1);
    // The indication is one word, because a reading task of lower priority could read half of two words.
    LAST.store(milliseconds(report.time_us) << 3 | number, Ordering::Relaxed);
}

/// Returns the indication to show at `now_us`.
fn indication(now_us: u64) -> Indication {
    let last = LAST.load(Ordering::Relaxed);
    let Some(at) = (last & 7).checked_sub(1) else { return Indication::Starting };
    // The stored time and the present time wrap at the same value.
    let age_ms = (milliseconds(now_us) << 3).wrapping_sub(last & !7) >> 3;
    if age_ms > SILENT_MS {
        return Indication::Fault;
    }
    Indication::ALL.get(at as usize).copied().unwrap_or_default()
}

fn milliseconds(us: u64) -> u32 {
    (us / 1000) as u32
}

/// Drives LED and buzzer for ever by calls of `show`.
pub async fn run(mut show: impl FnMut(IndicatorSignals)) -> ! {
    let mut indicator = Indicator::default();
    loop {
        let now_us = Instant::now().as_micros();
        show(indicator.signals(now_us, indication(now_us)));
        // The addition wraps, because an overflow check (after 585,000 years) would be a panic.
        Timer::at(Instant::from_micros(now_us.wrapping_add(STEP_US / 2))).await;
    }
}
