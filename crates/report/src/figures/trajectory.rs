//! A figure of the flights in space: a box seen from above its front right corner.

use super::canvas::{self, Canvas, Ink, WIDTH_PX};
use super::marks::{LABEL_PX, TimeMark, marks};
use super::palette::{BLACK, FRAME, GREY, GRID};
use super::picture::{CROSS, Picture};
use super::plotted_flight::{PlottedFlight, REFERENCE};
use super::reduce::simplify;
use super::time_chart::{ChartLine, PLOT_PX, range};
use crate::explore::{Explorable, ExplorableScene};
use afbc_drawing::{Point, Rgb, TextAnchor, Ticks};
use afbc_sim::flight::Sample;
use afbc_sim::flown::ScenarioFlight;
use nalgebra::Vector3;
use std::collections::HashSet;

const HEIGHT_PX: f64 = 660.0;
/// Area of the box, below a legend of one line: left, top, width, height.
const ROOM_PX: [f64; 4] = [110.0, 70.0, WIDTH_PX - 220.0, HEIGHT_PX - 70.0 - 62.0];
/// Largest number of ticks along an edge.
const TICKS: usize = 7;
/// Width of a band along the reference.
const BAND_PX: f64 = 13.0;
/// Height of the box relative to its longer floor edge.
const BOX_HEIGHT: f64 = 0.62;
/// Direction to the eye: azimuth -55 degrees, elevation 24 degrees.
const AZIMUTH_RAD: f64 = -0.96;
const ELEVATION_RAD: f64 = 0.42;

/// The box and its projection.
struct BoxProjection {
    low_m: Vector3<f64>,
    high_m: Vector3<f64>,
    /// Drawn lengths of the edges, in a common unit.
    edges: Vector3<f64>,
    px: f64,
    middle_px: (f64, f64),
}

impl BoxProjection {
    /// Creates a view of the box between two corners, moved down by `below_px`. The floor is true to scale unless an
    /// edge would become too short.
    fn new(low_m: Vector3<f64>, high_m: Vector3<f64>, below_px: f64) -> Self {
        let span = high_m - low_m;
        let longer = span.x.max(span.y);
        let edges = Vector3::new((span.x / longer).max(0.5), (span.y / longer).max(0.5), BOX_HEIGHT);
        let [left, top, width, height] = ROOM_PX;
        let view = BoxProjection {
            low_m,
            high_m,
            edges,
            px: 1.0,
            middle_px: (left + 0.5 * width, top + below_px + 0.5 * height),
        };
        // The outermost corners of the outline decide the scale. They are relative to the centre.
        let (right, _) = view.direction(Vector3::new(0.5, 0.5, 0.0));
        let (_, down) = view.direction(Vector3::new(0.5, -0.5, -0.5));
        BoxProjection { px: (0.5 * width / right).min(0.5 * height / down), ..view }
    }

    /// Returns where a vector points in the picture, to the right and down. The vector is given in lengths of the box's
    /// edges.
    fn direction(&self, v: Vector3<f64>) -> (f64, f64) {
        let v = v.component_mul(&self.edges) * self.px;
        let ((sin_a, cos_a), (sin_e, cos_e)) = (libm::sincos(AZIMUTH_RAD), libm::sincos(ELEVATION_RAD));
        let toward = cos_a * v.x + sin_a * v.y;
        (cos_a * v.y - sin_a * v.x, sin_e * toward - cos_e * v.z)
    }

    /// Returns the position of a point in the picture.
    fn at(&self, p: Vector3<f64>) -> Point {
        let middle = 0.5 * (self.low_m + self.high_m);
        // No edge has length zero: there is a margin even around a constant.
        let (right, down) = self.direction((p - middle).component_div(&(self.high_m - self.low_m)));
        (self.middle_px.0 + right, self.middle_px.1 + down)
    }

    fn contains(&self, p: &Vector3<f64>) -> bool {
        self.low_m.iter().zip(p).zip(&self.high_m).all(|((low, p), high)| low <= p && p <= high)
    }
}

