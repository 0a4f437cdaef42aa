//! The crystal: its start, and that it has failed.

use core::sync::atomic::{AtomicBool, Ordering};

/// Longest start-up time of a crystal \[ms\]; usually 2.
const START_MS: u32 = 100;

static FAILED: AtomicBool = AtomicBool::new(false);

/// True if the crystal has failed, at the start or in flight, so that arming must be refused.
pub fn has_failed() -> bool {
    FAILED.load(Ordering::Relaxed)
}

/// Records that the crystal has failed.
pub fn fail() {
    FAILED.store(true, Ordering::Relaxed);
}

/// True if a crystal that is turned on already `is_ready` in time; otherwise it has failed. embassy's init would wait
/// for it forever. The core runs `cycles_per_ms` until the clocks are set up.
pub fn starts(cycles_per_ms: u32, is_ready: impl Fn() -> bool) -> bool {
    let starts = (0..START_MS).any(|_| {
        let ready = is_ready();
        if !ready {
            cortex_m::asm::delay(cycles_per_ms);
        }
        ready
    });
    if !starts {
        fail();
    }
    starts
}
