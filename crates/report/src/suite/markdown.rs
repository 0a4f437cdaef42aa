//! The suite's table as Markdown, for a document.

use super::FlownSuite;
use super::cells::summary;
use core::fmt::Write;

/// Returns the marker lines around the table of the suite `name` in a page.
pub fn markers(name: &str) -> [String; 2] {
    ["begin", "end"].map(|end| format!("<!-- suite {name}: {end} -->"))
}

/// Formats as Markdown: the flights under each contender, and published results of others.
pub fn markdown(flown: FlownSuite<'_>) -> String {
    let mut page = String::new();
    let titles = flown.comparisons.first().map_or(Vec::new(), |comparison| {
        comparison.entries.iter().map(|entry| entry.contender().title()).collect::<Vec<_>>()
    });
    // Writing to a String cannot fail.
    let _ = writeln!(page, "| flight | {} |\n|---|{}", titles.join(" | "), "--:|".repeat(titles.len()));
    for (_, comparison) in flown.rows() {
        let scenario = &comparison.scenario;
        let cells: Vec<String> = comparison.entries.iter().map(summary).collect();
        let _ = writeln!(page, "| `{}`: {} | {} |", scenario.name, scenario.description, cells.join(" | "));
    }
    let published = flown.suite.flights.iter().filter(|flight| !flight.published.is_empty());
    for (index, flight) in published.enumerate() {
        if index == 0 {
            let _ = writeln!(page, "\n| flight | published: root mean square distance \\[m\\] |\n|---|---|");
        }
        let figures = flight.published.iter().map(|figure| {
            let source = flown.suite.sources.get(figure.source).map_or("", |source| source.name.as_str());
            format!("{} {} ({source})", figure.law, figure.rms_m)
        });
        let _ = writeln!(page, "| `{}` | {} |", flight.scenario.name, figures.collect::<Vec<_>>().join(", "));
    }
    for (index, source) in flown.suite.sources.iter().enumerate() {
        let gap = if index == 0 { "\n" } else { "" };
        let line = format!("* {}: {}. Differences: {}.", source.name, source.citation, source.differs);
        let _ = writeln!(page, "{gap}{}", wrapped(&line));
    }
    page
}

/// Wraps a list item into lines of at most 120 columns.
fn wrapped(item: &str) -> String {
    let (mut text, mut column) = (String::new(), 0);
    for word in item.split_whitespace() {
        let width = word.chars().count();
        if column + 1 + width > 120 {
            text += "\n ";
            column = 1;
        }
        if column > 0 {
            text.push(' ');
            column += 1;
        }
        text += word;
        column += width;
    }
    text
}
