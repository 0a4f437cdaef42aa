//! Whether the rotors turn as they are commanded.

use afbc_control::math::{max, min, sqrt};
use afbc_flight_core::motor::{Curve, Response};
use afbc_types::{ROTORS_MAX, Stamped};

/// Time between two calls of [`RotorMonitor::commanded`] \[s\].
const TICK_S: f32 = 1e-3;
/// Slices of the expected speed's past, and how long one is \[us\]: together at least as long as an answer is under
/// way.
const SLICES: usize = 3;
const SLICE_US: u64 = 10_000;
/// Share of the least speed expected lately below which a rotor does not follow. An empty battery takes a quarter of
/// it; a rotor with half the vehicle's time constant more or less is off by a quarter while it changes.
const SLOW: f32 = 0.5;
/// Share of the greatest above which it does not, and what is added of the largest speed.
const FAST: f32 = 1.5;
const FAST_MARGIN: f32 = 0.15;
/// Share of the least speed below which it counts as stopped, not as out of step.
const STOPPED: f32 = 0.2;
/// Time for which it must not follow before it is told, in two readings at least \[us\].
const PERSISTS_US: u64 = 15_000;
/// Time for which it must follow before it counts as well again \[us\].
const RECOVERS_US: u64 = 200_000;
/// Time from arming in which rotors start \[us\]: until one has turned as commanded, it is not judged.
const START_US: u64 = 1_500_000;

/// How a rotor fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RotorFailure {
    /// It has stopped, or all but.
    Stopped,
    /// It turns, and not as commanded: the motor controller has lost its motor's phase, or something blocks it.
    Desynchronised,
}

/// A change of a rotor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RotorNews {
    /// Its index, in the order of the vehicle's file.
    pub rotor: u8,
    /// How it fails; none if it turns as commanded again.
    pub failure: Option<RotorFailure>,
}

/// A rotor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct WatchedRotor {
    /// Speed expected of the commands \[rad/s\].
    expected: f32,
    /// Least and greatest of it and the command, the newest slice first.
    slices: [[f32; 2]; SLICES],
    /// True once it has turned as commanded since arming.
    has_turned: bool,
    /// Since when its readings say something other than `failure` \[us\].
    since_us: Option<u64>,
    failure: Option<RotorFailure>,
}

/// Compares measured speeds with the commanded ones, as rotors of the vehicle's time constant follow them. A rotor is
/// judged while the vehicle is armed and it is commanded more than its idle speed. From the time at which a rotor turns
/// half as fast as it should, a failure is told within 15 ms and the time between two readings.
#[derive(Clone, Debug, PartialEq)]
pub struct RotorMonitor {
    /// Share of the way to their commands that rotors go in a tick.
    share: f32,
    idle_rad_s: f32,
    fast_margin_rad_s: f32,
    rotors: [WatchedRotor; ROTORS_MAX],
    armed_us: Option<u64>,
    sliced_us: u64,
}

impl RotorMonitor {
    /// Creates it for rotors with this response and curve, which are in their ranges.
    #[must_use]
    pub fn new(response: &Response, curve: &Curve) -> Self {
        let Curve { speed_max_rad_s, linearity: k, idle: u } = *curve;
        RotorMonitor {
            share: min(TICK_S / response.time_constant_s, 1.0),
            // By the curve of the motors: (omega / omega_max)^2 = k u^2 + (1 - k) u.
            idle_rad_s: speed_max_rad_s * sqrt(max(k * u * u + (1.0 - k) * u, 0.0)),
            fast_margin_rad_s: FAST_MARGIN * speed_max_rad_s,
            rotors: [WatchedRotor::default(); ROTORS_MAX],
            armed_us: None,
            sliced_us: 0,
        }
    }

    /// Takes the speeds that a tick at `now_us` commanded \[rad/s\], to be called after each tick.
    pub fn commanded(&mut self, now_us: u64, armed: bool, speeds: &[f32]) {
        if !armed {
            self.armed_us = None;
            self.rotors = [WatchedRotor::default(); ROTORS_MAX];
            return;
        }
        self.armed_us.get_or_insert(now_us);
        let next_slice = now_us.saturating_sub(self.sliced_us) >= SLICE_US;
        if next_slice {
            self.sliced_us = now_us;
        }
        for (rotor, command) in self.rotors.iter_mut().zip(speeds) {
            // It replaces NaN.
            let command = max(*command, 0.0);
            rotor.expected += (command - rotor.expected) * self.share;
            if next_slice {
                rotor.slices.rotate_right(1);
            }
            let [newest, ..] = &mut rotor.slices;
            // A quicker rotor than expected is between this and its command.
            let now = [min(rotor.expected, command), max(rotor.expected, command)];
            let ([least, greatest], [low, high]) = (if next_slice { now } else { *newest }, now);
            *newest = [min(least, low), max(greatest, high)];
        }
    }

    /// Takes a measured speed \[rad/s\]; returns what has changed.
    pub fn measured(&mut self, rotor: u8, speed: Stamped<f32>) -> Option<RotorNews> {
        let (idle_rad_s, margin_rad_s) = (self.idle_rad_s, self.fast_margin_rad_s);
        let armed_us = self.armed_us?;
        let watched = self.rotors.get_mut(usize::from(rotor))?;
        let lowest = watched.slices.iter().fold(f32::INFINITY, |least, [other, _]| min(least, *other));
        let highest = watched.slices.iter().fold(idle_rad_s, |greatest, [_, other]| max(greatest, *other));
        let is_slow = lowest > idle_rad_s && speed.value < SLOW * lowest;
        let is_fast = speed.value > FAST * highest + margin_rad_s;
        let is_well = lowest > idle_rad_s && !is_slow && !is_fast;
        watched.has_turned |= is_well;
        let starts = !watched.has_turned && speed.at_us.saturating_sub(armed_us) < START_US;
        let kind = if speed.value < STOPPED * lowest { RotorFailure::Stopped } else { RotorFailure::Desynchronised };
        let (failure, persists_us) = match watched.failure {
            None if (is_slow || is_fast) && !starts => (Some(kind), PERSISTS_US),
            // One that was out of step on its way to a stop.
            Some(RotorFailure::Desynchronised) if is_slow && kind == RotorFailure::Stopped => (Some(kind), PERSISTS_US),
            Some(_) if is_well => (None, RECOVERS_US),
            _ => {
                watched.since_us = None;
                return None;
            }
        };
        let Some(since_us) = watched.since_us else {
            watched.since_us = Some(speed.at_us);
            return None;
        };
        if speed.at_us.saturating_sub(since_us) < persists_us {
            return None;
        }
        (watched.failure, watched.since_us) = (failure, None);
        Some(RotorNews { rotor, failure })
    }

    /// True if a rotor fails.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.rotors.iter().any(|rotor| rotor.failure.is_some())
    }

    /// Returns how each rotor fails.
    #[must_use]
    pub fn failures(&self) -> [Option<RotorFailure>; ROTORS_MAX] {
        self.rotors.map(|rotor| rotor.failure)
    }
}
