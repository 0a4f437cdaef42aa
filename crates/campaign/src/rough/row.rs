//! Flown flights and the quality of the estimate in each class.

use super::class::names;
use super::flight::RoughFlight;
use super::judgement::Judgement;

/// A flight that was flown.
#[derive(Clone, Debug)]
pub struct FlownRoughFlight {
    /// The flight.
    pub flight: RoughFlight,
    /// Quality of the flight's estimate, and its end.
    pub judgement: Judgement,
}

/// Quality of the estimate in the flights of a class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassRow {
    /// Name of the class; none for all flights.
    pub class: Option<&'static str>,
    /// Number of flights.
    pub flights: usize,
    /// Mean of the flights' normalised errors; NaN if any of them is NaN.
    pub nees: f64,
    /// Normalised error of the worst flight.
    pub worst_nees: f64,
    /// Mean fraction of errors within three standard deviations, over flights with a valid estimate.
    pub within: f64,
    /// Fraction of all evaluations at which the estimate was valid.
    pub valid: f64,
    /// Flights in which the flight core flew without a fresh state.
    pub coasted: usize,
    /// Flights in which the flight core descended.
    pub descended: usize,
    /// Flights in which the monitor switched to the fallback law.
    pub tripped: usize,
    /// Number of vehicles lost.
    pub lost: usize,
}

/// Returns a row for each class, and one for all flights.
pub fn rows(flown: &[FlownRoughFlight]) -> Vec<ClassRow> {
    let classes = names().map(Some).chain([None]);
    let row = |class: Option<&'static str>| {
        let of_class = flown.iter().filter(|flown| class.is_none_or(|class| flown.flight.class == class));
        row(class, &of_class.map(|flown| flown.judgement).collect::<Vec<_>>())
    };
    classes.map(row).collect()
}

fn row(class: Option<&'static str>, all: &[Judgement]) -> ClassRow {
    let judged: Vec<&Judgement> = all.iter().filter(|it| it.valid > 0).collect();
    let mean = |of: fn(&Judgement) -> f64| judged.iter().map(|it| of(it)).sum::<f64>() / judged.len() as f64;
    let count = |is: fn(&Judgement) -> bool| all.iter().filter(|it| is(it)).count();
    let sum = |of: fn(&Judgement) -> u64| all.iter().map(of).sum::<u64>() as f64;
    ClassRow {
        class,
        flights: all.len(),
        nees: mean(|it| it.nees),
        // NaN counts as the worst error.
        worst_nees: judged
            .iter()
            .map(|it| it.nees)
            .reduce(|a, b| if a >= b || a.is_nan() { a } else { b })
            .unwrap_or(f64::NAN),
        within: mean(|it| it.within),
        valid: sum(|it| it.valid) / sum(|it| it.looks),
        coasted: count(|it| it.coasted),
        descended: count(|it| it.descended),
        tripped: count(|it| it.tripped.is_some()),
        lost: count(|it| it.lost.is_some()),
    }
}
