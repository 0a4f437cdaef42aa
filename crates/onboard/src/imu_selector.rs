//! Selects one of two inertial sensors to fly on.

use crate::imu_lanes::{ImuLanes, OtherSensors};
use afbc_control::math::{min, sqrt};
use afbc_estimator::InertialState;
use nalgebra::Vector3;

/// Time without a sample after which the other sensor takes over, shorter than a gap that would affect the estimate
/// \[us\].
const SILENT_US: u64 = 3_000;
/// Time without a sample after which stations are told that a sensor has failed, longer than its driver's restart
/// \[us\].
const FAILED_US: u64 = 500_000;
/// Largest number of samples in the average difference of both sensors.
const AVERAGED: f32 = 20_000.0;
/// Number of samples from which the difference is known well enough to detect a change.
const KNOWN: f32 = 1_000.0;

/// Largest change between two samples that motion can cause \[rad/s, m/s2\]. More takes 2000 rad/s2, or a blow.
const JUMP: [f32; 2] = [2.0, 30.0];
/// Number of equal rates or forces in a row that mean a stuck sensor, if the other sensor's still change. Any sensor's
/// noise is about its last bit, so all three axes repeat at most about once in ten samples.
const STUCK: u16 = 15;

/// Weight of a sample in the mean disagreement of both sensors: a time constant of 50 ms.
const SHARE: f32 = 0.02;
/// Disagreement that is always tolerated \[rad/s, m/s2\], and the tolerated share of the measured quantity, for errors
/// of scale and alignment.
const APART: [f32; 2] = [0.026, 0.8];
const APART_SHARE: f32 = 0.03;
/// Weight of a sample in the mean magnetic field: a time constant of about one second.
const FIELD_SHARE: f32 = 0.01;
/// Time constant in which the estimate is corrected after a change of sensors \[s\], and the fastest correction
/// \[rad/s, m/s2\].
const MADE_UP_S: f32 = 0.2;
const MADE_UP_MAX: [f32; 2] = [1.0, 3.0];

/// State of the two inertial sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImuPair {
    /// True if the second sensor flies (is in use).
    pub second_flies: bool,
    /// True for each sensor that has ever sent a sample.
    pub present: [bool; 2],
    /// True for each sensor that sends samples and has not been found wrong.
    pub works: [bool; 2],
}

/// One of the two sensors.
#[derive(Clone, Copy, Debug)]
struct SelectableImu {
    /// Time of the newest accepted sample \[us\].
    last_us: Option<u64>,
    /// Newest accepted sample: rates \[rad/s\] and specific force \[m/s2\].
    newest: [Vector3<f32>; 2],
    /// Newest sample as it came, accepted or not.
    came: [Vector3<f32>; 2],
    /// Number of equal rates and of equal forces in a row.
    equals: [u16; 2],
    /// Offset subtracted from the samples when the sensor flies.
    offset: [Vector3<f32>; 2],
    /// True if the sensor has been found wrong.
    wrong: bool,
}

/// Selects the inertial sensor that flies (is in use) from two. The first to send a sample flies, until it falls
/// silent; a driver silences a sensor with wrong readings. Then the other sensor takes over. There is no return when
/// the first recovers, since a sensor that failed once may fail again. To avoid a jump of the estimate, the other
/// sensor's samples are corrected by the mean difference while both worked. A sample is rejected if it jumps and the
/// other sensor does not confirm it, or if rates or force repeat while the other sensor's change.
///
/// If the two disagree, [other sensors](OtherSensors) show which is right. If it is the other sensor, it takes over.
/// The turn and velocity that the wrong sensor missed are then added as a rate and a force, so that the estimate moves
/// to the true state smoothly enough for the vehicle to follow.
#[derive(Clone, Debug)]
pub struct ImuSelector {
    second_flies: bool,
    first: SelectableImu,
    second: SelectableImu,
    /// Number of samples averaged in the offset of the sensor in reserve, and the remaining difference from the sensor
    /// that flies, averaged and newest \[rad/s, m/s2\].
    averaged: f32,
    apart: [Vector3<f32>; 2],
    apart_now: [Vector3<f32>; 2],
    lanes: Option<ImuLanes>,
    /// Mean magnetic field in the earth frame while the sensors agree \[uT\].
    field: Option<Vector3<f32>>,
    /// Turn \[rad\] and velocity \[m/s\] that are still to be corrected, and the time of the last sample that flew
    /// \[us\].
    owed: [Vector3<f32>; 2],
    flown_us: u64,
}

