//! What all figures are drawn on and with.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::io;

/// Drawing units to a pixel. The library rounds to whole units, which at one a pixel would show as jagged lines.
const SCALE: f64 = 4.0;
/// Width of every figure.
pub(super) const WIDTH_PX: f64 = 900.0;

pub(super) const BLACK: RGBColor = RGBColor(26, 26, 26);
pub(super) const GREY: RGBColor = RGBColor(100, 100, 100);
pub(super) const GRID: RGBColor = RGBColor(226, 226, 226);
pub(super) const FRAME: RGBColor = RGBColor(150, 150, 150);

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Failure = DrawingAreaErrorKind<io::Error>;

/// Colour and width of a line.
#[derive(Clone, Copy)]
pub(super) struct Ink {
    pub(super) color: RGBColor,
    pub(super) width_px: f64,
}

impl Ink {
    pub(super) fn style(self) -> ShapeStyle {
        self.color.stroke_width(units(self.width_px).unsigned_abs())
    }
}

/// `color`, two thirds of the way to white.
pub(super) fn pale(color: RGBColor) -> RGBColor {
    let mix = |part: u8| 255 - (255 - part) / 3;
    RGBColor(mix(color.0), mix(color.1), mix(color.2))
}

/// Pixels to drawing units.
pub(super) fn units(px: f64) -> i32 {
    (px * SCALE).round() as i32
}

/// Text of a height in pixels. `⟨d⟩` makes a subscript.
pub(super) fn text(size_px: f64, color: RGBColor, horizontal: HPos) -> TextStyle<'static> {
    styled(size_px, color, horizontal, FontStyle::Normal)
}

fn styled(size_px: f64, color: RGBColor, horizontal: HPos, style: FontStyle) -> TextStyle<'static> {
    // The library sets type smaller than it is told by this factor.
    let font = FontDesc::new(FontFamily::SansSerif, size_px * SCALE * 1.24, style);
    TextStyle { font, color: color.to_backend_color(), pos: Pos::new(horizontal, VPos::Center) }
}

/// About how wide text is, without a font to measure.
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
        area.draw(&PathElement::new(sample, ink.style()))?;
        put(name, x + 30.0, y, text(12.0, BLACK, HPos::Left))?;
    }
    Ok(())
}

/// Height that title and legend take.
pub(super) fn head_px(legend: &[(String, Ink)]) -> f64 {
    places(legend).last().map_or(42.0, |(_, y)| *y) + 12.0
}

/// Where each entry of the legend goes, line by line.
fn places(legend: &[(String, Ink)]) -> Vec<(f64, f64)> {
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

/// Lets `draw` fill a white picture.
pub(super) fn svg(height_px: f64, title: &str, draw: impl FnOnce(&Area) -> Result<(), Failure>) -> io::Result<String> {
    let mut svg = String::new();
    let size = (units(WIDTH_PX).unsigned_abs(), units(height_px).unsigned_abs());
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present()).map_err(io::Error::other)?;
    }
    // The library's own first tag lacks what makes drawing units small and corners round.
    let body = svg.split_once('>').map_or("", |(_, body)| body);
    let body: String = body.lines().map(|line| subscripts(line) + "\n").collect();
    let body = body.replace(" opacity=\"1\"", "").replace("font-family=\"sans-serif\" ", "");
    // Type stands out from what lies under it.
    let body = body.replace("<text ", "<text paint-order=\"stroke\" stroke=\"#FFF\" stroke-width=\"10\" ");
    let (width, height) = size;
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH_PX}\" height=\"{height_px}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" stroke-linejoin=\"round\" \
         font-family=\"Helvetica, Arial, sans-serif\"><title>{title}</title>{body}"
    ))
}

/// `line` with each `⟨d⟩` lowered, and what follows raised again.
fn subscripts(line: &str) -> String {
    let lower = line.replace('⟨', "<tspan dy=\"0.3em\" font-size=\"75%\">");
    let raised = lower.replace('⟩', "</tspan><tspan dy=\"-0.225em\">");
    raised + &"</tspan>".repeat(line.matches('⟩').count())
}
