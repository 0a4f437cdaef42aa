//! Tests the mission protocol message by message.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test that cannot go on should say why"
)]

extern crate std;
mod jumps;

use super::upload::{PATIENCE_US, TRIES};
use super::*;
use crate::services::origin::Global;
use afbc_guidance::Item;
use std::vec::Vec as List;

const A: Address = Address { system: 255, component: 190 };
const B: Address = Address { system: 245, component: 190 };
const PLAN: MissionType = MissionType::MISSION;
const NOWHERE: Surroundings = Surroundings { origin: None, here_m: None, home_m: None, cylinder_m: [0.0; 2] };

fn waypoint(number: u16) -> MissionItem {
    MissionItem {
        number,
        command: 16,
        frame: 6,
        goes_on: true,
        parameters: [0.0, 0.0, 0.0, f32::NAN],
        x: 473_977_420 + i32::from(number),
        y: 85_455_940,
        z: 10.0,
        is_current: false,
    }
}

fn said(missions: &mut Missions) -> List<(MissionMessage, Address)> {
    core::iter::from_fn(|| missions.next_message()).collect()
}

/// Uploads items without loss. Returns the last messages.
fn upload(missions: &mut Missions, items: &[MissionItem]) -> List<(MissionMessage, Address)> {
    missions.hear(MissionMessage::Count(items.len() as u16, PLAN), A, true, 0, &NOWHERE);
    for item in items {
        assert_eq!(said(missions), [(MissionMessage::Request(item.number, PLAN), A)]);
        missions.hear(MissionMessage::Item(*item, PLAN), A, true, 0, &NOWHERE);
    }
    said(missions)
}

#[test]
fn what_was_uploaded_can_be_downloaded() {
    let mut missions = Missions::default();
    let items: List<_> = (0..ITEMS_MAX as u16).map(waypoint).collect();
    assert_eq!(upload(&mut missions, &items), [(MissionMessage::Ack(MissionResult::ACCEPTED, PLAN), A)]);
    missions.hear(MissionMessage::List(PLAN), B, false, 0, &NOWHERE);
    assert_eq!(said(&mut missions), [(MissionMessage::Count(64, PLAN), B)]);
    for item in &items {
        missions.hear(MissionMessage::Request(item.number, PLAN), B, false, 0, &NOWHERE);
        let reported = said(&mut missions);
        // An omitted heading is NaN, which is not equal to itself, so texts are compared.
        assert_eq!(std::format!("{reported:?}"), std::format!("{:?}", [(MissionMessage::Item(*item, PLAN), B)]));
    }
    missions.hear(MissionMessage::Request(64, PLAN), B, false, 0, &NOWHERE);
    assert_eq!(said(&mut missions), [(MissionMessage::Ack(MissionResult::INVALID_SEQUENCE, PLAN), B)]);
}

/// Rally points are stored in addition to the mission. Invalid ones are refused.
#[test]
fn rally_points_are_kept() {
    let mut missions = Missions::default();
    upload(&mut missions, &[waypoint(0)]);
    let point = |number| MissionItem { command: 5100, frame: 3, parameters: [0.0; 4], ..waypoint(number) };
    let plan = MissionType::RALLY;
    for bad in [waypoint(1), MissionItem { frame: 1, ..point(1) }, MissionItem { x: i32::MAX, ..point(1) }] {
        missions.hear(MissionMessage::Count(2, plan), A, true, 0, &NOWHERE);
        missions.hear(MissionMessage::Item(point(0), plan), A, true, 0, &NOWHERE);
        let heard = missions.hear(MissionMessage::Item(bad, plan), A, true, 0, &NOWHERE);
        assert!(heard.text.is_some_and(|text| std::format!("{text:?}").contains("rally item 1: ")));
        assert!(matches!(
            said(&mut missions).last(),
            Some((MissionMessage::Ack(result, MissionType::RALLY), A)) if result.0 != 0
        ));
    }
    missions.hear(MissionMessage::Count(2, plan), A, true, 0, &NOWHERE);
    missions.hear(MissionMessage::Item(point(0), plan), A, true, 0, &NOWHERE);
    missions.hear(MissionMessage::Item(point(1), plan), A, true, 0, &NOWHERE);
    assert_eq!(said(&mut missions).last(), Some(&(MissionMessage::Ack(MissionResult::ACCEPTED, plan), A)));
    missions.hear(MissionMessage::List(plan), B, false, 0, &NOWHERE);
    missions.hear(MissionMessage::Request(1, plan), B, false, 0, &NOWHERE);
    assert_eq!(said(&mut missions), [(MissionMessage::Count(2, plan), B), (MissionMessage::Item(point(1), plan), B)]);
    assert_eq!(missions.items().len(), 1);
    missions.hear(MissionMessage::Clear(plan), A, true, 0, &NOWHERE);
    assert_eq!((missions.count(plan), missions.items().len()), (0, 1));
}

