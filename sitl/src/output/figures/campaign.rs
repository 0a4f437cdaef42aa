//! Figures of a whole campaign: distributions over its flights, and what its losses hang on.

use super::canvas::{self, Area, FRAME, Failure, GREY, GRID, Ink, WIDTH_PX, text, units};
use super::time_chart::{decimals, number};
use super::{Figure, color};
use crate::campaign::statistics::percentile;
use crate::campaign::{BINS, Count, Drawn, Summary, Tally};
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use std::io;

/// Points of one curve at most.
const POINTS: usize = 400;
const LINE_PX: f64 = 1.6;
const LEFT_PX: f64 = 62.0;
const BOTTOM_PX: f64 = 42.0;
const MARGIN_PX: f64 = 16.0;
/// What of the left is free.
const FREE_PX: f64 = 6.0;
/// Height of a distribution, and of one of the panels side by side.
const WIDE_PX: f64 = 330.0;
const PANEL_PX: f64 = 200.0;

/// Draws every figure of a campaign.
pub(in crate::output) fn draw(summary: &Summary) -> io::Result<Vec<Figure>> {
    let flights = summary.tallies.first().map_or(0, |tally| tally.count.flights);
    let conditions = format!("{}: {flights} flights each", summary.manifest.name);
    let distribution =
        |title, label, values: fn(&Tally) -> &[f64]| distribution(summary, title, &conditions, label, values);
    let mut figures = vec![
        Figure {
            name: "position-error",
            caption:
                "How many flights stayed below which distance from the reference. A curve ends where the flights do \
                      that were not lost."
                    .into(),
            svg: distribution("Position error", "root mean square distance from the reference [m]", |tally| {
                &tally.rmse_position_m
            })?,
        },
        Figure {
            name: "smoothness",
            caption: "How many of the flights that were not lost kept the thrust command smoother than what.".into(),
            svg: distribution("Smoothness", "mean |ΔU₄| per step [N]", |tally| &tally.mean_abs_du4_n)?,
        },
    ];
    if summary.manifest.drawn.iter().any(is_spread) {
        figures.push(Figure {
            name: "success",
            caption: "Share of flights that were not lost, for each tenth of what was drawn.".into(),
            svg: success(summary, &conditions)?,
        });
    }
    Ok(figures)
}

fn is_spread(drawn: &Drawn) -> bool {
    drawn.ends[0] < drawn.ends[1]
}

fn inks() -> impl Iterator<Item = Ink> {
    (0..).map(|index| Ink { color: color(index), width_px: LINE_PX })
}

fn legend(summary: &Summary) -> Vec<(String, Ink)> {
    summary.tallies.iter().map(|tally| tally.contender.clone()).zip(inks()).collect()
}

/// Empirical distribution functions over a logarithmic axis.
fn distribution(
    summary: &Summary,
    title: &str,
    conditions: &str,
    label: &str,
    values: fn(&Tally) -> &[f64],
) -> io::Result<String> {
    let positive = |value: &&f64| value.is_finite() && **value > 0.0;
    let all = || summary.tallies.iter().flat_map(|tally| values(tally).iter().filter(positive));
    // From the smallest value to what all but the worst few stay below: the very worst would squeeze the rest.
    let low = all().copied().fold(f64::INFINITY, f64::min);
    let high = summary.tallies.iter().filter_map(|tally| {
        let finite: Vec<f64> = values(tally).iter().filter(positive).copied().collect();
        percentile(&finite, 99.5)
    });
    let high = high.fold(0.0, f64::max);
    let range = if low < high { 0.9 * low..1.1 * high } else { 1e-3..1.0 };

    let legend = legend(summary);
    let top_px = canvas::head_px(&legend);
    canvas::svg(top_px + WIDE_PX, title, |area| {
        canvas::head(area, title, conditions, &legend)?;
        let area = area.clone().shrink((0, units(top_px)), (units(WIDTH_PX - MARGIN_PX), units(WIDE_PX)));
        let mut chart = ChartBuilder::on(&area)
            .margin_left(units(FREE_PX))
            .set_label_area_size(LabelAreaPosition::Left, units(LEFT_PX - FREE_PX))
            .set_label_area_size(LabelAreaPosition::Bottom, units(BOTTOM_PX))
            .margin_top(units(6.0))
            .build_cartesian_2d(range.clone().log_scale(), 0.0..100.0_f64)?;
        mesh(&mut chart, label, "flights [%]", 12, &|x| logarithmic(*x))?;
        for (tally, ink) in summary.tallies.iter().zip(inks()) {
            let values = values(tally);
            let step = (values.len() / POINTS).max(1);
            let shares = (0..values.len()).filter(|rank| (rank + 1) % step == 0 || rank + 1 == values.len());
            let points = shares.filter_map(|rank| {
                let value = values.get(rank).copied().filter(|value| range.contains(value))?;
                Some((value, 100.0 * (rank + 1) as f64 / values.len() as f64))
            });
            chart.draw_series([PathElement::new(points.collect::<Vec<_>>(), ink.style())])?;
        }
        Ok(())
    })
}

