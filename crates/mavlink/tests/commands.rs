//! Commands written by the `mavlink` crate's own serialiser: the meaning of each parameter, and the commands that are
//! denied.

use crate::wire::{bytes, raw, read, theirs};
use afbc_mavlink::telemetry::OrbitStatus;
use afbc_mavlink::{
    CalibrationRequest, Counters, Datum, Downlink, GlobalPosition, Height, MavCmd, Reboot, Telemetry, Uplink,
    VehicleCommand,
};
use mavlink::dialects::common::{COMMAND_INT_DATA, COMMAND_LONG_DATA, MavFrame, ORBIT_EXECUTION_STATUS_DATA};

#[test]
fn commands() {
    let long = |command, param1, param2| {
        theirs(&COMMAND_LONG_DATA { command, param1, param2, target_system: 1, ..COMMAND_LONG_DATA::DEFAULT })
    };
    let int = |command, param1, param2| {
        let (frame, x, y) = (MavFrame::MAV_FRAME_GLOBAL, i32::MAX, i32::MAX);
        let data = COMMAND_INT_DATA { command, param1, param2, x, y, frame, ..COMMAND_INT_DATA::DEFAULT };
        theirs(&COMMAND_INT_DATA { target_system: 1, ..data })
    };
    let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
    for command in [&long as &dyn Fn(_, _, _) -> Vec<u8>, &int] {
        let read = |id, param1, param2| match read(&command(id, param1, param2)) {
            Ok(Uplink::Command(command)) => command,
            other => panic!("{other:?}"),
        };
        assert_eq!(read(arm, 1.0, 0.0), VehicleCommand::Arm);
        assert_eq!(read(arm, 1.0, 21196.0), VehicleCommand::Denied(400), "by force");
        assert_eq!(read(arm, 0.0, 0.0), VehicleCommand::Disarm);
        assert_eq!(read(arm, 0.0, 21195.0), VehicleCommand::Denied(400), "by which force?");
        assert_eq!(read(arm, -0.0, 21196.0), VehicleCommand::Kill);
        for param1 in [0.5, -1.0, 2.0, f32::NAN, f32::INFINITY] {
            assert_eq!(read(arm, param1, 21196.0), VehicleCommand::Denied(400));
        }
        let reboot = MavCmd::MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN;
        assert_eq!(read(reboot, 1.0, 0.0), VehicleCommand::Reboot(Reboot::Program));
        assert_eq!(read(reboot, 3.0, 0.0), VehicleCommand::Reboot(Reboot::BootLoader));
        // These values ask for nothing, for a shutdown, or are invalid.
        for param1 in [0.0, 2.0, 2.5, 4.0, -1.0, f32::NAN] {
            assert_eq!(read(reboot, param1, 0.0), VehicleCommand::Denied(246));
        }
        assert_eq!(read(MavCmd::MAV_CMD_USER_1, 0.0, f32::NAN), VehicleCommand::Engage);
        assert_eq!(read(MavCmd::MAV_CMD_USER_2, 0.0, f32::NAN), VehicleCommand::SelfTest);
        assert_eq!(read(MavCmd::MAV_CMD_NAV_LAND, f32::NAN, 0.0), VehicleCommand::Land);
        assert_eq!(read(MavCmd::MAV_CMD_DO_SET_SERVO, 1.0, 0.0), VehicleCommand::Other(183));
    }
}

/// Parameters of MAV_CMD_PREFLIGHT_CALIBRATION (241), as numbered in MAVLink's common dialect. MAVSDK sends NaN for the
/// parameters that it does not use.
#[test]
fn calibrations_are_read() {
    let read = |parameters: [f32; 7]| {
        let [param1, param2, param3, param4, param5, param6, param7] = parameters;
        let command = MavCmd::MAV_CMD_PREFLIGHT_CALIBRATION;
        let frame = COMMAND_LONG_DATA {
            command,
            param1,
            param2,
            param3,
            param4,
            param5,
            param6,
            param7,
            ..COMMAND_LONG_DATA::DEFAULT
        };
        match read(&theirs(&frame)) {
            Ok(Uplink::Command(command)) => command,
            other => panic!("{other:?}"),
        }
    };
    let known = [
        (CalibrationRequest::Cancel, 0, 0.0),
        (CalibrationRequest::Gyroscope, 0, 1.0),
        (CalibrationRequest::Magnetometer, 1, 1.0),
        (CalibrationRequest::Accelerometer, 4, 1.0),
        (CalibrationRequest::Level, 4, 2.0),
    ];
    for (asked, place, value) in known {
        for rest in [0.0, f32::NAN] {
            let mut parameters = [0.0, 0.0, 0.0, 0.0, 0.0, rest, rest];
            parameters[place] = value;
            assert_eq!(read(parameters), VehicleCommand::Calibrate(asked));
        }
    }
    // Every other value of each parameter, and two parameters at once: pressure, radio, airspeed, temperature, simple.
    for place in 0..7 {
        for value in [-1.0, 0.5, 1.0, 2.0, 3.0, 4.0, f32::INFINITY] {
            let mut parameters = [0.0; 7];
            parameters[place] = value;
            let is_known = known.iter().any(|(_, at, what)| (*at, *what) == (place, value));
            assert_eq!(read(parameters) == VehicleCommand::Denied(241), !is_known, "{parameters:?}");
            parameters[usize::from(place == 0)] = 1.0;
            assert_eq!(read(parameters), VehicleCommand::Denied(241), "{parameters:?}");
        }
    }
}