/// The mission does not change until the last item has arrived.
#[test]
fn a_broken_upload_changes_nothing() {
    let mut missions = Missions::default();
    upload(&mut missions, &[waypoint(0), waypoint(1)]);
    missions.hear(MissionMessage::Count(3, PLAN), A, true, 0, &NOWHERE);
    missions.hear(MissionMessage::Item(waypoint(0), PLAN), A, true, 0, &NOWHERE);
    let bad = MissionItem { command: 205, ..waypoint(1) };
    let heard = missions.hear(MissionMessage::Item(bad, PLAN), A, true, 0, &NOWHERE);
    assert_eq!(heard.text, Some(Words::of("mission item 1: DO_MOUNT_CONTROL unsupported")));
    assert_eq!(said(&mut missions).last(), Some(&(MissionMessage::Ack(MissionResult::UNSUPPORTED, PLAN), A)));
    assert_eq!(missions.items().len(), 2);
    assert_eq!(missions.number, 1);
}

#[test]
fn lost_messages_are_repeated_and_a_silent_station_is_given_up() {
    let mut missions = Missions::default();
    missions.hear(MissionMessage::Count(2, PLAN), A, true, 0, &NOWHERE);
    said(&mut missions);
    let mut asked = 0;
    for now_us in (0..10 * PATIENCE_US).step_by(1000) {
        let text = missions.tick(now_us);
        for (message, to) in said(&mut missions) {
            assert_eq!(to, A);
            match message {
                MissionMessage::Request(0, PLAN) => asked += 1,
                other => {
                    assert_eq!((other, text.is_some()), (MissionMessage::Ack(MissionResult::CANCELLED, PLAN), true))
                }
            }
        }
    }
    assert_eq!(asked, TRIES - 1);
    assert!(missions.upload.is_none());
    // A further upload works, and its last item may be repeated.
    upload(&mut missions, &[waypoint(0)]);
    missions.hear(MissionMessage::Item(waypoint(0), PLAN), A, true, 0, &NOWHERE);
    assert_eq!(said(&mut missions), [(MissionMessage::Ack(MissionResult::ACCEPTED, PLAN), A)]);
}

#[test]
fn only_the_station_in_control_changes_it() {
    let mut missions = Missions::default();
    upload(&mut missions, &[waypoint(0)]);
    missions.hear(MissionMessage::Count(1, PLAN), B, false, 0, &NOWHERE);
    missions.hear(MissionMessage::Clear(MissionType::ALL), B, false, 0, &NOWHERE);
    assert_eq!(missions.hear(MissionMessage::SetCurrent(0), B, false, 0, &NOWHERE), Heard::default());
    let denied = |plan| (MissionMessage::Ack(MissionResult::DENIED, plan), B);
    assert_eq!(said(&mut missions), [denied(PLAN), denied(MissionType::ALL)]);
    // Another station cannot add items to the upload.
    missions.hear(MissionMessage::Count(2, PLAN), A, true, 0, &NOWHERE);
    said(&mut missions);
    missions.hear(MissionMessage::Item(waypoint(0), PLAN), B, false, 0, &NOWHERE);
    assert_eq!(said(&mut missions), [(MissionMessage::Ack(MissionResult::INVALID_SEQUENCE, PLAN), B)]);
    assert_eq!(missions.upload.as_ref().map(Upload::wanted), Some(0));
}

#[test]
fn too_many_items_are_refused() {
    let mut missions = Missions::default();
    let heard = missions.hear(MissionMessage::Count(65, PLAN), A, true, 0, &NOWHERE);
    assert_eq!(heard.text, Some(Words::of("mission refused: room for 64 items")));
    assert_eq!(said(&mut missions), [(MissionMessage::Ack(MissionResult::NO_SPACE, PLAN), A)]);
}

