//! Geofence by prediction: checks the vehicle's stopping path against the boundaries of areas. Horizontal, local frame.
//!
//! The communication code holds the areas. It checks a few boundaries after each tick, and passes the result to the
//! guidance as [`FenceStatus`].

use crate::shaper::MotionShaper;
use afbc_control::math::{max, min, sqrt};
use nalgebra::Vector2;

/// Distance from a boundary at which the vehicle must have stopped \[m\].
pub const MARGIN_M: f32 = 1.0;
/// Shortest edge of an area \[m\].
const EDGE_MIN_M: f32 = 0.1;
/// Longest time until braking begins \[s\]: every boundary must be checked, and the guidance told.
// Checking 64 boundaries, two after each tick, takes 32 ms.
const REACTION_S: f32 = 0.06;
/// Lag of the vehicle behind its setpoint, since it must tilt first \[s\].
const LAG_S: f32 = 0.25;
/// Safety factor on the predicted stopping distance.
const RESERVE: f32 = 1.05;
/// Bound of the gap between a curved stop and its two straight parts, as a share of acceleration times squared turning
/// time.
const CURVE: f32 = 0.12;

/// State of the uploaded geofence in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FenceStatus {
    /// True if the vehicle would cross a boundary even if it braked now. Stays true until it has stopped.
    pub leaves: bool,
    /// True if the vehicle is outside.
    pub outside: bool,
}

/// Limits of acceleration and jerk that the vehicle brakes with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrakingLimits {
    acceleration_m_s2: f32,
    jerk_m_s3: f32,
}

impl BrakingLimits {
    /// Makes the limits from the largest acceleration \[m/s2\] and jerk \[m/s3\].
    pub const fn new(acceleration_m_s2: f32, jerk_m_s3: f32) -> Self {
        BrakingLimits { acceleration_m_s2, jerk_m_s3 }
    }
}

/// Stopping path of two straight parts: until the acceleration has turned to braking, and from there to the stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopPath {
    /// Start of the path \[m\].
    pub from_m: Vector2<f32>,
    /// End of the first straight part, where the braking begins \[m\].
    pub via_m: Vector2<f32>,
    /// Place of the stop \[m\].
    pub to_m: Vector2<f32>,
    /// Largest distance of the vehicle from the path, since the true path is curved \[m\].
    pub beside_m: f32,
}

impl StopPath {
    /// Returns the path of a setpoint that brakes with the limits of acceleration and jerk of an approach.
    pub fn of_setpoint(
        braking: &BrakingLimits,
        position_m: Vector2<f32>,
        velocity_m_s: Vector2<f32>,
        acceleration_m_s2: Vector2<f32>,
    ) -> Self {
        Self::after(REACTION_S, braking, position_m, velocity_m_s, acceleration_m_s2)
    }

    /// Returns the path of the vehicle itself, which lags behind its setpoint.
    pub fn of_vehicle(
        braking: &BrakingLimits,
        position_m: Vector2<f32>,
        velocity_m_s: Vector2<f32>,
        acceleration_m_s2: Vector2<f32>,
    ) -> Self {
        Self::after(REACTION_S + LAG_S, braking, position_m, velocity_m_s, acceleration_m_s2)
    }

    fn after(
        reaction_s: f32,
        braking: &BrakingLimits,
        from_m: Vector2<f32>,
        velocity_m_s: Vector2<f32>,
        acceleration_m_s2: Vector2<f32>,
    ) -> Self {
        let shape = MotionShaper::new(braking.acceleration_m_s2, braking.jerk_m_s3);
        let brakes_m_s2 = shape.braking(length(velocity_m_s));
        // The acceleration changes in a straight line to `wanted_m_s2`, as fast as the jerk allows.
        let turns = |wanted_m_s2: Vector2<f32>| {
            let turns_s = length(wanted_m_s2 - acceleration_m_s2) / braking.jerk_m_s3;
            (turns_s, velocity_m_s + (acceleration_m_s2 + wanted_m_s2) * (0.5 * turns_s))
        };
        let (_, roughly_m_s) = turns(direction(velocity_m_s) * -brakes_m_s2);
        // The velocity turns while the acceleration changes: brake against the mean of both directions.
        let between = direction(direction(velocity_m_s) + direction(roughly_m_s));
        let wanted_m_s2 = between * -brakes_m_s2;
        let (turns_s, turned_m_s) = turns(wanted_m_s2);
        // Double integral of an acceleration that changes linearly from one value to the other.
        let turning_m = (acceleration_m_s2 * 2.0 + wanted_m_s2) * (turns_s * turns_s / 6.0);
        let via_m = from_m + velocity_m_s * (turns_s + reaction_s) + turning_m;
        let stop_m = shape.stop(length(turned_m_s), brakes_m_s2);
        let to_m = via_m + direction(turned_m_s) * (stop_m * RESERVE);
        StopPath { from_m, via_m, to_m, beside_m: CURVE * length(acceleration_m_s2) * turns_s * turns_s }
    }

    /// True if the path approaches the edge from a to b and comes too close to it.
    pub fn nears_edge(&self, a_m: Vector2<f32>, b_m: Vector2<f32>) -> bool {
        let StopPath { from_m, via_m, to_m, .. } = *self;
        let now_m = distance(from_m, a_m, b_m);
        self.leads(now_m, min(apart(from_m, via_m, a_m, b_m), apart(via_m, to_m, a_m, b_m)))
    }

