//! Interactive figures: the script of a page (`assets/explore.js`) redraws them, so that readers can zoom, pan, hide
//! contenders, read values under the cursor, and replay flights in space.
//!
//! Each figure stores its packed data next to its SVG. The SVG is shown on paper and without JavaScript.

mod chart;
mod packed;
mod paths;
mod scene;

pub(crate) use chart::{ExplorableChart, LegendEntry, LineStyle, TimeSpan, TracePanel};
pub(crate) use paths::with_short_paths;
pub(crate) use scene::{ExplorableScene, TimedPose, rotors_on_a_circle_m};

use maud::{Markup, PreEscaped, html};
use serde::Serialize;

/// Data of an interactive figure.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(crate) enum Explorable {
    /// Panels above each other with a common time axis.
    Chart(ExplorableChart),
    /// Flights in space, with a slider over time.
    Scene(ExplorableScene),
}

const SCRIPT: &str = include_str!("../../assets/explore.js");
/// Style sheet of the interactive figures.
pub(crate) const STYLE: &str = include_str!("../../assets/explore.css");

/// Attributes by which the script finds the data.
const CHART: &str = "data-explore=\"chart\"";
const SCENE: &str = "data-explore=\"scene\"";

impl Explorable {
    /// Returns the figure's data as an element to put next to its picture.
    pub(crate) fn markup(&self) -> Markup {
        let kind = match self {
            Explorable::Chart(_) => "chart",
            Explorable::Scene(_) => "scene",
        };
        // A structure of only numbers and text can always be serialized.
        let json = serde_json::to_vec(self).unwrap_or_default();
        html! { script type="text/plain" data-explore=(kind) { (PreEscaped(packed::text(&json))) } }
    }
}

/// Returns the scripts that a page with this body needs; none without an interactive figure.
pub(crate) fn scripts(body: &Markup) -> Markup {
    let (charts, scenes) = (body.0.contains(CHART), body.0.contains(SCENE));
    let library = |name: &str, text: &str| {
        html! { script type="text/plain" data-library=(name) { (PreEscaped(packed::text(text.as_bytes()))) } }
    };
    html! {
        @if charts || scenes {
            (library("uPlot", afbc_web::UPLOT_JS))
            @if scenes { (library("THREE", afbc_web::THREE_JS)) }
            style { (PreEscaped(afbc_web::UPLOT_CSS)) }
            script { (PreEscaped(afbc_web::fit_script())) (PreEscaped(SCRIPT)) }
        }
    }
}
