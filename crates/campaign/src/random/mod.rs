//! The suite `random`: flights drawn over vehicles, and how the contenders stand in them. `docs/suites.md` has the
//! intervals and formulas.
//!
//! A flight is a function of seed, vehicle and number alone: it is the same on every machine, beside whatever others.

mod base;
mod bisection;
mod change;
mod flight;
mod path;
mod power;
mod ranking;

pub use change::Change;
pub use flight::{DrawnFlight, Seen};
pub use ranking::{Difference, RESAMPLES, Ranking, Score, is_level, rankings};

use crate::compare::{self, Outcome};
use afbc_files::read::FileError;
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_sim::run::Run;
use afbc_types::OutOfRange;
use afbc_vehicles::Vehicle;
use base::Base;
use core::ops::Range;
use rayon::prelude::*;

/// Name of the suite.
pub const NAME: &str = "random";
/// Number of flights of each vehicle and seed, unless another is asked for.
pub const FLIGHTS: u64 = 12;
/// Tilt that every contender is allowed \[rad\].
pub const TILT_MAX_RAD: f64 = 1.2;
/// What to draw.
#[derive(Clone, Debug)]
pub struct Random {
    /// Seeds.
    pub seeds: Range<u64>,
    /// Number of flights of each vehicle and seed.
    pub flights: u64,
    /// What the controllers see.
    pub seen: Seen,
    /// Who flies.
    pub vehicles: Vec<Vehicle>,
}

/// A flight that was flown.
#[derive(Clone, Debug)]
pub struct FlownDraw {
    /// The flight.
    pub flight: DrawnFlight,
    /// What became of each of its scenario's contenders.
    pub outcomes: Vec<Outcome>,
}

impl Random {
    /// Draws every flight: by seed, vehicle and number.
    ///
    /// # Errors
    /// One line on what a vehicle cannot fly.
    pub fn draw(&self) -> Result<Vec<DrawnFlight>, FileError> {
        let bases = self.vehicles.iter().map(|vehicle| Base::new(vehicle, self.seen));
        let bases = bases.collect::<Result<Vec<_>, _>>()?;
        let (bases, flights) = (bases.as_slice(), self.flights);
        let of_seed = |seed| bases.iter().flat_map(move |base| (1..=flights).map(move |number| (base, seed, number)));
        let all: Vec<_> = self.seeds.clone().flat_map(of_seed).collect();
        all.into_par_iter().map(|(base, seed, number)| base.flight(seed, number)).collect()
    }

    /// Draws every flight, flown by `contenders`, each with its gains for the vehicle, and then by `own`, whose own
    /// gains and settings, for the paper's vehicle, are scaled [by rule](Contender::by_rule).
    ///
    /// # Errors
    /// As [`Random::draw`]; or one line on a gain or setting out of range.
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

/// Flies every flight under each of its contenders on the current rayon pool, and calls `progress` after each. The
/// result does not depend on the number of threads.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn fly(flights: Vec<DrawnFlight>, progress: &(dyn Fn() + Sync)) -> Result<Vec<FlownDraw>, OutOfRange> {
    let outcome = |scenario: &Scenario, contender: &Contender| {
        let run = Run::fly(scenario, contender, u64::MAX)?;
        progress();
        Ok(Outcome::of(scenario, &run))
    };
    let flown = |flight: DrawnFlight| {
        let contenders = flight.scenario.contenders.par_iter();
        let outcomes = contenders.map(|contender| outcome(&flight.scenario, contender)).collect::<Result<_, _>>()?;
        Ok(FlownDraw { flight, outcomes })
    };
    flights.into_par_iter().map(flown).collect()
}

impl FlownDraw {
    /// Returns what its contenders are judged by.
    pub fn score(&self) -> Score {
        let rms_m = |outcome: &Outcome| outcome.lost.is_none().then(|| outcome.metrics.rmse.xyz().norm());
        Score { seed: self.flight.seed, rms_m: self.outcomes.iter().map(rms_m).collect() }
    }
}