    /// True if the path approaches the inside of a circular exclusion zone and comes too close to it.
    pub fn nears_disc(&self, centre_m: Vector2<f32>, radius_m: f32) -> bool {
        let off_m = |distance_m: f32| max(distance_m - radius_m, 0.0);
        let StopPath { from_m, via_m, to_m, .. } = *self;
        let nearest_m = min(distance(centre_m, from_m, via_m), distance(centre_m, via_m, to_m));
        self.leads(off_m(length(from_m - centre_m)), off_m(nearest_m))
    }

    /// True if the path approaches the outside of a circular inclusion zone and comes too close to it.
    pub fn nears_rim(&self, centre_m: Vector2<f32>, radius_m: f32) -> bool {
        let off_m = |place_m: Vector2<f32>| max(radius_m - length(place_m - centre_m), 0.0);
        let now_m = off_m(self.from_m);
        self.leads(now_m, min(min(now_m, off_m(self.via_m)), off_m(self.to_m)))
    }

    /// True if the path comes too close to a boundary: from the distance `now_m` to `nearest_m`. False for a vehicle
    /// that stands near the boundary or flies along it, so that it may leave.
    fn leads(&self, now_m: f32, nearest_m: f32) -> bool {
        let approach_m = max(0.1 * (now_m - 0.2), 1e-3);
        nearest_m < MARGIN_M + self.beside_m && now_m - nearest_m > approach_m
    }
}

fn length(vector: Vector2<f32>) -> f32 {
    sqrt(vector.norm_squared())
}

fn direction(vector: Vector2<f32>) -> Vector2<f32> {
    let size = length(vector);
    if size > 1e-3 { vector / size } else { Vector2::zeros() }
}

/// Returns the distance of a place from the line segment from a to b \[m\].
pub fn distance(place_m: Vector2<f32>, a_m: Vector2<f32>, b_m: Vector2<f32>) -> f32 {
    let (line, off) = (b_m - a_m, place_m - a_m);
    // A segment of zero length is a point: any `share` is right.
    let share = off.dot(&line) / max(line.norm_squared(), 1e-12);
    length(off - line * min(max(share, 0.0), 1.0))
}

/// Returns the distance between two line segments, from a to b and from c to d \[m\].
fn apart(a_m: Vector2<f32>, b_m: Vector2<f32>, c_m: Vector2<f32>, d_m: Vector2<f32>) -> f32 {
    if crosses(a_m, b_m, c_m, d_m) {
        return 0.0;
    }
    let ends = min(distance(a_m, c_m, d_m), distance(b_m, c_m, d_m));
    min(ends, min(distance(c_m, a_m, b_m), distance(d_m, a_m, b_m)))
}

/// Returns twice the signed area of a triangle, positive if counter-clockwise.
fn area(a: Vector2<f32>, b: Vector2<f32>, c: Vector2<f32>) -> f32 {
    (b - a).perp(&(c - a))
}

/// True if two line segments have a point in common.
fn crosses(a: Vector2<f32>, b: Vector2<f32>, c: Vector2<f32>, d: Vector2<f32>) -> bool {
    let same_side = |first: f32, second: f32| first * second > 0.0;
    if same_side(area(a, b, c), area(a, b, d)) || same_side(area(c, d, a), area(c, d, b)) {
        return false;
    }
    // Collinear segments must overlap.
    let overlap = |a: f32, b: f32, c: f32, d: f32| max(min(a, b), min(c, d)) <= min(max(a, b), max(c, d));
    overlap(a.x, b.x, c.x, d.x) && overlap(a.y, b.y, c.y, d.y)
}

/// True if a ray from `place_m` along +x crosses the edge. A place is inside a polygon if the ray crosses an odd number
/// of edges.
pub fn passes_edge(place_m: Vector2<f32>, a_m: Vector2<f32>, b_m: Vector2<f32>) -> bool {
    if (a_m.y > place_m.y) == (b_m.y > place_m.y) {
        return false;
    }
    // Horizontal edges have returned above: no division by zero.
    let share = (place_m.y - a_m.y) / (b_m.y - a_m.y);
    a_m.x + share * (b_m.x - a_m.x) > place_m.x
}

/// Reason to reject a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolygonFault {
    /// The polygon has fewer than three vertices.
    TooFew,
    /// Two consecutive vertices coincide, or an edge folds back onto the one before.
    Degenerate,
    /// Two edges cross or touch each other.
    Crossing,
}

/// Checks a polygon of `count` vertices, listed in order around it.
///
/// # Errors
/// The first fault found.
pub fn check_polygon(count: usize, vertex: impl Fn(usize) -> Vector2<f32>) -> Result<(), PolygonFault> {
    if count < 3 {
        return Err(PolygonFault::TooFew);
    }
    let next = |place: usize| if place + 1 == count { 0 } else { place + 1 };
    for first in 0..count {
        let (a, b) = (vertex(first), vertex(next(first)));
        let after = vertex(next(next(first)));
        let (edge, following) = (b - a, after - b);
        let turns = edge.perp(&following).abs() > 1e-6 * (edge.norm_squared() + following.norm_squared());
        if length(edge) < EDGE_MIN_M || !turns && edge.dot(&following) <= 0.0 {
            return Err(PolygonFault::Degenerate);
        }
        // Adjacent edges share a vertex, and are not compared.
        for second in first + 2..count {
            if next(second) != first && crosses(a, b, vertex(second), vertex(next(second))) {
                return Err(PolygonFault::Crossing);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
