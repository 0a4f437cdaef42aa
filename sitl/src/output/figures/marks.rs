//! What happens to the vehicle in flight, and how it is marked along the time axis.

use super::canvas::text_width_px;
use crate::output::words;
use crate::scenario::Scenario;

/// A time or an interval with a label.
pub(super) struct Mark {
    pub(super) label: String,
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    /// Row of the label, 0 at the bottom; none if there is no room for it.
    pub(super) lane: Option<usize>,
    /// Where the middle of the label is, along the axis.
    pub(super) label_px: f64,
}

/// Size of labels.
pub(super) const LABEL_PX: f64 = 11.0;
/// Rows of labels at most.
const LANES: usize = 4;

/// Everything that is marked on one time axis.
pub(super) struct Marks {
    /// The vehicle is another than believed: parameters, payloads, rotor faults.
    pub(super) changes: Vec<Mark>,
    /// Gusts.
    pub(super) gusts: Vec<Mark>,
    /// How many rows the labels take.
    pub(super) lanes: usize,
}

/// The marks of `scenario` on a time axis from 0 to `end_s`, `width_px` wide; those that begin and end at the same time
/// are one.
pub(super) fn marks(scenario: &Scenario, end_s: f64, width_px: f64) -> Marks {
    let gusts = scenario.environment.gusts().iter().map(|gust| {
        let (letter, index) = words::gust(gust);
        (format!("{letter}⟨{index}⟩"), gust.start_s, gust.end_s)
    });
    let (environment, rotors) = (&scenario.environment, &scenario.realism.rotors);
    let changes = environment.changes().iter().map(|c| (words::change(c).replace('-', "−"), c.start_s, c.end_s));
    let payloads = environment.payloads().iter().map(|p| (words::payload(p), p.start_s, p.end_s));
    let faults = rotors.faults.iter().map(|fault| (words::fault(fault), fault.start_s, f64::INFINITY));
    let changes = changes.chain(payloads).chain(faults);
    let (mut gusts, mut changes) = (merged(gusts, end_s), merged(changes, end_s));
    // The end of the last label of each row.
    let mut lanes = Vec::new();
    for mark in &mut gusts {
        place(mark, mark.start_s / end_s * width_px, width_px, &mut lanes);
    }
    for mark in &mut changes {
        place(mark, 0.5 * (mark.start_s + mark.end_s) / end_s * width_px, width_px, &mut lanes);
    }
    Marks { changes, gusts, lanes: lanes.len() }
}

/// Marks within the axis, sorted, one for each interval.
fn merged(intervals: impl Iterator<Item = (String, f64, f64)>, axis_end_s: f64) -> Vec<Mark> {
    let mut marks: Vec<Mark> = Vec::new();
    for (label, start_s, end_s) in intervals {
        let (start_s, end_s) = (start_s.max(0.0), end_s.min(axis_end_s));
        if start_s >= end_s {
            continue;
        }
        match marks.iter_mut().find(|mark| mark.start_s == start_s && mark.end_s == end_s) {
            Some(mark) => mark.label = format!("{}, {label}", mark.label),
            None => marks.push(Mark { label, start_s, end_s, lane: None, label_px: 0.0 }),
        }
    }
    marks.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    marks
}

/// Finds the lowest row where the label of `mark` has room around `middle_px`.
fn place(mark: &mut Mark, middle_px: f64, width_px: f64, lanes: &mut Vec<Vec<(f64, f64)>>) {
    let half = 0.5 * text_width_px(&mark.label, LABEL_PX) + 3.0;
    mark.label_px = middle_px.min(width_px - half).max(half);
    let (left, right) = (mark.label_px - half, mark.label_px + half);
    let free = |lane: &Vec<(f64, f64)>| lane.iter().all(|&(l, r)| right <= l || r <= left);
    let lane = lanes.iter().position(free).unwrap_or(lanes.len());
    if lane >= LANES || half > 0.5 * width_px {
        return;
    }
    if lane == lanes.len() {
        lanes.push(Vec::new());
    }
    if let Some(row) = lanes.get_mut(lane) {
        row.push((left, right));
        mark.lane = Some(lane);
    }
}
