//! JavaScript libraries, bundled by `scripts/build-web`.

/// The parts of three.js that are listed in `three.js`, with its `OrbitControls`; defines `THREE`.
pub const THREE_JS: &str = include_str!("../vendor/three.min.js");

/// Chart library; defines `uPlot`.
pub const UPLOT_JS: &str = include_str!("../vendor/uplot.min.js");

/// The style sheet of `uPlot`.
pub const UPLOT_CSS: &str = include_str!("../vendor/uplot.min.css");
