//! Orders and answers that follow from each command, target and mission.

use crate::common::{Bench, STATION};
use afbc_comms::services::modes;
use afbc_comms::services::origin::{EarthOrigin, Global};
use afbc_comms::services::streams::id;
use afbc_comms::{AuxSensors, BUSY, Comms, NO_ORIGIN, NOT_IN_CONTROL, NOT_KNOWN, Setup};
use afbc_flight_core::Refusal;
use afbc_guidance::{FlightMode, Order, OrderRefusal};
use afbc_mavlink::telemetry::BatteryStatus;
use afbc_mavlink::{
    Address, AttitudeAndThrust, CommandResult, Datum, Downlink, ExternalTarget, GlobalPosition, Height, ManualControl,
    MissionItem, MissionMessage, MissionResult, MissionType, PositionTarget, Reboot, Storage, TargetFrame, Telemetry,
    Uplink, VehicleCommand,
};
use afbc_onboard::Report;
use afbc_onboard::parameters::RecordChange;
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;

const OTHER: Address = Address { system: 245, component: 190 };
const VEHICLE: Address = Address { system: 1, component: 1 };
const HOME: [f32; 3] = [1.0, 2.0, 0.5];
const HERE: [f32; 3] = [10.0, -5.0, 3.0];

fn at(place: [f32; 3]) -> State {
    State { position_m: place.into(), ..State::default() }
}

pub(crate) fn origin() -> EarthOrigin {
    EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible")
}

/// Returns a vehicle that knows its position and, if `located`, its origin on the earth. Its home is elsewhere.
pub(crate) fn bench(located: bool) -> Bench {
    let mut bench = Bench::new();
    bench.comms = Comms::with(Setup { bytes_per_s: 1_000_000, ..Setup::default() });
    let origin = located.then(origin);
    bench.comms.set_aux_sensors(AuxSensors { origin, ..AuxSensors::default() });
    for tick in 0..1200 {
        bench.measure(&at(if tick < 1100 { HOME } else { HERE }));
        bench.step();
    }
    bench
}

/// Runs a tick with the vehicle at `HERE`. Returns the messages.
pub(crate) fn step(bench: &mut Bench) -> Vec<Downlink> {
    bench.measure(&at(HERE));
    bench.step().1
}

/// Returns the orders that follow from a command, and the answer if it does not come from the guidance.
pub(crate) fn orders(bench: &mut Bench, command: VehicleCommand) -> (Vec<Order>, Option<CommandResult>) {
    // Earlier commands are completed first.
    (0..5).for_each(|_| drop(step(bench)));
    bench.hear(Uplink::Command(command));
    let orders = bench.inputs.orders.given.iter().map(|given| given.value).collect::<Vec<_>>();
    let said = step(bench);
    let answer = said.iter().find_map(|message| match message {
        Downlink::CommandAck { answer, to: STATION, .. } => Some(*answer),
        _ => None,
    });
    (orders, answer.filter(|_| bench.inputs.orders.given.is_empty()))
}

pub(crate) fn leads_to(bench: &mut Bench, command: VehicleCommand, expected: &[Order]) {
    let (found, _) = orders(bench, command);
    // Texts are compared since NaN is not equal to itself. Places are rounded to 2 cm, since degrees on the wire are
    // inexact.
    let rounded = |orders: &[Order]| {
        let orders: Vec<_> = orders
            .iter()
            .map(|order| {
                let to_cm = |place: Vector3<f32>| place.map(|x| (x * 50.0).round() / 50.0 + 0.0);
                match *order {
                    Order::GoTo { position_m, yaw_rad, speed_m_s } => {
                        Order::GoTo { position_m: to_cm(position_m), yaw_rad, speed_m_s }
                    }
                    Order::Home(Some(place)) => Order::Home(Some(to_cm(place))),
                    Order::TakeOff(Some(height)) => Order::TakeOff(Some((height * 50.0).round() / 50.0)),
                    order => order,
                }
            })
            .collect();
        format!("{orders:?}")
    };
    assert_eq!(rounded(&found), rounded(expected), "{command:?}");
}