#[test]
fn each_invalid_number_is_named() {
    let good = waypoint(0);
    assert_eq!(check(&good), Ok(()));
    let [_, _, _, yaw] = good.parameters;
    let bare = MissionItem { x: 0, y: 0, z: 0.0, ..good };
    let cases = [
        (MissionItem { frame: 10, ..good }, MissionResult::UNSUPPORTED_FRAME),
        (MissionItem { x: 900_000_001, ..good }, MissionResult::INVALID_X),
        (MissionItem { x: i32::MIN, ..good }, MissionResult::INVALID_X),
        (MissionItem { y: -1_800_000_001, ..good }, MissionResult::INVALID_Y),
        (MissionItem { z: f32::NAN, ..good }, MissionResult::INVALID_Z),
        (MissionItem { z: f32::INFINITY, ..good }, MissionResult::INVALID_Z),
        (MissionItem { parameters: [-1.0, 0.0, 0.0, yaw], ..good }, MissionResult::INVALID_PARAM1),
        (MissionItem { parameters: [0.0, f32::INFINITY, 0.0, yaw], ..good }, MissionResult(7)),
        (MissionItem { parameters: [0.0, 0.0, 0.0, 1e9], ..good }, MissionResult(9)),
        (MissionItem { command: 178, parameters: [1.0, 0.0, 0.0, 0.0], ..bare }, MissionResult(7)),
        (MissionItem { command: 178, parameters: [3.0, 5.0, 0.0, 0.0], ..bare }, MissionResult::INVALID_PARAM1),
        (MissionItem { command: 92, ..good }, MissionResult::UNSUPPORTED),
    ];
    for (item, result) in cases {
        assert_eq!(check(&item).map_err(|invalid| invalid.result), Err(result), "{item:?}");
    }
}

#[test]
fn the_guidance_gets_items_in_the_local_frame() {
    let at = EarthOrigin::SIMULATED;
    let origin = EarthOrigin::new(at).expect("possible");
    let mut missions = Missions::default();
    let [latitude, longitude] = Global { altitude_m: 0.0, ..at }.e7();
    let take_off = MissionItem { command: 22, x: 0, y: 0, ..waypoint(0) };
    // The waypoint is 10 m above the altitude of the origin, to the north.
    let north = MissionItem { frame: 0, x: latitude + 1000, y: longitude, z: 498.0, ..waypoint(1) };
    let local = MissionItem { frame: 1, x: 20_000, y: 30_000, z: -4.0, ..waypoint(2) };
    let land = MissionItem { command: 21, x: 0, y: 0, z: 0.0, ..waypoint(3) };
    upload(&mut missions, &[take_off, north, local, land]);
    let leg = |number, origin| missions.leg(number, origin, 2.0).map(|leg| (leg.item, leg.is_last));
    assert_eq!(leg(0, Some(&origin)), Some((Item::TakeOff { height_m: 12.0 }, false)));
    let Some((Item::Waypoint { position_m, yaw_rad, .. }, false)) = leg(1, Some(&origin)) else {
        panic!("no waypoint")
    };
    assert!((position_m - nalgebra::Vector3::new(11.12, 0.0, 10.0)).norm() < 0.02, "{position_m}");
    assert!(yaw_rad.is_nan());
    let Some((Item::Waypoint { position_m, .. }, false)) = leg(2, None) else { panic!("no waypoint") };
    assert!((position_m - nalgebra::Vector3::new(2.0, -3.0, 4.0)).norm() < 1e-5, "{position_m}");
    assert!(matches!(leg(3, None), Some((Item::Land { position_m }, true)) if position_m.x.is_nan()));
    assert_eq!((leg(1, None), leg(4, Some(&origin))), (None, None));
}

