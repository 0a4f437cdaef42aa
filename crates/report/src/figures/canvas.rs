//! Drawing surface of a figure, in pixels, and the elements that all figures share.

use super::palette::{self, BLACK, GREY};
use crate::explore::LineStyle;
use afbc_drawing::{Drawing, Point, Rgb, Shape, Stroke, SvgStyle, SvgUnit, TextAnchor};

/// Width of every figure.
pub(super) const WIDTH_PX: f64 = 900.0;

/// Smallest width of the lines in a legend.
const LEGEND_PX: f64 = 2.5;
/// Width of the outline that separates text from the shapes below it.
const HALO_PX: f64 = 2.5;
/// Distance from the middle of a text down to its base line, relative to the font size.
const MIDDLE: f64 = 0.26;

/// Style of a line.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Ink {
    pub(super) color: Rgb,
    pub(super) width_px: f64,
    /// Number of the dash pattern; 0 is a solid line.
    pub(super) dash: usize,
    /// Opacity, 0 to 1.
    pub(super) opacity: f64,
}

impl Ink {
    /// Creates a solid, opaque style.
    pub(super) const fn new(color: Rgb, width_px: f64) -> Self {
        Ink { color, width_px, dash: 0, opacity: 1.0 }
    }

    /// Returns lengths of dashes and gaps in pixels, longer for higher numbers; empty for a solid line.
    fn dashes_px(self) -> Vec<f64> {
        const PATTERNS: [&[f64]; 5] = [&[7.0, 3.0], &[2.0, 3.0], &[10.0, 3.0, 2.0, 3.0], &[14.0, 5.0], &[4.0, 7.0]];
        let Some(place) = self.dash.checked_sub(1) else { return Vec::new() };
        let (pattern, round) = (place % PATTERNS.len(), 1 + place / PATTERNS.len());
        let lengths = PATTERNS.get(pattern).copied().unwrap_or_default();
        lengths.iter().map(|px| px * round as f64).collect()
    }

    fn stroke(self) -> Stroke {
        Stroke { color: self.color, width: self.width_px, opacity: self.opacity, dashes: self.dashes_px() }
    }

    /// Returns the number of columns to which a line on an axis of `axis_px` is reduced. A column is as wide as the
    /// line, and at least one pixel.
    pub(super) fn columns(self, axis_px: f64) -> f64 {
        axis_px / self.width_px.max(1.0)
    }

    /// Returns the same style for the page's script.
    pub(super) fn pen(self) -> LineStyle {
        let (colors, width_px) = (palette::both(self.color), self.width_px);
        LineStyle { colors, width_px, opacity: self.opacity, dash_px: self.dashes_px() }
    }
}

/// Factor by which AFBC's line is wider than the others, so that it stays visible on both sides of a line on top of it.
const PROMINENT: f64 = 1.4;

/// Returns a line style for each contender in `names`. AFBC's line is the widest. If two contenders share a colour, the
/// second one is dashed.
pub(super) fn inks(names: &[&str], width_px: f64) -> Vec<Ink> {
    let ink = |(name, dash): (&&str, usize)| {
        let width_px = if *name == "afbc" { PROMINENT * width_px } else { width_px };
        Ink { dash, ..Ink::new(palette::color(name), width_px) }
    };
    names.iter().zip(palette::repeats(names)).map(ink).collect()
}

/// Estimates the width of a text without a font.
pub(super) fn text_width_px(text: &str, size_px: f64) -> f64 {
    0.5 * size_px * text.chars().filter(|c| !matches!(c, '⟨' | '⟩')).count() as f64
}

/// A polygon: number of corners, direction of the first corner in turns, and relative radius of every second corner.
type Polygon = (usize, f64, f64);

/// A picture that is being drawn; shapes are listed from back to front.
pub(super) struct Canvas {
    title: &'static str,
    shapes: Vec<Shape>,
}

impl Canvas {
    /// Starts a picture with its title, conditions and legend.
    pub(super) fn new(title: &'static str, conditions: &str, legend: &[(String, Ink)]) -> Self {
        let mut canvas = Canvas { title, shapes: Vec::new() };
        canvas.write(title, (14.0, 18.0), 15.0, TextAnchor::Start, BLACK, true);
        canvas.text(&conditions.replace(" -", " −"), (WIDTH_PX - 14.0, 18.0), 11.0, TextAnchor::End, GREY);
        for ((name, ink), (x, y)) in legend.iter().zip(places(legend)) {
            let clear = Ink { width_px: ink.width_px.max(LEGEND_PX), ..*ink };
            canvas.line([(x, y), (x + 24.0, y)], clear);
            canvas.text(name, (x + 30.0, y), 12.0, TextAnchor::Start, BLACK);
        }
        canvas
    }

