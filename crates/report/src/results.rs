//! The results table of `docs/reference/results.md`: the paper's flight in every reading, on both plant models, under
//! both laws.

use crate::markers;
use afbc_plant::PlantModel;
use afbc_scenario::Scenario;
use afbc_scenario::case::{Case, Reading, Uncertainty};
use afbc_scenario::paper::scenario;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::Metrics;
use afbc_sim::run::FlightResult;
use afbc_types::OutOfRange;
use core::fmt::Write;

/// Returns the rows from top to bottom: each reading of the experiment with a readable name.
pub fn cases() -> Vec<(String, Case)> {
    let case = |reading, uncertainty| Case { reading, uncertainty };
    let mut cases = vec![
        ("calm".to_owned(), case(None, None)),
        ("uncertain".to_owned(), case(None, Some(Uncertainty::DEFAULT))),
        ("gusts, persistent".to_owned(), case(Some(Reading::Persistent), None)),
        ("gusts, 1 s pulses".to_owned(), case(Some(Reading::Pulses), None)),
        ("gusts, forces and moments".to_owned(), case(Some(Reading::Forces), None)),
    ];
    cases.extend(Uncertainty::ALL.map(|uncertainty| {
        let Uncertainty { inertia, thrust } = uncertainty;
        (
            format!("paper, inertia {}75 %, thrust {}40 %", inertia.symbol(), thrust.symbol()),
            case(Some(Reading::Persistent), Some(uncertainty)),
        )
    }));
    cases
}

/// Marker lines around the table in a page.
pub const MARKERS: [&str; 2] = ["<!-- results: begin -->", "<!-- results: end -->"];

/// Splits a page at its [`MARKERS`].
pub fn parts(page: &str) -> Option<(&str, &str, &str)> {
    markers::parts(page, MARKERS)
}

/// Returns the scenarios of the table from top to bottom, each with a readable name.
///
/// # Errors
/// Never fails in practice: the paper's parameters are in range.
pub fn scenarios() -> Result<Vec<(String, Scenario)>, OutOfRange> {
    let models = [PlantModel::Simplified, PlantModel::RigidBody];
    let rows = cases().into_iter().flat_map(|(name, case)| models.map(|model| (name.clone(), model, case)));
    rows.map(|(name, model, case)| Ok((name, scenario(model, case)?))).collect()
}

/// Flies each of `scenarios` under each of its contenders; calls `progress` after each flight.
///
/// # Errors
/// Fails with the first parameter, gain or setting out of range.
pub fn fly(
    scenarios: Vec<(String, Scenario)>,
    progress: &dyn Fn(),
) -> Result<Vec<(String, ScenarioFlight)>, OutOfRange> {
    let mut flown = Vec::new();
    for (name, scenario) in scenarios {
        for contender in &scenario.contenders {
            let run = FlightResult::fly(&scenario, contender, u64::MAX)?;
            flown.push((name.clone(), ScenarioFlight { scenario: scenario.clone(), run }));
            progress();
        }
    }
    Ok(flown)
}

/// Formats the table as Markdown.
pub fn markdown(flown: &[(String, ScenarioFlight)]) -> String {
    let mut table = String::from(
        "| scenario | plant | law | RMSE x | y | z | psi | max x | y | z | psi | final x | y | z | psi \
         | mean \\|dU1\\| | dU2 | dU3 | dU4 |\n|---|---|---|",
    );
    table.push_str(&"--:|".repeat(16));
    table.push('\n');
    for (name, ScenarioFlight { scenario, run }) in flown {
        let figures = match run.lost {
            Some(lost) => format!("lost at {:.3} s: {}{}", lost.time_s, lost.reason, " |".repeat(16)),
            None => row(&run.metrics),
        };
        // Writing to a String cannot fail.
        let _ = writeln!(table, "| {name} | {} | {} | {figures}", scenario.model.name(), run.contender.title());
    }
    table
}

fn row(metrics: &Metrics) -> String {
    let errors = [metrics.rmse, metrics.max_abs, metrics.final_error];
    let errors = errors.iter().flatten().map(|error| format!("{error:.4} | "));
    let inputs = metrics.mean_abs_delta_u.iter().map(|newtons| format!("{:.1} | ", newtons * 1000.0));
    errors.chain(inputs).collect::<String>().trim_end().to_owned()
}