/// Values just inside each limit are accepted. Values just outside are refused, and the result names the parameter.
#[test]
fn items_reach_up_to_their_limits() {
    const OK: Option<MissionResult> = None;
    let (x, y, z) = (Some(MissionResult::INVALID_X), Some(MissionResult::INVALID_Y), Some(MissionResult::INVALID_Z));
    let (first, second, fourth) = (Some(MissionResult(6)), Some(MissionResult(7)), Some(MissionResult(9)));
    let good = waypoint(0);
    let with = |first, second, fourth| MissionItem { parameters: [first, second, 0.0, fourth], ..good };
    let (loiter, land, take_off) = (19, 21, 22);
    let bare = MissionItem { x: 0, y: 0, z: 0.0, ..good };
    let speed = |kind, speed| MissionItem { command: 178, frame: 99, parameters: [kind, speed, 0.0, 0.0], ..bare };
    for (item, expected) in [
        (MissionItem { x: 900_000_000, y: -1_800_000_000, z: 1e5, ..good }, OK),
        (MissionItem { x: -900_000_000, y: 1_800_000_000, z: -1e5, ..good }, OK),
        (MissionItem { x: -900_000_001, ..good }, x),
        (MissionItem { y: 1_800_000_001, ..good }, y),
        (MissionItem { z: 100_001.0, ..good }, z),
        (MissionItem { z: -100_001.0, ..good }, z),
        (with(3600.0, 1000.0, 3600.0), OK),
        (with(0.0, 0.0, -3600.0), OK),
        (with(f32::NAN, f32::NAN, f32::NAN), OK),
        (with(3600.5, 0.0, 0.0), first),
        (with(-0.5, 0.0, 0.0), first),
        (with(0.0, 1000.5, 0.0), second),
        (with(0.0, -0.5, 0.0), second),
        (with(0.0, 0.0, 3600.5), fourth),
        (with(0.0, 0.0, -3600.5), fourth),
        // A loiter has no radius in its second parameter, but a time and a heading.
        (MissionItem { command: loiter, ..with(0.0, -7.0, 0.0) }, second),
        (MissionItem { command: loiter, ..with(3601.0, 0.0, 0.0) }, first),
        (MissionItem { command: loiter, ..with(0.0, 0.0, 1e9) }, fourth),
        // A landing is at the vehicle's place or elsewhere. Its height is not used, and its first four parameters must
        // be 0 or omitted.
        (MissionItem { command: land, x: 0, y: 0, z: f32::NAN, ..good }, OK),
        (MissionItem { command: land, x: i32::MAX, y: i32::MAX, z: f32::NAN, ..good }, OK),
        (MissionItem { command: land, ..with(-1.0, -1.0, 1e9) }, first),
        (MissionItem { command: land, ..with(0.0, -1.0, 1e9) }, second),
        (MissionItem { command: land, ..with(0.0, 0.0, 1e9) }, fourth),
        (MissionItem { command: land, z: f32::NAN, ..good }, OK),
        (MissionItem { command: land, z: 2e5, ..good }, z),
        (MissionItem { command: land, x: i32::MAX, ..good }, x),
        (MissionItem { command: land, x: 0, y: i32::MAX, ..good }, y),
        (MissionItem { command: land, x: i32::MAX, y: 0, ..good }, x),
        // A take-off is at the vehicle's place or leads elsewhere.
        (MissionItem { command: take_off, x: i32::MAX, y: i32::MAX, ..good }, OK),
        (MissionItem { command: take_off, x: 0, y: 0, ..good }, OK),
        (MissionItem { command: take_off, x: i32::MAX, ..good }, x),
        (MissionItem { command: take_off, y: i32::MIN, ..good }, y),
        (MissionItem { command: take_off, ..with(15.0, 0.0, 0.0) }, OK),
        (MissionItem { command: take_off, z: f32::NAN, ..good }, z),
        (MissionItem { command: 20, frame: 99, x: i32::MAX, z: f32::NAN, ..bare }, OK),
        (speed(0.0, 1000.0), OK),
        (speed(1.0, 0.5), OK),
        (speed(1.0, -1.0), OK),
        (speed(1.0, -2.0), OK),
        (speed(1.0, -3.0), second),
        (speed(0.0, 0.0), second),
        (speed(0.0, 1000.5), second),
        (speed(0.0, f32::NAN), second),
        (speed(2.0, 5.0), first),
    ] {
        assert_eq!(check(&item).err().map(|invalid| invalid.result), expected, "{item:?}");
    }
    let item = |command: u16, parameters| {
        let placed = [17, 18, 31, 195, 201].contains(&command);
        MissionItem { command, parameters, ..if placed { good } else { bare } }
    };
    let (eighth, nan) = (Some(MissionResult(8)), f32::NAN);
    for (item, expected) in [
        (item(93, [86_400.0, 0.0, 0.0, 0.0]), OK),
        (item(93, [86_401.0, 0.0, 0.0, 0.0]), first),
        (item(93, [-1.0, 12.0, 0.0, 0.0]), first),
        (item(93, [nan; 4]), first),
        (item(115, [90.0, 0.0, -1.0, 1.0]), OK),
        (item(115, [90.0, 0.0, 2.0, 1.0]), eighth),
        (item(115, [90.0, 0.0, 0.0, 0.5]), fourth),
        (item(115, [nan, 0.0, 0.0, 0.0]), first),
        (item(18, [1000.0, 0.0, -1000.0, nan]), OK),
        (item(18, [1.5, 0.0, nan, nan]), OK),
        (item(18, [1001.0, 0.0, 10.0, nan]), first),
        (item(18, [nan, 0.0, 10.0, nan]), first),
        (item(18, [1.0, 0.0, 0.5, nan]), eighth),
        (item(177, [0.0, -1.0, 0.0, 0.0]), OK),
        (item(177, [63.0, 1000.0, 0.0, 0.0]), OK),
        (item(177, [0.5, 1.0, 0.0, 0.0]), first),
        (item(177, [256.0, 1.0, 0.0, 0.0]), first),
        (item(177, [0.0, -2.0, 0.0, 0.0]), second),
        (item(177, [0.0, 1001.0, 0.0, 0.0]), second),
        (item(177, [0.0, nan, 0.0, 0.0]), second),
        (MissionItem { command: 201, parameters: [0.0; 4], ..bare }, OK),
        (item(201, [0.0; 4]), x),
        (item(201, [3.0, 0.0, 0.0, 0.0]), OK),
        (item(201, [1.0, 0.0, 0.0, 0.0]), first),
        (item(178, [1.0, 5.0, 50.0, 0.0]), eighth),
        (item(178, [1.0, 5.0, -2.0, 1.0]), fourth),
        (item(115, [90.0, 20.0, 0.0, 0.0]), second),
        (item(18, [1.0, 0.0, 10.0, 1.0]), fourth),
        (item(93, [5.0, 12.0, -1.0, -1.0]), second),
        (MissionItem { z: nan, ..item(195, [0.0; 4]) }, OK),
        (MissionItem { x: i32::MAX, ..item(195, [0.0; 4]) }, x),
        (MissionItem { z: nan, ..item(17, [0.0; 4]) }, z),
        (MissionItem { z: nan, ..item(31, [0.0; 4]) }, z),
    ] {
        assert_eq!(check(&item).err().map(|invalid| invalid.result), expected, "{item:?}");
    }
    for frame in 0..=u8::MAX {
        let known = [0, 1, 3, 5, 6].contains(&frame);
        for command in [16, 19, 21, 22] {
            let result = check(&MissionItem { frame, command, ..good }).map_err(|invalid| invalid.result);
            assert_eq!(result, if known { Ok(()) } else { Err(MissionResult::UNSUPPORTED_FRAME) }, "{frame}");
        }
    }
    for command in 0..1000 {
        let known = [16, 17, 18, 19, 20, 21, 22, 31, 93, 115, 177, 178, 195, 197, 201].contains(&command);
        let all = [[0.0; 4], [1.0, 1.0, 0.0, 0.0]].into_iter().flat_map(|parameters| {
            [good, bare].map(|item| check(&MissionItem { command, parameters, ..item }).is_ok())
        });
        assert_eq!(all.into_iter().any(|ok| ok), known, "{command}");
    }
}

