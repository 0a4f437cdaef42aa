//! A panel: its axes, and the positions of values between them.

use super::canvas::{Canvas, Ink};
use super::palette::{BLACK, FRAME, GREY, GRID};
use afbc_drawing::{PlotAxis, Point, TextAnchor, Ticks};
use core::ops::Range;

/// Height below a panel for the numbers and title of its x-axis.
pub(super) const BOTTOM_PX: f64 = 42.0;
/// Length of a tick, and distance of its label.
const TICK_PX: f64 = 3.0;
const APART_PX: f64 = 6.0;
/// Font sizes of numbers and titles.
const NUMBER_PX: f64 = 11.0;
const TITLE_PX: f64 = 12.0;
/// Line styles of axes with ticks, and of the grid.
pub(super) const FRAME_INK: Ink = Ink::new(FRAME, 0.75);
const GRID_INK: Ink = Ink::new(GRID, 0.75);
/// Line style of the box, fainter than the axes.
const BOX_INK: Ink = Ink::new(FRAME, 0.25);

/// Position of a panel's plot, and its axes.
#[derive(Clone, Copy)]
pub(super) struct PanelFrame {
    pub(super) x: PlotAxis,
    pub(super) y: PlotAxis,
}

impl PanelFrame {
    /// Creates a frame between its top left and bottom right corner.
    pub(super) fn new([(left, top), (right, bottom)]: [Point; 2], x: Range<f64>, y: Range<f64>) -> Self {
        PanelFrame {
            x: PlotAxis { low: x.start, high: x.end, from: left, to: right, is_logarithmic: false },
            y: PlotAxis { low: y.start, high: y.end, from: bottom, to: top, is_logarithmic: false },
        }
    }

    /// Returns the position of a point.
    pub(super) fn at(&self, (x, y): (f64, f64)) -> Point {
        (self.x.at(x), self.y.at(y))
    }

    /// Returns the positions of points.
    pub(super) fn all(&self, points: &[(f64, f64)]) -> Vec<Point> {
        points.iter().map(|point| self.at(*point)).collect()
    }

    /// Draws the grid; call this before drawing the lines.
    pub(super) fn grid(&self, canvas: &mut Canvas, x_ticks: &Ticks, y_ticks: &Ticks) {
        for x in x_ticks.at.iter().map(|tick| self.x.at(*tick)) {
            canvas.line([(x, self.y.from), (x, self.y.to)], GRID_INK);
        }
        for y in y_ticks.at.iter().map(|tick| self.y.at(*tick)) {
            canvas.line([(self.x.from, y), (self.x.to, y)], GRID_INK);
        }
    }

    /// Draws the box around the plot.
    pub(super) fn outline(&self, canvas: &mut Canvas) {
        let PanelFrame { x, y } = self;
        canvas.line([(x.from, y.to), (x.to, y.to), (x.to, y.from), (x.from, y.from), (x.from, y.to)], BOX_INK);
    }

    /// Draws the line, ticks and title of the x-axis, within [`BOTTOM_PX`].
    pub(super) fn bottom(&self, canvas: &mut Canvas, marks: impl Iterator<Item = (f64, String)>, title: &str) {
        let axis_px = self.y.from;
        canvas.line([(self.x.from, axis_px), (self.x.to, axis_px)], FRAME_INK);
        for (value, label) in marks {
            let x = self.x.at(value);
            canvas.line([(x, axis_px), (x, axis_px + TICK_PX)], FRAME_INK);
            canvas.text(&label, (x, axis_px + APART_PX + 0.5 * NUMBER_PX), NUMBER_PX, TextAnchor::Middle, GREY);
        }
        let middle_px = 0.5 * (self.x.from + self.x.to);
        canvas.text(title, (middle_px, axis_px + BOTTOM_PX - 0.5 * TITLE_PX), TITLE_PX, TextAnchor::Middle, BLACK);
    }

    /// Draws the line, ticks and title of the y-axis; the title's left edge is at `left_px`.
    pub(super) fn left(&self, canvas: &mut Canvas, ticks: &Ticks, title: &str, left_px: f64) {
        let axis_px = self.x.from;
        canvas.line([(axis_px, self.y.to), (axis_px, self.y.from)], FRAME_INK);
        for (value, label) in ticks.marks() {
            let y = self.y.at(value);
            canvas.line([(axis_px - TICK_PX, y), (axis_px, y)], FRAME_INK);
            canvas.text(&label, (axis_px - APART_PX, y), NUMBER_PX, TextAnchor::End, GREY);
        }
        canvas.upright(title, (left_px + 0.5 * TITLE_PX, 0.5 * (self.y.from + self.y.to)), TITLE_PX, BLACK);
    }
}
