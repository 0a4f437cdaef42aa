//! Reduction of the number of points without a visible change.

/// Reduces points on a time axis from 0 to `end_s` to the extremes in each of `columns` columns, plus the first and the
/// last point, in order of time. Chatter within a column keeps its height. Values that are not finite are left out.
pub(super) fn envelope(values: impl Iterator<Item = (f64, f64)>, end_s: f64, columns: f64) -> Vec<(f64, f64)> {
    let mut points = Vec::new();
    // `column` is the index, and the lowest and highest point of the current column. `last` is the last point of the
    // line.
    let mut column: Option<(f64, [(f64, f64); 2])> = None;
    let mut last = None;
    for point in values.filter(|(t, v)| t.is_finite() && v.is_finite()) {
        let index = (point.0 / end_s * columns).floor();
        match &mut column {
            Some((current, [low, high])) if *current == index => {
                if point.1 < low.1 {
                    *low = point;
                }
                if point.1 > high.1 {
                    *high = point;
                }
            }
            _ => match column.replace((index, [point; 2])) {
                Some((_, extremes)) => points.extend(in_time(extremes)),
                None => points.push(point),
            },
        }
        last = Some(point);
    }
    points.extend(column.into_iter().flat_map(|(_, extremes)| in_time(extremes)));
    points.extend(last);
    // Both extremes of a column may be the same point, and the last point may be an extreme.
    points.dedup();
    points
}

fn in_time([a, b]: [(f64, f64); 2]) -> [(f64, f64); 2] {
    if a.0 <= b.0 { [a, b] } else { [b, a] }
}

/// Simplifies a line by the Ramer-Douglas-Peucker algorithm. After both coordinates are multiplied by `scale`, it
/// deviates by at most `tolerance`.
pub(super) fn simplify(points: &[(f64, f64)], scale: (f64, f64), tolerance: f64) -> Vec<(f64, f64)> {
    let place = |p: &(f64, f64)| (p.0 * scale.0, p.1 * scale.1);
    let mut kept = Vec::new();
    let mut open = vec![points];
    kept.extend(points.first());
    while let Some(part) = open.pop() {
        let [first, between @ .., last] = part else { continue };
        let (a, b) = (place(first), place(last));
        let farthest = between
            .iter()
            .enumerate()
            .map(|(i, p)| (i + 1, distance(place(p), a, b)))
            .max_by(|x, y| x.1.total_cmp(&y.1))
            .filter(|(_, far)| *far > tolerance);
        match farthest.and_then(|(i, _)| Some((part.get(..=i)?, part.get(i..)?))) {
            // The first half is on top of the stack, so that points are kept in their order.
            Some((before, after)) => open.extend([after, before]),
            None => kept.push(*last),
        }
    }
    kept
}

/// Returns the distance of `p` from the segment between `a` and `b`.
fn distance(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length2 = dx * dx + dy * dy;
    let along = if length2 > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
    libm::hypot(p.0 - a.0 - along * dx, p.1 - a.1 - along * dy)
}

/// Returns the pieces of a line within `low..=high`, cut at the limits.
pub(super) fn clip(points: &[(f64, f64)], low: f64, high: f64) -> Vec<Vec<(f64, f64)>> {
    let inside = |p: &(f64, f64)| p.1 >= low && p.1 <= high;
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut piece: Vec<(f64, f64)> = points.first().filter(|p| inside(p)).copied().into_iter().collect();
    for (a, b) in points.iter().zip(points.iter().skip(1)) {
        let cut = |level: f64| (a.0 + (b.0 - a.0) * ((level - a.1) / (b.1 - a.1)), level);
        if a.1.max(b.1) < low || a.1.min(b.1) > high {
            continue;
        }
        if !inside(a) {
            piece.push(cut(if a.1 < low { low } else { high }));
        }
        if inside(b) {
            piece.push(*b);
        } else {
            piece.push(cut(if b.1 < low { low } else { high }));
            pieces.push(core::mem::take(&mut piece));
        }
    }
    pieces.push(piece);
    pieces.retain(|piece| piece.len() > 1);
    pieces
}
