//! Round numbers at which an axis has its ticks.

use core::ops::RangeInclusive;

/// Ticks of an axis at round numbers, with the format of their labels.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    /// Values of the ticks.
    pub at: Vec<f64>,
    form: LabelFormat,
}

/// Number format of an axis's labels.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LabelFormat {
    /// The same number of decimals for all labels, enough to tell them apart.
    Decimals(usize),
    /// Without trailing zeros: each label has the decimals that it needs.
    Short,
    /// Mantissa and power, as "1.5·10⁶".
    Scientific,
    /// Power of ten alone, as "10⁶".
    Power,
}

/// Tick distances within a power of ten.
const FACTORS: [f64; 3] = [1.0, 2.0, 5.0];
/// A linear axis that needs more decimals than this is labelled in scientific notation.
const DECIMALS: usize = 5;
const PLAIN: RangeInclusive<f64> = 0.999e-4..=1.001e5;

fn power_of_ten(power: i32) -> f64 {
    libm::pow(10.0, f64::from(power))
}

impl Ticks {
    /// Returns ticks from `low` to `high` at multiples of a step. The step is 1, 2 or 5 times a power of ten. There are
    /// at least two ticks and at most `most` (for `most` of at least 2). An axis without a length has none.
    pub fn linear(low: f64, high: f64, most: usize) -> Self {
        let rough = libm::log10((high - low) / most.max(1) as f64);
        if !rough.is_finite() {
            return Ticks { at: Vec::new(), form: LabelFormat::Decimals(0) };
        }
        let step = |n: i32| FACTORS.get(n.rem_euclid(3) as usize).unwrap_or(&1.0) * power_of_ten(n.div_euclid(3));
        // The tolerance counts an end that is itself a multiple, in spite of rounding.
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
        let is_large = low.abs().max(high.abs()) >= 1e5 || decimals > DECIMALS;
        let form = if is_large { LabelFormat::Scientific } else { LabelFormat::Decimals(decimals) };
        // The next wider step may leave a single tick. Keep this step then, and leave out some of its ticks.
        let places = (0..count).step_by(count.div_ceil(most.max(2)));
        Ticks { at: places.map(|place| (first + place as f64) * step(n)).collect(), form }
    }

    /// Returns ticks from `low` to `high`; both must be positive.
    ///
    /// The ticks are 1, 2 and 5 times the powers of ten if at most `most` of them fit. Otherwise they are powers of
    /// ten, thinned out to `most`. If fewer than two ticks lie in the range, they are those of a linear axis.
    pub fn logarithmic(low: f64, high: f64, most: usize) -> Self {
        let powers = libm::floor(libm::log10(low)) as i32..=libm::ceil(libm::log10(high)) as i32;
        let within = |factors: &[f64]| -> Vec<f64> {
            let ticks = powers.clone().flat_map(|power| factors.iter().map(move |it| it * power_of_ten(power)));
            ticks.filter(|tick| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(tick)).collect()
        };
        let (fine, coarse) = (within(&FACTORS), within(&[1.0]));
        let is_plain = fine.iter().all(|tick| PLAIN.contains(tick));
        let form = |other: LabelFormat| if is_plain { LabelFormat::Short } else { other };
        match (fine.len(), coarse.len()) {
            (0..=1, _) => Ticks::linear(low, high, most),
            (fine_count, coarse_count) if fine_count <= most || coarse_count < 2 => {
                Ticks { at: fine, form: form(LabelFormat::Scientific) }
            }
            (_, coarse_count) => {
                let at = coarse.into_iter().step_by(coarse_count.div_ceil(most.max(1))).collect();
                Ticks { at, form: form(LabelFormat::Power) }
            }
        }
    }

    /// Returns each tick with its label.
    pub fn marks(&self) -> impl Iterator<Item = (f64, String)> {
        self.at.iter().map(|at| (*at, self.label(*at)))
    }

    /// Formats a number in the axis's label format.
    pub fn label(&self, value: f64) -> String {
        match self.form {
            LabelFormat::Decimals(decimals) => label(value, decimals),
            LabelFormat::Short => short(&label(value, 1 + DECIMALS)).into(),
            LabelFormat::Scientific => scientific(value),
            LabelFormat::Power => format!("10{}", raised(libm::round(libm::log10(value)) as i32)),
        }
    }
}

/// Removes trailing zeros after the decimal point.
fn short(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
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
    let digits = short(&rounded).replace('-', "−");
    format!("{digits}·10{}", raised(power.parse().unwrap_or_default()))
}

/// Formats an exponent in superscript digits.
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
    #![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    #[test]
    fn ticks_are_round_within_the_axis_and_few() {
        for (low, high, most) in
            [(0.0, 1.0, 5), (-0.3, 12.0, 6), (1e-9, 7e-9, 4), (1e6, 1.1e6, 5), (-1.0, -0.9, 3), (0.0, 60.0, 8)]
        {
            let marks: Vec<_> = Ticks::linear(low, high, most).marks().collect();
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
        for (low, high) in [(1.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            assert!(Ticks::linear(low, high, 5).at.is_empty(), "{low} to {high}");
        }
    }

    proptest! {
        /// This holds for axes of any offset and length, and for any limit on the number of ticks.
        #[test]
        fn every_axis_has_two_ticks_with_labels_of_their_own(
            sign in prop::sample::select(vec![-1.0, 0.0, 1.0]), offset in -12.0..9.0f64, span in -12.0..9.0f64,
            most in 2_usize..11,
        ) {
            let low = sign * libm::pow(10.0, offset.min(span + 6.0));
            let high = low + libm::pow(10.0, span);
            let marks: Vec<_> = Ticks::linear(low, high, most).marks().collect();
            prop_assert!((2..=most).contains(&marks.len()), "{low} to {high}, {most}: {marks:?}");
            let room = 1e-6 * (high - low);
            prop_assert!(marks.iter().all(|(value, _)| (low - room..=high + room).contains(value)), "{marks:?}");
            let distinct: HashSet<_> = marks.iter().map(|(_, label)| label).collect();
            prop_assert_eq!(distinct.len(), marks.len(), "{:?}", marks);
        }

        #[test]
        fn every_logarithmic_axis_has_two_ticks(low in -9.0..6.0f64, decades in 0.01..12.0f64, most in 2_usize..14) {
            let [low, high] = [low, low + decades].map(|power| libm::pow(10.0, power));
            let marks: Vec<_> = Ticks::logarithmic(low, high, most).marks().collect();
            prop_assert!((2..=most.max(5)).contains(&marks.len()), "{low} to {high}: {marks:?}");
            prop_assert!(marks.windows(2).all(|two| two[0].0 < two[1].0), "{low} to {high}: {marks:?}");
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
    }

    #[test]
    fn logarithmic_axes_are_written_out_or_as_powers() {
        for (low, high, most, expected) in [
            (0.02, 0.6, 12, &["0.02", "0.05", "0.1", "0.2", "0.5"][..]),
            (0.002, 30.0, 5, &["0.01", "0.1", "1", "10"]),
            (2e-6, 30.0, 5, &["10⁻⁵", "10⁻³", "10⁻¹", "10¹"]),
            (1.5e-7, 6e-7, 5, &["2·10⁻⁷", "5·10⁻⁷"]),
            (0.123, 0.128, 5, &["0.124", "0.126", "0.128"]),
        ] {
            let labels: Vec<_> = Ticks::logarithmic(low, high, most).marks().map(|(_, label)| label).collect();
            assert_eq!(labels, expected, "{low} to {high}");
        }
    }
}
