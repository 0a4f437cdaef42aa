//! Bytes on the wire, compared with the `mavlink` crate's own serialiser, and with the specification for anything that
//! the crate lacks: extension fields, masks, frames, targets.

use afbc_mavlink::{
    Address, CommandResult, Counters, Decoder, Downlink, Encoder, ExternalTarget, FRAME_MAX, HealthArray, MavCmd,
    MavSeverity, MessageSet, PositionTarget, StatesRefused, TargetFrame, Uplink, VehicleCommand,
};
use afbc_types::{Axis, PerAxis, PoseSigmas, RotorSpeeds, Setpoint, State};
use mavlink::dialects::common::{
    ATTITUDE_DATA, COMMAND_INT_DATA, COMMAND_LONG_DATA, HIL_ACTUATOR_CONTROLS_DATA, MavFrame, ODOMETRY_DATA,
    PositionTargetTypemask, SET_POSITION_TARGET_LOCAL_NED_DATA,
};
use mavlink::{MAVLinkV2MessageRaw, MavHeader, MessageData};
use nalgebra::{SVector, Vector3};
use proptest::prelude::*;

const STATION: Address = Address { system: 255, component: 190 };
const VEHICLE: Address = Address { system: 1, component: 1 };

pub fn bytes(message: &impl MessageSet) -> Vec<u8> {
    Encoder::new(STATION).send(message, &mut [0; FRAME_MAX]).to_vec()
}

/// Returns a frame encoded by the `mavlink` crate.
pub fn theirs(data: &impl MessageData) -> Vec<u8> {
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message_data(MavHeader { system_id: 255, component_id: 190, sequence: 0 }, data);
    raw.raw_bytes().to_vec()
}

/// Returns the only message in `bytes`, or the counts.
pub fn read<M: MessageSet + Clone>(bytes: &[u8]) -> Result<M, Counters> {
    let mut decoder = Decoder::<M>::new(VEHICLE);
    let mut messages = Vec::new();
    decoder.feed(bytes, |from, message| {
        assert_eq!(from, STATION);
        messages.push(message);
    });
    assert!(messages.len() <= 1);
    messages.pop().ok_or(*decoder.counters())
}

/// Returns a frame with any payload and the correct checksum, built from the specification.
pub fn raw(id: u32, payload: &[u8], extra_crc: u8) -> Vec<u8> {
    let mut frame = vec![0xFD, payload.len() as u8, 0, 0, 0, 255, 190];
    frame.extend_from_slice(&id.to_le_bytes()[..3]);
    frame.extend_from_slice(payload);
    let crc = mavlink::calculate_crc(&frame[1..], extra_crc);
    frame.extend_from_slice(&crc.to_le_bytes());
    frame
}

fn odometry() -> ODOMETRY_DATA {
    ODOMETRY_DATA {
        frame_id: MavFrame::MAV_FRAME_LOCAL_NED,
        child_frame_id: MavFrame::MAV_FRAME_BODY_FRD,
        q: [1.0, 0.0, 0.0, 0.0],
        ..ODOMETRY_DATA::DEFAULT
    }
}

