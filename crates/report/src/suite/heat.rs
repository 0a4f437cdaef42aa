//! A heat map: each contender's distance divided by the best contender's.

use super::FlownSuite;
use super::cells::{FIGURES, SuiteFigure, lost};
use afbc_campaign::compare::{Comparison, ContenderFlights};
use core::f64::consts::LN_2;
use maud::{Markup, html};

/// Ratio at which a cell has its full colour.
const HOTTEST: f64 = 8.0;

/// Returns a table with one row per flight and one column per contender. A cell shows the root mean square distance as
/// a multiple of the flight's best, the redder the larger. The last row is the geometric mean over the flights that the
/// contender did not lose.
pub(super) fn map(flown: FlownSuite<'_>) -> Markup {
    let [figure, ..] = &FIGURES;
    let Some(first) = flown.comparisons.first() else { return html! {} };
    html! {
        table.heat {
            thead { tr {
                td {}
                @for entry in &first.entries { th scope="col" { (entry.contender().title()) } }
            } }
            tbody {
                @for comparison in flown.comparisons {
                    tr {
                        th scope="row" { a href=(format!("#{}", anchor(comparison))) { (comparison.scenario.name) } }
                        @for entry in &comparison.entries { (cell(ratio(figure, comparison, entry), lost(entry))) }
                    }
                }
            }
            tbody { tr {
                th scope="row" { "geometric mean" }
                @for index in 0..first.entries.len() { (mean(figure, flown.comparisons, index)) }
            } }
        }
    }
}

/// Returns the anchor of a flight's section in the page.
pub(super) fn anchor(comparison: &Comparison) -> String {
    format!("flight-{}", comparison.scenario.name)
}

/// Returns a contender's median as a multiple of the best contender's; `None` if it lost a vehicle.
fn ratio(figure: &SuiteFigure, comparison: &Comparison, entry: &ContenderFlights) -> Option<f64> {
    let median = |entry: &ContenderFlights| entry.median(figure.measure.value).map(|median| median.value);
    let best = comparison.entries.iter().filter_map(median).min_by(f64::total_cmp)?;
    let own = median(entry)?;
    // The ratio is also 1 if both are zero.
    Some(if own > best { own / best } else { 1.0 })
}

fn cell(ratio: Option<f64>, lost: Option<String>) -> Markup {
    match ratio {
        None => html! { td.lost { (lost.unwrap_or_default()) } },
        Some(ratio) if ratio <= 1.0 => html! { td.best { "1" } },
        Some(ratio) => html! { td style=(format!("--heat:{:.0}%", 100.0 * heat(ratio))) { (rounded(ratio)) } },
    }
}

/// Returns the geometric mean of a contender's ratios, and the number of flights that it lost.
fn mean(figure: &SuiteFigure, comparisons: &[Comparison], index: usize) -> Markup {
    let entries = || comparisons.iter().filter_map(|comparison| Some((comparison, comparison.entries.get(index)?)));
    let ratios: Vec<f64> = entries().filter_map(|(comparison, entry)| ratio(figure, comparison, entry)).collect();
    let lost = entries().count() - ratios.len();
    let mean = libm::exp(ratios.iter().map(|ratio| libm::log(*ratio)).sum::<f64>() / ratios.len() as f64);
    html! {
        td {
            @if ratios.is_empty() { "–" } @else { (rounded(mean)) }
            @if lost > 0 { ", " (lost) " lost" }
        }
    }
}

/// Returns the share of the full colour, which grows with the logarithm of the ratio.
fn heat(ratio: f64) -> f64 {
    (libm::log(ratio) / (LN_2 * libm::log2(HOTTEST))).clamp(0.0, 1.0)
}

/// Formats a ratio with three significant digits, or more if its integer part has more.
fn rounded(ratio: f64) -> String {
    match ratio {
        ratio if ratio < 9.995 => format!("{ratio:.2}"),
        ratio if ratio < 99.95 => format!("{ratio:.1}"),
        ratio if ratio < 1e4 => format!("{ratio:.0}"),
        ratio => format!("{ratio:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_grows_with_the_ratio_and_digits_stay_few() {
        let ratios = [1.000_1, 1.2, 2.0, 5.0, 8.0, 90.0, f64::INFINITY];
        assert!(ratios.iter().zip(&ratios[1..]).all(|(a, b)| heat(*a) <= heat(*b)));
        assert_eq!([heat(1.0), heat(8.0), heat(f64::INFINITY)], [0.0, 1.0, 1.0]);
        assert!((heat(libm::sqrt(8.0)) - 0.5).abs() < 1e-12);
        assert_eq!([1.234, 9.996, 99.96, 1.23e5].map(rounded), ["1.23", "10.0", "100", "1e5"]);
    }
}
