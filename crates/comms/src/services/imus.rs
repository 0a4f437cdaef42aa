//! Reports of two IMUs, one of which is used for flying.
//!
//! MAVLink has no field for the IMU in use, so a text announces each change. SYS_STATUS shows whether each IMU works.

use crate::services::health::sensor;
use crate::services::status::SensorBits;
use afbc_onboard::ImuPair;

/// An IMU without readings counts as failed from this time after power-up on \[us\].
const SET_UP_US: u64 = 3_000_000;
/// Shortest time between two texts \[us\].
const PAUSE_US: u64 = 1_000_000;

/// Bits of each IMU in SYS_STATUS. The constants below are the texts about each IMU.
const BITS: [u32; 2] = [sensor::GYROSCOPE | sensor::ACCELEROMETER, sensor::GYROSCOPE_2 | sensor::ACCELEROMETER_2];
const IN_USE: [&str; 2] = ["IMU 1 in use instead of IMU 2", "IMU 2 in use instead of IMU 1"];
const FAILED: [&str; 2] = ["IMU 1 failed", "IMU 2 failed"];
const WORKS: [&str; 2] = ["IMU 1 works again", "IMU 2 works again"];

/// State of two IMUs as announced to stations.
#[derive(Clone, Copy, Debug)]
pub struct ImuNews {
    second_flies: bool,
    works: [bool; 2],
    /// Time of the last text \[us\].
    told_us: Option<u64>,
}

impl ImuNews {
    /// Initial state: IMU 1 is in use, and both work.
    pub const NEW: Self = ImuNews { second_flies: false, works: [true; 2], told_us: None };

    /// Returns the next text at `now_us`. A change of the IMU in use comes first, then an IMU that fails or works
    /// again. There is at most one text per second, so a change that is undone within a second is not announced.
    pub fn look(&mut self, now_us: u64, pair: &ImuPair) -> Option<&'static str> {
        if self.told_us.is_some_and(|told_us| now_us.saturating_sub(told_us) < PAUSE_US) {
            return None;
        }
        let text = self.difference(now_us, pair)?;
        self.told_us = Some(now_us);
        Some(text)
    }

    fn difference(&mut self, now_us: u64, pair: &ImuPair) -> Option<&'static str> {
        if pair.second_flies != self.second_flies {
            self.second_flies = pair.second_flies;
            let [first, second] = IN_USE;
            return Some(if pair.second_flies { second } else { first });
        }
        let sensors = self.works.iter_mut().zip(pair.works).zip(FAILED.iter().zip(WORKS));
        for ((told, works), (failed, again)) in sensors {
            if *told != works && (works || now_us >= SET_UP_US) {
                *told = works;
                return Some(if works { again } else { failed });
            }
        }
        None
    }
}

/// Returns the IMUs that are present and healthy.
pub fn bits(pair: &ImuPair) -> SensorBits {
    let of =
        |which: [bool; 2]| which.into_iter().zip(BITS).fold(0, |all, (is, bits)| if is { all | bits } else { all });
    SensorBits { present: of(pair.present), healthy: of(pair.works) }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::services::health::system;
    use crate::services::status::VehicleStatus;
    use std::vec::Vec;

    const WELL: ImuPair = ImuPair { second_flies: false, present: [true; 2], works: [true; 2] };

    /// Returns the texts within `seconds` while `pair` does not change.
    fn told(news: &mut ImuNews, from_us: u64, seconds: u64, pair: &ImuPair) -> Vec<(u64, &'static str)> {
        let times = (0..seconds * 1000).map(|ms| from_us + ms * 1000);
        times.filter_map(|now_us| Some((now_us, news.look(now_us, pair)?))).collect()
    }

    #[test]
    fn each_change_is_told_once_and_the_one_that_flies_first() {
        let mut news = ImuNews::NEW;
        assert_eq!(told(&mut news, 0, 10, &WELL), []);
        let failed = ImuPair { second_flies: true, works: [false, true], ..WELL };
        let texts = [(10_000_000, "IMU 2 in use instead of IMU 1"), (11_000_000, "IMU 1 failed")];
        assert_eq!(told(&mut news, 10_000_000, 10, &failed), texts);
        let back = ImuPair { second_flies: true, ..WELL };
        assert_eq!(told(&mut news, 20_000_000, 10, &back), [(20_000_000, "IMU 1 works again")]);
        let second = ImuPair { works: [true, false], ..WELL };
        let texts = [(30_000_000, "IMU 1 in use instead of IMU 2"), (31_000_000, "IMU 2 failed")];
        assert_eq!(told(&mut news, 30_000_000, 10, &second), texts);
    }

    /// An IMU that is not set up yet has not failed. An IMU that never answers has.
    #[test]
    fn nothing_has_failed_before_it_could_be_set_up() {
        let mut news = ImuNews::NEW;
        let none = ImuPair::default();
        assert_eq!(told(&mut news, 0, 1, &none), []);
        let one = ImuPair { present: [true, false], works: [true, false], ..none };
        assert_eq!(told(&mut news, 1_000_000, 9, &one), [(3_000_000, "IMU 2 failed")]);
    }

    /// Frequent changes cause at most one text per second. Each text fits into STATUSTEXT, and the last text is right.
    #[test]
    fn a_flood_of_changes_is_none_of_texts() {
        let mut news = ImuNews::NEW;
        let mut texts = Vec::new();
        for ms in 0..20_000_u64 {
            let pair = ImuPair { second_flies: ms / 7 % 2 == 0, ..WELL };
            texts.extend(news.look(ms * 1000, &pair));
        }
        texts.extend(told(&mut news, 20_000_000, 3, &WELL).into_iter().map(|(_, text)| text));
        assert!((2..=21).contains(&texts.len()) && texts.iter().all(|text| text.len() <= 50), "{texts:?}");
        assert_eq!(texts.last(), Some(&"IMU 1 in use instead of IMU 2"));
    }

    /// SYS_STATUS shows both IMUs, whichever is in use.
    #[test]
    fn system_status_shows_each() {
        for (works, healthy) in [([true, true], 0x6_0003), ([false, true], 0x6_0000), ([true, false], 3)] {
            let mut status = VehicleStatus { senses: true, ..VehicleStatus::default() };
            status.aux.sensors = bits(&ImuPair { works, ..WELL });
            let (reported, all) = (system(&status), 0x6_0003);
            assert_eq!((reported.present & all, reported.healthy & all), (all, healthy), "{works:?}");
            assert_ne!(reported.healthy & sensor::ATTITUDE, 0);
        }
    }
}
