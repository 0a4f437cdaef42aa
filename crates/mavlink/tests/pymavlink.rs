//! Frames from MAVLink's reference implementation (`reference/frames.py`) are read correctly, and written again with
//! the same bytes.

use afbc_mavlink::telemetry::{
    ActuatorOutputs, AttitudeQuaternion, BatteryStatus, EstimatorStatus, GlobalOrigin, GlobalPositionInt, GpsRawInt,
    HomePosition, SystemStatus, Version, VfrHud,
};
use afbc_mavlink::{
    Address, AttitudeAndThrust, AvailableMode, CommandResult, ControlAnswer, ControlRequest, CurrentMode, DataStream,
    Datum, Decoder, Downlink, Encoder, ExternalTarget, FRAME_MAX, GlobalPosition, Height, ManualControl, MavSeverity,
    MessageInterval, MessageSet, MissionCurrent, MissionItem, MissionMessage, MissionResult, MissionType,
    ParameterRequest, ParameterValue, PositionTarget, TargetFrame, Telemetry, TimeMessage, Uplink, VehicleCommand,
};
use nalgebra::Vector3;

const STATION: Address = Address { system: 255, component: 190 };
const VEHICLE: Address = Address { system: 1, component: 1 };
const ALL: Address = Address { system: 0, component: 0 };

/// Returns the bytes of a frame by name.
fn frame(name: &str) -> Vec<u8> {
    let lines = include_str!("reference/frames.txt").lines().filter_map(|line| line.split_once(' '));
    let (_, hex) = lines.into_iter().find(|(other, _)| *other == name).unwrap_or_else(|| panic!("no {name}"));
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hex")).collect()
}

/// Checks that the frame is read as `expected`. Compares as text, since NaN differs from itself.
fn check<M: MessageSet + core::fmt::Debug>(name: &str, expected: &M) {
    let mut heard = Vec::new();
    let mut decoder = Decoder::<M>::new(VEHICLE);
    decoder.feed(&frame(name), |from, message| heard.push((from, message)));
    assert_eq!(format!("{heard:?}"), format!("{:?}", [(STATION, expected)]), "{name}: {:?}", decoder.counters());
}

/// Checks that the frame is read as `message`, and that writing `message` gives the same frame.
fn check_both(name: &str, message: &Downlink) {
    check(name, message);
    assert_eq!(Encoder::new(STATION).send(message, &mut [0; FRAME_MAX]), frame(name), "{name}");
}

fn name<const N: usize>(text: &str) -> [u8; N] {
    let mut bytes = [0; N];
    bytes[..text.len()].copy_from_slice(text.as_bytes());
    bytes
}

#[test]
fn commands_are_read() {
    let command = |name, command| check(name, &Uplink::Command(command));
    command("SET_MODE", VehicleCommand::SelectMode(0x0304_0000));
    command("COMMAND_LONG", VehicleCommand::SelectMode(0x0304_0000));
    let height = Height { metres: 12.25, above: Datum::Home };
    let place = GlobalPosition { latitude_e7: 473_977_420, longitude_e7: 85_455_940, height };
    command(
        "COMMAND_INT",
        VehicleCommand::Reposition { place, yaw_rad: -0.5, speed_m_s: Some(2.5), changes_mode: true },
    );
    command("TAKEOFF", VehicleCommand::TakeOff(Height { metres: 2.5, above: Datum::Here }));
    check("CONTROL", &Uplink::Control(ControlRequest::Release));
    check("STREAM", &Uplink::Stream(DataStream { group: 10, rate_hz: 4 }));
}

#[test]
fn targets_are_read() {
    let target = |name, target| check(name, &Uplink::Target(target));
    let (velocity_m_s, yaw_rate_rad_s) = (Vector3::new(1.0, -2.0, -3.0), f32::NAN);
    target(
        "TARGET",
        ExternalTarget::Motion(PositionTarget {
            axes: TargetFrame::Body,
            velocity_m_s,
            yaw_rate_rad_s,
            ..PositionTarget::NONE
        }),
    );
    let height = Height { metres: 12.5, above: Datum::Home };
    let place = GlobalPosition { latitude_e7: 473_977_420, longitude_e7: 85_455_940, height };
    target("PLACE", ExternalTarget::GlobalPosition(place, PositionTarget::NONE));
    let attitude = [0.5, 0.5, -0.5, -0.5];
    target(
        "ATTITUDE",
        ExternalTarget::Attitude(AttitudeAndThrust { attitude, yaw_rate_rad_s: f32::NAN, thrust: 0.75 }),
    );
    target("STICKS", ExternalTarget::Sticks(ManualControl { roll: -0.25, pitch: 0.5, throttle: 0.5, yaw: 1.0 }));
}

