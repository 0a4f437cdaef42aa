//! Shapes, axes and SVG output that every figure of the project shares.
//!
//! A [`Drawing`] is a list of shapes. Their lengths are in pixels or points, as the author chooses. Formats that need a
//! font or pixels (PDF, PNG) are in `afbc-plot`.
#![forbid(unsafe_code)]

mod axis;
mod shape;
mod svg;
mod ticks;

pub use axis::PlotAxis;
pub use shape::{Drawing, PAPER, Point, Rgb, Shape, Stroke, TextAnchor, parts};
pub use svg::{SvgStyle, SvgUnit, hex};
pub use ticks::Ticks;
