//! Lines of a flight in a figure.

use super::canvas::Ink;
use super::time_chart::{self, ChartLine};
use super::{palette, reduce};
use afbc_drawing::Rgb;
use afbc_sim::flight::Sample;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::inputs;
use nalgebra::Vector4;

/// Line style of the reference.
pub(super) const REFERENCE: Ink = Ink::new(palette::WANTED, 4.0);
/// Width of a law's line.
pub(super) const LINE_PX: f64 = 1.3;

/// A law's flight, with the style of its lines.
pub(super) struct PlottedFlight<'a> {
    pub(super) flight: &'a ScenarioFlight,
    pub(super) ink: Ink,
}

impl PlottedFlight<'_> {
    pub(super) fn ink(&self) -> Ink {
        self.ink
    }

    pub(super) fn color(&self) -> Rgb {
        self.ink.color
    }

    /// Returns the wide and pale style of values that this law demands, which are drawn behind its actual values.
    pub(super) fn pale(&self) -> Ink {
        Ink { opacity: 1.0 / 3.0, ..Ink::new(self.color(), REFERENCE.width_px) }
    }

    /// Returns the name for the legend.
    pub(super) fn title(&self) -> String {
        let title = self.flight.run.contender.title();
        match &self.flight.run.lost {
            Some(lost) => format!("{title} (lost at {:.1} s)", lost.time_s),
            None => title.into(),
        }
    }

    pub(super) fn lost_s(&self) -> Option<f64> {
        self.flight.run.lost.map(|lost| lost.time_s)
    }

    /// Returns a line of a value over time; `end_s` is the end of the time axis.
    pub(super) fn line(&self, ink: Ink, end_s: f64, value: impl Fn(&Sample) -> f64) -> ChartLine {
        self.drawn(ink, end_s, self.flight.run.log.iter().map(|sample| (sample.time_s, value(sample))))
    }

    /// Returns a line of one of U1..U4 over time, including its extremes between the rows of the log.
    pub(super) fn input(&self, end_s: f64, input: impl Fn(&Vector4<f64>) -> f64) -> ChartLine {
        let rows = self.flight.run.log.iter().zip(&self.flight.run.input_extremes);
        let values = rows.flat_map(|(sample, [low, high])| {
            [input(low), input(high), input(&inputs(sample))].map(|u| (sample.time_s, u))
        });
        self.drawn(self.ink(), end_s, values)
    }

    fn drawn(&self, ink: Ink, end_s: f64, values: impl Iterator<Item = (f64, f64)>) -> ChartLine {
        ChartLine {
            ink,
            points: reduce::envelope(values, end_s, ink.columns(time_chart::FINE_PX)),
            lost_s: self.lost_s(),
            is_reference: false,
        }
    }
}