pub(crate) fn refused(bench: &mut Bench, command: VehicleCommand, expected: CommandResult) {
    assert_eq!(orders(bench, command), (vec![], Some(expected)), "{command:?}");
}

fn place(local: [f32; 3], above: Datum, metres: f32) -> GlobalPosition {
    let [latitude_e7, longitude_e7] = origin().global(&local.into()).e7();
    GlobalPosition { latitude_e7, longitude_e7, height: Height { metres, above } }
}

fn height(metres: f32, above: Datum) -> GlobalPosition {
    GlobalPosition {
        latitude_e7: GlobalPosition::AS_IT_IS,
        longitude_e7: GlobalPosition::AS_IT_IS,
        height: Height { metres, above },
    }
}

#[test]
fn each_command_is_its_order() {
    let mut bench = bench(true);
    for (metres, above, height) in [
        (f32::NAN, Datum::Here, None),
        (2.5, Datum::Here, Some(2.5)),
        (4.0, Datum::Home, Some(4.0 + HOME[2] - HERE[2])),
        (500.0, Datum::Sea, Some(500.0 - 488.0 - HERE[2])),
    ] {
        leads_to(&mut bench, VehicleCommand::TakeOff(Height { metres, above }), &[Order::TakeOff(height)]);
    }
    leads_to(&mut bench, VehicleCommand::Land, &[Order::Select(FlightMode::Land)]);
    leads_to(&mut bench, VehicleCommand::Return, &[Order::Select(FlightMode::Return)]);
    for mode in FlightMode::ALL {
        leads_to(&mut bench, VehicleCommand::SelectMode(modes::custom(mode)), &[Order::Select(mode)]);
        match modes::standard(mode) {
            0 => refused(&mut bench, VehicleCommand::SelectStandardMode(0), CommandResult::Denied),
            number => leads_to(&mut bench, VehicleCommand::SelectStandardMode(number), &[Order::Select(mode)]),
        }
    }
    refused(&mut bench, VehicleCommand::SelectMode(0x0909_0000), CommandResult::Denied);
    refused(&mut bench, VehicleCommand::SelectStandardMode(99), CommandResult::Denied);
    leads_to(&mut bench, VehicleCommand::Speed(3.5), &[Order::Speed(3.5)]);
    leads_to(&mut bench, VehicleCommand::Home(None), &[Order::Home(None)]);
    let there = place([40.0, -30.0, 0.0], Datum::Sea, 495.0);
    leads_to(&mut bench, VehicleCommand::Home(Some(there)), &[Order::Home(Some(Vector3::new(40.0, -30.0, 7.0)))]);
    // From here on home is the ordered place, 7 m high.
    for (above, metres, z) in [(Datum::Sea, 500.0, 12.0), (Datum::Home, 5.0, 12.0)] {
        let go = VehicleCommand::Reposition {
            place: place([40.0, -30.0, 0.0], above, metres),
            yaw_rad: 0.5,
            speed_m_s: Some(2.0),
            changes_mode: true,
        };
        let position_m = Vector3::new(40.0, -30.0, z);
        leads_to(&mut bench, go, &[Order::GoTo { position_m, yaw_rad: 0.5, speed_m_s: Some(2.0) }]);
    }
}

