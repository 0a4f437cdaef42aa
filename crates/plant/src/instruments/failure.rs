//! Failures of instruments. A failure affects measurements taken while it lasts; measurements under way still arrive.

use super::barometer::BarometerReading;
use super::gnss::GnssFix;
use super::imu::ImuReading;
use super::magnetometer::MagnetometerReading;
use super::markov::draw;
use super::tracker::TrackerFix;
use crate::noise::{Noise, NoiseStream};
use afbc_types::{OutOfRange, Range};
use alloc::vec::Vec;
use libm::{cos, exp, sin, sqrt};
use nalgebra::{Quaternion, Vector3};

/// Kind of failure of an instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum FailureKind {
    /// The IMU repeats the last sample before the onset.
    ImuStuck,
    /// The IMU sends nothing.
    ImuDead,
    /// The IMU has additional white noise with these standard deviations per sample.
    ImuNoisy {
        /// Noise of the rates \[rad/s\].
        rates_rad_s: f64,
        /// Noise of the specific force \[m/s2\].
        specific_force_m_s2: f64,
    },
    /// The IMU saturates at these values.
    ImuClipped {
        /// Largest rate \[rad/s\].
        rates_rad_s: f64,
        /// Largest specific force \[m/s2\].
        specific_force_m_s2: f64,
    },
    /// The IMU has an additional bias, in sensor axes.
    ImuBiased {
        /// Bias of the rates \[rad/s\].
        rates_bias_rad_s: Vector3<f64>,
        /// Bias of the specific force \[m/s2\].
        force_bias_m_s2: Vector3<f64>,
    },
    /// The tracker sends nothing.
    TrackerLost,
    /// The tracker repeats the last pose before the onset, with new time stamps.
    TrackerFrozen,
    /// The tracker's frame has moved, and turned about its origin.
    TrackerJumped {
        /// Displacement of the frame \[m\].
        by_m: Vector3<f64>,
        /// Turn of the frame \[rad\].
        yaw_rad: f64,
    },
    /// The GNSS receiver sends nothing.
    GnssLost,
    /// The GNSS receiver's position has an offset.
    GnssJumped {
        /// Offset of the position \[m\].
        by_m: Vector3<f64>,
    },
    /// The GNSS receiver's position has an additional error by reflections, a first-order Gauss-Markov process that the
    /// reported accuracy does not include.
    GnssMultipath {
        /// Standard deviation of the error, per coordinate \[m\].
        deviation_m: f64,
        /// Correlation time of the error \[s\].
        correlation_time_s: f64,
    },
    /// The barometer sends nothing.
    BarometerLost,
    /// The barometer repeats the height before the onset.
    BarometerStuck,
    /// The barometer's port is blocked: the pressure stays at that of the onset, with the usual noise.
    BarometerBlocked,
    /// The magnetometer sends nothing.
    MagnetometerLost,
    /// The magnetometer repeats the field before the onset.
    MagnetometerStuck,
    /// The magnetometer is in an additional field, body frame.
    MagnetometerDisturbed {
        /// Additional field \[uT\].
        field_ut: Vector3<f64>,
    },
}