/// Draws the flights of `laws`, and the reference of the longest flight.
pub(super) fn picture(
    laws: &[PlottedFlight],
    longest: &ScenarioFlight,
    conditions: &str,
    mut legend: Vec<(String, Ink)>,
) -> Picture {
    let scenario = &longest.scenario;
    let end_s = longest.run.log.last().map_or(0.0, |last| last.time_s);
    let range_along = |axis: Vector3<f64>| {
        let flown = laws.iter().map(|law| law.line(law.ink(), end_s, |s| s.motion.position_m.dot(&axis)));
        let wanted = laws.iter().map(|law| ChartLine {
            is_reference: true,
            lost_s: None,
            ..law.line(REFERENCE, end_s, |s| s.reference.position_m.dot(&axis))
        });
        range(&flown.chain(wanted).collect::<Vec<_>>(), 0.5)
    };
    let ranges = [Vector3::x(), Vector3::y(), Vector3::z()].map(range_along);
    let marks = marks(scenario, end_s, PLOT_PX);
    // Where bands overlap, the lower ones are wider.
    let band = |change: &TimeMark| Ink::new(change.tint, BAND_PX + 6.0 * change.depth as f64);
    let mut changes: Vec<&TimeMark> = marks.changes.iter().collect();
    for (i, change) in changes.iter().enumerate() {
        if changes.iter().take(i).all(|other| (&other.label, other.tint) != (&change.label, change.tint)) {
            legend.push((change.label.clone(), Ink::new(change.tint, BAND_PX)));
        }
    }
    changes.sort_by_key(|change| core::cmp::Reverse(change.depth));
    let (mut bands, mut crosses) = (false, false);
    let below_px = canvas::head_px(&legend) - canvas::head_px(&[]);
    let view = BoxProjection::new(
        Vector3::from(ranges.each_ref().map(|range| range.start)),
        Vector3::from(ranges.each_ref().map(|range| range.end)),
        below_px,
    );

    let mut canvas = Canvas::new("Trajectory", conditions, &legend);
    furniture(&mut canvas, &view);
    let wanted = || longest.run.log.iter().map(|s| (s.time_s, s.reference.position_m));
    let shadow = wanted().map(|(_, p)| Vector3::new(p.x, p.y, view.low_m.z));
    path(&mut canvas, &view, shadow, Ink::new(FRAME, 0.75));
    for change in &changes {
        let during = wanted().filter(|(t, _)| change.start_s <= *t && *t <= change.end_s);
        bands |= path(&mut canvas, &view, during.map(|(_, p)| p), band(change));
    }
    path(&mut canvas, &view, wanted().map(|(_, p)| p), REFERENCE);
    for law in laws {
        let flown = law.flight.run.log.iter().map(|s| s.motion.position_m);
        path(&mut canvas, &view, flown, law.ink());
        let end = law.flight.run.log.last().map(|s| s.motion.position_m).filter(|end| view.contains(end));
        if let (Some(end), Some(_)) = (end, law.flight.run.lost) {
            crosses = true;
            canvas.cross(view.at(end), 5.0, law.color());
        }
    }
    let start = scenario.initial.position_m;
    let gusts = marks.gusts.iter().map(|gust| (scenario.trajectory.at(gust.start_s).position_m, gust.label.as_str()));
    let seen = dot_all(&mut canvas, &view, core::iter::once((start, "start")).chain(gusts));
    let dots = seen > usize::from(view.contains(&start));
    let svg = canvas.svg(HEIGHT_PX + below_px);
    let mut caption = "The flights in space.".to_owned();
    if dots {
        caption += " Dots: position of the reference at the onset of a gust.";
    }
    if bands {
        caption += " Shaded: the reference's path during the event named in the legend.";
    }
    if crosses {
        caption += CROSS;
    }
    let explorable = Some(Explorable::Scene(scene(laws, longest, &view)));
    Picture { name: "fig4-trajectory", caption, svg, explorable }
}

/// Returns the plotted flights as data for the page's script.
fn scene(laws: &[PlottedFlight], longest: &ScenarioFlight, view: &BoxProjection) -> ExplorableScene {
    let scenario = &longest.scenario;
    let arm_m = scenario.vehicle.arm_m;
    let end_s = longest.run.log.last().map_or(0.0, |last| last.time_s);
    let mut scene = ExplorableScene {
        title: "Trajectory".to_owned(),
        end_s,
        low_m: view.low_m.into(),
        high_m: view.high_m.into(),
        rotors_m: scenario.rotors.iter().map(|rotor| [arm_m * rotor.x, arm_m * rotor.y]).collect(),
        tracks: Vec::new(),
    };
    let wanted = |s: &Sample| (s.time_s, s.reference.position_m, Vector3::zeros());
    let places: Vec<_> = longest.run.log.iter().map(wanted).collect();
    scene.add("reference".to_owned(), REFERENCE.pen(), &places, true);
    for law in laws {
        let place = |s: &Sample| (s.time_s, s.motion.position_m, s.motion.attitude_rad);
        let places: Vec<_> = law.flight.run.log.iter().map(place).collect();
        scene.add(law.title(), law.ink().pen(), &places, false);
    }
    scene
}

