//! Counterparts of the paper's Figs. 4 to 8 as SVG, all contenders of one scenario overlaid.
//!
//! Gusts are marked where they strike, and shaded is for how long something is the matter. A contender has the same colour
//! in every figure, whoever else is in it.

pub(super) mod campaign;
mod canvas;
pub(super) mod compare;
mod marks;
mod palette;
mod reduce;
mod time_chart;
mod trajectory;

use super::words;
use afbc_sim::flight::Sample;
use afbc_sim::flown::Flown;
use afbc_sim::metrics::{inputs, tracking_error};
use canvas::Ink;
use nalgebra::Vector4;
use plotters::style::RGBColor;
use std::io;
use time_chart::{Chart, Line, Panel};

/// One picture.
pub(super) struct Figure {
    /// File name without `.svg`.
    pub(super) name: &'static str,
    /// What there is to see, in one sentence.
    pub(super) caption: String,
    /// The picture.
    pub(super) svg: String,
}

/// Said of figures with a cross.
const CROSS: &str = " A cross: where a vehicle was lost.";

/// Corners of the mark of contender number `index` around its middle, in drawing units: with colours, marks tell
/// contenders apart for those who see no colours.
fn marker(index: usize, px: f64) -> Vec<(i32, i32)> {
    // Corners around the middle, the direction of the first in turns, and how far out every second one is.
    const SHAPES: [(usize, f64, f64); 6] =
        [(16, 0.0, 0.85), (4, 0.125, 1.0), (3, -0.25, 1.0), (4, 0.0, 1.0), (8, 0.0, 0.35), (3, 0.25, 1.0)];
    let (corners, turn, second) = *SHAPES.get(index % SHAPES.len()).unwrap_or(&SHAPES[0]);
    let corner = |i: usize| {
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * (i as f64 / corners as f64 + turn));
        let out = 1.15 * px * if i % 2 == 1 { second } else { 1.0 };
        (canvas::units(out * cos), canvas::units(out * sin))
    };
    (0..corners).map(corner).collect()
}

/// What should be flown.
const REFERENCE: Ink = Ink::new(palette::WANTED, 4.0);
/// Width of a law's line.
const LINE_PX: f64 = 1.3;

/// One law's flight, with what its lines are drawn in.
struct Law<'a> {
    flight: &'a Flown,
    ink: Ink,
}

impl Law<'_> {
    fn ink(&self) -> Ink {
        self.ink
    }

    fn color(&self) -> RGBColor {
        self.ink.color
    }

    /// Wide and pale: what this law wants, behind what it gets.
    fn pale(&self) -> Ink {
        Ink { opacity: 1.0 / 3.0, ..Ink::new(self.color(), REFERENCE.width_px) }
    }

    /// The name, for the legend.
    fn title(&self) -> String {
        let title = self.flight.run.contender.title();
        match &self.flight.run.lost {
            Some(lost) => format!("{title} (lost at {:.1} s)", lost.time_s),
            None => title.into(),
        }
    }

    fn lost_s(&self) -> Option<f64> {
        self.flight.run.lost.map(|lost| lost.time_s)
    }

    /// A value over time; `end_s` is the end of the time axis.
    fn line(&self, ink: Ink, end_s: f64, value: impl Fn(&Sample) -> f64) -> Line {
        self.drawn(ink, end_s, self.flight.run.log.iter().map(|sample| (sample.time_s, value(sample))))
    }

    /// One of U1..U4 over time, with what it did between the rows of the log.
    fn input(&self, end_s: f64, input: Input) -> Line {
        let rows = self.flight.run.log.iter().zip(&self.flight.run.input_extremes);
        let values = rows.flat_map(|(sample, [low, high])| {
            [input(low), input(high), input(&inputs(sample))].map(|u| (sample.time_s, u))
        });
        self.drawn(self.ink(), end_s, values)
    }

    fn drawn(&self, ink: Ink, end_s: f64, values: impl Iterator<Item = (f64, f64)>) -> Line {
        Line {
            ink,
            points: reduce::envelope(values, end_s, time_chart::COLUMNS),
            lost_s: self.lost_s(),
            is_reference: false,
        }
    }
}

/// Something to draw over time.
type Value = fn(&Sample) -> f64;
/// One of U1..U4.
type Input = fn(&Vector4<f64>) -> f64;

/// Fig. 5: label, what is flown, what is wanted.
const OUTPUTS: [(&str, Value, Value); 4] = [
    ("x [m]", |s| s.motion.position_m.x, |s| s.reference.position_m.x),
    ("y [m]", |s| s.motion.position_m.y, |s| s.reference.position_m.y),
    ("z [m]", |s| s.motion.position_m.z, |s| s.reference.position_m.z),
    ("ψ [rad]", |s| s.motion.attitude_rad.z, |s| s.reference.yaw_rad),
];
/// Fig. 6: likewise, but each law wants its own.
const ATTITUDE: [(&str, Value, Value); 2] = [
    ("φ [rad]", |s| s.motion.attitude_rad.x, |s| s.command.filtered[0].angle.into()),
    ("θ [rad]", |s| s.motion.attitude_rad.y, |s| s.command.filtered[1].angle.into()),
];
/// Fig. 7. The space that does not break is also one that does not vanish behind a subscript.
const ERRORS: [(&str, Value); 4] = [
    ("x⟨d⟩\u{a0}− x [m]", |s| tracking_error(s).x),
    ("y⟨d⟩\u{a0}− y [m]", |s| tracking_error(s).y),
    ("z⟨d⟩\u{a0}− z [m]", |s| tracking_error(s).z),
    ("ψ⟨d⟩\u{a0}− ψ [rad]", |s| tracking_error(s).w),
];
/// Fig. 8.
const INPUTS: [(&str, Input); 4] = [("U₁ [N]", |u| u.x), ("U₂ [N]", |u| u.y), ("U₃ [N]", |u| u.z), ("U₄ [N]", |u| u.w)];