#[test]
fn bytes_are_the_mavlink_crates() {
    let attitude = Downlink::Attitude {
        time_ms: 12_345,
        attitude_rad: Vector3::new(0.1, 0.2, 0.3),
        rates_rad_s: Vector3::new(-1.0, 2.0, -3.0),
    };
    let expected = ATTITUDE_DATA {
        time_boot_ms: 12_345,
        roll: 0.1,
        pitch: -0.2,
        yaw: -0.3,
        rollspeed: -1.0,
        pitchspeed: -2.0,
        yawspeed: 3.0,
    };
    assert_eq!(bytes(&attitude), theirs(&expected));

    let mut state = State { position_m: Vector3::new(1.0, 2.0, 3.0), ..State::default() };
    state.rates_rad_s = Vector3::new(0.1, 0.2, 0.3);
    let mut expected = ODOMETRY_DATA { time_usec: 99, x: 1.0, y: -2.0, z: -3.0, ..odometry() };
    (expected.rollspeed, expected.pitchspeed, expected.yawspeed) = (0.1, -0.2, -0.3);
    (expected.q[2], expected.q[3]) = (-0.0, -0.0);
    (expected.vy, expected.vz) = (-0.0, -0.0);
    assert_eq!(bytes(&Uplink::State { sent_us: 99, state, sigmas: PoseSigmas::UNKNOWN }), theirs(&expected));

    let command =
        COMMAND_LONG_DATA { command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, param1: 1.0, ..COMMAND_LONG_DATA::DEFAULT };
    assert_eq!(bytes(&Uplink::Command(VehicleCommand::Arm)), theirs(&command));

    // Command 31010 has no parameters.
    let command = COMMAND_LONG_DATA { command: MavCmd::MAV_CMD_USER_1, ..COMMAND_LONG_DATA::DEFAULT };
    let engage = Uplink::Command(VehicleCommand::Engage);
    assert_eq!(bytes(&engage), theirs(&command));
    assert_eq!(bytes(&engage)[38..40], 31010_u16.to_le_bytes());
    assert_eq!(read(&theirs(&command)), Ok(engage));
    let denied = Uplink::Command(VehicleCommand::Denied(31_010));
    assert_eq!(read(&theirs(&COMMAND_LONG_DATA { param1: 7.0, ..command })), Ok(denied));
}

#[test]
fn sequence_numbers_count_and_wrap() {
    let mut sender = Encoder::new(STATION);
    for expected in (0..=255).chain(0..3) {
        assert_eq!(sender.send(&Uplink::Heartbeat, &mut [0; FRAME_MAX])[4], expected);
    }
}

#[test]
fn answers_carry_their_extension_fields() {
    let answer = Downlink::CommandAck {
        command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM as u16,
        answer: CommandResult::Refused(0x0102_0304),
        to: Address { system: 255, component: 190 },
    };
    let frame = bytes(&answer);
    // Command 400, temporarily rejected, no progress, result_param2, receiver.
    assert_eq!(frame[10..20], [0x90, 0x01, 1, 0, 4, 3, 2, 1, 255, 190]);
    assert_eq!(read(&frame), Ok(answer));
}

#[test]
fn health_is_an_array_of_29_floats() {
    let mut number = 0.0;
    let mut next = || {
        number += 1.0;
        number
    };
    let health = HealthArray {
        time_us: 7,
        tick_us: next(),
        tick_max_us: next(),
        rate_hz: next(),
        late_ticks: next() as u32,
        saturated_ticks: next() as u32,
        state_age_us: next(),
        theta_norm: PerAxis::from_fn(|_| next()),
        delta: PerAxis::from_fn(|_| next()),
        link: Counters {
            received: next() as u32,
            bad_checksum: next() as u32,
            unknown: next() as u32,
            malformed: next() as u32,
            implausible: next() as u32,
            unsupported: next() as u32,
            elsewhere: next() as u32,
            skipped_bytes: next() as u32,
            lost: next() as u32,
        },
        unanswered: next() as u32,
        states_refused: StatesRefused {
            overtaken: next() as u32,
            late: next() as u32,
            elsewhere: next() as u32,
            frozen: next() as u32,
        },
    };
    let frame = bytes(&Downlink::Health(health));
    assert_eq!(frame[10..18], 7u64.to_le_bytes());
    assert_eq!(frame[20..26], *b"health");
    for (index, element) in frame[30..frame.len() - 2].chunks(4).enumerate() {
        let mut padded = [0; 4];
        padded[..element.len()].copy_from_slice(element);
        assert_eq!(f32::from_le_bytes(padded), index as f32 + 1.0);
    }
    assert_eq!(read(&frame), Ok(Downlink::Health(health)));
    assert_eq!(Axis::ALL.len() * 2 + 6 + 10 + 1, 29);
}

