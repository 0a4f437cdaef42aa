//! Writes a drawing as SVG; texts stay texts.

use crate::shape::{Drawing, PAPER, Point, Rgb, Shape, TextAnchor, parts};
use core::fmt::Write;

/// Unit of the drawing's lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SvgUnit {
    /// Points of 1/72 inch, written with two decimals.
    Point,
    /// Pixels, written as integers in quarters of a pixel; shorter than decimals, and finer than anybody sees.
    Pixel,
}

/// Options of the SVG output.
#[derive(Clone, Copy, Debug)]
pub struct SvgStyle<'a> {
    /// Title that screen readers read out.
    pub title: &'a str,
    /// Unit of the drawing's lengths.
    pub unit: SvgUnit,
    /// Font families in order of preference.
    pub fonts: &'a str,
    /// Width of an outline of the texts in the background colour, which separates a text from the shapes below it; 0
    /// for none.
    pub halo: f64,
    /// Pairs of a colour and its replacement in dark mode on a screen. Print always uses the first colour.
    pub dark: &'a [[Rgb; 2]],
}

impl Drawing {
    /// Returns the drawing as an SVG file.
    pub fn svg(&self, style: &SvgStyle<'_>) -> String {
        let writer = SvgWriter::new(style, &self.shapes);
        let mut body = format!("<rect width=\"100%\" height=\"100%\" fill=\"{}\"/>\n", hex(PAPER));
        body += &writer.clips();
        for shape in &self.shapes {
            body += &writer.element(shape);
            body.push('\n');
        }
        let unit = if style.unit == SvgUnit::Point { "pt" } else { "" };
        let [width, height] = [self.width, self.height].map(short);
        let [right, bottom] = [self.width, self.height].map(|length| short(writer.steps * length));
        let dark = dark(style.dark, &body);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}{unit}\" height=\"{height}{unit}\" \
             viewBox=\"0 0 {right} {bottom}\" role=\"img\" fill=\"none\" stroke-linejoin=\"round\" \
             font-family=\"{}\">\n<title>{}</title>\n{dark}{body}</svg>\n",
            style.fonts,
            escaped(style.title)
        )
    }
}

/// Returns a style sheet that replaces the body's colours in dark mode; empty if no colour has a replacement.
fn dark(variants: &[[Rgb; 2]], body: &str) -> String {
    let mut rules = String::new();
    for [light, dark] in variants.iter().map(|pair| pair.map(hex)) {
        for part in ["fill", "stroke"] {
            if body.contains(&format!("{part}=\"{light}\"")) {
                rules += &format!("svg [{part}=\"{light}\"]{{{part}:{dark}}}");
            }
        }
    }
    if rules.is_empty() {
        return rules;
    }
    format!("<style>@media screen and (prefers-color-scheme:dark){{{rules}}}</style>\n")
}

/// Writes shapes in the unit of the file.
struct SvgWriter {
    /// Distinct clip boxes. Shapes refer to a box by its index.
    boxes: Vec<[f64; 4]>,
    /// Units of the file per unit of the drawing.
    steps: f64,
    decimals: usize,
    /// SVG attributes that every text gets.
    halo: String,
}

impl SvgWriter {
    fn new(style: &SvgStyle<'_>, shapes: &[Shape]) -> Self {
        let mut boxes: Vec<[f64; 4]> = Vec::new();
        for shape in shapes {
            if let Shape::Line { within: Some(within), .. } | Shape::Area { within: Some(within), .. } = shape
                && !boxes.contains(within)
            {
                boxes.push(*within);
            }
        }
        let (steps, decimals) = match style.unit {
            SvgUnit::Point => (1.0, 2),
            SvgUnit::Pixel => (4.0, 0),
        };
        let halo = if style.halo > 0.0 {
            let width = short(steps * style.halo);
            format!(" paint-order=\"stroke\" stroke=\"{}\" stroke-width=\"{width}\"", hex(PAPER))
        } else {
            String::new()
        };
        SvgWriter { boxes, steps, decimals, halo }
    }

    /// Formats a coordinate in the unit of the file.
    fn length(&self, value: f64) -> String {
        format!("{:.*}", self.decimals, self.steps * value)
    }

