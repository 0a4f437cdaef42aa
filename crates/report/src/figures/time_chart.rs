//! Figures of panels above each other with a common time axis.

use super::canvas::{self, Canvas, Ink, WIDTH_PX};
use super::marks::{LABEL_PX, TimeMark, TimeMarks};
use super::palette::{self, EDGE, GREY};
use super::panel::{BOTTOM_PX, FRAME_INK, PanelFrame};
use super::picture::{CROSS, Picture};
use super::reduce::{clip, envelope, simplify};
use crate::explore::{Explorable, ExplorableChart, LegendEntry, TimeSpan, TracePanel};
use afbc_drawing::TextAnchor;
use core::ops::Range;

/// Width on the left of the panels, for labels and numbers.
const LEFT_PX: f64 = 74.0;
/// Part of [`LEFT_PX`] that stays free.
const MARGIN_PX: f64 = 6.0;
const RIGHT_PX: f64 = 16.0;
/// Height of one panel, including the space between panels.
const PANEL_PX: f64 = 148.0;
const GAP_PX: f64 = 12.0;
const LANE_PX: f64 = 16.0;
/// Width of a panel's plot.
pub(super) const PLOT_PX: f64 = WIDTH_PX - LEFT_PX - RIGHT_PX;

/// Largest number of ticks on each axis.
const T_TICKS: usize = 13;
const Y_TICKS: usize = 6;

/// Factor by which a reader can zoom in before single points become visible.
const ZOOM: f64 = 2.0;
/// Width in pixels for which lines are reduced.
pub(super) const FINE_PX: f64 = ZOOM * PLOT_PX;

/// Smallest margin below and above the values, in the panel's unit.
const LEAST_ROOM: f64 = 5e-3;
/// Line styles of a gust's onset, and of the ends of a band.
const ONSET: Ink = Ink::new(EDGE, 0.75);
const BAND_END: Ink = Ink { opacity: 0.5, ..ONSET };
/// Opacity of a band.
const BAND_OPACITY: f64 = 0.6;

/// A value over time.
pub(super) struct ChartLine {
    pub(super) ink: Ink,
    /// Points with increasing time, reduced for [`FINE_PX`].
    pub(super) points: Vec<(f64, f64)>,
    /// Time at which the vehicle was lost, if it was.
    pub(super) lost_s: Option<f64>,
    /// True for a reference: it does not count as a surviving vehicle and never gets a cross.
    pub(super) is_reference: bool,
}

/// A panel with one quantity.
pub(super) struct ChartPanel {
    pub(super) label: &'static str,
    /// Whether to draw a line at zero.
    pub(super) zero: bool,
    /// Lines from back to front.
    pub(super) lines: Vec<ChartLine>,
}

impl ChartPanel {
    /// Returns true if a line chatters so much that it fills a band: in at least a twentieth of the columns, its height
    /// is several line widths.
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
pub(super) struct TimeChart<'a> {
    pub(super) title: &'static str,
    pub(super) conditions: &'a str,
    /// Events to mark, laid out for the width of a plot.
    pub(super) marks: TimeMarks,
    pub(super) end_s: f64,
    pub(super) legend: Vec<(String, Ink)>,
    pub(super) panels: Vec<ChartPanel>,
}

