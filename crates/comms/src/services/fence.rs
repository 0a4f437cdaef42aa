//! The geofence that stations upload: areas of inclusion and areas of exclusion.
//!
//! The vehicle must stay inside all inclusions and outside all exclusions, at any height. An area is a circle (one
//! item) or a polygon (one item per vertex). A circle of radius 0 is ignored. [`FenceWatch`] checks a few boundaries
//! after each tick, so that its cost does not depend on their number.

use crate::services::items::{Invalid, check_unused};
use crate::services::origin::LocalChart;
use afbc_guidance::FenceStatus;
use afbc_guidance::fence::{MARGIN_M, PolygonFault, StopPath, check_polygon, distance, passes_edge};
use afbc_mavlink::{MavCmd, MissionItem, MissionResult};
use nalgebra::Vector2;

const RETURN_POINT: u16 = MavCmd::MAV_CMD_NAV_FENCE_RETURN_POINT as u16;
/// Commands of polygon vertices and circles: inclusion, then exclusion.
const VERTEX: [u16; 2] = [
    MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION as u16,
    MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION as u16,
];
const CIRCLE: [u16; 2] =
    [MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION as u16, MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION as u16];
/// Largest radius of a circle, and largest distance of an area from the origin along each axis \[m\].
const FAR_M: f32 = 20_000.0;
/// Number of boundaries checked after each tick.
const LOOKS: usize = 2;
/// A vehicle that was about to leave has stopped once it has been below this speed \[m/s\] for this time \[ticks\].
const SLOW_M_S: f32 = 0.5;
const STOPPED_TICKS: u16 = 500;

/// Checks one item without the others.
///
/// # Errors
/// Returns the first fault of the item.
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
    // The absolute value is unsigned, because `i32::MIN` has no absolute value in `i32`.
    if item.x.unsigned_abs() > 900_000_000 {
        return refuse(MissionResult::INVALID_X, "latitude is out of range");
    }
    if item.y.unsigned_abs() > 1_800_000_000 {
        return refuse(MissionResult::INVALID_Y, "longitude is out of range");
    }
    let [first, ..] = item.parameters;
    if circle && !(0.0..=FAR_M).contains(&first) {
        return refuse(MissionResult::INVALID_PARAM1, "radius must be 0 to 20000 m");
    }
    if !circle && first < 3.0 {
        return refuse(MissionResult::INVALID_PARAM1, "less than three vertices");
    }
    if !circle && vertices(item).is_none() {
        return refuse(MissionResult::INVALID_PARAM1, "number of vertices is invalid");
    }
    Ok(())
}

/// Checks the whole fence for a vehicle at `here_m`, if that is known. The items must be valid one by one.
///
/// # Errors
/// Returns the number of an item and its fault.
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
            return refuse(item, MissionResult(7), "only one inclusion group allowed");
        }
        if let Some(count) = vertices(item) {
            let same = |other: &MissionItem| {
                other.command == item.command && vertices(other) == Some(count) && number(other) == number(item)
            };
            if let Some(other) = area.iter().find(|other| !same(other)) {
                return refuse(other, MissionResult::INVALID_PARAM1, "vertices of two polygons are mixed");
            }
            if area.len() != usize::from(count) {
                return refuse(last, MissionResult::INVALID_PARAM1, "vertices are missing");
            }
        }
        if is_none(item) {
            continue;
        }
        if area.iter().any(|item| chart.local([item.x, item.y]).amax() > FAR_M) {
            return refuse(item, MissionResult::INVALID_X, "over 20 km from the origin");
        }
        if vertices(item).is_some() {
            let vertex = |place: usize| area.get(place).map_or(Vector2::zeros(), |item| chart.local([item.x, item.y]));
            if let Err(fault) = check_polygon(area.len(), vertex) {
                let reason = match fault {
                    PolygonFault::TooFew => "less than three vertices",
                    PolygonFault::Degenerate => "vertices coincide or are in line",
                    PolygonFault::Crossing => "edges cross each other",
                };
                return refuse(item, MissionResult::INVALID_PARAM1, reason);
            }
        }
        if here_m.is_some_and(|here_m| !allows(area, chart, here_m)) {
            return refuse(item, MissionResult::DENIED, "the vehicle is outside this fence");
        }
    }
    Ok(())
}

/// Returns true if a place is inside the fence.
pub fn contains(items: &[MissionItem], chart: &LocalChart, place_m: Vector2<f32>) -> bool {
    areas(items).all(|area| allows(area, chart, place_m))
}

/// Returns true if a place is inside the fence by at least the margin, so that a vehicle can stop there.
pub fn holds(items: &[MissionItem], chart: &LocalChart, place_m: Vector2<f32>) -> bool {
    holds_circle(items, chart, place_m, 0.0)
}

