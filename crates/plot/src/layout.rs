//! Lays out a figure: computes the position of each of its shapes.

use crate::figure::{FigurePanel, PanelLine, PaperFigure};
use crate::font::width_pt;
use afbc_drawing::{Drawing, PlotAxis, Point, Rgb, Shape, Stroke, TextAnchor, Ticks};

/// Points per millimetre.
const PT_PER_MM: f64 = 72.0 / 25.4;
const INK: Rgb = [0x1A, 0x1A, 0x1A];
const GRID: Rgb = [0xDD, 0xDD, 0xDD];
const FRAME_PT: f64 = 0.5;
const GRID_PT: f64 = 0.3;
const TICK_PT: f64 = 2.0;
/// Opacity of a band's area.
const BAND: f64 = 0.2;
/// A point closer than this to the last drawn point cannot be seen and is left out \[pt\].
const UNSEEN_PT: f64 = 0.12;
/// Margin around the values of an axis, as a share of their range.
const ROOM: f64 = 0.05;
/// Largest number of ticks on a y-axis, and least distance between ticks of the x-axis in widths of its longest label.
const Y_TICKS: usize = 5;
const X_APART: f64 = 1.8;
/// Dash patterns: lengths of dashes and gaps \[pt\].
const DASHES: [&[f64]; 5] = [&[], &[4.0, 1.5], &[1.0, 1.2], &[5.0, 1.5, 1.0, 1.5], &[8.0, 2.0]];

/// Returns the figure as a drawing in points.
pub(crate) fn laid_out(figure: &PaperFigure) -> Result<Drawing, String> {
    let PaperFigure { font_pt, x_range, panels, is_logarithmic, .. } = figure;
    let width_pt_all = figure.width_mm * PT_PER_MM;
    let [low, high] = match x_range {
        Some(range) => *range,
        None => {
            extent(panels.iter().flat_map(|panel| &panel.lines).flat_map(xs)).ok_or("there are no numbers to draw")?
        }
    };
    if low >= high {
        return Err(format!("the x-axis would go from {low} to {high}; choose another --x or another range"));
    }
    // The width of the y-axes' labels comes first: the panels get the width that is left.
    let ranges: Vec<[f64; 2]> =
        panels.iter().map(|panel| range(panel, [low, high], *is_logarithmic)).collect::<Result<_, _>>()?;
    let y_ticks: Vec<Ticks> = ranges
        .iter()
        .map(|[low, high]| {
            let axis = PlotAxis { low: *low, high: *high, from: 0.0, to: 1.0, is_logarithmic: *is_logarithmic };
            axis.ticks(Y_TICKS)
        })
        .collect();
    let widest = y_ticks.iter().flat_map(Ticks::marks).map(|(_, label)| width_pt(&label, *font_pt));
    let left_pt = 1.5 * font_pt + widest.fold(0.0, f64::max) + TICK_PT + 3.0;
    let right_pt = width_pt_all - 0.9 * font_pt;
    if right_pt - left_pt < 4.0 * font_pt {
        return Err(format!(
            "a width of {} mm leaves no room for the chart beside the axis numbers; choose a larger --width",
            figure.width_mm
        ));
    }
    let mut shapes = Vec::new();
    let mut top_pt = legend(figure, left_pt, right_pt, &mut shapes);
    for (index, ((panel, [low_y, high_y]), ticks)) in panels.iter().zip(&ranges).zip(&y_ticks).enumerate() {
        let bottom_pt = top_pt + figure.panel_mm * PT_PER_MM;
        let x = PlotAxis { low, high, from: left_pt, to: right_pt, is_logarithmic: false };
        let y = PlotAxis { low: *low_y, high: *high_y, from: bottom_pt, to: top_pt, is_logarithmic: *is_logarithmic };
        let last = index + 1 == panels.len();
        frame(figure, panel, [&x, &y], ticks, last, &mut shapes);
        lines(figure, panel, [&x, &y], &mut shapes);
        top_pt = bottom_pt + if last { 0.0 } else { 0.8 * font_pt };
    }
    let height_pt = top_pt + TICK_PT + 3.1 * font_pt;
    Ok(Drawing { width: width_pt_all, height: height_pt, shapes })
}

