//! Groups flights by scenario, and names their files.

use crate::words::{case_words, slug};
use afbc_scenario::Scenario;
use afbc_sim::flown::ScenarioFlight;
use std::collections::HashSet;

/// The flights of one scenario, and their file names.
pub(super) struct ScenarioGroup<'a> {
    /// The scenario that all of them flew.
    pub(super) scenario: &'a Scenario,
    /// Flights in the order flown; never empty.
    pub(super) flights: Vec<&'a ScenarioFlight>,
    /// File name of each flight's log.
    pub(super) csv_names: Vec<String>,
    /// Prefix of `fig4-trajectory.svg` etc.
    pub(super) figure_prefix: String,
}

/// Groups flights by scenario, in the order flown, and names their files.
pub(super) fn groups(flown: &[ScenarioFlight]) -> Vec<ScenarioGroup<'_>> {
    let mut groups: Vec<ScenarioGroup<'_>> = Vec::new();
    for flight in flown {
        match groups.iter_mut().find(|group| group.scenario == &flight.scenario) {
            Some(group) => group.flights.push(flight),
            None => groups.push(ScenarioGroup {
                scenario: &flight.scenario,
                flights: vec![flight],
                csv_names: Vec::new(),
                figure_prefix: String::new(),
            }),
        }
    }
    let scenarios: Vec<_> = groups.iter().map(|group| group.scenario).collect();
    let mut taken = HashSet::new();
    for group in &mut groups {
        let stem = unique(&mut taken, distinct_stem(group.scenario, &scenarios));
        if scenarios.len() > 1 {
            group.figure_prefix = format!("{stem}-");
        }
        for flight in &group.flights {
            let name = unique(&mut taken, format!("{stem}-{}", slug(&flight.run.contender.name)));
            group.csv_names.push(format!("{name}.csv"));
        }
    }
    groups
}

/// Returns the scenario's name, with the words that distinguish it from other scenarios of that name.
fn distinct_stem(scenario: &Scenario, all: &[&Scenario]) -> String {
    let own = case_words(scenario);
    let mut name = slug(&scenario.name);
    let others: Vec<_> = all.iter().filter(|other| slug(&other.name) == name).map(|other| case_words(other)).collect();
    for (i, word) in own.iter().enumerate() {
        if others.iter().any(|other| other.get(i) != Some(word)) {
            name = format!("{name}-{word}");
        }
    }
    name
}

/// Returns `name`, with a number if it is taken. Case is ignored, as on some file systems.
fn unique(taken: &mut HashSet<String>, name: String) -> String {
    let mut candidate = name.clone();
    let mut number = 2;
    while !taken.insert(candidate.to_lowercase()) {
        candidate = format!("{name}-{number}");
        number += 1;
    }
    candidate
}
