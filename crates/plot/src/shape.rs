//! What a figure is drawn from, in points of 1/72 inch, y downwards.

/// Red, green, blue.
pub(crate) type Rgb = [u8; 3];

/// A place \[pt\].
pub(crate) type Place = (f64, f64);

/// How a line is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) color: Rgb,
    pub(crate) width_pt: f64,
    /// Lengths on and off \[pt\]; empty for a solid line.
    pub(crate) dashes: &'static [f64],
}

/// Where the given place of a text is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TextAnchor {
    Start,
    Middle,
    End,
}

/// A part of a figure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    /// A line through points, within a box: left, top, right, bottom.
    Line { points: Vec<Place>, stroke: Stroke, within: Option<[f64; 4]> },
    /// A filled area, within a box likewise.
    Area { points: Vec<Place>, color: Rgb, opacity: f64, within: Option<[f64; 4]> },
    /// A text on its base line, turned to run upwards or not.
    Text { text: String, place: Place, size_pt: f64, anchor: TextAnchor, color: Rgb, upwards: bool },
}

/// A laid out figure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Drawing {
    pub(crate) width_pt: f64,
    pub(crate) height_pt: f64,
    /// From back to front.
    pub(crate) shapes: Vec<Shape>,
}
