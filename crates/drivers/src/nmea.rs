//! GNSS receivers that speak NMEA 0183: every one does, without being configured. An epoch is a fix (GGA) and the speed
//! and course of the same time (RMC), in either order, as makers differ; other sentences are left out.
//!
//! The sentences do not say how good a fix is: its standard deviations are taken from the dilution of precision and
//! [`RANGE_SIGMA_M`]. Nor do they have a vertical speed: it is the mean change of the altitude over some [`CLIMB_S`].

use crate::reading::FixReading;
use afbc_types::sin_cos;
use nalgebra::Vector3;
use nmea0183::datetime::Time;
use nmea0183::{GGA, GPSQuality, ParseResult, Parser, RMC};

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
/// Seconds of a day.
const DAY_S: f32 = 86_400.0;

/// Makes fixes of the bytes of a receiver.
pub struct NmeaDecoder {
    parser: Parser,
    /// The halves of an epoch that is not complete.
    fix: Option<GGA>,
    motion: Option<RMC>,
    /// Time of day \[s\], altitude \[m\] and vertical speed \[m/s\] of the last fix.
    last: Option<[f32; 3]>,
    good_sentences: u32,
    bad_sentences: u32,
}

impl Default for NmeaDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl NmeaDecoder {
    /// One that has read nothing.
    #[must_use]
    pub fn new() -> Self {
        NmeaDecoder { parser: Parser::new(), fix: None, motion: None, last: None, good_sentences: 0, bad_sentences: 0 }
    }

    /// Begins a sentence anew, after bytes of another protocol.
    pub fn begin(&mut self) {
        self.parser = Parser::new();
    }

    /// Number of sentences that were whole, and of a known kind.
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
        let parsed = self.parser.parse_from_byte(byte)?;
        self.good_sentences = self.good_sentences.saturating_add(parsed.is_ok().into());
        match parsed {
            Ok(ParseResult::GGA(fix)) => match fix.filter(|fix| fix.gps_quality != GPSQuality::NoFix) {
                Some(fix) => self.fix = Some(fix),
                None => {
                    self.fix = None;
                    return Some(None);
                }
            },
            Ok(ParseResult::RMC(motion)) => self.motion = motion,
            Ok(_) => return None,
            Err(_) => {
                self.bad_sentences = self.bad_sentences.saturating_add(1);
                return None;
            }
        }
        let [fix_s, motion_s] = [&self.fix.as_ref()?.time, &self.motion.as_ref()?.datetime.time].map(seconds);
        // Halves of two epochs: the older one is overwritten once its successor comes. Both times are read from the
        // same digits, so that those of one epoch are equal to the bit.
        if fix_s != motion_s {
            return None;
        }
        let (fix, motion) = (self.fix.take()?, self.motion.take()?);
        Some(self.reading(&fix, &motion))
    }

    fn reading(&mut self, fix: &GGA, motion: &RMC) -> Option<FixReading> {
        let altitude_m = fix.altitude.as_ref()?.meters;
        let (time_s, speed_m_s) = (seconds(&fix.time), motion.speed.as_mps());
        let sigma_m = fix.hdop * RANGE_SIGMA_M;
        let course_deg = motion.course.as_ref().map_or(0.0, |course| course.degrees);
        let [latitude_deg, longitude_deg] = [fix.latitude.as_f64(), fix.longitude.as_f64()];
        let is_finite = [altitude_m, time_s, speed_m_s, sigma_m, course_deg].iter().all(|number| number.is_finite());
        if !(is_finite && latitude_deg.is_finite() && longitude_deg.is_finite() && sigma_m > 0.0) {
            return None;
        }
        let climb_m_s = match self.last {
            Some([last_s, last_m, climb_m_s]) => {
                let passed_s = time_s - last_s;
                let passed_s = if passed_s < 0.0 { passed_s + DAY_S } else { passed_s };
                if passed_s <= PAUSE_S {
                    // The share of a step in a first-order filter, times the change in it.
                    climb_m_s + (altitude_m - last_m - passed_s * climb_m_s) / (passed_s + CLIMB_S)
                } else {
                    0.0
                }
            }
            None => 0.0,
        };
        self.last = Some([time_s, altitude_m, climb_m_s]);
        let (east, north) = sin_cos(course_deg.clamp(-360.0, 360.0) * (core::f32::consts::PI / 180.0));
        Some(FixReading {
            latitude_deg,
            longitude_deg,
            altitude_m: f64::from(altitude_m),
            velocity_ned_m_s: Vector3::new(north * speed_m_s, east * speed_m_s, -climb_m_s),
            horizontal_sigma_m: sigma_m,
            vertical_sigma_m: VERTICAL * sigma_m,
            speed_sigma_m_s: SPEED_SIGMA_M_S,
            climb_sigma_m_s: CLIMB_SIGMA_M_S,
            satellites: fix.sat_in_use,
        })
    }
}

/// Returns the time of day \[s\].
fn seconds(time: &Time) -> f32 {
    f32::from(time.hours) * 3600.0 + f32::from(time.minutes) * 60.0 + time.seconds
}
