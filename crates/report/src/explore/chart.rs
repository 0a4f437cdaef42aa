//! A chart over time.

use super::packed::deltas;
use serde::Serialize;

/// Steps of the time axis, and of a panel's value axis.
const TIME_STEPS: f64 = 1e6;
const VALUE_STEPS: f64 = 16_384.0;

/// A chart over time, as the script draws it.
#[derive(Serialize)]
pub(crate) struct ExplorableChart {
    pub(crate) title: String,
    pub(crate) end_s: f64,
    pub(crate) legend: Vec<LegendEntry>,
    pub(crate) panels: Vec<TracePanel>,
    /// Events: shaded intervals, or moments if both ends are the same.
    pub(crate) spans: Vec<Span>,
}

/// A line's style.
#[derive(Clone, PartialEq, Serialize)]
pub(crate) struct Pen {
    /// Colour on white, and in the dark.
    pub(crate) colors: [String; 2],
    pub(crate) width_px: f64,
    pub(crate) opacity: f64,
    /// Lengths on and off; solid if empty.
    pub(crate) dash_px: Vec<f64>,
}

/// A name, and the style of its lines; `⟨d⟩` is a subscript.
#[derive(Serialize)]
pub(crate) struct LegendEntry {
    pub(crate) name: String,
    #[serde(flatten)]
    pub(crate) pen: Pen,
}

/// An interval with its label.
#[derive(Serialize)]
pub(crate) struct Span {
    pub(crate) label: String,
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    pub(crate) colors: [String; 2],
}

/// A panel with one quantity.
#[derive(Serialize)]
pub(crate) struct TracePanel {
    /// `⟨d⟩` is a subscript.
    pub(crate) label: String,
    /// Range of the axis while all of the time is seen.
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) traces: Vec<Trace>,
}

/// A line: points as differences on a grid, time in millionths of the chart's duration, values in 2^-14 of the
/// panel's range, from its low end.
#[derive(Serialize)]
pub(crate) struct Trace {
    /// Index of its entry in the legend, by which it is hidden.
    entry: Option<usize>,
    #[serde(flatten)]
    pen: Pen,
    times: Vec<i64>,
    values: Vec<i64>,
}

impl TracePanel {
    /// Adds a line over a time axis from 0 to `end_s`.
    pub(crate) fn add(&mut self, entry: Option<usize>, pen: Pen, points: &[(f64, f64)], end_s: f64) {
        self.traces.push(Trace {
            entry,
            pen,
            times: deltas(points.iter().map(|point| point.0), 0.0, end_s, TIME_STEPS),
            values: deltas(points.iter().map(|point| point.1), self.low, self.high, VALUE_STEPS),
        });
    }
}
