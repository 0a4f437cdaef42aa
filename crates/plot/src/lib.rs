//! Figures for a paper from logs: columns of CSV, Parquet, ULog and MCAP files, as SVG, PDF or PNG of a given width.
//!
//! A [`PaperFigure`] is laid out as a drawing in points of 1/72 inch, which each format writes in its own way.
//! Text is measured by the font in `font/`, whose outlines PDF and PNG draw: no fonts of the machine are used, so the
//! same figure has the same bytes everywhere, and nothing is left to embed.
#![forbid(unsafe_code)]

mod band;
mod columns;
mod csv;
mod figure;
mod font;
mod format;
mod layout;
mod mcap;
mod parquet;
mod pdf;
mod png;
mod table;
mod units;

pub use band::{Band, binned, over_seeds};
pub use columns::LogColumns;
pub use figure::{FigurePanel, PanelLine, PaperFigure};
pub use format::FigureFormat;
pub use table::{LogTable, Points};
pub use units::axis_title;
