//! Messages from the vehicle.

use crate::address::Address;
use crate::command_result::{self, CommandResult};
use crate::frames::flip;
use crate::health::{self, HealthArray};
use crate::interval::{DataStream, MessageInterval};
use crate::message::{FrameFault, MessageFormat, MessageSet, PAYLOAD_MAX, parse, put};
use crate::mission::MissionMessage;
use crate::modes::{AvailableMode, CurrentMode};
use crate::operator::{ANSWER_ID, ControlAnswer};
use crate::parameter::{ParameterError, ParameterValue};
use crate::service::ServiceRefusal;
use crate::target::{PositionTarget, followed_format, read_followed, write_followed};
use crate::telemetry::Telemetry;
use crate::time::TimeMessage;
use afbc_types::{ROTORS_MAX, RotorSpeeds};
use mavlink::MessageData;
use mavlink::dialects::common::{
    ATTITUDE_DATA, AVAILABLE_MODES_DATA, COMMAND_ACK_DATA, CURRENT_MODE_DATA, DATA_STREAM_DATA, DEBUG_FLOAT_ARRAY_DATA,
    HEARTBEAT_DATA, HIL_ACTUATOR_CONTROLS_DATA, HilActuatorControlsFlags, LOCAL_POSITION_NED_DATA,
    MESSAGE_INTERVAL_DATA, MavAutopilot, MavModeFlag, MavSeverity, MavState, MavType, PARAM_ERROR_DATA,
    PARAM_VALUE_DATA, POSITION_TARGET_LOCAL_NED_DATA, STATUSTEXT_DATA,
};
use mavlink::types::CharArray;
use nalgebra::{SVector, Vector3};

/// Text of up to 50 bytes.
pub type StatusText = CharArray<50>;

/// A message from the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Downlink {
    /// HEARTBEAT (0) of a quadrotor.
    Heartbeat {
        /// True if the motors may turn.
        armed: bool,
        /// True if a failsafe is active or has just ended: MAV_STATE_CRITICAL.
        failsafe: bool,
        /// Mode of the vehicle: `custom_mode`.
        mode: u32,
    },
    /// HIL_ACTUATOR_CONTROLS (93): commanded rotor speeds. Each control, whose range is -1..1, is omega_i /
    /// [`Downlink::SPEED_FULL_SCALE_RAD_S`]. The full scale is a power of two, so that speeds are not rounded.
    Rotors {
        /// Time since power-up \[us\].
        time_us: u64,
        /// True if the motors may turn.
        armed: bool,
        /// omega_i; 0 for rotors that the vehicle does not have.
        speeds: RotorSpeeds<ROTORS_MAX>,
    },
    /// ATTITUDE (30), in the frames of [`afbc_types`].
    Attitude {
        /// Time since power-up \[ms\].
        time_ms: u32,
        /// Roll, pitch, yaw \[rad\].
        attitude_rad: Vector3<f32>,
        /// p, q, r \[rad/s\].
        rates_rad_s: Vector3<f32>,
    },
    /// LOCAL_POSITION_NED (32), in the frames of [`afbc_types`].
    Position {
        /// Time since power-up \[ms\].
        time_ms: u32,
        /// Position in the earth frame \[m\].
        position_m: Vector3<f32>,
        /// Velocity in the earth frame \[m/s\].
        velocity_m_s: Vector3<f32>,
    },
    /// COMMAND_ACK (77).
    CommandAck {
        /// Number of the answered command.
        command: u16,
        /// The answer.
        answer: CommandResult,
        /// Sender of the command.
        to: Address,
    },
    /// STATUSTEXT (253).
    Text {
        /// Severity.
        severity: MavSeverity,
        /// Text.
        text: StatusText,
    },
    /// DEBUG_FLOAT_ARRAY (350) named "health".
    Health(HealthArray),
    /// Telemetry for display by ground stations.
    Telemetry(Telemetry),
    /// POSITION_TARGET_LOCAL_NED (85): time since power-up \[ms\] and the target that the vehicle follows.
    PositionTarget(u32, PositionTarget),
    /// MISSION_* message to a ground station.
    Mission {
        /// The message.
        message: MissionMessage,
        /// Receiver.
        to: Address,
    },
    /// TIMESYNC, PING, SYSTEM_TIME.
    Time(TimeMessage),
    /// MESSAGE_INTERVAL (244).
    Interval(MessageInterval),
    /// AVAILABLE_MODES (435).
    AvailableMode(AvailableMode),
    /// CURRENT_MODE (436).
    CurrentMode(CurrentMode),
    /// PARAM_VALUE (22).
    Parameter(ParameterValue),
    /// CHANGE_OPERATOR_CONTROL_ACK (6).
    Control(ControlAnswer),
    /// DATA_STREAM (67).
    Stream(DataStream),
    /// PARAM_ERROR (345).
    ParameterError {
        /// The error.
        error: ParameterError,
        /// Address of the requester.
        to: Address,
    },
    /// Refusal of a request for a service that the vehicle does not have.
    Refusal {
        /// The refusal.
        refusal: ServiceRefusal,
        /// Address of the requester, if the message names it.
        to: Address,
    },
}

