//! Fences are uploaded, checked and watched like those of real stations.
#![allow(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used, reason = "tests")]

extern crate std;
use super::*;
use crate::services::mission::{Missions, Surroundings};
use crate::services::origin::{EarthOrigin, Global};
use crate::services::texts::Words;
use afbc_guidance::MotionLimits;
use afbc_mavlink::{Address, MissionMessage, MissionType};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::vec;
use std::vec::Vec;

const A: Address = Address { system: 255, component: 190 };

fn origin() -> EarthOrigin {
    EarthOrigin::new(EarthOrigin::SIMULATED).unwrap()
}

fn at(place_m: [f32; 2]) -> [i32; 2] {
    origin().global(&Vector3::new(place_m[0], place_m[1], 0.0)).e7()
}

fn item(command: u16, first: f32, place_m: [f32; 2]) -> MissionItem {
    let [x, y] = at(place_m);
    MissionItem { command, frame: 5, goes_on: true, parameters: [first, 0.0, 0.0, 0.0], x, y, ..MissionItem::default() }
}

fn polygon(command: u16, corners: &[[f32; 2]]) -> Vec<MissionItem> {
    corners.iter().map(|corner| item(command, corners.len() as f32, *corner)).collect()
}

fn square(command: u16, [x, y]: [f32; 2], half: f32) -> Vec<MissionItem> {
    polygon(command, &[[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]])
}

fn numbered(items: Vec<MissionItem>) -> Vec<MissionItem> {
    items.into_iter().zip(0..).map(|(item, number)| MissionItem { number, ..item }).collect()
}

fn around(here: Option<[f32; 2]>) -> Surroundings {
    Surroundings { origin: Some(origin()), here_m: here.map(Vector2::from), ..Surroundings::default() }
}

/// Uploads a fence. Returns the result and the text.
fn upload(missions: &mut Missions, items: &[MissionItem], around: &Surroundings) -> (MissionResult, Option<Words>) {
    let mut heard = missions.hear(MissionMessage::Count(items.len() as u16, MissionType::FENCE), A, true, 0, around);
    while let Some((message, to)) = missions.next_message() {
        assert_eq!(to, A);
        match message {
            MissionMessage::Request(number, MissionType::FENCE) => {
                let item = items[usize::from(number)];
                heard = missions.hear(MissionMessage::Item(item, MissionType::FENCE), A, true, 0, around);
            }
            MissionMessage::Ack(result, MissionType::FENCE) => {
                assert_eq!(heard.fence, result == MissionResult::ACCEPTED);
                return (result, heard.text);
            }
            other => panic!("{other:?}"),
        }
    }
    panic!("no answer");
}

fn stars() -> impl Strategy<Value = Vec<[f32; 2]>> {
    (prop::collection::vec(5.0_f32..300.0, 3..12), -200.0_f32..200.0, -200.0_f32..200.0).prop_map(|(radii, x, y)| {
        let turn = core::f32::consts::TAU / radii.len() as f32;
        let corner = |(place, radius): (usize, &f32)| {
            let (s, c) = (place as f32 * turn).sin_cos();
            [x + c * radius, y + s * radius]
        };
        radii.iter().enumerate().map(corner).collect()
    })
}

/// Generates fences of polygons and circles, inclusions and exclusions.
fn fences() -> impl Strategy<Value = Vec<MissionItem>> {
    let area =
        prop_oneof![
            (0..2_usize, stars()).prop_map(|(kind, corners)| polygon(VERTEX[kind], &corners)),
            (0..2_usize, 0.0_f32..300.0, -200.0_f32..200.0, -200.0_f32..200.0)
                .prop_map(|(kind, radius, x, y)| vec![item(CIRCLE[kind], radius, [x, y])]),
        ];
    prop::collection::vec(area, 0..5).prop_map(|areas| numbered(areas.concat()))
}

