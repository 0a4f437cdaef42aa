//! Why a parameter is not what was asked for, in one line.

use afbc_store::Name;
use afbc_types::OutOfRange;
use core::fmt;
use heapless::String;

/// Length of STATUSTEXT.
pub const REASON_MAX: usize = 50;

/// One line of at most 50 characters.
// Made without `core::fmt`, whose calls the firmware's stack analysis cannot follow.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reason(String<REASON_MAX>);

impl Reason {
    /// Makes a line: `subject: text`; what is longer is cut.
    pub fn new(subject: &str, text: &str) -> Self {
        let mut line = Line::default();
        [subject, ": ", text].into_iter().for_each(|part| line.text(part));
        Reason(line.text)
    }

    /// Makes the line on a parameter.
    pub(crate) fn on(name: Name, text: &str) -> Self {
        Reason::new(name.as_str(), text)
    }

    /// Makes the line on a value outside the range of its own.
    pub(crate) fn range(name: Name, error: &OutOfRange) -> Self {
        let mut line = Line::default();
        [name.as_str(), ": must be "].into_iter().for_each(|part| line.text(part));
        line.number(error.range.min);
        line.text(" to ");
        line.number(error.range.max);
        Reason(line.text)
    }

    /// Makes the line on a value with which another one leaves its range; without the limit if that is too long.
    pub(crate) fn together(name: Name, error: &OutOfRange) -> Self {
        let OutOfRange { value, range } = error;
        let (side, limit) = if *value > range.max { (" above", range.max) } else { (" below", range.min) };
        let mut line = Line::default();
        [name.as_str(), ": ", range.name, side].into_iter().for_each(|part| line.text(part));
        let short = line.text.clone();
        line.text(" ");
        line.number(limit);
        Reason(if line.is_cut { short } else { line.text })
    }

    /// Returns the text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A line that takes what fits.
#[derive(Default)]
struct Line {
    text: String<REASON_MAX>,
    is_cut: bool,
}

impl Line {
    fn text(&mut self, text: &str) {
        text.chars().for_each(|c| self.char(c));
    }

    fn char(&mut self, c: char) {
        self.is_cut |= self.text.push(c).is_err();
    }

    /// Adds a number to four digits, or to one if it is very small or large.
    fn number(&mut self, number: f64) {
        if number < 0.0 {
            self.char('-');
        }
        let size = libm::fabs(number);
        let unit = match size {
            _ if size >= 1e5 || size > 0.0 && size < 1e-3 => return self.power(size),
            _ if size >= 100.0 => 10,
            _ if size >= 10.0 => 100,
            _ => 1000,
        };
        let scaled = (size * f64::from(unit) + 0.5) as u32;
        self.whole(scaled / unit);
        let (mut rest, mut place) = (scaled % unit, unit / 10);
        if rest > 0 {
            self.char('.');
        }
        while rest > 0 && place > 0 {
            self.digit(rest / place);
            rest %= place;
            place /= 10;
        }
    }

    /// Adds a number as a digit and a power of ten.
    fn power(&mut self, mut size: f64) {
        let mut exponent = 0_i32;
        while size >= 9.5 && exponent < 400 {
            (size, exponent) = (size / 10.0, exponent + 1);
        }
        while size < 0.95 && exponent > -400 {
            (size, exponent) = (size * 10.0, exponent - 1);
        }
        self.digit((size + 0.5) as u32);
        self.text(if exponent < 0 { "e-" } else { "e" });
        self.whole(exponent.unsigned_abs());
    }

    fn whole(&mut self, number: u32) {
        let mut place = 1;
        while number / place >= 10 {
            place *= 10;
        }
        while place > 0 {
            self.digit(number / place % 10);
            place /= 10;
        }
    }

    fn digit(&mut self, digit: u32) {
        self.char(char::from_digit(digit.min(9), 10).unwrap_or('9'));
    }
}
