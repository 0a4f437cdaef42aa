//! Bar charts of root mean square errors.

use super::canvas::{Canvas, Ink, WIDTH_PX, text_width_px};
use super::palette::{BLACK, GREY, color};
use super::panel::FRAME_INK;
use super::picture::Picture;
use crate::differences::number;
use crate::words;
use afbc_campaign::compare::{Comparison, ContenderFlights, MEASURES};
use afbc_drawing::TextAnchor;
use afbc_sim::metrics::SETTLED_S;

/// Number of panels: the first [`MEASURES`] are errors.
const PANELS: usize = 4;
const BAR_PX: f64 = 18.0;
/// Height of the title above a panel's bars.
const TITLE_PX: f64 = 26.0;
const MARGIN_PX: f64 = 14.0;
/// Width on the right of the longest bar, for its number.
const NUMBER_PX: f64 = 60.0;

/// Draws the errors of every contender as bars, two panels side by side; `None` without contenders.
pub(crate) fn draw(comparison: &Comparison) -> Option<Picture> {
    if comparison.entries.is_empty() {
        return None;
    }
    let scenario = &comparison.scenario;
    let conditions = format!("{}: {}", scenario.name, words::conditions(scenario));
    let (top_px, panel_px) = (34.0, TITLE_PX + comparison.entries.len() as f64 * BAR_PX + 12.0);
    let mut canvas = Canvas::new("Root mean square errors", &conditions, &[]);
    for index in 0..PANELS {
        let corner = ((index % 2) as f64 * WIDTH_PX / 2.0 + MARGIN_PX, top_px + (index / 2) as f64 * panel_px);
        panel(&mut canvas, comparison, index, corner);
    }
    let mut caption = format!("Root mean square errors from {SETTLED_S} s to the end; shorter is better.");
    let lost = |entry: &ContenderFlights| entry.lost() > 0;
    if comparison.is_repeated() && !comparison.entries.iter().all(lost) {
        caption += " Median over all seeds; thin bars: its interval of at least 95 %.";
    }
    if comparison.entries.iter().any(lost) {
        caption += " A contender that lost a vehicle has no bar.";
    }
    let svg = canvas.svg(top_px + 2.0 * panel_px);
    Some(Picture { name: "rmse", caption, svg, explorable: None })
}

/// Draws one error of every contender; the last argument is the panel's top left corner.
fn panel(canvas: &mut Canvas, comparison: &Comparison, index: usize, (left_px, top_px): (f64, f64)) {
    let Some(figure) = MEASURES.get(index) else { return };
    let median = |entry: &ContenderFlights| entry.median(figure.value);
    let medians = || comparison.entries.iter().filter_map(median);
    let ends = medians().flat_map(|median| [median.value].into_iter().chain(median.interval.into_iter().flatten()));
    let largest = ends.filter(|end| end.is_finite()).fold(1e-9, f64::max);
    let names = comparison.entries.iter().map(|entry| text_width_px(entry.contender().title(), 12.0));
    let zero_px = left_px + names.fold(0.0, f64::max) + 8.0;
    let room_px = (left_px + WIDTH_PX / 2.0 - 2.0 * MARGIN_PX - NUMBER_PX - zero_px).max(1.0);

    canvas.text(figure.title, (zero_px, top_px + 14.0), 12.0, TextAnchor::Start, BLACK);
    for (row, entry) in comparison.entries.iter().enumerate() {
        let y_px = top_px + TITLE_PX + row as f64 * BAR_PX;
        let middle_px = y_px + 0.5 * BAR_PX;
        canvas.text(entry.contender().title(), (zero_px - 8.0, middle_px), 12.0, TextAnchor::End, BLACK);
        let Some(median) = median(entry) else {
            canvas.text("lost", (zero_px + 6.0, middle_px), 11.0, TextAnchor::Start, GREY);
            continue;
        };
        let x_px = |value: f64| zero_px + room_px * value.clamp(0.0, largest) / largest;
        let corners = [(zero_px, y_px + 2.0), (x_px(median.value), y_px + BAR_PX - 2.0)];
        canvas.rectangle(corners, color(&entry.contender().name), 1.0);
        let mut end_px = x_px(median.value);
        if let Some([low, high]) = median.interval {
            end_px = x_px(high);
            canvas.line([(x_px(low), middle_px), (end_px, middle_px)], Ink::new(BLACK, 1.25));
        }
        canvas.text(&number(median.value, figure), (end_px + 6.0, middle_px), 11.0, TextAnchor::Start, GREY);
    }
    let bars_px = comparison.entries.len() as f64 * BAR_PX;
    canvas.line([(zero_px, top_px + TITLE_PX), (zero_px, top_px + TITLE_PX + bars_px)], FRAME_INK);
}
