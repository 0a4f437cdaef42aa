//! Figures of a campaign: distributions over its flights, and losses against drawn quantities.

use super::canvas::{self, Area, Failure, Ink, WIDTH_PX, marker, text, units};
use super::palette::{BLACK, FRAME, GREY, GRID};
use super::picture::Picture;
use super::ticks::{self, Axis, number};
use crate::words;
use afbc_campaign::statistics::{Share, percentile};
use afbc_campaign::{BINS, Count, Drawn, Summary, Tally};
use core::ops::Range;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use std::io;

/// Largest number of points of a curve.
const POINTS: usize = 400;
/// Largest number of ticks along a distribution, and on each other axis.
const X_TICKS: usize = 12;
const Y_TICKS: usize = 6;
const LINE_PX: f64 = 1.6;
const LEFT_PX: f64 = 62.0;
const BOTTOM_PX: f64 = 42.0;
const MARGIN_PX: f64 = 16.0;
/// Free space at the left edge.
const FREE_PX: f64 = 6.0;
/// Heights of a distribution and of a success panel.
const WIDE_PX: f64 = 330.0;
const PANEL_PX: f64 = 200.0;
/// Size of a distribution's marks.
const MARK_PX: f64 = 4.0;
/// Distance between marks at the same position, and below which lines count as coincident.
const APART_PX: f64 = 8.0;
const SAME_PX: f64 = 1.0;
/// Opacity of an interval.
const INTERVAL_OPACITY: f64 = 0.15;
/// Approximate opacity of all intervals together.
const INTERVALS_OPACITY: f64 = 0.6;
/// Top of the axis of shares \[%\], so that marks at 100 are not cut off.
const TOP: f64 = 104.0;

/// Draws every figure of a campaign; none without flights.
pub(crate) fn draw(summary: &Summary) -> io::Result<Vec<Picture>> {
    let flights = summary.tallies.first().map_or(0, |tally| tally.count.flights);
    let conditions = format!("{}: {flights} flights each", summary.manifest.name);
    let lost = summary.tallies.iter().any(|tally| tally.count.kept < tally.count.flights);
    let ends = if lost { " A curve ends at the share of flights not lost." } else { "" };
    let errors = Distribution {
        title: "Position error",
        label: "root mean square distance from the reference [m]",
        values: |tally| &tally.rmse_position_m,
    };
    let smoothness =
        Distribution {
            title: "Smoothness", label: "mean |ΔU₄| per step [N]", values: |tally| &tally.mean_abs_du4_n
        };
    let figure = |name, caption, svg: Option<String>| svg.map(|svg| Picture { name, caption, svg, explorable: None });
    let interval = "Pale: 95 % interval of the share. Mark: end of a curve.";
    let not_lost = if lost { " of the flights that were not lost" } else { " of the flights" };
    let spread = summary.manifest.drawn.iter().any(is_spread) && flights > 0;
    let figures = [
        figure(
            "position-error",
            format!("Share of the flights below each distance from the reference. {interval}{ends}"),
            errors.draw(summary, &conditions)?,
        ),
        figure(
            "smoothness",
            format!("Share{not_lost} with a mean thrust change below each value. {interval}"),
            smoothness.draw(summary, &conditions)?,
        ),
        figure(
            "success",
            "Share of flights that were not lost, for each tenth of the drawn values. Bars: 95 % intervals, side by \
             side within a tenth."
                .into(),
            spread.then(|| success(summary, &conditions)).transpose()?,
        ),
    ];
    Ok(figures.into_iter().flatten().collect())
}

fn is_spread(drawn: &Drawn) -> bool {
    drawn.ends[0] < drawn.ends[1]
}

/// Returns names with their lines, in the campaign's order.
fn legend(summary: &Summary) -> Vec<(String, Ink)> {
    let names: Vec<&str> = summary.tallies.iter().map(|tally| tally.contender.as_str()).collect();
    names.iter().map(|name| (*name).to_owned()).zip(canvas::inks(&names, LINE_PX)).collect()
}