impl SelectableImu {
    const NEW: Self = {
        let zero = [Vector3::new(0.0, 0.0, 0.0); 2];
        SelectableImu { last_us: None, newest: zero, came: zero, equals: [0; 2], offset: zero, wrong: false }
    };

    /// Returns one of its samples, with the offset removed.
    fn corrected(&self, sample: &[Vector3<f32>; 2]) -> [Vector3<f32>; 2] {
        let ([rates, force], [of_rates, of_force]) = (sample, &self.offset);
        [rates - of_rates, force - of_force]
    }

    /// Returns true if this sensor's rates or force repeat and those of `other` do not.
    fn is_stuck(&self, other: &SelectableImu) -> bool {
        // Without noise, as at rest in a simulation, both sensors repeat. That is no fault.
        self.equals.iter().zip(other.equals).any(|(own, others)| *own >= STUCK && others < STUCK / 2)
    }

    fn is_silent(&self, now_us: u64) -> bool {
        self.last_us.is_none_or(|last_us| now_us.saturating_sub(last_us) > SILENT_US)
    }
}

impl ImuSelector {
    /// A selector that has seen no sample.
    pub const NEW: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        ImuSelector {
            second_flies: false,
            first: SelectableImu::NEW,
            second: SelectableImu::NEW,
            averaged: 0.0,
            apart: [zero; 2],
            apart_now: [zero; 2],
            lanes: None,
            field: None,
            owed: [zero; 2],
            flown_us: 0,
        }
    };

    /// Takes a sample of the first sensor, in axes common to both sensors. Returns the sample to fly on, if this sensor
    /// flies.
    pub fn take_first(&mut self, at_us: u64, sample: [Vector3<f32>; 2]) -> Option<[Vector3<f32>; 2]> {
        self.take(false, at_us, sample)
    }

    /// Takes a sample of the second sensor, in the same axes. Returns the sample to fly on, if this sensor flies.
    pub fn take_second(&mut self, at_us: u64, sample: [Vector3<f32>; 2]) -> Option<[Vector3<f32>; 2]> {
        self.take(true, at_us, sample)
    }

    fn take(&mut self, is_second: bool, at_us: u64, sample: [Vector3<f32>; 2]) -> Option<[Vector3<f32>; 2]> {
        let flies = self.second_flies == is_second;
        let (this, other) = if is_second { (&mut self.second, &self.first) } else { (&mut self.first, &self.second) };
        for ((equals, new), old) in this.equals.iter_mut().zip(&sample).zip(&this.came) {
            *equals = if new == old { equals.saturating_add(1) } else { 0 };
        }
        // Rejected samples of the other sensor confirm a jump, too. When both sensors feel a blow, each sensor's sample
        // jumps, and the rejected sample of one sensor confirms the sample of the other sensor.
        let confirmed = !jumps(&this.corrected(&sample), &other.corrected(&other.came));
        let is_none = jumps(&sample, &this.came) && !confirmed || this.is_stuck(other);
        this.came = sample;
        let other_is_silent = other.is_silent(at_us);
        // Without another sensor to compare it with, a sensor flies whatever it reads.
        if is_none && !other_is_silent {
            return None;
        }
        (this.last_us, this.newest) = (Some(at_us), sample);
        if flies {
            return Some(self.fly(is_second, at_us));
        }
        if other_is_silent {
            // The offset stays: with it, this sensor's samples match the other sensor's.
            (self.second_flies, self.lanes) = (is_second, None);
            return Some(self.fly(is_second, at_us));
        }
        self.compare(is_second);
        None
    }

    /// Returns the newest sample of the sensor that flies, with the correction that is still due.
    fn fly(&mut self, is_second: bool, at_us: u64) -> [Vector3<f32>; 2] {
        let imu = if is_second { &self.second } else { &self.first };
        let mut flown = imu.corrected(&imu.newest);
        let since_s = at_us.saturating_sub(self.flown_us).min(SILENT_US) as f32 * 1e-6;
        self.flown_us = at_us;
        for ((quantity, owed), most) in flown.iter_mut().zip(&mut self.owed).zip(MADE_UP_MAX) {
            let size = sqrt(owed.norm_squared());
            if size > 0.0 {
                let rate = *owed * min(1.0 / MADE_UP_S, most / size);
                *quantity += rate;
                // Ends a negligible correction, because an exponential decay never reaches zero.
                *owed = if size < 3e-4 { Vector3::zeros() } else { *owed - rate * since_s };
            }
        }
        flown
    }

    /// Compares the newest sample of the sensor in reserve with the sensor that flies.
    fn compare(&mut self, is_second: bool) {
        let (this, flying) = if is_second { (&mut self.second, &self.first) } else { (&mut self.first, &self.second) };
        // A rejected sample cannot be compared.
        if flying.newest != flying.came {
            return;
        }
        let flown = flying.corrected(&flying.newest);
        // While the lanes decide, the difference may be a fault and must not enter the mean.
        if self.lanes.is_none() {
            self.averaged = (self.averaged + 1.0).min(AVERAGED);
            for ((mean, own), flown) in this.offset.iter_mut().zip(&this.newest).zip(&flown) {
                *mean += (own - flown - *mean) / self.averaged;
            }
        }
        let ([own_rates, own_force], [rates, force]) = (this.corrected(&this.newest), flown);
        self.apart_now = [own_rates - rates, own_force - force];
        self.apart.iter_mut().zip(self.apart_now).for_each(|(mean, now)| *mean += (now - *mean) * SHARE);
    }

    /// Returns true if the sensors disagree by more than this share of the tolerance.
    fn disagree(&self, share: f32) -> bool {
        let measured = if self.second_flies { &self.second.newest } else { &self.first.newest };
        self.apart.iter().zip(measured).zip(APART).any(|((apart, measured), none)| {
            let most = share * (none + APART_SHARE * sqrt(measured.norm_squared()));
            apart.norm_squared() > most * most
        })
    }

    /// Checks the two sensors against each other, by the estimate and other measurements. Switches to the other sensor
    /// if the other sensor is right. Call it in every tick with an estimate.
    pub fn cross_check(&mut self, now: &InertialState, others: &OtherSensors) {
        let works = !self.first.is_silent(now.at_us) && !self.second.is_silent(now.at_us);
        if !works {
            self.lanes = None;
            return;
        }
        // The lanes end at half the disagreement that starts them, so that noise does not toggle them.
        let (begins, ends) = (self.averaged >= KNOWN && self.disagree(1.0), !self.disagree(0.5));
        let Some(lanes) = &mut self.lanes else {
            if begins {
                self.lanes = Some(ImuLanes::new(now, self.field));
            } else if let Some(field) = &others.field {
                let field = now.rotation * field;
                self.field = Some(self.field.map_or(field, |mean| mean + (field - mean) * FIELD_SHARE));
            }
            return;
        };
        lanes.advance(now, self.apart_now.map(|apart| now.to_body * apart), others);
        match lanes.other_is_right() {
            Some(true) => self.change(now),
            Some(false) => self.keep(),
            None if ends || lanes.is_old() => self.lanes = None,
            None => (),
        }
    }

    /// Switches to the other sensor as if it had flown since the lanes began.
    fn change(&mut self, now: &InertialState) {
        let Some(lanes) = self.lanes.take() else { return };
        let to_imu = now.to_body.transpose();
        let (wrong, right) =
            if self.second_flies { (&mut self.second, &mut self.first) } else { (&mut self.first, &mut self.second) };
        (wrong.wrong, right.wrong) = (true, false);
        for (offset, moved) in right.offset.iter_mut().zip(lanes.moved(now)) {
            // The estimator's biases have adapted to the wrong sensor. A shift of the right sensor's offset by the same
            // amount makes the right sensor fit these biases at once.
            *offset -= to_imu * moved;
        }
        self.owed = lanes.hidden().map(|hidden| to_imu * (now.rotation.transpose() * hidden));
        self.second_flies = !self.second_flies;
        self.begin_again();
    }

    /// Keeps the sensor that flies, and marks the other one as wrong. Their difference is measured anew.
    fn keep(&mut self) {
        self.lanes = None;
        let (right, wrong) =
            if self.second_flies { (&mut self.second, &mut self.first) } else { (&mut self.first, &mut self.second) };
        (right.wrong, wrong.wrong) = (false, true);
        self.begin_again();
    }

    /// Restarts the average difference.
    fn begin_again(&mut self) {
        let none = [Vector3::zeros(); 2];
        (self.averaged, self.apart, self.apart_now) = (0.0, none, none);
    }

    /// Returns which sensor flies at `now_us`, and which sensors work.
    pub fn pair(&self, now_us: u64) -> ImuPair {
        let works = |imu: &SelectableImu| {
            !imu.wrong && imu.last_us.is_some_and(|last_us| now_us.saturating_sub(last_us) <= FAILED_US)
        };
        let both = [&self.first, &self.second];
        ImuPair {
            second_flies: self.second_flies,
            present: both.map(|imu| imu.last_us.is_some()),
            works: both.map(works),
        }
    }
}