impl TimeChart<'_> {
    /// Returns the figure; its caption is completed by an explanation of the marks.
    pub(super) fn picture(&self, name: &'static str, caption: &str) -> Picture {
        let (svg, words) = (self.svg(), self.words());
        let explorable = Some(Explorable::Chart(self.explorable()));
        Picture { name, caption: format!("{caption}{words}"), svg, explorable }
    }

    /// Explains everything in the figure except lines.
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
        let losses = |panel: &ChartPanel| {
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

    /// Returns the same chart for the page's script.
    fn explorable(&self) -> ExplorableChart {
        let legend = self.legend.iter().map(|(name, ink)| LegendEntry { name: name.clone(), pen: ink.pen() });
        let panel = |panel: &ChartPanel| {
            let range = range(&panel.lines, LEAST_ROOM);
            let label = panel.label.to_owned();
            let mut traced = TracePanel { label, low: range.start, high: range.end, traces: Vec::new() };
            let scale = (ZOOM * PLOT_PX / self.end_s, ZOOM * (PANEL_PX - GAP_PX) / (range.end - range.start));
            for line in &panel.lines {
                // A pale line without its own legend entry belongs to the law with the same colour.
                let entry = self.legend.iter().position(|(_, ink)| *ink == line.ink);
                let entry = entry.or_else(|| self.legend.iter().position(|(_, ink)| ink.color == line.ink.color));
                traced.add(entry, line.ink.pen(), &simplify(&line.points, scale, 0.2), self.end_s);
            }
            traced
        };
        let span = |mark: &TimeMark| TimeSpan {
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

    fn svg(&self) -> String {
        let mut canvas = Canvas::new(self.title, self.conditions, &self.legend);
        let top_px = canvas::head_px(&self.legend) + self.marks.lanes as f64 * LANE_PX;
        let bottom_px = top_px + self.panels.len() as f64 * PANEL_PX;
        for (i, panel) in self.panels.iter().enumerate() {
            self.panel(&mut canvas, panel, top_px + i as f64 * PANEL_PX, i + 1 == self.panels.len());
        }
        self.labels(&mut canvas, top_px);
        canvas.svg(bottom_px + BOTTOM_PX)
    }

    /// Draws one panel with its top at `y_px`; the last panel has the time axis.
    fn panel(&self, canvas: &mut Canvas, panel: &ChartPanel, y_px: f64, is_last: bool) {
        let (marks, end_s) = (&self.marks, self.end_s);
        let plot_height_px = PANEL_PX - GAP_PX;
        let range = range(&panel.lines, LEAST_ROOM);
        let (low, high) = (range.start, range.end);
        let corners = [(LEFT_PX, y_px), (WIDTH_PX - RIGHT_PX, y_px + plot_height_px)];
        let frame = PanelFrame::new(corners, 0.0..end_s, range);
        let (times, values) = (frame.x.ticks(T_TICKS), frame.y.ticks(Y_TICKS));

        let bands = || marks.changes.iter().chain(&marks.gusts).filter(|mark| mark.is_band);
        for mark in bands() {
            let corners = [(mark.start_s, low), (mark.end_s, high)].map(|corner| frame.at(corner));
            canvas.rectangle(corners, mark.tint, BAND_OPACITY);
        }
        let ends = bands().flat_map(|mark| [mark.start_s, mark.end_s]).filter(|t| *t > 0.0 && *t < end_s);
        ends.for_each(|t| canvas.line([frame.at((t, low)), frame.at((t, high))], BAND_END));

        frame.grid(canvas, &times, &values);
        if is_last {
            frame.bottom(canvas, times.marks(), "t [s]");
        }
        frame.left(canvas, &values, panel.label, MARGIN_PX);
        frame.outline(canvas);
        if panel.zero && low < 0.0 && 0.0 < high {
            canvas.line([frame.at((0.0, 0.0)), frame.at((end_s, 0.0))], FRAME_INK);
        }
        for gust in &marks.gusts {
            canvas.line([frame.at((gust.start_s, low)), frame.at((gust.start_s, high))], ONSET);
        }

        let scale = (PLOT_PX / end_s, plot_height_px / (high - low));
        for ChartLine { ink, points, lost_s, is_reference } in &panel.lines {
            let pieces = clip(&envelope(points.iter().copied(), end_s, ink.columns(PLOT_PX)), low, high);
            for piece in &pieces {
                canvas.line(frame.all(&simplify(piece, scale, 0.2)), *ink);
            }
            if let (Some(_), false, Some(&(t, v))) = (lost_s, is_reference, points.last()) {
                // Outside the panel, write the value: a cross at the edge would mark a wrong position.
                let mut beyond = |arrow, y| {
                    let words = format!("{arrow} {} ", values.label(v));
                    canvas.text(&words, (frame.x.at(t), y), LABEL_PX, TextAnchor::End, ink.color);
                };
                match v {
                    v if v > high => beyond('↑', frame.y.to + LABEL_PX),
                    v if v < low => beyond('↓', frame.y.from - LABEL_PX),
                    _ => canvas.cross(frame.at((t, v)), 4.0, ink.color),
                }
            }
        }
    }

    /// Draws the marks' labels on their bands, above the panels.
    fn labels(&self, canvas: &mut Canvas, top_px: f64) {
        for mark in self.marks.gusts.iter().chain(&self.marks.changes) {
            let bottom_px = top_px - 3.0 - mark.lane as f64 * LANE_PX;
            if mark.is_band {
                let x = |t: f64| LEFT_PX + t / self.end_s * PLOT_PX;
                let corners = [(x(mark.start_s), bottom_px - LANE_PX + 2.0), (x(mark.end_s), bottom_px)];
                canvas.rectangle(corners, mark.tint, 1.0);
            }
            let place = (LEFT_PX + mark.label_px, bottom_px - 0.5 * LANE_PX + 1.0);
            canvas.text(&mark.label, place, LABEL_PX, TextAnchor::Middle, GREY);
        }
    }
}

/// Returns the value range of a panel: all values of the references and the surviving flights. A lost flight counts
/// until shortly before its end, and extends the range to at most three times the others' range. If all vehicles are
/// lost, the range is not limited.
pub(super) fn range(lines: &[ChartLine], least_room: f64) -> Range<f64> {
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
    // Leave a margin above and below, also for a constant.
    let room = (0.06 * (high - low)).max(1e-3 * low.abs().max(high.abs())).max(least_room);
    low - room..high + room
}

/// Returns the smallest and largest value of some lines, if there are any.
fn extent<'a>(lines: impl Iterator<Item = &'a ChartLine>) -> Option<(f64, f64)> {
    let mut extent = None;
    for line in lines {
        // A lost flight counts until one second before its end, or 90 % of a flight shorter than 10 s.
        let until_s = line.lost_s.map_or(f64::INFINITY, |lost_s| lost_s - (0.1 * lost_s).min(1.0));
        for &(_, v) in line.points.iter().filter(|(t, _)| *t <= until_s) {
            let (low, high) = extent.unwrap_or((v, v));
            extent = Some((v.min(low), v.max(high)));
        }
    }
    extent
}
