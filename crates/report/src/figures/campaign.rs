//! Figures of a campaign: distributions over its flights, and losses against the drawn quantities.

use super::canvas::{self, Canvas, Ink, WIDTH_PX};
use super::panel::{BOTTOM_PX, PanelFrame};
use super::picture::Picture;
use crate::words;
use afbc_campaign::statistics::{Share, percentile};
use afbc_campaign::{BINS, CampaignSummary, ContenderSummary, DrawnQuantity, SurvivalCount};
use afbc_drawing::{PlotAxis, Point, Ticks};
use core::ops::Range;

/// Largest number of points of a curve.
const POINTS: usize = 400;
/// Largest number of ticks on the value axis of a distribution, and on each other axis.
const X_TICKS: usize = 12;
const Y_TICKS: usize = 6;
const LINE_PX: f64 = 1.6;
const LEFT_PX: f64 = 62.0;
const MARGIN_PX: f64 = 16.0;
/// Free space at the left edge.
const FREE_PX: f64 = 6.0;
/// Heights of a distribution and of a success panel.
const WIDE_PX: f64 = 330.0;
const PANEL_PX: f64 = 200.0;
/// Size of a distribution's marks.
const MARK_PX: f64 = 4.0;
/// Least distance between marks, and distance below which lines count as coincident.
const APART_PX: f64 = 8.0;
const SAME_PX: f64 = 1.0;
/// Opacity of one interval's area.
const INTERVAL_OPACITY: f64 = 0.15;
/// Approximate opacity of all intervals' areas together.
const INTERVALS_OPACITY: f64 = 0.6;
/// Upper end of the axis of shares \[%\], so that marks at 100 are not cut off.
const TOP: f64 = 104.0;

/// Draws all figures of a campaign; figures without data are left out.
pub(crate) fn draw(summary: &CampaignSummary) -> Vec<Picture> {
    let flights = summary.tallies.first().map_or(0, |tally| tally.count.flights);
    let conditions = format!("{}: {flights} flights each", summary.manifest.name);
    let lost = summary.tallies.iter().any(|tally| tally.count.kept < tally.count.flights);
    let ends = if lost { " A curve ends at the share of flights not lost." } else { "" };
    let errors = DistributionFigure {
        title: "Position error",
        label: "root mean square distance from the reference [m]",
        values: |tally| &tally.rmse_position_m,
    };
    let smoothness = DistributionFigure {
        title: "Smoothness",
        label: "mean |ΔU₄| per step [N]",
        values: |tally| &tally.mean_abs_du4_n,
    };
    let figure = |name, caption, svg: Option<String>| svg.map(|svg| Picture { name, caption, svg, explorable: None });
    let interval = "Pale band: 95 % interval of the share. Mark: end of a curve.";
    let not_lost = if lost { " of the flights that were not lost" } else { " of the flights" };
    let spread = summary.manifest.drawn.iter().any(is_spread) && flights > 0;
    let figures = [
        figure(
            "position-error",
            format!("Share of the flights below each distance from the reference. {interval}{ends}"),
            errors.draw(summary, &conditions),
        ),
        figure(
            "smoothness",
            format!("Share{not_lost} with a mean thrust change below each value. {interval}"),
            smoothness.draw(summary, &conditions),
        ),
        figure(
            "success",
            "Share of flights that were not lost, for each tenth of the drawn values. Bars: 95 % intervals, side by \
             side within a tenth."
                .into(),
            spread.then(|| success(summary, &conditions)),
        ),
    ];
    figures.into_iter().flatten().collect()
}

fn is_spread(drawn: &DrawnQuantity) -> bool {
    drawn.ends[0] < drawn.ends[1]
}

/// Returns the contenders' names with their line styles, in the campaign's order.
fn legend(summary: &CampaignSummary) -> Vec<(String, Ink)> {
    let names: Vec<&str> = summary.tallies.iter().map(|tally| tally.contender.as_str()).collect();
    names.iter().map(|name| (*name).to_owned()).zip(canvas::inks(&names, LINE_PX)).collect()
}

/// Starts a figure whose legend shows each contender's mark.
fn begun(title: &'static str, conditions: &str, legend: &[(String, Ink)]) -> Canvas {
    let mut canvas = Canvas::new(title, conditions, legend);
    for (index, ((_, ink), (x_px, y_px))) in legend.iter().zip(canvas::places(legend)).enumerate() {
        canvas.mark((x_px + 12.0, y_px), index, MARK_PX, ink.color);
    }
    canvas
}

/// A figure of cumulative distributions with a logarithmic value axis.
struct DistributionFigure {
    title: &'static str,
    label: &'static str,
    values: fn(&ContenderSummary) -> &[f64],
}

/// One contender's distribution: a value, and the share of flights below it with the ends of its interval \[%\].
type DistributionCurve = Vec<(f64, [f64; 3])>;

