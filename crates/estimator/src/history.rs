//! Past states, so that a measurement meets the state of its own time.
//!
//! Corrections of the present hold for the past too. They are not written into 64 entries each time: an entry is stored
//! without the corrections made so far, and gets all those made up to now when it is looked up. That a correction of
//! velocity made the past position differ, and one of tilt the past velocity, is left out here (it is the product of a
//! correction and a delay: 2 mm for 0.02 m/s and 100 ms); the Jacobian of the measurement ([`crate::horizon`]) has it.

use crate::rotation::{identity, normalized, renormalized};
use afbc_control::math::abs_max;
use nalgebra::{Quaternion, Vector3};

/// Number of entries; a power of two.
const ENTRIES: usize = 64;
/// Corrections of position \[m\] and velocity \[m/s\] above which all entries are rewritten, to keep their last bits.
const SHIFT_MAX: f32 = 8.0;

/// State at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Past {
    /// Lowest 32 bits of the time \[us\].
    pub(crate) at_us: u32,
    pub(crate) attitude: Quaternion<f32>,
    pub(crate) velocity: Vector3<f32>,
    pub(crate) position: Vector3<f32>,
}

/// Sum of corrections.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shift {
    attitude: Quaternion<f32>,
    velocity: Vector3<f32>,
    position: Vector3<f32>,
}

const NOTHING: Past = Past {
    at_us: 0,
    attitude: Quaternion::new(1.0, 0.0, 0.0, 0.0),
    velocity: Vector3::new(0.0, 0.0, 0.0),
    position: Vector3::new(0.0, 0.0, 0.0),
};

/// The ring of past states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct History {
    entries: [Past; ENTRIES],
    /// Number of entries ever stored; the newest is at this number less one.
    stored: u32,
    filled: u32,
    shift: Shift,
}

impl Default for History {
    fn default() -> Self {
        let zero = Vector3::zeros();
        let shift = Shift { attitude: identity(), velocity: zero, position: zero };
        History { entries: [NOTHING; ENTRIES], stored: 0, filled: 0, shift }
    }
}

impl History {
    /// Forgets all entries.
    pub(crate) fn clear(&mut self) {
        self.filled = 0;
        let zero = Vector3::zeros();
        self.shift = Shift { attitude: identity(), velocity: zero, position: zero };
    }

    /// Returns the entry stored `back` entries ago, without corrections.
    #[inline]
    fn entry(&self, back: u32) -> Option<&Past> {
        let place = self.stored.wrapping_sub(1).wrapping_sub(back) as usize % ENTRIES;
        self.entries.get(place).filter(|_| back < self.filled)
    }

    /// Stores the state of the present.
    pub(crate) fn store(&mut self, state: &Past) {
        let raw = Past {
            at_us: state.at_us,
            attitude: self.shift.attitude.conjugate() * state.attitude,
            velocity: state.velocity - self.shift.velocity,
            position: state.position - self.shift.position,
        };
        if let Some(place) = self.entries.get_mut(self.stored as usize % ENTRIES) {
            *place = raw;
        }
        self.stored = self.stored.wrapping_add(1);
        self.filled = (self.filled + 1).min(ENTRIES as u32);
    }

    /// Adds a correction of the present: the rotation `turn` in the earth frame, velocity and position.
    pub(crate) fn correct(&mut self, turn: &Quaternion<f32>, velocity: &Vector3<f32>, position: &Vector3<f32>) {
        self.shift.attitude = renormalized(&(turn * self.shift.attitude));
        self.shift.velocity += velocity;
        self.shift.position += position;
    }

    /// True if the corrections have grown so large that [`settle`](Self::settle) is due.
    pub(crate) fn is_unsettled(&self) -> bool {
        abs_max(&self.shift.velocity) > SHIFT_MAX || abs_max(&self.shift.position) > SHIFT_MAX
    }

    /// Writes the corrections of position and velocity into all entries.
    #[cold]
    #[inline(never)]
    pub(crate) fn settle(&mut self) {
        let Shift { velocity, position, .. } = self.shift;
        for entry in &mut self.entries {
            entry.velocity += velocity;
            entry.position += position;
        }
        (self.shift.velocity, self.shift.position) = (Vector3::zeros(), Vector3::zeros());
    }

    /// Returns the newest entry, without corrections.
    pub(crate) fn newest_raw(&self) -> Option<Past> {
        self.entry(0).copied()
    }

    /// Returns the newest entry, corrected.
    #[inline]
    pub(crate) fn newest(&self) -> Option<Past> {
        self.entry(0).map(|entry| self.corrected(entry))
    }

    /// Returns `raw` with all corrections.
    #[inline]
    pub(crate) fn corrected(&self, raw: &Past) -> Past {
        Past {
            at_us: raw.at_us,
            attitude: self.shift.attitude * raw.attitude,
            velocity: raw.velocity + self.shift.velocity,
            position: raw.position + self.shift.position,
        }
    }

    /// Returns the state at `at_us`, interpolated and without corrections, `None` if it is before the oldest or after
    /// the newest entry.
    pub(crate) fn at(&self, at_us: u32) -> Option<Past> {
        let newest = self.entry(0)?;
        let age = |entry: &Past| entry.at_us.wrapping_sub(at_us) as i32;
        if age(newest) < 0 {
            return None;
        }
        if age(newest) == 0 {
            return Some(*newest);
        }
        // The oldest entry after that time, by bisection.
        let (mut later, mut earlier) = (0, self.filled - 1);
        if self.entry(earlier).is_none_or(|oldest| age(oldest) > 0) {
            return None;
        }
        while earlier - later > 1 {
            let middle = later + (earlier - later) / 2;
            if self.entry(middle).is_some_and(|entry| age(entry) > 0) {
                later = middle;
            } else {
                earlier = middle;
            }
        }
        Some(between(self.entry(earlier)?, self.entry(later)?, &self.shift.velocity, at_us))
    }
}

/// Interpolates: the position with both velocities (Hermite's cubic), the others linearly. Positions follow from the
/// corrected velocities, which are those stored and `shift`.
fn between(a: &Past, b: &Past, shift: &Vector3<f32>, at_us: u32) -> Past {
    let span_us = b.at_us.wrapping_sub(a.at_us) as f32;
    let x = at_us.wrapping_sub(a.at_us) as f32 / span_us;
    let span_s = span_us * 1e-6;
    let nearer = if a.attitude.dot(&b.attitude) < 0.0 { -b.attitude } else { b.attitude };
    // What the velocities add to the straight line between the positions.
    let chord = b.position - a.position;
    let bend = |velocity: &Vector3<f32>| (velocity + shift) * span_s - chord;
    let (from, to) = (bend(&a.velocity), bend(&b.velocity));
    Past {
        at_us,
        attitude: normalized(&(a.attitude * (1.0 - x) + nearer * x)),
        velocity: a.velocity + (b.velocity - a.velocity) * x,
        position: a.position + chord * x + (from * (1.0 - x) - to * x) * (x * (1.0 - x)),
    }
}
