//! A delay of whole steps.

use alloc::{vec, vec::Vec};

/// How many steps of `step_s` are nearest to `delay_s`.
pub(crate) fn whole_steps(delay_s: f64, step_s: f64) -> usize {
    libm::round(delay_s / step_s) as usize
}

/// Hands back what was put in a fixed number of steps ago: a ring buffer.
#[derive(Clone, Debug)]
pub(crate) struct DelayLine<T> {
    ring: Vec<T>,
    oldest: usize,
}

impl<T: Copy> DelayLine<T> {
    /// A line that has held `past` forever.
    pub(crate) fn new(steps: usize, past: T) -> Self {
        DelayLine { ring: vec![past; steps], oldest: 0 }
    }

    /// Forgets everything: the line has held `past` forever.
    pub(crate) fn refill(&mut self, past: T) {
        self.ring.fill(past);
    }

    /// Puts `now` in and takes the oldest out.
    #[inline]
    pub(crate) fn pass(&mut self, now: T) -> T {
        // No slot: no delay.
        let Some(slot) = self.ring.get_mut(self.oldest) else { return now };
        let then = core::mem::replace(slot, now);
        self.oldest += 1;
        if self.oldest == self.ring.len() {
            self.oldest = 0;
        }
        then
    }
}