#[test]
fn missions_are_read() {
    let mission = |name, message| check(name, &Uplink::Mission(message));
    mission("COUNT", MissionMessage::Count(300, MissionType::FENCE));
    let item = MissionItem {
        number: 513,
        command: 16,
        frame: 6,
        is_current: false,
        goes_on: true,
        parameters: [5.0, 2.0, 0.5, f32::NAN],
        x: 473_977_420,
        y: -85_455_940,
        z: 10.5,
    };
    mission("ITEM", MissionMessage::Item(item, MissionType::MISSION));
    mission("LIST", MissionMessage::List(MissionType::RALLY));
    mission("REQUEST", MissionMessage::Request(3, MissionType::MISSION));
    mission("REQUEST_INT", MissionMessage::Request(3, MissionType::FENCE));
    mission("ACK", MissionMessage::Ack(MissionResult::INVALID_SEQUENCE, MissionType::MISSION));
    mission("CLEAR", MissionMessage::Clear(MissionType::ALL));
    mission("SET_CURRENT", MissionMessage::SetCurrent(9));
}

#[test]
fn clocks_and_parameters_are_read() {
    check("TIMESYNC", &Uplink::Time(TimeMessage::Sync { answered_ns: 0, asked_ns: -5, to: ALL }));
    check("PING", &Uplink::Time(TimeMessage::Ping { time_us: 77, number: 5, to: ALL }));
    check("SYSTEM_TIME", &Uplink::Time(TimeMessage::Time { unix_us: 1_700_000_000_000_000, boot_ms: 1234 }));
    let parameter = |name, request| check(name, &Uplink::Parameter(request));
    parameter("PARAM_READ", ParameterRequest::ReadName(name("MIS_TAKEOFF_ALT")));
    parameter("PARAM_PLACE", ParameterRequest::ReadIndex(3));
    parameter("PARAM_LIST", ParameterRequest::List);
    let value = 1.5_f32.to_le_bytes();
    parameter("PARAM_SET", ParameterRequest::Set { name: name("SIXTEEN_LETTERS_"), value, kind: 9 });
}

#[test]
fn places_are_read_and_written() {
    let both = |name, telemetry| check_both(name, &Downlink::Telemetry(telemetry));
    both(
        "<GLOBAL_POSITION_INT",
        Telemetry::GlobalPositionInt(GlobalPositionInt {
            time_ms: 5,
            place_e7: [473_977_420, -85_455_940],
            altitude_mm: 488_123,
            relative_mm: -123,
            velocity_ned_cm_s: [100, -200, 300],
            heading_cdeg: 35_999,
        }),
    );
    both(
        "<GPS_RAW_INT",
        Telemetry::GpsRawInt(GpsRawInt {
            time_us: 9,
            place_e7: [473_977_420, 85_455_940],
            altitude_mm: 488_000,
            kind: 3,
            satellites: 12,
            sigma_mm: [500, 800],
            speed_cm_s: 123,
            course_cdeg: 4567,
        }),
    );
    let (place_e7, altitude_mm, time_us) = ([1, 2], 3, 99);
    both("<GPS_GLOBAL_ORIGIN", Telemetry::GpsGlobalOrigin(GlobalOrigin { place_e7, altitude_mm, time_us }));
    let (position_m, attitude) = (Vector3::new(4.0, -5.0, -6.0), [1.0, 0.0, -0.0, -0.0]);
    // Only reading is tested, since the conversion changes the signs of zeros.
    check(
        "<HOME_POSITION",
        &Downlink::Telemetry(Telemetry::HomePosition(HomePosition {
            place_e7,
            altitude_mm,
            position_m,
            attitude,
            time_us,
        })),
    );
}

