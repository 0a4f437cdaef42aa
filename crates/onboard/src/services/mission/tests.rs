//! The mission protocol, message by message.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test that cannot go on should say why"
)]

extern crate std;
use super::upload::{PATIENCE_US, TRIES};
use super::*;
use crate::services::origin::Global;
use afbc_guidance::Item;
use std::vec::Vec as List;

const A: Address = Address { system: 255, component: 190 };
const B: Address = Address { system: 245, component: 190 };
const PLAN: Plan = Plan::MISSION;

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

fn said(missions: &mut Missions) -> List<(Mission, Address)> {
    core::iter::from_fn(|| missions.next_message()).collect()
}

/// Uploads items without a loss; returns what was said last.
fn upload(missions: &mut Missions, items: &[MissionItem]) -> List<(Mission, Address)> {
    missions.hear(Mission::Count(items.len() as u16, PLAN), A, true, 0);
    for item in items {
        assert_eq!(said(missions), [(Mission::Request(item.number, PLAN), A)]);
        missions.hear(Mission::Item(*item, PLAN), A, true, 0);
    }
    said(missions)
}

#[test]
fn what_was_uploaded_can_be_downloaded() {
    let mut missions = Missions::default();
    let items: List<_> = (0..ITEMS_MAX as u16).map(waypoint).collect();
    assert_eq!(upload(&mut missions, &items), [(Mission::Ack(MissionResult::ACCEPTED, PLAN), A)]);
    missions.hear(Mission::List(PLAN), B, false, 0);
    assert_eq!(said(&mut missions), [(Mission::Count(64, PLAN), B)]);
    for item in &items {
        missions.hear(Mission::Request(item.number, PLAN), B, false, 0);
        let told = said(&mut missions);
        // A heading that is not given is NaN, which differs from itself.
        assert_eq!(std::format!("{told:?}"), std::format!("{:?}", [(Mission::Item(*item, PLAN), B)]));
    }
    missions.hear(Mission::Request(64, PLAN), B, false, 0);
    assert_eq!(said(&mut missions), [(Mission::Ack(MissionResult::INVALID_SEQUENCE, PLAN), B)]);
}

#[test]
fn fences_and_rally_points_are_empty() {
    let mut missions = Missions::default();
    for plan in [Plan::FENCE, Plan::RALLY] {
        missions.hear(Mission::List(plan), A, false, 0);
        missions.hear(Mission::Count(0, plan), A, true, 0);
        missions.hear(Mission::Count(1, plan), A, true, 0);
        missions.hear(Mission::Clear(plan), A, true, 0);
        let [accepted, unsupported] =
            [MissionResult::ACCEPTED, MissionResult::UNSUPPORTED].map(|it| (Mission::Ack(it, plan), A));
        assert_eq!(said(&mut missions), [(Mission::Count(0, plan), A), accepted, unsupported, accepted]);
    }
}

/// The mission stays as it was until the last item is there.
#[test]
fn a_broken_upload_changes_nothing() {
    let mut missions = Missions::default();
    upload(&mut missions, &[waypoint(0), waypoint(1)]);
    missions.hear(Mission::Count(3, PLAN), A, true, 0);
    missions.hear(Mission::Item(waypoint(0), PLAN), A, true, 0);
    let bad = MissionItem { command: 205, ..waypoint(1) };
    let heard = missions.hear(Mission::Item(bad, PLAN), A, true, 0);
    assert_eq!(heard.text, Some(Words::of("mission item 1: command is not supported")));
    assert_eq!(said(&mut missions).last(), Some(&(Mission::Ack(MissionResult::UNSUPPORTED, PLAN), A)));
    assert_eq!(missions.items().len(), 2);
    assert_eq!(missions.number, 1);
}

#[test]
fn lost_messages_are_repeated_and_a_silent_station_is_given_up() {
    let mut missions = Missions::default();
    missions.hear(Mission::Count(2, PLAN), A, true, 0);
    said(&mut missions);
    let mut asked = 0;
    for now_us in (0..10 * PATIENCE_US).step_by(1000) {
        let text = missions.tick(now_us);
        for (message, to) in said(&mut missions) {
            assert_eq!(to, A);
            match message {
                Mission::Request(0, PLAN) => asked += 1,
                other => assert_eq!((other, text.is_some()), (Mission::Ack(MissionResult::CANCELLED, PLAN), true)),
            }
        }
    }
    assert_eq!(asked, TRIES - 1);
    assert!(missions.upload.is_none());
    // Another one works, and its last item may come twice.
    upload(&mut missions, &[waypoint(0)]);
    missions.hear(Mission::Item(waypoint(0), PLAN), A, true, 0);
    assert_eq!(said(&mut missions), [(Mission::Ack(MissionResult::ACCEPTED, PLAN), A)]);
}

#[test]
fn only_the_station_in_control_changes_it() {
    let mut missions = Missions::default();
    upload(&mut missions, &[waypoint(0)]);
    missions.hear(Mission::Count(1, PLAN), B, false, 0);
    missions.hear(Mission::Clear(Plan::ALL), B, false, 0);
    assert_eq!(missions.hear(Mission::SetCurrent(0), B, false, 0), Heard::default());
    let denied = |plan| (Mission::Ack(MissionResult::DENIED, plan), B);
    assert_eq!(said(&mut missions), [denied(PLAN), denied(Plan::ALL)]);
    // Nor does another one put items into its upload.
    missions.hear(Mission::Count(2, PLAN), A, true, 0);
    said(&mut missions);
    missions.hear(Mission::Item(waypoint(0), PLAN), B, false, 0);
    assert_eq!(said(&mut missions), [(Mission::Ack(MissionResult::INVALID_SEQUENCE, PLAN), B)]);
    assert_eq!(missions.upload.as_ref().map(Upload::wanted), Some(0));
}

#[test]
fn too_many_items_are_refused() {
    let mut missions = Missions::default();
    let heard = missions.hear(Mission::Count(65, PLAN), A, true, 0);
    assert_eq!(heard.text, Some(Words::of("mission refused: more than 64 items")));
    assert_eq!(said(&mut missions), [(Mission::Ack(MissionResult::NO_SPACE, PLAN), A)]);
}

#[test]
fn each_invalid_number_is_named() {
    let good = waypoint(0);
    assert_eq!(check(&good), Ok(()));
    let [_, _, _, yaw] = good.parameters;
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
        (MissionItem { command: 178, parameters: [1.0, 0.0, 0.0, 0.0], ..good }, MissionResult(7)),
        (MissionItem { command: 178, parameters: [3.0, 5.0, 0.0, 0.0], ..good }, MissionResult::INVALID_PARAM1),
        (MissionItem { command: 93, ..good }, MissionResult::UNSUPPORTED),
    ];
    for (item, result) in cases {
        assert_eq!(check(&item).map_err(|invalid| invalid.result), Err(result), "{item:?}");
    }
}

#[test]
fn the_guidance_gets_items_in_the_local_frame() {
    let at = Origin::SIMULATED;
    let origin = Origin::new(at).expect("possible");
    let mut missions = Missions::default();
    let [latitude, longitude] = Global { altitude_m: 0.0, ..at }.e7();
    let take_off = MissionItem { command: 22, ..waypoint(0) };
    // 10 m above the sea's level of the origin, to the north.
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
