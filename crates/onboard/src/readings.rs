//! Readings of the vehicle's own sensors since the last tick.

use afbc_estimator::{ImuSample, Measurement, Stamped};
use nalgebra::Vector3;

/// Largest number of aiding measurements in one tick. Further ones wait for the next tick.
pub const AIDS_MAX: usize = 2;

/// A value with its age.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Aged<T> {
    /// The value.
    pub value: T,
    /// Age of the value when the tick begins \[us\].
    pub age_us: u32,
}

impl<T> Aged<T> {
    /// Returns the value with its time on the vehicle's clock.
    pub(crate) fn timed(self, now_us: u64) -> Stamped<T> {
        Stamped { value: self.value, at_us: now_us.saturating_sub(self.age_us.into()) }
    }
}

/// Readings for one tick. By default there are none, as of a vehicle without sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Readings {
    /// New inertial sample, if any: rates \[rad/s\] and specific force \[m/s2\] in the sensor's axes
    /// ([`Mounting`](afbc_types::Mounting)).
    pub imu: Option<Aged<[Vector3<f32>; 2]>>,
    /// Aiding measurements in the order of arrival, without gaps.
    pub aids: [Option<Aged<Measurement>>; AIDS_MAX],
}

/// Number of values in a measurement on the wire.
const NUMBERS: usize = Measurement::NUMBERS;
/// Bytes of a measurement on the wire: kind, age, values.
const AID_LEN: usize = 1 + 4 + 4 * NUMBERS;
/// Bytes of an inertial sample on the wire: flag, age, six values.
const IMU_LEN: usize = 1 + 4 + 4 * 6;

impl Readings {
    /// No readings.
    pub const NONE: Self = Readings { imu: None, aids: [None; AIDS_MAX] };
    /// Length on the [wire](crate::ReplyHead) \[bytes\].
    pub const LEN: usize = IMU_LEN + AIDS_MAX * AID_LEN;

    /// Removes all readings.
    pub fn clear(&mut self) {
        self.imu = None;
        for aid in &mut self.aids {
            *aid = None;
        }
    }

    /// Returns the inertial sample in the sensor's axes, with its time, for a tick at `now_us`.
    pub(crate) fn sample(&self, now_us: u64) -> Option<ImuSample> {
        let Stamped { value: [rates_rad_s, specific_force_m_s2], at_us } = self.imu?.timed(now_us);
        Some(ImuSample { at_us, rates_rad_s, specific_force_m_s2 })
    }

    /// Returns the readings' bytes on the wire.
    pub fn to_bytes(&self) -> [u8; Self::LEN] {
        let imu = self.imu.map_or([0; IMU_LEN], |Aged { value: [rates, force], age_us }| {
            record(1, age_us, rates.iter().chain(&force).copied())
        });
        let aids = self.aids.iter().flat_map(|aid| aid.as_ref().map_or([0; AID_LEN], aid_to_bytes));
        let mut bytes = [0; Self::LEN];
        bytes.iter_mut().zip(imu.into_iter().chain(aids)).for_each(|(to, from)| *to = from);
        bytes
    }

    /// Reads the bytes of [`to_bytes`](Self::to_bytes). Leaves out unknown kinds of measurements.
    pub fn from_bytes(bytes: &[u8; Self::LEN]) -> Self {
        let mut rest = bytes.iter().copied();
        let (has_imu, age_us, [p, q, r, x, y, z]) = fields(&mut rest);
        let imu = (has_imu == 1).then_some(Aged { value: [Vector3::new(p, q, r), Vector3::new(x, y, z)], age_us });
        let mut readings = Readings { imu, ..Readings::NONE };
        let mut free = readings.aids.iter_mut();
        for _ in 0..AIDS_MAX {
            let (kind, age_us, numbers) = fields(&mut rest);
            if let (Some(value), true) = (Measurement::of_numbers(kind, numbers), free.len() > 0) {
                free.next().into_iter().for_each(|slot| *slot = Some(Aged { value, age_us }));
            }
        }
        readings
    }
}

/// Returns kind, age and values as bytes, padded with zeros.
fn record<const L: usize>(kind: u8, age_us: u32, numbers: impl Iterator<Item = f32>) -> [u8; L] {
    let mut bytes = [0; L];
    let all = [kind].into_iter().chain(age_us.to_le_bytes()).chain(numbers.flat_map(f32::to_le_bytes));
    bytes.iter_mut().zip(all).for_each(|(to, from)| *to = from);
    bytes
}

