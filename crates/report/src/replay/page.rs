//! The HTML page of a replay.

use super::{ReplayedRecording, cells};
use crate::figures::{self, Picture};
use crate::report::{picture, sheet, space};
use maud::html;

pub(super) fn page(replay: &ReplayedRecording<'_>, pictures: &[Picture]) -> String {
    let rows = cells::rows(replay);
    sheet(
        &format!("{}, replayed", replay.name),
        &html! {
            p.quiet { "A recorded flight through the estimator, beside the estimate in the log." }
            p { (cells::conditions(replay)) "." }
            div.scroll { table {
                thead { tr { td {} @for head in cells::HEADS { th scope="col" { (head) } } } }
                tbody {
                    @for row in &rows {
                        tr { th scope="row" { (row.name) } @for cell in &row.cells { td { (cell) } } }
                    }
                }
            } }
            p.quiet {
                "Differences: log minus estimate. Within 3σ: share of the coordinates within three of the estimator's \
                 standard deviations. Valid: share of the log's times at which the estimate was valid; only these \
                 times are compared."
            }
            @for sentence in cells::sentences(replay) { p { (sentence) } }
            (space(figures::replay::space(replay.replayed), "Both estimates, while they are valid."))
            @for figure in pictures { (picture(figure)) }
        },
    )
}
