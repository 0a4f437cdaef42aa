//! Panels above each other with a common time axis.

use super::canvas::{self, Area, Failure, Ink, WIDTH_PX, text, units};
use super::marks::{LABEL_PX, Mark, Marks};
use super::palette::{self, BLACK, EDGE, FRAME, GREY, GRID};
use super::picture::{CROSS, Picture};
use super::reduce::{clip, envelope, simplify};
use super::ticks::{self, Axis, number};
use crate::explore::{Explorable, ExplorableChart, LegendEntry, Span, TracePanel};
use core::ops::Range;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use std::io;

/// Width left of the panels, for label and numbers.
const LEFT_PX: f64 = 74.0;
/// Free part of that width.
const MARGIN_PX: f64 = 6.0;
const RIGHT_PX: f64 = 16.0;
/// Height of one panel, including the space between panels.
const PANEL_PX: f64 = 148.0;
const GAP_PX: f64 = 12.0;
/// Height below the panels, for numbers and label of the time axis.
const BOTTOM_PX: f64 = 42.0;
const LANE_PX: f64 = 16.0;
/// Width of a panel's plot.
pub(super) const PLOT_PX: f64 = WIDTH_PX - LEFT_PX - RIGHT_PX;

/// Largest number of ticks on each axis.
const T_TICKS: usize = 13;
const Y_TICKS: usize = 6;

/// How far a page's reader can zoom until points become visible.
const ZOOM: f64 = 2.0;
/// Width that lines are reduced for.
pub(super) const FINE_PX: f64 = ZOOM * PLOT_PX;

/// Smallest room below and above the values, in the panel's unit.
const LEAST_ROOM: f64 = 5e-3;
/// Line of a gust's onset, and of the ends of a band.
const ONSET: Ink = Ink::new(EDGE, 0.75);
const BAND_END: Ink = Ink { opacity: 0.5, ..ONSET };
/// Opacity of a band.
const BAND_OPACITY: f64 = 0.6;

/// A value over time.
pub(super) struct Line {
    pub(super) ink: Ink,
    /// Points with increasing time, reduced for [`FINE_PX`].
    pub(super) points: Vec<(f64, f64)>,
    /// Time at which the vehicle was lost, if it was.
    pub(super) lost_s: Option<f64>,
    /// True for a reference, which does not extend the axis by itself.
    pub(super) is_reference: bool,
}

/// A panel with one quantity.
pub(super) struct Panel {
    pub(super) label: &'static str,
    /// Whether to draw a line at zero.
    pub(super) zero: bool,
    /// Lines from back to front.
    pub(super) lines: Vec<Line>,
}

impl Panel {
    /// True if a line fills a band: in at least a twentieth of the columns it oscillates by several of its own widths.
    pub(super) fn has_chatter(&self, end_s: f64) -> bool {
        let range = range(&self.lines, LEAST_ROOM);
        let tall = 4.0 / (PANEL_PX - GAP_PX) * (range.end - range.start);
        self.lines.iter().any(|line| {
            let column = |t: f64| (t / end_s * line.ink.columns(PLOT_PX)).floor();
            let columns = line.points.chunk_by(|a, b| column(a.0) == column(b.0));
            let height = |points: &[(f64, f64)]| {
                let values = || points.iter().map(|(_, v)| v.clamp(range.start, range.end));
                values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
            };
            let (tall, all) =
                columns.fold((0, 0), |(n, all), points| (n + usize::from(height(points) > tall), all + 1));
            20 * tall > all
        })
    }
}

/// A whole figure.
pub(super) struct Chart<'a> {
    pub(super) title: &'a str,
    pub(super) conditions: &'a str,
    /// Events that are marked, for the width of a plot.
    pub(super) marks: Marks,
    pub(super) end_s: f64,
    pub(super) legend: Vec<(String, Ink)>,
    pub(super) panels: Vec<Panel>,
}

