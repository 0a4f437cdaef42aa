//! Missions after their upload: cleared, replaced, ended early, or impossible to fly.

use crate::commands::{Current as _, bench, item, leads_to, orders, origin, refused, step, upload};
use crate::common::Bench;
use crate::fence::{Vehicle, way};
use afbc_flight_core::Mode;
use afbc_guidance::{FlightMode, Item, Order, OrderRefusal};
use afbc_mavlink::{
    CommandResult, Datum, Downlink, GlobalPosition, Height, MissionItem, MissionMessage, MissionResult, MissionType,
    Uplink, VehicleCommand,
};

/// Returns the mission item that the guidance was given last.
fn leg(bench: &mut Bench) -> Option<afbc_guidance::RequestedItem> {
    (0..3).for_each(|_| drop(step(bench)));
    let inputs = bench.receive(&[]);
    bench.inputs.merge(&inputs);
    step(bench);
    bench.taken.orders.leg
}

/// If a station clears the mission, the guidance is told so. If it uploads another one, even a shorter one, the
/// guidance gets the first item of that.
#[test]
fn a_mission_that_is_cleared_is_withdrawn() {
    for clear in [
        MissionMessage::Clear(MissionType::MISSION),
        MissionMessage::Clear(MissionType::ALL),
        MissionMessage::Count(0, MissionType::MISSION),
    ] {
        let mut bench = bench(true);
        bench.hear(Uplink::Mission(clear));
        assert_eq!(leg(&mut bench), None, "there was none");
        assert_eq!(upload(&mut bench, &[item(0, 16), item(1, 16), item(2, 16)]), Some(MissionResult::ACCEPTED));
        leads_to(&mut bench, VehicleCommand::SetCurrent(Some(2), false), &[Order::Resume(2)]);
        let handed = leg(&mut bench).expect("handed over");
        assert_eq!((handed.number, handed.is_last), (2, true));
        assert_eq!(upload(&mut bench, &[item(0, 16)]), Some(MissionResult::ACCEPTED));
        let handed = leg(&mut bench).expect("handed over");
        assert_eq!((handed.number, handed.is_last), (0, true));
        bench.hear(Uplink::Mission(clear));
        let handed = leg(&mut bench).expect("withdrawn");
        assert_eq!((handed.item, bench.comms.has_mail()), (Item::None, false));
        assert_eq!(bench.comms_current().total, 0);
        assert_eq!(upload(&mut bench, &[item(0, 16), item(1, 16)]), Some(MissionResult::ACCEPTED));
        assert_eq!(leg(&mut bench).map(|leg| (leg.number, leg.is_last)), Some((0, false)));
    }
}

/// The last item in MISSION_START ends the mission, until the mission is started without one or is replaced.
#[test]
fn a_mission_ends_with_the_item_that_is_to_be_the_last() {
    let mut bench = bench(true);
    let items = [item(0, 16), item(1, 16), item(2, 16)];
    assert_eq!(upload(&mut bench, &items), Some(MissionResult::ACCEPTED));
    let ends = |bench: &mut Bench, last, at| {
        let _ = orders(bench, VehicleCommand::StartMission(0, last));
        let _ = orders(bench, VehicleCommand::SetCurrent(Some(at), false));
        leg(bench).map(|leg| (leg.number, leg.is_last))
    };
    assert_eq!(ends(&mut bench, Some(1), 1), Some((1, true)));
    assert_eq!(ends(&mut bench, None, 1), Some((1, false)));
    assert_eq!(ends(&mut bench, Some(1), 1), Some((1, true)));
    assert_eq!(ends(&mut bench, Some(1), 0), Some((0, false)));
    assert_eq!(upload(&mut bench, &items), Some(MissionResult::ACCEPTED));
    let _ = orders(&mut bench, VehicleCommand::SetCurrent(Some(1), false));
    assert_eq!(leg(&mut bench).map(|leg| (leg.number, leg.is_last)), Some((1, false)));
}

