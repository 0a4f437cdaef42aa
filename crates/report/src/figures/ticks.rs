//! Axes and their ticks.

use core::ops::Range;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};

/// An axis with ticks of our own: the library's leave some axes without one.
#[derive(Clone)]
pub(super) struct Axis {
    range: Range<f64>,
    at: Vec<f64>,
    is_logarithmic: bool,
}

impl Axis {
    pub(super) fn linear(range: Range<f64>, ticks: Vec<f64>) -> Self {
        Axis { range, at: ticks, is_logarithmic: false }
    }

    pub(super) fn logarithmic(range: Range<f64>, most: usize) -> Self {
        Axis { at: logarithmic(&range, most), range, is_logarithmic: true }
    }
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let Range { start, end } = self.range;
        let share = if self.is_logarithmic {
            libm::log(value / start) / libm::log(end / start)
        } else {
            (value - start) / (end - start)
        };
        // Rounded as the library does.
        let length = f64::from(to - from) * share;
        from + if to > from { libm::floor(length + 1e-3) } else { libm::ceil(length - 1e-3) } as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.at.clone() }
    }
}

/// Round numbers along an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    pub(super) at: Vec<f64>,
    /// Number of decimals that tells them from each other.
    pub(super) decimals: usize,
}

/// Steps within a power of ten.
const FACTORS: [f64; 3] = [1.0, 2.0, 5.0];

/// Returns multiples of 1, 2 or 5 times a power of ten within `axis`: two at least, and otherwise at most `most`.
pub(super) fn linear(axis: &Range<f64>, most: usize) -> Ticks {
    let (low, high, most) = (axis.start, axis.end, most.max(1) as f64);
    let rough = libm::log10((high - low) / most);
    if !rough.is_finite() {
        return Ticks { at: Vec::new(), decimals: 0 };
    }
    let step = |n: i32| {
        let factor = FACTORS.get(n.rem_euclid(3) as usize).copied().unwrap_or(1.0);
        factor * libm::pow(10.0, f64::from(n.div_euclid(3)))
    };
    // An end that is a multiple itself counts in spite of rounding.
    let ends = |n: i32| (libm::ceil(low / step(n) - 1e-9), libm::floor(high / step(n) + 1e-9));
    let count = |n: i32| {
        let (first, last) = ends(n);
        last - first + 1.0
    };
    let mut n = 3 * libm::floor(rough) as i32;
    while count(n) > most {
        n += 1;
    }
    while count(n) < 2.0 {
        n -= 1;
    }
    let (first, last) = ends(n);
    let at = (0..=(last - first) as i64).map(|i| (first + i as f64) * step(n)).collect();
    Ticks { at, decimals: decimals(step(n)) }
}

/// Returns ticks of a logarithmic axis of positive numbers: 1, 2 and 5 times the powers of ten if at most `most` of
/// them are within it, else powers of ten; and those of a linear one where these are fewer than two.
pub(super) fn logarithmic(axis: &Range<f64>, most: usize) -> Vec<f64> {
    let powers = libm::floor(libm::log10(axis.start)) as i32..=libm::ceil(libm::log10(axis.end)) as i32;
    let within = |factors: &[f64]| -> Vec<f64> {
        let ticks = powers.clone().flat_map(|power| factors.iter().map(move |it| it * libm::pow(10.0, power.into())));
        ticks.filter(|tick| axis.contains(tick)).collect()
    };
    let (fine, coarse) = (within(&FACTORS), within(&[1.0]));
    match (fine.len(), coarse.len()) {
        (0..=1, _) => linear(axis, most).at,
        (fine_count, coarse_count) if fine_count <= most || coarse_count < 2 => fine,
        (_, coarse_count) => coarse.into_iter().step_by(coarse_count.div_ceil(most.max(1)).max(1)).collect(),
    }
}

/// Returns the number of decimals that distinguishes numbers `step` apart.
fn decimals(step: f64) -> usize {
    (-libm::log10(step) - 1e-6).ceil().clamp(0.0, 9.0) as usize
}

/// Formats a number on an axis, with a typographic minus sign.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().any(|b| matches!(b, b'1'..=b'9')) => format!("−{digits}"),
        Some(digits) => digits.into(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::indexing_slicing, reason = "a test that panics has failed")]
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_axis_has_two_ticks_that_differ(
            sign in prop::sample::select(vec![-1.0, 0.0, 1.0]), offset in -6.0..6.0f64, span in -6.0..6.0f64,
            most in 1_usize..14,
        ) {
            let low = sign * libm::pow(10.0, offset.min(span + 6.0));
            let high = low + libm::pow(10.0, span);
            let Ticks { at, decimals } = linear(&(low..high), most);
            prop_assert!(at.len() >= 2 && at.len() <= most.max(5), "{low} to {high}: {at:?}");
            let room = 1e-6 * (high - low);
            prop_assert!(at.iter().all(|tick| (low - room..=high + room).contains(tick)), "{low} to {high}: {at:?}");
            let labels: Vec<String> = at.iter().map(|tick| number(*tick, decimals)).collect();
            prop_assert!(labels.windows(2).all(|two| two[0] != two[1]), "{low} to {high}: {labels:?}");
        }

        #[test]
        fn every_logarithmic_axis_has_two_ticks(low in -9.0..6.0f64, decades in 0.01..12.0f64, most in 2_usize..14) {
            let axis = libm::pow(10.0, low)..libm::pow(10.0, low + decades);
            let at = logarithmic(&axis, most);
            prop_assert!(at.len() >= 2 && at.len() <= most.max(5), "{axis:?}: {at:?}");
            prop_assert!(at.windows(2).all(|two| two[0] < two[1]), "{axis:?}: {at:?}");
        }
    }

    #[test]
    fn an_axis_without_a_length_has_no_tick() {
        for axis in [1.0..1.0, f64::NAN..1.0, 0.0..f64::INFINITY] {
            assert!(linear(&axis, 5).at.is_empty(), "{axis:?}");
        }
    }
}
