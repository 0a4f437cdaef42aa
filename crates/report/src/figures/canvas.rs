//! Drawing functions shared by all figures.

use super::palette::{self, BLACK, GREY, WHITE};
use crate::explore::Pen;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::io;

/// Drawing units per pixel. The library rounds to whole units, and single pixels would give jagged lines.
const SCALE: f64 = 4.0;
/// Width of every figure.
pub(super) const WIDTH_PX: f64 = 900.0;

/// Smallest width of the lines in a legend.
const LEGEND_PX: f64 = 2.5;

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Failure = DrawingAreaErrorKind<io::Error>;

/// Style of a line.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Ink {
    pub(super) color: RGBColor,
    pub(super) width_px: f64,
    /// 0 for a solid line, any other number for its own dash pattern.
    pub(super) dash: usize,
    /// Opacity, 0 to 1.
    pub(super) opacity: f64,
}

/// The dash number is stored in this part of the opacity until the picture is finished, since the library has no
/// dashes.
const DASH: f64 = 0.001;
/// Largest number of dash patterns.
const DASHES: usize = 50;

impl Ink {
    /// Creates a solid line.
    pub(super) const fn new(color: RGBColor, width_px: f64) -> Self {
        Ink { color, width_px, dash: 0, opacity: 1.0 }
    }

    pub(super) fn style(self) -> ShapeStyle {
        let opacity = if self.dash > 0 { 1.0 - DASH * self.dash.min(DASHES) as f64 } else { self.opacity };
        self.color.mix(opacity).stroke_width(units(self.width_px).unsigned_abs())
    }

    /// Returns the number of columns that a line over an axis of `axis_px` is reduced to: each as wide as the line, and
    /// at least a pixel.
    pub(super) fn columns(self, axis_px: f64) -> f64 {
        axis_px / self.width_px.max(1.0)
    }

    /// Returns the same style for a page's script.
    pub(super) fn pen(self) -> Pen {
        let dash_px = if self.dash > 0 { dash_lengths_px(self.dash.min(DASHES)) } else { Vec::new() };
        let (colors, width_px) = (palette::both(self.color), self.width_px);
        Pen { colors, width_px, opacity: self.opacity, dash_px }
    }
}

/// AFBC's line is wider than the others by this factor: it is seen on both sides of a line that lies on it.
const PROMINENT: f64 = 1.4;

/// Returns a line for each of the contenders `names`: AFBC's is the widest; of two that share a colour, the second is
/// dashed.
pub(super) fn inks(names: &[&str], width_px: f64) -> Vec<Ink> {
    let ink = |(name, dash): (&&str, usize)| {
        let width_px = if *name == "afbc" { PROMINENT * width_px } else { width_px };
        Ink { dash, ..Ink::new(palette::color(name), width_px) }
    };
    names.iter().zip(palette::repeats(names)).map(ink).collect()
}

/// Returns the attribute that encodes a dash pattern.
fn dash_opacity(dash: usize) -> String {
    // With its quotes: otherwise 0.99 would be found in 0.999.
    format!(" opacity=\"{}\"", 1.0 - DASH * dash as f64)
}

/// Returns lengths on and off in pixels, longer for higher numbers.
fn dash_lengths_px(dash: usize) -> Vec<f64> {
    const PATTERNS: [&[f64]; 5] = [&[7.0, 3.0], &[2.0, 3.0], &[10.0, 3.0, 2.0, 3.0], &[14.0, 5.0], &[4.0, 7.0]];
    let (pattern, round) = ((dash - 1) % PATTERNS.len(), 1 + (dash - 1) / PATTERNS.len());
    let lengths = PATTERNS.get(pattern).copied().unwrap_or_default();
    lengths.iter().map(|px| px * round as f64).collect()
}

/// Returns the attribute for a dash pattern.
fn dash_pattern(dash: usize) -> String {
    let lengths: Vec<_> = dash_lengths_px(dash).iter().map(|px| units(*px).to_string()).collect();
    format!(" stroke-dasharray=\"{}\"", lengths.join(" "))
}

/// Converts pixels to drawing units.
pub(super) fn units(px: f64) -> i32 {
    (px * SCALE).round() as i32
}

/// Text of a height in pixels. `⟨d⟩` gives a subscript.
pub(super) fn text(size_px: f64, color: RGBColor, horizontal: HPos) -> TextStyle<'static> {
    styled(size_px, color, horizontal, FontStyle::Normal)
}

