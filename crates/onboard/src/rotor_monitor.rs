//! Checks that the rotors turn as commanded.

use afbc_control::math::{max, min, sqrt};
use afbc_flight_core::motor::{Curve, Response};
use afbc_types::{ROTORS_MAX, Stamped};

/// Time between two calls of [`RotorMonitor::commanded`] \[s\].
const TICK_S: f32 = 1e-3;
/// Number and length \[us\] of the slices of past expected speeds. Together they cover the delay of a measurement.
const SLICES: usize = 3;
const SLICE_US: u64 = 10_000;
/// A rotor is too slow below this share of the lowest speed expected recently. An empty battery costs a quarter of the
/// speed; a time constant wrong by half costs a quarter while the speed changes.
const SLOW: f32 = 0.5;
/// A rotor is too fast above this share of the highest speed expected recently, plus this share of the largest speed.
const FAST: f32 = 1.5;
const FAST_MARGIN: f32 = 0.15;
/// Share of the lowest expected speed below which a rotor counts as stopped, not as desynchronised.
const STOPPED: f32 = 0.2;
/// Time for which a rotor must not follow before it is reported, in at least two readings \[us\].
const PERSISTS_US: u64 = 15_000;
/// Time for which a rotor must follow again before its failure ends \[us\].
const RECOVERS_US: u64 = 200_000;
/// Time after arming in which a rotor is not judged until it has turned as commanded \[us\].
const START_US: u64 = 1_500_000;

/// A rotor's failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RotorFailure {
    /// The rotor has stopped, or almost.
    Stopped,
    /// The rotor turns, but not as commanded: its controller has lost synchronisation, or something blocks it.
    Desynchronised,
}

/// A rotor's failure or recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RotorNews {
    /// Index of the rotor, in the order of the vehicle's file.
    pub rotor: u8,
    /// The failure; none if the rotor turns as commanded again.
    pub failure: Option<RotorFailure>,
}

/// State of a rotor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct WatchedRotor {
    /// Expected speed for the commands \[rad/s\].
    expected: f32,
    /// Lowest and highest of the expected and commanded speeds in each slice, the newest slice first.
    slices: [[f32; 2]; SLICES],
    /// True once the rotor has turned as commanded since arming.
    has_turned: bool,
    /// Time since which the readings contradict `failure` \[us\].
    since_us: Option<u64>,
    failure: Option<RotorFailure>,
}

/// Compares measured rotor speeds with the speeds expected for the commands and the vehicle's rotor time constant. A
/// rotor is judged while the vehicle is armed and the command is above idle speed. A failure is reported within 15 ms,
/// plus the time between two readings, after the rotor turns half as fast as it should.
#[derive(Clone, Debug, PartialEq)]
pub struct RotorMonitor {
    /// Share of the way to its command that a rotor covers in a tick.
    share: f32,
    idle_rad_s: f32,
    fast_margin_rad_s: f32,
    rotors: [WatchedRotor; ROTORS_MAX],
    armed_us: Option<u64>,
    sliced_us: u64,
}

impl RotorMonitor {
    /// Creates the monitor for rotors with this response and curve, which must be in their ranges.
    #[must_use]
    pub fn new(response: &Response, curve: &Curve) -> Self {
        let Curve { speed_max_rad_s, linearity: k, idle: u } = *curve;
        RotorMonitor {
            share: min(TICK_S / response.time_constant_s, 1.0),
            // The motors' curve is (omega / omega_max)^2 = k u^2 + (1 - k) u.
            idle_rad_s: speed_max_rad_s * sqrt(max(k * u * u + (1.0 - k) * u, 0.0)),
            fast_margin_rad_s: FAST_MARGIN * speed_max_rad_s,
            rotors: [WatchedRotor::default(); ROTORS_MAX],
            armed_us: None,
            sliced_us: 0,
        }
    }

    /// Takes the speeds that the tick at `now_us` commanded \[rad/s\]. Call it after each tick.
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
            // `max` replaces NaN.
            let command = max(*command, 0.0);
            rotor.expected += (command - rotor.expected) * self.share;
            if next_slice {
                rotor.slices.rotate_right(1);
            }
            let [newest, ..] = &mut rotor.slices;
            // A rotor that is faster than expected lies between the expected speed and the command.
            let now = [min(rotor.expected, command), max(rotor.expected, command)];
            let ([least, greatest], [low, high]) = (if next_slice { now } else { *newest }, now);
            *newest = [min(least, low), max(greatest, high)];
        }
    }

    /// Takes a measured speed \[rad/s\]. Returns a change of the rotor's failure, if any.
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
            // A desynchronised rotor that has now stopped.
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

    /// Returns true if any rotor has failed.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.rotors.iter().any(|rotor| rotor.failure.is_some())
    }

    /// Returns the failure of each rotor.
    #[must_use]
    pub fn failures(&self) -> [Option<RotorFailure>; ROTORS_MAX] {
        self.rotors.map(|rotor| rotor.failure)
    }
}
