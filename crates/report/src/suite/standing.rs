//! Ranking of the contenders over all flights of a suite.

use super::FlownSuite;
use super::cells::{FIGURES, lost};
use crate::differences::{TEST, TEST_LEGEND, median, test};
use crate::grid::{Grid, GridCell};
use afbc_campaign::compare::{Comparison, ContenderFlights, DISTANCE};
use afbc_campaign::random::{RESAMPLES, Ranking, RankingDifference, Score, rankings};
use serde::Serialize;
use std::io::{self, Write};

/// Ranks the contenders: every flight counts once, with the median distance over its seeds.
fn standing(flown: FlownSuite<'_>) -> Vec<Ranking> {
    let score = |(flight, comparison): (usize, &Comparison)| {
        let rms_m = |entry: &ContenderFlights| entry.median(DISTANCE.value).map(|median| median.value);
        // Each flight is its own cluster: unlike flights of one seed, no two of these belong together.
        Score { seed: flight as u64, rms_m: comparison.entries.iter().map(rms_m).collect() }
    };
    let scores: Vec<Score> = flown.comparisons.iter().enumerate().map(score).collect();
    rankings(&scores, flown.comparisons.first().map_or(0, |first| first.baseline))
}

fn contenders(flown: FlownSuite<'_>) -> &[ContenderFlights] {
    flown.comparisons.first().map_or(&[], |first| first.entries.as_slice())
}

/// Returns the title of the reference contender.
fn baseline(flown: FlownSuite<'_>) -> &str {
    flown
        .comparisons
        .first()
        .and_then(|first| Some(first.entries.get(first.baseline)?.contender().title()))
        .unwrap_or("")
}

/// Returns the ranking as a table.
pub(super) fn grid(flown: FlownSuite<'_>) -> Grid {
    let baseline = baseline(flown);
    let row = |(entry, ranking): (&ContenderFlights, &Ranking)| {
        let [mut ratio, mut p, mut effect] = [const { String::new() }; 3];
        if let Some(RankingDifference { mean, interval, test: tested, p_holm, .. }) = ranking.difference {
            let of = |log: f64| format!("{:.2}", libm::exp(log));
            ratio = of(mean) + &interval.map_or(String::new(), |ends| format!(" [{}, {}]", of(ends[0]), of(ends[1])));
            if entry.contender().title() != baseline {
                [p, effect] = test(&tested, p_holm);
            }
        }
        let counts = [ranking.wins.to_string(), ranking.lost.to_string()];
        let cells = counts.into_iter().chain([ratio, p, effect]).map(GridCell::from);
        (entry.contender().title().to_owned(), cells.collect())
    };
    let over = format!("over {baseline} [95 %]");
    let heads = ["law", "best or level", "lost", &over].into_iter().chain(TEST).map(String::from).collect();
    let flights = flown.comparisons.len();
    let note = format!(
        "Figures of the root mean square distance from the reference, each flight by its median over the seeds. best \
         or level: flights in which a law is best, or within 5 % or 0.2 mm of the best. lost: flights in which most \
         seeds lose the vehicle. over {baseline}: the law's distance divided by {baseline}'s, geometric mean over the \
         flights that neither loses, with its 95 % interval (bootstrap over the flights, {RESAMPLES} resamples). \
         {TEST_LEGEND}"
    );
    Grid {
        caption: format!("Suite {}: how the laws stand in {flights} flights", flown.suite.name),
        heads,
        rows: contenders(flown).iter().zip(&standing(flown)).map(row).collect(),
        note,
    }
}

/// Returns the tables for a paper: the distances of every flight, and the contenders' ranking.
pub(super) fn grids(flown: FlownSuite<'_>) -> Vec<Grid> {
    let [distance, ..] = FIGURES;
    let cell = |comparison: &Comparison, entry: &ContenderFlights| GridCell {
        text: match (lost(entry), entry.median(DISTANCE.value)) {
            (None, Some(own)) => median(&own, &DISTANCE),
            (lost, _) => lost.unwrap_or_default(),
        },
        best: distance.is_best(comparison, entry),
    };
    let row = |comparison: &Comparison| {
        let cells = comparison.entries.iter().map(|entry| cell(comparison, entry));
        (comparison.scenario.name.clone(), cells.collect())
    };
    let titles = contenders(flown).iter().map(|entry| entry.contender().title());
    let distances = Grid {
        caption: format!("Suite {}: {}", flown.suite.name, distance.title.to_lowercase()),
        heads: ["flight"].into_iter().chain(titles).map(String::from).collect(),
        rows: flown.comparisons.iter().map(row).collect(),
        note:
            "Medians over the seeds, and in brackets intervals of at least 95 % (order statistics, from six seeds on)."
                .into(),
    };
    vec![distances, grid(flown)]
}

#[derive(Serialize)]
struct StandingRow<'a> {
    contender: &'a str,
    flights: usize,
    best_or_level: usize,
    lost: usize,
    lost_alone: usize,
    geometric_mean_m: Option<f64>,
    flights_both_keep: Option<usize>,
    ratio: Option<f64>,
    ratio_low_95: Option<f64>,
    ratio_high_95: Option<f64>,
    p: Option<f64>,
    p_holm: Option<f64>,
    rank_biserial: Option<f64>,
}

/// Writes the ranking, one row per contender.
pub(super) fn csv(out: &mut dyn Write, flown: FlownSuite<'_>) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    for (entry, ranking) in contenders(flown).iter().zip(standing(flown)) {
        let difference = ranking.difference;
        let interval = difference.and_then(|difference| difference.interval);
        csv.serialize(StandingRow {
            contender: &entry.contender().name,
            flights: flown.comparisons.len(),
            best_or_level: ranking.wins,
            lost: ranking.lost,
            lost_alone: ranking.lost_alone,
            geometric_mean_m: ranking.geometric_m,
            flights_both_keep: difference.map(|difference| difference.flights),
            ratio: difference.map(|difference| libm::exp(difference.mean)),
            ratio_low_95: interval.map(|[low, _]| libm::exp(low)),
            ratio_high_95: interval.map(|[_, high]| libm::exp(high)),
            p: difference.map(|difference| difference.test.p),
            p_holm: difference.map(|difference| difference.p_holm),
            rank_biserial: difference.map(|difference| difference.test.effect),
        })?;
    }
    csv.flush()
}
