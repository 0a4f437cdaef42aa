//! Drawings: what every figure is made of, whoever draws it, and their SVG.
//!
//! A [`Drawing`] is a list of shapes in a length of its author's choice, pixels or points. Axes and their ticks are
//! here, too, so that every figure has the same. Formats that need a font or pixels are `afbc-plot`'s.
#![forbid(unsafe_code)]

mod axis;
mod shape;
mod svg;
mod ticks;

pub use axis::PlotAxis;
pub use shape::{Drawing, PAPER, Point, Rgb, Shape, Stroke, TextAnchor, parts};
pub use svg::{SvgStyle, SvgUnit, hex};
pub use ticks::Ticks;