    /// Returns the clip paths of all boxes.
    fn clips(&self) -> String {
        let mut clips = String::new();
        for (place, [left, top, right, bottom]) in self.boxes.iter().enumerate() {
            let [x, y, width, height] = [*left, *top, right - left, bottom - top].map(|value| self.length(value));
            // Writing to a String cannot fail.
            let _ = writeln!(
                clips,
                "<clipPath id=\"panel{place}\"><rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>\
                 </clipPath>"
            );
        }
        clips
    }

    fn clip(&self, within: &Option<[f64; 4]>) -> String {
        let place = within.and_then(|within| self.boxes.iter().position(|other| *other == within));
        place.map_or(String::new(), |place| format!(" clip-path=\"url(#panel{place})\""))
    }

    fn path(&self, points: &[Point]) -> String {
        let points: Vec<String> =
            points.iter().map(|(x, y)| format!("{},{}", self.length(*x), self.length(*y))).collect();
        points.join(" ")
    }

    fn element(&self, shape: &Shape) -> String {
        match shape {
            Shape::Line { points, stroke, within } => {
                let dashes: Vec<String> = stroke.dashes.iter().map(|length| short(self.steps * length)).collect();
                let dashes = if dashes.is_empty() {
                    String::new()
                } else {
                    format!(" stroke-dasharray=\"{}\"", dashes.join(" "))
                };
                format!(
                    "<polyline points=\"{}\" stroke=\"{}\" stroke-width=\"{}\"{dashes}{}{}/>",
                    self.path(points),
                    hex(stroke.color),
                    short(self.steps * stroke.width),
                    opacity("stroke", stroke.opacity),
                    self.clip(within)
                )
            }
            Shape::Area { points, color, opacity: share, within } => format!(
                "<polygon points=\"{}\" fill=\"{}\"{}{}/>",
                self.path(points),
                hex(*color),
                opacity("fill", *share),
                self.clip(within)
            ),
            Shape::Text { text, place: (x, y), size, anchor, color, upwards, is_bold } => {
                let anchor = match anchor {
                    TextAnchor::Start => "start",
                    TextAnchor::Middle => "middle",
                    TextAnchor::End => "end",
                };
                let ([x, y], size) = ([*x, *y].map(|length| self.length(length)), short(self.steps * size));
                let bold = if *is_bold { " font-weight=\"bold\"" } else { "" };
                let turned = if *upwards { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
                format!(
                    "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{}\"{}{bold}\
                     {turned}>{}</text>",
                    hex(*color),
                    self.halo,
                    lowered(&escaped(text))
                )
            }
        }
    }
}

/// Returns the opacity attribute of `part`; empty if the shape is opaque.
fn opacity(part: &str, share: f64) -> String {
    if share < 1.0 { format!(" {part}-opacity=\"{}\"", short(share)) } else { String::new() }
}

/// Formats a number with at most three decimals and no trailing zeros.
fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Formats a colour as `#rrggbb`.
pub fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Returns SVG that shifts subscripts below the base line, and the text after them back up.
fn lowered(text: &str) -> String {
    let parts = parts(text);
    let piece = |part: &(&str, bool), is_first: bool| match part {
        (words, true) => format!("<tspan dy=\"0.3em\" font-size=\"75%\">{words}</tspan>"),
        (words, false) if is_first || words.is_empty() => (*words).to_owned(),
        (words, false) => format!("<tspan dy=\"-0.225em\">{words}</tspan>"),
    };
    parts.iter().enumerate().map(|(place, part)| piece(part, place == 0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lowered_leaves_the_rest_on_its_line() {
        assert_eq!(lowered("x [m]"), "x [m]");
        let low = "<tspan dy=\"0.3em\" font-size=\"75%\">d</tspan>";
        assert_eq!(lowered("x⟨d⟩"), format!("x{low}"));
        assert_eq!(lowered("x⟨d⟩ − x"), format!("x{low}<tspan dy=\"-0.225em\"> − x</tspan>"));
        assert_eq!(lowered("⟨d⟩⟨d⟩, x⟩ ⟨"), format!("{low}{low}<tspan dy=\"-0.225em\">, x⟩ ⟨</tspan>"));
    }
}
