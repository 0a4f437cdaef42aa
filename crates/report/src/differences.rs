//! Medians, and differences between contenders over the same seeds: as text, JSON and CSV.

use crate::grid::{Grid, GridCell};
use afbc_campaign::PairedDifference;
use afbc_campaign::compare::{Comparison, ContenderFlights, DISTANCE, Measure};
use afbc_campaign::statistics::{Median, SignedRank};
use serde::Serialize;
use std::io::{self, Write};

/// Formats a value with its measure's number of digits.
pub(crate) fn number(value: f64, measure: &Measure) -> String {
    let value = value * measure.scale;
    match value {
        // Value of a lost flight.
        f64::INFINITY => "∞".into(),
        f64::NEG_INFINITY => "-∞".into(),
        _ if value.abs() < 1e4 => format!("{value:.0$}", measure.digits),
        _ => format!("{value:.2e}"),
    }
}

/// Formats a median with its interval: "0.0012 [0.0011, 0.0014]".
pub(crate) fn median(median: &Median, measure: &Measure) -> String {
    let Median { value, interval } = median;
    let ends = interval.map(|ends| ends.map(|end| number(end, measure)));
    let ends = ends.map_or(String::new(), |[low, high]| format!(" [{low}, {high}]"));
    number(*value, measure) + &ends
}

/// Formats a p-value.
pub(crate) fn probability(p: f64) -> String {
    if p < 0.001 { "<0.001".into() } else { format!("{p:.3}") }
}

/// Formats the p-value and the effect size of a test.
pub(crate) fn test(test: &SignedRank, p_holm: f64) -> [String; 2] {
    [probability(p_holm), format!("{:+.2}", test.effect)]
}

/// Column heads of [`test`].
pub(crate) const TEST: [&str; 2] = ["p", "effect"];

/// Explanation of the columns of `test`.
pub(crate) const TEST_LEGEND: &str = "p: Wilcoxon's signed rank test, two-sided, exact up to 100 pairs, with Holm's \
     correction for the number of laws. effect: matched-pairs rank-biserial correlation, +1 if the law is always \
     farther from the reference, -1 if the law is always nearer.";

/// Returns a table of the distances, and of their differences to the reference contender's; `None` for a single seed.
pub(crate) fn grid(comparison: &Comparison) -> Option<Grid> {
    let baseline =
        comparison.entries.get(comparison.baseline).filter(|_| comparison.is_repeated())?.contender().title();
    let row = |(entry, paired): (&ContenderFlights, Option<PairedDifference>)| {
        let own = entry.median(DISTANCE.value).map_or("lost".into(), |own| median(&own, &DISTANCE));
        let best = comparison.is_best(entry, &DISTANCE);
        let [difference, p, effect] = match paired {
            None => [const { String::new() }; 3],
            Some(PairedDifference { difference, test: tested, p_holm, .. }) => {
                let [p, effect] = test(&tested, p_holm);
                [if difference.value.is_nan() { "-".into() } else { median(&difference, &DISTANCE) }, p, effect]
            }
        };
        let lost = (entry.lost() > 0).then(|| format!("{} of {}", entry.lost(), entry.flights.len()));
        let own = GridCell { text: own, best };
        let cells = [own, difference.into(), p.into(), effect.into(), lost.unwrap_or_default().into()];
        (entry.contender().title().to_owned(), cells.to_vec())
    };
    let paired = comparison.paired_differences(DISTANCE.value);
    let mut rows: Vec<(String, Vec<GridCell>)> = comparison.entries.iter().zip(paired).map(row).collect();
    let less = format!("minus {baseline}'s");
    let mut heads: Vec<String> = ["law", DISTANCE.title, &less].into_iter().chain(TEST).map(String::from).collect();
    if comparison.entries.iter().any(|entry| entry.lost() > 0) {
        heads.push("lost".into());
    } else {
        rows.iter_mut().for_each(|(_, cells)| cells.truncate(heads.len() - 1));
    }
    let seeds = comparison.entries.iter().map(|entry| entry.flights.len()).max().unwrap_or_default();
    let caption =
        format!("{}: root mean square distance from the reference over {seeds} seeds", comparison.scenario.name);
    let note = format!(
        "Medians, with intervals of at least 95 % in brackets (order statistics, from six seeds on). A lost vehicle \
         counts as infinitely far. minus {baseline}'s: median of the differences over the same seeds. {TEST_LEGEND}"
    );
    Some(Grid { caption, heads, rows, note })
}

