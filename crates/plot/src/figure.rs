//! Figures for papers: panels above each other with a common x-axis.

use crate::table::Points;

/// A figure as wide as a paper's column.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperFigure {
    /// Width of the figure \[mm\].
    pub width_mm: f64,
    /// Height of a panel \[mm\].
    pub panel_mm: f64,
    /// Font size \[pt\].
    pub font_pt: f64,
    /// Width of the lines \[pt\].
    pub line_pt: f64,
    /// Title in the file's metadata; it is not drawn.
    pub title: String,
    /// Label of the x-axis.
    pub x_title: String,
    /// Limits of the x-axis; `None` shows all points.
    pub x_range: Option<[f64; 2]>,
    /// Whether the y-axes are logarithmic; values that are not positive are left out then.
    pub is_logarithmic: bool,
    /// Panels from top to bottom.
    pub panels: Vec<FigurePanel>,
}

/// A panel with its own y-axis.
#[derive(Clone, Debug, PartialEq)]
pub struct FigurePanel {
    /// Label of the y-axis.
    pub y_title: String,
    /// Lines from back to front.
    pub lines: Vec<PanelLine>,
}

/// Lines that share one entry of the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelLine {
    /// Name in the legend.
    pub label: String,
    /// Colour: red, green, blue.
    pub color: [u8; 3],
    /// Index of the dash pattern; 0 is a solid line.
    pub dash: usize,
    /// Curves, all drawn in the same style.
    pub lines: Vec<Points>,
    /// Lower and upper edge of a band, each pair with its x.
    pub band: Vec<(f64, [f64; 2])>,
}