/// Each command becomes an item of the guidance. Omitted numbers become 0; MAVLink's headings are clockwise.
#[test]
fn each_item_is_one_of_the_guidance() {
    let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
    let place = |x: f32, y: f32| {
        let [x, y] = origin.global(&nalgebra::Vector3::new(x, y, 0.0)).e7();
        MissionItem { x, y, z: 7.0, frame: 3, ..waypoint(0) }
    };
    let there = |item: &MissionItem| to_guidance(item, Some(&origin), 2.0);
    let near = |found: nalgebra::Vector3<f32>, x: f32, y: f32, z: f32| {
        assert!((found - nalgebra::Vector3::new(x, y, z)).norm() < 0.02, "{found}");
    };
    let full = MissionItem { parameters: [12.0, 3.0, 0.0, 90.0], ..place(30.0, -20.0) };
    let Some(Item::Waypoint { position_m, yaw_rad, hold_s, within_m, fly_through }) = there(&full) else {
        panic!("no waypoint")
    };
    near(position_m, 30.0, -20.0, 9.0);
    assert!((yaw_rad + core::f32::consts::FRAC_PI_2).abs() < 1e-6, "{yaw_rad}");
    assert_eq!((hold_s, within_m, fly_through), (12.0, 3.0, false));
    let bare = MissionItem { parameters: [f32::NAN; 4], ..place(30.0, -20.0) };
    let Some(Item::Waypoint { yaw_rad, hold_s, within_m, .. }) = there(&bare) else { panic!("no waypoint") };
    assert!(yaw_rad.is_nan() && hold_s == 0.0 && within_m == 0.0);
    let Some(Item::Waypoint { position_m, yaw_rad, hold_s, within_m, fly_through }) =
        there(&MissionItem { command: 19, ..full })
    else {
        panic!("no stay")
    };
    near(position_m, 30.0, -20.0, 9.0);
    assert!((yaw_rad + core::f32::consts::FRAC_PI_2).abs() < 1e-6, "{yaw_rad}");
    assert_eq!((hold_s, within_m, fly_through), (12.0, 0.0, false));
    let Some(Item::Land { position_m }) = there(&MissionItem { command: 21, ..full }) else { panic!("no landing") };
    near(position_m, 30.0, -20.0, 9.0);
    for (x, y, here) in [(0, 0, true), (0, full.y, false), (full.x, 0, false)] {
        let Some(Item::Land { position_m }) = there(&MissionItem { command: 21, x, y, ..full }) else {
            panic!("no landing")
        };
        assert_eq!(position_m.x.is_nan(), here, "{x} {y}");
    }
    let Some(Item::TakeOffTo { position_m }) = there(&MissionItem { command: 22, ..full }) else {
        panic!("no take-off")
    };
    near(position_m, 30.0, -20.0, 9.0);
    // The take-off is here, at an altitude above sea level. The origin is at 488 m.
    for nowhere in [0, i32::MAX] {
        let above = MissionItem { command: 22, frame: 5, x: nowhere, y: nowhere, z: 500.0, ..full };
        assert_eq!(there(&above), Some(Item::TakeOff { height_m: 12.0 }));
    }
    assert_eq!(there(&MissionItem { command: 20, ..full }), Some(Item::Return));
    let speed = MissionItem { command: 178, parameters: [1.0, 4.5, 0.0, 0.0], ..full };
    assert_eq!(there(&speed), Some(Item::Speed(4.5)));
    // -1 keeps the speed; -2 restores the default.
    let speed = |speed| there(&MissionItem { command: 178, parameters: [1.0, speed, 0.0, 0.0], ..full });
    assert_eq!([-1.0, -2.0].map(speed), [Some(Item::Wait(0.0)), Some(Item::Speed(f32::INFINITY))]);
    let item = |command, parameters| there(&MissionItem { command, parameters, ..place(30.0, -20.0) });
    assert_eq!(item(93, [7.0, -1.0, -1.0, -1.0]), Some(Item::Wait(7.0)));
    assert_eq!(item(177, [3.0, 2.0, 0.0, 0.0]), Some(Item::Jump(3)));
    assert_eq!(
        item(115, [90.0, 20.0, 1.0, 1.0]),
        Some(Item::Yaw { yaw_rad: -core::f32::consts::FRAC_PI_2, relative: true, direction: -1 })
    );
    let Some(Item::Turns { centre_m, radius_m, turns }) = item(18, [2.0, 0.0, 15.0, 1.0]) else { panic!("no turns") };
    near(centre_m, 30.0, -20.0, 9.0);
    assert_eq!((radius_m, turns), (-15.0, 2.0), "to the right");
    let Some(Item::Waypoint { hold_s, yaw_rad, .. }) = item(17, [0.0, 0.0, 20.0, 180.0]) else { panic!("no stay") };
    assert_eq!((hold_s, yaw_rad), (f32::INFINITY, -core::f32::consts::PI));
    let Some(Item::Waypoint { position_m, hold_s, .. }) = item(31, [0.0; 4]) else { panic!("no climb") };
    near(position_m, 30.0, -20.0, 9.0);
    assert_eq!(hold_s, 0.0);
    for (command, kind, to) in [(195, 0.0, true), (197, 0.0, false), (201, 3.0, true), (201, 0.0, false)] {
        let Some(Item::Look { at_m }) = item(command, [kind, 0.0, 0.0, 0.0]) else { panic!("no region") };
        assert_eq!((at_m.xy() - nalgebra::Vector2::new(30.0, -20.0)).norm() < 0.02, to, "{command}");
        assert_eq!(at_m.x.is_nan(), !to);
    }
    assert_eq!(there(&MissionItem { command: 205, ..full }), None);
    assert_eq!(there(&MissionItem { frame: 99, ..full }), None);
    // Without an origin there are no global places. A return and a change of speed need none.
    for (command, known) in [(16, false), (19, false), (21, false), (22, false), (20, true), (178, true)] {
        assert_eq!(to_guidance(&MissionItem { command, ..full }, None, 0.0).is_some(), known, "{command}");
    }
}

