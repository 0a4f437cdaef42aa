//! The result of a search as text for a scenario file.

use crate::conditions::Condition;
use crate::cost::{costs, mean};
use crate::gains::found_text;
use crate::search::SearchResult;
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_types::OutOfRange;
use core::fmt::Write;
use std::error::Error;

/// Formats the contender found as `[[contender]]` of a scenario file or, if the flights are on a vehicle from a file,
/// as `[gains]` of that file. Comments before it list the cost of each flight, the conditions met, and the change of
/// each gain from `start`.
///
/// # Errors
/// None in practice, since both contenders have flown before.
pub fn report(
    start: &Contender,
    found: &SearchResult,
    [training, held_out]: [&[Scenario]; 2],
    conditions: &[Condition],
    seed: u64,
) -> Result<String, Box<dyn Error>> {
    let SearchResult { contender, before, after, evaluations, changes } = found;
    let mut text = format!(
        "# {} after {evaluations} tries with seed {seed}: cost {after:.4}, before {before:.4}\n#\n",
        contender.kind().title()
    );
    text += "# flight              before     after\n";
    for (title, flights) in [("training", training), ("held out", held_out)] {
        let (before, after) = (costs(flights, start)?, costs(flights, contender)?);
        // Writing to a String cannot fail.
        for (scenario, (before, after)) in flights.iter().zip(before.iter().zip(&after)) {
            let _ = writeln!(text, "# {:<16}{before:>10.4}{after:>10.4}", scenario.name);
        }
        let (before, after) = (mean(&before), mean(&after));
        let _ = writeln!(text, "# {title:<16}{before:>10.4}{after:>10.4}  geometric mean\n#");
    }
    for condition in conditions.iter().filter(|condition| condition.is_asked_of(contender.kind())) {
        let met = |contender| Ok::<_, OutOfRange>(if condition.factor(contender)? > 1.0 { "not met" } else { "met" });
        let _ = writeln!(text, "# {:<16}{:>10}{:>10}", condition.scenario.name, met(start)?, met(contender)?);
    }
    if !conditions.is_empty() {
        text.push_str("#\n");
    }
    let width = changes.iter().map(|change| change.name.len()).max().unwrap_or(0);
    for change in changes {
        let _ = writeln!(text, "# {:<width$} {:>10} -> {}", change.name, change.from, change.to);
    }
    text.push('\n');
    text += &found_text(&Contender { name: format!("{}-tuned", start.name), ..contender.clone() }, training);
    Ok(text)
}
