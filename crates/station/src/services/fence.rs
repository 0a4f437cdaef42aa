//! The geofence that stations upload: areas to stay in, and areas to stay out of.
//!
//! The vehicle must be inside all areas of inclusion, and outside all areas of exclusion, at any height. An area is a
//! polygon, a vertex an item, or a circle; a circle of radius 0 is none. A few boundaries are looked at after each tick
//! ([`FenceWatch`]), so that its cost does not depend on their number.

use crate::services::items::{Invalid, check_unused};
use crate::services::origin::LocalChart;
use afbc_guidance::FenceView;
use afbc_guidance::fence::{MARGIN_M, PolygonFault, StopPath, check_polygon, distance, passes_edge};
use afbc_link::{MavCmd, MissionItem, MissionResult};
use nalgebra::Vector2;

const RETURN_POINT: u16 = MavCmd::MAV_CMD_NAV_FENCE_RETURN_POINT as u16;
/// To stay in, and to stay out of.
const VERTEX: [u16; 2] = [
    MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION as u16,
    MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION as u16,
];
const CIRCLE: [u16; 2] =
    [MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION as u16, MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION as u16];
/// Largest radius, and distance of an area from the origin \[m\].
const FAR_M: f32 = 20_000.0;
/// Boundaries looked at after a tick.
const LOOKS: usize = 2;
/// Speed below which a vehicle that was about to leave has stopped \[m/s\], and for how long it must have \[ticks\].
const SLOW_M_S: f32 = 0.5;
const STOPPED_TICKS: u16 = 500;

/// Checks an item by itself.
///
/// # Errors
/// The first thing that is wrong with it.
pub fn check_item(item: &MissionItem) -> Result<(), Invalid> {
    let refuse = |result, reason| Err(Invalid { result, reason });
    if item.command == RETURN_POINT {
        return refuse(MissionResult::UNSUPPORTED, "return point is not supported");
    }
    let circle = CIRCLE.contains(&item.command);
    if !circle && !VERTEX.contains(&item.command) {
        return Err(Invalid::COMMAND);
    }
    check_unused(item, if is_inclusion(item) { 0b011_0011 } else { 0b011_0001 })?;
    if ![0, 3, 5, 6].contains(&item.frame) {
        return refuse(MissionResult::UNSUPPORTED_FRAME, "frame is not supported");
    }
    // Unsigned, since the smallest number has no other absolute value.
    if item.x.unsigned_abs() > 900_000_000 {
        return refuse(MissionResult::INVALID_X, "latitude is out of range");
    }
    if item.y.unsigned_abs() > 1_800_000_000 {
        return refuse(MissionResult::INVALID_Y, "longitude is out of range");
    }
    let [first, ..] = item.parameters;
    if circle && !(0.0..=FAR_M).contains(&first) {
        return refuse(MissionResult::INVALID_PARAM1, "radius is not 0 to 20000 m");
    }
    if !circle && first < 3.0 {
        return refuse(MissionResult::INVALID_PARAM1, "less than three vertices");
    }
    if !circle && vertices(item).is_none() {
        return refuse(MissionResult::INVALID_PARAM1, "number of vertices is invalid");
    }
    Ok(())
}

/// Checks the whole fence, whose items are valid by themselves, for a vehicle at `here_m`, if that is known.
///
/// # Errors
/// The number of an item, and what is wrong with it.
pub fn check(
    items: &[MissionItem],
    chart: Option<&LocalChart>,
    here_m: Option<Vector2<f32>>,
) -> Result<(), (u16, Invalid)> {
    let refuse = |item: &MissionItem, result, reason| Err((item.number, Invalid { result, reason }));
    let Some(first) = items.first() else { return Ok(()) };
    let Some(chart) = chart else {
        return refuse(first, MissionResult::ERROR, "no position yet, try again");
    };
    let mut group = None;
    for area in areas(items) {
        let (Some(item), Some(last)) = (area.first(), area.last()) else { continue };
        let included = is_inclusion(item);
        let number = |item: &MissionItem| or_zero(item.parameters[1]);
        if included && number(item) != *group.get_or_insert(number(item)) {
            return refuse(item, MissionResult(7), "one group of inclusions only");
        }
        if let Some(count) = vertices(item) {
            let same = |other: &MissionItem| {
                other.command == item.command && vertices(other) == Some(count) && number(other) == number(item)
            };
            if let Some(other) = area.iter().find(|other| !same(other)) {
                return refuse(other, MissionResult::INVALID_PARAM1, "vertices do not belong together");
            }
            if area.len() != usize::from(count) {
                return refuse(last, MissionResult::INVALID_PARAM1, "vertices are missing");
            }
        }
        if is_none(item) {
            continue;
        }
        if area.iter().any(|item| chart.local([item.x, item.y]).amax() > FAR_M) {
            return refuse(item, MissionResult::INVALID_X, "farther away than 20 km");
        }
        if vertices(item).is_some() {
            let vertex = |place: usize| area.get(place).map_or(Vector2::zeros(), |item| chart.local([item.x, item.y]));
            if let Err(fault) = check_polygon(area.len(), vertex) {
                let reason = match fault {
                    PolygonFault::TooFew => "less than three vertices",
                    PolygonFault::Degenerate => "vertices at one place, or on one line",
                    PolygonFault::Crossing => "edges cross each other",
                };
                return refuse(item, MissionResult::INVALID_PARAM1, reason);
            }
        }
        if here_m.is_some_and(|here_m| !allows(area, chart, here_m)) {
            return refuse(item, MissionResult::DENIED, "the vehicle is outside");
        }
    }
    Ok(())
}

