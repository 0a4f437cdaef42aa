//! Root mean square errors as bars.

use super::canvas::{self, Area, FRAME, Failure, GREY, Ink, WIDTH_PX, text, text_width_px, units};
use super::{Figure, color};
use crate::compare::{Comparison, Entry, FIGURES};
use crate::output::words;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use std::io;

/// The first of [`FIGURES`]: the errors.
const PANELS: usize = 4;
const BAR_PX: f64 = 18.0;
/// Above the bars of one panel.
const TITLE_PX: f64 = 26.0;
const MARGIN_PX: f64 = 14.0;
/// Right of the longest bar: its number.
const NUMBER_PX: f64 = 60.0;

/// Bars of every contender's errors, two panels side by side; none of no contender.
pub(in crate::output) fn draw(comparison: &Comparison) -> io::Result<Option<Figure>> {
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
    let caption = "Root mean square errors from 5 s to the end, the mean over all seeds; short is good.".into();
    Ok(Some(Figure { name: "rmse", caption, svg }))
}

/// One error of every contender, from the corner at the left top.
fn panel(area: &Area, comparison: &Comparison, index: usize, (left_px, top_px): (f64, f64)) -> Result<(), Failure> {
    let Some(figure) = FIGURES.get(index) else { return Ok(()) };
    let mean = |entry: &Entry| entry.spread(figure.value).map(|spread| spread.mean);
    let largest = comparison.entries.iter().filter_map(mean).fold(1e-9, f64::max);
    let names = comparison.entries.iter().map(|entry| text_width_px(entry.contender().title(), 12.0));
    let zero_px = left_px + names.fold(0.0, f64::max) + 8.0;
    let room_px = (left_px + WIDTH_PX / 2.0 - 2.0 * MARGIN_PX - NUMBER_PX - zero_px).max(1.0);
    let write = |words: String, x: f64, y: f64, style| area.draw(&Text::new(words, (units(x), units(y)), style));

    write(figure.title.into(), zero_px, top_px + 14.0, text(12.0, canvas::BLACK, HPos::Left))?;
    for (row, entry) in comparison.entries.iter().enumerate() {
        let y_px = top_px + TITLE_PX + row as f64 * BAR_PX;
        let middle_px = y_px + 0.5 * BAR_PX;
        write(entry.contender().title().into(), zero_px - 8.0, middle_px, text(12.0, canvas::BLACK, HPos::Right))?;
        let (length_px, label) = match mean(entry) {
            Some(mean) => (room_px * mean / largest, format!("{mean:.4}")),
            None => (0.0, "lost".into()),
        };
        let corners = [(units(zero_px), units(y_px + 2.0)), (units(zero_px + length_px), units(y_px + BAR_PX - 2.0))];
        area.draw(&Rectangle::new(corners, color(row).filled()))?;
        write(label, zero_px + length_px + 6.0, middle_px, text(11.0, GREY, HPos::Left))?;
    }
    let axis = [
        (units(zero_px), units(top_px + TITLE_PX)),
        (units(zero_px), units(top_px + TITLE_PX + comparison.entries.len() as f64 * BAR_PX)),
    ];
    area.draw(&PathElement::new(axis, Ink { color: FRAME, width_px: 0.75 }.style()))
}