/// A mission with places outside the fence is refused, if fence and places are known.
#[test]
fn a_mission_outside_the_fence_is_refused() {
    let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
    let around = Surroundings { origin: Some(origin), ..NOWHERE };
    let [x, y] = origin.at().e7();
    let circle =
        MissionItem { command: 5003, frame: 5, parameters: [30.0, 0.0, 0.0, 0.0], x, y, z: 0.0, ..waypoint(0) };
    for (command, north, outside) in
        [(16, 100, false), (16, 2600, false), (16, 2650, true), (17, 2650, true), (21, 2650, true), (195, 2650, false)]
    {
        let mut missions = Missions::default();
        missions.hear(MissionMessage::Count(1, MissionType::FENCE), A, true, 0, &around);
        missions.hear(MissionMessage::Item(circle, MissionType::FENCE), A, true, 0, &around);
        missions.hear(MissionMessage::Count(1, PLAN), A, true, 0, &around);
        let item = MissionItem { command, x: x + north, y, parameters: [0.0; 4], ..waypoint(0) };
        let heard = missions.hear(MissionMessage::Item(item, PLAN), A, true, 0, &around);
        let text = outside.then(|| Words::of("mission item 0: outside the geofence"));
        assert_eq!((heard.text, missions.items().len()), (text, usize::from(!outside)), "{command} {north}");
    }
}