/// Reads kind, age and values.
fn fields<const N: usize>(rest: &mut impl Iterator<Item = u8>) -> (u8, u32, [f32; N]) {
    let kind = rest.next().unwrap_or_default();
    let mut word = || [(); 4].map(|()| rest.next().unwrap_or_default());
    let age_us = u32::from_le_bytes(word());
    (kind, age_us, [(); N].map(|()| f32::from_le_bytes(word())))
}

fn aid_to_bytes(aid: &Aged<Measurement>) -> [u8; AID_LEN] {
    let (kind, numbers) = aid.value.numbers();
    record(kind, aid.age_us, numbers.into_iter())
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;

    fn aids() -> [Measurement; 6] {
        let (first, second) = (Vector3::new(1.0, -2.0, 3.5), Vector3::new(-4.0, 5.0, -6.5));
        [
            Measurement::Pose {
                position_m: first,
                attitude: [0.1, 0.2, -0.3, 0.4],
                position_sigma_m: 7.0,
                attitude_sigma_rad: 8.0,
            },
            Measurement::Position { position_m: first, sigma_m: 7.0 },
            Measurement::Gnss {
                position_m: first,
                velocity_m_s: second,
                horizontal_sigma_m: 7.0,
                vertical_sigma_m: 8.0,
                speed_sigma_m_s: 9.0,
                climb_sigma_m_s: 10.0,
            },
            Measurement::Height { height_m: 3.0, sigma_m: 7.0 },
            Measurement::MagneticField { field: second, sigma: 7.0 },
            Measurement::Heading { heading_rad: 3.0, sigma_rad: 7.0 },
        ]
    }

    /// Every pair of measurements is read as it was written, with and without an inertial sample.
    #[test]
    fn what_is_read_crosses_the_wire() {
        let imu = Aged { value: [Vector3::new(0.5, -1.5, 2.5), Vector3::new(9.0, 8.0, -7.0)], age_us: 0x0102_0304 };
        let none = core::iter::once(None);
        for first in none.clone().chain(aids().map(Some)) {
            for second in none.clone().chain(aids().map(Some)).filter(|second| first.is_some() || second.is_none()) {
                for imu in [None, Some(imu)] {
                    let aid = |aid: Option<Measurement>, age_us| aid.map(|value| Aged { value, age_us });
                    let readings = Readings { imu, aids: [aid(first, 77), aid(second, u32::MAX)] };
                    assert_eq!(Readings::from_bytes(&readings.to_bytes()), readings);
                    let mut cleared = readings;
                    cleared.clear();
                    assert_eq!(cleared, Readings::NONE);
                }
            }
        }
    }

    /// An unknown kind is left out, and the next measurement moves up.
    #[test]
    fn unknown_kinds_leave_no_gap() {
        let height = Some(Aged { value: Measurement::Height { height_m: 3.0, sigma_m: 7.0 }, age_us: 5 });
        let mut bytes = Readings { imu: None, aids: [height; 2] }.to_bytes();
        for kind in [0, 7, 255] {
            bytes[IMU_LEN] = kind;
            assert_eq!(Readings::from_bytes(&bytes), Readings { imu: None, aids: [height, None] });
        }
    }

    /// A reading's time is the tick's time minus its age, but never before power-up.
    #[test]
    fn ages_become_times() {
        let sample = |age_us, now_us| {
            let imu = Some(Aged { value: [Vector3::new(1.0, 2.0, 3.0), Vector3::new(4.0, 5.0, 6.0)], age_us });
            Readings { imu, ..Readings::NONE }.sample(now_us)
        };
        for (age_us, now_us, at_us) in [(0, 900, 900), (250, 900, 650), (950, 900, 0)] {
            let sample = sample(age_us, now_us);
            assert_eq!(sample.map(|sample| sample.at_us), Some(at_us));
            assert_eq!(sample.map(|sample| sample.rates_rad_s), Some(Vector3::new(1.0, 2.0, 3.0)));
            assert_eq!(sample.map(|sample| sample.specific_force_m_s2), Some(Vector3::new(4.0, 5.0, 6.0)));
        }
        assert_eq!(Readings::NONE.sample(5), None);
    }
}