/// Draws the legend if there is more than one entry. Returns the y of the first panel's top.
fn legend(figure: &PaperFigure, left_pt: f64, right_pt: f64, shapes: &mut Vec<Shape>) -> f64 {
    let font_pt = figure.font_pt;
    let mut entries: Vec<&PanelLine> = Vec::new();
    for line in figure.panels.iter().flat_map(|panel| &panel.lines) {
        if entries.iter().all(|other| other.label != line.label) {
            entries.push(line);
        }
    }
    if entries.len() < 2 {
        return 0.6 * font_pt;
    }
    let (mut x, mut y) = (left_pt, 1.2 * font_pt);
    for entry in entries {
        let needed = 2.6 * font_pt + width_pt(&entry.label, font_pt);
        if x > left_pt && x + needed > right_pt {
            (x, y) = (left_pt, y + 1.35 * font_pt);
        }
        let middle = y - 0.32 * font_pt;
        let sample = [(x, middle), (x + 2.2 * font_pt, middle)];
        if !entry.band.is_empty() {
            let [from, to] = sample.map(|(x, _)| x);
            let [up, down] = [middle - 0.35 * font_pt, middle + 0.35 * font_pt];
            let points = vec![(from, up), (to, up), (to, down), (from, down)];
            shapes.push(Shape::Area { points, color: entry.color, opacity: BAND, within: None });
        }
        shapes.push(Shape::Line { points: sample.to_vec(), stroke: stroke(figure, entry), within: None });
        shapes.push(text(&entry.label, (x + 2.6 * font_pt, y), font_pt, TextAnchor::Start, false));
        x += needed + 1.2 * font_pt;
    }
    y + 0.8 * font_pt
}

/// Draws a panel's grid, frame, ticks and axis labels.
fn frame(
    figure: &PaperFigure,
    panel: &FigurePanel,
    [x, y]: [&PlotAxis; 2],
    y_ticks: &Ticks,
    is_last: bool,
    shapes: &mut Vec<Shape>,
) {
    let font_pt = figure.font_pt;
    let mut line = |from: Point, to: Point, color, width_pt| {
        let stroke = Stroke::solid(color, width_pt);
        shapes.push(Shape::Line { points: vec![from, to], stroke, within: None });
    };
    let widest = |ticks: &Ticks| ticks.marks().map(|(_, label)| width_pt(&label, font_pt)).fold(font_pt, f64::max);
    let most = |ticks: &Ticks| ((x.to - x.from) / (X_APART * widest(ticks))) as usize;
    // The number of ticks depends on the width of the labels, and the labels on the number of ticks. The labels of 8
    // ticks give the width.
    let x_ticks = x.ticks(most(&x.ticks(8)).clamp(2, 10));
    for at in x_ticks.at.iter().map(|value| x.at(*value)) {
        line((at, y.from), (at, y.to), GRID, GRID_PT);
        line((at, y.from), (at, y.from + TICK_PT), INK, FRAME_PT);
    }
    for at in y_ticks.at.iter().map(|value| y.at(*value)) {
        line((x.from, at), (x.to, at), GRID, GRID_PT);
        line((x.from, at), (x.from - TICK_PT, at), INK, FRAME_PT);
    }
    let corners = [(x.from, y.to), (x.to, y.to), (x.to, y.from), (x.from, y.from)];
    let points = corners.into_iter().chain(corners.first().copied()).collect();
    let stroke = Stroke::solid(INK, FRAME_PT);
    shapes.push(Shape::Line { points, stroke, within: None });
    for (value, label) in y_ticks.marks() {
        let place = (x.from - TICK_PT - 1.5, y.at(value) + 0.36 * font_pt);
        shapes.push(text(&label, place, font_pt, TextAnchor::End, false));
    }
    let middle = 0.5 * (y.from + y.to);
    shapes.push(text(&panel.y_title, (1.1 * font_pt, middle), font_pt, TextAnchor::Middle, true));
    if is_last {
        for (value, label) in x_ticks.marks() {
            // Move a long number at the right end left, so that it stays within the figure.
            let last_pt = figure.width_mm * PT_PER_MM - 0.5 * width_pt(&label, font_pt);
            let place = (x.at(value).min(last_pt), y.from + TICK_PT + 1.1 * font_pt);
            shapes.push(text(&label, place, font_pt, TextAnchor::Middle, false));
        }
        let place = (0.5 * (x.from + x.to), y.from + TICK_PT + 2.5 * font_pt);
        shapes.push(text(&figure.x_title, place, font_pt, TextAnchor::Middle, false));
    }
}