fn styled(size_px: f64, color: RGBColor, horizontal: HPos, style: FontStyle) -> TextStyle<'static> {
    // The library draws type smaller than requested by this factor.
    let font = FontDesc::new(FontFamily::SansSerif, size_px * SCALE * 1.24, style);
    TextStyle { font, color: color.to_backend_color(), pos: Pos::new(horizontal, VPos::Center) }
}

/// Estimates the width of text, without a font to measure.
pub(super) fn text_width_px(text: &str, size_px: f64) -> f64 {
    0.5 * size_px * text.chars().filter(|c| !matches!(c, '⟨' | '⟩')).count() as f64
}

/// Draws title, conditions and legend.
pub(super) fn head(area: &Area, title: &str, conditions: &str, legend: &[(String, Ink)]) -> Result<(), Failure> {
    let put = |words: &str, x: f64, y: f64, style: TextStyle<'static>| {
        area.draw(&Text::new(words.to_owned(), (units(x), units(y)), style))
    };
    put(title, 14.0, 18.0, styled(15.0, BLACK, HPos::Left, FontStyle::Bold))?;
    put(&conditions.replace(" -", " −"), WIDTH_PX - 14.0, 18.0, text(11.0, GREY, HPos::Right))?;
    for ((name, ink), (x, y)) in legend.iter().zip(places(legend)) {
        let sample = [(units(x), units(y)), (units(x + 24.0), units(y))];
        let clear = Ink { width_px: ink.width_px.max(LEGEND_PX), ..*ink };
        area.draw(&PathElement::new(sample, clear.style()))?;
        put(name, x + 30.0, y, text(12.0, BLACK, HPos::Left))?;
    }
    Ok(())
}

/// Returns the height of title and legend.
pub(super) fn head_px(legend: &[(String, Ink)]) -> f64 {
    places(legend).last().map_or(42.0, |(_, y)| *y) + 12.0
}

/// Returns the position of each entry of the legend, line by line.
pub(super) fn places(legend: &[(String, Ink)]) -> Vec<(f64, f64)> {
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

/// Returns an SVG of a white picture that `draw` has filled.
pub(super) fn svg(height_px: f64, title: &str, draw: impl FnOnce(&Area) -> Result<(), Failure>) -> io::Result<String> {
    let mut svg = String::new();
    let size = (units(WIDTH_PX).unsigned_abs(), units(height_px).unsigned_abs());
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present()).map_err(io::Error::other)?;
    }
    // The library's first tag lacks the attributes for drawing units and round corners.
    let body = svg.split_once('>').map_or("", |(_, body)| body);
    let body: String = body.lines().map(|line| subscripts(line) + "\n").collect();
    let body = body.replace(" opacity=\"1\"", "").replace("font-family=\"sans-serif\" ", "");
    // A white outline separates type from what lies below it.
    let body = body.replace("<text ", "<text paint-order=\"stroke\" stroke=\"#FFFFFF\" stroke-width=\"10\" ");
    let body = (1..=DASHES).fold(body, |body, dash| body.replace(&dash_opacity(dash), &dash_pattern(dash)));
    let style = palette::dark_style(&body);
    let (width, height) = size;
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH_PX}\" height=\"{height_px}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" stroke-linejoin=\"round\" \
         font-family=\"Helvetica, Arial, sans-serif\"><title>{title}</title>{style}{body}"
    ))
}

/// Replaces each `⟨d⟩` of `line` by a lowered character.
fn subscripts(line: &str) -> String {
    let lower = line.replace('⟨', "<tspan dy=\"0.3em\" font-size=\"75%\">");
    let raised = lower.replace('⟩', "</tspan><tspan dy=\"-0.225em\">");
    raised + &"</tspan>".repeat(line.matches('⟩').count())
}

/// Returns the corners of the mark of contender number `index` around its centre, in drawing units: marks distinguish
/// contenders without colours.
pub(super) fn marker(index: usize, px: f64) -> Vec<(i32, i32)> {
    // Number of corners, direction of the first in turns, and relative radius of every second one.
    const SHAPES: [(usize, f64, f64); 6] =
        [(16, 0.0, 0.85), (4, 0.125, 1.0), (3, -0.25, 1.0), (4, 0.0, 1.0), (8, 0.0, 0.35), (3, 0.25, 1.0)];
    let (corners, turn, second) = *SHAPES.get(index % SHAPES.len()).unwrap_or(&SHAPES[0]);
    let corner = |i: usize| {
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * (i as f64 / corners as f64 + turn));
        let out = 1.15 * px * if i % 2 == 1 { second } else { 1.0 };
        (units(out * cos), units(out * sin))
    };
    (0..corners).map(corner).collect()
}
