//! The HTML page of the suite `random`.

use super::RandomResults;
use super::cells::{cells, heads, legend, notes};
use super::results::VehicleGroup;
use super::shown_flight::ShownFlight;
use crate::report::{sheet, space_of_many};
use afbc_campaign::random::TILT_MAX_RAD;
use maud::{Markup, html};

pub(super) fn page(judged: &RandomResults<'_>, shown: Vec<ShownFlight>) -> String {
    sheet(
        "Suite random",
        &html! {
            p { "Randomly drawn flights of each vehicle: " (judged.words()) "." }
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
            @if !shown.is_empty() {
                p {
                    "For each vehicle, the flight in which " (judged.baseline()) " is worst relative to the best "
                    "contender, or in which it lost the vehicle and another contender did not:"
                }
            }
            @for flight in shown {
                h2 { (flight.name) }
                p.quiet { (flight.conditions) "." }
                (space_of_many(flight.space))
            }
        },
    )
}

/// Returns a table with one row per contender.
fn rankings(judged: &RandomResults<'_>, group: &VehicleGroup<'_>) -> Markup {
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
