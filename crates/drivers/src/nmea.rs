//! GNSS receivers that speak NMEA 0183, which every one does without configuration. An epoch is a position (GGA) and
//! the speed and course of the same time (RMC), in either order, since makers differ. Other sentences are ignored. Both
//! sentences must say that they are measured. Dead reckoning, a manual position and a simulator's position count as an
//! epoch without a fix.
//!
//! The sentences do not state the accuracy of a fix. Its standard deviations are computed from the dilution of
//! precision and [`RANGE_SIGMA_M`]. The sentences do not state the vertical speed either. It is computed as the
//! low-pass filtered change of the altitude, with the time constant [`CLIMB_S`].

mod sentence;

use crate::reading::GnssReading;
use afbc_types::sin_cos;
use nalgebra::Vector3;
use sentence::{FramedSentence, GgaFields, RmcFields, Sentence, SentenceFramer};

/// Standard deviation of a satellite's range, for a single-frequency receiver under an open sky \[m\]. Multiplied by
/// the dilution of precision, it gives the standard deviation of a position.
pub const RANGE_SIGMA_M: f32 = 2.5;
/// Typical ratio of vertical to horizontal dilution of precision.
const VERTICAL: f32 = 1.5;
/// Standard deviation of the velocity to the north, and to the east \[m/s\]: PX4's value for receivers that do not
/// state it (`EKF2_GPS_V_NOISE`).
const SPEED_SIGMA_M_S: f32 = 0.3;
/// Standard deviation of the vertical speed \[m/s\]. With 10 fixes per second and white altitude noise of 1 m, the
/// filtered speed has 0.9 m/s; at a vertical acceleration of 1 m/s2 it lags by 1 m/s.
const CLIMB_SIGMA_M_S: f32 = 1.5;
/// Time constant of the vertical speed, and longest time between two altitudes that it uses \[s\].
pub const CLIMB_S: f32 = 1.0;
const PAUSE_S: f32 = 2.0;
/// One knot \[m/s\].
const KNOT_M_S: f32 = 1852.0 / 3600.0;
/// Milliseconds per day.
const DAY_MS: u32 = 86_400_000;

/// Decodes a receiver's bytes into fixes.
#[derive(Default)]
pub struct NmeaDecoder {
    framing: SentenceFramer,
    /// Sentences of an incomplete epoch.
    fix: Option<GgaFields>,
    motion: Option<RmcFields>,
    /// Time of day \[ms\], altitude \[m\] and vertical speed \[m/s\] of the last fix.
    last: Option<(u32, f32, f32)>,
    good_sentences: u32,
    bad_sentences: u32,
}

impl NmeaDecoder {
    /// Creates a decoder that has read nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Discards the current sentence, after bytes of another protocol.
    pub fn begin(&mut self) {
        self.framing = SentenceFramer::default();
    }

    /// Returns the number of valid sentences.
    #[must_use]
    pub fn good_sentences(&self) -> u32 {
        self.good_sentences
    }

    /// Returns the number of damaged sentences, caused by a bad line or a wrong baud rate.
    #[must_use]
    pub fn bad_sentences(&self) -> u32 {
        self.bad_sentences
    }

    /// Takes a byte and returns the fix that it completes; `Some(None)` is an epoch without a fix.
    pub fn take(&mut self, byte: u8) -> Option<Option<GnssReading>> {
        let sentence = match self.framing.take(byte)? {
            FramedSentence::Whole(body) => Sentence::read(body),
            FramedSentence::Damaged => Err(()),
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
        // If the two sentences are of different epochs, the older sentence is overwritten when its successor comes.
        let (fix, motion) = (self.fix?, self.motion?);
        if fix.time_ms != motion.time_ms {
            return None;
        }
        (self.fix, self.motion) = (None, None);
        Some(self.reading(&fix, &motion))
    }

    /// Combines the sentences of an epoch; returns none if the numbers are impossible.
    fn reading(&mut self, fix: &GgaFields, motion: &RmcFields) -> Option<GnssReading> {
        let thousandths = |number: i32| number as f32 / 1000.0;
        let (altitude_m, sigma_m) = (thousandths(fix.altitude_mm), thousandths(fix.dilution) * RANGE_SIGMA_M);
        let (speed_m_s, course_deg) = (thousandths(motion.speed) * KNOT_M_S, thousandths(motion.course));
        let climb_m_s = match self.last {
            Some((last_ms, last_m, climb_m_s)) => {
                let passed_s = ((fix.time_ms + DAY_MS).saturating_sub(last_ms) % DAY_MS) as f32 / 1000.0;
                if passed_s <= PAUSE_S {
                    // Step of a first-order filter: its share, times the difference from the present value.
                    climb_m_s + (altitude_m - last_m - passed_s * climb_m_s) / (passed_s + CLIMB_S)
                } else {
                    0.0
                }
            }
            None => 0.0,
        };
        let (east, north) = sin_cos(course_deg.clamp(-360.0, 360.0) * (core::f32::consts::PI / 180.0));
        let reading = GnssReading {
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
