//! Compares predicted stopping paths with flights of the limiter, and the geometry with definitions.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "tests")]

extern crate std;
use super::*;
use crate::limiter::{Limiter, LimiterTarget};
use crate::settings::MotionLimits;
use afbc_types::State;
use nalgebra::Vector3;
use proptest::prelude::*;
use std::vec::Vec;

const DT_S: f32 = 1e-3;

fn place() -> impl Strategy<Value = Vector2<f32>> {
    (-20.0_f32..20.0, -20.0_f32..20.0).prop_map(|(x, y)| Vector2::new(x, y))
}

fn limits() -> impl Strategy<Value = MotionLimits> {
    (1.0_f32..15.0, 1.0_f32..8.0, 4.0_f32..40.0, 1.0_f32..2.0).prop_map(|(speed_m_s, acceleration_m_s2, jerk, more)| {
        MotionLimits {
            speed_m_s,
            acceleration_m_s2,
            acceleration_max_m_s2: acceleration_m_s2 * more,
            jerk_m_s3: jerk,
            jerk_max_m_s3: jerk * more * 3.0,
            ..MotionLimits::DEFAULT
        }
    })
}

/// Draws a star-shaped polygon around the origin, which does not cross itself.
fn star() -> impl Strategy<Value = Vec<Vector2<f32>>> {
    prop::collection::vec(2.0_f32..20.0, 3..12).prop_map(|radii| {
        let turn = core::f32::consts::TAU / radii.len() as f32;
        let corner = |(place, radius): (usize, &f32)| {
            let (s, c) = (place as f32 * turn).sin_cos();
            Vector2::new(c, s) * *radius
        };
        radii.iter().enumerate().map(corner).collect()
    })
}

fn edges(polygon: &[Vector2<f32>]) -> impl Iterator<Item = (Vector2<f32>, Vector2<f32>)> {
    (0..polygon.len()).map(|place| (polygon[place], polygon[(place + 1) % polygon.len()]))
}

fn at(state: Vector2<f32>, velocity: Vector2<f32>) -> State {
    State {
        position_m: Vector3::new(state.x, state.y, 0.0),
        velocity_m_s: Vector3::new(velocity.x, velocity.y, 0.0),
        ..State::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]

    /// The limiter stops on the predicted path, after any flight, and not much earlier.
    #[test]
    fn a_stop_ends_as_predicted(
        limits in limits(),
        heading in 0.0_f32..6.3,
        share in 0.0_f32..1.0,
        push in (-10.0_f32..10.0, -10.0_f32..10.0),
        before in 0..800_u32,
    ) {
        let mut limiter = Limiter::new(limits).unwrap();
        let (s, c) = heading.sin_cos();
        limiter.anchor(&at(Vector2::new(3.0, 4.0), Vector2::new(c, s) * (share * limits.speed_m_s)));
        let stop = LimiterTarget::stop(limits.speed_m_s, 3.0, 1.5);
        let nan = f32::NAN;
        let pushed = LimiterTarget { acceleration_m_s2: Vector3::new(push.0, push.1, nan), ..stop };
        for _ in 0..before {
            limiter.advance(&pushed, DT_S);
        }
        let begun = limiter.setpoint().unwrap();
        let (p, v, a) = (begun.position_m.xy(), begun.velocity_m_s.xy(), begun.acceleration_m_s2.xy());
        let path = StopPath::of_setpoint(&limits.braking(), p, v, a);
        for _ in 0..40_000 {
            limiter.advance(&stop, DT_S);
            let now = limiter.setpoint().unwrap();
            let now_m = now.position_m.xy();
            let off_m = distance(now_m, path.from_m, path.via_m).min(distance(now_m, path.via_m, path.to_m));
            // The setpoint may use half of the margin. The vehicle needs the other half.
            prop_assert!(off_m < 0.5 * MARGIN_M + path.beside_m, "{off_m} m off {path:?}");
            if now.velocity_m_s.norm() < 1e-3 {
                break;
            }
        }
        let stopped = limiter.setpoint().unwrap().position_m.xy();
        let (predicted_m, flown_m) = ((path.to_m - p).norm(), (stopped - p).norm());
        prop_assert!(predicted_m < 1.6 * flown_m + 0.1 * v.norm() + 1.0, "{predicted_m} m of {flown_m} m");
    }

    /// The distance of a path from an edge equals the distance of its nearest point, found by sampling.
    #[test]
    fn a_way_nears_an_edge_as_its_points_do(
        (a, b) in (place(), place()),
        (from, via, to) in (place(), place(), place()),
    ) {
        prop_assume!((b - a).norm() > 0.5);
        let path = StopPath { from_m: from, via_m: via, to_m: to, beside_m: 0.0 };
        let points = |share: u32| match share {
            0..1000 => from + (via - from) * (share as f32 / 1000.0),
            _ => via + (to - via) * ((share - 1000) as f32 / 1000.0),
        };
        let nearest = (0..=2000).map(|share| distance(points(share), a, b)).fold(f32::MAX, f32::min);
        let now = distance(from, a, b);
        // Skip cases close to the thresholds.
        let approach = now - nearest;
        prop_assume!((nearest - MARGIN_M).abs() > 0.05 && (approach - (0.1 * (now - 0.2)).max(1e-3)).abs() > 0.05);
        let nears = nearest < MARGIN_M && approach > 0.1 * (now - 0.2);
        prop_assert_eq!(path.nears_edge(a, b), nears, "{} m, {} m", now, nearest);
        // A disc and a rim are checked in the same way, against the definition of their distance.
        let centre = a;
        let off = |outside: f32, point: Vector2<f32>| (outside * ((point - centre).norm() - 8.0)).max(0.0);
        for (outside, nears) in [(1.0, path.nears_disc(centre, 8.0)), (-1.0, path.nears_rim(centre, 8.0))] {
            let nearest = (0..=2000).map(|share| off(outside, points(share))).fold(f32::MAX, f32::min);
            let now = off(outside, from);
            let approach = now - nearest;
            if (nearest - MARGIN_M).abs() > 0.05 && (approach - (0.1 * (now - 0.2)).max(1e-3)).abs() > 0.05 {
                prop_assert_eq!(nears, nearest < MARGIN_M && approach > (0.1 * (now - 0.2)).max(1e-3));
            }
        }
    }

    /// Every star is a valid area. A place is inside if a triangle of the middle and an edge contains it.
    #[test]
    fn a_star_holds_what_is_within_it(polygon in star(), place in place()) {
        prop_assert_eq!(check_polygon(polygon.len(), |it| polygon[it]), Ok(()));
        let within = edges(&polygon).any(|(a, b)| {
            // The place is in the triangle of the middle and this edge.
            let middle = Vector2::zeros();
            area(middle, a, place) >= 0.0 && area(a, b, place) >= 0.0 && area(b, middle, place) >= 0.0
        });
        let near = edges(&polygon).any(|(a, b)| distance(place, a, b) < 1e-3);
        let passed = edges(&polygon).filter(|(a, b)| passes_edge(place, *a, *b)).count();
        prop_assert!(near || (passed % 2 == 1) == within, "{place}");
    }

    /// Swapping two vertices makes edges cross, or leaves the polygon valid.
    #[test]
    fn edges_that_cross_are_found(polygon in star(), first in 0..12_usize, second in 0..12_usize) {
        let mut changed = polygon.clone();
        let count = polygon.len();
        changed.swap(first % count, second % count);
        let crossing = (0..count).any(|one| {
            (one + 2..count).any(|other| {
                let (a, b) = (changed[one], changed[(one + 1) % count]);
                let (c, d) = (changed[other], changed[(other + 1) % count]);
                // Two sides intersect if the solution for both parameters lies between 0 and 1.
                let (r, s) = (b - a, d - c);
                let whole = r.perp(&s);
                let (t, u) = ((c - a).perp(&s) / whole, (c - a).perp(&r) / whole);
                (one, other) != (0, count - 1) && (0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&u)
            })
        });
        let fault = check_polygon(count, |it| changed[it]);
        prop_assert_eq!(fault == Err(PolygonFault::Crossing), crossing, "{:?}", changed);
    }
}