/// Without an origin on the earth, only heights relative to home or the vehicle can be resolved.
#[test]
fn without_an_origin_there_are_heights_only() {
    let mut bench = bench(false);
    let go = |place| VehicleCommand::Reposition { place, yaw_rad: f32::NAN, speed_m_s: None, changes_mode: true };
    let unknown = CommandResult::Refused(NO_ORIGIN);
    for above in [Datum::Sea, Datum::Home] {
        refused(&mut bench, go(place([4.0, 3.0, 0.0], above, 5.0)), unknown);
    }
    refused(&mut bench, go(height(500.0, Datum::Sea)), unknown);
    refused(&mut bench, VehicleCommand::TakeOff(Height { metres: 500.0, above: Datum::Sea }), unknown);
    refused(&mut bench, VehicleCommand::Home(Some(place([4.0, 3.0, 0.0], Datum::Sea, 500.0))), unknown);
    let position_m = Vector3::new(f32::NAN, f32::NAN, 5.0 + HOME[2]);
    let order = Order::GoTo { position_m, yaw_rad: f32::NAN, speed_m_s: None };
    leads_to(&mut bench, go(height(5.0, Datum::Home)), &[order]);
    leads_to(
        &mut bench,
        VehicleCommand::TakeOff(Height { metres: 4.0, above: Datum::Here }),
        &[Order::TakeOff(Some(4.0))],
    );
    let order = Order::TakeOff(Some(4.0 + HOME[2] - HERE[2]));
    leads_to(&mut bench, VehicleCommand::TakeOff(Height { metres: 4.0, above: Datum::Home }), &[order]);
}

pub(crate) fn item(number: u16, command: u16) -> MissionItem {
    let place = place([20.0, 10.0, 0.0], Datum::Home, 5.0);
    let (x, y) = (place.latitude_e7, place.longitude_e7);
    let parameters = [0.0, 0.0, 0.0, f32::NAN];
    MissionItem { number, command, frame: 6, is_current: false, goes_on: true, parameters, x, y, z: 5.0 }
}

/// Uploads these items. Returns the last acknowledgement.
pub(crate) fn upload(bench: &mut Bench, items: &[MissionItem]) -> Option<MissionResult> {
    bench.hear(Uplink::Mission(MissionMessage::Count(items.len() as u16, MissionType::MISSION)));
    let mut result = None;
    for _ in 0..10 * (items.len() + 1) {
        for message in step(bench) {
            match message {
                Downlink::Mission { message: MissionMessage::Request(number, _), to: STATION } => {
                    bench.hear(Uplink::Mission(MissionMessage::Item(items[usize::from(number)], MissionType::MISSION)));
                }
                Downlink::Mission { message: MissionMessage::Ack(reported, _), to: STATION } => result = Some(reported),
                _ => (),
            }
        }
    }
    result
}

#[test]
fn missions_begin_and_go_on_at_items_that_there_are() {
    let mut bench = bench(true);
    let none = CommandResult::Refused(OrderRefusal::NoMission as i32);
    refused(&mut bench, VehicleCommand::StartMission(0, None), none);
    for (number, resets) in [(Some(0), false), (None, false), (None, true)] {
        refused(&mut bench, VehicleCommand::SetCurrent(number, resets), none);
    }
    assert!(!bench.comms.has_mail());
    assert_eq!(upload(&mut bench, &[item(0, 16), item(1, 16)]), Some(MissionResult::ACCEPTED));
    let select = Order::Select(FlightMode::Mission);
    leads_to(&mut bench, VehicleCommand::StartMission(0, None), &[select]);
    leads_to(&mut bench, VehicleCommand::StartMission(1, Some(1)), &[Order::Resume(1), select]);
    leads_to(&mut bench, VehicleCommand::SetCurrent(Some(1), false), &[Order::Resume(1)]);
    leads_to(&mut bench, VehicleCommand::SetCurrent(Some(0), true), &[Order::Resume(0)]);
    // Commands about the present item do not change it, with or without a reset.
    refused(&mut bench, VehicleCommand::SetCurrent(None, false), CommandResult::Accepted);
    refused(&mut bench, VehicleCommand::SetCurrent(None, true), CommandResult::Accepted);
    refused(&mut bench, VehicleCommand::StartMission(2, None), none);
    refused(&mut bench, VehicleCommand::StartMission(0, Some(2)), none);
    refused(&mut bench, VehicleCommand::SetCurrent(Some(2), true), none);
}