/// Draws title, conditions, and the legend with each contender's mark.
fn head(area: &Area, title: &str, conditions: &str, legend: &[(String, Ink)]) -> Result<(), Failure> {
    canvas::head(area, title, conditions, legend)?;
    for (index, ((_, ink), (x_px, y_px))) in legend.iter().zip(canvas::places(legend)).enumerate() {
        let place = EmptyElement::at((units(x_px + 12.0), units(y_px)));
        area.draw(&(place + Polygon::new(marker(index, MARK_PX), ink.color.filled())))?;
    }
    Ok(())
}

/// Cumulative distribution over a logarithmic axis.
struct Distribution {
    title: &'static str,
    label: &'static str,
    values: fn(&Tally) -> &[f64],
}

/// One contender's part of a distribution: value and share of flights \[%\] below it, with the ends of its interval.
type Curve = Vec<(f64, [f64; 3])>;

impl Distribution {
    /// Draws the figure, if any flight has a value.
    fn draw(&self, summary: &Summary, conditions: &str) -> io::Result<Option<String>> {
        let Some(range) = self.range(summary) else { return Ok(None) };
        let curves: Vec<Curve> = summary.tallies.iter().map(|tally| curve((self.values)(tally), &range)).collect();
        let plot_px = WIDTH_PX - MARGIN_PX - LEFT_PX;
        let px = |value: f64| libm::log(value / range.start) / libm::log(range.end / range.start) * plot_px;
        let legend = legend(summary);
        let top_px = canvas::head_px(&legend);
        let svg = canvas::svg(top_px + WIDE_PX, self.title, |area| {
            head(area, self.title, conditions, &legend)?;
            let area = area.clone().shrink((0, units(top_px)), (units(WIDTH_PX - MARGIN_PX), units(WIDE_PX)));
            let mut chart = chart_on(&area, 6.0).build_cartesian_2d(
                Axis::logarithmic(range.clone(), X_TICKS),
                Axis::linear(0.0..TOP, ticks::linear(&(0.0..100.0), Y_TICKS).at),
            )?;
            mesh(&mut chart, self.label, "flights [%]", &|x| logarithmic(*x))?;
            let opacity = INTERVAL_OPACITY.min(INTERVALS_OPACITY / legend.len() as f64);
            for (curve, (_, ink)) in curves.iter().zip(&legend) {
                let high = curve.iter().map(|(value, [_, _, high])| (*value, *high));
                let low = curve.iter().rev().map(|(value, [_, low, _])| (*value, *low));
                let interval = high.chain(low).collect::<Vec<_>>();
                chart.draw_series([Polygon::new(interval, ink.color.mix(opacity).filled())])?;
            }
            for (index, (curve, (_, ink))) in curves.iter().zip(&legend).enumerate() {
                // A line hidden by later ones is wider, to be visible on both sides of them.
                let hidden = curves.iter().skip(index + 1).filter(|later| coincide(curve, later, px)).count();
                let ink = Ink { width_px: ink.width_px.max(LINE_PX * (1.0 + 1.5 * hidden as f64)), ..*ink };
                let points: Vec<_> = curve.iter().map(|(value, [share, _, _])| (*value, *share)).collect();
                chart.draw_series([PathElement::new(points, ink.style())])?;
            }
            let mut ends: Vec<(f64, f64)> = Vec::new();
            for (index, (curve, (_, ink))) in curves.iter().zip(&legend).enumerate() {
                let Some((value, [share, _, _])) = curve.last() else { continue };
                let (mut x_px, y_px) = (px(*value), share / TOP * WIDE_PX);
                while ends.iter().any(|(x, y)| (x - x_px).abs() < APART_PX && (y - y_px).abs() < APART_PX) {
                    x_px -= APART_PX;
                }
                ends.push((x_px, y_px));
                let place = (value * libm::pow(range.end / range.start, (x_px - px(*value)) / plot_px), *share);
                let mark = Polygon::new(marker(index, MARK_PX), ink.color.filled());
                chart.draw_series([EmptyElement::at(place) + mark])?;
            }
            Ok(())
        });
        svg.map(Some)
    }