impl DistributionFigure {
    /// Draws the figure; `None` if no flight has a value.
    fn draw(&self, summary: &CampaignSummary, conditions: &str) -> Option<String> {
        let range = self.range(summary)?;
        let curves: Vec<DistributionCurve> =
            summary.tallies.iter().map(|tally| curve((self.values)(tally), &range)).collect();
        let legend = legend(summary);
        let top_px = canvas::head_px(&legend);
        let mut canvas = begun(self.title, conditions, &legend);
        let place_px = [(0.0, top_px + 6.0), (WIDTH_PX - MARGIN_PX, top_px + WIDE_PX)];
        let linear = frame_in(place_px, range, 0.0..TOP);
        let frame = PanelFrame { x: PlotAxis { is_logarithmic: true, ..linear.x }, ..linear };
        let (values, shares) = (frame.x.ticks(X_TICKS), Ticks::linear(0.0, 100.0, Y_TICKS));
        mesh(&mut canvas, &frame, [&values, &shares], [self.label, "flights [%]"]);
        let opacity = INTERVAL_OPACITY.min(INTERVALS_OPACITY / legend.len() as f64);
        for (curve, (_, ink)) in curves.iter().zip(&legend) {
            let high = curve.iter().map(|(value, [_, _, high])| frame.at((*value, *high)));
            let low = curve.iter().rev().map(|(value, [_, low, _])| frame.at((*value, *low)));
            canvas.area(high.chain(low).collect::<Vec<_>>(), ink.color, opacity);
        }
        for (index, (curve, (_, ink))) in curves.iter().zip(&legend).enumerate() {
            // A line that later lines cover is wider, so that it stays visible on both sides of them.
            let hidden = curves.iter().skip(index + 1).filter(|later| coincide(curve, later, &frame.x)).count();
            let ink = Ink { width_px: ink.width_px.max(LINE_PX * (1.0 + 1.5 * hidden as f64)), ..*ink };
            canvas.line(curve.iter().map(|(value, [share, _, _])| frame.at((*value, *share))).collect::<Vec<_>>(), ink);
        }
        let mut ends: Vec<Point> = Vec::new();
        for (index, (curve, (_, ink))) in curves.iter().zip(&legend).enumerate() {
            let Some((value, [share, _, _])) = curve.last() else { continue };
            let (mut x_px, y_px) = frame.at((*value, *share));
            while ends.iter().any(|(x, y)| (x - x_px).abs() < APART_PX && (y - y_px).abs() < APART_PX) {
                x_px -= APART_PX;
            }
            ends.push((x_px, y_px));
            canvas.mark((x_px, y_px), index, MARK_PX, ink.color);
        }
        Some(canvas.svg(top_px + WIDE_PX))
    }

    /// Returns the range from the smallest value to a high percentile; the worst few flights would squeeze the rest.
    fn range(&self, summary: &CampaignSummary) -> Option<Range<f64>> {
        let finite = |tally| (self.values)(tally).iter().filter(is_shown).copied();
        let low = summary.tallies.iter().flat_map(finite).fold(f64::INFINITY, f64::min);
        let high = summary.tallies.iter().filter_map(|tally| percentile(&finite(tally).collect::<Vec<_>>(), 99.5));
        let high = high.fold(0.0, f64::max);
        (low <= high).then_some(0.9 * low..1.1 * high)
    }
}

fn is_shown(value: &&f64) -> bool {
    value.is_finite() && **value > 0.0
}

/// Returns a curve of few points through the distribution of the sorted `values` within `range`.
fn curve(values: &[f64], range: &Range<f64>) -> DistributionCurve {
    let step = (values.len() / POINTS).max(1);
    let ranks = (0..values.len()).filter(|rank| (rank + 1) % step == 0 || rank + 1 == values.len());
    let points = ranks.filter_map(|rank| {
        let value = values.get(rank).copied().filter(|value| range.contains(value))?;
        let Share { value: share, low, high } = Share::of(rank as u64 + 1, values.len() as u64);
        Some((value, [share, low, high].map(|share| 100.0 * share)))
    });
    points.collect()
}

/// Returns true if one curve hides another: they coincide at half of its points or more.
fn coincide(curve: &DistributionCurve, other: &DistributionCurve, axis: &PlotAxis) -> bool {
    let at = |share: f64| other.iter().find(|(_, [of, ..])| *of >= share).map(|(value, _)| axis.at(*value));
    let same =
        |(value, [share, ..]): &&(f64, [f64; 3])| at(*share).is_some_and(|x| (x - axis.at(*value)).abs() < SAME_PX);
    !curve.is_empty() && 2 * curve.iter().filter(same).count() >= curve.len()
}