/// The guidance gets the item that it asks for once. Then there are no inputs without bytes.
#[test]
fn the_wanted_item_is_handed_over_once() {
    let mut bench = bench(true);
    assert_eq!((bench.comms.has_mail(), bench.inputs.orders.leg), (false, None));
    assert_eq!(upload(&mut bench, &[item(0, 22), item(1, 21)]), Some(MissionResult::ACCEPTED));
    let legs = |bench: &mut Bench| {
        let inputs = bench.receive(&[]);
        bench.inputs.merge(&inputs);
        inputs.orders.leg
    };
    // The item was handed over with the first state after the upload.
    assert_eq!((bench.comms.has_mail(), legs(&mut bench)), (false, None));
    bench.hear(Uplink::Command(VehicleCommand::SetCurrent(Some(1), false)));
    bench.step();
    assert!(bench.comms.has_mail(), "it wants the other one");
    let leg = legs(&mut bench).expect("handed over");
    assert_eq!((leg.number, leg.is_last), (1, true));
    assert_eq!((bench.comms.has_mail(), legs(&mut bench)), (false, None));
    let current = bench.comms_current();
    assert_eq!((current.number, current.total, current.state, current.mode), (1, 2, 4, 2));
}

pub(crate) trait Current {
    fn comms_current(&mut self) -> afbc_mavlink::MissionCurrent;
}

impl Current for Bench {
    /// Requests MISSION_CURRENT.
    fn comms_current(&mut self) -> afbc_mavlink::MissionCurrent {
        self.hear(Uplink::Command(VehicleCommand::RequestMessage { message: id::MISSION_CURRENT, index: 0 }));
        let said = step(self);
        let current = said.iter().find_map(|message| match message {
            Downlink::Mission { message: MissionMessage::Current(current), .. } => Some(*current),
            _ => None,
        });
        current.expect("sent")
    }
}

/// Only the station in control may give orders. Any station may send requests and stop the motors.
#[test]
fn orders_are_for_the_station_in_control() {
    let mut bench = bench(true);
    leads_to(&mut bench, VehicleCommand::Speed(2.0), &[Order::Speed(2.0)]);
    let mut reported = |command| {
        bench.hear_from(OTHER, Uplink::Command(command));
        assert!(bench.inputs.orders.given.is_empty());
        let said = step(&mut bench);
        said.into_iter().find_map(|message| match message {
            Downlink::CommandAck { answer, to: OTHER, .. } => Some(answer),
            _ => None,
        })
    };
    for command in [
        VehicleCommand::Land,
        VehicleCommand::Return,
        VehicleCommand::Speed(1.0),
        VehicleCommand::Home(None),
        VehicleCommand::SelectMode(0x0304_0000),
        VehicleCommand::SelectStandardMode(7),
        VehicleCommand::StartMission(0, None),
        VehicleCommand::SetCurrent(Some(0), false),
        VehicleCommand::Reboot(Reboot::Program),
        VehicleCommand::Reboot(Reboot::BootLoader),
        VehicleCommand::Arm,
        VehicleCommand::Engage,
        VehicleCommand::SelfTest,
        VehicleCommand::Storage(Storage::Reset),
        VehicleCommand::TakeOff(Height { metres: 2.0, above: Datum::Here }),
    ] {
        assert_eq!(reported(command), Some(CommandResult::Refused(NOT_IN_CONTROL)), "{command:?}");
    }
    for command in
        [VehicleCommand::Disarm, VehicleCommand::Kill, VehicleCommand::CheckArming, VehicleCommand::RequestProtocol]
    {
        assert_eq!(reported(command), Some(CommandResult::Accepted), "{command:?}");
    }
    assert_eq!(
        [VehicleCommand::Denied(178), VehicleCommand::Other(9)].map(reported),
        [Some(CommandResult::Denied), Some(CommandResult::Unsupported)]
    );
}

/// The vehicle ignores its own messages if they come back.
#[test]
fn its_own_messages_are_not_heard() {
    let mut bench = bench(true);
    bench.hear_from(VEHICLE, Uplink::Command(VehicleCommand::Other(60_000)));
    let said = step(&mut bench);
    assert!(!said.iter().any(|message| matches!(message, Downlink::CommandAck { .. })), "{said:?}");
}

