//! GNSS receivers that speak NMEA 0183: every one does, without being configured. An epoch is a fix (GGA) and the speed
//! and course of the same time (RMC); other sentences are left out.
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
/// Standard deviation of the velocity \[m/s\]: that of the vertical speed, from altitudes with a noise of half a metre.
const SPEED_SIGMA_M_S: f32 = 1.0;
/// Time constant of the vertical speed, and longest time between two altitudes that it takes \[s\].
pub const CLIMB_S: f32 = 1.0;
const PAUSE_S: f32 = 2.0;
/// Seconds of a day.
const DAY_S: f32 = 86_400.0;
/// Baud rates of receivers as they are delivered, the most common first.
pub const BAUDS: [u32; 5] = [38_400, 9_600, 115_200, 57_600, 230_400];

/// Makes fixes of the bytes of a receiver.
pub struct NmeaDecoder {
    parser: Parser,
    fix: Option<GGA>,
    /// Time of day \[s\], altitude \[m\] and vertical speed \[m/s\] of the last fix.
    last: Option<[f32; 3]>,
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
        NmeaDecoder { parser: Parser::new(), fix: None, last: None, bad_sentences: 0 }
    }

    /// Number of sentences that were damaged: a bad line, or the wrong baud rate.
    #[must_use]
    pub fn bad_sentences(&self) -> u32 {
        self.bad_sentences
    }

    /// Takes a byte, and returns the fix whose last one it is: `Some(None)` for an epoch without a fix.
    pub fn take(&mut self, byte: u8) -> Option<Option<FixReading>> {
        match self.parser.parse_from_byte(byte)? {
            Ok(ParseResult::GGA(fix)) => {
                self.fix = fix.filter(|fix| fix.gps_quality != GPSQuality::NoFix);
                if self.fix.is_some() { None } else { Some(None) }
            }
            Ok(ParseResult::RMC(Some(motion))) => {
                let fix = self.fix.take()?;
                (seconds(&fix.time) == seconds(&motion.datetime.time)).then(|| self.reading(&fix, &motion))
            }
            Ok(_) => None,
            Err(_) => {
                self.bad_sentences = self.bad_sentences.saturating_add(1);
                None
            }
        }
    }

    fn reading(&mut self, fix: &GGA, motion: &RMC) -> Option<FixReading> {
        let altitude_m = fix.altitude.as_ref()?.meters;
        let time_s = seconds(&fix.time);
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
        let course_deg = motion.course.as_ref().map_or(0.0, |course| course.degrees);
        let course_rad = course_deg.clamp(-360.0, 360.0) * (core::f32::consts::PI / 180.0);
        let (east, north) = sin_cos(course_rad);
        let speed_m_s = motion.speed.as_mps();
        let sigma_m = fix.hdop * RANGE_SIGMA_M;
        let reading = FixReading {
            latitude_deg: fix.latitude.as_f64(),
            longitude_deg: fix.longitude.as_f64(),
            altitude_m: f64::from(altitude_m),
            velocity_ned_m_s: Vector3::new(north * speed_m_s, east * speed_m_s, -climb_m_s),
            horizontal_sigma_m: sigma_m,
            vertical_sigma_m: VERTICAL * sigma_m,
            speed_sigma_m_s: SPEED_SIGMA_M_S,
            satellites: fix.sat_in_use,
        };
        let numbers = [reading.latitude_deg, reading.longitude_deg, reading.altitude_m, sigma_m.into()];
        let finite = numbers.iter().all(|number| number.is_finite()) && speed_m_s.is_finite();
        (finite && sigma_m > 0.0).then_some(reading)
    }
}

/// Returns the time of day \[s\].
fn seconds(time: &Time) -> f32 {
    f32::from(time.hours) * 3600.0 + f32::from(time.minutes) * 60.0 + time.seconds
}
