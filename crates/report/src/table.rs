//! Formats the table of flights for the terminal.

use crate::claims::Claim;
use crate::groups::{ScenarioGroup, groups};
use crate::words;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::{Metrics, SETTLED_S};
use core::cell::Cell;
use nalgebra::Vector4;

/// Widest line of text in files, and on a terminal of unknown width.
const WIDTH: usize = 100;

thread_local! {
    /// Current widest line of text.
    static WIDTH_NOW: Cell<usize> = const { Cell::new(WIDTH) };
}

/// Width of a column of numbers.
const CELL: usize = 10;

/// Returns the current widest line of text.
pub(super) fn line_width() -> usize {
    WIDTH_NOW.get()
}

/// Returns the table that `make` makes, wrapped for a terminal with this many columns.
pub fn for_terminal(columns: usize, make: impl FnOnce() -> String) -> String {
    WIDTH_NOW.set(columns.min(WIDTH));
    let table = make();
    WIDTH_NOW.set(WIDTH);
    table
}

/// One block of the table: title, heads of its four columns, and values.
pub(super) struct TableBlock {
    pub(super) title: &'static str,
    pub(super) columns: [&'static str; 4],
    pub(super) digits: usize,
    pub(super) values: fn(&Metrics) -> Vector4<f64>,
    /// True if the values only exist for a flight beyond the settling time.
    pub(super) needs_settled: bool,
    /// True for the first block, which also lists lost flights; the others leave them out.
    pub(super) first: bool,
}

const OUTPUTS: [&str; 4] = ["x [m]", "y [m]", "z [m]", "psi [rad]"];

/// Blocks from top to bottom.
pub(super) const BLOCKS: [TableBlock; 4] = [
    TableBlock { title: "RMSE", columns: OUTPUTS, digits: 4, values: |m| m.rmse, needs_settled: true, first: true },
    TableBlock {
        title: "largest |error|",
        columns: OUTPUTS,
        digits: 4,
        values: |m| m.max_abs,
        needs_settled: true,
        first: false,
    },
    TableBlock {
        title: "final error",
        columns: OUTPUTS,
        digits: 4,
        values: |m| m.final_error,
        needs_settled: false,
        first: false,
    },
    TableBlock {
        title: "mean |dU|",
        columns: ["U1 [mN]", "U2 [mN]", "U3 [mN]", "U4 [mN]"],
        digits: 1,
        values: |m| m.mean_abs_delta_u * 1000.0,
        needs_settled: true,
        first: false,
    },
];

impl TableBlock {
    /// Returns the flights that have a row in this block.
    pub(super) fn rows<'a>(&self, group: &'a ScenarioGroup<'_>) -> impl Iterator<Item = &'a ScenarioFlight> {
        let all = self.first;
        group.flights.iter().copied().filter(move |flight| all || flight.run.lost.is_none())
    }

    /// Returns the four values of a run, or dashes if there was nothing to measure.
    pub(super) fn cells(&self, flight: &ScenarioFlight) -> [String; 4] {
        let values: [f64; 4] = (self.values)(&flight.run.metrics).into();
        if self.needs_settled && !flight.run.is_settled() {
            return values.map(|_| "-".into());
        }
        values.map(|value| number(value, self.digits))
    }
}

/// Formats `value` with `digits` decimals, or in scientific notation if that is too wide for the column. Never gives
/// "-0.000".
fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if text.len() >= CELL {
        format!("{value:.2e}")
    } else if text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.')) {
        text.trim_start_matches('-').into()
    } else {
        text
    }
}

/// Explains the values in one or two sentences.
pub(super) fn legend() -> String {
    format!(
        "Error: reference minus vehicle, from {SETTLED_S} s to the end. Mean |dU|: mean absolute change of each input \
         from one control step to the next."
    )
}

/// Formats flights and claims. For each scenario and law there are the RMSE, largest and final error of each axis, and
/// the smoothness of each input.
pub fn table(flown: &[ScenarioFlight], claims: &[Claim]) -> String {
    let mut lines = Vec::new();
    let groups = groups(flown);
    for group in &groups {
        flights(group, &mut lines);
        lines.push(String::new());
    }
    if groups.is_empty() {
        lines.push("Nothing was flown.".into());
    } else {
        wrap(&mut lines, "", &legend());
    }
    if !claims.is_empty() {
        lines.extend([String::new(), "The paper's claims".into()]);
    }
    for claim in claims {
        let verdict = if claim.holds { "  holds          " } else { "  does not hold  " };
        wrap(&mut lines, verdict, &format!("{}:", claim.statement));
        wrap(&mut lines, &" ".repeat(verdict.len()), &claim.evidence);
    }
    lines.push(String::new());
    lines.join("\n")
}

/// Formats the block of one scenario.
fn flights(group: &ScenarioGroup, lines: &mut Vec<String>) {
    wrap(lines, "", &format!("{}: {}", group.scenario.name, words::conditions(group.scenario)));
    // Width of the longest printed name.
    let name_width = group.flights.iter().map(|flight| flight.run.contender.title().chars().count()).max().unwrap_or(0);
    // Titles, names and numbers fit a terminal of 80 columns.
    let title_width = BLOCKS.iter().map(|block| block.title.len() + 2).max().unwrap_or(0);
    let rule = "─".repeat(title_width + name_width + 4 * CELL);
    let (widths, mut head) = ([title_width, name_width], [""; 4]);
    for block in &BLOCKS {
        let rows: Vec<_> = block.rows(group).collect();
        if rows.is_empty() {
            continue;
        }
        if head == block.columns {
            lines.push(rule.replace('─', "┈"));
        } else {
            head = block.columns;
            lines.push(rule.clone());
            lines.push(row("", "", widths, &head));
        }
        let mut title = block.title;
        for flight in rows {
            let name = flight.run.contender.title();
            lines.push(match &flight.run.lost {
                Some(lost) => {
                    format!("{title:<title_width$}{name:<name_width$}   {}", words::lost(lost))
                }
                None => row(title, name, widths, &block.cells(flight)),
            });
            title = "";
        }
    }
    lines.push(rule);
    for flight in &group.flights {
        if let Some(tripped) = &flight.run.tripped {
            wrap(lines, "", &format!("{}: {}.", flight.run.contender.title(), words::tripped(tripped)));
        }
        if let Some(estimate) = &flight.run.metrics.estimate {
            wrap(lines, "", &format!("{}: {}.", flight.run.contender.title(), words::estimate(estimate)));
        }
    }
}

fn row(title: &str, name: &str, [title_width, name_width]: [usize; 2], cells: &[impl AsRef<str>; 4]) -> String {
    let [a, b, c, d] = cells.each_ref().map(AsRef::as_ref);
    format!("{title:<title_width$}{name:<name_width$}{a:>CELL$}{b:>CELL$}{c:>CELL$}{d:>CELL$}")
}

/// Appends `text` after `first`, wrapped; further lines are aligned with the text.
pub(super) fn wrap(lines: &mut Vec<String>, first: &str, text: &str) {
    let (width, mut line) = (line_width(), first.to_owned());
    let mut length = first.chars().count();
    let indent = length;
    for word in text.split_whitespace() {
        let word_length = word.chars().count();
        if length > indent {
            if length + 1 + word_length > width {
                lines.push(core::mem::replace(&mut line, " ".repeat(indent)));
                length = indent;
            } else {
                line.push(' ');
                length += 1;
            }
        }
        line.push_str(word);
        length += word_length;
    }
    lines.push(line);
}