/// Draws labelled dots at the `places` that are in the box. Dots at the same position share one label. Returns the
/// number of places in the box.
fn dot_all<'a>(
    canvas: &mut Canvas,
    view: &BoxProjection,
    places: impl Iterator<Item = (Vector3<f64>, &'a str)>,
) -> usize {
    let mut dots: Vec<(Point, String)> = Vec::new();
    let mut count = 0;
    for (place, label) in places.filter(|(place, _)| view.contains(place)) {
        count += 1;
        let (x, y) = view.at(place);
        match dots.iter_mut().find(|((a, b), _)| libm::hypot(a - x, b - y) < LABEL_PX) {
            Some((_, labels)) => *labels += &format!(", {label}"),
            None => dots.push(((x, y), label.to_owned())),
        }
    }
    for (place, label) in &dots {
        dot(canvas, view, *place, label);
    }
    count
}

/// Draws a dot with a label on the side away from the centre.
fn dot(canvas: &mut Canvas, view: &BoxProjection, (x, y): Point, label: &str) {
    let (dx, dy) = (x - view.middle_px.0, y - view.middle_px.1);
    let away = 15.0 / libm::hypot(dx, dy).max(1.0);
    canvas.dot((x, y), 3.0, BLACK);
    let side = if dx < 0.0 { TextAnchor::End } else { TextAnchor::Start };
    canvas.text(label, (x + dx * away * 0.7, y + dy * away), LABEL_PX, side, BLACK);
}

/// Draws a path up to where it first leaves the box. Repeated laps are drawn once. Returns whether any of it is in the
/// box.
fn path(canvas: &mut Canvas, view: &BoxProjection, places: impl Iterator<Item = Vector3<f64>>, ink: Ink) -> bool {
    let mut inked = HashSet::new();
    let mut pieces = Vec::new();
    let mut piece = Vec::new();
    let mut last: Option<Point> = None;
    for place in places.take_while(|p| view.contains(p)) {
        let (x, y) = view.at(place);
        let cell = (x as i32, y as i32);
        if inked.insert(cell) {
            if piece.is_empty() {
                piece.extend(last);
            }
            piece.push((x, y));
        } else if last.is_some_and(|(x, y)| (x as i32, y as i32) != cell) && !piece.is_empty() {
            piece.push((x, y));
            pieces.push(core::mem::take(&mut piece));
        }
        last = Some((x, y));
    }
    piece.extend(last);
    pieces.push(piece);
    for piece in &pieces {
        canvas.line(simplify(piece, (1.0, 1.0), 0.15), ink);
    }
    last.is_some()
}

/// Draws the floor and the back walls with grid, numbers and names of the axes.
fn furniture(canvas: &mut Canvas, view: &BoxProjection) {
    let (low, high) = (view.low_m, view.high_m);
    let line = |canvas: &mut Canvas, a: Vector3<f64>, b: Vector3<f64>, color: Rgb| {
        canvas.line([view.at(a), view.at(b)], Ink::new(color, 0.75));
    };
    // Each axis has a front edge with the numbers and a parallel back edge. An edge is given by its point at the axis's
    // zero and the direction of its grid lines. The last vector points from the edge to the numbers.
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let near = |axis: Vector3<f64>| low - axis.component_mul(&low);
    let right = Vector3::new(high.x, 0.0, low.z);
    let axes = [
        (x, "x [m]", (near(x), y), (near(x) + y * (high.y - low.y), z), -y),
        (y, "y [m]", (right, -x), (near(y), z), x),
        (z, "z [m]", (near(z), y), (near(z) + y * (high.y - low.y), x), -x - y),
    ];
    let span = high - low;
    for (axis, name, front, back, outward) in axes {
        let (first, last) = (low.dot(&axis), high.dot(&axis));
        let out = view.direction(outward);
        let out_length = libm::hypot(out.0, out.1);
        let beside = |value: f64, away_px: f64| {
            let (right, down) = view.at(front.0 + axis * value);
            let away = away_px / out_length;
            (right + out.0 * away, down + out.1 * away + 4.0)
        };
        for (value, label) in Ticks::linear(first, last, TICKS).marks() {
            for (edge, way) in [front, back] {
                let from = edge + axis * value;
                line(canvas, from, from + way.component_mul(&span), GRID);
            }
            // The left corner has the number of the z-axis.
            if axis != x || value - first > 0.04 * (last - first) {
                canvas.text(&label, beside(value, 16.0), LABEL_PX, TextAnchor::Middle, GREY);
            }
        }
        for (edge, _) in [front, back] {
            line(canvas, edge + axis * first, edge + axis * last, FRAME);
        }
        canvas.text(name, beside(0.5 * (first + last), 50.0), 12.0, TextAnchor::Middle, BLACK);
    }
    // The three edges of the back walls without numbers.
    line(canvas, Vector3::new(low.x, low.y, high.z), Vector3::new(low.x, high.y, high.z), FRAME);
    line(canvas, Vector3::new(low.x, high.y, high.z), Vector3::new(high.x, high.y, high.z), FRAME);
    line(canvas, Vector3::new(high.x, high.y, low.z), Vector3::new(high.x, high.y, high.z), FRAME);
}
