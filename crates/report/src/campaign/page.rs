//! The HTML page of a campaign.

use super::cells::{HEADS, bad, cells, flights, legend, percent};
use crate::figures::Picture;
use crate::report::{picture, sheet};
use crate::words;
use afbc_campaign::statistics::Share;
use afbc_campaign::{CampaignSummary, SurvivalCount};
use maud::{Markup, html};

pub(super) fn page(summary: &CampaignSummary, figures: &[Picture]) -> String {
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
            p.quiet { (legend(summary)) }
            @for figure in figures { (picture(figure)) }
            h3 { "Share of flights not lost, by trajectory" }
            div.scroll { (by_trajectory(summary)) }
            p.quiet { "The 95 % interval stands below each share." }
            h3 { "Worst flights" }
            div.scroll { (worst(summary)) }
            @if !manifest.drawn.is_empty() {
                h3 { "Drawn" }
                div.scroll { (drawn(summary)) }
            }
        },
    )
}

fn results(summary: &CampaignSummary) -> Markup {
    html! {
        table {
            thead {
                tr { td {} @for (group, columns) in HEADS { th colspan=(columns.len()) { (group) } } }
                tr { td {} @for (_, columns) in HEADS { @for column in columns { th scope="col" { (column) } } } }
            }
            tbody {
                @for tally in &summary.tallies {
                    tr { th scope="row" { (&tally.contender) } @for cell in cells(tally) { td { (&cell) } } }
                }
            }
        }
    }
}

/// Formats the share of flights that were not lost, with its 95 % interval.
fn not_lost(count: &SurvivalCount) -> Markup {
    let Share { value, low, high } = count.share();
    html! {
        (percent(value))
        @if count.flights > 0 { br; span.quiet { (format!("{:.1} to {:.1}", 100.0 * low, 100.0 * high)) } }
    }
}

fn by_trajectory(summary: &CampaignSummary) -> Markup {
    html! {
        table {
            thead { tr { td {} @for name in &summary.manifest.trajectories { th scope="col" { (name) } } } }
            tbody {
                @for tally in &summary.tallies {
                    tr {
                        th scope="row" { (tally.contender) }
                        @for count in &tally.by_trajectory { td { (not_lost(count)) } }
                    }
                }
            }
        }
    }
}

fn worst(summary: &CampaignSummary) -> Markup {
    let target = summary.manifest.target();
    html! {
        table {
            @for tally in &summary.tallies {
                tbody {
                    @for (i, flight) in tally.worst.iter().enumerate() {
                        @let [how, command] = bad(&target, tally, flight);
                        tr {
                            th scope="row" { @if i == 0 { (tally.contender) } }
                            td.prose { (how) br; code { (command) } }
                        }
                    }
                }
            }
        }
    }
}

fn drawn(summary: &CampaignSummary) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "quantity" }
                    th.name scope="col" { "from, to" }
                    th.name scope="col" { "in the file" }
                }
            }
            tbody {
                @for drawn in &summary.manifest.drawn {
                    @let [low, high] = drawn.ends;
                    tr {
                        th scope="row" { (words::drawn(&drawn.name)) }
                        td.name { @if low < high { (low) " to " (high) } @else { (low) } }
                        td.name { code { (drawn.name) } }
                    }
                }
            }
        }
    }
}