/// Statistics of one figure of merit over a contender's seeds. A field is null if it does not apply or would be
/// infinite.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct FigureOverSeeds {
    name: &'static str,
    median: Option<f64>,
    low_95: Option<f64>,
    high_95: Option<f64>,
    difference: Option<f64>,
    difference_low_95: Option<f64>,
    difference_high_95: Option<f64>,
    p: Option<f64>,
    p_holm: Option<f64>,
    rank_biserial: Option<f64>,
}

/// Returns the statistics of these figures of merit, per contender.
pub(crate) fn figures<'a>(
    comparison: &Comparison,
    measures: impl IntoIterator<Item = &'a Measure>,
) -> Vec<Vec<FigureOverSeeds>> {
    let mut all = vec![Vec::new(); comparison.entries.len()];
    for measure in measures {
        let paired = comparison.paired_differences(measure.value);
        for ((entry, paired), all) in comparison.entries.iter().zip(paired).zip(&mut all) {
            all.push(figure(measure, Median::of(&entry.values(measure.value)), paired));
        }
    }
    all
}

fn figure(measure: &Measure, median: Option<Median>, paired: Option<PairedDifference>) -> FigureOverSeeds {
    let ends = |median: Option<Median>| {
        let interval = median.and_then(|median| median.interval);
        [median.map(|median| median.value), interval.map(|[low, _]| low), interval.map(|[_, high]| high)]
            .map(|number| number.filter(|number| number.is_finite()))
    };
    let [difference, difference_low_95, difference_high_95] = ends(paired.map(|paired| paired.difference));
    let [median, low_95, high_95] = ends(median);
    let name = measure.name;
    let (p, p_holm) = (paired.map(|paired| paired.test.p), paired.map(|paired| paired.p_holm));
    let rank_biserial = paired.map(|paired| paired.test.effect);
    FigureOverSeeds {
        name,
        median,
        low_95,
        high_95,
        difference,
        difference_low_95,
        difference_high_95,
        p,
        p_holm,
        rank_biserial,
    }
}

/// A row of `statistics.csv`.
#[derive(Serialize)]
struct StatisticsRow<'a> {
    scenario: &'a str,
    contender: &'a str,
    seeds: usize,
    lost: usize,
    figure: &'static str,
    median: Option<f64>,
    low_95: Option<f64>,
    high_95: Option<f64>,
    against: &'a str,
    difference: Option<f64>,
    difference_low_95: Option<f64>,
    difference_high_95: Option<f64>,
    p: Option<f64>,
    p_holm: Option<f64>,
    rank_biserial: Option<f64>,
}

/// Writes one row per figure of each contender in each scenario.
pub(crate) fn csv(out: &mut dyn Write, comparisons: &[Comparison], measures: &[&Measure]) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    for comparison in comparisons {
        let figures = figures(comparison, measures.iter().copied());
        for (entry, figures) in comparison.entries.iter().zip(figures) {
            for figure in figures {
                csv.serialize(StatisticsRow {
                    scenario: &comparison.scenario.name,
                    contender: &entry.contender().name,
                    seeds: entry.flights.len(),
                    lost: entry.lost(),
                    figure: figure.name,
                    median: figure.median,
                    low_95: figure.low_95,
                    high_95: figure.high_95,
                    against: baseline(comparison),
                    difference: figure.difference,
                    difference_low_95: figure.difference_low_95,
                    difference_high_95: figure.difference_high_95,
                    p: figure.p,
                    p_holm: figure.p_holm,
                    rank_biserial: figure.rank_biserial,
                })?;
            }
        }
    }
    csv.flush()
}

/// Returns the name of the contender with which the others are compared.
pub(crate) fn baseline(comparison: &Comparison) -> &str {
    comparison.entries.get(comparison.baseline).map_or("", |entry| &entry.contender().name)
}