    /// Draws a line if there are at least two points.
    pub(super) fn line(&mut self, points: impl Into<Vec<Point>>, ink: Ink) {
        let points = points.into();
        if points.len() > 1 {
            self.shapes.push(Shape::Line { points, stroke: ink.stroke(), within: None });
        }
    }

    /// Fills a polygon.
    pub(super) fn area(&mut self, points: impl Into<Vec<Point>>, color: Rgb, opacity: f64) {
        self.shapes.push(Shape::Area { points: points.into(), color, opacity, within: None });
    }

    /// Fills the rectangle between two corners.
    pub(super) fn rectangle(&mut self, [a, b]: [Point; 2], color: Rgb, opacity: f64) {
        self.area([a, (b.0, a.1), b, (a.0, b.1)], color, opacity);
    }

    /// Draws a cross.
    pub(super) fn cross(&mut self, (x, y): Point, arm_px: f64, color: Rgb) {
        for down in [arm_px, -arm_px] {
            self.line([(x - arm_px, y - down), (x + arm_px, y + down)], Ink::new(color, 2.0));
        }
    }

    /// Draws a dot.
    pub(super) fn dot(&mut self, place: Point, radius_px: f64, color: Rgb) {
        self.polygon(place, radius_px, (24, 0.0, 1.0), color);
    }

    /// Draws the mark of contender number `index`. The shapes of marks tell contenders apart without colours.
    pub(super) fn mark(&mut self, place: Point, index: usize, px: f64, color: Rgb) {
        const SHAPES: [Polygon; 6] =
            [(16, 0.0, 0.85), (4, 0.125, 1.0), (3, -0.25, 1.0), (4, 0.0, 1.0), (8, 0.0, 0.35), (3, 0.25, 1.0)];
        let shape = *SHAPES.get(index % SHAPES.len()).unwrap_or(&SHAPES[0]);
        self.polygon(place, 1.15 * px, shape, color);
    }

    fn polygon(&mut self, (x, y): Point, radius_px: f64, (corners, turn, second): Polygon, color: Rgb) {
        let corner = |i: usize| {
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * (i as f64 / corners as f64 + turn));
            let out = radius_px * if i % 2 == 1 { second } else { 1.0 };
            (x + out * cos, y + out * sin)
        };
        self.area((0..corners).map(corner).collect::<Vec<_>>(), color, 1.0);
    }

    /// Writes a text that is vertically centred at `place`. `⟨d⟩` gives a subscript.
    pub(super) fn text(&mut self, text: &str, place: Point, size_px: f64, anchor: TextAnchor, color: Rgb) {
        self.write(text, place, size_px, anchor, color, false);
    }

    fn write(&mut self, text: &str, (x, y): Point, size: f64, anchor: TextAnchor, color: Rgb, is_bold: bool) {
        let place = (x, y + MIDDLE * size);
        self.shapes.push(Shape::Text { text: text.to_owned(), place, size, anchor, color, upwards: false, is_bold });
    }

    /// Writes a text that runs upwards, centred at `place`.
    pub(super) fn upright(&mut self, text: &str, (x, y): Point, size: f64, color: Rgb) {
        let (text, place, anchor) = (text.to_owned(), (x + MIDDLE * size, y), TextAnchor::Middle);
        self.shapes.push(Shape::Text { text, place, size, anchor, color, upwards: true, is_bold: false });
    }

    /// Returns the picture as SVG.
    pub(super) fn svg(self, height_px: f64) -> String {
        let (fonts, dark) = ("Helvetica, Arial, sans-serif", palette::all());
        let style = SvgStyle { title: self.title, unit: SvgUnit::Pixel, fonts, halo: HALO_PX, dark: &dark };
        Drawing { width: WIDTH_PX, height: height_px, shapes: self.shapes }.svg(&style)
    }
}

/// Returns the height of title and legend.
pub(super) fn head_px(legend: &[(String, Ink)]) -> f64 {
    places(legend).last().map_or(42.0, |(_, y)| *y) + 12.0
}

/// Returns the position of each legend entry, line by line.
pub(super) fn places(legend: &[(String, Ink)]) -> Vec<Point> {
    let (mut x, mut y) = (14.0, 42.0);
    let place = |(name, _): &(String, Ink)| {
        let width = 30.0 + text_width_px(name, 12.0) + 26.0;
        if x > 14.0 && x + width > WIDTH_PX {
            (x, y) = (14.0, y + 18.0);
        }
        let here = (x, y);
        x += width;
        here
    };
    legend.iter().map(place).collect()
}
