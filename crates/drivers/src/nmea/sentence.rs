//! NMEA 0183 sentences: framing with checksum, and the fields of position and motion.
//!
//! Numbers are read as integers in units of their last decimal place. Floating-point parsing would need large tables in
//! flash and double precision, which these chips do not have.

use heapless::Vec;

/// Longest sentence read, without `$` and checksum: NMEA allows 79 bytes, some receivers write more.
const LENGTH: usize = 100;
/// GGA qualities of a measured fix: satellites alone (1), with corrections (2, 3, and NovAtel's 9), carrier phase (4,
/// 5). Not measured are dead reckoning (6), a manual position (7) and a simulator (8).
const MEASURED: &[u8] = b"123459";
/// One degree in ten-millionths of a minute.
const DEGREE: i32 = 600_000_000;

/// Assembles sentences byte by byte.
#[derive(Default)]
pub(super) struct SentenceFramer {
    body: Vec<u8, LENGTH>,
    place: FramingState,
}

/// Position of the next byte in a sentence.
#[derive(Clone, Copy, Default)]
enum FramingState {
    /// Outside any sentence.
    #[default]
    Outside,
    Body,
    /// Checksum; holds its first digit once it was read.
    Checksum(Option<u8>),
}

/// Result of a byte that ends a sentence.
#[derive(Debug, PartialEq)]
pub(super) enum FramedSentence<'a> {
    /// Body of a sentence with a correct checksum, without `$` and checksum.
    Whole(&'a [u8]),
    Damaged,
}

impl SentenceFramer {
    /// Takes a byte; returns the sentence that it completes or shows to be damaged.
    pub(super) fn take(&mut self, byte: u8) -> Option<FramedSentence<'_>> {
        let damaged = match (self.place, byte) {
            (place, b'$') => {
                self.body.clear();
                self.place = FramingState::Body;
                // A sentence that has begun is cut off.
                !matches!(place, FramingState::Outside)
            }
            (FramingState::Outside, _) => false,
            (FramingState::Body, b'*') => {
                self.place = FramingState::Checksum(None);
                false
            }
            // Other bytes cannot be part of a sentence.
            (FramingState::Body, b' '..=b'~') => self.body.push(byte).is_err(),
            (FramingState::Body, _) => true,
            (FramingState::Checksum(upper), _) => match (hexadecimal(byte), upper) {
                (None, _) => true,
                (digit, None) => {
                    self.place = FramingState::Checksum(digit);
                    false
                }
                (Some(lower), Some(upper)) => {
                    self.place = FramingState::Outside;
                    let sum = self.body.iter().fold(0, |sum, byte| sum ^ byte);
                    return Some(if sum == upper << 4 | lower {
                        FramedSentence::Whole(&self.body)
                    } else {
                        FramedSentence::Damaged
                    });
                }
            },
        };
        if damaged && byte != b'$' {
            self.place = FramingState::Outside;
        }
        damaged.then_some(FramedSentence::Damaged)
    }
}

fn hexadecimal(digit: u8) -> Option<u8> {
    match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'A'..=b'F' => Some(digit - b'A' + 10),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        _ => None,
    }
}

/// A sentence used for an epoch.
#[derive(Debug, PartialEq)]
pub(super) enum Sentence {
    /// A sentence GGA. The fields are none without a measured fix.
    Fix(Option<GgaFields>),
    /// A sentence RMC. The fields are none if the sentence is not valid or was not measured.
    Motion(Option<RmcFields>),
}

/// Fields of GGA.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GgaFields {
    /// Time of day \[ms\].
    pub(super) time_ms: u32,
    pub(super) latitude: Angle,
    pub(super) longitude: Angle,
    pub(super) satellites: u8,
    /// Horizontal dilution of precision \[0.001\].
    pub(super) dilution: i32,
    /// Altitude above the geoid \[mm\].
    pub(super) altitude_mm: i32,
}

