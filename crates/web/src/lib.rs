//! What pages are made of, each file as one text to be put into a page or served beside it, so that it needs no
//! network: three.js (MIT) for the vehicle in three dimensions and uPlot (MIT) for charts over time, and the page that
//! shows a vehicle ([`page_files`]). `scripts/build-web` bundles the libraries from the versions in `package.json`; their
//! licences are beside them, in `vendor`.

#![forbid(unsafe_code)]

mod page;

pub use page::{PageFile, page_files};

/// The parts of three.js listed in `three.js`, with its `OrbitControls`; a script that defines `THREE`.
pub const THREE_JS: &str = include_str!("../vendor/three.min.js");

/// A script that defines `uPlot`.
pub const UPLOT_JS: &str = include_str!("../vendor/uplot.min.js");

/// The style sheet of `uPlot`.
pub const UPLOT_CSS: &str = include_str!("../vendor/uplot.min.css");
