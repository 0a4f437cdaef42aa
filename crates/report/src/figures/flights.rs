//! Counterparts of the paper's Figs. 4 to 8, with all contenders of one scenario in the same figure.

use super::marks::marks;
use super::picture::Picture;
use super::plotted_flight::{LINE_PX, PlottedFlight, REFERENCE};
use super::time_chart::{ChartLine, ChartPanel, PLOT_PX, TimeChart};
use super::{canvas, trajectory};
use crate::words;
use afbc_sim::flight::{EstimateErrors, Sample};
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::tracking_error;
use nalgebra::Vector4;

/// A quantity of a log row.
type RowValue = fn(&Sample) -> f64;
/// One of U1..U4.
type InputValue = fn(&Vector4<f64>) -> f64;

/// Fig. 5: label, actual value, reference.
const OUTPUTS: [(&str, RowValue, RowValue); 4] = [
    ("x [m]", |s| s.motion.position_m.x, |s| s.reference.position_m.x),
    ("y [m]", |s| s.motion.position_m.y, |s| s.reference.position_m.y),
    ("z [m]", |s| s.motion.position_m.z, |s| s.reference.position_m.z),
    ("ψ [rad]", |s| s.motion.attitude_rad.z, |s| s.reference.yaw_rad),
];
/// Fig. 6: label, actual value, and the angle that the law demands.
const ATTITUDE: [(&str, RowValue, RowValue); 2] = [
    ("φ [rad]", |s| s.motion.attitude_rad.x, |s| s.trace.filtered[0].angle.into()),
    ("θ [rad]", |s| s.motion.attitude_rad.y, |s| s.trace.filtered[1].angle.into()),
];
/// Fig. 7: label, error. No-break spaces keep the space next to a subscript.
const ERRORS: [(&str, RowValue); 4] = [
    ("x⟨d⟩\u{a0}− x [m]", |s| tracking_error(s).x),
    ("y⟨d⟩\u{a0}− y [m]", |s| tracking_error(s).y),
    ("z⟨d⟩\u{a0}− z [m]", |s| tracking_error(s).z),
    ("ψ⟨d⟩\u{a0}− ψ [rad]", |s| tracking_error(s).w),
];
/// A coordinate of the vehicle's own estimate: label, error and standard deviation.
type EstimateCoordinate = (&'static str, fn(&EstimateErrors) -> f32, fn(&EstimateErrors) -> f32);

/// Errors of the estimate, which are small: in centimetres and degrees.
const ESTIMATE: [EstimateCoordinate; 9] = [
    ("x [cm]", |e| 100.0 * e.position_error_m.x, |e| 100.0 * e.position_sigma_m.x),
    ("y [cm]", |e| 100.0 * e.position_error_m.y, |e| 100.0 * e.position_sigma_m.y),
    ("z [cm]", |e| 100.0 * e.position_error_m.z, |e| 100.0 * e.position_sigma_m.z),
    ("v⟨x⟩ [cm/s]", |e| 100.0 * e.velocity_error_m_s.x, |e| 100.0 * e.velocity_sigma_m_s.x),
    ("v⟨y⟩ [cm/s]", |e| 100.0 * e.velocity_error_m_s.y, |e| 100.0 * e.velocity_sigma_m_s.y),
    ("v⟨z⟩ [cm/s]", |e| 100.0 * e.velocity_error_m_s.z, |e| 100.0 * e.velocity_sigma_m_s.z),
    ("about x [°]", |e| e.attitude_error_rad.x.to_degrees(), |e| e.attitude_sigma_rad.x.to_degrees()),
    ("about y [°]", |e| e.attitude_error_rad.y.to_degrees(), |e| e.attitude_sigma_rad.y.to_degrees()),
    ("about z [°]", |e| e.attitude_error_rad.z.to_degrees(), |e| e.attitude_sigma_rad.z.to_degrees()),
];
/// Fig. 8: label, input.
const INPUTS: [(&str, InputValue); 4] =
    [("U₁ [N]", |u| u.x), ("U₂ [N]", |u| u.y), ("U₃ [N]", |u| u.z), ("U₄ [N]", |u| u.w)];

/// Draws the figures in `names`, in that order. Each pair is a figure's name and its new name.
pub(crate) fn named(flights: &[&ScenarioFlight], names: &[(&str, &'static str)]) -> Vec<Picture> {
    let mut figures = draw(flights);
    let take = |(figure, name): &(&str, &'static str)| {
        let index = figures.iter().position(|drawn| drawn.name == *figure)?;
        Some(Picture { name, ..figures.swap_remove(index) })
    };
    names.iter().filter_map(take).collect()
}

/// Draws all figures of one scenario's flights; none without flights.
pub(crate) fn draw(flights: &[&ScenarioFlight]) -> Vec<Picture> {
    // The longest flight covers most of the reference.
    let Some(longest) = flights.iter().max_by_key(|flight| flight.run.log.len()) else { return Vec::new() };
    let scenario = &longest.scenario;
    let last_s = longest.run.log.last().map_or(0.0, |last| last.time_s);
    let end_s = if last_s > 0.0 { last_s } else { scenario.duration_s };
    let names: Vec<&str> = flights.iter().map(|flight| flight.run.contender.name.as_str()).collect();
    let inks = canvas::inks(&names, LINE_PX);
    let laws: Vec<PlottedFlight> =
        flights.iter().zip(inks).map(|(flight, ink)| PlottedFlight { flight, ink }).collect();
    // Draw the roughest lines first, so that they hide nothing.
    let mut rough_first: Vec<&PlottedFlight> = laws.iter().collect();
    let roughness = |law: &PlottedFlight| law.flight.run.metrics.mean_abs_delta_u.sum();
    rough_first.sort_by(|a, b| roughness(b).total_cmp(&roughness(a)));
    let each = |value: RowValue| rough_first.iter().map(move |law| law.line(law.ink(), end_s, value));

    let reference = PlottedFlight { flight: longest, ink: REFERENCE };
    let outputs = OUTPUTS.map(|(label, value, wanted)| {
        let wanted = ChartLine { lost_s: None, is_reference: true, ..reference.line(REFERENCE, end_s, wanted) };
        ChartPanel { label, zero: false, lines: core::iter::once(wanted).chain(each(value)).collect() }
    });
    let attitude = ATTITUDE.map(|(label, value, wanted)| {
        let wanted = |law: &&PlottedFlight| ChartLine { is_reference: true, ..law.line(law.pale(), end_s, wanted) };
        ChartPanel { label, zero: true, lines: rough_first.iter().map(wanted).chain(each(value)).collect() }
    });
    let errors = ERRORS.map(|(label, value)| ChartPanel { label, zero: true, lines: each(value).collect() });
    let controls = INPUTS.map(|(label, input)| ChartPanel {
        label,
        zero: true,
        lines: rough_first.iter().map(|law| law.input(end_s, input)).collect(),
    });

    let of =
        |sample: &Sample, value: fn(&EstimateErrors) -> f32| sample.estimated.map_or(f64::NAN, |e| value(&e).into());
    let estimate = ESTIMATE.map(|(label, error, sigma)| {
        let band = |law: &&PlottedFlight| {
            let edge = |sign: f64| law.line(law.pale(), end_s, move |s| sign * 3.0 * of(s, sigma));
            [1.0, -1.0].map(|sign| ChartLine { is_reference: true, ..edge(sign) })
        };
        let lines = rough_first.iter().flat_map(band);
        ChartPanel {
            label,
            zero: true,
            lines: lines.chain(rough_first.iter().map(|law| law.line(law.ink(), end_s, |s| of(s, error)))).collect(),
        }
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
        let marks = marks(scenario, end_s, PLOT_PX);
        TimeChart { title, conditions: &conditions, marks, end_s, legend, panels }.picture(name, caption)
    };
    let jumps = if chatter { " Filled band: chatter, the input jumps between its edges." } else { "" };
    let mut pictures = vec![
        trajectory::picture(&laws, longest, &conditions, with_reference()),
        chart("fig5-outputs", "Position and yaw against their reference.", "Outputs", with_reference(), outputs.into()),
        chart(
            "fig6-attitude",
            "Roll and pitch against the angles demanded by the position loop.",
            "Roll and pitch",
            with_desired.collect(),
            attitude.into(),
        ),
        chart("fig7-errors", "Reference minus vehicle.", "Errors", law_legend().collect(), errors.into()),
        chart(
            "fig8-inputs",
            &format!("Inputs as produced by the rotors.{jumps}"),
            "Inputs",
            law_legend().collect(),
            controls.into(),
        ),
    ];
    if scenario.instruments.imu.is_some() {
        let caption =
            "The vehicle's own estimate: truth minus estimate, and three times its standard deviation (pale).";
        let panels = estimate.into();
        pictures.push(chart("fig9-estimate", caption, "Estimate", law_legend().collect(), panels));
    }
    pictures
}