/// Returns true if a place is inside, computed from the definitions in double precision.
fn inside(items: &[MissionItem], place: [f64; 2]) -> bool {
    let mut rest = items;
    let local = |item: &MissionItem| {
        let place = origin().local(&Global::of_e7([item.x, item.y], 0.0));
        [f64::from(place.x), f64::from(place.y)]
    };
    while let Some(first) = rest.first() {
        let vertex = VERTEX.contains(&first.command);
        let count = if vertex { first.parameters[0] as usize } else { 1 };
        let (area, others) = rest.split_at(count);
        rest = others;
        let included = first.command % 2 == 1;
        if !vertex {
            let [x, y] = local(first);
            let (off, radius) = ((place[0] - x).hypot(place[1] - y), f64::from(first.parameters[0]));
            if radius > 0.0 && (off <= radius) != included {
                return false;
            }
            continue;
        }
        // Sum of the angles that the edges subtend at the place.
        let seen: f64 = (0..count)
            .map(|edge| {
                let ([a, b], [c, d]) = (local(&area[edge]), local(&area[(edge + 1) % count]));
                let (from, to) = ((b - place[1]).atan2(a - place[0]), (d - place[1]).atan2(c - place[0]));
                (to - from + 3.0 * core::f64::consts::PI).rem_euclid(core::f64::consts::TAU) - core::f64::consts::PI
            })
            .sum();
        if (seen.abs() > core::f64::consts::PI) != included {
            return false;
        }
    }
    true
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    /// A download returns exactly the uploaded items. The mission in the same storage does not change.
    #[test]
    fn what_was_uploaded_can_be_downloaded(items in fences(), mission in 0..5_u16) {
        let mut missions = Missions::default();
        let [x, y] = at([1.0, 2.0]);
        for number in 0..mission {
            let waypoint = MissionItem { number, command: 16, frame: 6, x, y, ..MissionItem::default() };
            if number == 0 {
                missions.hear(MissionMessage::Count(mission, MissionType::MISSION), A, true, 0, &around(None));
            }
            missions.hear(MissionMessage::Item(waypoint, MissionType::MISSION), A, true, 0, &around(None));
        }
        while missions.next_message().is_some() {}
        for _ in 0..2 {
            prop_assert_eq!(upload(&mut missions, &items, &around(None)), (MissionResult::ACCEPTED, None));
            prop_assert_eq!(missions.items().len(), usize::from(mission));
            missions.hear(MissionMessage::List(MissionType::FENCE), A, false, 0, &around(None));
            let count = MissionMessage::Count(items.len() as u16, MissionType::FENCE);
            prop_assert_eq!(missions.next_message(), Some((count, A)));
            for item in &items {
                missions.hear(MissionMessage::Request(item.number, MissionType::FENCE), A, false, 0, &around(None));
                prop_assert_eq!(missions.next_message(), Some((MissionMessage::Item(*item, MissionType::FENCE), A)));
            }
        }
        let heard = missions.hear(MissionMessage::Clear(MissionType::FENCE), A, true, 0, &around(None));
        prop_assert!(heard.fence && missions.fence().is_empty());
        prop_assert_eq!(missions.items().len(), usize::from(mission));
    }

    /// Fence watch and definition agree on whether a place is inside. Places close to a boundary are left out.
    #[test]
    fn a_vehicle_is_inside_or_not(items in fences(), x in -400.0_f32..400.0, y in -400.0_f32..400.0) {
        let chart = origin().chart();
        let here_m = Vector2::new(x, y);
        prop_assume!(boundaries(&items, &chart).all(|boundary| match boundary {
            Boundary::Edge(a, b) => distance(here_m, a, b) > 0.05,
            Boundary::Circle { centre_m, radius_m, .. } => ((here_m - centre_m).norm() - radius_m).abs() > 0.05,
        }));
        let truth = inside(&items, [x.into(), y.into()]);
        prop_assert_eq!(contains(&items, &chart, here_m), truth);
        let stop = StopPath::of_vehicle(&MotionLimits::DEFAULT.braking(), here_m, Vector2::zeros(), Vector2::zeros());
        let motion = FenceMotion { here_m, speed_m_s: 0.0, stops: [stop; 2] };
        let mut watch = FenceWatch::default();
        for _ in 0..items.len() {
            watch.look(&items, &chart, &motion);
        }
        prop_assert_eq!(watch.view(), FenceStatus { leaves: !truth, outside: !truth });
        // The same fence is refused if the vehicle is outside.
        let refused = check(&items, Some(&chart), Some(here_m)).err().map(|(_, invalid)| invalid.reason);
        prop_assert_eq!(refused, (!truth).then_some("the vehicle is outside this fence"));
    }

    /// The chart agrees with the exact conversion.
    #[test]
    fn the_chart_is_the_earth(
        latitude in -70.0_f64..70.0,
        longitude in -180.0_f64..180.0,
        x in -1.0_f32..1.0,
        y in -1.0_f32..1.0,
    ) {
        let at = Global { latitude_deg: latitude, longitude_deg: longitude, altitude_m: 300.0 };
        let origin = EarthOrigin::new(at).unwrap();
        for (reach, most) in [(1000.0, 0.03), (10_000.0, 0.4), (20_000.0, 2.0)] {
            let place = Vector3::new(x * reach, y * reach, 0.0);
            let e7 = origin.global(&place).e7();
            let [latitude, mut longitude] = e7;
            if longitude > 1_800_000_000 {
                longitude -= 1_800_000_000;
                longitude -= 1_800_000_000;
            }
            let local = origin.chart().local([latitude, longitude]);
            prop_assert!((local - place.xy()).norm() < most, "{local} {place}");
        }
    }

    /// Any item is answered, and none causes a panic.
    #[test]
    fn any_items_are_answered(
        items in prop::collection::vec(
            (4999..5006_u16, any::<f32>(), -3.0_f32..70.0, any::<i32>(), any::<i32>(), any::<bool>()),
            1..30,
        ),
    ) {
        let items = items.into_iter().map(|(command, wild, tame, x, y, tamed)| MissionItem {
            command,
            frame: 5,
            parameters: [if tamed { tame.round() } else { wild }, wild, wild, wild],
            x,
            y,
            ..MissionItem::default()
        });
        let items = numbered(items.collect());
        let checked = items.iter().all(|item| check_item(item).is_ok());
        let mut missions = Missions::default();
        let (result, text) = upload(&mut missions, &items, &around(Some([0.0, 0.0])));
        prop_assert!(checked || result != MissionResult::ACCEPTED);
        prop_assert_eq!(text.is_some(), result != MissionResult::ACCEPTED);
        // A fence of such items causes no panic either.
        let chart = origin().chart();
        let _ = contains(&items, &chart, Vector2::zeros());
        let (braking, none) = (MotionLimits::DEFAULT.braking(), Vector2::zeros());
        let stop = StopPath::of_vehicle(&braking, none, none, none);
        let motion = FenceMotion { here_m: Vector2::zeros(), speed_m_s: 0.0, stops: [stop; 2] };
        let mut watch = FenceWatch::default();
        for _ in 0..80 {
            watch.look(&items, &chart, &motion);
        }
    }
}

