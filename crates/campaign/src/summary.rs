//! Summary of all flights, accumulated row by row.

use crate::manifest::Manifest;
use crate::row::ResultRow;
use crate::statistics::Share;

/// Number of equal intervals into which the range of a drawn quantity is divided.
pub const BINS: usize = 10;
/// Number of worst flights listed for each contender.
const WORST: usize = 3;

/// Numbers of all flights and of flights without a loss.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurvivalCount {
    /// All flights.
    pub flights: u64,
    /// Flights in which the vehicle was not lost.
    pub kept: u64,
}

impl SurvivalCount {
    fn add(&mut self, kept: bool) {
        self.flights += 1;
        self.kept += u64::from(kept);
    }

    /// Returns the share of flights in which the vehicle was not lost, with its interval.
    pub fn share(&self) -> Share {
        Share::of(self.kept, self.flights)
    }
}

/// One of the worst flights.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstFlight {
    /// Index of the flight.
    pub flight: u64,
    /// Name of the flight's trajectory.
    pub trajectory: String,
    /// Time and reason of the vehicle's loss, if any.
    pub lost: Option<(f64, String)>,
    /// Root mean square distance from the reference \[m\].
    pub rmse_position_m: Option<f64>,
}

impl WorstFlight {
    /// Returns a sort key that grows with how bad the flight was. A loss ranks above any error, an early loss above a
    /// late one.
    fn badness(&self) -> (bool, f64) {
        match &self.lost {
            Some((time_s, _)) => (true, -time_s),
            None => (false, self.rmse_position_m.unwrap_or_default()),
        }
    }
}

/// Results of one contender.
#[derive(Clone, Debug)]
pub struct ContenderSummary {
    /// Name of the contender.
    pub contender: String,
    /// Numbers of all flights of the contender, and of those in which the vehicle was not lost.
    pub count: SurvivalCount,
    /// Number of flights in which the contender's monitor switched to the fallback law.
    pub tripped: u64,
    /// Counts for each trajectory, in the campaign's order.
    pub by_trajectory: Vec<SurvivalCount>,
    /// Counts for each drawn quantity, in [`BINS`] equal parts of its interval.
    pub by_draw: Vec<[SurvivalCount; BINS]>,
    /// Root mean square distances from the reference \[m\], sorted; infinite for lost flights.
    pub rmse_position_m: Vec<f64>,
    /// Largest distances from the reference \[m\], sorted; infinite for lost flights.
    pub max_position_m: Vec<f64>,
    /// Mean |change of U4| per step \[N\], sorted, of flights without a loss.
    pub mean_abs_du4_n: Vec<f64>,
    /// Fractions of steps with a rotor at its limit, sorted, of flights without a loss.
    pub saturated_ratio: Vec<f64>,
    /// The worst flights, beginning with the worst.
    pub worst: Vec<WorstFlight>,
}

/// Results of a campaign.
#[derive(Clone, Debug)]
pub struct CampaignSummary {
    /// Description of the campaign and shard.
    pub manifest: Manifest,
    /// Results of each contender, in the campaign's order.
    pub tallies: Vec<ContenderSummary>,
}

impl CampaignSummary {
    /// Creates an empty summary.
    pub fn new(manifest: &Manifest) -> Self {
        // The lists are allocated at once, since only they grow with the number of flights.
        let values = || Vec::with_capacity(manifest.shard.count(manifest.flights) as usize);
        let tally = |contender: &String| ContenderSummary {
            contender: contender.clone(),
            count: SurvivalCount::default(),
            tripped: 0,
            by_trajectory: vec![SurvivalCount::default(); manifest.trajectories.len()],
            by_draw: vec![[SurvivalCount::default(); BINS]; manifest.drawn.len()],
            rmse_position_m: values(),
            max_position_m: values(),
            mean_abs_du4_n: values(),
            saturated_ratio: values(),
            worst: Vec::new(),
        };
        CampaignSummary { tallies: manifest.contenders.iter().map(tally).collect(), manifest: manifest.clone() }
    }

    /// Adds one row.
    pub fn add(&mut self, row: &ResultRow) {
        let CampaignSummary { manifest, tallies } = self;
        let Some(tally) = tallies.iter_mut().find(|tally| tally.contender == row.contender) else { return };
        let number = |name| manifest.number(row, name);
        let kept = row.lost_reason.is_none();
        tally.count.add(kept);
        tally.tripped += u64::from(row.trip_reason.is_some());
        let along = manifest.trajectories.iter().position(|name| *name == row.trajectory);
        if let Some(count) = along.and_then(|along| tally.by_trajectory.get_mut(along)) {
            count.add(kept);
        }
        for ((bins, drawn), value) in tally.by_draw.iter_mut().zip(&manifest.drawn).zip(&row.numbers) {
            if let Some(count) = value.and_then(|value| bins.get_mut(bin(drawn.ends, value))) {
                count.add(kept);
            }
        }
        let or_lost = |name| if kept { number(name) } else { Some(f64::INFINITY) };
        tally.rmse_position_m.extend(or_lost("rmse_position_m"));
        tally.max_position_m.extend(or_lost("max_position_m"));
        if kept {
            tally.mean_abs_du4_n.extend(number("mean_abs_du4_n"));
            tally.saturated_ratio.extend(number("saturated_ratio"));
        }
        let bad = WorstFlight {
            flight: row.flight,
            trajectory: row.trajectory.clone(),
            lost: row.lost_reason.clone().map(|reason| (number("lost_at_s").unwrap_or_default(), reason)),
            rmse_position_m: number("rmse_position_m"),
        };
        tally.worst.push(bad);
        // The sort is stable: of two equally bad flights, the earlier one comes first.
        tally.worst.sort_by(|a, b| {
            let ((a_lost, a), (b_lost, b)) = (a.badness(), b.badness());
            b_lost.cmp(&a_lost).then(b.total_cmp(&a))
        });
        tally.worst.truncate(WORST);
    }

    /// Sorts the values. To be called after the last row.
    pub fn finish(mut self) -> Self {
        for tally in &mut self.tallies {
            let ContenderSummary { rmse_position_m, max_position_m, mean_abs_du4_n, saturated_ratio, .. } = tally;
            for values in [rmse_position_m, max_position_m, mean_abs_du4_n, saturated_ratio] {
                values.sort_by(f64::total_cmp);
            }
        }
        self
    }
}

/// Returns the index of the part of the interval, of [`BINS`] equal ones, that `value` lies in. The upper end belongs
/// to the last part.
fn bin([low, high]: [f64; 2], value: f64) -> usize {
    // An interval of one value gives 0/0 = NaN, which the cast turns into 0, the first part.
    ((value - low) / (high - low) * BINS as f64).clamp(0.0, BINS as f64 - 1.0) as usize
}
