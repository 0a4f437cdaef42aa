//! The report of a replay.

use super::{Replay, cells};
use crate::figures::Picture;
use crate::report::{picture, sheet};
use maud::html;

pub(super) fn page(replay: &Replay<'_>, pictures: &[Picture]) -> String {
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
                "Log less estimate. Within 3σ: share of the coordinates within three of the estimator's standard \
                 deviations. Valid: share of the log's times at which the estimate was valid; only these are compared."
            }
            @for sentence in cells::sentences(replay) { p { (sentence) } }
            @for figure in pictures { (picture(figure)) }
        },
    )
}
