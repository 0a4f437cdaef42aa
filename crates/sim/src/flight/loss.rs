//! When a vehicle counts as lost.
//!
//! It is lost where it cannot be controlled any more, tilted beyond 90 degrees or far away, and where it does not fly
//! although it should: its reference is in the air, and its motors are off, or it stands on the ground. A flight core
//! that brings the vehicle down since the scenario takes its measurements away does what it is for; such a flight is
//! not lost.

use super::sample::Sample;
use core::f64::consts::FRAC_PI_2;

/// Distance from the reference beyond which a vehicle counts as lost \[m\].
pub const LOST_DISTANCE_M: f64 = 50.0;
/// Longest time for which a vehicle may fall below its reference with its motors off \[s\].
pub const OFF_S: f64 = 0.5;
/// Height of the reference above a vehicle on the ground from which on it should be in the air \[m\].
pub const ALOFT_M: f64 = 0.3;
/// Longest time for which it may be on the ground then \[s\].
pub const GROUNDED_S: f64 = 3.0;
/// Height above the ground, where it stood, from which on it is in the air \[m\].
pub const CLEAR_M: f64 = 0.1;

/// What has become of a vehicle so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
    /// Time from which on a fault may ground it \[s\].
    faulty_from_s: f64,
    /// True if it is brought down by its flight core, after a fault.
    excused: bool,
    /// True if its motors have been on.
    started: bool,
    /// Largest height so far \[m\].
    highest_m: f64,
    /// Time since which it falls below its reference with its motors off \[s\].
    off_since_s: Option<f64>,
    grounded: Option<Grounded>,
}

/// On the ground although the reference is in the air.
#[derive(Clone, Copy, Debug)]
struct Grounded {
    since_s: f64,
    /// Smallest height since then \[m\].
    lowest_m: f64,
}

impl Watch {
    /// Begins at the start of a flight in which nothing fails before `faulty_from_s`.
    pub(super) fn new(faulty_from_s: f64) -> Self {
        Watch {
            faulty_from_s,
            excused: false,
            started: false,
            highest_m: f64::NEG_INFINITY,
            off_since_s: None,
            grounded: None,
        }
    }

    /// Returns why the vehicle counts as lost, if it does. `descends` is true if its flight core brings it down.
    // Inlined, so that of a sample only what is read is ever made.
    #[inline(always)]
    pub(super) fn lost(&mut self, sample: &Sample, descends: bool) -> Option<&'static str> {
        match uncontrolled(sample) {
            None => self.idle(sample, descends),
            reason => reason,
        }
    }

    /// Returns why a vehicle that should fly counts as lost, if it does.
    #[inline(always)]
    fn idle(&mut self, sample: &Sample, descends: bool) -> Option<&'static str> {
        let (motion, reference, time_s) = (&sample.motion, &sample.reference, sample.time_s);
        let height_m = motion.position_m.z;
        let below_m = reference.position_m.z - height_m;
        let touches = sample.telemetry.is_some_and(|telemetry| telemetry.on_ground);
        let off = !sample.action.speeds.0.as_slice().iter().any(|speed| *speed > 0.0);
        self.started |= !off;
        self.highest_m = self.highest_m.max(height_m);
        self.excused |= descends && time_s >= self.faulty_from_s;
        if self.excused {
            return None;
        }
        // A law that lets the vehicle fall does so above its reference, or to end a climb.
        let falls = off && !touches && below_m > 0.0 && motion.velocity_m_s.z < reference.velocity_m_s.z;
        if !falls && !touches && self.grounded.is_none() {
            self.off_since_s = None;
            return None;
        }
        self.off_since_s = falls.then(|| self.off_since_s.unwrap_or(time_s));
        // Feet that bounce do not begin the time anew; a climb clear of the ground does.
        self.grounded = self.grounded.filter(|grounded| height_m < grounded.lowest_m + CLEAR_M);
        if touches {
            self.grounded.get_or_insert(Grounded { since_s: time_s, lowest_m: height_m });
        }
        self.grounded = self.grounded.filter(|_| below_m > ALOFT_M);
        if let Some(grounded) = &mut self.grounded {
            grounded.lowest_m = grounded.lowest_m.min(height_m);
        }
        let off_too_long = self.off_since_s.is_some_and(|since_s| time_s - since_s > OFF_S);
        let grounded = self.grounded.filter(|grounded| time_s - grounded.since_s > GROUNDED_S);
        // The cause first: what has never armed has its motors off in the air, or stands on the ground, as well.
        match grounded {
            _ if (off_too_long || grounded.is_some()) && !self.started => Some("never armed"),
            _ if off_too_long => Some("motors off in the air"),
            Some(Grounded { lowest_m, .. }) if self.highest_m < lowest_m + CLEAR_M => Some("never left the ground"),
            Some(_) => Some("on the ground below its reference"),
            None => None,
        }
    }
}

/// Returns why the vehicle counts as out of control, if it does. Assumption A3 excludes a tilt of 90 degrees.
#[inline]
fn uncontrolled(sample: &Sample) -> Option<&'static str> {
    let eta = &sample.motion.attitude_rad;
    let distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
    let (upright, near) = (eta.x.abs() < FRAC_PI_2 && eta.y.abs() < FRAC_PI_2, distance_m < LOST_DISTANCE_M);
    // A NaN is neither upright nor near.
    match (upright, near) {
        (true, true) => None,
        (false, _) => Some("tilted beyond 90 degrees"),
        (_, false) => Some("more than 50 m from the reference"),
    }
}
