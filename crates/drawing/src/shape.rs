//! Shapes that a figure consists of. Lengths have the drawing's own unit; y points down.

/// A colour: red, green, blue.
pub type Rgb = [u8; 3];

/// A point: x to the right, y down.
pub type Point = (f64, f64);

/// Background colour.
pub const PAPER: Rgb = [0xFF; 3];

/// Style of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Colour of the line.
    pub color: Rgb,
    /// Width of the line.
    pub width: f64,
    /// Opacity from 0 (invisible) to 1 (hides everything below).
    pub opacity: f64,
    /// Lengths of dashes and gaps; empty for a solid line.
    pub dashes: Vec<f64>,
}

impl Stroke {
    /// Returns an opaque solid line.
    pub fn solid(color: Rgb, width: f64) -> Self {
        Stroke { color, width, opacity: 1.0, dashes: Vec::new() }
    }
}

/// Part of a text that lies at the text's given position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextAnchor {
    /// The beginning of the text.
    Start,
    /// The middle of the text.
    Middle,
    /// The end of the text.
    End,
}

/// One shape of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A polyline.
    Line {
        /// Points from the beginning to the end.
        points: Vec<Point>,
        /// Style of the line.
        stroke: Stroke,
        /// Box that clips the line, if any: left, top, right, bottom.
        within: Option<[f64; 4]>,
    },
    /// A filled polygon.
    Area {
        /// Corners of the polygon.
        points: Vec<Point>,
        /// Fill colour.
        color: Rgb,
        /// Opacity from 0 (invisible) to 1 (hides everything below).
        opacity: f64,
        /// Box that clips the polygon, if any: left, top, right, bottom.
        within: Option<[f64; 4]>,
    },
    /// A text. The part between `⟨` and `⟩` is a subscript.
    Text {
        /// Words of the text.
        text: String,
        /// Position of the anchor, on the text's base line.
        place: Point,
        /// Font size.
        size: f64,
        /// Part of the text that lies at `place`.
        anchor: TextAnchor,
        /// Colour of the text.
        color: Rgb,
        /// Whether the text is rotated to run upwards.
        upwards: bool,
        /// Whether the text is bold; formats without a bold font ignore this.
        is_bold: bool,
    },
}

/// A figure whose shapes all have their positions.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width of the drawing.
    pub width: f64,
    /// Height of the drawing.
    pub height: f64,
    /// Shapes from back to front.
    pub shapes: Vec<Shape>,
}

/// Splits a text into parts, each with whether it is a subscript. The brackets `⟨` and `⟩` are removed. Parts alternate
/// and begin with normal text, which may be empty.
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