/// Items that the guidance would refuse in flight are refused at upload: places far away, on the far half of the earth
/// or outside the cylinder around home. The same holds for places in commands and rally points.
#[test]
fn what_cannot_be_flown_is_refused_at_upload() {
    let mut bench = bench(true);
    let [latitude, longitude] = origin().at().e7();
    let opposite = longitude - 1_800_000_000;
    let far = [[0, 0], [latitude + 27_000_000, longitude], [-latitude, opposite], [-latitude + 1_000, opposite - 999]];
    for [x, y] in far {
        for command in [16, 17, 18, 19, 21, 22, 31, 195] {
            let parameters = if command == 18 { [1.0, 0.0, 10.0, f32::NAN] } else { [0.0, 0.0, 0.0, 0.0] };
            let there = MissionItem { x, y, parameters, ..item(1, command) };
            if [x, y] == [0, 0] && [21, 22].contains(&command) {
                // 0, 0 means the vehicle's place.
                continue;
            }
            let result = upload(&mut bench, &[item(0, 16), there]);
            assert_eq!(result, Some(MissionResult::INVALID_X), "{command} at {x} {y}");
        }
        let height = Height { metres: 500.0, above: Datum::Sea };
        let place = GlobalPosition { latitude_e7: x, longitude_e7: y, height };
        let go = VehicleCommand::Reposition { place, yaw_rad: f32::NAN, speed_m_s: None, changes_mode: true };
        let (given, _) = orders(&mut bench, go);
        let Some(Order::GoTo { position_m, .. }) = given.first() else { panic!("{given:?}") };
        assert!(!afbc_guidance::is_place(position_m), "{position_m}");
        bench.hear(Uplink::Mission(MissionMessage::Count(1, MissionType::RALLY)));
        let point = MissionItem { x, y, frame: 3, parameters: [0.0; 4], ..item(0, 5100) };
        bench.hear(Uplink::Mission(MissionMessage::Item(point, MissionType::RALLY)));
        let said: Vec<_> = (0..5).flat_map(|_| step(&mut bench)).collect();
        let refused = |it: &Downlink| {
            matches!(
                it,
                Downlink::Mission { message: MissionMessage::Ack(MissionResult::INVALID_X, MissionType::RALLY), .. }
            )
        };
        assert!(said.iter().any(refused), "{said:?}");
    }
    // The parameters set the cylinder around home. The item is 21 m from home and 5 m above it.
    let set = |bench: &mut Bench, name: &str, value: f32| {
        let mut padded = [0; 16];
        padded.iter_mut().zip(name.bytes()).for_each(|(to, from)| *to = from);
        let request = afbc_mavlink::ParameterRequest::Set { name: padded, value: value.to_le_bytes(), kind: 9 };
        bench.hear(Uplink::Parameter(request));
        (0..3).for_each(|_| drop(step(bench)));
    };
    for (name, value, result) in [
        ("GF_MAX_HOR_DIST", 20.0, MissionResult::DENIED),
        ("GF_MAX_HOR_DIST", 22.0, MissionResult::ACCEPTED),
        ("GF_MAX_VER_DIST", 4.0, MissionResult::DENIED),
        ("GF_MAX_VER_DIST", 6.0, MissionResult::ACCEPTED),
    ] {
        set(&mut bench, name, value);
        assert_eq!(upload(&mut bench, &[item(0, 16)]), Some(result), "{name} {value}");
    }
    // A mission that has become impossible is refused at its start.
    leads_to(&mut bench, VehicleCommand::StartMission(0, None), &[Order::Select(FlightMode::Mission)]);
    set(&mut bench, "GF_MAX_HOR_DIST", 20.0);
    for command in [VehicleCommand::StartMission(0, None), VehicleCommand::SelectStandardMode(6)] {
        refused(&mut bench, command, CommandResult::Refused(OrderRefusal::OutOfRange as i32));
    }
}

/// A new fence or new rally points change neither the mission nor the guidance's copy of it.
#[test]
fn other_plans_leave_the_mission_alone() {
    let mut vehicle = Vehicle::new();
    let place = [20.0, -20.0];
    assert_eq!(vehicle.upload(MissionType::MISSION, &[way(16, place), way(16, place)]), MissionResult::ACCEPTED);
    let upload = vehicle.leg(1).upload;
    let disc = MissionItem { frame: 5, z: 0.0, parameters: [5.0, 0.0, 0.0, 0.0], ..way(5004, [40.0, 0.0]) };
    let rally = MissionItem { frame: 3, parameters: [0.0; 4], ..way(5100, place) };
    for (plan, item) in [(MissionType::FENCE, disc), (MissionType::RALLY, rally)] {
        assert_eq!(vehicle.upload(plan, &[item]), MissionResult::ACCEPTED);
        assert_eq!([vehicle.leg(0), vehicle.leg(1)].map(|leg| leg.upload), [upload; 2], "{plan:?}");
    }
}

/// Repetitions of a jump are counted per flight: disarming resets them.
#[test]
fn jumps_begin_anew_with_each_flight() {
    let mut vehicle = Vehicle::new();
    let jump = MissionItem { command: 177, parameters: [0.0, 1.0, 0.0, 0.0], x: 0, y: 0, z: 0.0, ..item(1, 177) };
    let items = [way(16, [20.0, -20.0]), jump, way(16, [30.0, -20.0])];
    assert_eq!(vehicle.upload(MissionType::MISSION, &items), MissionResult::ACCEPTED);
    // Returns the target of the jump, and then makes the jump.
    let jump = |vehicle: &mut Vehicle| {
        vehicle.leg(2);
        let leg = vehicle.leg(1);
        vehicle.report.guided.reached = Some(1);
        vehicle.pass(1);
        vehicle.report.guided.reached = None;
        leg.item
    };
    for _ in 0..2 {
        vehicle.report.mode = Mode::Flying;
        assert_eq!([(); 3].map(|()| jump(&mut vehicle)), [0, 2, 0].map(Item::Jump));
        vehicle.report.mode = Mode::Disarmed;
        vehicle.pass(1);
    }
}