/// True if a place is inside the fence.
pub fn contains(items: &[MissionItem], chart: &LocalChart, place_m: Vector2<f32>) -> bool {
    areas(items).all(|area| allows(area, chart, place_m))
}

/// True if a vehicle can stop at a place: it is well inside the fence.
pub fn holds(items: &[MissionItem], chart: &LocalChart, place_m: Vector2<f32>) -> bool {
    holds_circle(items, chart, place_m, 0.0)
}

/// True if the straight way between two places inside the fence does not leave it; also if it begins outside.
pub fn is_clear(items: &[MissionItem], chart: &LocalChart, from_m: Vector2<f32>, to_m: Vector2<f32>) -> bool {
    // Up to a tenth of the margin, so that a vehicle near the boundary can fly along it.
    let path = StopPath { from_m, via_m: to_m, to_m, beside_m: -0.9 * MARGIN_M };
    !contains(items, chart, from_m) || !boundaries(items, chart).any(|boundary| boundary.is_neared(&path))
}

/// True if a circle is inside the fence.
pub fn holds_circle(items: &[MissionItem], chart: &LocalChart, centre_m: Vector2<f32>, radius_m: f32) -> bool {
    let clear = |boundary: Boundary| match boundary {
        Boundary::Edge(a_m, b_m) => {
            let farthest_m = (a_m - centre_m).norm_squared().max((b_m - centre_m).norm_squared());
            let within_m = (radius_m - MARGIN_M).max(0.0);
            distance(centre_m, a_m, b_m) >= radius_m + MARGIN_M || farthest_m <= within_m * within_m
        }
        Boundary::Circle { centre_m: other_m, radius_m: other, included } => {
            let apart_m = distance(centre_m, other_m, other_m);
            let within = apart_m + other <= radius_m - MARGIN_M;
            if included {
                apart_m + radius_m <= other - MARGIN_M
            } else {
                within || apart_m >= other + radius_m + MARGIN_M
            }
        }
    };
    // A point of it is inside, and nothing crosses it: then all of it is.
    contains(items, chart, centre_m + Vector2::new(radius_m, 0.0)) && boundaries(items, chart).all(clear)
}

/// How the vehicle moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FenceMotion {
    /// Where it is \[m\].
    pub here_m: Vector2<f32>,
    /// Its horizontal speed \[m/s\].
    pub speed_m_s: f32,
    /// How vehicle and setpoint would stop.
    pub stops: [StopPath; 2],
}

/// Looks at the fence, some of its boundaries after each tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FenceWatch {
    /// The boundary to be looked at next, by its item; the first of its area, and of the next one.
    next: u8,
    first: u8,
    end: u8,
    /// Where the vehicle was when the polygon was begun \[m\].
    from_m: Vector2<f32>,
    /// True if an odd number of the polygon's edges has been passed by a ray from there.
    odd: bool,
    /// What has been found since the first boundary.
    nears: bool,
    outside: bool,
    /// Ticks for which it has stopped without being about to leave.
    stopped_ticks: u16,
    view: FenceView,
}

impl FenceWatch {
    /// Returns what has been found.
    pub fn view(&self) -> FenceView {
        self.view
    }

    /// Begins with another fence.
    pub fn renew(&mut self) {
        *self = FenceWatch::default();
    }

    /// Looks at the next boundaries.
    pub fn look(&mut self, items: &[MissionItem], chart: &LocalChart, motion: &FenceMotion) {
        let stopped = motion.speed_m_s < SLOW_M_S;
        self.stopped_ticks = if stopped { self.stopped_ticks.saturating_add(1) } else { 0 };
        for _ in 0..LOOKS.min(items.len()) {
            self.look_at_next(items, chart, motion);
        }
    }

    fn look_at_next(&mut self, items: &[MissionItem], chart: &LocalChart, motion: &FenceMotion) {
        let next = usize::from(self.next);
        let Some(item) = items.get(next) else { return self.end() };
        if self.next >= self.end {
            self.first = self.next;
            self.end = self.next.saturating_add(vertices(item).unwrap_or(1));
        }
        let (begin, end) = (usize::from(self.first), usize::from(self.end));
        if let Some(boundary) = boundary(items.get(begin..end).unwrap_or_default(), next.saturating_sub(begin), chart) {
            let nears = motion.stops.iter().any(|path| boundary.is_neared(path));
            self.nears |= nears;
            if nears {
                // At once: a round of 64 boundaries takes 32 ticks.
                (self.view.leaves, self.stopped_ticks) = (true, 0);
            }
            match boundary {
                Boundary::Circle { .. } => self.outside |= !boundary.allows(motion.here_m),
                Boundary::Edge(a_m, b_m) => {
                    if next == begin {
                        // One place for all edges: with one for each, a moving vehicle would spoil the count.
                        (self.from_m, self.odd) = (motion.here_m, false);
                    }
                    self.odd ^= passes_edge(self.from_m, a_m, b_m);
                    self.outside |= next + 1 == end && self.odd != is_inclusion(item);
                }
            }
        }
        self.next = self.next.saturating_add(1);
        if usize::from(self.next) >= items.len() {
            self.end();
        }
    }