impl FailureKind {
    /// One failure of each kind, with its numbers zero.
    pub const ALL: [FailureKind; 17] = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        [
            FailureKind::ImuStuck,
            FailureKind::ImuDead,
            FailureKind::ImuNoisy { rates_rad_s: 0.0, specific_force_m_s2: 0.0 },
            FailureKind::ImuClipped { rates_rad_s: 0.0, specific_force_m_s2: 0.0 },
            FailureKind::ImuBiased { rates_bias_rad_s: zero, force_bias_m_s2: zero },
            FailureKind::TrackerLost,
            FailureKind::TrackerFrozen,
            FailureKind::TrackerJumped { by_m: zero, yaw_rad: 0.0 },
            FailureKind::GnssLost,
            FailureKind::GnssJumped { by_m: zero },
            FailureKind::GnssMultipath { deviation_m: 0.0, correlation_time_s: 1.0 },
            FailureKind::BarometerLost,
            FailureKind::BarometerStuck,
            FailureKind::BarometerBlocked,
            FailureKind::MagnetometerLost,
            FailureKind::MagnetometerStuck,
            FailureKind::MagnetometerDisturbed { field_ut: zero },
        ]
    };

    /// Returns the name used in scenario files: the instrument and the kind of failure.
    pub const fn name(self) -> &'static str {
        match self {
            FailureKind::ImuStuck => "imu-stuck",
            FailureKind::ImuDead => "imu-dead",
            FailureKind::ImuNoisy { .. } => "imu-noisy",
            FailureKind::ImuClipped { .. } => "imu-clipped",
            FailureKind::ImuBiased { .. } => "imu-biased",
            FailureKind::TrackerLost => "tracker-lost",
            FailureKind::TrackerFrozen => "tracker-frozen",
            FailureKind::TrackerJumped { .. } => "tracker-jumped",
            FailureKind::GnssLost => "gnss-lost",
            FailureKind::GnssJumped { .. } => "gnss-jumped",
            FailureKind::GnssMultipath { .. } => "gnss-multipath",
            FailureKind::BarometerLost => "barometer-lost",
            FailureKind::BarometerStuck => "barometer-stuck",
            FailureKind::BarometerBlocked => "barometer-blocked",
            FailureKind::MagnetometerLost => "magnetometer-lost",
            FailureKind::MagnetometerStuck => "magnetometer-stuck",
            FailureKind::MagnetometerDisturbed { .. } => "magnetometer-disturbed",
        }
    }

    /// Returns the failure scaled by `share`, `None` for a failure without a size.
    pub fn scaled(self, share: f64) -> Option<Self> {
        Some(match self {
            FailureKind::ImuNoisy { rates_rad_s, specific_force_m_s2 } => FailureKind::ImuNoisy {
                rates_rad_s: rates_rad_s * share,
                specific_force_m_s2: specific_force_m_s2 * share,
            },
            FailureKind::ImuBiased { rates_bias_rad_s, force_bias_m_s2 } => FailureKind::ImuBiased {
                rates_bias_rad_s: rates_bias_rad_s * share,
                force_bias_m_s2: force_bias_m_s2 * share,
            },
            FailureKind::TrackerJumped { by_m, yaw_rad } => {
                FailureKind::TrackerJumped { by_m: by_m * share, yaw_rad: yaw_rad * share }
            }
            FailureKind::GnssJumped { by_m } => FailureKind::GnssJumped { by_m: by_m * share },
            FailureKind::GnssMultipath { deviation_m, correlation_time_s } => {
                FailureKind::GnssMultipath { deviation_m: deviation_m * share, correlation_time_s }
            }
            FailureKind::MagnetometerDisturbed { field_ut } => {
                FailureKind::MagnetometerDisturbed { field_ut: field_ut * share }
            }
            _ => return None,
        })
    }
}

/// Failure from `start_s` to `end_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct InstrumentFault {
    /// Kind of failure.
    pub failure: FailureKind,
    /// Onset \[s\].
    pub start_s: f64,
    /// End \[s\], infinite for a permanent failure.
    pub end_s: f64,
    /// Time from the onset in which the failure grows evenly to its size \[s\]; 0 for at once.
    pub rise_s: f64,
}

/// Accepted ranges of a failure's numbers.
#[expect(missing_docs, reason = "named after the field that each bounds")]
pub mod limits {
    use afbc_types::Range;
    pub const RATES: Range = Range::new("rates_rad_s", 0.0, 1000.0);
    pub const FORCE: Range = Range::new("specific_force_m_s2", 0.0, 10_000.0);
    pub const RATES_BIAS: Range = Range::new("rates_bias_rad_s", -1000.0, 1000.0);
    pub const FORCE_BIAS: Range = Range::new("force_bias_m_s2", -10_000.0, 10_000.0);
    pub const JUMP: Range = Range::new("by_m", -10_000.0, 10_000.0);
    pub const YAW: Range = Range::new("yaw_rad", -10.0, 10.0);
    pub const FIELD: Range = Range::new("field_ut", -100_000.0, 100_000.0);
    pub const DEVIATION: Range = Range::new("deviation_m", 0.0, 1000.0);
    pub const CORRELATION: Range = Range::new("correlation_time_s", 0.001, 1e5);
    pub const START: Range = Range::new("start_s", 0.0, f64::INFINITY);
    pub const RISE: Range = Range::new("rise_s", 0.0, 36_000.0);
}

impl InstrumentFault {
    /// Returns the failure at `now_s`, scaled while it grows.
    fn at(&self, now_s: f64) -> FailureKind {
        if now_s >= self.start_s + self.rise_s {
            return self.failure;
        }
        let share = (now_s - self.start_s) / self.rise_s;
        self.failure.scaled(share).unwrap_or(self.failure)
    }