    /// Returns the range from the smallest value to a high percentile: the worst few would squeeze the rest.
    fn range(&self, summary: &Summary) -> Option<Range<f64>> {
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
fn curve(values: &[f64], range: &Range<f64>) -> Curve {
    let step = (values.len() / POINTS).max(1);
    let ranks = (0..values.len()).filter(|rank| (rank + 1) % step == 0 || rank + 1 == values.len());
    let points = ranks.filter_map(|rank| {
        let value = values.get(rank).copied().filter(|value| range.contains(value))?;
        let Share { value: share, low, high } = Share::of(rank as u64 + 1, values.len() as u64);
        Some((value, [share, low, high].map(|share| 100.0 * share)))
    });
    points.collect()
}

/// True if one curve hides another: they coincide at half of its points or more.
fn coincide(curve: &Curve, other: &Curve, px: impl Fn(f64) -> f64) -> bool {
    let at = |share: f64| other.iter().find(|(_, [of_other, _, _])| *of_other >= share).map(|(value, _)| px(*value));
    let same = |(value, [share, _, _]): &&(f64, [f64; 3])| at(*share).is_some_and(|x| (x - px(*value)).abs() < SAME_PX);
    !curve.is_empty() && 2 * curve.iter().filter(same).count() >= curve.len()
}

/// Draws the share of flights not lost against each drawn quantity, a panel for each.
fn success(summary: &Summary, conditions: &str) -> io::Result<String> {
    let legend = legend(summary);
    let title = "Success";
    let panels: Vec<_> = summary.manifest.drawn.iter().enumerate().filter(|(_, drawn)| is_spread(drawn)).collect();
    // Many contenders side by side need more room.
    let columns = if legend.len() > 6 { 1 } else { 2 };
    let rows = panels.len().div_ceil(columns);
    let head_px = canvas::head_px(&legend);
    let bottom = lowest(summary);
    canvas::svg(head_px + rows as f64 * PANEL_PX + 8.0, title, |area| {
        head(area, title, conditions, &legend)?;
        let width_px = (WIDTH_PX - MARGIN_PX) / columns as f64;
        for (place, (index, drawn)) in panels.iter().enumerate() {
            let (column, row) = (place % columns, place / columns);
            let (x_px, y_px) = (column as f64 * width_px, head_px + row as f64 * PANEL_PX);
            let panel = area.clone().shrink((units(x_px), units(y_px)), (units(width_px), units(PANEL_PX)));
            let bins = summary.tallies.iter().map(|tally| tally.by_draw.get(*index));
            let contenders: Vec<_> = legend.iter().map(|(_, ink)| *ink).zip(bins).collect();
            success_panel(&panel, drawn, &contenders, bottom, width_px - LEFT_PX)?;
        }
        Ok(())
    })
}

/// Returns the lower end of the axis of shares \[%\]: below all intervals.
fn lowest(summary: &Summary) -> f64 {
    let counts = summary.tallies.iter().flat_map(|tally| tally.by_draw.iter().flatten());
    let low = counts.filter(|count| count.flights > 0).map(|count| count.share().low).fold(1.0, f64::min);
    (10.0 * low).floor().min(9.0) * 10.0
}

/// Draws one panel, `plot_px` wide, with `bottom` as the lower end of its axis.
fn success_panel(
    area: &Area,
    drawn: &Drawn,
    contenders: &[(Ink, Option<&[Count; BINS]>)],
    bottom: f64,
    plot_px: f64,
) -> Result<(), Failure> {
    let [low, high] = drawn.ends;
    // As much room above 100 as with an axis from 0.
    let top = 100.0 + (TOP - 100.0) * (1.0 - bottom / 100.0);
    let values = ticks::linear(&(low..high), Y_TICKS);
    let mut chart = chart_on(area, 10.0).build_cartesian_2d(
        Axis::linear(low..high, values.at),
        Axis::linear(bottom..top, ticks::linear(&(bottom..100.0), Y_TICKS).at),
    )?;
    mesh(&mut chart, &words::drawn(&drawn.name), "not lost [%]", &|x| short(*x, values.decimals))?;
    // Side by side within a tenth of the range, with a gap to the next.
    let bin_px = plot_px / BINS as f64;
    let apart_px = bin_px / (contenders.len() as f64 + 2.0);
    let mark_px = (0.55 * apart_px).clamp(1.5, MARK_PX);
    for (index, (ink, bins)) in contenders.iter().enumerate() {
        let Some(bins) = bins else { continue };
        let beside = (index as f64 + 1.5) * apart_px / bin_px;
        let flown: Vec<(f64, Share)> = bins
            .iter()
            .enumerate()
            .filter(|(_, count)| count.flights > 0)
            .map(|(bin, count)| (low + (bin as f64 + beside) / BINS as f64 * (high - low), count.share()))
            .collect();
        let points: Vec<_> = flown.iter().map(|(x, share)| (*x, 100.0 * share.value)).collect();
        let faint = Ink { width_px: 0.75, opacity: 0.4, ..Ink::new(ink.color, LINE_PX) };
        chart.draw_series([PathElement::new(points.clone(), faint.style())])?;
        let bar = Ink::new(ink.color, 1.25).style();
        let ends = |(x, share): &(f64, Share)| [(*x, 100.0 * share.low), (*x, 100.0 * share.high)];
        chart.draw_series(flown.iter().map(|at| PathElement::new(ends(at), bar)))?;
        let mark = || Polygon::new(marker(index, mark_px), ink.color.filled());
        chart.draw_series(points.iter().map(|&at| EmptyElement::at(at) + mark()))?;
    }
    Ok(())
}

/// Creates a chart with room for labels on the left and below.
fn chart_on<'a, 'b>(area: &'a Area<'b>, top_px: f64) -> ChartBuilder<'a, 'b, SVGBackend<'b>> {
    let mut chart = ChartBuilder::on(area);
    chart
        .margin_left(units(FREE_PX))
        .set_label_area_size(LabelAreaPosition::Left, units(LEFT_PX - FREE_PX))
        .set_label_area_size(LabelAreaPosition::Bottom, units(BOTTOM_PX))
        .margin_top(units(top_px));
    chart
}

/// Draws frame, grid and labels of a chart.
fn mesh(
    chart: &mut ChartContext<'_, SVGBackend<'_>, Cartesian2d<Axis, Axis>>,
    x_label: &str,
    y_label: &str,
    format: &dyn Fn(&f64) -> String,
) -> Result<(), Failure> {
    chart
        .configure_mesh()
        .x_labels(X_TICKS)
        .y_labels(X_TICKS)
        .max_light_lines(0)
        .bold_line_style(Ink::new(GRID, 0.75).style())
        .light_line_style(Ink::new(GRID, 0.25).style())
        .axis_style(Ink::new(FRAME, 0.75).style())
        .label_style(text(11.0, GREY, HPos::Center))
        .axis_desc_style(text(12.0, BLACK, HPos::Center))
        .x_label_formatter(format)
        .y_label_formatter(&|share| number(*share, 0))
        .set_all_tick_mark_size(units(3.0))
        .x_desc(x_label)
        .y_desc(y_label)
        .draw()
}

/// Formats a number on a logarithmic axis, without rounding errors of the logarithm.
fn logarithmic(x: f64) -> String {
    let power = libm::floor(libm::log10(x));
    short(x, (1.0 - power).clamp(0.0, 9.0) as usize)
}

/// Formats a number without trailing zeros.
fn short(x: f64, decimals: usize) -> String {
    let text = number(x, decimals);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