impl Chart<'_> {
    /// Returns the figure; to its caption, what is in it besides lines is added.
    pub(super) fn picture(&self, name: &'static str, caption: &str) -> io::Result<Picture> {
        let (svg, words) = (self.svg(&self.marks)?, self.words());
        let explorable = Some(Explorable::Chart(self.explorable()));
        Ok(Picture { name, caption: format!("{caption}{words}"), svg, explorable })
    }

    /// Explains everything in the figure besides lines.
    fn words(&self) -> String {
        let marks = &self.marks;
        let mut all = marks.gusts.iter().chain(&marks.changes);
        let mut words = String::new();
        if !marks.gusts.is_empty() {
            words += marks.onset;
        }
        if all.any(|mark| mark.is_band) {
            words += " Shaded: duration of the event named above.";
        }
        let losses = |panel: &Panel| {
            let range = range(&panel.lines, LEAST_ROOM);
            let lost = panel.lines.iter().filter(|line| line.lost_s.is_some() && !line.is_reference);
            let ends: Vec<_> = lost.filter_map(|line| line.points.last()).map(|(_, v)| range.contains(v)).collect();
            ends
        };
        let within: Vec<bool> = self.panels.iter().flat_map(losses).collect();
        if within.contains(&true) {
            words += CROSS;
        }
        if within.contains(&false) {
            words += " Arrow: a vehicle was lost beyond the panel.";
        }
        words
    }

    /// Returns the same chart for a page's script.
    fn explorable(&self) -> ExplorableChart {
        let legend = self.legend.iter().map(|(name, ink)| LegendEntry { name: name.clone(), pen: ink.pen() });
        let panel = |panel: &Panel| {
            let range = range(&panel.lines, LEAST_ROOM);
            let label = panel.label.to_owned();
            let mut traced = TracePanel { label, low: range.start, high: range.end, traces: Vec::new() };
            let scale = (ZOOM * PLOT_PX / self.end_s, ZOOM * (PANEL_PX - GAP_PX) / (range.end - range.start));
            for line in &panel.lines {
                // A pale line without a name of its own belongs to the law of its colour.
                let entry = self.legend.iter().position(|(_, ink)| *ink == line.ink);
                let entry = entry.or_else(|| self.legend.iter().position(|(_, ink)| ink.color == line.ink.color));
                traced.add(entry, line.ink.pen(), &simplify(&line.points, scale, 0.2), self.end_s);
            }
            traced
        };
        let span = |mark: &Mark| Span {
            label: mark.label.clone(),
            start_s: mark.start_s,
            end_s: if mark.is_band { mark.end_s } else { mark.start_s },
            colors: palette::both(mark.tint),
        };
        ExplorableChart {
            title: self.title.to_owned(),
            end_s: self.end_s,
            legend: legend.collect(),
            panels: self.panels.iter().map(panel).collect(),
            spans: self.marks.changes.iter().chain(&self.marks.gusts).map(span).collect(),
        }
    }

    fn svg(&self, marks: &Marks) -> io::Result<String> {
        let head_px = canvas::head_px(&self.legend);
        let lanes_px = marks.lanes as f64 * LANE_PX;
        let height_px = head_px + lanes_px + self.panels.len() as f64 * PANEL_PX + BOTTOM_PX;
        canvas::svg(height_px, self.title, |area| {
            canvas::head(area, self.title, self.conditions, &self.legend)?;
            let top_px = head_px + lanes_px;
            for (i, panel) in self.panels.iter().enumerate() {
                let y_px = top_px + i as f64 * PANEL_PX;
                let last = i + 1 == self.panels.len();
                self.panel(area, panel, y_px, marks, last)?;
            }
            labels(area, marks, self.end_s, top_px)
        })
    }

    /// Draws one panel with its top at `y_px`; the last one carries the time axis.
    fn panel(&self, area: &Area, panel: &Panel, y_px: f64, marks: &Marks, last: bool) -> Result<(), Failure> {
        let plot_height_px = PANEL_PX - GAP_PX;
        let bottom_px = if last { BOTTOM_PX } else { 0.0 };
        let area =
            area.clone().shrink((0, units(y_px)), (units(WIDTH_PX - RIGHT_PX), units(plot_height_px + bottom_px)));
        let range = range(&panel.lines, LEAST_ROOM);
        let (low, high) = (range.start, range.end);
        let (times, values) = (ticks::linear(&(0.0..self.end_s), T_TICKS), ticks::linear(&range, Y_TICKS));
        let (decimals, time_decimals) = (values.decimals, times.decimals);
        let mut chart = ChartBuilder::on(&area)
            .margin_left(units(MARGIN_PX))
            .set_label_area_size(LabelAreaPosition::Left, units(LEFT_PX - MARGIN_PX))
            .set_label_area_size(LabelAreaPosition::Bottom, units(bottom_px))
            .build_cartesian_2d(Axis::linear(0.0..self.end_s, times.at), Axis::linear(range, values.at))?;

        let line = |from, to, ink: Ink| PathElement::new([from, to], ink.style());
        let bands = || marks.changes.iter().chain(&marks.gusts).filter(|mark| mark.is_band);
        let shade = |mark: &Mark| mark.tint.mix(BAND_OPACITY).filled();
        chart.draw_series(bands().map(|m| Rectangle::new([(m.start_s, low), (m.end_s, high)], shade(m))))?;
        let ends = bands().flat_map(|mark| [mark.start_s, mark.end_s]).filter(|t| *t > 0.0 && *t < self.end_s);
        chart.draw_series(ends.map(|t| line((t, low), (t, high), BAND_END)))?;

        let axis = Ink::new(FRAME, 0.75).style();
        chart
            .configure_mesh()
            .x_labels(T_TICKS)
            .y_labels(Y_TICKS)
            .max_light_lines(0)
            .bold_line_style(Ink::new(GRID, 0.75).style())
            .light_line_style(Ink::new(GRID, 0.25).style())
            .axis_style(axis)
            .label_style(text(11.0, GREY, HPos::Center))
            .axis_desc_style(text(12.0, BLACK, HPos::Center))
            .x_label_formatter(&|t| number(*t, time_decimals))
            .y_label_formatter(&|v| number(*v, decimals))
            .set_all_tick_mark_size(units(3.0))
            .x_desc(if last { "t [s]" } else { "" })
            .y_desc(panel.label)
            .draw()?;

        chart.draw_series([Rectangle::new([(0.0, low), (self.end_s, high)], axis)])?;
        if panel.zero && low < 0.0 && 0.0 < high {
            chart.draw_series([line((0.0, 0.0), (self.end_s, 0.0), Ink::new(FRAME, 0.75))])?;
        }
        chart.draw_series(marks.gusts.iter().map(|gust| line((gust.start_s, low), (gust.start_s, high), ONSET)))?;

        let scale = (PLOT_PX / self.end_s, plot_height_px / (high - low));
        for Line { ink, points, lost_s, is_reference } in &panel.lines {
            let pieces = clip(&envelope(points.iter().copied(), self.end_s, ink.columns(PLOT_PX)), low, high);
            chart.draw_series(pieces.iter().map(|piece| PathElement::new(simplify(piece, scale, 0.2), ink.style())))?;
            if let (Some(_), false, Some(&(t, v))) = (lost_s, is_reference, points.last()) {
                let style = Ink::new(ink.color, 2.0).style();
                // Beyond the panel the position is written: a cross at the edge would mark a wrong one.
                let beyond = |arrow, edge| {
                    let words = format!("{arrow} {} ", number(v, decimals));
                    Text::new(words, (t, edge), text(LABEL_PX, ink.color, HPos::Right))
                };
                let edge = LABEL_PX * (high - low) / plot_height_px;
                match v {
                    v if v > high => drop(chart.draw_series([beyond('↑', high - edge)])?),
                    v if v < low => drop(chart.draw_series([beyond('↓', low + edge)])?),
                    _ => drop(chart.draw_series([Cross::new((t, v), units(4.0), style)])?),
                }
            }
        }
        Ok(())
    }
}