#[test]
fn what_is_no_area_is_refused() {
    let check = |corners: &[[f32; 2]]| check_polygon(corners.len(), |place| Vector2::from(corners[place])).err();
    assert_eq!(check(&[[0.0, 0.0], [9.0, 0.0]]), Some(PolygonFault::TooFew));
    assert_eq!(check(&[]), Some(PolygonFault::TooFew));
    assert_eq!(check(&[[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]), None);
    assert_eq!(check(&[[0.0, 0.0], [9.0, 0.0], [9.0, 0.05]]), Some(PolygonFault::Degenerate));
    // One edge folds back onto another.
    assert_eq!(check(&[[0.0, 0.0], [9.0, 0.0], [4.0, 0.0]]), Some(PolygonFault::Degenerate));
    // One polygon has a vertex on another edge. The other is a bow tie.
    let touching = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [4.0, 0.0], [0.0, 9.0]];
    assert_eq!(check(&touching), Some(PolygonFault::Crossing));
    assert_eq!(check(&[[0.0, 0.0], [9.0, 9.0], [9.0, 0.0], [0.0, 9.0]]), Some(PolygonFault::Crossing));
    // A vertex in the middle of a straight edge is allowed.
    assert_eq!(check(&[[0.0, 0.0], [4.0, 0.0], [9.0, 0.0], [9.0, 9.0]]), None);
}

/// A vehicle that stands near a boundary, flies along it or away from it does not count as leaving.
#[test]
fn only_what_leads_to_the_boundary_counts() {
    let (a, b) = (Vector2::new(-50.0, 0.0), Vector2::new(50.0, 0.0));
    let braking = MotionLimits::DEFAULT.braking();
    let nears = |y: f32, velocity: [f32; 2]| {
        let path = StopPath::of_vehicle(&braking, Vector2::new(0.0, y), velocity.into(), Vector2::zeros());
        path.nears_edge(a, b)
    };
    for y in [0.5, 0.9, 1.5] {
        assert!(!nears(y, [0.0, 0.0]) && !nears(y, [8.0, 0.0]) && !nears(y, [1.0, 2.0]), "{y} m");
        assert!(nears(y, [0.0, -2.0]), "{y} m");
    }
    // A stop from 10 m/s with 3 m/s2 takes 17 m, plus some for jerk and reaction.
    assert!(nears(20.0, [0.0, -10.0]) && !nears(32.0, [0.0, -10.0]));
    assert!(nears(0.05, [0.0, -0.02]), "nor slowly");
}