    /// # Errors
    /// Returns the first number that is out of range, by name.
    pub(super) fn validate(&self) -> Result<(), OutOfRange> {
        limits::START.check(self.start_s)?;
        limits::RISE.check(self.rise_s)?;
        let each = |range: Range, vector: &Vector3<f64>| vector.iter().try_for_each(|&number| range.check(number));
        match &self.failure {
            FailureKind::ImuNoisy { rates_rad_s, specific_force_m_s2 }
            | FailureKind::ImuClipped { rates_rad_s, specific_force_m_s2 } => {
                limits::RATES.check(*rates_rad_s)?;
                limits::FORCE.check(*specific_force_m_s2)
            }
            FailureKind::ImuBiased { rates_bias_rad_s, force_bias_m_s2 } => {
                each(limits::RATES_BIAS, rates_bias_rad_s)?;
                each(limits::FORCE_BIAS, force_bias_m_s2)
            }
            FailureKind::TrackerJumped { by_m, yaw_rad } => {
                each(limits::JUMP, by_m)?;
                limits::YAW.check(*yaw_rad)
            }
            FailureKind::GnssJumped { by_m } => each(limits::JUMP, by_m),
            FailureKind::GnssMultipath { deviation_m, correlation_time_s } => {
                limits::DEVIATION.check(*deviation_m)?;
                limits::CORRELATION.check(*correlation_time_s)
            }
            FailureKind::MagnetometerDisturbed { field_ut } => each(limits::FIELD, field_ut),
            _ => Ok(()),
        }
    }
}

/// Readings from before the onset, and the present value of a wandering error.
#[derive(Clone, Copy, Debug, Default)]
struct FailureMemory {
    imu: Option<ImuReading>,
    tracker: Option<TrackerFix>,
    height: Option<BarometerReading>,
    true_height_m: Option<f64>,
    field: Option<MagnetometerReading>,
    /// Wandering error in standard deviations, and its time \[s\].
    wander: Option<(Vector3<f64>, f64)>,
}

/// Failures of a flight, applied one after the other in the listed order.
#[derive(Clone, Debug)]
pub(super) struct SimulatedFailures {
    faults: Vec<(InstrumentFault, FailureMemory)>,
    /// Last reading of each instrument.
    last: FailureMemory,
    random: Noise,
}

/// Tolerance when comparing times, far below any step \[s\].
const TIME_SLACK_S: f64 = 1e-9;

impl SimulatedFailures {
    pub(super) fn new(faults: &[InstrumentFault], seed: u64) -> Self {
        let faults = faults.iter().map(|fault| (*fault, FailureMemory::default())).collect();
        SimulatedFailures { faults, last: FailureMemory::default(), random: Noise::new(seed, NoiseStream::Failures) }
    }

    /// Adds a failure, and forgets failures that end before it begins.
    pub(super) fn add(&mut self, fault: InstrumentFault) {
        self.faults.retain(|(earlier, _)| earlier.end_s > fault.start_s);
        self.faults.push((fault, FailureMemory::default()));
    }

    pub(super) fn end(&mut self) {
        self.faults.clear();
    }

    /// Returns the failures active at `now_s`, each with its stored readings.
    fn active(
        faults: &mut [(InstrumentFault, FailureMemory)],
        now_s: f64,
    ) -> impl Iterator<Item = (FailureKind, &mut FailureMemory)> {
        let now_s = now_s + TIME_SLACK_S;
        let active = faults.iter_mut().filter(move |(fault, _)| (fault.start_s..fault.end_s).contains(&now_s));
        active.map(move |(fault, held)| (fault.at(now_s), held))
    }

