//! Events of a flight, and their marks along the time axis.

use super::canvas::text_width_px;
use super::palette::TINTS;
use crate::words;
use afbc_drawing::Rgb;
use afbc_scenario::Scenario;

/// An event with a label, at an instant or over an interval.
#[derive(Clone, Debug)]
pub(super) struct TimeMark {
    pub(super) label: String,
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    /// Whether the interval is shaded. For permanent changes only the onset is shown.
    pub(super) is_band: bool,
    /// Tint of the band; overlapping bands have different tints.
    pub(super) tint: Rgb,
    /// Number of bands below this band, which determines the band's width along the trajectory.
    pub(super) depth: usize,
    /// Row of the label and band, 0 at the bottom. Marks in one row do not overlap in time.
    pub(super) lane: usize,
    /// Position of the label's centre along the axis.
    pub(super) label_px: f64,
}

impl TimeMark {
    fn overlaps(&self, other: &TimeMark) -> bool {
        self.is_band && other.is_band && self.start_s < other.end_s && other.start_s < self.end_s
    }
}

/// Font size of labels.
pub(super) const LABEL_PX: f64 = 11.0;

/// All marks of one time axis.
pub(super) struct TimeMarks {
    /// Changes of the vehicle or its sensors: parameters, payloads, rotor faults, outages.
    pub(super) changes: Vec<TimeMark>,
    /// Gusts of force and of wind.
    pub(super) gusts: Vec<TimeMark>,
    /// Number of rows of labels.
    pub(super) lanes: usize,
    /// Explanation of the thin lines, for the caption.
    pub(super) onset: &'static str,
}

/// Returns the marks of `scenario` on a time axis from 0 to `end_s` that is `width_px` wide. Events with the same start
/// and end share a mark.
pub(super) fn marks(scenario: &Scenario, end_s: f64, width_px: f64) -> TimeMarks {
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
    separate(&mut gusts.iter_mut().chain(&mut changes));
    placed(changes, gusts, end_s, width_px, " Thin line: onset of a gust.")
}

/// Returns marks at instants, each with a label and a time; `onset` explains them in the caption.
pub(super) fn moments(
    moments: impl Iterator<Item = (String, f64)>,
    end_s: f64,
    width_px: f64,
    onset: &'static str,
) -> TimeMarks {
    let mut moments = merged(moments.map(|(label, time_s)| (label, time_s, f64::INFINITY)), end_s, 0.5 * width_px);
    moments.iter_mut().for_each(|mark| mark.is_band = false);
    placed(Vec::new(), moments, end_s, width_px, onset)
}

/// Assigns each mark its row.
fn placed(
    mut changes: Vec<TimeMark>,
    mut gusts: Vec<TimeMark>,
    end_s: f64,
    width_px: f64,
    onset: &'static str,
) -> TimeMarks {
    // `lanes` holds the occupied intervals of each row.
    let mut lanes = Vec::new();
    for mark in gusts.iter_mut().chain(&mut changes) {
        place(mark, width_px / end_s, width_px, &mut lanes);
    }
    TimeMarks { changes, gusts, lanes: lanes.len(), onset }
}

/// Returns sorted marks within the axis. Events with equal intervals share a mark unless its label would exceed
/// `longest_px`.
fn merged(intervals: impl Iterator<Item = (String, f64, f64)>, axis_end_s: f64, longest_px: f64) -> Vec<TimeMark> {
    let mut marks: Vec<TimeMark> = Vec::new();
    for (label, start_s, end_s) in intervals {
        let (start_s, end_s) = (start_s.max(0.0), end_s.min(axis_end_s));
        if start_s >= end_s {
            continue;
        }
        let has_room =
            |mark: &TimeMark| text_width_px(&mark.label, LABEL_PX) + text_width_px(&label, LABEL_PX) < longest_px;
        let same = |mark: &&mut TimeMark| mark.start_s == start_s && mark.end_s == end_s && has_room(mark);
        match marks.iter_mut().find(same) {
            Some(mark) => mark.label = format!("{}, {label}", mark.label),
            None => marks.push(TimeMark {
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

/// Assigns tints to bands. Equal labels get equal tints, and different labels different tints as far as possible.
/// Overlapping bands never share a tint unless there are too few tints.
fn separate(marks: &mut dyn Iterator<Item = &mut TimeMark>) {
    let mut labels: Vec<String> = Vec::new();
    let mut done: Vec<TimeMark> = Vec::new();
    for mark in marks.filter(|mark| mark.is_band) {
        let known = labels.iter().position(|label| *label == mark.label);
        let first = known.unwrap_or(labels.len());
        if known.is_none() {
            labels.push(mark.label.clone());
        }
        let under: Vec<&TimeMark> = done.iter().filter(|other| other.overlaps(mark)).collect();
        let tints = TINTS.iter().cycle().skip(first % TINTS.len()).take(TINTS.len());
        let free = tints.clone().find(|tint| under.iter().all(|other| other.tint != **tint));
        mark.tint = *free.or(tints.clone().next()).unwrap_or(&mark.tint);
        mark.depth = (0..).find(|depth| under.iter().all(|other| other.depth != *depth)).unwrap_or_default();
        done.push(mark.clone());
    }
}

/// Puts `mark` into the lowest row with room for its band and label. The label is on its band, or next to a short band.
fn place(mark: &mut TimeMark, px_per_s: f64, width_px: f64, lanes: &mut Vec<Vec<(f64, f64)>>) {
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