/// Returns true if two samples differ by more than motion can explain.
fn jumps(one: &[Vector3<f32>; 2], other: &[Vector3<f32>; 2]) -> bool {
    let apart =
        |((one, other), most): ((&Vector3<f32>, &Vector3<f32>), f32)| (one - other).norm_squared() > most * most;
    one.iter().zip(other).zip(JUMP).any(apart)
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, reason = "tests")]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    fn motion(ms: u64) -> [Vector3<f32>; 2] {
        let t = ms as f32 * 1e-3;
        [Vector3::new((3.0 * t).sin(), (2.0 * t).cos(), 0.5), Vector3::new(0.0, t.sin(), 9.81)]
    }

    /// Whichever sensor fails, at any time, the selected samples have no gap over 4 ms and no jump by the sensors'
    /// biases.
    #[test]
    fn a_failure_leaves_no_gap_and_no_jump() {
        let bias = [Vector3::new(0.05, -0.03, 0.02), Vector3::new(0.3, -0.2, 0.4)];
        for fails_ms in [7_000, 20_003, 59_999_u64] {
            let mut selector = ImuSelector::NEW;
            let mut last_ms = 0;
            for ms in 1..70_000_u64 {
                let at_us = ms * 1_000;
                let [rates, force] = motion(ms);
                let flown = [
                    (ms < fails_ms).then(|| selector.take_first(at_us, [rates, force])).flatten(),
                    selector.take_second(at_us + 300, [rates + bias[0], force + bias[1]]),
                ];
                let all: Vec<_> = flown.into_iter().flatten().collect();
                assert!(all.len() <= 1, "one flies");
                for [flown_rates, flown_force] in all {
                    assert!(ms - last_ms <= 4, "{last_ms} to {ms} ms");
                    last_ms = ms;
                    assert!((flown_rates - rates).norm() < 1e-3 && (flown_force - force).norm() < 1e-2, "{ms} ms");
                }
            }
            let pair = selector.pair(70_000_000);
            assert_eq!((pair.second_flies, last_ms), (true, 69_999));
            assert_eq!((pair.present, pair.works), ([true; 2], [false, true]));
        }
    }

    /// Random samples of either sensor are not used and do not change the mean difference. The other sensor takes over
    /// within 4 ms.
    #[test]
    fn garbled_samples_do_not_fly() {
        for garbled in [0, 1] {
            let mut selector = ImuSelector::NEW;
            let (mut random, mut last_ms) = (1_u32, 0);
            let mut axis = |most: f32| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (random as f32 / u32::MAX as f32 - 0.5) * 2.0 * most
            };
            for ms in 1..9_000_u64 {
                let truth = motion(ms);
                let mut samples = [truth; 2];
                if (3_000..6_000).contains(&ms) {
                    let most = [35.0, 157.0];
                    samples[garbled] = most.map(|most| Vector3::new(axis(most), axis(most), axis(most)));
                }
                let [first, second] = samples;
                let flown = [selector.take_first(ms * 1_000, first), selector.take_second(ms * 1_000 + 300, second)];
                for [rates, force] in flown.into_iter().flatten() {
                    assert!(ms - last_ms <= 4, "{last_ms} to {ms} ms");
                    last_ms = ms;
                    assert!((rates - truth[0]).norm() < 2.1 && (force - truth[1]).norm() < 31.0, "{ms} ms");
                }
            }
            assert!(
                last_ms == 8_999
                    && [selector.first, selector.second]
                        .iter()
                        .all(|imu| imu.offset.iter().all(|mean| mean.norm() < 1e-2)),
                "{selector:?}"
            );
        }
    }

    /// A blow that both sensors feel is used. A blow that only one feels costs a sample.
    #[test]
    fn a_blow_flies() {
        let mut selector = ImuSelector::NEW;
        let (rest, blow) = (motion(0), [Vector3::new(9.0, 0.0, 0.0), Vector3::new(0.0, 90.0, 9.81)]);
        assert_eq!(selector.take_first(1_000, rest), Some(rest));
        assert_eq!(selector.take_second(1_300, rest), None);
        assert_eq!(selector.take_first(2_000, blow), None, "not yet confirmed");
        assert_eq!(selector.take_second(2_300, blow), None);
        assert_eq!(selector.take_first(3_000, blow), Some(blow));
        assert_eq!(selector.take_first(4_000, rest), None);
        assert_eq!(selector.take_first(5_000, rest), Some(rest), "it stays");
    }

    /// Rates or force that repeat while the other sensor's change are not used. Repeats of both sensors, as at rest in
    /// a simulation without noise, or of a single saturated axis are no fault.
    #[test]
    fn what_repeats_itself_does_not_fly() {
        let still = motion(1_000);
        for (quantity, axes, of_both, stuck) in
            [(0, 3, false, true), (1, 3, false, true), (0, 3, true, false), (0, 1, false, false), (1, 2, false, false)]
        {
            let mut selector = ImuSelector::NEW;
            let mut last_ms = [0; 2];
            for ms in 1..2_000_u64 {
                let noise = Vector3::new((ms % 7) as f32, (ms % 5) as f32, (ms % 3) as f32) * 1e-3;
                let moves = motion(ms).map(|moves| moves + noise);
                let mut held = moves;
                if ms >= 1_000 {
                    held[quantity].iter_mut().zip(&still[quantity]).take(axes).for_each(|(axis, still)| *axis = *still);
                }
                let flown = [
                    selector.take_first(ms * 1_000, held),
                    selector.take_second(ms * 1_000 + 300, if of_both { held } else { moves }),
                ];
                last_ms.iter_mut().zip(flown).filter(|(_, flown)| flown.is_some()).for_each(|(last, _)| *last = ms);
            }
            let [first_ms, second_ms] = last_ms;
            let what = (quantity, axes, of_both);
            assert_eq!(selector.pair(2_000_000).second_flies, stuck, "{what:?}");
            assert!(if stuck { first_ms <= 1_016 && second_ms == 1_999 } else { first_ms == 1_999 }, "{what:?}");
        }
    }

    #[test]
    fn one_alone_flies_and_the_first_takes_over_again() {
        let mut selector = ImuSelector::NEW;
        assert_eq!(selector.take_second(1_000, motion(1)), Some(motion(1)));
        assert_eq!(selector.take_first(1_300, motion(1)), None);
        assert_eq!(selector.take_second(2_000, motion(2)), Some(motion(2)));
        assert_eq!(selector.take_first(6_000, motion(6)), Some(motion(6)));
        assert!(!selector.pair(6_000).second_flies);
        assert_eq!(selector.take_second(6_300, motion(6)), None);
    }
}
