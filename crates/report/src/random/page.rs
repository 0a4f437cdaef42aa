//! The report.

use super::Judged;
use super::cells::{cells, heads, legend, notes};
use super::judged::Group;
use crate::report::sheet;
use afbc_campaign::random::TILT_MAX_RAD;
use maud::{Markup, html};

pub(super) fn page(judged: &Judged<'_>) -> String {
    sheet(
        "Suite random",
        &html! {
            p { "Flights drawn over vehicles: " (judged.words()) "." }
            p.quiet {
                "Every contender flies the same flights with the vehicle's own gains and a tilt of up to "
                (TILT_MAX_RAD) " rad. Every flight is in flights.csv."
            }
            p.quiet { (legend(judged)) }
            @for group in &judged.groups {
                h2 { (group.name()) }
                div.scroll { (rankings(judged, group)) }
                @for note in notes(judged, group) { p { (note) } }
            }
        },
    )
}

/// A row for each contender.
fn rankings(judged: &Judged<'_>, group: &Group<'_>) -> Markup {
    html! {
        table {
            thead { tr {
                td { (group.flights) " flights" }
                @for head in heads(judged) { th scope="col" { (head) } }
            } }
            tbody {
                @for (contender, ranking) in judged.contenders().iter().zip(&group.rankings) {
                    tr {
                        th scope="row" { (contender.title()) }
                        @for cell in cells(group, ranking) { td { (cell) } }
                    }
                }
            }
        }
    }
}