/// MISSION_STATE: 1 no mission, 2 not started, 3 active, 4 paused, 5 complete.
#[test]
fn the_state_of_a_mission_is_reported() {
    let mut missions = Missions::default();
    let state = |missions: &Missions, item, reached, flies| {
        let MissionCurrent { number, total, state, mode } = missions.current(item, reached, flies);
        (number, total, state, mode)
    };
    assert_eq!(state(&missions, Some(0), None, false), (0, 0, 1, 2));
    assert_eq!(state(&missions, Some(3), Some(2), true), (3, 0, 1, 1));
    upload(&mut missions, &[waypoint(0), waypoint(1), waypoint(2)]);
    assert_eq!(state(&missions, None, None, false), (0, 3, 2, 2));
    assert_eq!(state(&missions, Some(1), Some(0), true), (1, 3, 3, 1));
    assert_eq!(state(&missions, Some(1), Some(0), false), (1, 3, 4, 2));
    assert_eq!(state(&missions, Some(2), Some(2), false), (2, 3, 5, 2));
    assert_eq!(state(&missions, Some(2), Some(2), true), (2, 3, 3, 1));
    // The guidance tells items apart by the number of the upload and the number of the item.
    let leg = missions.leg(1, None, 0.0);
    assert_eq!(leg, None, "its place is not known");
    let local = MissionItem { frame: 1, x: 10_000, y: 20_000, z: -3.0, ..waypoint(0) };
    upload(&mut missions, &[local, MissionItem { number: 1, ..local }]);
    let legs = [0, 1, 2].map(|number| missions.leg(number, None, 0.0).map(|leg| (leg.number, leg.upload, leg.is_last)));
    assert_eq!(legs, [Some((0, 2, false)), Some((1, 2, true)), None]);
}

/// Each message is answered for each type of plan, with and without control.
#[test]
fn every_message_is_answered_by_what_it_is_about() {
    for plan in [0, 1, 2, 3, 99, 255].map(MissionType) {
        let mut missions = Missions::default();
        upload(&mut missions, &[waypoint(0), waypoint(1)]);
        let mut ask = |message, may| {
            let heard = missions.hear(message, A, may, 0, &NOWHERE);
            (said(&mut missions), heard, missions.items().len())
        };
        let ack = |result| std::vec![(MissionMessage::Ack(result, plan), A)];
        let is_mission = plan == MissionType::MISSION;
        let (reported, heard, _) = ask(MissionMessage::List(plan), false);
        assert_eq!(
            (reported, heard),
            (std::vec![(MissionMessage::Count(if is_mission { 2 } else { 0 }, plan), A)], Heard::default())
        );
        let (reported, ..) = ask(MissionMessage::Request(1, plan), false);
        let is_item = matches!(
            reported[..],
            [(MissionMessage::Item(MissionItem { number: 1, .. }, reported), A)] if reported == plan
        );
        assert!(
            is_item == is_mission && (is_mission || reported == ack(MissionResult::INVALID_SEQUENCE)),
            "{reported:?}"
        );
        assert_eq!(
            ask(MissionMessage::PartialList(afbc_mavlink::MissionRange { writes: true, numbers: [0, 1] }, plan), true)
                .0,
            ack(MissionResult::UNSUPPORTED)
        );
        for message in [MissionMessage::Count(1, plan), MissionMessage::Count(0, plan), MissionMessage::Clear(plan)] {
            assert_eq!(ask(message, false), (ack(MissionResult::DENIED), Heard::default(), 2));
        }
        let known = plan.0 <= 2 || plan == MissionType::ALL;
        let (reported, _, left) = ask(MissionMessage::Clear(plan), true);
        assert_eq!(reported, ack(if known { MissionResult::ACCEPTED } else { MissionResult::UNSUPPORTED }));
        assert_eq!(left, if is_mission || plan == MissionType::ALL { 0 } else { 2 });
        let (reported, ..) = ask(MissionMessage::Count(0, plan), true);
        assert_eq!(reported, ack(if plan.0 <= 2 { MissionResult::ACCEPTED } else { MissionResult::UNSUPPORTED }));
        let (reported, ..) = ask(MissionMessage::Count(ITEMS_MAX as u16, plan), true);
        assert_eq!(reported == [(MissionMessage::Request(0, plan), A)], is_mission, "{reported:?}");
    }
}

