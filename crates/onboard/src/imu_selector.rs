//! Which of two inertial sensors flies.

use crate::imu_lanes::{ImuLanes, OtherSensors};
use afbc_control::math::{min, sqrt};
use afbc_estimator::Inertial;
use nalgebra::Vector3;

/// Time without a sample after which the other sensor flies \[us\]: less than the estimator bridges without a trace.
const SILENT_US: u64 = 3_000;
/// Time without a sample after which a sensor does not work, as stations are told \[us\]: longer than its driver takes
/// to set it up again.
const FAILED_US: u64 = 500_000;
/// Samples in which the difference of both sensors is averaged, at least.
const AVERAGED: f32 = 20_000.0;
/// Samples from which on the difference is known well enough to tell that it has changed.
const KNOWN: f32 = 1_000.0;

/// What no motion changes from one sample to the next \[rad/s, m/s2\]: it takes 2000 rad/s2, or a blow.
const JUMP: [f32; 2] = [2.0, 30.0];
/// Equal samples of rates or of force in a row, while the other sensor's change, that are a stuck sensor. The noise of
/// any part is about its last bit, so that all three axes repeat themselves once in ten or more.
const STUCK: u16 = 15;

/// Share of a sample in the mean disagreement of both sensors: a time constant of 50 ms.
const SHARE: f32 = 0.02;
/// Disagreement that is none \[rad/s, m/s2\], and the share of a quantity that two sensors may differ by, as of scale
/// and alignment.
const APART: [f32; 2] = [0.026, 0.8];
const APART_SHARE: f32 = 0.03;
/// Share of a field in its mean: about a second.
const FIELD_SHARE: f32 = 0.01;
/// Time constant in which the estimate is brought to where the vehicle is \[s\], and how fast at most \[rad/s, m/s2\].
const MADE_UP_S: f32 = 0.2;
const MADE_UP_MAX: [f32; 2] = [1.0, 3.0];

/// Two inertial sensors at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImuPair {
    /// True if the second flies.
    pub second_flies: bool,
    /// True for each that has read something.
    pub present: [bool; 2],
    /// True for each that reads, and has not been found wrong.
    pub works: [bool; 2],
}

/// A sensor.
#[derive(Clone, Copy, Debug)]
struct Imu {
    /// Time of the newest sample \[us\].
    last_us: Option<u64>,
    /// Newest sample: rates \[rad/s\] and specific force \[m/s2\].
    newest: [Vector3<f32>; 2],
    /// The same as it came, whether or not it is one.
    came: [Vector3<f32>; 2],
    /// Equal ones in a row.
    equals: [u16; 2],
    /// What its samples are less when they fly.
    offset: [Vector3<f32>; 2],
    /// True if it has been found wrong.
    wrong: bool,
}

/// Chooses between two inertial sensors: whichever reads first, usually the first, flies until it is silent, as a
/// driver makes one whose readings are wrong; then the other does. It stays, since a sensor that failed once may fail
/// again. So that the estimate does not jump, the samples of the one that does not fly are corrected by its mean
/// difference from the other while both worked. A sample that jumps and that the other sensor does not confirm, as of a
/// garbled wire, is none; nor is one whose rates or force have repeated themselves while the other's changed.
///
/// Of two that disagree, [whatever else is measured](OtherSensors) tells which is right. When that is the other one, it
/// flies from then on; turn and velocity that the wrong one has hidden are made up for as a rate and a force, so that
/// the estimate goes to where the vehicle is as smoothly as the vehicle can follow.
#[derive(Clone, Debug)]
pub struct ImuSelector {
    second_flies: bool,
    first: Imu,
    second: Imu,
    /// Samples of which the offset of the one that does not fly is the mean, and how far it is from that, on average
    /// and now \[rad/s, m/s2\].
    averaged: f32,
    apart: [Vector3<f32>; 2],
    apart_now: [Vector3<f32>; 2],
    lanes: Option<ImuLanes>,
    /// Mean magnetic field while they agree, in the earth frame \[uT\].
    field: Option<Vector3<f32>>,
    /// What is to be made up for, turn \[rad\] and velocity \[m/s\], and the time of the last sample that flew \[us\].
    owed: [Vector3<f32>; 2],
    flown_us: u64,
}

impl Imu {
    const NEW: Self = {
        let zero = [Vector3::new(0.0, 0.0, 0.0); 2];
        Imu { last_us: None, newest: zero, came: zero, equals: [0; 2], offset: zero, wrong: false }
    };

    /// Returns a sample of it as it flies.
    fn corrected(&self, sample: &[Vector3<f32>; 2]) -> [Vector3<f32>; 2] {
        let ([rates, force], [of_rates, of_force]) = (sample, &self.offset);
        [rates - of_rates, force - of_force]
    }

    /// True if rates or force repeat themselves, and those of `other` do not.
    fn is_stuck(&self, other: &Imu) -> bool {
        // Both repeat themselves where there is no noise, as at rest in a simulation: that is no fault.
        self.equals.iter().zip(other.equals).any(|(own, others)| *own >= STUCK && others < STUCK / 2)
    }

    fn is_silent(&self, now_us: u64) -> bool {
        self.last_us.is_none_or(|last_us| now_us.saturating_sub(last_us) > SILENT_US)
    }
}