    /// Ends with the last boundary.
    fn end(&mut self) {
        let FenceWatch { nears, outside, stopped_ticks, .. } = *self;
        // Until it has stopped: a vehicle that brakes is soon no longer about to leave.
        let lasts = self.view.leaves && stopped_ticks < STOPPED_TICKS;
        let view = FenceView { leaves: nears || outside || lasts, outside };
        *self = FenceWatch { view, stopped_ticks, ..FenceWatch::default() };
    }
}

/// A boundary of an area.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Boundary {
    Edge(Vector2<f32>, Vector2<f32>),
    Circle { centre_m: Vector2<f32>, radius_m: f32, included: bool },
}

impl Boundary {
    fn is_neared(&self, path: &StopPath) -> bool {
        match *self {
            Boundary::Edge(a_m, b_m) => path.nears_edge(a_m, b_m),
            Boundary::Circle { centre_m, radius_m, included: true } => path.nears_rim(centre_m, radius_m),
            Boundary::Circle { centre_m, radius_m, .. } => path.nears_disc(centre_m, radius_m),
        }
    }

    /// True if a circle does not exclude a place.
    fn allows(&self, place_m: Vector2<f32>) -> bool {
        match *self {
            Boundary::Edge(..) => true,
            Boundary::Circle { centre_m, radius_m, included } => {
                ((place_m - centre_m).norm_squared() <= radius_m * radius_m) == included
            }
        }
    }
}

/// Returns a boundary of an area: its circle, or the edge that begins at a vertex; none of a circle of radius 0.
fn boundary(area: &[MissionItem], place: usize, chart: &LocalChart) -> Option<Boundary> {
    let item = area.get(place)?;
    let begin_m = chart.local([item.x, item.y]);
    if vertices(item).is_none() {
        let [radius_m, ..] = item.parameters;
        return (!is_none(item)).then_some(Boundary::Circle {
            centre_m: begin_m,
            radius_m,
            included: is_inclusion(item),
        });
    }
    let next = area.get(place + 1).or(area.first())?;
    Some(Boundary::Edge(begin_m, chart.local([next.x, next.y])))
}

/// Returns every boundary of a fence.
fn boundaries<'a>(items: &'a [MissionItem], chart: &'a LocalChart) -> impl Iterator<Item = Boundary> + 'a {
    areas(items).flat_map(|area| (0..area.len()).filter_map(|place| boundary(area, place, chart)))
}

/// True if an area does not exclude a place.
fn allows(area: &[MissionItem], chart: &LocalChart, place_m: Vector2<f32>) -> bool {
    let mut odd = false;
    for boundary in (0..area.len()).filter_map(|place| boundary(area, place, chart)) {
        match boundary {
            Boundary::Circle { .. } => return boundary.allows(place_m),
            Boundary::Edge(a_m, b_m) => odd ^= passes_edge(place_m, a_m, b_m),
        }
    }
    area.first().is_none_or(|item| is_none(item) || odd == is_inclusion(item))
}

/// Returns the areas, each with its items: as many as the first one says, or what is left.
fn areas(items: &[MissionItem]) -> impl Iterator<Item = &[MissionItem]> {
    let mut rest = items;
    core::iter::from_fn(move || {
        let count = rest.first().map(|item| vertices(item).map_or(1, usize::from))?;
        let (area, others) = rest.split_at_checked(count).unwrap_or((rest, &[]));
        rest = others;
        Some(area)
    })
}

/// Returns the number of vertices of the polygon to which an item belongs; none of a circle.
fn vertices(item: &MissionItem) -> Option<u8> {
    let [count, ..] = item.parameters;
    let whole = count as u8;
    (VERTEX.contains(&item.command) && whole >= 3 && f32::from(whole) == count).then_some(whole)
}

fn is_inclusion(item: &MissionItem) -> bool {
    let ([vertex, _], [circle, _]) = (VERTEX, CIRCLE);
    [vertex, circle].contains(&item.command)
}

/// True if an item is a circle of radius 0, which MAVSDK sends in place of none.
fn is_none(item: &MissionItem) -> bool {
    let [radius_m, ..] = item.parameters;
    CIRCLE.contains(&item.command) && radius_m == 0.0
}

fn or_zero(number: f32) -> f32 {
    if number.is_nan() { 0.0 } else { number }
}

#[cfg(test)]
mod tests;