/// Draws the panel's bands, then its lines.
fn lines(figure: &PaperFigure, panel: &FigurePanel, [x, y]: [&PlotAxis; 2], shapes: &mut Vec<Shape>) {
    let within = Some([x.from, y.to, x.to, y.from]);
    let is_seen = |value: &f64| !y.is_logarithmic || *value > 0.0;
    for PanelLine { color, band, .. } in &panel.lines {
        let edge = |edge: usize| {
            let values = band.iter().filter_map(move |(at, ends)| Some((*at, *ends.get(edge)?)));
            // A logarithmic axis has no zero: draw the band's edge at the lower end of the panel instead.
            values.map(|(at, value)| (x.at(at), y.at(if is_seen(&value) { value } else { y.low }))).collect::<Vec<_>>()
        };
        if band.len() > 1 {
            let points = edge(0).into_iter().chain(edge(1).into_iter().rev()).collect();
            shapes.push(Shape::Area { points, color: *color, opacity: BAND, within });
        }
    }
    for line in &panel.lines {
        for points in &line.lines {
            let places = points.iter().filter(|(_, value)| is_seen(value)).map(|(at, value)| (x.at(*at), y.at(*value)));
            let points = thinned(places);
            if points.len() > 1 {
                shapes.push(Shape::Line { points, stroke: stroke(figure, line), within });
            }
        }
    }
}

/// Leaves out points that are too close to the last point kept. The very last point stays.
fn thinned(places: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    let mut last = None;
    for place in places {
        let is_seen = kept.last().is_none_or(|(x, y)| libm::hypot(place.0 - x, place.1 - y) >= UNSEEN_PT);
        last = Some(place).filter(|_| !is_seen);
        if is_seen {
            kept.push(place);
        }
    }
    kept.extend(last);
    kept
}

fn stroke(figure: &PaperFigure, line: &PanelLine) -> Stroke {
    let dashes = DASHES.get(line.dash % DASHES.len()).copied().unwrap_or_default();
    Stroke { dashes: dashes.into(), ..Stroke::solid(line.color, figure.line_pt) }
}

fn text(text: &str, place: Point, size: f64, anchor: TextAnchor, upwards: bool) -> Shape {
    Shape::Text { text: text.into(), place, size, anchor, color: INK, upwards, is_bold: false }
}

fn xs(line: &PanelLine) -> impl Iterator<Item = f64> {
    line.lines.iter().flatten().map(|(x, _)| *x)
}

/// Returns the smallest and the largest number.
fn extent(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.fold(None, |extent, value| {
        let [low, high] = extent.unwrap_or([value, value]);
        Some([f64::min(low, value), f64::max(high, value)])
    })
}

/// Returns the range of a panel's y-axis: the values within the x-range, with a margin.
fn range(panel: &FigurePanel, [from, to]: [f64; 2], is_logarithmic: bool) -> Result<[f64; 2], String> {
    let is_shown = |x: f64| (from..=to).contains(&x);
    let lines = panel.lines.iter().flat_map(|line| line.lines.iter().flatten().map(|(x, y)| (*x, *y)));
    let bands = panel.lines.iter().flat_map(|line| line.band.iter().flat_map(|(x, ends)| ends.map(|y| (*x, y))));
    let values = lines.chain(bands).filter(|(x, y)| is_shown(*x) && (!is_logarithmic || *y > 0.0)).map(|(_, y)| y);
    let Some([low, high]) = extent(values) else {
        let positive = if is_logarithmic { " that are positive" } else { "" };
        return Err(format!("{}: no numbers{positive} to draw on this x-axis; choose another range", panel.y_title));
    };
    if is_logarithmic {
        let room = libm::pow((high / low).max(1.2), ROOM);
        return Ok([low / room, high * room]);
    }
    // The margin is positive even for a constant, also for a constant of zero.
    let least = if low == 0.0 && high == 0.0 { 1.0 } else { 1e-9 };
    let room = (ROOM * (high - low)).max(1e-3 * low.abs().max(high.abs())).max(least);
    Ok([low - room, high + room])
}