/// Fields of RMC.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RmcFields {
    /// Time of day \[ms\].
    pub(super) time_ms: u32,
    /// Speed over ground \[0.001 knots\].
    pub(super) speed: i32,
    /// Course from the north, clockwise \[0.001 deg\]; 0 if the receiver gives none, as at rest.
    pub(super) course: i32,
}

/// A latitude or longitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Angle {
    degrees: i32,
    /// Minutes \[1e-7 minutes\].
    minutes: i32,
    is_negative: bool,
}

impl Angle {
    /// Returns the angle in degrees.
    pub(super) fn degrees(self) -> f64 {
        let degrees = f64::from(self.degrees) + f64::from(self.minutes) / f64::from(DEGREE);
        if self.is_negative { -degrees } else { degrees }
    }
}

impl Sentence {
    /// Parses a sentence of any two-letter talker. Returns none for other kinds, and for proprietary sentences, which
    /// begin with P (`PGRMC`).
    /// # Errors
    /// If a required field is not a number or out of range.
    pub(super) fn read(body: &[u8]) -> Result<Option<Self>, ()> {
        let mut fields = body.split(|byte| *byte == b',');
        let kind = match fields.next() {
            Some([b'A'..=b'O' | b'Q'..=b'Z', b'A'..=b'Z', kind @ ..]) => kind,
            _ => return Ok(None),
        };
        let mut fields = SentenceFields(fields);
        Ok(match kind {
            b"GGA" => Some(Sentence::Fix(fields.fix().ok_or(())?)),
            b"RMC" => Some(Sentence::Motion(fields.motion().ok_or(())?)),
            _ => None,
        })
    }
}

/// Fields not yet read.
struct SentenceFields<I>(I);

impl<'a, I: Iterator<Item = &'a [u8]>> SentenceFields<I> {
    fn next(&mut self) -> Option<&'a [u8]> {
        self.0.next()
    }

    /// Parses GGA; `Some(None)` without a measured fix.
    fn fix(&mut self) -> Option<Option<GgaFields>> {
        let time = self.next()?;
        let [latitude, north, longitude, east] = [self.next()?, self.next()?, self.next()?, self.next()?];
        if !matches!(self.next()?, [quality] if MEASURED.contains(quality)) {
            return Some(None);
        }
        let fix = GgaFields {
            time_ms: time_of_day(time)?,
            latitude: angle(latitude, north, *b"NS", 90)?,
            longitude: angle(longitude, east, *b"EW", 180)?,
            satellites: decimal(self.next()?, 0)?.try_into().ok()?,
            dilution: decimal(self.next()?, 3)?,
            altitude_mm: decimal(self.next()?, 3)?,
        };
        Some(Some(fix))
    }

    /// Parses RMC; `Some(None)` if it is not valid or not measured.
    fn motion(&mut self) -> Option<Option<RmcFields>> {
        let time = self.next()?;
        if self.next()? != b"A" {
            return Some(None);
        }
        // Skips the position, which GGA gives.
        let speed = self.0.nth(4)?;
        let course = self.next()?;
        // The mode follows date and magnetic variation; receivers before NMEA 2.3 do not send it.
        if !matches!(self.0.nth(3), None | Some(b"" | b"A" | b"D" | b"F" | b"P" | b"R")) {
            return Some(None);
        }
        Some(Some(RmcFields {
            time_ms: time_of_day(time)?,
            speed: decimal(speed, 3)?,
            course: if course.is_empty() { 0 } else { decimal(course, 3)? },
        }))
    }
}