/// Modes come in parts, as MAVSDK sends them, or complete, as MAVProxy and pymavlink do. Neither form is taken for the
/// other, and anything else is denied.
#[test]
fn modes_come_in_parts_or_whole() {
    let set_mode = |param1, param2, param3| {
        let command = MavCmd::MAV_CMD_DO_SET_MODE;
        match read(&theirs(&COMMAND_LONG_DATA { command, param1, param2, param3, ..COMMAND_LONG_DATA::DEFAULT })) {
            Ok(Uplink::Command(command)) => command,
            other => panic!("{other:?}"),
        }
    };
    for (main, sub) in (0..=255).flat_map(|main| (0..=255).map(move |sub| (main, sub))) {
        let mode = main << 16 | sub << 24;
        assert_eq!(set_mode(1.0, main as f32, sub as f32), VehicleCommand::SelectMode(mode));
        assert_eq!(set_mode(29.0, mode as f32, 0.0), VehicleCommand::SelectMode(mode));
        assert_eq!(set_mode(1.0, mode as f32, f32::NAN), VehicleCommand::SelectMode(mode));
    }
    let hold = 0x0304_0000_u32 as f32;
    let wrong = [[1.0, 256.0, 0.0], [1.0, 65_535.0, 0.0], [1.0, 65_537.0, 0.0], [1.0, hold, 3.0], [0.0, hold, 0.0]];
    for [p1, p2, p3] in wrong {
        assert_eq!(set_mode(p1, p2, p3), VehicleCommand::Denied(176), "{p1} {p2} {p3}");
    }
    for p2 in [-65_536.0, 0.5, 4_294_967_296.0, f32::MAX, f32::INFINITY, f32::NAN] {
        assert_eq!(set_mode(1.0, p2, 0.0), VehicleCommand::Denied(176), "{p2}");
    }
}

/// Commands of any number, known or not, are read, so that they can be answered.
#[test]
fn every_command_is_read() {
    for id in 0..=u16::MAX {
        for (message, extra_crc, length) in [(76, 152, 33), (75, 158, 35)] {
            let mut payload = vec![0; length];
            payload[28..30].copy_from_slice(&id.to_le_bytes());
            let known = VehicleCommand::KNOWN.contains(&id);
            let Ok(Uplink::Command(expected)) = read(&raw(message, &payload, extra_crc)) else { panic!("{id}") };
            assert_eq!(matches!(expected, VehicleCommand::Other(_)), !known, "{id}");
            assert_eq!(expected == VehicleCommand::Disarm, id == 400);
            assert_eq!(expected == VehicleCommand::Engage, id == 31_010);
            // The frame without its trailing zeros gives the same command.
            let again = read::<Uplink>(&raw(message, &payload[..30], extra_crc));
            assert_eq!(format!("{again:?}"), format!("{:?}", Ok::<_, Counters>(Uplink::Command(expected))));
            assert_eq!(expected.id(), id);
        }
    }
}

/// The signs of radius and speed give the direction together. NaN means the default, and impossible orbits are denied.
#[test]
fn circles_are_read_and_reported() {
    let (x, y, z, nan) = (473_977_420, 85_455_940, 12.5, f32::NAN);
    let orbit = |param1, param2, param3, param4| {
        let (command, frame) = (MavCmd::MAV_CMD_DO_ORBIT, MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT);
        let data =
            COMMAND_INT_DATA { command, frame, param1, param2, param3, param4, x, y, z, ..COMMAND_INT_DATA::DEFAULT };
        match read(&theirs(&data)) {
            Ok(Uplink::Command(command)) => command,
            other => panic!("{other:?}"),
        }
    };
    let height = Height { metres: z, above: Datum::Home };
    let place = GlobalPosition { latitude_e7: x, longitude_e7: y, height };
    let flown = |radius_m, speed_m_s, heading, angle_deg| VehicleCommand::Orbit {
        place,
        radius_m,
        speed_m_s,
        angle_deg,
        heading,
    };
    assert_eq!(orbit(10.0, 2.0, 0.0, 0.0), flown(10.0, 2.0, 0, 0));
    assert_eq!(orbit(-10.0, 2.0, 3.0, 4.712_389), flown(-10.0, 2.0, 3, 270));
    assert_eq!(orbit(10.0, -2.0, 5.0, nan), flown(-10.0, 2.0, 5, 0));
    assert_eq!(orbit(-10.0, -2.0, nan, 0.0), flown(10.0, 2.0, 0, 0));
    let VehicleCommand::Orbit { radius_m, speed_m_s, .. } = orbit(nan, nan, nan, nan) else { panic!("another") };
    assert!(radius_m.is_nan() && speed_m_s.is_nan());
    for [p1, p2, p3, p4] in [
        [f32::INFINITY, 2.0, 0.0, 0.0],
        [10.0, f32::INFINITY, 0.0, 0.0],
        // These rows have yaw by radio control, and invalid yaw behaviours.
        [10.0, 2.0, 4.0, 0.0],
        [10.0, 2.0, 6.0, 0.0],
        [10.0, 2.0, 0.5, 0.0],
        [10.0, 2.0, 0.0, -1.0],
        [10.0, 2.0, 0.0, 1144.0],
    ] {
        assert_eq!(orbit(p1, p2, p3, p4), VehicleCommand::Denied(34), "{p1} {p2} {p3} {p4}");
    }
    let status = OrbitStatus { time_us: 77, radius_m: -9.5, place_e7: [x, y], altitude_m: 500.25 };
    let data = ORBIT_EXECUTION_STATUS_DATA {
        time_usec: 77,
        radius: -9.5,
        x,
        y,
        z: 500.25,
        frame: MavFrame::MAV_FRAME_GLOBAL_INT,
    };
    let report = Downlink::Telemetry(Telemetry::Orbit(status));
    assert_eq!(bytes(&report), theirs(&data));
    assert_eq!(read(&theirs(&data)).ok(), Some(report));
}