/// Each refusal has its own result, and its text names the item and the fault.
#[test]
fn a_fence_that_is_none_is_refused_by_name() {
    use MissionResult as Is;
    let bow_tie = polygon(5001, &[[-9.0, -9.0], [9.0, 9.0], [9.0, -9.0], [-9.0, 9.0]]);
    let mut missing = square(5001, [0.0, 0.0], 20.0);
    missing.pop();
    let mut mixed = square(5001, [0.0, 0.0], 20.0);
    mixed[2].command = 5002;
    let mut counts = square(5001, [0.0, 0.0], 20.0);
    counts[1].parameters[0] = 3.0;
    let mut groups = [square(5001, [0.0, 0.0], 20.0), square(5001, [0.0, 0.0], 30.0)].concat();
    groups[4..].iter_mut().for_each(|item| item.parameters[1] = 1.0);
    let with = |change: &dyn Fn(&mut MissionItem)| {
        let mut item = item(5003, 30.0, [0.0, 0.0]);
        change(&mut item);
        vec![item]
    };
    let twice = polygon(5001, &[[-9.0, -9.0], [-9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]);
    let cases: &[(Vec<MissionItem>, Is, &str)] = &[
        (bow_tie, Is::INVALID_PARAM1, "fence item 0: edges cross each other"),
        (twice, Is::INVALID_PARAM1, "fence item 0: vertices coincide or are in line"),
        (missing, Is::INVALID_PARAM1, "fence item 2: vertices are missing"),
        (mixed, Is::INVALID_PARAM1, "fence item 2: vertices of two polygons are mixed"),
        (counts, Is::INVALID_PARAM1, "fence item 1: vertices of two polygons are mixed"),
        (groups, MissionResult(7), "fence item 4: only one inclusion group allowed"),
        (polygon(5001, &[[0.0, 0.0], [9.0, 9.0]]), Is::INVALID_PARAM1, "fence item 0: less than three vertices"),
        (vec![item(5001, 3.5, [0.0; 2])], Is::INVALID_PARAM1, "fence item 0: number of vertices is invalid"),
        (square(5001, [100.0, 0.0], 20.0), Is::DENIED, "fence item 0: the vehicle is outside this fence"),
        (square(5002, [0.0, 0.0], 20.0), Is::DENIED, "fence item 0: the vehicle is outside this fence"),
        (with(&|item| item.parameters[0] = -1.0), Is::INVALID_PARAM1, "fence item 0: radius must be 0 to 20000 m"),
        (with(&|item| item.parameters[0] = f32::NAN), Is::INVALID_PARAM1, "fence item 0: radius must be 0 to 20000 m"),
        (with(&|item| item.frame = 1), Is::UNSUPPORTED_FRAME, "fence item 0: frame is not supported"),
        (with(&|item| item.command = 5000), Is::UNSUPPORTED, "fence item 0: return point is not supported"),
        (with(&|item| item.command = 16), Is::UNSUPPORTED, "fence item 0: command 16 unsupported"),
        (with(&|item| item.x = 900_000_001), Is::INVALID_X, "fence item 0: latitude is out of range"),
        (with(&|item| item.y = -1_800_000_001), Is::INVALID_Y, "fence item 0: longitude is out of range"),
        (with(&|item| item.x = 0), Is::INVALID_X, "fence item 0: over 20 km from the origin"),
        // These places are valid, but too far away.
        (with(&|item| item.x = -900_000_000), Is::INVALID_X, "fence item 0: over 20 km from the origin"),
        (with(&|item| item.y = 1_800_000_000), Is::INVALID_X, "fence item 0: over 20 km from the origin"),
    ];
    for (items, result, text) in cases {
        let mut missions = Missions::default();
        let before = numbered(vec![item(5003, 50.0, [0.0, 0.0])]);
        assert_eq!(upload(&mut missions, &before, &around(Some([0.0, 0.0]))).0, Is::ACCEPTED);
        let (answer, said) = upload(&mut missions, &numbered(items.clone()), &around(Some([0.0, 0.0])));
        assert_eq!((answer, said), (*result, Some(Words::of(text))));
        assert_eq!(missions.fence(), before, "{text}");
    }
    let fence = numbered(square(5001, [0.0, 0.0], 20.0));
    let unknown = upload(&mut Missions::default(), &fence, &Surroundings::default());
    assert_eq!(unknown, (Is::ERROR, Some(Words::of("fence item 0: no position yet, try again"))));
    // The fence has more items than there is room for.
    let many = numbered((0..65).map(|_| item(5003, 50.0, [0.0, 0.0])).collect());
    let refused = upload(&mut Missions::default(), &many, &around(None));
    assert_eq!(refused, (Is::NO_SPACE, Some(Words::of("fence refused: room for 64 items"))));
}

/// MAVSDK's example sends a circle of radius 0 at 0, 0 in place of no circle.
#[test]
fn a_circle_without_radius_is_none() {
    let none = MissionItem { command: 5003, frame: 5, ..MissionItem::default() };
    let fence = numbered([square(5001, [0.0, 0.0], 11.0), vec![none]].concat());
    assert_eq!(upload(&mut Missions::default(), &fence, &around(Some([0.0, 0.0]))), (MissionResult::ACCEPTED, None));
    assert!(contains(&fence, &origin().chart(), Vector2::new(5.0, 5.0)));
}

/// The fence tells whether the places, paths and circles of orders are inside.
#[test]
fn places_ways_and_circles_are_inside_or_not() {
    let chart = origin().chart();
    let fence = numbered([square(5001, [0.0, 0.0], 50.0), square(5002, [20.0, 0.0], 5.0)].concat());
    let m = |x: f32, y: f32| Vector2::new(x, y);
    assert!(holds(&fence, &chart, m(0.0, 0.0)) && holds(&fence, &chart, m(48.9, 0.0)));
    assert!(!holds(&fence, &chart, m(49.1, 0.0)) && !holds(&fence, &chart, m(60.0, 0.0)));
    assert!(!holds(&fence, &chart, m(20.0, 0.0)) && !holds(&fence, &chart, m(14.5, 0.0)));
    assert!(
        !is_clear(&fence, &chart, m(0.0, 0.0), m(40.0, 0.0)) && is_clear(&fence, &chart, m(0.0, 0.0), m(40.0, 20.0))
    );
    // Paths along the boundary and in from outside are allowed.
    assert!(
        is_clear(&fence, &chart, m(49.5, -40.0), m(49.5, 40.0)) && is_clear(&fence, &chart, m(60.0, 0.0), m(40.0, 0.0))
    );
    assert!(holds_circle(&fence, &chart, m(0.0, 0.0), 10.0), "beside the exclusion");
    assert!(!holds_circle(&fence, &chart, m(0.0, 0.0), 20.0), "through it");
    assert!(holds_circle(&fence, &chart, m(20.0, 0.0), 20.0), "around it");
    assert!(!holds_circle(&fence, &chart, m(20.0, 0.0), 29.5) && !holds_circle(&fence, &chart, m(200.0, 0.0), 10.0));
    let round = numbered(vec![item(5003, 50.0, [0.0, 0.0]), item(5004, 5.0, [20.0, 0.0])]);
    assert!(holds_circle(&round, &chart, m(20.0, 0.0), 20.0) && !holds_circle(&round, &chart, m(0.0, 0.0), 20.0));
    assert!(!holds_circle(&round, &chart, m(20.0, 0.0), 29.5) && !holds(&round, &chart, m(20.0, 0.0)));
}