#[test]
fn messages_on_request_are_sent_or_refused_with_the_reason() {
    let mut bench = bench(true);
    let ask = |bench: &mut Bench, message, index| {
        let (none, answer) = orders(bench, VehicleCommand::RequestMessage { message, index });
        assert_eq!(none, []);
        answer.expect("answered")
    };
    for index in 0..=u32::from(modes::COUNT) {
        assert_eq!(ask(&mut bench, id::AVAILABLE_MODES, index), CommandResult::Accepted);
    }
    assert_eq!(ask(&mut bench, id::AVAILABLE_MODES, u32::from(modes::COUNT) + 1), CommandResult::Denied);
    assert_eq!(ask(&mut bench, 9_999, 0), CommandResult::Unsupported);
    assert_eq!(ask(&mut bench, id::BATTERY_STATUS, 0), CommandResult::Refused(NOT_KNOWN));
    let battery =
        BatteryStatus { voltage_mv: 11_100, current_ca: -1, remaining_percent: -1, consumed_mah: -1, charge: 0 };
    bench.comms.set_aux_sensors(AuxSensors { battery: Some(battery), origin: Some(origin()), ..AuxSensors::default() });
    assert_eq!(ask(&mut bench, id::BATTERY_STATUS, 0), CommandResult::Accepted);
    // A request for all modes is answered by each mode in order.
    (0..20).for_each(|_| drop(step(&mut bench)));
    bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: id::AVAILABLE_MODES, index: 0 }));
    let places: Vec<_> = (0..20)
        .flat_map(|_| step(&mut bench))
        .filter_map(|message| match message {
            Downlink::AvailableMode(mode) => Some(mode.index),
            _ => None,
        })
        .collect();
    assert!(places.iter().copied().eq(1..=modes::COUNT), "{places:?}");
    // Two messages have request commands of their own.
    for (command, is_it) in [
        (VehicleCommand::RequestProtocol, (|it| *it == Telemetry::Protocol) as fn(&Telemetry) -> bool),
        (VehicleCommand::RequestCapabilities, |it| matches!(it, Telemetry::Version(_))),
    ] {
        bench.hear(Uplink::Command(command));
        let said: Vec<_> = (0..5).flat_map(|_| step(&mut bench)).collect();
        let sent = said.iter().any(|message| matches!(message, Downlink::Telemetry(it) if is_it(it)));
        assert!(sent, "{command:?}: {said:?}");
    }
    // A message without an index cannot be requested with one.
    assert_eq!(ask(&mut bench, id::ATTITUDE, 1), CommandResult::Denied);
    (0..20).for_each(|_| drop(step(&mut bench)));
    // There are more requests than the queue has room for.
    for _ in 0..40 {
        bench.hear(Uplink::Command(VehicleCommand::RequestProtocol));
    }
    let said: Vec<_> = (0..30).flat_map(|_| step(&mut bench)).collect();
    let count = |wanted: CommandResult| {
        said.iter()
            .filter(|it| matches!(it, Downlink::CommandAck { command: 519, answer, .. } if *answer == wanted))
            .count()
    };
    assert_eq!((count(CommandResult::Accepted), count(CommandResult::Refused(BUSY))), (16, 24));
}

#[test]
fn intervals_are_set_and_reported_on_the_wire() {
    let mut bench = bench(true);
    let set = |message, interval_us| VehicleCommand::SetInterval { message, interval_us };
    refused(&mut bench, set(id::ATTITUDE, 5_000), CommandResult::Accepted);
    refused(&mut bench, set(9_999, 5_000), CommandResult::Unsupported);
    for (message, expected) in [(id::ATTITUDE, 5_000), (9_999, 0), (id::GPS_GLOBAL_ORIGIN, -1)] {
        bench.hear(Uplink::Command(VehicleCommand::GetInterval(message)));
        let said: Vec<_> = (0..3).flat_map(|_| step(&mut bench)).collect();
        let interval = said.iter().find_map(|it| match it {
            Downlink::Interval(interval) => Some((interval.message, interval.interval_us)),
            _ => None,
        });
        assert_eq!(interval, Some((message, expected)));
    }
}

