//! The results table of `docs/results.md`: the paper's flight in every reading, on both models, under both laws.

use crate::metrics::Metrics;
use crate::paper::{Case, Reading, Uncertainty, scenario};
use crate::run::Run;
use airframe::OutOfRange;
use core::fmt::Write;
use plant::Model;

/// The rows, top to bottom: each reading of the experiment, with its name for people.
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

/// The lines between which a page holds the table.
pub const MARKERS: [&str; 2] = ["<!-- results: begin -->", "<!-- results: end -->"];

/// A page up to and with the first marker's line, its table, and the rest; `None` if it lacks a marker.
pub fn parts(page: &str) -> Option<(&str, &str, &str)> {
    let [begin, end] = MARKERS;
    let from = page.find(begin)? + begin.len() + 1;
    let to = page.find(end).filter(|&to| to >= from)?;
    Some((page.get(..from)?, page.get(from..to)?, page.get(to..)?))
}

/// Flies every row and writes the table in Markdown.
///
/// # Errors
/// None in fact: the paper's parameters are in range.
pub fn markdown() -> Result<String, OutOfRange> {
    let mut table = String::from(
        "| scenario | plant | law | RMSE x | y | z | psi | max x | y | z | psi | final x | y | z | psi \
         | mean \\|dU1\\| | dU2 | dU3 | dU4 |\n|---|---|---|",
    );
    table.push_str(&"--:|".repeat(16));
    table.push('\n');
    for (name, case) in cases() {
        for model in [Model::Simplified, Model::RigidBody] {
            let scenario = scenario(model, case)?;
            for contender in &scenario.contenders {
                let run = Run::fly(&scenario, contender, u64::MAX)?;
                let figures = match run.lost {
                    Some(lost) => format!("lost at {:.3} s: {}{}", lost.time_s, lost.reason, " |".repeat(16)),
                    None => row(&run.metrics),
                };
                // Writing to a String cannot fail.
                let _ = writeln!(table, "| {name} | {} | {} | {figures}", model.name(), contender.title());
            }
        }
    }
    Ok(table)
}

fn row(metrics: &Metrics) -> String {
    let errors = [metrics.rmse, metrics.max_abs, metrics.final_error];
    let errors = errors.iter().flatten().map(|error| format!("{error:.4} | "));
    let inputs = metrics.mean_abs_delta_u.iter().map(|newtons| format!("{:.1} | ", newtons * 1000.0));
    errors.chain(inputs).collect::<String>().trim_end().to_owned()
}