/// Draws the share of flights not lost against each drawn quantity, one panel per quantity.
fn success(summary: &CampaignSummary, conditions: &str) -> String {
    let legend = legend(summary);
    let panels: Vec<_> = summary.manifest.drawn.iter().enumerate().filter(|(_, drawn)| is_spread(drawn)).collect();
    // Many contenders side by side need wider panels.
    let columns = if legend.len() > 6 { 1 } else { 2 };
    let rows = panels.len().div_ceil(columns);
    let head_px = canvas::head_px(&legend);
    let bottom = lowest(summary);
    let mut canvas = begun("Success", conditions, &legend);
    let width_px = (WIDTH_PX - MARGIN_PX) / columns as f64;
    for (place, (index, drawn)) in panels.iter().enumerate() {
        let (x_px, y_px) = ((place % columns) as f64 * width_px, head_px + (place / columns) as f64 * PANEL_PX);
        let place_px = [(x_px, y_px + 10.0), (x_px + width_px, y_px + PANEL_PX)];
        let bins = summary.tallies.iter().map(|tally| tally.by_draw.get(*index));
        let contenders: Vec<_> = legend.iter().map(|(_, ink)| *ink).zip(bins).collect();
        success_panel(&mut canvas, place_px, drawn, &contenders, bottom);
    }
    canvas.svg(head_px + rows as f64 * PANEL_PX + 8.0)
}

/// Returns the lower end of the axis of shares \[%\], below all intervals.
fn lowest(summary: &CampaignSummary) -> f64 {
    let counts = summary.tallies.iter().flat_map(|tally| tally.by_draw.iter().flatten());
    let low = counts.filter(|count| count.flights > 0).map(|count| count.share().low).fold(1.0, f64::min);
    (10.0 * low).floor().min(9.0) * 10.0
}

/// Draws one panel between two corners; `bottom` is the lower end of its axis.
fn success_panel(
    canvas: &mut Canvas,
    place_px: [Point; 2],
    drawn: &DrawnQuantity,
    contenders: &[(Ink, Option<&[SurvivalCount; BINS]>)],
    bottom: f64,
) {
    let [low, high] = drawn.ends;
    // Leave the same room above 100 as with an axis from 0.
    let top = 100.0 + (TOP - 100.0) * (1.0 - bottom / 100.0);
    let frame = frame_in(place_px, low..high, bottom..top);
    let (values, shares) = (frame.x.ticks(Y_TICKS), Ticks::linear(bottom, 100.0, Y_TICKS));
    mesh(canvas, &frame, [&values, &shares], [&words::drawn(&drawn.name), "not lost [%]"]);
    // The contenders are side by side within each tenth of the range, with a gap to the next tenth.
    let bin_px = (frame.x.to - frame.x.from) / BINS as f64;
    let apart_px = bin_px / (contenders.len() as f64 + 2.0);
    let mark_px = (0.55 * apart_px).clamp(1.5, MARK_PX);
    for (index, (ink, bins)) in contenders.iter().enumerate() {
        let Some(bins) = bins else { continue };
        let x_px = |bin: usize| frame.x.from + bin as f64 * bin_px + (index as f64 + 1.5) * apart_px;
        let flown: Vec<(f64, Share)> = bins
            .iter()
            .enumerate()
            .filter(|(_, count)| count.flights > 0)
            .map(|(bin, count)| (x_px(bin), count.share()))
            .collect();
        let at = |x_px: f64, share: f64| (x_px, frame.y.at(100.0 * share));
        let points: Vec<Point> = flown.iter().map(|(x_px, share)| at(*x_px, share.value)).collect();
        let faint = Ink { width_px: 0.75, opacity: 0.4, ..Ink::new(ink.color, LINE_PX) };
        canvas.line(points.clone(), faint);
        for (x_px, share) in &flown {
            canvas.line([at(*x_px, share.low), at(*x_px, share.high)], Ink::new(ink.color, 1.25));
        }
        for place in points {
            canvas.mark(place, index, mark_px, ink.color);
        }
    }
}

/// Creates a frame between two corners, with room for labels on the left and below.
fn frame_in([(left, top), (right, bottom)]: [Point; 2], x: Range<f64>, y: Range<f64>) -> PanelFrame {
    PanelFrame::new([(left + LEFT_PX, top), (right, bottom - BOTTOM_PX)], x, y)
}

/// Draws axes, grid and labels.
fn mesh(canvas: &mut Canvas, frame: &PanelFrame, [x_ticks, y_ticks]: [&Ticks; 2], [x_title, y_title]: [&str; 2]) {
    frame.grid(canvas, x_ticks, y_ticks);
    frame.bottom(canvas, x_ticks.marks().map(|(value, label)| (value, short(label))), x_title);
    frame.left(canvas, y_ticks, y_title, frame.x.from - LEFT_PX + FREE_PX);
}

/// Removes trailing zeros after the decimal point.
fn short(number: String) -> String {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.').into() } else { number }
}
