//! One-line reasons why a parameter was not set as requested.

use afbc_store::RecordName;
use afbc_types::OutOfRange;
use core::fmt;
use heapless::String;

/// Length of the text in a STATUSTEXT message.
pub const REASON_MAX: usize = 50;

/// One line of at most 50 characters.
// The text is made without `core::fmt`, whose calls the firmware's stack analysis cannot follow.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reason(String<REASON_MAX>);

impl Reason {
    /// Creates the line `subject: text`, cut to the length that fits.
    pub fn new(subject: &str, text: &str) -> Self {
        let mut line = ReasonLine::default();
        [subject, ": ", text].into_iter().for_each(|part| line.text(part));
        Reason(line.text)
    }

    /// Creates a line about a parameter.
    pub fn on(name: RecordName, text: &str) -> Self {
        Reason::new(name.as_str(), text)
    }

    /// Creates a line about a value out of its own range.
    pub(crate) fn range(name: RecordName, error: &OutOfRange) -> Self {
        let mut line = ReasonLine::default();
        [name.as_str(), ": must be "].into_iter().for_each(|part| line.text(part));
        line.number(error.range.min);
        line.text(" to ");
        line.number(error.range.max);
        Reason(line.text)
    }

    /// Creates a line about a value that puts another quantity out of range. Leaves out the limit if the line gets too
    /// long.
    pub(crate) fn together(name: RecordName, error: &OutOfRange) -> Self {
        let OutOfRange { value, range } = error;
        let (side, limit) = if *value > range.max { (" above", range.max) } else { (" below", range.min) };
        let mut line = ReasonLine::default();
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

/// A line that drops the characters that do not fit.
#[derive(Default)]
struct ReasonLine {
    text: String<REASON_MAX>,
    is_cut: bool,
}

impl ReasonLine {
    fn text(&mut self, text: &str) {
        text.chars().for_each(|c| self.char(c));
    }

    fn char(&mut self, c: char) {
        self.is_cut |= self.text.push(c).is_err();
    }

    /// Appends a number with four digits, or with one if it is very small or large.
    fn number(&mut self, number: f64) {
        if number < 0.0 {
            self.char('-');
        }
        let size = number.abs();
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

    /// Appends a number as one digit and a power of ten.
    fn power(&mut self, mut size: f64) {
        let mut exponent = 0_i32;
        // Scales the number until it rounds to a single digit. Exponents of f64 end at 308; the limit is for infinity.
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

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    extern crate std;
    use super::*;
    use afbc_types::Range;
    use proptest::prelude::*;
    use std::string::{String as Text, ToString};

    fn written(number: f64) -> Text {
        let mut line = ReasonLine::default();
        line.number(number);
        line.text.to_string()
    }

    proptest! {
        /// A number is written with four digits, or with one if it is very small or large. There are no needless zeros
        /// before it, or at the end of a fraction.
        #[test]
        fn numbers_are_written_as_they_are(mantissa in 1.0..10.0_f64, exponent in -12..13_i32, negative: bool) {
            let size = mantissa * 10.0_f64.powi(exponent);
            let number = if negative { -size } else { size };
            let text = written(number);
            let read: f64 = text.parse().expect("a number");
            let is_power = !(1e-3..1e5).contains(&size);
            prop_assert_eq!(text.contains('e'), is_power, "{} {}", number, text);
            let unit = match size {
                _ if is_power => 0.51 * 10.0_f64.powi(size.log10().floor() as i32),
                _ if size >= 100.0 => 0.051,
                _ if size >= 10.0 => 0.0051,
                _ => 0.00051,
            };
            prop_assert!((read - number).abs() <= unit, "{} {}", number, text);
            prop_assert_eq!(text.starts_with('-'), negative);
            let digits = text.trim_start_matches('-');
            prop_assert!(!digits.starts_with('.') && !digits.ends_with('.'), "{}", text);
            prop_assert!(!digits.contains('.') || !digits.ends_with('0'), "{}", text);
            prop_assert!(!digits.starts_with('0') || digits.starts_with("0.") || digits == "0", "{}", text);
            prop_assert!(!is_power || digits.split('e').next().map(str::len) == Some(1), "{}", text);
        }
    }

    #[test]
    fn numbers_at_the_ends_of_their_forms() {
        for (number, text) in [
            (0.0, "0"),
            (1e-3, "0.001"),
            (9e-4, "9e-4"),
            (0.05, "0.05"),
            (9.5e-7, "1e-6"),
            (9.4e-7, "9e-7"),
            (1.0, "1"),
            (-1.5, "-1.5"),
            (9.999, "9.999"),
            (10.0, "10"),
            (12.34, "12.34"),
            (12.04, "12.04"),
            (99.99, "99.99"),
            (100.0, "100"),
            (123.4, "123.4"),
            (99_999.0, "99999"),
            (1e5, "1e5"),
            (9.4e5, "9e5"),
            (9.5e5, "1e6"),
            (1e30, "1e30"),
            (1e-30, "1e-30"),
        ] {
            assert_eq!(written(number), text);
        }
    }

    #[test]
    fn lines_say_what_is_wrong_and_are_cut() {
        let name = RecordName::new("V_MASS").expect("short");
        assert_eq!(Reason::on(name, "why").to_string(), "V_MASS: why");
        assert_eq!(Reason::new("subject", "text").as_str(), "subject: text");
        let range = Range::new("mass_kg", 0.5, 20.0);
        let error = |value| OutOfRange { value, range };
        assert_eq!(Reason::range(name, &error(0.0)).as_str(), "V_MASS: must be 0.5 to 20");
        assert_eq!(Reason::together(name, &error(0.0)).as_str(), "V_MASS: mass_kg below 0.5");
        assert_eq!(Reason::together(name, &error(21.0)).as_str(), "V_MASS: mass_kg above 20");
        assert_eq!(Reason::together(name, &error(f64::NAN)).as_str(), "V_MASS: mass_kg below 0.5");
        let long = Range::new("a_name_of_thirty_five_letters_in_all", 0.5, 20.0);
        let error = OutOfRange { value: 0.0, range: long };
        assert_eq!(Reason::together(name, &error).as_str(), "V_MASS: a_name_of_thirty_five_letters_in_all below");
        let words = "0123456789".repeat(9);
        assert_eq!(Reason::new("s", &words).as_str().len(), REASON_MAX);
    }
}