#[test]
fn odometry_in_another_frame_or_failed_is_unsupported() {
    let read = |data: &ODOMETRY_DATA| read::<Uplink>(&theirs(data));
    assert!(matches!(read(&odometry()), Ok(Uplink::State { .. })));
    let local = ODOMETRY_DATA { frame_id: MavFrame::MAV_FRAME_LOCAL_FRD, ..odometry() };
    assert!(matches!(read(&local), Ok(Uplink::State { .. })));
    for frame in [MavFrame::MAV_FRAME_LOCAL_ENU, MavFrame::MAV_FRAME_BODY_FRD, MavFrame::MAV_FRAME_GLOBAL] {
        let wrong = ODOMETRY_DATA { frame_id: frame, ..odometry() };
        assert_eq!(read(&wrong).expect_err("wrong frame").unsupported, 1);
        let wrong = ODOMETRY_DATA { child_frame_id: frame, ..odometry() };
        assert_eq!(read(&wrong).is_ok(), frame == MavFrame::MAV_FRAME_BODY_FRD);
    }

    let mut payload = [0; 233];
    odometry().ser(mavlink::MavlinkVersion::V2, &mut payload);
    // Reset counter, type of estimator, quality in percent; -1 means that odometry has failed.
    payload[230..].copy_from_slice(&[5, 2, 80]);
    let good = raw(ODOMETRY_DATA::ID, &payload, ODOMETRY_DATA::EXTRA_CRC);
    assert!(matches!(self::read(&good), Ok(Uplink::State { .. })));
    payload[232] = 0xFF;
    let failed = raw(ODOMETRY_DATA::ID, &payload, ODOMETRY_DATA::EXTRA_CRC);
    assert_eq!(self::read::<Uplink>(&failed).expect_err("failed").unsupported, 1);
}

#[test]
fn odometry_without_covariance_is_read() {
    let mut data = odometry();
    (data.pose_covariance[0], data.velocity_covariance[0]) = (f32::NAN, f32::NAN);
    assert!(matches!(read(&theirs(&data)), Ok(Uplink::State { .. })));
}

#[test]
fn each_number_of_a_state_that_is_not_finite_is_counted() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
        for field in 0..13 {
            let mut data = odometry();
            let ODOMETRY_DATA { x, y, z, q: [qw, qx, qy, qz], vx, vy, vz, rollspeed, pitchspeed, yawspeed, .. } =
                &mut data;
            let fields = [x, y, z, qw, qx, qy, qz, vx, vy, vz, rollspeed, pitchspeed, yawspeed];
            *fields.into_iter().nth(field).expect("13 fields") = bad;
            let counters = read::<Uplink>(&theirs(&data)).expect_err("implausible");
            assert_eq!(counters, Counters { implausible: 1, ..Counters::default() }, "{bad} in {field}");
        }
    }
}

fn target(mask: u16) -> SET_POSITION_TARGET_LOCAL_NED_DATA {
    SET_POSITION_TARGET_LOCAL_NED_DATA {
        x: 1.0,
        y: 2.0,
        z: 3.0,
        vx: 4.0,
        vy: 5.0,
        vz: 6.0,
        afx: 7.0,
        afy: 8.0,
        afz: 9.0,
        yaw: 0.1,
        yaw_rate: 0.2,
        type_mask: PositionTargetTypemask::from_bits_retain(mask),
        coordinate_frame: MavFrame::MAV_FRAME_LOCAL_NED,
        target_system: 1,
        target_component: 1,
        ..SET_POSITION_TARGET_LOCAL_NED_DATA::DEFAULT
    }
}

