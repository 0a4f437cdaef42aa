//! What a figure is drawn from: lengths in a unit of the drawing's own, y downwards.

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// A point: right and down.
pub type Point = (f64, f64);

/// Colour of what is drawn on.
pub const PAPER: Rgb = [0xFF; 3];

/// How a line is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub color: Rgb,
    /// Its width.
    pub width: f64,
    /// 0 for what is not seen to 1 for what hides all below.
    pub opacity: f64,
    /// Lengths on and off; empty for a solid line.
    pub dashes: Vec<f64>,
}

impl Stroke {
    /// Returns a solid line that hides what is below.
    pub fn solid(color: Rgb, width: f64) -> Self {
        Stroke { color, width, opacity: 1.0, dashes: Vec::new() }
    }
}

/// Where the given place of a text is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextAnchor {
    /// At its beginning.
    Start,
    /// In its middle.
    Middle,
    /// At its end.
    End,
}

/// A part of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A line through points.
    Line {
        /// From its beginning to its end.
        points: Vec<Point>,
        /// How it is drawn.
        stroke: Stroke,
        /// What is seen of it lies within this box, if any: left, top, right, bottom.
        within: Option<[f64; 4]>,
    },
    /// A filled area.
    Area {
        /// Its corners.
        points: Vec<Point>,
        /// Its colour.
        color: Rgb,
        /// As that of a line.
        opacity: f64,
        /// As that of a line.
        within: Option<[f64; 4]>,
    },
    /// A text; `⟨d⟩` in it is a lowered d.
    Text {
        /// The words.
        text: String,
        /// Where its anchor lies on its base line.
        place: Point,
        /// Size of the type.
        size: f64,
        /// What of it lies at the place.
        anchor: TextAnchor,
        /// Its colour.
        color: Rgb,
        /// Whether it is turned to run upwards.
        upwards: bool,
        /// Whether it is bold, where the format's fonts are.
        is_bold: bool,
    },
}

/// A laid out figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width of everything.
    pub width: f64,
    /// Height of everything.
    pub height: f64,
    /// From back to front.
    pub shapes: Vec<Shape>,
}

/// Returns the parts of a text, each with whether it is lowered, without the brackets that say so; what is not lowered
/// comes first, if empty, and between any two that are.
pub fn parts(text: &str) -> Vec<(&str, bool)> {
    let (mut parts, mut rest) = (Vec::new(), text);
    while let Some((before, (lower, after))) =
        rest.split_once('⟨').and_then(|(before, after)| Some((before, after.split_once('⟩')?)))
    {
        parts.extend([(before, false), (lower, true)]);
        rest = after;
    }
    parts.push((rest, false));
    parts
}