#[test]
fn an_item_is_chosen_that_there_is() {
    let mut missions = Missions::default();
    upload(&mut missions, &[waypoint(0), waypoint(1)]);
    for (number, may, resume, text) in [
        (0, true, Some(0), None),
        (1, true, Some(1), None),
        (2, true, None, Some(Words::of("no mission item 2"))),
        (1, false, None, None),
    ] {
        assert_eq!(
            missions.hear(MissionMessage::SetCurrent(number), A, may, 0, &NOWHERE),
            Heard { text, resume, fence: false }
        );
    }
}

/// Only the uploading station may abort its upload. Until it does, no other station may upload.
#[test]
fn an_upload_is_its_stations_own() {
    let mut missions = Missions::default();
    missions.hear(MissionMessage::Count(2, PLAN), A, true, 0, &NOWHERE);
    said(&mut missions);
    missions.hear(MissionMessage::Count(1, PLAN), B, true, 0, &NOWHERE);
    assert_eq!(said(&mut missions), [(MissionMessage::Ack(MissionResult::DENIED, PLAN), B)]);
    missions.hear(MissionMessage::Ack(MissionResult::CANCELLED, PLAN), B, true, 0, &NOWHERE);
    assert!(missions.upload.is_some());
    // Items that are early, repeated or of another plan are not accepted.
    for item in [waypoint(1), waypoint(5)] {
        missions.hear(MissionMessage::Item(item, PLAN), A, true, 0, &NOWHERE);
        assert_eq!(said(&mut missions), []);
    }
    missions.hear(MissionMessage::Item(waypoint(0), MissionType::FENCE), A, true, 0, &NOWHERE);
    assert_eq!(said(&mut missions), [(MissionMessage::Ack(MissionResult::INVALID_SEQUENCE, MissionType::FENCE), A)]);
    missions.hear(MissionMessage::Item(waypoint(0), PLAN), A, true, 0, &NOWHERE);
    assert_eq!(said(&mut missions), [(MissionMessage::Request(1, PLAN), A)]);
    missions.hear(MissionMessage::Item(waypoint(0), PLAN), A, true, 0, &NOWHERE);
    assert_eq!(said(&mut missions), []);
    missions.hear(MissionMessage::Ack(MissionResult::CANCELLED, PLAN), A, true, 0, &NOWHERE);
    assert!(missions.upload.is_none());
    // The station may start again, and only the last item may be repeated.
    upload(&mut missions, &[waypoint(0), waypoint(1)]);
    for (item, from, plan, result) in [
        (waypoint(1), A, PLAN, MissionResult::ACCEPTED),
        (waypoint(0), A, PLAN, MissionResult::INVALID_SEQUENCE),
        (waypoint(1), B, PLAN, MissionResult::INVALID_SEQUENCE),
        (waypoint(1), A, MissionType::RALLY, MissionResult::INVALID_SEQUENCE),
    ] {
        missions.hear(MissionMessage::Item(item, plan), from, true, 0, &NOWHERE);
        assert_eq!(said(&mut missions), [(MissionMessage::Ack(result, plan), from)]);
    }
}

/// The text names an unused parameter by its number.
#[test]
fn what_is_not_used_is_named() {
    let mut missions = Missions::default();
    let cases =
        [([0.0, 0.0, 5.0, 0.0], "parameter 3 must be 0", 8), ([0.0, 0.0, 0.0, 4000.0], "heading is out of range", 9)];
    for (parameters, reason, result) in cases {
        missions.hear(MissionMessage::Count(1, PLAN), A, true, 0, &NOWHERE);
        let heard =
            missions.hear(MissionMessage::Item(MissionItem { parameters, ..waypoint(0) }, PLAN), A, true, 0, &NOWHERE);
        assert_eq!(heard.text, Some(Words::of("mission item 0: ").and(reason)));
        assert_eq!(said(&mut missions).last(), Some(&(MissionMessage::Ack(MissionResult(result), PLAN), A)));
    }
}

/// If a tick brings more messages than can be answered, the unanswered ones are not carried out.
#[test]
fn nothing_is_cleared_without_an_answer() {
    let mut missions = Missions::default();
    (0..OUT_MAX).for_each(|_| drop(missions.hear(MissionMessage::List(PLAN), A, true, 0, &NOWHERE)));
    for message in [MissionMessage::Clear(PLAN), MissionMessage::Count(0, PLAN)] {
        assert_eq!(missions.hear(message, A, true, 0, &NOWHERE), Heard::default());
    }
    assert_eq!((missions.number, said(&mut missions).len()), (0, OUT_MAX));
}