/// A reboot needs a shell that supports the kind of reboot, and a disarmed vehicle, as in PX4.
#[test]
fn it_reboots_where_it_can_and_disarmed_only() {
    let both: &[Reboot] = &[Reboot::Program, Reboot::BootLoader];
    for (reboots, into, armed, expected) in [
        (&[] as &[_], Reboot::Program, false, CommandResult::Unsupported),
        (&[Reboot::Program], Reboot::BootLoader, false, CommandResult::Unsupported),
        (&[Reboot::Program], Reboot::BootLoader, true, CommandResult::Unsupported),
        (&[Reboot::Program], Reboot::Program, false, CommandResult::Accepted),
        (both, Reboot::Program, false, CommandResult::Accepted),
        (both, Reboot::BootLoader, false, CommandResult::Accepted),
        (both, Reboot::Program, true, CommandResult::Refused(Refusal::AlreadyArmed as i32)),
        (both, Reboot::BootLoader, true, CommandResult::Refused(Refusal::AlreadyArmed as i32)),
    ] {
        let mut bench = if armed { Bench::flying() } else { Bench::new() };
        bench.comms = Comms::with(Setup { reboots, ..Setup::default() });
        bench.step();
        bench.hear(Uplink::Command(VehicleCommand::Reboot(into)));
        // The answer is sent before the shell reboots.
        let said = bench.step().1;
        let answered = said.iter().any(|it| matches!(it, Downlink::CommandAck { answer, .. } if *answer == expected));
        let wanted = Some(into).filter(|_| expected == CommandResult::Accepted);
        assert!(answered && bench.comms.wants_reboot() == wanted, "{reboots:?} {into:?} {armed}: {said:?}");
    }
}

#[test]
fn stored_parameters_are_restored_disarmed_only() {
    let mut disarmed = bench(true);
    for (storage, changes) in [(Storage::Load, 0), (Storage::Save, 0), (Storage::Reset, 1)] {
        refused(&mut disarmed, VehicleCommand::Storage(storage), CommandResult::Accepted);
        assert_eq!(disarmed.changes.len(), changes);
    }
    assert_eq!(disarmed.changes, [RecordChange::Restored]);
    let mut armed = Bench::flying();
    armed.hear(Uplink::Command(VehicleCommand::Storage(Storage::Reset)));
    let said = armed.tick(&State::default()).1;
    let refusal = CommandResult::Refused(Refusal::AlreadyArmed as i32);
    assert!(said.iter().any(|it| matches!(it, Downlink::CommandAck { answer, .. } if *answer == refusal)), "{said:?}");
    assert_eq!(armed.changes, []);
}

