//! The HTML page of an exact log under changed settings.

use super::cells;
use super::replayed::ReplayedLog;
use crate::figures::{self, Picture};
use crate::report::{picture, sheet, space};
use maud::html;

pub(super) fn page(log: &ReplayedLog<'_>, pictures: &[Picture]) -> String {
    let replay = log.replay;
    let comparison = replay.comparison.as_ref();
    let rows = comparison.map_or(Vec::new(), |comparison| cells::rows(replay, comparison));
    sheet(
        &format!("{}, under other settings", log.name),
        &html! {
            p.quiet { "The firmware's own code, run again on the inputs of a recorded flight." }
            p { (cells::conditions(replay)) "." }
            @for sentence in cells::contents(replay) { p { (sentence) } }
            p { (cells::verdict(replay)) }
            @for sentence in comparison.map_or(Vec::new(), cells::changed) { p { (sentence) } }
            div.scroll { table {
                thead { tr { td {} @for head in cells::HEADS { th scope="col" { (head) } } } }
                tbody {
                    @for row in &rows {
                        tr { th scope="row" { (row.name) } @for cell in &row.cells { td { (cell) } } }
                    }
                }
            } }
            p.quiet { "Differences in ticks during which the vehicle is armed with both settings." }
            (space(figures::exact::space(replay), "The estimates, as flown and with the changed settings."))
            @for figure in pictures { (picture(figure)) }
        },
    )
}
