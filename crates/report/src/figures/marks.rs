//! What happens to the vehicle in flight, and how it is marked along the time axis.

use super::canvas::text_width_px;
use super::palette::TINTS;
use crate::words;
use afbc_sim::scenario::Scenario;
use plotters::style::RGBColor;

/// A time or an interval with a label.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    pub(super) label: String,
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    /// Whether the interval is shown; of what stays for good, only how it begins.
    pub(super) is_band: bool,
    /// Of the band; another than those of bands that it overlaps.
    pub(super) tint: RGBColor,
    /// How many bands at most lie over one another where this one is laid on top; tells widths apart.
    pub(super) depth: usize,
    /// Row of label and band, 0 at the bottom: nothing else is there at that time.
    pub(super) lane: usize,
    /// Where the middle of the label is, along the axis.
    pub(super) label_px: f64,
}

impl Mark {
    fn overlaps(&self, other: &Mark) -> bool {
        self.is_band && other.is_band && self.start_s < other.end_s && other.start_s < self.end_s
    }
}

/// Size of labels.
pub(super) const LABEL_PX: f64 = 11.0;

/// Everything that is marked on one time axis.
pub(super) struct Marks {
    /// The vehicle or what it knows is another than believed: parameters, payloads, rotor faults, no state.
    pub(super) changes: Vec<Mark>,
    /// Gusts, as forces and of wind.
    pub(super) gusts: Vec<Mark>,
    /// How many rows the labels take.
    pub(super) lanes: usize,
}

/// The marks of `scenario` on a time axis from 0 to `end_s`, `width_px` wide; those that begin and end at the same time
/// are one.
pub(super) fn marks(scenario: &Scenario, end_s: f64, width_px: f64) -> Marks {
    let (environment, realism) = (&scenario.environment, &scenario.realism);
    let forces = environment.gusts().iter().map(|gust| {
        let (letter, index) = words::gust(gust);
        (format!("{letter}⟨{index}⟩"), gust.start_s, gust.end_s)
    });
    let winds = realism.wind.gusts.iter().map(|gust| {
        let gust_end_s = gust.start_s + 2.0 * gust.rise_s + gust.hold_s;
        (words::wind_gust(gust), gust.start_s, gust_end_s)
    });
    let changes = environment.changes().iter().map(|c| (words::change(c).replace('-', "−"), c.start_s, c.end_s));
    let payloads = environment.payloads().iter().map(|p| (words::payload(p).replace('-', "−"), p.start_s, p.end_s));
    let faults = realism.rotors.faults.iter().map(|fault| (words::fault(fault), fault.start_s, f64::INFINITY));
    let outages = scenario.outages.iter().map(|outage| ("no state".to_owned(), outage.start_s, outage.end_s));
    let changes = changes.chain(payloads).chain(faults).chain(outages);
    let longest_px = 0.5 * width_px;
    let mut gusts = merged(forces.chain(winds), end_s, longest_px);
    let mut changes = merged(changes, end_s, longest_px);
    for gust in &mut gusts {
        gust.is_band = gust.end_s < end_s;
    }
    tell_apart(&mut gusts.iter_mut().chain(&mut changes));
    // What each row has taken.
    let mut lanes = Vec::new();
    for mark in gusts.iter_mut().chain(&mut changes) {
        place(mark, width_px / end_s, width_px, &mut lanes);
    }
    Marks { changes, gusts, lanes: lanes.len() }
}

/// Marks within the axis, sorted, one for each interval unless its label grew beyond `longest_px`.
fn merged(intervals: impl Iterator<Item = (String, f64, f64)>, axis_end_s: f64, longest_px: f64) -> Vec<Mark> {
    let mut marks: Vec<Mark> = Vec::new();
    for (label, start_s, end_s) in intervals {
        let (start_s, end_s) = (start_s.max(0.0), end_s.min(axis_end_s));
        if start_s >= end_s {
            continue;
        }
        let has_room =
            |mark: &Mark| text_width_px(&mark.label, LABEL_PX) + text_width_px(&label, LABEL_PX) < longest_px;
        let same = |mark: &&mut Mark| mark.start_s == start_s && mark.end_s == end_s && has_room(mark);
        match marks.iter_mut().find(same) {
            Some(mark) => mark.label = format!("{}, {label}", mark.label),
            None => marks.push(Mark {
                label,
                start_s,
                end_s,
                is_band: true,
                tint: TINTS[0],
                depth: 0,
                lane: 0,
                label_px: 0.0,
            }),
        }
    }
    marks.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    marks
}

/// Gives bands their tints: the same for the same label and others for other labels, as far as they go; never the same
/// for two that overlap, unless more do than there are tints.
fn tell_apart(marks: &mut dyn Iterator<Item = &mut Mark>) {
    let mut labels: Vec<String> = Vec::new();
    let mut done: Vec<Mark> = Vec::new();
    for mark in marks.filter(|mark| mark.is_band) {
        let known = labels.iter().position(|label| *label == mark.label);
        let first = known.unwrap_or(labels.len());
        if known.is_none() {
            labels.push(mark.label.clone());
        }
        let under: Vec<&Mark> = done.iter().filter(|other| other.overlaps(mark)).collect();
        let tints = TINTS.iter().cycle().skip(first % TINTS.len()).take(TINTS.len());
        let free = tints.clone().find(|tint| under.iter().all(|other| other.tint != **tint));
        mark.tint = *free.or(tints.clone().next()).unwrap_or(&mark.tint);
        mark.depth = (0..).find(|depth| under.iter().all(|other| other.depth != *depth)).unwrap_or_default();
        done.push(mark.clone());
    }
}

/// Finds the lowest row where band and label of `mark` have room: the label on its band, or beside one that is too short.
fn place(mark: &mut Mark, px_per_s: f64, width_px: f64, lanes: &mut Vec<Vec<(f64, f64)>>) {
    let half = (0.5 * text_width_px(&mark.label, LABEL_PX) + 3.0).min(0.5 * width_px);
    let (start_px, end_px) = (mark.start_s * px_per_s, mark.end_s * px_per_s);
    let end_px = if mark.is_band { end_px } else { start_px };
    mark.label_px = if !mark.is_band || 2.0 * half < end_px - start_px {
        (0.5 * (start_px + end_px)).min(width_px - half).max(half)
    } else if end_px + 2.0 * half <= width_px {
        end_px + half
    } else {
        (start_px - half).max(half)
    };
    let (left, right) = (start_px.min(mark.label_px - half), end_px.max(mark.label_px + half));
    let free = |lane: &Vec<(f64, f64)>| lane.iter().all(|&(l, r)| right <= l || r <= left);
    mark.lane = lanes.iter().position(free).unwrap_or(lanes.len());
    match lanes.get_mut(mark.lane) {
        Some(lane) => lane.push((left, right)),
        None => lanes.push(vec![(left, right)]),
    }
}
