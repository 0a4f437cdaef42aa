//! Root mean square errors as bars.

use super::canvas::{self, Area, Failure, Ink, WIDTH_PX, text, text_width_px, units};
use super::palette::{BLACK, FRAME, GREY, color};
use super::picture::Picture;
use crate::differences::number;
use crate::words;
use afbc_campaign::compare::{Comparison, Entry, MEASURES};
use afbc_sim::metrics::SETTLED_S;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use std::io;

/// Number of panels: the errors are the first of [`MEASURES`].
const PANELS: usize = 4;
const BAR_PX: f64 = 18.0;
/// Height above the bars of one panel.
const TITLE_PX: f64 = 26.0;
const MARGIN_PX: f64 = 14.0;
/// Width right of the longest bar, for its number.
const NUMBER_PX: f64 = 60.0;

/// Draws bars of every contender's errors, two panels side by side; none without contenders.
pub(crate) fn draw(comparison: &Comparison) -> io::Result<Option<Picture>> {
    if comparison.entries.is_empty() {
        return Ok(None);
    }
    let scenario = &comparison.scenario;
    let conditions = format!("{}: {}", scenario.name, words::conditions(scenario));
    let title = "Root mean square errors";
    let (top_px, panel_px) = (34.0, TITLE_PX + comparison.entries.len() as f64 * BAR_PX + 12.0);
    let svg = canvas::svg(top_px + 2.0 * panel_px, title, |area| {
        canvas::head(area, title, &conditions, &[])?;
        for index in 0..PANELS {
            let corner = ((index % 2) as f64 * WIDTH_PX / 2.0 + MARGIN_PX, top_px + (index / 2) as f64 * panel_px);
            panel(area, comparison, index, corner)?;
        }
        Ok(())
    })?;
    let mut caption = format!("Root mean square errors from {SETTLED_S} s to the end; shorter is better.");
    let lost = |entry: &Entry| entry.lost() > 0;
    if comparison.is_repeated() && !comparison.entries.iter().all(lost) {
        caption += " Median over all seeds; thin bars: its interval of at least 95 %.";
    }
    if comparison.entries.iter().any(lost) {
        caption += " A contender that lost a vehicle has no bar.";
    }
    Ok(Some(Picture { name: "rmse", caption, svg, explorable: None }))
}

/// Draws one error of every contender, with the given top left corner.
fn panel(area: &Area, comparison: &Comparison, index: usize, (left_px, top_px): (f64, f64)) -> Result<(), Failure> {
    let Some(figure) = MEASURES.get(index) else { return Ok(()) };
    let median = |entry: &Entry| entry.median(figure.value);
    let medians = || comparison.entries.iter().filter_map(median);
    let ends = medians().flat_map(|median| [median.value].into_iter().chain(median.interval.into_iter().flatten()));
    let largest = ends.filter(|end| end.is_finite()).fold(1e-9, f64::max);
    let names = comparison.entries.iter().map(|entry| text_width_px(entry.contender().title(), 12.0));
    let zero_px = left_px + names.fold(0.0, f64::max) + 8.0;
    let room_px = (left_px + WIDTH_PX / 2.0 - 2.0 * MARGIN_PX - NUMBER_PX - zero_px).max(1.0);
    let write = |words: String, x: f64, y: f64, style| area.draw(&Text::new(words, (units(x), units(y)), style));

    write(figure.title.into(), zero_px, top_px + 14.0, text(12.0, BLACK, HPos::Left))?;
    for (row, entry) in comparison.entries.iter().enumerate() {
        let y_px = top_px + TITLE_PX + row as f64 * BAR_PX;
        let middle_px = y_px + 0.5 * BAR_PX;
        write(entry.contender().title().into(), zero_px - 8.0, middle_px, text(12.0, BLACK, HPos::Right))?;
        let Some(median) = median(entry) else {
            write("lost".into(), zero_px + 6.0, middle_px, text(11.0, GREY, HPos::Left))?;
            continue;
        };
        let x_px = |value: f64| zero_px + room_px * value.clamp(0.0, largest) / largest;
        let corners = [(units(zero_px), units(y_px + 2.0)), (units(x_px(median.value)), units(y_px + BAR_PX - 2.0))];
        area.draw(&Rectangle::new(corners, color(&entry.contender().name).filled()))?;
        let mut end_px = x_px(median.value);
        if let Some([low, high]) = median.interval {
            end_px = x_px(high);
            let ends = [x_px(low), end_px].map(|x| (units(x), units(middle_px)));
            area.draw(&PathElement::new(ends, Ink::new(BLACK, 1.25).style()))?;
        }
        write(number(median.value, figure), end_px + 6.0, middle_px, text(11.0, GREY, HPos::Left))?;
    }
    let axis = [
        (units(zero_px), units(top_px + TITLE_PX)),
        (units(zero_px), units(top_px + TITLE_PX + comparison.entries.len() as f64 * BAR_PX)),
    ];
    area.draw(&PathElement::new(axis, Ink::new(FRAME, 0.75).style()))
}