/// Targets in every frame and joysticks are accepted, but only from the station in control.
#[test]
fn targets_and_sticks_reach_the_guidance() {
    let nan = Vector3::from_element(f32::NAN);
    let motion = |axes, position_m: Vector3<f32>, velocity_m_s: Vector3<f32>| PositionTarget {
        axes,
        position_m,
        velocity_m_s,
        acceleration_m_s2: nan,
        yaw_rad: 0.25,
        yaw_rate_rad_s: f32::NAN,
    };
    let (step_m, fast) = (Vector3::new(2.0, -3.0, 1.0), Vector3::new(0.5, 0.25, -0.125));
    let mut bench = bench(true);
    let mut reported = |from: Address, message: Uplink| {
        bench.hear_from(from, message);
        let target = bench.inputs.orders.target.map(|target| target.value);
        let sticks = bench.inputs.orders.sticks.map(|sticks| sticks.value);
        step(&mut bench);
        (target, sticks)
    };
    for (axes, position_m, velocity_m_s, flown_m, body) in [
        (TargetFrame::Local, step_m, fast, step_m, false),
        (TargetFrame::Offset, step_m, fast, Vector3::from(HERE) + step_m, false),
        (TargetFrame::Body, nan, fast, nan, true),
        (TargetFrame::Body, step_m, nan, step_m, false),
        (TargetFrame::BodyOffset, step_m, nan, step_m, true),
    ] {
        let (target, _) =
            reported(STATION, Uplink::Target(ExternalTarget::Motion(motion(axes, position_m, velocity_m_s))));
        let Some(afbc_guidance::OffboardTarget::Motion(target)) = target else { panic!("{axes:?}: {target:?}") };
        let found = (target.position_m, target.velocity_m_s, target.yaw_rad, target.body);
        assert_eq!(format!("{found:?}"), format!("{:?}", (flown_m, velocity_m_s, 0.25, body)), "{axes:?}");
    }
    let there = place([40.0, -30.0, 0.0], Datum::Sea, 500.0);
    let (target, _) =
        reported(STATION, Uplink::Target(ExternalTarget::GlobalPosition(there, motion(TargetFrame::Local, nan, fast))));
    let Some(afbc_guidance::OffboardTarget::Motion(target)) = target else { panic!("{target:?}") };
    assert!((target.position_m - Vector3::new(40.0, -30.0, 12.0)).norm() < 0.02, "{target:?}");
    assert_eq!((target.velocity_m_s, target.body), (fast, false));
    let attitude = AttitudeAndThrust { attitude: [0.6, 0.8, 0.0, 0.0], yaw_rate_rad_s: 0.5, thrust: 0.25 };
    let (target, _) = reported(STATION, Uplink::Target(ExternalTarget::Attitude(attitude)));
    let Some(afbc_guidance::OffboardTarget::Attitude(target)) = target else { panic!("{target:?}") };
    assert_eq!((target.yaw_rate_rad_s, target.thrust), (0.5, 0.25));
    assert!((target.attitude.w - 0.6).abs() < 1e-6 && (target.attitude.i.abs() - 0.8).abs() < 1e-6);
    let sticks = ManualControl { roll: 0.1, pitch: -0.2, throttle: 0.3, yaw: -0.4 };
    let (target, told_sticks) = reported(STATION, Uplink::Target(ExternalTarget::Sticks(sticks)));
    assert_eq!(target, None);
    let found = told_sticks.expect("sticks");
    for (found, sent) in [(found.roll, 0.1), (found.pitch, -0.2), (found.throttle, 0.3), (found.yaw, -0.4)] {
        assert!((found - sent).abs() < 1e-2, "{found} {sent}");
    }
    // Targets and sticks of another station are ignored.
    assert_eq!(reported(OTHER, Uplink::Target(ExternalTarget::Sticks(sticks))), (None, None));
    assert_eq!(reported(OTHER, Uplink::Setpoint(Setpoint::default())), (None, None));
}

/// An offset from the vehicle's position is ignored while the position is unknown.
#[test]
fn an_offset_from_nowhere_is_no_target() {
    let mut bench = Bench::new();
    bench.step();
    let nan = Vector3::from_element(f32::NAN);
    for (axes, taken) in [(TargetFrame::Offset, false), (TargetFrame::Local, true)] {
        let motion = PositionTarget {
            axes,
            position_m: Vector3::new(1.0, 2.0, 3.0),
            velocity_m_s: nan,
            acceleration_m_s2: nan,
            yaw_rad: f32::NAN,
            yaw_rate_rad_s: f32::NAN,
        };
        bench.hear(Uplink::Target(ExternalTarget::Motion(motion)));
        assert_eq!(bench.inputs.orders.target.is_some(), taken, "{axes:?}");
    }
}

