//! Low-priority work: logging, and monitoring of the stack.

use crate::{comms, control, executors};
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m_rt::STACK_PAINT_VALUE;
use embassy_executor::SendSpawner;
use embassy_time::{Instant, Timer};

/// Period \[us\].
const EVERY_US: u64 = 1_000_000;

static STACK_BYTES: AtomicU32 = AtomicU32::new(0);

/// Returns the largest stack depth so far, all interrupts included, as of at most a second ago \[bytes\].
pub fn stack_bytes() -> u32 {
    STACK_BYTES.load(Ordering::Relaxed)
}

/// Starts the task.
pub fn spawn(spawner: SendSpawner) {
    spawner.spawn(executors::once(task()));
}

#[embassy_executor::task]
async fn task() {
    loop {
        // Wrapping, without a check for an overflow after 585,000 years that could panic.
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

/// Returns how many bytes of the stack no longer hold the paint of start-up.
#[expect(unsafe_code, reason = "the stack's bounds are linker symbols, and its unused part belongs to no object")]
#[inline(never)]
fn deepest_stack() -> u32 {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let (mut word, top) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: every word from _stack_end up to _stack_start is RAM (memory.x); volatile, as interrupts push onto it.
    while word < top && unsafe { word.read_volatile() } == STACK_PAINT_VALUE {
        // SAFETY: still within the stack's region, or one past its end.
        word = unsafe { word.add(1) };
    }
    // Not below zero, since the loop ends at `top`.
    (top as usize - word as usize) as u32
}