/// Returns true if the straight path between two places does not leave the fence, or if it begins outside.
pub fn is_clear(items: &[MissionItem], chart: &LocalChart, from_m: Vector2<f32>, to_m: Vector2<f32>) -> bool {
    // The path may come as close as a tenth of the margin, so that a vehicle near a boundary can fly along it.
    let path = StopPath { from_m, via_m: to_m, to_m, beside_m: -0.9 * MARGIN_M };
    !contains(items, chart, from_m) || !boundaries(items, chart).any(|boundary| boundary.is_neared(&path))
}

/// Returns true if a circular path is inside the fence by at least the margin.
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
    // One point of the circle is inside and no boundary crosses the circle, so all of it is inside.
    contains(items, chart, centre_m + Vector2::new(radius_m, 0.0)) && boundaries(items, chart).all(clear)
}

/// Motion of the vehicle relative to the fence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FenceMotion {
    /// Position of the vehicle \[m\].
    pub here_m: Vector2<f32>,
    /// Horizontal speed of the vehicle \[m/s\].
    pub speed_m_s: f32,
    /// Stopping paths of the vehicle and of the setpoint.
    pub stops: [StopPath; 2],
}

/// Watches the fence: checks some of the boundaries after each tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FenceWatch {
    /// Items of the next boundary to check, of the first boundary of its area, and of the next area.
    next: u8,
    first: u8,
    end: u8,
    /// Position of the vehicle at the check of the polygon's first edge \[m\].
    from_m: Vector2<f32>,
    /// True if a ray from `from_m` has crossed an odd number of the polygon's edges so far.
    odd: bool,
    /// Findings since the first boundary: the vehicle is about to leave, or it is outside.
    nears: bool,
    outside: bool,
    /// Number of ticks for which the vehicle has stood still and was not about to leave.
    stopped_ticks: u16,
    view: FenceStatus,
}

impl FenceWatch {
    /// Returns the state of the fence for the guidance.
    pub fn view(&self) -> FenceStatus {
        self.view
    }

    /// Restarts for another fence.
    pub fn renew(&mut self) {
        *self = FenceWatch::default();
    }

    /// Checks the next boundaries.
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
                // The flag is raised at once: a round of 64 boundaries takes 32 ticks.
                (self.view.leaves, self.stopped_ticks) = (true, 0);
            }
            match boundary {
                Boundary::Circle { .. } => self.outside |= !boundary.allows(motion.here_m),
                Boundary::Edge(a_m, b_m) => {
                    if next == begin {
                        // All edges use the same position: a moving one would spoil the count of crossings.
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

    /// Ends a round of checks after the last boundary.
    fn end(&mut self) {
        let FenceWatch { nears, outside, stopped_ticks, .. } = *self;
        // The flag stays until the vehicle has stopped: once it brakes, it is soon no longer about to leave.
        let lasts = self.view.leaves && stopped_ticks < STOPPED_TICKS;
        let view = FenceStatus { leaves: nears || outside || lasts, outside };
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

    /// Returns true if a circle permits a place. Always true for an edge.
    fn allows(&self, place_m: Vector2<f32>) -> bool {
        match *self {
            Boundary::Edge(..) => true,
            Boundary::Circle { centre_m, radius_m, included } => {
                ((place_m - centre_m).norm_squared() <= radius_m * radius_m) == included
            }
        }
    }
}

/// Returns a boundary of an area: its circle, or the edge that begins at a vertex. A circle of radius 0 has none.
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

/// Returns all boundaries of a fence.
fn boundaries<'a>(items: &'a [MissionItem], chart: &'a LocalChart) -> impl Iterator<Item = Boundary> + 'a {
    areas(items).flat_map(|area| (0..area.len()).filter_map(|place| boundary(area, place, chart)))
}

/// Returns true if an area permits a place.
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

/// Splits the items into areas. An area has as many items as its first item says, or all that are left.
fn areas(items: &[MissionItem]) -> impl Iterator<Item = &[MissionItem]> {
    let mut rest = items;
    core::iter::from_fn(move || {
        let count = rest.first().map(|item| vertices(item).map_or(1, usize::from))?;
        let (area, others) = rest.split_at_checked(count).unwrap_or((rest, &[]));
        rest = others;
        Some(area)
    })
}

/// Returns the number of vertices of the item's polygon. Returns none for a circle.
fn vertices(item: &MissionItem) -> Option<u8> {
    let [count, ..] = item.parameters;
    let whole = count as u8;
    (VERTEX.contains(&item.command) && whole >= 3 && f32::from(whole) == count).then_some(whole)
}

fn is_inclusion(item: &MissionItem) -> bool {
    let ([vertex, _], [circle, _]) = (VERTEX, CIRCLE);
    [vertex, circle].contains(&item.command)
}

/// Returns true if an item is a circle of radius 0, which MAVSDK sends for an empty fence.
fn is_none(item: &MissionItem) -> bool {
    let [radius_m, ..] = item.parameters;
    CIRCLE.contains(&item.command) && radius_m == 0.0
}

fn or_zero(number: f32) -> f32 {
    if number.is_nan() { 0.0 } else { number }
}

#[cfg(test)]
mod tests;
