//! Ticks of an axis.

/// Ticks of an axis at round numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ticks {
    /// Where they are, with their labels.
    pub(crate) marks: Vec<(f64, String)>,
}

/// Steps within a power of ten.
const FACTORS: [f64; 3] = [1.0, 2.0, 5.0];

fn power_of_ten(power: i32) -> f64 {
    libm::pow(10.0, f64::from(power))
}

impl Ticks {
    /// Returns ticks from `low` to `high`: two at least and, from two on, at most `most`, at equal multiples of 1, 2 or
    /// 5 times a power of ten.
    pub(crate) fn linear(low: f64, high: f64, most: usize) -> Self {
        let rough = libm::log10((high - low) / most.max(1) as f64);
        if !rough.is_finite() {
            return Ticks { marks: Vec::new() };
        }
        let step = |n: i32| FACTORS.get(n.rem_euclid(3) as usize).unwrap_or(&1.0) * power_of_ten(n.div_euclid(3));
        // An end that is a multiple itself counts in spite of rounding.
        let ends = |n: i32| (libm::ceil(low / step(n) - 1e-9), libm::floor(high / step(n) + 1e-9));
        let count = |n: i32| {
            let (first, last) = ends(n);
            last - first + 1.0
        };
        let mut n = 3 * libm::floor(rough) as i32;
        while count(n) > most.max(1) as f64 {
            n += 1;
        }
        while count(n) < 2.0 {
            n -= 1;
        }
        let ((first, _), count) = (ends(n), count(n) as usize);
        let decimals = usize::try_from(-n.div_euclid(3)).unwrap_or(0);
        let large = low.abs().max(high.abs()) >= 1e5 || decimals > 5;
        let mark = |i: usize| {
            let value = (first + i as f64) * step(n);
            (value, if large { scientific(value) } else { label(value, decimals) })
        };
        // The next wider step may leave one: then some of the narrower are left out.
        Ticks { marks: (0..count).step_by(count.div_ceil(most.max(2))).map(mark).collect() }
    }

    /// Returns ticks at the powers of ten from `low` to `high`, both positive; every second, third and so on if there
    /// are more than `most`.
    pub(crate) fn logarithmic(low: f64, high: f64, most: usize) -> Self {
        let (first, last) = (libm::ceil(libm::log10(low) - 1e-9) as i32, libm::floor(libm::log10(high) + 1e-9) as i32);
        let every = 1 + usize::try_from(last - first).unwrap_or(0) / most.max(1);
        let mark = |power: i32| (power_of_ten(power), format!("10{}", raised(power)));
        Ticks { marks: (first..=last).step_by(every).map(mark).collect() }
    }
}

/// Formats a number with a typographic minus sign.
fn label(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.bytes().all(|b| matches!(b, b'0' | b'.'));
    if value < 0.0 && !is_zero { format!("−{text}") } else { text }
}

/// Formats a number as "1.5·10⁶".
fn scientific(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let text = format!("{value:e}");
    let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
    let rounded = format!("{:.9}", digits.parse::<f64>().unwrap_or_default());
    let digits = rounded.trim_end_matches('0').trim_end_matches('.').replace('-', "−");
    format!("{digits}·10{}", raised(power.parse().unwrap_or_default()))
}

/// Formats an exponent.
fn raised(power: i32) -> String {
    let high = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        _ => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or_default()).unwrap_or(digit),
    };
    power.to_string().chars().map(high).collect()
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    #[test]
    fn ticks_are_round_within_the_axis_and_few() {
        for (low, high, most) in
            [(0.0, 1.0, 5), (-0.3, 12.0, 6), (1e-9, 7e-9, 4), (1e6, 1.1e6, 5), (-1.0, -0.9, 3), (0.0, 60.0, 8)]
        {
            let marks = Ticks::linear(low, high, most).marks;
            assert!((2..=most).contains(&marks.len()), "{low} to {high}: {marks:?}");
            let step = marks.get(1).unwrap().0 - marks.first().unwrap().0;
            let mantissa = step / libm::pow(10.0, libm::floor(libm::log10(step) + 1e-6));
            assert!([1.0, 2.0, 5.0].iter().any(|round| (mantissa - round).abs() < 1e-3), "{step}");
            let room = 1e-6 * (high - low);
            assert!(marks.iter().all(|(value, _)| (low - room..=high + room).contains(value)), "{marks:?}");
            let mut labels: Vec<_> = marks.iter().map(|(_, label)| label).collect();
            labels.dedup();
            assert_eq!(labels.len(), marks.len(), "{marks:?}");
        }
        assert_eq!(Ticks::linear(1.0, 1.0, 5).marks, []);
        assert_eq!(Ticks::linear(f64::NAN, 1.0, 5).marks, []);
    }

    proptest! {
        /// Whatever an axis shows, and however few labels fit.
        #[test]
        fn every_axis_has_two_ticks_with_labels_of_their_own(
            sign in prop::sample::select(vec![-1.0, 0.0, 1.0]), offset in -12.0..9.0f64, span in -12.0..9.0f64,
            most in 2_usize..11,
        ) {
            let low = sign * libm::pow(10.0, offset.min(span + 6.0));
            let high = low + libm::pow(10.0, span);
            let marks = Ticks::linear(low, high, most).marks;
            prop_assert!((2..=most).contains(&marks.len()), "{low} to {high}, {most}: {marks:?}");
            let room = 1e-6 * (high - low);
            prop_assert!(marks.iter().all(|(value, _)| (low - room..=high + room).contains(value)), "{marks:?}");
            let distinct: HashSet<_> = marks.iter().map(|(_, label)| label).collect();
            prop_assert_eq!(distinct.len(), marks.len(), "{:?}", marks);
        }
    }

    #[test]
    fn labels_are_typeset() {
        assert_eq!(label(-0.5, 1), "−0.5");
        assert_eq!(label(-0.0001, 1), "0.0");
        assert_eq!(scientific(1.5e6), "1.5·10⁶");
        assert_eq!(scientific(-2e-10), "−2·10⁻¹⁰");
        let labels: Vec<_> = Ticks::logarithmic(0.002, 30.0, 5).marks.into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["10⁻²", "10⁻¹", "10⁰", "10¹"]);
    }
}
