//! Decides when a vehicle counts as lost.
//!
//! A vehicle is lost if it is out of control: tilted beyond 90 degrees, or far from its reference. It is also lost if
//! its reference is in the air while its motors are off or it stands on the ground. A descent by the flight core's
//! failsafe is no loss if the scenario has taken away the measurements: that is the failsafe's purpose.

use super::sample::Sample;
use core::f64::consts::FRAC_PI_2;

/// Distance from the reference beyond which a vehicle counts as lost \[m\].
pub const LOST_DISTANCE_M: f64 = 50.0;
/// Longest time for which a vehicle may fall below its reference with its motors off \[s\].
pub const OFF_S: f64 = 0.5;
/// A vehicle on the ground should be in the air if its reference is higher above it than this \[m\].
pub const ALOFT_M: f64 = 0.3;
/// Longest time for which a vehicle that should be in the air may be on the ground \[s\].
pub const GROUNDED_S: f64 = 3.0;
/// A vehicle has left the ground if it rises by more than this \[m\].
pub const CLEAR_M: f64 = 0.1;

/// Record of a flight, for judging whether the vehicle is lost.
#[derive(Clone, Copy, Debug)]
pub(super) struct LossDetector {
    /// Time of the scenario's first fault that may ground the vehicle \[s\].
    faulty_from_s: f64,
    /// True if the flight core has brought the vehicle down after a fault.
    excused: bool,
    /// True if the motors have been on.
    started: bool,
    /// Largest height so far \[m\].
    highest_m: f64,
    /// Time since which the vehicle falls below its reference with its motors off \[s\].
    off_since_s: Option<f64>,
    grounded: Option<Grounded>,
}

/// A stay on the ground while the reference is in the air.
#[derive(Clone, Copy, Debug)]
struct Grounded {
    since_s: f64,
    /// Smallest height during the stay \[m\].
    lowest_m: f64,
}

impl LossDetector {
    /// Starts the record of a flight without faults before `faulty_from_s`.
    pub(super) fn new(faulty_from_s: f64) -> Self {
        LossDetector {
            faulty_from_s,
            excused: false,
            started: false,
            highest_m: f64::NEG_INFINITY,
            off_since_s: None,
            grounded: None,
        }
    }

    /// Returns the reason for which the vehicle counts as lost; none if it does not. `descends` is true while a
    /// failsafe brings the vehicle down.
    // This function is inlined, so that only the used parts of a sample are ever built.
    #[inline(always)]
    pub(super) fn lost(&mut self, sample: &Sample, descends: bool) -> Option<&'static str> {
        match uncontrolled(sample) {
            None => self.idle(sample, descends),
            reason => reason,
        }
    }

    /// Returns the reason for which a controllable vehicle counts as lost; none if it does not.
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
        // A law may turn the motors off above its reference, or to end a climb.
        let falls = off && !touches && below_m > 0.0 && motion.velocity_m_s.z < reference.velocity_m_s.z;
        if !falls && !touches && self.grounded.is_none() {
            self.off_since_s = None;
            return None;
        }
        self.off_since_s = falls.then(|| self.off_since_s.unwrap_or(time_s));
        // Bouncing feet do not restart the time; a climb clear of the ground does.
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
        // Report the cause first: a vehicle that never armed also meets the other conditions, motors off or on the
        // ground.
        match grounded {
            _ if (off_too_long || grounded.is_some()) && !self.started => Some("never armed"),
            _ if off_too_long => Some("motors off in the air"),
            Some(Grounded { lowest_m, .. }) if self.highest_m < lowest_m + CLEAR_M => Some("never left the ground"),
            Some(_) => Some("on the ground below its reference"),
            None => None,
        }
    }
}

/// Returns the reason for which the vehicle is out of control; none if it is under control. The paper's assumption A3
/// excludes a tilt of 90 degrees.
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
