//! Ring of past states, so that each measurement is compared with the state at its own time.
//!
//! A correction of the present state also corrects the past states; otherwise the next late measurement would report
//! the same error again and correct it twice. The corrections are not written into every entry. Their sum is itself an
//! error (theta, v, p) that follows the filter's equations ([`crate::horizon`]):
//!
//! ```text
//! theta' = theta        v' = v - S x theta        p' = p + T v
//! ```
//!
//! Entries are stored without corrections. A lookup of an entry that is tau old adds the present sum, propagated back
//! to the entry's time: v + S x theta and p - tau v - D x theta.

use crate::rotation::{identity, normalized, renormalized};
use afbc_control::math::abs_max;
use nalgebra::{Quaternion, Vector3};

/// Number of entries: 284 ms at 4 ms each, since a measurement of 250 ms may still wait for its turn.
const ENTRIES: usize = 72;
/// Sum of corrections above which all entries are rewritten: position \[m\] and velocity \[m/s\] for precision,
/// rotation \[rad\] for linearity.
const SHIFT_MAX: f32 = 8.0;
const TURN_MAX: f32 = 0.1;

/// State at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PastState {
    /// Lowest 32 bits of the time \[us\].
    pub(crate) at_us: u32,
    pub(crate) attitude: Quaternion<f32>,
    pub(crate) velocity: Vector3<f32>,
    pub(crate) position: Vector3<f32>,
}

/// Sum of the corrections.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CorrectionSum {
    /// Exact rotation.
    attitude: Quaternion<f32>,
    /// Linear rotation since the entries were last rewritten.
    theta: Vector3<f32>,
    velocity: Vector3<f32>,
    position: Vector3<f32>,
}

const NOTHING: PastState = PastState {
    at_us: 0,
    attitude: Quaternion::new(1.0, 0.0, 0.0, 0.0),
    velocity: Vector3::new(0.0, 0.0, 0.0),
    position: Vector3::new(0.0, 0.0, 0.0),
};

/// Ring of past states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StateHistory {
    entries: [PastState; ENTRIES],
    /// Index of the newest entry.
    newest: u32,
    filled: u32,
    shift: CorrectionSum,
}

impl Default for StateHistory {
    fn default() -> Self {
        let zero = Vector3::zeros();
        let shift = CorrectionSum { attitude: identity(), theta: zero, velocity: zero, position: zero };
        StateHistory { entries: [NOTHING; ENTRIES], newest: 0, filled: 0, shift }
    }
}

impl StateHistory {
    /// Deletes all entries and corrections.
    pub(crate) fn clear(&mut self) {
        self.filled = 0;
        let zero = Vector3::zeros();
        self.shift = CorrectionSum { attitude: identity(), theta: zero, velocity: zero, position: zero };
    }

    /// Returns the entry stored `back` entries before the newest, without corrections.
    #[inline]
    fn entry(&self, back: u32) -> Option<&PastState> {
        let place = if back <= self.newest { self.newest - back } else { self.newest + ENTRIES as u32 - back };
        self.entries.get(place as usize).filter(|_| back < self.filled)
    }

    /// Propagates the sum of corrections by `time_s`, in which specific force has changed the velocity by `thrust`.
    pub(crate) fn advance(&mut self, time_s: f32, thrust: &Vector3<f32>) {
        let change = thrust.cross(&self.shift.theta);
        self.shift.position += (self.shift.velocity - change * 0.5) * time_s;
        self.shift.velocity -= change;
    }

    /// Stores the present state.
    pub(crate) fn store(&mut self, state: &PastState) {
        let raw = PastState {
            at_us: state.at_us,
            attitude: self.shift.attitude.conjugate() * state.attitude,
            velocity: state.velocity - self.shift.velocity,
            position: state.position - self.shift.position,
        };
        self.newest = if self.newest + 1 < ENTRIES as u32 { self.newest + 1 } else { 0 };
        if let Some(place) = self.entries.get_mut(self.newest as usize) {
            *place = raw;
        }
        self.filled = (self.filled + 1).min(ENTRIES as u32);
    }

    /// Adds a correction of the present state: the rotation in the earth frame, exact as `turn` and linear as `theta`,
    /// velocity and position.
    pub(crate) fn correct(
        &mut self,
        turn: &Quaternion<f32>,
        theta: &Vector3<f32>,
        velocity: &Vector3<f32>,
        position: &Vector3<f32>,
    ) {
        self.shift.attitude = renormalized(&(turn * self.shift.attitude));
        self.shift.theta += theta;
        self.shift.velocity += velocity;
        self.shift.position += position;
    }

    /// Returns true if the corrections are so large that [`settle`](Self::settle) is due.
    pub(crate) fn is_unsettled(&self) -> bool {
        abs_max(&self.shift.velocity) > SHIFT_MAX
            || abs_max(&self.shift.position) > SHIFT_MAX
            || abs_max(&self.shift.theta) > TURN_MAX
    }

