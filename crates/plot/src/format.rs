//! File formats of a figure.

use crate::figure::PaperFigure;
use crate::layout::laid_out;
use crate::pdf::pdf;
use crate::png::png;
use afbc_drawing::{SvgStyle, SvgUnit};
use std::path::Path;

/// File format of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FigureFormat {
    /// Vector graphics for web pages and editors.
    Svg,
    /// Vector graphics for LaTeX.
    Pdf,
    /// Bitmap.
    Png {
        /// Pixels per inch.
        dpi: f64,
    },
}

impl FigureFormat {
    /// Returns the format for a file name's extension, if it is known. `dpi` applies to PNG.
    pub fn of(path: &Path, dpi: f64) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "svg" => Some(FigureFormat::Svg),
            "pdf" => Some(FigureFormat::Pdf),
            "png" => Some(FigureFormat::Png { dpi }),
            _ => None,
        }
    }
}

impl PaperFigure {
    /// Returns the contents of the figure's file. The same figure always gives the same bytes.
    ///
    /// # Errors
    /// Fails with one line if there is nothing to draw, or not enough room.
    pub fn write(&self, format: FigureFormat) -> Result<Vec<u8>, String> {
        let drawing = laid_out(self)?;
        Ok(match format {
            FigureFormat::Svg => {
                let fonts = "DejaVu Sans, Verdana, sans-serif";
                let style = SvgStyle { title: &self.title, unit: SvgUnit::Point, fonts, halo: 0.0, dark: &[] };
                drawing.svg(&style).into_bytes()
            }
            FigureFormat::Pdf => pdf(&drawing, &self.title),
            FigureFormat::Png { dpi } => png(&drawing, dpi)?,
        })
    }
}