/// Draws the labels of the marks on their bands, above the panels.
fn labels(area: &Area, marks: &Marks, end_s: f64, top_px: f64) -> Result<(), Failure> {
    for mark in marks.gusts.iter().chain(&marks.changes) {
        let bottom_px = top_px - 3.0 - mark.lane as f64 * LANE_PX;
        if mark.is_band {
            let x = |t: f64| units(LEFT_PX + t / end_s * PLOT_PX);
            let corners = [(x(mark.start_s), units(bottom_px - LANE_PX + 2.0)), (x(mark.end_s), units(bottom_px))];
            area.draw(&Rectangle::new(corners, mark.tint.filled()))?;
        }
        let place = (units(LEFT_PX + mark.label_px), units(bottom_px - 0.5 * LANE_PX + 1.0));
        area.draw(&Text::new(mark.label.clone(), place, text(LABEL_PX, GREY, HPos::Center)))?;
    }
    Ok(())
}

/// Returns the range of a panel: all of every flight. A lost flight extends it to at most three times the others'
/// range, and counts until shortly before its end; if all are lost, their range is not limited.
pub(super) fn range(lines: &[Line], least_room: f64) -> Range<f64> {
    let all = extent(lines.iter());
    let survived = lines.iter().any(|line| line.lost_s.is_none() && !line.is_reference);
    let others = extent(lines.iter().filter(|line| line.lost_s.is_none()));
    let (low, high) = match (all, others) {
        (Some(all), Some((low, high))) if survived => {
            let span = high - low;
            (all.0.max(low - span), all.1.min(high + span))
        }
        (all, _) => all.unwrap_or_default(),
    };
    // Room above and below, also for a constant.
    let room = (0.06 * (high - low)).max(1e-3 * low.abs().max(high.abs())).max(least_room);
    low - room..high + room
}

/// Returns the smallest and largest value of some lines, if there are any.
fn extent<'a>(lines: impl Iterator<Item = &'a Line>) -> Option<(f64, f64)> {
    let mut extent = None;
    for line in lines {
        // Until one second before the end, or a tenth for a short flight.
        let until_s = line.lost_s.map_or(f64::INFINITY, |lost_s| lost_s - (0.1 * lost_s).min(1.0));
        for &(_, v) in line.points.iter().filter(|(t, _)| *t <= until_s) {
            let (low, high) = extent.unwrap_or((v, v));
            extent = Some((v.min(low), v.max(high)));
        }
    }
    extent
}
