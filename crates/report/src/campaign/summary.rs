//! `summary.json` of a campaign.

use super::cells::PERCENTS;
use afbc_campaign::statistics::percentile;
use afbc_campaign::{CampaignSummary, ContenderSummary, Manifest, SurvivalCount};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{self, Write};

#[derive(Serialize)]
struct CampaignResultsJson<'a> {
    campaign: &'a Manifest,
    contenders: Vec<CampaignContenderJson<'a>>,
}

#[derive(Serialize)]
struct CampaignContenderJson<'a> {
    name: &'a str,
    #[serde(flatten)]
    all: SuccessJson,
    tripped: u64,
    by_trajectory: BTreeMap<&'a str, SuccessJson>,
    /// Percentile; null if the flight at that rank was lost.
    rmse_position_m: PercentilesJson,
    max_position_m: PercentilesJson,
    /// Percentiles over flights that were not lost.
    mean_abs_du4_n: PercentilesJson,
    saturated_ratio: PercentilesJson,
    /// Numbers of the worst flights, worst first.
    worst_flights: Vec<u64>,
}

/// Number and share of flights that were not lost.
#[derive(Serialize)]
struct SuccessJson {
    flights: u64,
    kept: u64,
    success_ratio: f64,
    /// Wilson's score interval of the share.
    success_interval_95: [f64; 2],
}

impl From<&SurvivalCount> for SuccessJson {
    fn from(count: &SurvivalCount) -> Self {
        let share = count.share();
        SuccessJson {
            flights: count.flights,
            kept: count.kept,
            success_ratio: share.value,
            success_interval_95: [share.low, share.high],
        }
    }
}

/// Percentiles by the nearest-rank method.
#[derive(Serialize)]
struct PercentilesJson {
    p50: Option<f64>,
    p90: Option<f64>,
    p99: Option<f64>,
}

impl From<&Vec<f64>> for PercentilesJson {
    fn from(sorted: &Vec<f64>) -> Self {
        let [p50, p90, p99] = PERCENTS.map(|percent| percentile(sorted, percent).filter(|value| value.is_finite()));
        PercentilesJson { p50, p90, p99 }
    }
}

fn contender<'a>(manifest: &'a Manifest, tally: &'a ContenderSummary) -> CampaignContenderJson<'a> {
    let names = manifest.trajectories.iter().map(String::as_str);
    CampaignContenderJson {
        name: &tally.contender,
        all: (&tally.count).into(),
        tripped: tally.tripped,
        by_trajectory: names.zip(tally.by_trajectory.iter().map(SuccessJson::from)).collect(),
        rmse_position_m: (&tally.rmse_position_m).into(),
        max_position_m: (&tally.max_position_m).into(),
        mean_abs_du4_n: (&tally.mean_abs_du4_n).into(),
        saturated_ratio: (&tally.saturated_ratio).into(),
        worst_flights: tally.worst.iter().map(|bad| bad.flight).collect(),
    }
}

/// Writes the summary as one JSON object.
///
/// # Errors
/// Fails if writing to `out` fails.
pub fn write(out: &mut dyn Write, summary: &CampaignSummary) -> io::Result<()> {
    let contender = |tally| contender(&summary.manifest, tally);
    let page = CampaignResultsJson {
        campaign: &summary.manifest,
        contenders: summary.tallies.iter().map(contender).collect(),
    };
    serde_json::to_writer_pretty(&mut *out, &page)?;
    writeln!(out)
}
