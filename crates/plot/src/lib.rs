//! Draws figures for papers from logs: columns of CSV, Parquet, ULog and MCAP files as SVG, PDF or PNG of a given
//! width.
//!
//! A [`PaperFigure`] is laid out as a drawing in points of 1/72 inch, and each format writes this drawing. The font in
//! `font/` measures all texts and gives their outlines in PDF and PNG. No system fonts are used, so the same figure has
//! the same bytes on every machine, and no fonts are embedded.
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