/// Parses a decimal number in units of its `places`-th decimal place; further places are cut off.
fn decimal(text: &[u8], places: usize) -> Option<i32> {
    let (is_negative, digits) = match text {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    let point = digits.iter().position(|byte| *byte == b'.').unwrap_or(digits.len());
    let (whole, fraction) = digits.split_at_checked(point)?;
    let fraction = fraction.get(1..).unwrap_or_default();
    if whole.is_empty() && fraction.is_empty() || !whole.iter().chain(fraction).all(u8::is_ascii_digit) {
        return None;
    }
    let padded = fraction.iter().chain([b'0'; 8].iter()).take(places);
    let number = whole
        .iter()
        .chain(padded)
        .try_fold(0_i32, |number, digit| number.checked_mul(10)?.checked_add(i32::from(digit - b'0')))?;
    Some(if is_negative { -number } else { number })
}

/// Parses `hhmmss.sss` into milliseconds of the day. A leap second (60) counts as the first second of the next minute.
fn time_of_day(text: &[u8]) -> Option<u32> {
    let number: u32 = decimal(text, 3)?.try_into().ok()?;
    let (hours, minutes, milliseconds) = (number / 10_000_000, number / 100_000 % 100, number % 100_000);
    let is_time = hours < 24 && minutes < 60 && milliseconds < 61_000;
    is_time.then_some((hours * 60 + minutes) * 60_000 + milliseconds)
}

/// Parses `dddmm.mmmmm` and one of two direction letters.
fn angle(text: &[u8], letter: &[u8], [positive, negative]: [u8; 2], most: i32) -> Option<Angle> {
    let point = text.iter().position(|byte| *byte == b'.').unwrap_or(text.len());
    let (degrees, minutes) = text.split_at_checked(point.checked_sub(2)?)?;
    let (degrees, minutes) = (decimal(degrees, 0)?, decimal(minutes, 7)?);
    let is_negative = letter == [negative];
    let is_angle = (0..DEGREE).contains(&minutes) && (0..most).contains(&degrees) || (degrees, minutes) == (most, 0);
    (is_angle && (is_negative || letter == [positive])).then_some(Angle { degrees, minutes, is_negative })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_cut_and_filled() {
        let read = [("0.9", 900), ("-12.3456", -12_345), ("7", 7_000), (".5", 500), ("5.", 5_000), ("00.001", 1)];
        for (text, expected) in read {
            assert_eq!(decimal(text.as_bytes(), 3), Some(expected), "{text}");
        }
        for text in ["", ".", "-", "1e3", "+1", "1.2.3", "inf", "NaN", "3000000", "--1", "1 "] {
            assert_eq!(decimal(text.as_bytes(), 3), None, "{text}");
        }
    }

    #[test]
    fn angles_and_times_have_ranges() {
        let north = |text: &str| angle(text.as_bytes(), b"N", *b"NS", 90);
        assert_eq!(north("9000.000").map(Angle::degrees), Some(90.0));
        assert_eq!(north("0000.3").map(Angle::degrees), Some(0.005));
        for text in ["9000.001", "9100.0", "4760.0", "-447.0", "4.0", "", "47-1.0", "4712"] {
            assert_eq!(north(text).map(Angle::degrees).filter(|_| text != "4712"), None, "{text}");
        }
        assert_eq!(angle(b"4712", b"S", *b"NS", 90).map(Angle::degrees), Some(-47.2));
        assert_eq!(angle(b"4712", b"E", *b"NS", 90), None);
        assert_eq!(time_of_day(b"235960.5"), Some(86_400_500));
        for text in ["240000", "236000", "235961", "-10000", "99999999"] {
            assert_eq!(time_of_day(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn a_sentence_that_breaks_off_is_damaged() {
        let mut framing = SentenceFramer::default();
        let mut damaged = 0;
        let mut whole = 0;
        for byte in b"$GP,1$GPX*17\r\n$GP\r\n$*0\xFF$A*40 $A*4g$A*41\r\n" {
            match framing.take(*byte) {
                Some(FramedSentence::Whole(_)) => whole += 1,
                Some(FramedSentence::Damaged) => damaged += 1,
                None => (),
            }
        }
        // The checksum of `GPX` is 0x4F, that of `A` is 0x41.
        assert_eq!((whole, damaged), (1, 6));
        let long: Vec<u8, 200> = core::iter::once(b'$').chain([b'A'; 150]).collect();
        assert_eq!(long.iter().filter(|byte| framing.take(**byte) == Some(FramedSentence::Damaged)).count(), 1);
    }
}
