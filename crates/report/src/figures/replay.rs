//! Figures of a replayed log: its estimate, ours, and the difference.

use super::canvas::Ink;
use super::marks::moments;
use super::picture::Picture;
use super::plotted_flight::{LINE_PX, REFERENCE};
use super::time_chart::{ChartLine, ChartPanel, FINE_PX, PLOT_PX, TimeChart};
use super::{palette, reduce};
use crate::explore::{ExplorableScene, TimedPose, rotors_on_a_circle_m};
use afbc_estimator::Estimate;
use afbc_replay::{LoggedState, Recording, ReplayRow, Replayed};
use afbc_types::State;
use nalgebra::{Quaternion, Vector3};

/// Largest number of resets that are marked.
const MARKS_MAX: usize = 10;

/// A panel's label, our value, and the log's value.
type ComparedPanel = (&'static str, fn(&Estimate) -> f32, fn(&LoggedState) -> Option<f32>);

const ATTITUDE: [ComparedPanel; 3] = [
    ("φ [°]", |e| e.state.attitude_rad.x.to_degrees(), |l| angle(l, |a| a.x)),
    ("θ [°]", |e| e.state.attitude_rad.y.to_degrees(), |l| angle(l, |a| a.y)),
    ("ψ [°]", |e| e.state.attitude_rad.z.to_degrees(), |l| angle(l, |a| a.z)),
];
const VELOCITY: [ComparedPanel; 3] = [
    ("v⟨x⟩ [m/s]", |e| e.state.velocity_m_s.x, |l| l.velocity_m_s.map(|v| v.x)),
    ("v⟨y⟩ [m/s]", |e| e.state.velocity_m_s.y, |l| l.velocity_m_s.map(|v| v.y)),
    ("v⟨z⟩ [m/s]", |e| e.state.velocity_m_s.z, |l| l.velocity_m_s.map(|v| v.z)),
];
const POSITION: [ComparedPanel; 3] = [
    ("x [m]", |e| e.state.position_m.x, |l| l.position_m.map(|p| p.x)),
    ("y [m]", |e| e.state.position_m.y, |l| l.position_m.map(|p| p.y)),
    ("z [m]", |e| e.state.position_m.z, |l| l.position_m.map(|p| p.z)),
];

/// A panel's label, the log's value minus ours, our standard deviation, and whether our value is valid.
type DifferencePanel =
    (&'static str, fn(&ReplayRow, &Estimate) -> Option<f64>, fn(&Estimate) -> f32, fn(&Estimate) -> bool);

const DIFFERENCE: [DifferencePanel; 9] = [
    ("x [m]", |r, e| position(r, e).map(|d| d.x), |e| e.sigmas.position_m.x, |e| e.validity.position),
    ("y [m]", |r, e| position(r, e).map(|d| d.y), |e| e.sigmas.position_m.y, |e| e.validity.position),
    ("z [m]", |r, e| position(r, e).map(|d| d.z), |e| e.sigmas.position_m.z, |e| e.validity.height),
    ("v⟨x⟩ [m/s]", |r, e| velocity(r, e).map(|d| d.x), |e| e.sigmas.velocity_m_s.x, |e| e.validity.velocity),
    ("v⟨y⟩ [m/s]", |r, e| velocity(r, e).map(|d| d.y), |e| e.sigmas.velocity_m_s.y, |e| e.validity.velocity),
    ("v⟨z⟩ [m/s]", |r, e| velocity(r, e).map(|d| d.z), |e| e.sigmas.velocity_m_s.z, |e| e.validity.velocity),
    (
        "about x [°]",
        |r, _| rotation_component(r, |t| t.x),
        |e| e.sigmas.attitude_rad.x.to_degrees(),
        |e| e.validity.attitude,
    ),
    (
        "about y [°]",
        |r, _| rotation_component(r, |t| t.y),
        |e| e.sigmas.attitude_rad.y.to_degrees(),
        |e| e.validity.attitude,
    ),
    (
        "about z [°]",
        |r, _| rotation_component(r, |t| t.z),
        |e| e.sigmas.attitude_rad.z.to_degrees(),
        |e| e.validity.heading,
    ),
];

fn angle(logged: &LoggedState, of: fn(&Vector3<f32>) -> f32) -> Option<f32> {
    let ([w, x, y, z], zero) = (logged.attitude?, Vector3::zeros());
    let state = State::from_quaternion(zero, zero, &Quaternion::new(w, x, y, z), zero)?;
    Some(of(&state.attitude_rad).to_degrees())
}

fn position(row: &ReplayRow, ours: &Estimate) -> Option<Vector3<f64>> {
    row.logged.position_m.map(|position| (position - ours.state.position_m).cast())
}

fn velocity(row: &ReplayRow, ours: &Estimate) -> Option<Vector3<f64>> {
    row.logged.velocity_m_s.map(|velocity| (velocity - ours.state.velocity_m_s).cast())
}

fn rotation_component(row: &ReplayRow, of: fn(&Vector3<f64>) -> f64) -> Option<f64> {
    row.rotation_rad().map(|rotation| of(&rotation).to_degrees())
}

/// Draws every figure that has data.
pub(crate) fn draw(recording: &Recording, replayed: &Replayed) -> Vec<Picture> {
    let rows = &replayed.rows;
    let end_s = rows.last().map_or(0.0, |row| row.time_s);
    let own = Ink::new(palette::color("afbc"), LINE_PX);
    let band = Ink { opacity: 1.0 / 3.0, ..Ink::new(palette::color("afbc"), REFERENCE.width_px) };
    let line = |ink: Ink, is_reference: bool, value: &dyn Fn(&ReplayRow) -> Option<f64>| {
        let points = rows.iter().filter_map(|row| Some((row.time_s, value(row)?)));
        ChartLine { ink, points: reduce::envelope(points, end_s, ink.columns(FINE_PX)), lost_s: None, is_reference }
    };
    let both = |(label, ours, theirs): ComparedPanel| ChartPanel {
        label,
        zero: false,
        lines: vec![
            line(REFERENCE, true, &|row| theirs(&row.logged).map(f64::from)),
            line(own, false, &|row| row.ours.as_ref().map(|e| ours(e).into())),
        ],
    };
    let difference = |(label, value, sigma, valid): DifferencePanel| {
        let edge = |sign: f32| {
            line(band, true, &|row| {
                let ours = row.ours.as_ref().filter(|e| valid(e))?;
                value(row, ours).map(|_| f64::from(sign * 3.0 * sigma(ours)))
            })
        };
        let inner = line(own, false, &|row| value(row, row.ours.as_ref().filter(|e| valid(e))?));
        ChartPanel { label, zero: true, lines: vec![edge(1.0), edge(-1.0), inner] }
    };
    let conditions = recording.format;
    let chart = |name, caption: &str, title, legend: &[(&str, Ink)], panels: Vec<ChartPanel>| {
        let first_us = recording.imu.first().map_or(0, |sample| sample.at_us);
        let reset =
            |reset: &afbc_replay::LoggedReset| (reset.what.to_owned(), (reset.at_us as f64 - first_us as f64) * 1e-6);
        let resets = recording.resets.iter().map(reset).filter(|(_, at_s)| *at_s >= 0.0).take(MARKS_MAX);
        let marks = moments(resets, end_s, PLOT_PX, " Thin line: reset of the log's own estimate.");
        let legend = legend.iter().map(|(name, ink)| ((*name).to_owned(), *ink)).collect();
        TimeChart { title, conditions, marks, end_s, legend, panels }.picture(name, caption)
    };
    let both_legend = [("log", REFERENCE), ("estimate", own)];
    let lines_drawn = |panels: &[ChartPanel]| {
        end_s > 0.0 && panels.iter().any(|panel| panel.lines.iter().any(|line| line.points.len() > 1))
    };
    let mut pictures = Vec::new();
    for (name, title, caption, pairs) in [
        ("attitude", "Attitude", "Roll, pitch and yaw.", ATTITUDE),
        ("velocity", "Velocity", "Velocity: x north, y west, z up.", VELOCITY),
        ("position", "Position", "Position: x north, y west, z up.", POSITION),
    ] {
        let panels: Vec<ChartPanel> = pairs.into_iter().map(both).collect();
        if lines_drawn(&panels) {
            pictures.push(chart(name, caption, title, &both_legend, panels));
        }
    }
    let panels: Vec<ChartPanel> = DIFFERENCE.into_iter().map(difference).collect();
    let panels: Vec<ChartPanel> =
        panels.into_iter().filter(|panel| panel.lines.iter().any(|line| line.points.len() > 1)).collect();
    if lines_drawn(&panels) {
        let caption = "Log minus estimate while both are valid, and three times the estimate's standard deviation \
             (pale). Rotations are about the axes of the earth frame.";
        let legend = [("log less estimate", own), ("3σ", band)];
        pictures.push(chart("difference", caption, "Difference", &legend, panels));
    }
    pictures
}

/// Returns the log's estimate and ours in space, as far as they have a position.
pub(crate) fn space(replayed: &Replayed) -> Option<ExplorableScene> {
    let ours = |row: &ReplayRow| {
        let ours = row.ours.as_ref().filter(|ours| ours.validity.position && ours.validity.height)?;
        Some((row.time_s, ours.state.position_m.cast(), ours.state.attitude_rad.cast()))
    };
    let logged = |row: &ReplayRow| {
        let ([w, x, y, z], zero) = (row.logged.attitude?, Vector3::zeros());
        let state = State::from_quaternion(zero, zero, &Quaternion::new(w, x, y, z), zero)?;
        Some((row.time_s, row.logged.position_m?.cast(), state.attitude_rad.cast()))
    };
    let ours: Vec<TimedPose> = replayed.rows.iter().filter_map(ours).collect();
    let logged: Vec<TimedPose> = replayed.rows.iter().filter_map(logged).collect();
    let mut scene = ExplorableScene::around(ours.iter().chain(&logged), rotors_on_a_circle_m(4))?;
    scene.add("log".to_owned(), REFERENCE.pen(), &logged, false);
    scene.add("estimate".to_owned(), Ink::new(palette::color("afbc"), LINE_PX).pen(), &ours, false);
    Some(scene)
}
