//! Which of two inertial sensors flies.

use nalgebra::Vector3;

/// Time without a sample after which the other sensor flies \[us\]: less than the estimator bridges without a trace.
const SILENT_US: u64 = 3_000;
/// Time without a sample after which a sensor does not work, as stations are told \[us\]: longer than its driver takes
/// to set it up again.
const FAILED_US: u64 = 500_000;
/// Samples in which the difference of both sensors is averaged, at least.
const AVERAGED: f32 = 5_000.0;

/// What no motion changes from one sample to the next \[rad/s, m/s2\]: it takes 2000 rad/s2, or a blow.
const JUMP: [f32; 2] = [2.0, 30.0];

/// Two inertial sensors at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImuPair {
    /// True if the second flies.
    pub second_flies: bool,
    /// True for each that has read something.
    pub present: [bool; 2],
    /// True for each that reads.
    pub works: [bool; 2],
}

/// Chooses between two inertial sensors: whichever reads first, usually the first, flies until it is silent, as a
/// driver makes one whose readings are wrong; then the other does. It stays, since a sensor that failed once may fail
/// again. So that the estimate does not jump, the second's samples are corrected by its mean difference from the first
/// while both worked. A sample that jumps and that the other sensor does not confirm, as of a garbled wire, is none.
#[derive(Clone, Debug)]
pub struct ImuSelector {
    second_flies: bool,
    /// Time of the newest sample of each \[us\].
    last_us: [Option<u64>; 2],
    /// Newest sample of the first: rates \[rad/s\] and specific force \[m/s2\].
    first: [Vector3<f32>; 2],
    /// Newest sample of each as it came, whether or not it is one.
    came: ([Vector3<f32>; 2], [Vector3<f32>; 2]),
    /// Second less first, on average.
    difference: [Vector3<f32>; 2],
    averaged: f32,
}

impl ImuSelector {
    /// One that has seen no sample.
    pub const NEW: Self = {
        let zero = [Vector3::new(0.0, 0.0, 0.0); 2];
        ImuSelector {
            second_flies: false,
            last_us: [None; 2],
            first: zero,
            came: (zero, zero),
            difference: zero,
            averaged: 0.0,
        }
    };

    /// Takes a sample of the first sensor, in the body's axes, and returns what flies.
    pub fn take_first(&mut self, at_us: u64, sample: [Vector3<f32>; 2]) -> Option<[Vector3<f32>; 2]> {
        let ([first_us, second_us], (first, second)) = (&mut self.last_us, &mut self.came);
        let [of_rates, of_force] = self.difference;
        let [rates, force] = *second;
        let is_none = jumps(&sample, first) && jumps(&sample, &[rates - of_rates, force - of_force]);
        *first = sample;
        if is_none && !is_silent(*second_us, at_us) {
            return None;
        }
        *first_us = Some(at_us);
        self.first = sample;
        self.second_flies &= !is_silent(*second_us, at_us);
        (!self.second_flies).then_some(sample)
    }

    /// Takes a sample of the second.
    pub fn take_second(&mut self, at_us: u64, sample: [Vector3<f32>; 2]) -> Option<[Vector3<f32>; 2]> {
        let ([first_us, second_us], (first, second)) = (&mut self.last_us, &mut self.came);
        let [of_rates, of_force] = self.difference;
        let [rates, force] = sample;
        let is_none = jumps(&sample, second) && jumps(&[rates - of_rates, force - of_force], first);
        *second = sample;
        if is_none && !is_silent(*first_us, at_us) {
            return None;
        }
        *second_us = Some(at_us);
        self.second_flies |= is_silent(*first_us, at_us);
        let (difference, from) = (&mut self.difference, &self.first);
        if !self.second_flies && first_us.is_some() && *from == *first {
            self.averaged = (self.averaged + 1.0).min(AVERAGED);
            for ((mean, second), first) in difference.iter_mut().zip(&sample).zip(from) {
                *mean += (second - first - *mean) / self.averaged;
            }
        }
        let [rates, force] = sample;
        let [of_rates, of_force] = *difference;
        self.second_flies.then(|| [rates - of_rates, force - of_force])
    }

    /// Returns which flies at `now_us`, and which work.
    pub fn pair(&self, now_us: u64) -> ImuPair {
        let works = |last_us: Option<u64>| last_us.is_some_and(|last_us| now_us.saturating_sub(last_us) <= FAILED_US);
        ImuPair {
            second_flies: self.second_flies,
            present: self.last_us.map(|last_us| last_us.is_some()),
            works: self.last_us.map(works),
        }
    }
}

/// True if two samples are further apart than motion makes them.
fn jumps(one: &[Vector3<f32>; 2], other: &[Vector3<f32>; 2]) -> bool {
    let apart =
        |((one, other), most): ((&Vector3<f32>, &Vector3<f32>), f32)| (one - other).norm_squared() > most * most;
    one.iter().zip(other).zip(JUMP).any(apart)
}

fn is_silent(last_us: Option<u64>, now_us: u64) -> bool {
    last_us.is_none_or(|last_us| now_us.saturating_sub(last_us) > SILENT_US)
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
            assert!(last_ms == 8_999 && selector.difference.iter().all(|mean| mean.norm() < 1e-2), "{selector:?}");
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
