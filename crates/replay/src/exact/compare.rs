//! Compares the flight of a log with a replay under changed settings.

use super::change::SettingChange;
use super::quantities::{QUANTITIES, QuantityValues, ReplayQuantity, values};
use afbc_control::Trace;
use afbc_onboard::Report;
use core::f64::consts::{PI, TAU};

/// Ticks per row: rows have 100 Hz.
const EVERY: u64 = 10;

/// Statistics of the differences in one quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuantityFigure {
    /// Number of ticks at which both flights have a value.
    pub count: u64,
    squares: f64,
    /// Largest absolute difference.
    pub largest: f64,
    /// Time of the largest difference, from the first tick of the log on \[s\].
    pub largest_at_s: f64,
}

impl QuantityFigure {
    /// Returns the root mean square; none if nothing could be compared.
    #[must_use]
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| libm::sqrt(self.squares / self.count as f64))
    }

    fn add(&mut self, difference: f64, at_s: f64) {
        self.count += 1;
        self.squares += difference * difference;
        if difference.abs() > self.largest {
            (self.largest, self.largest_at_s) = (difference.abs(), at_s);
        }
    }
}

/// Values of one tick in the order of [`QUANTITIES`]; a missing value is NaN.
#[derive(Clone, Copy, Debug)]
pub struct ChangeRow {
    /// Time from the first tick of the log on \[s\].
    pub time_s: f64,
    /// Values as flown.
    pub flown: QuantityValues,
    /// Values under the changed settings.
    pub changed: QuantityValues,
}

/// Compares the commands of changed settings with the commands as flown, from the same inputs. The vehicle flew under
/// the original settings: how it would have moved under the changed ones is not known.
#[derive(Clone, Debug)]
pub struct ChangeComparison {
    /// The changed settings.
    pub changes: Vec<SettingChange>,
    /// Differences in the order of [`QUANTITIES`], over the ticks at which both flights are armed.
    pub figures: [QuantityFigure; QUANTITIES.len()],
    /// Rows at intervals of 0.01 s.
    pub rows: Vec<ChangeRow>,
    /// Number of ticks at which the flight core's modes differ.
    pub other_mode: u64,
    /// Time of the first different mode, from the first tick of the log on \[s\].
    pub other_mode_s: Option<f64>,
    ticks: u64,
}

impl ChangeComparison {
    pub(super) fn new(changes: &[SettingChange]) -> Self {
        ChangeComparison {
            changes: changes.to_vec(),
            figures: [QuantityFigure::default(); QUANTITIES.len()],
            rows: Vec::new(),
            other_mode: 0,
            other_mode_s: None,
            ticks: 0,
        }
    }

    /// Adds one tick of both flights.
    pub(super) fn add(&mut self, time_s: f64, flown: (&Report, &Trace), changed: (&Report, &Trace)) {
        let row = ChangeRow { time_s, flown: values(flown.0, flown.1), changed: values(changed.0, changed.1) };
        if flown.0.mode != changed.0.mode {
            self.other_mode += 1;
            self.other_mode_s.get_or_insert(time_s);
        }
        if flown.0.mode.armed() && changed.0.mode.armed() {
            for (figure, difference) in self.figures.iter_mut().zip(row.differences()) {
                if let Some(difference) = difference {
                    figure.add(difference, time_s);
                }
            }
        }
        if self.ticks.is_multiple_of(EVERY) {
            self.rows.push(row);
        }
        self.ticks += 1;
    }
}

impl ChangeRow {
    /// Returns the differences in the order of [`QUANTITIES`]; none where either value is missing.
    pub fn differences(&self) -> impl Iterator<Item = Option<f64>> {
        let both = self.flown.iter().zip(&self.changed);
        QUANTITIES.iter().zip(both).map(|(quantity, (flown, changed))| difference(quantity, *flown, *changed))
    }
}

fn difference(quantity: &ReplayQuantity, flown: f32, changed: f32) -> Option<f64> {
    let difference = f64::from(changed) - f64::from(flown);
    let difference = if quantity.wraps { libm::remainder(difference, TAU).clamp(-PI, PI) } else { difference };
    difference.is_finite().then_some(difference)
}
