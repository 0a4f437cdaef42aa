//! A campaign on one page.

use super::{HEADS, LEGEND, bad, cells, flights, percent};
use crate::campaign::Summary;
use crate::output::figures::Figure;
use crate::output::report::{picture, sheet};
use maud::{Markup, html};

pub(super) fn page(summary: &Summary, figures: &[Figure]) -> String {
    let manifest = &summary.manifest;
    let title = if manifest.description.is_empty() { &manifest.name } else { &manifest.description };
    sheet(
        title,
        &html! {
            p.quiet {
                (flights(summary)) " flights under each of " (manifest.contenders.len())
                " contenders, all with the same draws (seed " (manifest.seed) "). Every row is in results.parquet."
            }
            h2 { (manifest.name) }
            div.scroll { (results(summary)) }
            p.quiet { (LEGEND) }
            @for figure in figures { (picture(figure)) }
            h3 { "Not lost, by trajectory" }
            div.scroll { (by_trajectory(summary)) }
            h3 { "Worst flights" }
            div.scroll { (worst(summary)) }
            h3 { "Drawn" }
            div.scroll { (drawn(summary)) }
        },
    )
}

fn results(summary: &Summary) -> Markup {
    html! {
        table {
            thead {
                tr { td {} @for (group, columns) in HEADS { th colspan=(columns.len()) { (unbroken(group)) } } }
                tr { td {} @for (_, columns) in HEADS { @for column in columns { th scope="col" { (column) } } } }
            }
            tbody {
                @for tally in &summary.tallies {
                    tr { th scope="row" { (unbroken(&tally.contender)) } @for cell in cells(tally) { td { (unbroken(&cell)) } } }
                }
            }
        }
    }
}

/// Text that stays on one line.
fn unbroken(text: &str) -> String {
    text.replace(' ', "\u{a0}").replace('-', "\u{2011}")
}

fn by_trajectory(summary: &Summary) -> Markup {
    html! {
        table {
            thead { tr { td {} @for name in &summary.manifest.trajectories { th scope="col" { (name) } } } }
            tbody {
                @for tally in &summary.tallies {
                    tr {
                        th scope="row" { (tally.contender) }
                        @for count in &tally.by_trajectory { td { (percent(count.share().value)) } }
                    }
                }
            }
        }
    }
}

fn worst(summary: &Summary) -> Markup {
    let target = summary.manifest.target();
    html! {
        table {
            @for tally in &summary.tallies {
                tbody {
                    @for (i, flight) in tally.worst.iter().enumerate() {
                        @let [how, command] = bad(&target, tally, flight);
                        tr {
                            th scope="row" { @if i == 0 { (tally.contender) } }
                            td.name { (how) br; code { (command) } }
                        }
                    }
                }
            }
        }
    }
}

fn drawn(summary: &Summary) -> Markup {
    html! {
        table {
            tbody {
                @for drawn in &summary.manifest.drawn {
                    @let [low, high] = drawn.ends;
                    tr {
                        th scope="row" { (drawn.name) }
                        td.name { @if low < high { (low) " to " (high) } @else { (low) } }
                        td.name { (drawn.meaning) }
                    }
                }
            }
        }
    }
}