/// Share of flights that were not lost against every drawn quantity: two panels side by side.
fn success(summary: &Summary, conditions: &str) -> io::Result<String> {
    let legend = legend(summary);
    let title = "Success";
    let panels: Vec<_> = summary.manifest.drawn.iter().enumerate().filter(|(_, drawn)| is_spread(drawn)).collect();
    let rows = panels.len().div_ceil(2);
    let head_px = canvas::head_px(&legend);
    canvas::svg(head_px + rows as f64 * PANEL_PX + 8.0, title, |area| {
        canvas::head(area, title, conditions, &legend)?;
        let width_px = (WIDTH_PX - MARGIN_PX) / 2.0;
        for (place, (index, drawn)) in panels.iter().enumerate() {
            let (x_px, y_px) = ((place % 2) as f64 * width_px, head_px + (place / 2) as f64 * PANEL_PX);
            let panel = area.clone().shrink((units(x_px), units(y_px)), (units(width_px), units(PANEL_PX)));
            success_panel(&panel, summary, *index, drawn)?;
        }
        Ok(())
    })
}

fn success_panel(area: &Area, summary: &Summary, index: usize, drawn: &Drawn) -> Result<(), Failure> {
    let [low, high] = drawn.ends;
    let mut chart = ChartBuilder::on(area)
        .margin_left(units(FREE_PX))
        .set_label_area_size(LabelAreaPosition::Left, units(LEFT_PX - FREE_PX))
        .set_label_area_size(LabelAreaPosition::Bottom, units(BOTTOM_PX))
        .margin_top(units(10.0))
        .build_cartesian_2d(low..high, 0.0..100.0_f64)?;
    let digits = decimals((high - low) / 5.0);
    mesh(&mut chart, &drawn.name, "not lost [%]", 6, &|x| short(*x, digits))?;
    for (tally, ink) in summary.tallies.iter().zip(inks()) {
        let Some(bins) = tally.by_draw.get(index) else { continue };
        let centre = |bin: usize| low + (bin as f64 + 0.5) / BINS as f64 * (high - low);
        let flown = bins.iter().enumerate().filter(|(_, count)| count.flights > 0);
        let points: Vec<_> =
            flown.map(|(bin, count): (_, &Count)| (centre(bin), 100.0 * count.share().value)).collect();
        chart.draw_series(points.iter().map(|&at| Circle::new(at, units(2.0), ink.color.filled())))?;
        chart.draw_series([PathElement::new(points, ink.style())])?;
    }
    Ok(())
}

/// Frame, grid and words of a chart.
fn mesh<X: Ranged<ValueType = f64> + ValueFormatter<f64>>(
    chart: &mut ChartContext<'_, SVGBackend<'_>, Cartesian2d<X, RangedCoordf64>>,
    x_label: &str,
    y_label: &str,
    x_ticks: usize,
    format: &dyn Fn(&f64) -> String,
) -> Result<(), Failure> {
    chart
        .configure_mesh()
        .x_labels(x_ticks)
        .y_labels(6)
        .max_light_lines(0)
        .bold_line_style(Ink { color: GRID, width_px: 0.75 }.style())
        .axis_style(Ink { color: FRAME, width_px: 0.75 }.style())
        .label_style(text(11.0, GREY, HPos::Center))
        .axis_desc_style(text(12.0, canvas::BLACK, HPos::Center))
        .x_label_formatter(format)
        .y_label_formatter(&|share| number(*share, 0))
        .set_all_tick_mark_size(units(3.0))
        .x_desc(x_label)
        .y_desc(y_label)
        .draw()
}

/// A number on a logarithmic axis, free of what the logarithm left behind the second digit.
fn logarithmic(x: f64) -> String {
    let power = libm::floor(libm::log10(x));
    short(x, (1.0 - power).clamp(0.0, 9.0) as usize)
}

/// A number without zeros that say nothing.
fn short(x: f64, decimals: usize) -> String {
    let text = number(x, decimals);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
