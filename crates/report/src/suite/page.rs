//! The HTML page of a suite.

use super::cells::{FIGURES, SuiteFigure, lost, trip};
use super::flight_figures::FlightFigures;
use super::{FlownSuite, heat, standing};
use crate::report::{picture, sheet, space_of_many};
use crate::words;
use afbc_campaign::suite::SuiteFlight;
use afbc_sim::metrics::SETTLED_S;
use maud::{Markup, html};

pub(super) fn page(flown: FlownSuite<'_>, drawn: Vec<FlightFigures>) -> String {
    let suite = flown.suite;
    sheet(
        &format!("Suite {}", suite.name),
        &html! {
            p { (suite.description) "." }
            p.quiet {
                "Every contender flies the same vehicle through the same noise and weather, with the gains of the "
                "vehicle's file or, without these, gains scaled to the vehicle by rule. Figures are evaluated from "
                (SETTLED_S) " s to the end. *: best of the flight."
            }
            h2 { "Where they stand" }
            p.quiet {
                "Root mean square distance from the reference as a multiple of the flight's best, by medians over the "
                "seeds; the geometric mean is over the flights that the contender did not lose."
            }
            div.scroll { (heat::map(flown)) }
            @let standing = standing::grid(flown);
            h2 { (standing.caption) }
            (standing.section())
            @for figure in &FIGURES { h2 { (figure.title) } div.scroll { (results(flown, figure)) } }
            @if flown.rows().any(|(flight, _)| !flight.published.is_empty()) { (published(flown)) }
            @for ((flight, comparison), drawn) in flown.rows().zip(drawn) {
                h2 id=(heat::anchor(comparison)) { (flight.scenario.name) }
                @if !comparison.scenario.description.is_empty() { p { (comparison.scenario.description) "." } }
                p.quiet { (words::conditions(&comparison.scenario)) (tilt(flight)) "." }
                @for entry in &comparison.entries {
                    @if let Some(trip) = trip(entry) { p { (entry.contender().title()) ": " (trip) "." } }
                    @for lost in entry.flights.iter().filter_map(|flight| flight.lost).take(1) {
                        p { (entry.contender().title()) ": " (words::lost(&lost)) "." }
                    }
                }
                @if let Some(errors) = &drawn.errors { (picture(errors)) }
                (space_of_many(drawn.space))
            }
        },
    )
}

fn tilt(flight: &SuiteFlight) -> String {
    flight.tilt_max_rad.map_or(String::new(), |tilt_rad| format!(", a tilt of up to {tilt_rad} rad"))
}

/// Returns a table with one row per flight and one column per contender.
fn results(flown: FlownSuite<'_>, figure: &SuiteFigure) -> Markup {
    html! {
        table {
            thead { tr {
                td {}
                @for entry in flown.comparisons.first().iter().flat_map(|first| &first.entries) {
                    th scope="col" { (entry.contender().title()) }
                }
            } }
            tbody {
                @for comparison in flown.comparisons {
                    tr {
                        th scope="row" { (comparison.scenario.name) }
                        @for entry in &comparison.entries {
                            @match (lost(entry), figure.text(entry)) {
                                (None, Some(text)) => td {
                                    @if figure.is_best(comparison, entry) { strong { (text) } "*" } @else { (text) }
                                    @if trip(entry).is_some() { " trip" }
                                },
                                (lost, _) => td.lost {
                                    (lost.unwrap_or_default()) @if trip(entry).is_some() { ", trip" }
                                },
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Returns a table of published results about the flights.
fn published(flown: FlownSuite<'_>) -> Markup {
    let figures = flown.rows().flat_map(|(flight, _)| flight.published.iter().map(move |figure| (flight, figure)));
    html! {
        h2 { "Published" }
        div.scroll { table {
            thead { tr {
                td {} th { "who flew" } th { "root mean square distance [m]" } th { "source" }
            } }
            tbody {
                @for (flight, figure) in figures {
                    tr {
                        th scope="row" { (flight.scenario.name) }
                        td.name { (figure.law) }
                        td { (figure.rms_m) }
                        td { @if let Some(source) = flown.suite.sources.get(figure.source) { (source.name) } }
                    }
                }
            }
        } }
        dl {
            @for source in &flown.suite.sources {
                div { dt { (source.name) } dd { (source.citation) ". Differences: " (source.differs) "." } }
            }
        }
    }
}
