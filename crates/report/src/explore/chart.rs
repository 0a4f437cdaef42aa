//! A chart over time.

use super::packed::deltas;
use serde::Serialize;

/// Grid steps along the time axis, and along a panel's value axis.
const TIME_STEPS: f64 = 1e6;
const VALUE_STEPS: f64 = 16_384.0;

/// A chart over time, in the form that the page's script reads.
#[derive(Serialize)]
pub(crate) struct ExplorableChart {
    pub(crate) title: String,
    pub(crate) end_s: f64,
    pub(crate) legend: Vec<LegendEntry>,
    pub(crate) panels: Vec<TracePanel>,
    /// Events: shaded intervals, or instants if both ends are equal.
    pub(crate) spans: Vec<TimeSpan>,
}

/// Style of a line.
#[derive(Clone, PartialEq, Serialize)]
pub(crate) struct LineStyle {
    /// Colour on white, and in dark mode.
    pub(crate) colors: [String; 2],
    pub(crate) width_px: f64,
    pub(crate) opacity: f64,
    /// Lengths of dashes and gaps; empty for a solid line.
    pub(crate) dash_px: Vec<f64>,
}

/// Name of a legend entry, with the style of its lines; `⟨d⟩` is a subscript.
#[derive(Serialize)]
pub(crate) struct LegendEntry {
    pub(crate) name: String,
    #[serde(flatten)]
    pub(crate) pen: LineStyle,
}

/// A time interval with its label.
#[derive(Serialize)]
pub(crate) struct TimeSpan {
    pub(crate) label: String,
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    pub(crate) colors: [String; 2],
}

/// A panel with one quantity.
#[derive(Serialize)]
pub(crate) struct TracePanel {
    /// Label of the panel; `⟨d⟩` is a subscript.
    pub(crate) label: String,
    /// Ends of the value axis while the whole time range is visible.
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) traces: Vec<PanelTrace>,
}

/// A line. Its points are stored as differences on a grid: times in millionths of the chart's duration, values in 2^-14
/// of the panel's range, counted from its lower end.
#[derive(Serialize)]
pub(crate) struct PanelTrace {
    /// Index of the legend entry that hides and shows the line.
    entry: Option<usize>,
    #[serde(flatten)]
    pen: LineStyle,
    times: Vec<i64>,
    values: Vec<i64>,
}

impl TracePanel {
    /// Adds a line on a time axis from 0 to `end_s`.
    pub(crate) fn add(&mut self, entry: Option<usize>, pen: LineStyle, points: &[(f64, f64)], end_s: f64) {
        self.traces.push(PanelTrace {
            entry,
            pen,
            times: deltas(points.iter().map(|point| point.0), 0.0, end_s, TIME_STEPS),
            values: deltas(points.iter().map(|point| point.1), self.low, self.high, VALUE_STEPS),
        });
    }
}
