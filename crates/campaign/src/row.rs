//! Result of one flight of one contender.

use crate::plan::Campaign;
use afbc_scenario::contender::Contender;
use afbc_sim::flight::{FlightStart, Lost};
use afbc_sim::metrics::{Accumulator, Metrics, is_settled};
use afbc_types::OutOfRange;
use core::ops::ControlFlow;

/// Result of one flight of one contender: a row of the results.
#[derive(Clone, Debug, PartialEq)]
pub struct ResultRow {
    /// Index of the flight.
    pub flight: u64,
    /// Seed of the flight's noise and weather.
    pub seed: u64,
    /// Name of the contender.
    pub contender: String,
    /// Name of the trajectory.
    pub trajectory: String,
    /// Reason of the vehicle's loss, if any.
    pub lost_reason: Option<String>,
    /// Reason of the monitor's switch to the fallback law, if any.
    pub trip_reason: Option<String>,
    /// Values drawn, then the [`FIGURES`]; none where nothing could be measured.
    pub numbers: Vec<Option<f64>>,
}

/// A column of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct ResultColumn {
    /// Name, ending in the unit.
    pub name: String,
    /// Meaning in words.
    pub meaning: String,
}

/// A figure of merit.
pub struct FigureOfMerit {
    /// Name, ending in the unit.
    pub name: &'static str,
    /// Meaning in words.
    pub meaning: &'static str,
    value: fn(&FlightSums) -> Option<f64>,
}

/// Sums over one flight.
#[derive(Clone, Debug, Default)]
struct FlightSums {
    lost: Option<Lost>,
    /// Time and reason of the monitor's trip, if any.
    tripped: Option<(f64, &'static str)>,
    metrics: Metrics,
    /// Number of steps in which errors were evaluated.
    settled: u64,
    /// Number of all steps. `saturated` counts those with a rotor at its limit.
    steps: u64,
    saturated: u64,
}

impl FlightSums {
    fn measured(&self, value: f64) -> Option<f64> {
        self.metrics.measured(value)
    }

    /// Returns `value`, a change between two steps, if there were at least two steps with evaluated errors.
    fn changed(&self, value: f64) -> Option<f64> {
        (self.settled > 1).then_some(value)
    }
}

const fn figure(name: &'static str, meaning: &'static str, value: fn(&FlightSums) -> Option<f64>) -> FigureOfMerit {
    FigureOfMerit { name, meaning, value }
}

/// All figures of merit, in the order of the columns. Errors are evaluated from
/// [`SETTLED_S`](afbc_sim::metrics::SETTLED_S) on.
pub static FIGURES: [FigureOfMerit; 21] = [
    figure("lost_at_s", "time at which the vehicle was lost", |o| o.lost.map(|lost| lost.time_s)),
    figure("tripped_at_s", "time at which the monitor switched to the fallback law", |o| {
        o.tripped.map(|(time_s, _)| time_s)
    }),
    figure("rmse_x_m", "root mean square error along x", |o| o.measured(o.metrics.rmse.x)),
    figure("rmse_y_m", "root mean square error along y", |o| o.measured(o.metrics.rmse.y)),
    figure("rmse_z_m", "root mean square error along z", |o| o.measured(o.metrics.rmse.z)),
    figure("rmse_psi_rad", "root mean square error of yaw", |o| o.measured(o.metrics.rmse.w)),
    figure("rmse_position_m", "root mean square distance from the reference", |o| {
        o.measured(o.metrics.rmse.xyz().norm())
    }),
    figure("max_x_m", "largest error along x", |o| o.measured(o.metrics.max_abs.x)),
    figure("max_y_m", "largest error along y", |o| o.measured(o.metrics.max_abs.y)),
    figure("max_z_m", "largest error along z", |o| o.measured(o.metrics.max_abs.z)),
    figure("max_psi_rad", "largest error of yaw", |o| o.measured(o.metrics.max_abs.w)),
    figure("max_position_m", "largest distance from the reference", |o| o.measured(o.metrics.max_distance_m)),
    figure("mean_abs_du1_n", "mean |change of U1| per step", |o| o.changed(o.metrics.mean_abs_delta_u.x)),
    figure("mean_abs_du2_n", "mean |change of U2| per step", |o| o.changed(o.metrics.mean_abs_delta_u.y)),
    figure("mean_abs_du3_n", "mean |change of U3| per step", |o| o.changed(o.metrics.mean_abs_delta_u.z)),
    figure("mean_abs_du4_n", "mean |change of U4| per step", |o| o.changed(o.metrics.mean_abs_delta_u.w)),
    figure("saturated_ratio", "share of the steps with a rotor at its limit", |o| {
        Some(o.saturated as f64 / o.steps as f64)
    }),
    figure("estimate_position_rms_m", "root mean square error of the vehicle's estimated position", |o| {
        o.metrics.estimate.map(|estimate| estimate.position_m.norm())
    }),
    figure("estimate_velocity_rms_m_s", "root mean square error of the vehicle's estimated velocity", |o| {
        o.metrics.estimate.map(|estimate| estimate.velocity_m_s.norm())
    }),
    figure("estimate_attitude_rms_rad", "root mean square error of the vehicle's estimated attitude", |o| {
        o.metrics.estimate.map(|estimate| estimate.attitude_rad.norm())
    }),
    figure(
        "estimate_nees",
        "mean normalised estimation error squared of position, velocity and attitude together",
        |o| o.metrics.estimate.map(|estimate| estimate.nees),
    ),
];

impl Campaign {
    /// Flies flight `flight` under every contender.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range.
    pub fn rows(&self, flight: u64) -> Result<Vec<ResultRow>, OutOfRange> {
        let draw = self.draw(flight);
        let scenario = self.with(flight, &draw)?;
        let trajectory = self.trajectory(flight).map(|trajectory| trajectory.name.as_str()).unwrap_or_default();
        let mut start = FlightStart::of(&scenario);
        let row = |contender: &Contender| {
            let outcome = FlightSums::of(&mut start, contender)?;
            let figures = FIGURES.iter().map(|figure| (figure.value)(&outcome));
            Ok(ResultRow {
                flight,
                seed: draw.seed,
                contender: contender.name.clone(),
                trajectory: trajectory.into(),
                lost_reason: outcome.lost.map(|lost| lost.reason.into()),
                trip_reason: outcome.tripped.map(|(_, reason)| reason.into()),
                numbers: draw.values.iter().copied().map(Some).chain(figures).collect(),
            })
        };
        scenario.contenders.iter().map(row).collect()
    }
}

impl FlightSums {
    /// Flies the contender and keeps only sums.
    fn of(start: &mut FlightStart, contender: &Contender) -> Result<Self, OutOfRange> {
        let mut outcome = FlightSums::default();
        let mut metrics = Accumulator::default();
        outcome.lost = start.fly(contender, &mut |sample| {
            metrics.add(sample);
            outcome.steps += 1;
            let health = &sample.action.health;
            outcome.saturated += u64::from(health.saturated);
            outcome.tripped = outcome.tripped.or(health.fallback.map(|reason| (sample.time_s, reason)));
            outcome.settled += u64::from(is_settled(sample.time_s));
            ControlFlow::Continue(())
        })?;
        outcome.metrics = metrics.finish();
        Ok(outcome)
    }
}
