//! Files of the page that shows a vehicle.

use crate::vendor::{THREE_JS, UPLOT_CSS, UPLOT_JS};

/// One file of the page.
#[derive(Clone, Debug)]
pub struct PageFile {
    /// Path of the file, relative to the page's address.
    pub path: &'static str,
    /// Media type (MIME).
    pub media: &'static str,
    /// Contents of the file.
    pub text: String,
}

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const HEAD: &str = r#"<link rel="stylesheet" href="uplot.min.css"><link rel="stylesheet" href="style.css">"#;
const TAIL: &str = r#"<script src="three.min.js"></script><script src="uplot.min.js"></script>
<script type="module" src="socket-main.js"></script>"#;

/// JavaScript module with functions for axis ranges, ticks and camera positions.
const FIT_JS: &str = include_str!("../page/fit.js");

/// Returns the functions of `fit.js` as a plain script, for a page without modules.
pub fn fit_script() -> &'static str {
    FIT_JS.split_once("\nexport ").map_or(FIT_JS, |(functions, _)| functions)
}

/// Returns the page's files for a server that has a WebSocket at `/socket`. `scripts/build-playground` makes the page
/// without one.
pub fn page_files() -> Vec<PageFile> {
    let index = include_str!("../page/index.html").replace("<!-- head -->", HEAD).replace("<!-- tail -->", TAIL);
    let files = [
        ("three.min.js", SCRIPT, THREE_JS),
        ("uplot.min.js", SCRIPT, UPLOT_JS),
        ("uplot.min.css", STYLE, UPLOT_CSS),
        ("style.css", STYLE, include_str!("../page/style.css")),
        ("app.js", SCRIPT, include_str!("../page/app.js")),
        ("charts.js", SCRIPT, include_str!("../page/charts.js")),
        ("fit.js", SCRIPT, FIT_JS),
        ("parameters.js", SCRIPT, include_str!("../page/parameters.js")),
        ("scene.js", SCRIPT, include_str!("../page/scene.js")),
        ("socket-engine.js", SCRIPT, include_str!("../page/socket-engine.js")),
        ("socket-main.js", SCRIPT, include_str!("../page/socket-main.js")),
    ];
    let index = PageFile { path: "", media: "text/html; charset=utf-8", text: index };
    let files = files.map(|(path, media, text)| PageFile { path, media, text: text.to_owned() });
    std::iter::once(index).chain(files).collect()
}