impl ImuSelector {
    /// One that has seen no sample.
    pub const NEW: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        ImuSelector {
            second_flies: false,
            first: Imu::NEW,
            second: Imu::NEW,
            averaged: 0.0,
            apart: [zero; 2],
            apart_now: [zero; 2],
            lanes: None,
            field: None,
            owed: [zero; 2],
            flown_us: 0,
        }
    };

    /// Takes a sample of the first sensor, in the body's axes, and returns what flies.
    pub fn take_first(&mut self, at_us: u64, sample: [Vector3<f32>; 2]) -> Option<[Vector3<f32>; 2]> {
        self.take(false, at_us, sample)
    }

    /// Takes a sample of the second.
    pub fn take_second(&mut self, at_us: u64, sample: [Vector3<f32>; 2]) -> Option<[Vector3<f32>; 2]> {
        self.take(true, at_us, sample)
    }

    fn take(&mut self, is_second: bool, at_us: u64, sample: [Vector3<f32>; 2]) -> Option<[Vector3<f32>; 2]> {
        let flies = self.second_flies == is_second;
        let (this, other) = if is_second { (&mut self.second, &self.first) } else { (&mut self.first, &self.second) };
        for ((equals, new), old) in this.equals.iter_mut().zip(&sample).zip(&this.came) {
            *equals = if new == old { equals.saturating_add(1) } else { 0 };
        }
        // By what came, sample or not: of a blow that both feel, the first reading is none, and confirms the second.
        let confirmed = !jumps(&this.corrected(&sample), &other.corrected(&other.came));
        let is_none = jumps(&sample, &this.came) && !confirmed || this.is_stuck(other);
        this.came = sample;
        let other_is_silent = other.is_silent(at_us);
        // Alone, a sensor flies whatever it reads: there is no other to judge it by.
        if is_none && !other_is_silent {
            return None;
        }
        (this.last_us, this.newest) = (Some(at_us), sample);
        if flies {
            return Some(self.fly(is_second, at_us));
        }
        if other_is_silent {
            // Its offset stays: what it reads is as the other's, as long as both are right.
            (self.second_flies, self.lanes) = (is_second, None);
            return Some(self.fly(is_second, at_us));
        }
        self.compare(is_second);
        None
    }

    /// Returns the newest sample of the sensor that flies, with what is to be made up for.
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
                // The decay would not end by itself.
                *owed = if size < 3e-4 { Vector3::zeros() } else { *owed - rate * since_s };
            }
        }
        flown
    }

    /// Compares the newest sample of the sensor that does not fly with that of the other.
    fn compare(&mut self, is_second: bool) {
        let (this, flying) = if is_second { (&mut self.second, &self.first) } else { (&mut self.first, &self.second) };
        // One that is none confirms nothing.
        if flying.newest != flying.came {
            return;
        }
        let flown = flying.corrected(&flying.newest);
        // While the lanes decide, the difference may be a fault, which is not to become part of the mean.
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

    /// True if the sensors disagree by more than this share of what is none.
    fn disagree(&self, share: f32) -> bool {
        let measured = if self.second_flies { &self.second.newest } else { &self.first.newest };
        self.apart.iter().zip(measured).zip(APART).any(|((apart, measured), none)| {
            let most = share * (none + APART_SHARE * sqrt(measured.norm_squared()));
            apart.norm_squared() > most * most
        })
    }

    /// Takes what the estimator has made of the samples that fly and what else has been measured, in every tick that
    /// has an estimate, and changes to the other sensor if that one is right.
    pub fn cross_check(&mut self, now: &Inertial, others: &OtherSensors) {
        let works = !self.first.is_silent(now.at_us) && !self.second.is_silent(now.at_us);
        if !works {
            self.lanes = None;
            return;
        }
        // Ends at half of what begins them, so that noise does not begin and end lanes in turn.
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

    /// Has the other fly, as if it had flown since the lanes began.
    fn change(&mut self, now: &Inertial) {
        let Some(lanes) = self.lanes.take() else { return };
        let to_imu = now.to_body.transpose();
        let (wrong, right) =
            if self.second_flies { (&mut self.second, &mut self.first) } else { (&mut self.first, &mut self.second) };
        (wrong.wrong, right.wrong) = (true, false);
        for (offset, moved) in right.offset.iter_mut().zip(lanes.moved(now)) {
            // The estimator's biases have moved to fit the wrong sensor: moved with them, the right one fits at once.
            *offset -= to_imu * moved;
        }
        self.owed = lanes.hidden().map(|hidden| to_imu * (now.rotation.transpose() * hidden));
        self.second_flies = !self.second_flies;
        self.begin_again();
    }

    /// Has the one stay that flies: the other is wrong, and its difference a new one.
    fn keep(&mut self) {
        self.lanes = None;
        let (right, wrong) =
            if self.second_flies { (&mut self.second, &mut self.first) } else { (&mut self.first, &mut self.second) };
        (right.wrong, wrong.wrong) = (false, true);
        self.begin_again();
    }

    /// Averages the difference from now on.
    fn begin_again(&mut self) {
        let none = [Vector3::zeros(); 2];
        (self.averaged, self.apart, self.apart_now) = (0.0, none, none);
    }

    /// Returns which flies at `now_us`, and which work.
    pub fn pair(&self, now_us: u64) -> ImuPair {
        let works =
            |imu: &Imu| !imu.wrong && imu.last_us.is_some_and(|last_us| now_us.saturating_sub(last_us) <= FAILED_US);
        let both = [&self.first, &self.second];
        ImuPair {
            second_flies: self.second_flies,
            present: both.map(|imu| imu.last_us.is_some()),
            works: both.map(works),
        }
    }
}

/// True if two samples are further apart than motion makes them.
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

    /// Whichever sensor fails, and whenever, what flies has no gap over 4 ms and no jump by the sensors' biases.
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

    /// Random bytes of either sensor neither fly nor enter the mean difference, and the other takes over in 4 ms.
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

    /// A blow that both feel flies, and one that only one feels costs a sample.
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

    /// Rates or force that repeat themselves beside a sensor whose own change are none; not so those of both, of a
    /// vehicle at rest in a simulation without noise, nor an axis alone, at the end of its range.
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