    pub(super) fn imu(&mut self, mut seen: ImuReading) -> Option<ImuReading> {
        let before = *self.last.imu.get_or_insert(seen);
        let mut alive = true;
        for (failure, held) in Self::active(&mut self.faults, seen.at_s) {
            let ImuReading { at_s, rates_rad_s: rates, specific_force_m_s2: force } = &mut seen;
            match failure {
                FailureKind::ImuStuck => seen = ImuReading { at_s: *at_s, ..*held.imu.get_or_insert(before) },
                FailureKind::ImuDead => alive = false,
                FailureKind::ImuNoisy { rates_rad_s, specific_force_m_s2 } => {
                    *rates += draw(&mut self.random) * rates_rad_s;
                    *force += draw(&mut self.random) * specific_force_m_s2;
                }
                FailureKind::ImuClipped { rates_rad_s, specific_force_m_s2 } => {
                    *rates = rates.map(|rate| rate.clamp(-rates_rad_s, rates_rad_s));
                    *force = force.map(|force| force.clamp(-specific_force_m_s2, specific_force_m_s2));
                }
                FailureKind::ImuBiased { rates_bias_rad_s, force_bias_m_s2 } => {
                    (*rates, *force) = (*rates + rates_bias_rad_s, *force + force_bias_m_s2);
                }
                _ => {}
            }
        }
        // The reading is stored with the failures applied, because a sensor that sticks later repeats it.
        self.last.imu = Some(seen);
        alive.then_some(seen)
    }

    pub(super) fn tracker(&mut self, now_s: f64, mut seen: TrackerFix) -> Option<TrackerFix> {
        let before = *self.last.tracker.get_or_insert(seen);
        let mut alive = true;
        // Failures start and end by the true time, since an error of the stamp must not shift them.
        for (failure, held) in Self::active(&mut self.faults, now_s) {
            match failure {
                FailureKind::TrackerLost => alive = false,
                FailureKind::TrackerFrozen => {
                    seen = TrackerFix { true_at_s: seen.true_at_s, ..*held.tracker.get_or_insert(before) };
                }
                FailureKind::TrackerJumped { by_m, yaw_rad } => {
                    let (c, s) = (cos(yaw_rad), sin(yaw_rad));
                    let [[x, y, z]] = seen.position_m.data.0;
                    seen.position_m = by_m + Vector3::new(c * x - s * y, s * x + c * y, z);
                    let turn = Quaternion::new(cos(0.5 * yaw_rad), 0.0, 0.0, sin(0.5 * yaw_rad));
                    seen.attitude = turn * seen.attitude;
                }
                _ => {}
            }
        }
        self.last.tracker = Some(seen);
        alive.then_some(seen)
    }

    pub(super) fn gnss(&mut self, now_s: f64, mut seen: GnssFix) -> Option<GnssFix> {
        let mut alive = true;
        // Failures act by the true time, as for the tracker.
        for (failure, held) in Self::active(&mut self.faults, now_s) {
            match failure {
                FailureKind::GnssLost => alive = false,
                FailureKind::GnssJumped { by_m } => seen.position_m += by_m,
                FailureKind::GnssMultipath { deviation_m, correlation_time_s } => {
                    let drawn = draw(&mut self.random);
                    let off = held.wander.map_or(drawn, |(off, since_s)| {
                        let kept = exp((since_s - now_s) / correlation_time_s);
                        off * kept + drawn * sqrt(1.0 - kept * kept)
                    });
                    held.wander = Some((off, now_s));
                    seen.position_m += off * deviation_m;
                }
                _ => {}
            }
        }
        alive.then_some(seen)
    }

    /// Applies the failures to a height. `true_height_m` is the height without any error.
    pub(super) fn barometer(&mut self, true_height_m: f64, mut seen: BarometerReading) -> Option<BarometerReading> {
        let before = *self.last.height.get_or_insert(seen);
        let mut alive = true;
        for (failure, held) in Self::active(&mut self.faults, seen.true_at_s) {
            match failure {
                FailureKind::BarometerLost => alive = false,
                FailureKind::BarometerStuck => seen.height_m = held.height.get_or_insert(before).height_m,
                FailureKind::BarometerBlocked => {
                    seen.height_m += *held.true_height_m.get_or_insert(true_height_m) - true_height_m;
                }
                _ => {}
            }
        }
        self.last.height = Some(seen);
        alive.then_some(seen)
    }

    pub(super) fn magnetometer(&mut self, mut seen: MagnetometerReading) -> Option<MagnetometerReading> {
        let before = *self.last.field.get_or_insert(seen);
        let mut alive = true;
        for (failure, held) in Self::active(&mut self.faults, seen.true_at_s) {
            match failure {
                FailureKind::MagnetometerLost => alive = false,
                FailureKind::MagnetometerStuck => seen.field_ut = held.field.get_or_insert(before).field_ut,
                FailureKind::MagnetometerDisturbed { field_ut } => seen.field_ut += field_ut,
                _ => {}
            }
        }
        self.last.field = Some(seen);
        alive.then_some(seen)
    }
}