impl Downlink {
    /// Rotor speed at a control of 1 \[rad/s\].
    pub const SPEED_FULL_SCALE_RAD_S: f32 = 32_768.0;
}

impl MessageSet for Downlink {
    fn format(id: u32) -> Option<MessageFormat> {
        match id {
            HEARTBEAT_DATA::ID => Some(MessageFormat::of::<HEARTBEAT_DATA>(0)),
            HIL_ACTUATOR_CONTROLS_DATA::ID => Some(MessageFormat::of::<HIL_ACTUATOR_CONTROLS_DATA>(0)),
            ATTITUDE_DATA::ID => Some(MessageFormat::of::<ATTITUDE_DATA>(0)),
            LOCAL_POSITION_NED_DATA::ID => Some(MessageFormat::of::<LOCAL_POSITION_NED_DATA>(0)),
            COMMAND_ACK_DATA::ID => Some(command_result::format()),
            STATUSTEXT_DATA::ID => Some(MessageFormat::of::<STATUSTEXT_DATA>(TEXT_EXTENSION)),
            DEBUG_FLOAT_ARRAY_DATA::ID => Some(health::format()),
            POSITION_TARGET_LOCAL_NED_DATA::ID => Some(followed_format()),
            MESSAGE_INTERVAL_DATA::ID => Some(MessageInterval::format()),
            AVAILABLE_MODES_DATA::ID => Some(AvailableMode::format()),
            CURRENT_MODE_DATA::ID => Some(CurrentMode::format()),
            PARAM_VALUE_DATA::ID => Some(ParameterValue::format()),
            ANSWER_ID => Some(ControlAnswer::format()),
            DATA_STREAM_DATA::ID => Some(DataStream::answer_format()),
            PARAM_ERROR_DATA::ID => Some(ParameterError::format()),
            _ => Telemetry::format(id)
                .or_else(|| MissionMessage::format(id))
                .or_else(|| TimeMessage::format(id))
                .or_else(|| ServiceRefusal::format(id)),
        }
    }

    fn read(id: u32, payload: &[u8], _: Address) -> Result<Self, FrameFault> {
        match id {
            HEARTBEAT_DATA::ID => parse(payload).map(read_heartbeat),
            HIL_ACTUATOR_CONTROLS_DATA::ID => read_rotors(&parse(payload)?),
            ATTITUDE_DATA::ID => parse(payload).map(read_attitude),
            LOCAL_POSITION_NED_DATA::ID => parse(payload).map(read_position),
            COMMAND_ACK_DATA::ID => {
                command_result::read(payload).map(|(command, answer, to)| Downlink::CommandAck { command, answer, to })
            }
            STATUSTEXT_DATA::ID => {
                let STATUSTEXT_DATA { severity, text } = parse(payload)?;
                Ok(Downlink::Text { severity, text })
            }
            DEBUG_FLOAT_ARRAY_DATA::ID => health::read(payload).map(Downlink::Health),
            POSITION_TARGET_LOCAL_NED_DATA::ID => {
                read_followed(payload).map(|(time_ms, motion)| Downlink::PositionTarget(time_ms, motion))
            }
            MESSAGE_INTERVAL_DATA::ID => Ok(Downlink::Interval(MessageInterval::read(payload))),
            AVAILABLE_MODES_DATA::ID => Ok(Downlink::AvailableMode(AvailableMode::read(payload))),
            CURRENT_MODE_DATA::ID => Ok(Downlink::CurrentMode(CurrentMode::read(payload))),
            PARAM_VALUE_DATA::ID => Ok(Downlink::Parameter(ParameterValue::read(payload))),
            ANSWER_ID => ControlAnswer::read(payload).map(Downlink::Control),
            DATA_STREAM_DATA::ID => Ok(Downlink::Stream(DataStream::read_answer(payload))),
            PARAM_ERROR_DATA::ID => {
                let (error, to) = ParameterError::read(payload);
                Ok(Downlink::ParameterError { error, to })
            }
            _ if ServiceRefusal::format(id).is_some() => {
                ServiceRefusal::read(id, payload).map(|(refusal, to)| Downlink::Refusal { refusal, to })
            }
            _ if MissionMessage::format(id).is_some() => {
                MissionMessage::read(id, payload).map(|(message, to)| Downlink::Mission { message, to })
            }
            _ if TimeMessage::format(id).is_some() => TimeMessage::read(id, payload).map(Downlink::Time),
            _ => Telemetry::read(id, payload).map(Downlink::Telemetry),
        }
    }

    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            Downlink::Heartbeat { armed, failsafe, mode } => put(&write_heartbeat(*armed, *failsafe, *mode), payload),
            Downlink::Rotors { time_us, armed, speeds } => put(&write_rotors(*time_us, *armed, speeds), payload),
            Downlink::Attitude { time_ms, attitude_rad, rates_rad_s } => {
                let ([roll, pitch, yaw], rates) = (flip(*attitude_rad).into(), flip(*rates_rad_s));
                let [rollspeed, pitchspeed, yawspeed] = rates.into();
                let time_boot_ms = *time_ms;
                put(&ATTITUDE_DATA { time_boot_ms, roll, pitch, yaw, rollspeed, pitchspeed, yawspeed }, payload)
            }
            Downlink::Position { time_ms, position_m, velocity_m_s } => {
                let [x, y, z] = flip(*position_m).into();
                let [vx, vy, vz] = flip(*velocity_m_s).into();
                put(&LOCAL_POSITION_NED_DATA { time_boot_ms: *time_ms, x, y, z, vx, vy, vz }, payload)
            }
            Downlink::CommandAck { command, answer, to } => command_result::write(*command, *answer, *to, payload),
            Downlink::Text { severity, text } => put(&STATUSTEXT_DATA { severity: *severity, text: *text }, payload),
            Downlink::Health(health) => health.write(payload),
            Downlink::Telemetry(telemetry) => telemetry.write(payload),
            Downlink::PositionTarget(time_ms, motion) => write_followed(*time_ms, motion, payload),
            Downlink::Mission { message, to } => message.write(*to, payload),
            Downlink::Time(clock) => clock.write(payload),
            Downlink::Interval(interval) => interval.write(payload),
            Downlink::AvailableMode(mode) => mode.write(payload),
            Downlink::CurrentMode(mode) => mode.write(payload),
            Downlink::Parameter(value) => value.write(payload),
            Downlink::Control(answer) => answer.write(payload),
            Downlink::Stream(stream) => stream.write_answer(payload),
            Downlink::ParameterError { error, to } => error.write(*to, payload),
            Downlink::Refusal { refusal, to } => refusal.write(*to, payload),
        }
    }
}

