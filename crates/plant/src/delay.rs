//! Delay by whole steps.

use alloc::{vec, vec::Vec};

/// Returns `delay_s` in steps of `step_s`, rounded.
pub(crate) fn whole_steps(delay_s: f64, step_s: f64) -> usize {
    libm::round(delay_s / step_s) as usize
}

/// Ring buffer that returns each value a fixed number of steps later.
#[derive(Clone, Debug)]
pub(crate) struct DelayLine<T> {
    ring: Vec<T>,
    oldest: usize,
}

impl<T: Copy> DelayLine<T> {
    /// Creates a delay line filled with `past`.
    pub(crate) fn new(steps: usize, past: T) -> Self {
        DelayLine { ring: vec![past; steps], oldest: 0 }
    }

    /// Fills the delay line with `past`.
    pub(crate) fn refill(&mut self, past: T) {
        self.ring.fill(past);
    }

    /// Stores `now` and returns the oldest value.
    #[inline]
    pub(crate) fn pass(&mut self, now: T) -> T {
        // Without a slot there is no delay.
        let Some(slot) = self.ring.get_mut(self.oldest) else { return now };
        let then = core::mem::replace(slot, now);
        self.oldest += 1;
        if self.oldest == self.ring.len() {
            self.oldest = 0;
        }
        then
    }
}
