//! Results of flights: table, CSV, summary, figures, HTML page.

#[cfg(test)]
mod tests;

pub use crate::csv::values as columns;
pub use crate::summary::write as json;
pub use crate::table::table;

use crate::claims::Claim;
use crate::{csv, figures, groups, report, summary};
use afbc_files::{Error, Folder};
use afbc_sim::flown::ScenarioFlight;
use std::path::PathBuf;

/// Writes all results of `flown` into `folder`, and removes all earlier files of the same command. Returns the paths
/// written:
///
/// * `<stem>-<contender>.csv`: each run's log;
/// * `fig4-trajectory.svg`, `fig5-outputs.svg`, `fig6-attitude.svg`, `fig7-errors.svg`, `fig8-inputs.svg`: counterparts
///   of the paper's figures, with all contenders; with several scenarios, `<stem>-fig4-trajectory.svg` etc. for each;
///   `fig9-estimate.svg` for vehicles that estimate their own state;
/// * `summary.json`: the figures of merit of each run;
/// * `report.html`: all results on one self-contained page.
///
/// The stem is the scenario's name. For scenarios of the same name it also contains the reading, signs, plant, profile,
/// or else a number. Each file is written under a temporary name first, so that it appears complete or not at all.
///
/// # Errors
/// Fails at the first file that cannot be written, or that another command has written.
pub fn write(folder: &Folder, flown: &[ScenarioFlight], claims: &[Claim]) -> Result<Vec<PathBuf>, Error> {
    let groups = groups::groups(flown);
    let sets: Vec<_> = groups.iter().map(|group| figures::flights::draw(&group.flights)).collect();
    let svg_name = |group: &groups::ScenarioGroup<'_>, figure: &figures::Picture| {
        format!("{}{}.svg", group.figure_prefix, figure.name)
    };
    let mut names = vec!["summary.json".to_owned(), "report.html".to_owned()];
    for (group, figures) in groups.iter().zip(&sets) {
        names.extend(group.csv_names.iter().cloned());
        names.extend(figures.iter().map(|figure| svg_name(group, figure)));
    }
    folder.only(&names)?;

    let mut paths = Vec::new();
    for (group, figures) in groups.iter().zip(&sets) {
        for (flight, name) in group.flights.iter().zip(&group.csv_names) {
            paths.push(folder.write(name, |out| csv::write(out, flight))?);
        }
        for figure in figures {
            paths.push(folder.write(&svg_name(group, figure), |out| out.write_all(figure.svg.as_bytes()))?);
        }
    }
    paths.push(folder.write("summary.json", |out| summary::write(out, flown))?);
    let page = report::page(&groups, &sets, claims);
    paths.push(folder.write("report.html", |out| out.write_all(page.as_bytes()))?);
    Ok(paths)
}