fn mode_flags(armed: bool) -> MavModeFlag {
    let always = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | MavModeFlag::MAV_MODE_FLAG_GUIDED_ENABLED;
    if armed { always | MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED } else { always }
}

fn read_heartbeat(data: HEARTBEAT_DATA) -> Downlink {
    Downlink::Heartbeat {
        armed: data.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED),
        failsafe: data.system_status == MavState::MAV_STATE_CRITICAL,
        mode: data.custom_mode,
    }
}

fn write_heartbeat(armed: bool, failsafe: bool, mode: u32) -> HEARTBEAT_DATA {
    HEARTBEAT_DATA {
        custom_mode: mode,
        mavtype: MavType::MAV_TYPE_QUADROTOR,
        autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
        base_mode: mode_flags(armed),
        system_status: match (armed, failsafe) {
            (_, true) => MavState::MAV_STATE_CRITICAL,
            (true, false) => MavState::MAV_STATE_ACTIVE,
            (false, false) => MavState::MAV_STATE_STANDBY,
        },
        mavlink_version: 3,
    }
}

fn read_rotors(data: &HIL_ACTUATOR_CONTROLS_DATA) -> Result<Downlink, FrameFault> {
    let [a, b, c, d, e, f, g, h, ..] = data.controls;
    let controls = SVector::from([a, b, c, d, e, f, g, h]);
    if !controls.iter().all(|control| (0.0..=1.0).contains(control)) {
        return Err(FrameFault::Implausible);
    }
    Ok(Downlink::Rotors {
        time_us: data.time_usec,
        armed: data.mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED),
        speeds: RotorSpeeds(controls * Downlink::SPEED_FULL_SCALE_RAD_S),
    })
}

fn write_rotors(time_us: u64, armed: bool, speeds: &RotorSpeeds<ROTORS_MAX>) -> HIL_ACTUATOR_CONTROLS_DATA {
    let mut data = HIL_ACTUATOR_CONTROLS_DATA {
        time_usec: time_us,
        flags: HilActuatorControlsFlags::empty(),
        mode: mode_flags(armed) | MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED,
        ..HIL_ACTUATOR_CONTROLS_DATA::DEFAULT
    };
    for (control, speed) in data.controls.iter_mut().zip(&speeds.0) {
        *control = speed / Downlink::SPEED_FULL_SCALE_RAD_S;
    }
    data
}

fn read_attitude(data: ATTITUDE_DATA) -> Downlink {
    Downlink::Attitude {
        time_ms: data.time_boot_ms,
        attitude_rad: flip(Vector3::new(data.roll, data.pitch, data.yaw)),
        rates_rad_s: flip(Vector3::new(data.rollspeed, data.pitchspeed, data.yawspeed)),
    }
}

fn read_position(data: LOCAL_POSITION_NED_DATA) -> Downlink {
    Downlink::Position {
        time_ms: data.time_boot_ms,
        position_m: flip(Vector3::new(data.x, data.y, data.z)),
        velocity_m_s: flip(Vector3::new(data.vx, data.vy, data.vz)),
    }
}

/// Length of STATUSTEXT's extension fields, which number the parts of longer texts \[bytes\].
const TEXT_EXTENSION: usize = 3;