#[test]
fn every_type_mask_means_what_the_specification_says() {
    for mask in 0..4096u16 {
        let bit = |n: u16| mask & (1 << n) != 0;
        let read = read::<Uplink>(&theirs(&target(mask)));
        if bit(9) || mask & 0b1101_1111_1111 == 0b1101_1111_1111 {
            assert_eq!(read.expect_err("forces, or nothing").unsupported, 1, "{mask:#b}");
            continue;
        }
        let unless = |ignored, value: f32| if ignored { f32::NAN } else { value };
        let expected = PositionTarget {
            axes: TargetFrame::Local,
            position_m: Vector3::new(unless(bit(0), 1.0), unless(bit(1), -2.0), unless(bit(2), -3.0)),
            velocity_m_s: Vector3::new(unless(bit(3), 4.0), unless(bit(4), -5.0), unless(bit(5), -6.0)),
            acceleration_m_s2: Vector3::new(unless(bit(6), 7.0), unless(bit(7), -8.0), unless(bit(8), -9.0)),
            yaw_rad: unless(bit(10), -0.1),
            yaw_rate_rad_s: unless(bit(11), -0.2),
        };
        let motion = match read {
            Ok(Uplink::Setpoint(setpoint)) => {
                assert_eq!(mask, 0, "complete");
                PositionTarget::from(&setpoint)
            }
            Ok(Uplink::Target(ExternalTarget::Motion(motion))) => motion,
            other => panic!("{mask:#b}: {other:?}"),
        };
        // Compares as text, since NaN differs from itself.
        assert_eq!(format!("{motion:?}"), format!("{expected:?}"), "{mask:#b}");
        // A setpoint needs position and heading.
        let needed = bit(0) || bit(1) || bit(2) || bit(10);
        let or_zero = |number: f32| if number.is_nan() { 0.0 } else { number };
        let setpoint = Setpoint {
            position_m: expected.position_m,
            velocity_m_s: expected.velocity_m_s.map(or_zero),
            acceleration_m_s2: expected.acceleration_m_s2.map(or_zero),
            yaw_rad: expected.yaw_rad,
            yaw_rate_rad_s: or_zero(expected.yaw_rate_rad_s),
            ..Setpoint::default()
        };
        assert_eq!(motion.setpoint(), (!needed).then_some(setpoint), "{mask:#b}");
    }
}

#[test]
fn ignored_fields_may_hold_anything() {
    let mut data = target(0b1001_1111_1000);
    (data.vx, data.afy, data.yaw_rate) = (f32::NAN, f32::INFINITY, f32::NAN);
    assert!(read::<Uplink>(&theirs(&data)).is_ok());
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let mut data = target(0);
        data.vx = bad;
        assert_eq!(read::<Uplink>(&theirs(&data)).expect_err("no number").implausible, 1);
    }
}

#[test]
fn targets_in_frames_of_the_vehicle_are_read() {
    use MavFrame as F;
    let axes = |frame, mask| {
        let data = SET_POSITION_TARGET_LOCAL_NED_DATA { coordinate_frame: frame, ..target(mask) };
        match read::<Uplink>(&theirs(&data)) {
            Ok(Uplink::Target(ExternalTarget::Motion(motion))) => Ok(motion.axes),
            Err(counters) => Err(counters.unsupported),
            other => panic!("{other:?}"),
        }
    };
    // The masks select only the velocity, only the position, and both.
    let [velocity, position, both] = [0b1111_1100_0111, 0b1101_1111_1000, 0b1101_1100_0000];
    for mask in [velocity, position, both].map(|mask: u16| mask & !(1 << 9)) {
        assert_eq!(axes(F::MAV_FRAME_LOCAL_OFFSET_NED, mask), Ok(TargetFrame::Offset));
        assert_eq!(axes(F::MAV_FRAME_BODY_OFFSET_NED, mask), Ok(TargetFrame::BodyOffset));
        assert_eq!(axes(F::MAV_FRAME_BODY_FRD, mask), Ok(TargetFrame::BodyOffset));
        let expected = if mask == both { Err(1) } else { Ok(TargetFrame::Body) };
        assert_eq!(axes(F::MAV_FRAME_BODY_NED, mask), expected, "{mask:#b}");
        for frame in [F::MAV_FRAME_LOCAL_ENU, F::MAV_FRAME_GLOBAL, F::MAV_FRAME_LOCAL_FLU] {
            assert_eq!(axes(frame, mask), Err(1));
        }
    }
}

#[test]
fn only_what_is_meant_for_the_vehicle_is_read() {
    for (system, component, mine) in [(1, 1, true), (0, 0, true), (1, 0, true), (2, 1, false), (1, 2, false)] {
        let mut setpoint = target(0);
        (setpoint.target_system, setpoint.target_component) = (system, component);
        let command = COMMAND_LONG_DATA {
            command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
            target_system: system,
            target_component: component,
            ..COMMAND_LONG_DATA::DEFAULT
        };
        let int = COMMAND_INT_DATA {
            command: MavCmd::MAV_CMD_DO_SET_MODE,
            target_system: system,
            target_component: component,
            ..COMMAND_INT_DATA::DEFAULT
        };
        for frame in [theirs(&setpoint), theirs(&command), theirs(&int)] {
            match read::<Uplink>(&frame) {
                Ok(_) => assert!(mine),
                Err(counters) => assert_eq!((mine, counters.elsewhere), (false, 1)),
            }
        }
    }
}

