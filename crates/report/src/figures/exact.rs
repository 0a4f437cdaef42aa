//! Figures of an exact log's replay: quantities as flown, and under the changed settings.

use super::canvas::Ink;
use super::marks::moments;
use super::picture::Picture;
use super::plotted_flight::{LINE_PX, REFERENCE};
use super::time_chart::{ChartLine, ChartPanel, FINE_PX, PLOT_PX, TimeChart};
use super::{palette, reduce};
use crate::explore::{ExplorableScene, TimedPose, rotors_on_a_circle_m};
use afbc_replay::exact::{ChangeRow, ExactReplay, QUANTITIES};
use nalgebra::Vector3;

/// A panel: its label, the name of its quantity, and the factor to the panel's unit.
type ExactPanel = (&'static str, &'static str, f64);

const DEGREES: f64 = 180.0 / core::f64::consts::PI;
const MOTORS: [ExactPanel; 8] = [
    ("ω⟨1⟩ [rad/s]", "omega1_rad_s", 1.0),
    ("ω⟨2⟩ [rad/s]", "omega2_rad_s", 1.0),
    ("ω⟨3⟩ [rad/s]", "omega3_rad_s", 1.0),
    ("ω⟨4⟩ [rad/s]", "omega4_rad_s", 1.0),
    ("ω⟨5⟩ [rad/s]", "omega5_rad_s", 1.0),
    ("ω⟨6⟩ [rad/s]", "omega6_rad_s", 1.0),
    ("ω⟨7⟩ [rad/s]", "omega7_rad_s", 1.0),
    ("ω⟨8⟩ [rad/s]", "omega8_rad_s", 1.0),
];
const DEMANDS: [ExactPanel; 7] = [
    ("φ⟨d⟩ [°]", "roll_setpoint_rad", DEGREES),
    ("θ⟨d⟩ [°]", "pitch_setpoint_rad", DEGREES),
    ("ψ⟨d⟩ [°]", "yaw_setpoint_rad", DEGREES),
    ("U⟨4⟩ [N]", "u4_n", 1.0),
    ("U⟨1⟩ [N]", "u1_n", 1.0),
    ("U⟨2⟩ [N]", "u2_n", 1.0),
    ("U⟨3⟩ [N]", "u3_n", 1.0),
];
const ESTIMATE: [ExactPanel; 6] = [
    ("x [m]", "x_m", 1.0),
    ("y [m]", "y_m", 1.0),
    ("z [m]", "z_m", 1.0),
    ("φ [°]", "roll_rad", DEGREES),
    ("θ [°]", "pitch_rad", DEGREES),
    ("ψ [°]", "yaw_rad", DEGREES),
];

/// Draws every figure that has data.
pub(crate) fn draw(replay: &ExactReplay) -> Vec<Picture> {
    let Some(comparison) = &replay.comparison else { return Vec::new() };
    let rows = &comparison.rows;
    let end_s = rows.last().map_or(0.0, |row| row.time_s);
    let own = Ink::new(palette::color("afbc"), LINE_PX);
    let line = |ink: Ink, is_reference: bool, value: &dyn Fn(&ChangeRow) -> Option<f64>| {
        let points = rows.iter().filter_map(|row| Some((row.time_s, value(row)?)));
        ChartLine { ink, points: reduce::envelope(points, end_s, ink.columns(FINE_PX)), lost_s: None, is_reference }
    };
    let panel = |(label, name, factor): &ExactPanel| {
        let index = QUANTITIES.iter().position(|quantity| quantity.name == *name)?;
        let scaled =
            |value: Option<&f32>| value.filter(|value| value.is_finite()).map(|value| f64::from(*value) * factor);
        let panel = ChartPanel {
            label,
            zero: false,
            lines: vec![
                line(REFERENCE, true, &|row| scaled(row.flown.get(index))),
                line(own, false, &|row| scaled(row.changed.get(index))),
            ],
        };
        panel.lines.iter().any(|line| line.points.len() > 1).then_some(panel)
    };
    let conditions = format!("{} under {}", replay.vehicle, replay.law);
    let mut pictures = Vec::new();
    for (name, title, caption, panes) in [
        ("motors", "Rotor speeds", "Rotor speeds, commanded.", MOTORS.get(..replay.rotors).unwrap_or(&MOTORS)),
        ("demands", "Demands", "Desired attitude and heading, and the law's inputs before rotor limits.", &DEMANDS),
        ("estimate", "Estimate", "Estimated position and attitude.", &ESTIMATE),
    ] {
        let panels: Vec<ChartPanel> = panes.iter().filter_map(panel).collect();
        if end_s <= 0.0 || panels.is_empty() {
            continue;
        }
        let marks = moments(
            comparison.other_mode_s.map(|at_s| ("other mode".to_owned(), at_s)).into_iter(),
            end_s,
            PLOT_PX,
            " Thin line: the flight core changes to another mode.",
        );
        let legend = vec![("as flown".to_owned(), REFERENCE), ("changed".to_owned(), own)];
        let chart = TimeChart { title, conditions: &conditions, marks, end_s, legend, panels };
        pictures.push(chart.picture(name, caption));
    }
    pictures
}

/// Returns the estimate in space, as flown and under the changed settings.
pub(crate) fn space(replay: &ExactReplay) -> Option<ExplorableScene> {
    let rows = &replay.comparison.as_ref()?.rows;
    let index = |name: &str| QUANTITIES.iter().position(|quantity| quantity.name == name);
    let position = [index("x_m")?, index("y_m")?, index("z_m")?];
    let attitude = [index("roll_rad")?, index("pitch_rad")?, index("yaw_rad")?];
    let places = |values: fn(&ChangeRow) -> &[f32]| -> Vec<TimedPose> {
        let three = |row: &ChangeRow, [x, y, z]: [usize; 3]| {
            let value = |i: usize| values(row).get(i).filter(|value| value.is_finite()).map(|value| f64::from(*value));
            Some(Vector3::new(value(x)?, value(y)?, value(z)?))
        };
        rows.iter().filter_map(|row| Some((row.time_s, three(row, position)?, three(row, attitude)?))).collect()
    };
    let (flown, changed) = (places(|row| &row.flown), places(|row| &row.changed));
    let mut scene = ExplorableScene::around(flown.iter().chain(&changed), rotors_on_a_circle_m(replay.rotors))?;
    scene.add("as flown".to_owned(), REFERENCE.pen(), &flown, false);
    scene.add("changed".to_owned(), Ink::new(palette::color("afbc"), LINE_PX).pen(), &changed, false);
    Some(scene)
}
