//! The suite `random` draws flights across vehicles and ranks the contenders in them. `docs/suites.md` has the
//! intervals and formulas.
//!
//! A flight depends only on seed, vehicle and number. It is the same on every machine, whichever other flights are
//! drawn.

mod base;
mod bisection;
mod flight;
mod mismatch;
mod path;
mod power;
mod ranking;

pub use flight::{DrawnFlight, FeedbackSource};
pub use mismatch::ModelMismatch;
pub use ranking::{RESAMPLES, Ranking, RankingDifference, Score, is_level, rankings};

use crate::compare::{self, FlightOutcome};
use afbc_files::read::FileError;
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_sim::run::FlightResult;
use afbc_types::OutOfRange;
use afbc_vehicles::Vehicle;
use base::BaseVehicle;
use core::ops::Range;
use rayon::prelude::*;

/// Name of the suite.
pub const NAME: &str = "random";
/// Default number of flights per vehicle and seed.
pub const FLIGHTS: u64 = 12;
/// Tilt limit that every contender gets at least \[rad\].
pub const TILT_MAX_RAD: f64 = 1.2;
/// Selection of the flights to draw.
#[derive(Clone, Debug)]
pub struct RandomFlights {
    /// Seeds from which flights are drawn.
    pub seeds: Range<u64>,
    /// Number of flights per vehicle and seed.
    pub flights: u64,
    /// Source of the state that the controllers see.
    pub seen: FeedbackSource,
    /// Vehicles that fly.
    pub vehicles: Vec<Vehicle>,
}

/// A flight that was flown.
#[derive(Clone, Debug)]
pub struct FlownRandomFlight {
    /// The flight.
    pub flight: DrawnFlight,
    /// Result of each of the scenario's contenders.
    pub outcomes: Vec<FlightOutcome>,
}

impl RandomFlights {
    /// Draws all flights, ordered by seed, vehicle and number.
    ///
    /// # Errors
    /// One line about the first value that a vehicle cannot fly with.
    pub fn draw(&self) -> Result<Vec<DrawnFlight>, FileError> {
        let bases = self.vehicles.iter().map(|vehicle| BaseVehicle::new(vehicle, self.seen));
        let bases = bases.collect::<Result<Vec<_>, _>>()?;
        let (bases, flights) = (bases.as_slice(), self.flights);
        let of_seed = |seed| bases.iter().flat_map(move |base| (1..=flights).map(move |number| (base, seed, number)));
        let all: Vec<_> = self.seeds.clone().flat_map(of_seed).collect();
        all.into_par_iter().map(|(base, seed, number)| base.flight(seed, number)).collect()
    }

    /// Draws all flights with their contenders: first `contenders`, each with its gains for the vehicle; then `own`.
    /// The gains and settings of `own` are for the paper's vehicle and are scaled [by rule](Contender::by_rule).
    ///
    /// # Errors
    /// Errors of [`RandomFlights::draw`], or one line about a gain or setting out of range.
    pub fn under(&self, contenders: &[Contender], own: &[Contender]) -> Result<Vec<DrawnFlight>, FileError> {
        let mut flights = self.draw()?;
        flights.par_iter_mut().try_for_each(|flight| {
            compare::fly_under(&mut flight.scenario, contenders)?;
            compare::fly_by_rule(&mut flight.scenario, own)?;
            compare::free_to_tilt(&mut flight.scenario, TILT_MAX_RAD);
            Ok::<(), FileError>(())
        })?;
        Ok(flights)
    }
}

/// Flies all flights under each of their contenders on the current rayon pool. Calls `progress` after each run. The
/// result does not depend on the number of threads.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn fly(flights: Vec<DrawnFlight>, progress: &(dyn Fn() + Sync)) -> Result<Vec<FlownRandomFlight>, OutOfRange> {
    let outcome = |scenario: &Scenario, contender: &Contender| {
        let run = FlightResult::fly(scenario, contender, u64::MAX)?;
        progress();
        Ok(FlightOutcome::of(scenario, &run))
    };
    let flown = |flight: DrawnFlight| {
        let contenders = flight.scenario.contenders.par_iter();
        let outcomes = contenders.map(|contender| outcome(&flight.scenario, contender)).collect::<Result<_, _>>()?;
        Ok(FlownRandomFlight { flight, outcomes })
    };
    flights.into_par_iter().map(flown).collect()
}

impl FlownRandomFlight {
    /// Returns the distances by which the contenders are ranked.
    pub fn score(&self) -> Score {
        let rms_m = |outcome: &FlightOutcome| outcome.lost.is_none().then(|| outcome.metrics.rmse.xyz().norm());
        Score { seed: self.flight.seed, rms_m: self.outcomes.iter().map(rms_m).collect() }
    }
}
