//! GNSS receivers that speak NMEA 0183: every one does, without being configured. An epoch is a fix (GGA) and the speed
//! and course of the same time (RMC), in either order, as makers differ; other sentences are left out. Both must say
//! that they are measured: dead reckoning, a place put in by hand and a simulator's are an epoch without a fix.
//!
//! The sentences do not say how good a fix is: its standard deviations are taken from the dilution of precision and
//! [`RANGE_SIGMA_M`]. Nor do they have a vertical speed: it is the mean change of the altitude over some [`CLIMB_S`].

mod sentence;

use crate::reading::FixReading;
use afbc_types::sin_cos;
use nalgebra::Vector3;
use sentence::{Fix, Framed, Framing, Motion, Sentence};

/// Standard deviation of a satellite's range, with which the dilution of precision gives that of a position \[m\]: a
/// single-frequency receiver under an open sky.
pub const RANGE_SIGMA_M: f32 = 2.5;
/// Ratio of vertical to horizontal dilution, usually.
const VERTICAL: f32 = 1.5;
/// Standard deviation of the velocity to the north, and to the east \[m/s\]: what PX4 takes for receivers that do not
/// say (`EKF2_GPS_V_NOISE`).
const SPEED_SIGMA_M_S: f32 = 0.3;
/// Standard deviation of the vertical speed \[m/s\]: white noise of 1 m in the altitudes of a receiver with 10 fixes a
/// second leaves 0.9 m/s, and the mean lags 1 m/s behind a vehicle that climbs faster by 1 m/s2.
const CLIMB_SIGMA_M_S: f32 = 1.5;
/// Time constant of the vertical speed, and longest time between two altitudes that it takes \[s\].
pub const CLIMB_S: f32 = 1.0;
const PAUSE_S: f32 = 2.0;
/// A knot \[m/s\].
const KNOT_M_S: f32 = 1852.0 / 3600.0;
/// Milliseconds of a day.
const DAY_MS: u32 = 86_400_000;

/// Makes fixes of the bytes of a receiver.
#[derive(Default)]
pub struct NmeaDecoder {
    framing: Framing,
    /// The halves of an epoch that is not complete.
    fix: Option<Fix>,
    motion: Option<Motion>,
    /// Time of day \[ms\], altitude \[m\] and vertical speed \[m/s\] of the last fix.
    last: Option<(u32, f32, f32)>,
    good_sentences: u32,
    bad_sentences: u32,
}

impl NmeaDecoder {
    /// One that has read nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Begins a sentence anew, after bytes of another protocol.
    pub fn begin(&mut self) {
        self.framing = Framing::default();
    }

    /// Number of sentences that were whole.
    #[must_use]
    pub fn good_sentences(&self) -> u32 {
        self.good_sentences
    }

    /// Number of sentences that were damaged: a bad line, or the wrong baud rate.
    #[must_use]
    pub fn bad_sentences(&self) -> u32 {
        self.bad_sentences
    }

    /// Takes a byte, and returns the fix that it completes: `Some(None)` for an epoch without a fix.
    pub fn take(&mut self, byte: u8) -> Option<Option<FixReading>> {
        let sentence = match self.framing.take(byte)? {
            Framed::Whole(body) => Sentence::read(body),
            Framed::Damaged => Err(()),
        };
        let count = if sentence.is_ok() { &mut self.good_sentences } else { &mut self.bad_sentences };
        *count = count.saturating_add(1);
        let is_measured = match sentence.ok()?? {
            Sentence::Fix(fix) => {
                self.fix = fix;
                fix.is_some()
            }
            Sentence::Motion(motion) => {
                self.motion = motion;
                motion.is_some()
            }
        };
        if !is_measured {
            return Some(None);
        }
        // Halves of two epochs: the older one is overwritten once its successor comes.
        let (fix, motion) = (self.fix?, self.motion?);
        if fix.time_ms != motion.time_ms {
            return None;
        }
        (self.fix, self.motion) = (None, None);
        Some(self.reading(&fix, &motion))
    }

    /// Returns what an epoch's halves say; none if no receiver can have it.
    fn reading(&mut self, fix: &Fix, motion: &Motion) -> Option<FixReading> {
        let thousandths = |number: i32| number as f32 / 1000.0;
        let (altitude_m, sigma_m) = (thousandths(fix.altitude_mm), thousandths(fix.dilution) * RANGE_SIGMA_M);
        let (speed_m_s, course_deg) = (thousandths(motion.speed) * KNOT_M_S, thousandths(motion.course));
        let climb_m_s = match self.last {
            Some((last_ms, last_m, climb_m_s)) => {
                let passed_s = ((fix.time_ms + DAY_MS).saturating_sub(last_ms) % DAY_MS) as f32 / 1000.0;
                if passed_s <= PAUSE_S {
                    // The share of a step in a first-order filter, times the change in it.
                    climb_m_s + (altitude_m - last_m - passed_s * climb_m_s) / (passed_s + CLIMB_S)
                } else {
                    0.0
                }
            }
            None => 0.0,
        };
        let (east, north) = sin_cos(course_deg.clamp(-360.0, 360.0) * (core::f32::consts::PI / 180.0));
        let reading = FixReading {
            latitude_deg: fix.latitude.degrees(),
            longitude_deg: fix.longitude.degrees(),
            altitude_m: f64::from(altitude_m),
            velocity_ned_m_s: Vector3::new(north * speed_m_s, east * speed_m_s, -climb_m_s),
            horizontal_sigma_m: sigma_m,
            vertical_sigma_m: VERTICAL * sigma_m,
            speed_sigma_m_s: SPEED_SIGMA_M_S,
            climb_sigma_m_s: CLIMB_SIGMA_M_S,
            satellites: fix.satellites,
        };
        let reading = reading.possible()?;
        self.last = Some((fix.time_ms, altitude_m, climb_m_s));
        Some(reading)
    }
}
