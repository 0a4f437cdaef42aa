//! What a vehicle's own sensors have read since the last tick.

use afbc_estimator::{ImuSample, Measurement, Timed};
use nalgebra::Vector3;

/// Most measurements of aiding sensors that a tick takes; further ones wait for the next.
pub const AIDS_MAX: usize = 2;

/// A value that was true some time before the tick that takes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aged<T> {
    /// The value.
    pub value: T,
    /// Its age when the tick begins \[us\].
    pub age_us: u32,
}

impl<T> Aged<T> {
    /// Returns the value with its time on the vehicle's clock.
    pub(crate) fn timed(self, now_us: u64) -> Timed<T> {
        Timed { value: self.value, at_us: now_us.saturating_sub(self.age_us.into()) }
    }
}

/// Readings for one tick. The default is that of a vehicle without sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// Rates \[rad/s\] and specific force \[m/s2\] in the body frame, if there is a new sample.
    pub imu: Option<Aged<[Vector3<f32>; 2]>>,
    /// Measurements, in the order of their arrival, without gaps.
    pub aids: [Option<Aged<Measurement>>; AIDS_MAX],
}

/// Numbers of a measurement on the wire.
const NUMBERS: usize = 9;
/// Bytes of a measurement on the wire: kind, age, numbers.
const AID_LEN: usize = 1 + 4 + 4 * NUMBERS;
/// Bytes of a sample: whether there is one, age, six numbers.
const IMU_LEN: usize = 1 + 4 + 4 * 6;

impl Readings {
    /// No readings.
    pub const NONE: Self = Readings { imu: None, aids: [None; AIDS_MAX] };
    /// Length on the [wire](crate::ReplyHead) \[bytes\].
    pub const LEN: usize = IMU_LEN + AIDS_MAX * AID_LEN;

    /// True if no sensor has read anything.
    pub fn is_empty(&self) -> bool {
        // Without gaps: the first is there if any is.
        self.imu.is_none() && matches!(self.aids, [None, ..])
    }

    /// Forgets all readings.
    pub fn clear(&mut self) {
        self.imu = None;
        for aid in &mut self.aids {
            *aid = None;
        }
    }

    /// Moves all readings of `other` here. Copies only those that are there.
    pub fn take_from(&mut self, other: &mut Readings) {
        self.imu = other.imu.take();
        for (to, from) in self.aids.iter_mut().zip(&mut other.aids) {
            match from {
                Some(aid) => {
                    *to = Some(*aid);
                    *from = None;
                }
                None => *to = None,
            }
        }
    }

    /// Returns the sample with its time, for a tick at `now_us`.
    pub(crate) fn sample(&self, now_us: u64) -> Option<ImuSample> {
        let Timed { value: [rates_rad_s, specific_force_m_s2], at_us } = self.imu?.timed(now_us);
        Some(ImuSample { at_us, rates_rad_s, specific_force_m_s2 })
    }