    /// Writes the corrections of position and velocity into all entries.
    #[cold]
    #[inline(never)]
    pub(crate) fn settle(&mut self, gravity: f32) {
        let Some(newest) = self.newest_raw() else { return };
        let shift = self.shift;
        for entry in &mut self.entries {
            let (velocity, position) = shift.of(entry, &newest, gravity);
            entry.velocity += velocity;
            entry.position += position;
        }
        let zero = Vector3::zeros();
        // The attitude stays in the sum, because a sum of rotations does not grow beyond a unit quaternion.
        (self.shift.theta, self.shift.velocity, self.shift.position) = (zero, zero, zero);
    }

    /// Returns the newest entry without corrections.
    pub(crate) fn newest_raw(&self) -> Option<PastState> {
        self.entry(0).copied()
    }

    /// Returns the newest entry with corrections.
    #[inline]
    pub(crate) fn newest(&self) -> Option<PastState> {
        self.entry(0).map(|entry| PastState {
            at_us: entry.at_us,
            attitude: self.shift.attitude * entry.attitude,
            velocity: entry.velocity + self.shift.velocity,
            position: entry.position + self.shift.position,
        })
    }

    /// Returns `raw` with corrections, `None` before the first entry.
    #[inline]
    pub(crate) fn corrected(&self, raw: &PastState, gravity: f32) -> Option<PastState> {
        let (velocity, position) = self.shift.of(raw, self.entry(0)?, gravity);
        Some(PastState {
            at_us: raw.at_us,
            attitude: self.shift.attitude * raw.attitude,
            velocity: raw.velocity + velocity,
            position: raw.position + position,
        })
    }

    /// Returns the velocity change by specific force from `raw` to the newest entry.
    pub(crate) fn thrust_since(&self, raw: &PastState, gravity: f32) -> Vector3<f32> {
        match (self.newest(), self.corrected(raw, gravity)) {
            (Some(newest), Some(past)) => motion_between(&newest, &past, gravity).1,
            _ => Vector3::zeros(),
        }
    }

    /// Returns the interpolated state at `at_us` without corrections, `None` if it is before the oldest or after the
    /// newest entry.
    pub(crate) fn at(&self, at_us: u32) -> Option<PastState> {
        let newest = self.entry(0)?;
        // As a signed number the age is right even when the 32-bit time wraps.
        let age = |entry: &PastState| entry.at_us.wrapping_sub(at_us) as i32;
        if age(newest) < 0 {
            return None;
        }
        if age(newest) == 0 {
            return Some(*newest);
        }
        // Bisection finds the last entry before `at_us` and the first entry after it.
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
        Some(between(self.entry(earlier)?, self.entry(later)?, at_us))
    }
}

impl CorrectionSum {
    /// Returns the corrections of velocity and position at the time of `raw`. Both entries are without corrections.
    #[inline]
    fn of(&self, raw: &PastState, newest: &PastState, gravity: f32) -> (Vector3<f32>, Vector3<f32>) {
        let (tau_s, thrust, distance) = motion_between(newest, raw, gravity);
        (self.velocity + thrust.cross(&self.theta), self.position - self.velocity * tau_s - distance.cross(&self.theta))
    }
}

/// Returns tau \[s\], S and D from `past` to `present` ([`crate::horizon`]).
#[inline]
pub(crate) fn motion_between(present: &PastState, past: &PastState, gravity: f32) -> (f32, Vector3<f32>, Vector3<f32>) {
    let tau_s = present.at_us.wrapping_sub(past.at_us) as i32 as f32 * 1e-6;
    let mut thrust = present.velocity - past.velocity;
    thrust.z += gravity * tau_s;
    let mut distance = present.velocity * tau_s - (present.position - past.position);
    distance.z += 0.5 * gravity * tau_s * tau_s;
    (tau_s, thrust, distance)
}

/// Interpolates between two entries: the position as Hermite's cubic with both velocities, the rest linearly.
fn between(a: &PastState, b: &PastState, at_us: u32) -> PastState {
    // Above zero: `at_us` is at or after `a` and before `b`.
    let span_us = b.at_us.wrapping_sub(a.at_us) as f32;
    let x = at_us.wrapping_sub(a.at_us) as f32 / span_us;
    let span_s = span_us * 1e-6;
    // q and -q are the same attitude; the interpolation must use the nearer one.
    let nearer = if a.attitude.dot(&b.attitude) < 0.0 { -b.attitude } else { b.attitude };
    // Deviation of each end's velocity from the straight line between the positions.
    let chord = b.position - a.position;
    let bend = |velocity: &Vector3<f32>| velocity * span_s - chord;
    let (from, to) = (bend(&a.velocity), bend(&b.velocity));
    PastState {
        at_us,
        attitude: normalized(&(a.attitude * (1.0 - x) + nearer * x)),
        velocity: a.velocity + (b.velocity - a.velocity) * x,
        position: a.position + chord * x + (from * (1.0 - x) - to * x) * (x * (1.0 - x)),
    }
}
