//! Low-priority monitoring: logs tick durations, stack depth and bad frames to the debugger once per second.

use crate::{comms, control, executors};
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m_rt::STACK_PAINT_VALUE;
use embassy_executor::SendSpawner;
use embassy_time::{Instant, Timer};

/// Period of the task \[us\].
const EVERY_US: u64 = 1_000_000;

static STACK_BYTES: AtomicU32 = AtomicU32::new(0);

/// Returns the largest stack depth so far, all interrupts included, at most a second old \[bytes\].
pub fn stack_bytes() -> u32 {
    STACK_BYTES.load(Ordering::Relaxed)
}

/// Starts the housekeeping task.
pub fn spawn(spawner: SendSpawner) {
    spawner.spawn(executors::once(task()));
}

#[embassy_executor::task]
async fn task() {
    loop {
        // The addition wraps, because an overflow check (after 585,000 years) would be a panic.
        Timer::at(Instant::from_micros(Instant::now().as_micros().wrapping_add(EVERY_US))).await;
        STACK_BYTES.store(deepest_stack(), Ordering::Relaxed);
        let [last, longest] = control::cycles();
        defmt::info!(
            "tick {=u32} cycles, longest {=u32}; stack {=u32} bytes; {=u32} bad frames",
            last,
            longest,
            stack_bytes(),
            comms::bad_frames(),
        );
    }
}

/// Returns the number of stack bytes that no longer hold the value painted at start-up.
#[expect(unsafe_code, reason = "linker symbols bound the stack, and no object uses its free part")]
#[inline(never)]
fn deepest_stack() -> u32 {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let (mut word, top) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: every word from _stack_end up to _stack_start is RAM (memory.x); volatile, since interrupts write the
    // stack.
    while word < top && unsafe { word.read_volatile() } == STACK_PAINT_VALUE {
        // SAFETY: the pointer stays within the stack's region or one past its end.
        word = unsafe { word.add(1) };
    }
    // The subtraction cannot underflow, since the search for the first changed word ends at `top`.
    (top as usize - word as usize) as u32
}