    /// Returns the readings as they cross the wire.
    pub fn to_bytes(&self) -> [u8; Self::LEN] {
        let imu = self.imu.map_or([0; IMU_LEN], |Aged { value: [rates, force], age_us }| {
            record(1, age_us, rates.iter().chain(&force).copied())
        });
        let aids = self.aids.iter().flat_map(|aid| aid.as_ref().map_or([0; AID_LEN], aid_to_bytes));
        let mut bytes = [0; Self::LEN];
        bytes.iter_mut().zip(imu.into_iter().chain(aids)).for_each(|(to, from)| *to = from);
        bytes
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote. Unknown kinds are left out.
    pub fn from_bytes(bytes: &[u8; Self::LEN]) -> Self {
        let mut rest = bytes.iter().copied();
        let (has_imu, age_us, [p, q, r, x, y, z]) = fields(&mut rest);
        let imu = (has_imu == 1).then_some(Aged { value: [Vector3::new(p, q, r), Vector3::new(x, y, z)], age_us });
        let mut readings = Readings { imu, ..Readings::NONE };
        let mut free = readings.aids.iter_mut();
        for _ in 0..AIDS_MAX {
            let (kind, age_us, numbers) = fields(&mut rest);
            if let (Some(value), true) = (measurement(kind, numbers), free.len() > 0) {
                free.next().into_iter().for_each(|slot| *slot = Some(Aged { value, age_us }));
            }
        }
        readings
    }
}

/// Returns kind, age and numbers as bytes, with zeros up to the end.
fn record<const L: usize>(kind: u8, age_us: u32, numbers: impl Iterator<Item = f32>) -> [u8; L] {
    let mut bytes = [0; L];
    let all = [kind].into_iter().chain(age_us.to_le_bytes()).chain(numbers.flat_map(f32::to_le_bytes));
    bytes.iter_mut().zip(all).for_each(|(to, from)| *to = from);
    bytes
}

/// Reads kind, age and numbers.
fn fields<const N: usize>(rest: &mut impl Iterator<Item = u8>) -> (u8, u32, [f32; N]) {
    let kind = rest.next().unwrap_or_default();
    let mut word = || [(); 4].map(|()| rest.next().unwrap_or_default());
    let age_us = u32::from_le_bytes(word());
    (kind, age_us, [(); N].map(|()| f32::from_le_bytes(word())))
}

fn aid_to_bytes(aid: &Aged<Measurement>) -> [u8; AID_LEN] {
    let (kind, vectors, numbers): (u8, [Vector3<f32>; 2], [f32; 6]) = match aid.value {
        Measurement::Pose { position_m, attitude: [w, x, y, z], position_sigma_m, attitude_sigma_rad } => {
            (1, [position_m, Vector3::new(w, x, y)], [z, position_sigma_m, attitude_sigma_rad, 0.0, 0.0, 0.0])
        }
        Measurement::Position { position_m, sigma_m } => (2, [position_m, Vector3::new(sigma_m, 0.0, 0.0)], [0.0; 6]),
        Measurement::Gnss { position_m, velocity_m_s, horizontal_sigma_m, vertical_sigma_m, speed_sigma_m_s } => {
            (3, [position_m, velocity_m_s], [horizontal_sigma_m, vertical_sigma_m, speed_sigma_m_s, 0.0, 0.0, 0.0])
        }
        Measurement::Height { height_m, sigma_m } => {
            (4, [Vector3::new(height_m, sigma_m, 0.0), Vector3::zeros()], [0.0; 6])
        }
        Measurement::MagneticField { field, sigma } => (5, [field, Vector3::new(sigma, 0.0, 0.0)], [0.0; 6]),
        Measurement::Heading { heading_rad, sigma_rad } => {
            (6, [Vector3::new(heading_rad, sigma_rad, 0.0), Vector3::zeros()], [0.0; 6])
        }
    };
    let [first, second] = vectors;
    record(kind, aid.age_us, first.iter().copied().chain(second.iter().copied()).chain(numbers))
}

fn measurement(kind: u8, [a, b, c, d, e, f, g, h, i]: [f32; NUMBERS]) -> Option<Measurement> {
    let first = Vector3::new(a, b, c);
    Some(match kind {
        1 => {
            Measurement::Pose { position_m: first, attitude: [d, e, f, g], position_sigma_m: h, attitude_sigma_rad: i }
        }
        2 => Measurement::Position { position_m: first, sigma_m: d },
        3 => Measurement::Gnss {
            position_m: first,
            velocity_m_s: Vector3::new(d, e, f),
            horizontal_sigma_m: g,
            vertical_sigma_m: h,
            speed_sigma_m_s: i,
        },
        4 => Measurement::Height { height_m: a, sigma_m: b },
        5 => Measurement::MagneticField { field: first, sigma: d },
        6 => Measurement::Heading { heading_rad: a, sigma_rad: b },
        _ => return None,
    })
}