#[test]
fn rotor_speeds_outside_the_scale_are_refused() {
    for control in [-0.1, 1.1, f32::NAN] {
        let mut data = HIL_ACTUATOR_CONTROLS_DATA::default();
        data.controls[2] = control;
        assert_eq!(read::<Downlink>(&theirs(&data)).expect_err("no speed").implausible, 1);
    }
}

const SEVERITIES: [MavSeverity; 8] = [
    MavSeverity::MAV_SEVERITY_EMERGENCY,
    MavSeverity::MAV_SEVERITY_ALERT,
    MavSeverity::MAV_SEVERITY_CRITICAL,
    MavSeverity::MAV_SEVERITY_ERROR,
    MavSeverity::MAV_SEVERITY_WARNING,
    MavSeverity::MAV_SEVERITY_NOTICE,
    MavSeverity::MAV_SEVERITY_INFO,
    MavSeverity::MAV_SEVERITY_DEBUG,
];

proptest! {
    /// Rotor speeds are transmitted exactly.
    #[test]
    fn rotor_speeds_are_exact(speeds in prop::array::uniform8(0.0f32..32_768.0), time_us: u64, armed: bool) {
        let rotors = Downlink::Rotors { time_us, armed, speeds: RotorSpeeds(SVector::from(speeds)) };
        prop_assert_eq!(read(&bytes(&rotors)), Ok(rotors));
    }

    /// Every other message survives writing and reading, except for the rounding of a state (`tests/frames.rs`).
    #[test]
    fn messages_survive_the_link(
        v in prop::array::uniform3(-1e3f32..1e3),
        w in prop::array::uniform3(-1e2f32..1e2),
        n: u32,
        armed: bool,
        failsafe: bool,
        text in "[ -~]{0,50}",
        command in any::<u16>().prop_filter("not ours", |id| !VehicleCommand::KNOWN.contains(id)),
        severity in 0..8usize,
    ) {
        let (a, b) = (v.into(), w.into());
        let setpoint = Setpoint {
            position_m: a,
            velocity_m_s: b,
            acceleration_m_s2: a * 0.1,
            yaw_rad: b.x,
            yaw_rate_rad_s: b.y,
            ..Setpoint::default()
        };
        for message in [
            Uplink::Heartbeat,
            Uplink::Setpoint(setpoint),
            Uplink::Command(VehicleCommand::Arm),
            Uplink::Command(VehicleCommand::Disarm),
            Uplink::Command(VehicleCommand::Engage),
            Uplink::Command(VehicleCommand::SelfTest),
            Uplink::Command(VehicleCommand::Kill),
            Uplink::Command(VehicleCommand::Denied(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM as u16)),
            Uplink::Command(VehicleCommand::Other(command)),
        ] {
            prop_assert_eq!(read(&bytes(&message)), Ok(message));
        }
        for message in [
            Downlink::Heartbeat { armed, failsafe, mode: n },
            Downlink::Attitude { time_ms: n, attitude_rad: a, rates_rad_s: b },
            Downlink::Position { time_ms: n, position_m: a, velocity_m_s: b },
            Downlink::CommandAck { command, answer: CommandResult::Unsupported, to: VEHICLE },
            Downlink::CommandAck { command, answer: CommandResult::Accepted, to: VEHICLE },
            Downlink::CommandAck { command, answer: CommandResult::Refused(n as i32), to: VEHICLE },
            Downlink::CommandAck { command, answer: CommandResult::Denied, to: VEHICLE },
            Downlink::CommandAck { command, answer: CommandResult::Failed, to: VEHICLE },
            Downlink::Text { severity: SEVERITIES[severity], text: text.as_str().into() },
        ] {
            prop_assert_eq!(read(&bytes(&message)), Ok(message));
        }
    }
}
