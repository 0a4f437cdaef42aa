//! The HTML page of a comparison.

use super::cells::{cells, heads, legend, lost};
use crate::differences;
use crate::figures::Picture;
use crate::report::{parameters, picture, sheet};
use crate::words;
use afbc_campaign::compare::Comparison;
use maud::{Markup, html};

pub(super) fn page(comparisons: &[Comparison], figures: &[Vec<Picture>]) -> String {
    sheet(
        "Controllers compared",
        &html! {
            p.quiet { "Every controller flies the same vehicle through the same noise and weather." }
            @for (comparison, figures) in comparisons.iter().zip(figures) {
                h2 { (comparison.scenario.name) }
                @if !comparison.scenario.description.is_empty() { p { (comparison.scenario.description) "." } }
                p.quiet { (words::conditions(&comparison.scenario)) "." }
                div.scroll { (results(comparison)) }
                p.quiet { (legend(comparisons)) }
                @if let Some(grid) = differences::grid(comparison) { h3 { (grid.caption) } (grid.section()) }
                @for figure in figures { (picture(figure)) }
                h3 { "Parameters" }
                (parameters(&comparison.scenario))
            }
        },
    )
}

fn results(comparison: &Comparison) -> Markup {
    let heads = heads(comparison);
    html! {
        table {
            thead { tr { td {} @for head in &heads { th scope="col" { (head) } } } }
            tbody {
                @for entry in &comparison.entries {
                    tr {
                        th scope="row" { (entry.contender().title()) }
                        @match cells(comparison, entry, differences::median) {
                            Some(cells) => @for cell in cells { (cell) },
                            None => td.lost colspan=(heads.len()) { (lost(entry)) },
                        }
                    }
                }
            }
        }
    }
}
