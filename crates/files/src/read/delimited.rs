//! Detection of the character that separates the values of a text file.

/// Possible separators, the most common first.
const SEPARATORS: [char; 3] = [',', ';', '\t'];

/// Format of a file of separated values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DelimitedFormat {
    /// Character between two values.
    pub separator: u8,
}

impl DelimitedFormat {
    /// Detects the separator of the file `text`: comma, semicolon or tab, whichever is most frequent in its first line.
    pub fn of(text: &[u8]) -> Self {
        let head = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
        let count = |separator: &char| head.iter().filter(|byte| char::from(**byte) == *separator).count();
        // The order is reversed, so that on a tie the last separator wins: the comma.
        let most = SEPARATORS.iter().rev().max_by_key(|separator| count(separator)).copied().unwrap_or(',');
        DelimitedFormat { separator: most as u8 }
    }

    /// Parses a number. Unless the comma is the separator, it may be the decimal sign.
    pub fn number(self, text: &str) -> Option<f64> {
        let number = text.trim().parse().ok();
        number.or_else(|| text.trim().replace(',', ".").parse().ok().filter(|_: &f64| self.separator != b','))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separators_are_told_by_the_head() {
        for separator in SEPARATORS {
            let text = ["time_s", "x_m", "y_m", "z_m"].join(&separator.to_string());
            assert_eq!(
                DelimitedFormat::of(format!("{text}\n1,1,1,1,1,1,1,1").as_bytes()).separator,
                separator as u8,
                "{text}"
            );
        }
        assert_eq!(DelimitedFormat::of(b"").separator, b',');
        assert_eq!(DelimitedFormat::of(b"t").separator, b',');
    }

    #[test]
    fn a_comma_is_a_decimal_sign_where_it_does_not_separate() {
        let by = |separator| DelimitedFormat { separator };
        assert_eq!(by(b';').number(" 1,5"), Some(1.5));
        assert_eq!(by(b'\t').number("-1.5e3"), Some(-1500.0));
        assert_eq!((by(b',').number("1,5"), by(b';').number("1,5,2"), by(b';').number("")), (None, None, None));
    }
}