/// Fig. 7 alone.
pub(super) fn errors(flights: &[&Flown]) -> io::Result<Option<Figure>> {
    let fig7 = draw(flights)?.into_iter().find(|figure| figure.name == "fig7-errors");
    Ok(fig7.map(|figure| Figure { name: "errors", ..figure }))
}

/// Draws every figure of one scenario's flights; of no flight, none.
pub(super) fn draw(flights: &[&Flown]) -> io::Result<Vec<Figure>> {
    // The longest flight has met the most of the reference.
    let Some(longest) = flights.iter().max_by_key(|flight| flight.run.log.len()) else { return Ok(Vec::new()) };
    let scenario = &longest.scenario;
    let last_s = longest.run.log.last().map_or(0.0, |last| last.time_s);
    let end_s = if last_s > 0.0 { last_s } else { scenario.duration_s };
    let names: Vec<&str> = flights.iter().map(|flight| flight.run.contender.name.as_str()).collect();
    let inks = canvas::inks(&names, LINE_PX);
    let laws: Vec<Law> = flights.iter().zip(inks).map(|(flight, ink)| Law { flight, ink }).collect();
    // The roughest behind, so that it hides nothing.
    let mut rough_first: Vec<&Law> = laws.iter().collect();
    let roughness = |law: &Law| law.flight.run.metrics.mean_abs_delta_u.sum();
    rough_first.sort_by(|a, b| roughness(b).total_cmp(&roughness(a)));
    let each = |value: Value| rough_first.iter().map(move |law| law.line(law.ink(), end_s, value));

    let reference = Law { flight: longest, ink: REFERENCE };
    let outputs = OUTPUTS.map(|(label, value, wanted)| {
        let wanted = Line { lost_s: None, is_reference: true, ..reference.line(REFERENCE, end_s, wanted) };
        Panel { label, zero: false, lines: core::iter::once(wanted).chain(each(value)).collect() }
    });
    let attitude = ATTITUDE.map(|(label, value, wanted)| {
        let wanted = |law: &&Law| Line { is_reference: true, ..law.line(law.pale(), end_s, wanted) };
        Panel { label, zero: true, lines: rough_first.iter().map(wanted).chain(each(value)).collect() }
    });
    let errors = ERRORS.map(|(label, value)| Panel { label, zero: true, lines: each(value).collect() });
    let controls = INPUTS.map(|(label, input)| Panel {
        label,
        zero: true,
        lines: rough_first.iter().map(|law| law.input(end_s, input)).collect(),
    });

    let law_legend = || laws.iter().map(|law| (law.title(), law.ink()));
    let with_reference = || core::iter::once(("reference".to_owned(), REFERENCE)).chain(law_legend()).collect();
    let with_desired = laws.iter().flat_map(|law| {
        let desired = format!("{} φ⟨d⟩, θ⟨d⟩", law.flight.run.contender.title());
        [(law.title(), law.ink()), (desired, law.pale())]
    });

    let conditions = format!("{}: {}", scenario.name, words::conditions(scenario));
    let chatter = controls.iter().any(|panel| panel.has_chatter(end_s));
    let chart = |name, caption: &str, title, legend, panels| {
        let (svg, seen) = Chart { title, conditions: &conditions, scenario, end_s, legend, panels }.draw()?;
        Ok::<_, io::Error>(Figure { name, caption: format!("{caption}{seen}"), svg })
    };
    let jumps = if chatter { " A filled band is chatter: the input jumps between its edges." } else { "" };
    let (trajectory, seen) = trajectory::draw(&laws, longest, &conditions, with_reference())?;
    Ok(vec![
        Figure { name: "fig4-trajectory", caption: format!("The flights in space.{seen}"), svg: trajectory },
        chart(
            "fig5-outputs",
            "Position and yaw against their reference.",
            "Outputs",
            with_reference(),
            outputs.into(),
        )?,
        chart(
            "fig6-attitude",
            "Roll and pitch against the angles that the position loop asks for.",
            "Roll and pitch",
            with_desired.collect(),
            attitude.into(),
        )?,
        chart("fig7-errors", "Reference minus vehicle.", "Errors", law_legend().collect(), errors.into())?,
        chart(
            "fig8-inputs",
            &format!("Inputs as the rotors give them.{jumps}"),
            "Inputs",
            law_legend().collect(),
            controls.into(),
        )?,
    ])
}
