//! The libraries, as `scripts/build-web` bundles them.

/// The parts of three.js listed in `three.js`, with its `OrbitControls`; a script that defines `THREE`.
pub const THREE_JS: &str = include_str!("../vendor/three.min.js");

/// A script that defines `uPlot`.
pub const UPLOT_JS: &str = include_str!("../vendor/uplot.min.js");

/// The style sheet of `uPlot`.
pub const UPLOT_CSS: &str = include_str!("../vendor/uplot.min.css");