#[test]
fn telemetry_is_read_and_written() {
    let both = |name, telemetry| check_both(name, &Downlink::Telemetry(telemetry));
    let (attitude, rates_rad_s) = ([0.5, 0.25, 0.5, -0.75], Vector3::new(1.0, -2.0, -3.0));
    both("<ATTITUDE_QUATERNION", Telemetry::Attitude(AttitudeQuaternion { time_ms: 5, attitude, rates_rad_s }));
    both(
        "<SYS_STATUS",
        Telemetry::System(SystemStatus {
            present: 7,
            enabled: 5,
            healthy: 3,
            load_permille: 51,
            voltage_mv: 16_100,
            current_ca: 1234,
            remaining_percent: 87,
            dropped_frames: 11,
        }),
    );
    both(
        "<BATTERY_STATUS",
        Telemetry::Battery(BatteryStatus {
            voltage_mv: 16_100,
            current_ca: 1234,
            consumed_mah: 250,
            remaining_percent: 87,
            charge: 1,
        }),
    );
    both("<EXTENDED_SYS_STATE", Telemetry::Landed(2));
    let sigma_m = [0.5, 0.75];
    both("<ESTIMATOR_STATUS", Telemetry::Estimator(EstimatorStatus { time_us: 9, flags: 831, sigma_m }));
    let throttles = [0.25, 0.5, 0.75, 1.0, 0.0, 0.0, 0.0, 0.0];
    both("<ACTUATOR_OUTPUT_STATUS", Telemetry::Outputs(ActuatorOutputs { time_us: 9, active: 4, throttles }));
    let (software, commit) = ([1, 2, 3, 255], [1, 2, 3, 4, 5, 6, 7, 8]);
    both("<AUTOPILOT_VERSION", Telemetry::Version(Version { capabilities: 8706, uid: 77, software, commit }));
    both(
        "<VFR_HUD",
        Telemetry::VfrHud(VfrHud {
            speed_m_s: 1.5,
            altitude_m: 490.0,
            climb_m_s: -0.5,
            heading_deg: 270,
            throttle_percent: 55,
        }),
    );
}

#[test]
fn the_rest_is_read_and_written() {
    let to = Address { system: 245, component: 190 };
    check_both("<COMMAND_ACK", &Downlink::CommandAck { command: 22, answer: CommandResult::InProgress, to });
    check_both("<MESSAGE_INTERVAL", &Downlink::Interval(MessageInterval { message: 31, interval_us: -1 }));
    let (custom, name_of_mode) = (0x0204_0000, name("takeoff"));
    let mode = AvailableMode { count: 9, index: 2, standard: 8, custom, properties: 4, name: name_of_mode };
    check_both("<AVAILABLE_MODES", &Downlink::AvailableMode(mode));
    let mode = CurrentMode { standard: 7, custom: 0x0604_0000, intended: 0x0304_0000 };
    check_both("<CURRENT_MODE", &Downlink::CurrentMode(mode));
    let current = MissionCurrent { number: 3, total: 9, state: 3, mode: 1 };
    check_both("<MISSION_CURRENT", &Downlink::Mission { message: MissionMessage::Current(current), to: ALL });
    check_both("<MISSION_ITEM_REACHED", &Downlink::Mission { message: MissionMessage::Reached(3), to: ALL });
    let value = 2.5_f32.to_le_bytes();
    let parameter = ParameterValue { name: name("GF_MAX_HOR_DIST"), value, kind: 9, count: 300, index: u16::MAX };
    check_both("<PARAM_VALUE", &Downlink::Parameter(parameter));
    let followed = PositionTarget {
        axes: TargetFrame::Local,
        position_m: Vector3::new(1.0, -2.0, -3.0),
        velocity_m_s: Vector3::new(4.0, -5.0, -6.0),
        acceleration_m_s2: Vector3::new(7.0, -8.0, -9.0),
        yaw_rad: -0.5,
        yaw_rate_rad_s: -0.25,
    };
    check_both("<POSITION_TARGET", &Downlink::PositionTarget(5, followed));
    let refused = ControlAnswer { station: 245, control: ControlRequest::Take, granted: false };
    check_both("<CONTROL", &Downlink::Control(refused));
    let (severity, text) = (MavSeverity::MAV_SEVERITY_WARNING, "refused: not armed".into());
    check_both("<TEXT", &Downlink::Text { severity, text });
}
