//! Checks the crystal's start and records its failure.

use core::sync::atomic::{AtomicBool, Ordering};

/// Longest start-up time of a crystal \[ms\]; usually 2.
const START_MS: u32 = 100;

static FAILED: AtomicBool = AtomicBool::new(false);

/// Returns true if the crystal has failed, at the start or in flight: arming must be refused then.
pub fn has_failed() -> bool {
    FAILED.load(Ordering::Relaxed)
}

/// Records that the crystal has failed.
pub fn fail() {
    FAILED.store(true, Ordering::Relaxed);
}

/// Waits until the crystal, already turned on, `is_ready`. Returns false, and records the failure, if it does not start
/// in time: embassy's init would wait forever. `cycles_per_ms` is the core clock before the clocks are set up.
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
