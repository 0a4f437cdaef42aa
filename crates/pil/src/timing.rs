//! Computes the firmware's times on each board. Inputs are counted instructions, the cores' cycles per instruction, and
//! transfers on the buses. The result is the worst response of each interrupt and task, in the tables of
//! `docs/reference/timing-tables.md`.

mod boards;
mod bus;
mod cycles;
mod known;
mod verdict;
mod work;

pub use boards::{BOARDS, BoardTimes, RateOfUart, TABLES, default_baud};
pub use bus::{BusScript, i2c_ns, spi_clock_hz, spi_ns};
pub use cycles::{CORTEX_M4F, CORTEX_M7, CoreCycles, CycleLimit, InstructionMix};
pub use known::KnownLateness;
pub use verdict::verdicts;
pub use work::{CriticalSection, InstructionCounts, TimingRow};

use crate::Error;
use crate::response::load;
use std::fmt::Write as _;

/// Tables of one board and the problems found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BoardReport {
    /// Tables in Markdown.
    pub text: String,
    /// A line for each wrong row: late but not known to be, later than known, or known to be late but in time.
    pub wrong: Vec<String>,
}

/// Returns the tables of all boards. `budgets` is the page with the instruction counts.
///
/// # Errors
/// Fails if the page lacks a row.
pub fn reports(budgets: &str) -> Result<Vec<BoardReport>, Error> {
    let work = InstructionCounts::read(budgets)?;
    Ok(BOARDS.iter().map(|board| report(board, &work)).collect())
}

fn report(board: &BoardTimes, work: &InstructionCounts) -> BoardReport {
    let mut text = String::new();
    let core = board.core;
    let _ = writeln!(text, "### {}\n", board.name);
    let [best, bound] = [CycleLimit::Best, CycleLimit::Bound].map(|limit| core.per_instruction(limit));
    let _ = writeln!(
        text,
        "{}, {} MHz: {best:.2} cycles per instruction at best, {bound:.2} at most.\n",
        core.name,
        core.hz / 1_000_000
    );
    let _ = writeln!(text, "| | period | C, best | C, most | blocked | R, best | R, most | deadline | share |");
    let _ = writeln!(text, "|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    let [best, bound] = [CycleLimit::Best, CycleLimit::Bound].map(|limit| work.rows(board, limit, default_baud()));
    for (best, bound) in best.iter().zip(&bound) {
        let deadline = bound.deadline_ns.map_or_else(String::new, us);
        let share = match (bound.deadline_ns, bound.response_ns) {
            (None, _) => String::new(),
            (Some(deadline), Some(response)) if response <= deadline => {
                format!("{} %", (response * 100).div_ceil(deadline))
            }
            _ if best.is_late() => "**late**, at best too".into(),
            _ => "**late**".into(),
        };
        let none = || "none".into();
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {deadline} | {share} |",
            bound.name,
            us(bound.task.period_ns),
            us(best.task.cost_ns),
            us(bound.task.cost_ns),
            us(bound.task.blocking_ns),
            best.response_ns.map_or_else(none, us),
            bound.response_ns.map_or_else(none, us),
        );
    }
    let share = |rows: &[TimingRow]| {
        let tasks: Vec<_> = rows.iter().map(|row| row.task).collect();
        format!("{:.0} %", load(&tasks) * 100.0)
    };
    let _ = writeln!(text, "| load | | {} | {} | | | | | |\n", share(&best), share(&bound));

    let _ = writeln!(text, "| known to be late | at most | accepted because |\n|---|--:|---|");
    for known in board.known {
        let _ = writeln!(text, "{known}");
    }
    text.push('\n');
    let _ = writeln!(text, "| transfer | bytes | clock | time |\n|---|--:|--:|--:|");
    for script in board.scripts() {
        let _ = writeln!(
            text,
            "| {} | {} | {} kHz | {} |",
            script.part,
            script.bytes,
            script.clock_hz / 1000,
            us(script.time_ns)
        );
    }
    let _ = writeln!(text, "| DSHOT600 frame, by DMA | | 600 kHz | {} |\n", us(bus::FRAME_NS));
    let _ = writeln!(text, "| with interrupts off | instructions | best | most |\n|---|--:|--:|--:|");
    for section in work.sections(board) {
        let time = |limit| us(section.time_ns(core, limit));
        let count = section.straight + section.looped;
        let _ =
            writeln!(text, "| {} | {count} | {} | {} |", section.what, time(CycleLimit::Best), time(CycleLimit::Bound));
    }
    let wrong = verdicts(board.known, &best, &bound);
    BoardReport { text, wrong: wrong.iter().map(|wrong| format!("{}: {wrong}", board.name)).collect() }
}

/// Formats a time in microseconds, rounded up to a tenth.
fn us(ns: u64) -> String {
    let tenths = ns.div_ceil(100);
    format!("{}.{} us", tenths / 10, tenths % 10)
}

const BEGIN: &str = "<!-- timing: written by cargo run --release -p pil --bin timing -->\n";
const END: &str = "<!-- end -->\n";

/// Returns the page with the tables between its markers.
///
/// # Errors
/// Fails if the page has no markers.
pub fn page(text: &str, reports: &[BoardReport]) -> Result<String, Error> {
    let unmarked = || Error::Protocol("docs/reference/timing-tables.md lacks the markers of the tables".into());
    let (before, rest) = text.split_once(BEGIN).ok_or_else(unmarked)?;
    let (_, after) = rest.split_once(END).ok_or_else(unmarked)?;
    let tables: Vec<_> = reports.iter().map(|report| report.text.as_str()).collect();
    Ok([before, BEGIN, tables.join("\n").as_str(), END, after].concat())
}
