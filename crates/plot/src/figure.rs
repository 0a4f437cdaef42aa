//! A figure: panels above each other with a common axis.

use crate::table::Points;

/// A figure for a paper's column.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperFigure {
    /// Width of everything \[mm\].
    pub width_mm: f64,
    /// Height of a panel \[mm\].
    pub panel_mm: f64,
    /// Size of the type \[pt\].
    pub font_pt: f64,
    /// Width of the lines \[pt\].
    pub line_pt: f64,
    /// Title for those who do not see it; it is not drawn.
    pub title: String,
    /// Title of the x-axis.
    pub x_title: String,
    /// Ends of the x-axis; all points if there are none.
    pub x_range: Option<[f64; 2]>,
    /// Whether the y-axes are logarithmic; what is not positive is left out then.
    pub is_logarithmic: bool,
    /// From top to bottom.
    pub panels: Vec<FigurePanel>,
}

/// A panel with its own y-axis.
#[derive(Clone, Debug, PartialEq)]
pub struct FigurePanel {
    /// Title of the y-axis.
    pub y_title: String,
    /// From back to front.
    pub lines: Vec<PanelLine>,
}

/// What one entry of the legend stands for.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelLine {
    /// Name in the legend.
    pub label: String,
    /// Red, green, blue.
    pub color: [u8; 3],
    /// Number of its dash pattern; 0 is a solid line.
    pub dash: usize,
    /// The lines, all alike.
    pub lines: Vec<Points>,
    /// Lower and upper edge of a band over x.
    pub band: Vec<(f64, [f64; 2])>,
}