/// The guidance is told 20 times per second that the station in control was heard, and is not told of other stations.
#[test]
fn the_guidance_hears_of_the_station_in_control() {
    let mut bench = bench(true);
    leads_to(&mut bench, VehicleCommand::Speed(2.0), &[Order::Speed(2.0)]);
    let mut heard = |from: Address| {
        let mut times = Vec::new();
        for _ in 0..1000 {
            bench.hear_from(from, Uplink::Heartbeat);
            times.extend(bench.inputs.orders.heard_us);
            step(&mut bench);
        }
        times
    };
    let times = heard(STATION);
    assert!((18..=20).contains(&times.len()), "{times:?}");
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] >= 50_000), "{times:?}");
    assert_eq!(heard(OTHER), [0; 0]);
}

/// The shell's texts are sent. The battery that the shell measures reaches the guidance in volts and amperes.
#[test]
fn what_the_shell_says_is_reported() {
    let mut bench = bench(true);
    bench.comms.warn("flash is worn");
    let said = step(&mut bench);
    let reported = |it: &Downlink| matches!(it, Downlink::Text { text, .. } if text.to_str() == Ok("flash is worn"));
    assert!(said.iter().any(reported), "{said:?}");
    for (current_ca, current_a) in [(1250, 12.5), (-1, 0.0)] {
        let battery =
            BatteryStatus { voltage_mv: 11_100, current_ca, remaining_percent: -1, consumed_mah: -1, charge: 0 };
        bench.comms.set_aux_sensors(AuxSensors { battery: Some(battery), ..AuxSensors::default() });
        let reading = bench.receive(&[]).battery.expect("measured");
        assert!((reading.voltage_v - 11.1).abs() < 1e-5 && (reading.current_a - current_a).abs() < 1e-5, "{reading:?}");
    }
}

/// All stations are told of each item that is reached. MISSION_CURRENT shows the progress of the mission.
#[test]
fn a_mission_reports_how_far_it_is() {
    let mut bench = bench(true);
    let state = |bench: &mut Bench| {
        let current = bench.comms_current();
        (current.total, current.state, current.mode)
    };
    assert_eq!(state(&mut bench), (0, 1, 2), "no mission");
    assert_eq!(upload(&mut bench, &[item(0, 16), item(1, 16)]), Some(MissionResult::ACCEPTED));
    assert_eq!(state(&mut bench), (2, 4, 2), "it waits");
    let (mut report, _) = bench.step();
    (report.guided.mode, report.guided.wanted, report.mode) = (FlightMode::Mission, 1, afbc_flight_core::Mode::Flying);
    report.guided.reached = Some(0);
    let said = bench.said(&report);
    let reached = |said: &[Downlink], number| {
        said.iter().any(|it| {
            matches!(
                it,
                Downlink::Mission { message: MissionMessage::Reached(reported), .. } if *reported == number
            )
        })
    };
    assert!(reached(&said, 0), "{said:?}");
    let current = |bench: &mut Bench, report: &Report| {
        bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: id::MISSION_CURRENT, index: 0 }));
        let said = bench.said(report);
        let current = said.iter().find_map(|it| match it {
            Downlink::Mission { message: MissionMessage::Current(it), .. } => Some((it.number, it.state, it.mode)),
            _ => None,
        });
        current.expect("sent")
    };
    report.guided.reached = None;
    assert_eq!(current(&mut bench, &report), (1, 3, 1), "it flies");
    report.guided.reached = Some(1);
    assert!(reached(&bench.said(&report), 1));
    (report.guided.reached, report.guided.mode) = (None, FlightMode::Hold);
    assert_eq!(current(&mut bench, &report), (1, 5, 2), "it is done");
    (report.guided.mode, report.mode) = (FlightMode::Mission, afbc_flight_core::Mode::Disarmed);
    assert_eq!(current(&mut bench, &report), (1, 5, 2), "on the ground it does not fly");
}

/// This checks the test's own conversion of places.
#[test]
fn places_of_the_test_are_where_they_say() {
    let GlobalPosition { latitude_e7, longitude_e7, .. } = place([40.0, -30.0, 0.0], Datum::Sea, 0.0);
    let back = origin().local(&Global::of_e7([latitude_e7, longitude_e7], 488.0));
    assert!((back - Vector3::new(40.0, -30.0, 0.0)).norm() < 0.02, "{back}");
}
