//! Messages from the vehicle.

use crate::address::Address;
use crate::decoder::Counters;
use crate::frames::flip;
use crate::message::{Fault, Format, Message, PAYLOAD_MAX, extension, field, parse, put, put_extended, put_fields};
use afbc_types::{Axis, PerAxis, ROTORS_MAX, RotorSpeeds};
use mavlink::MessageData;
use mavlink::dialects::common::{
    ATTITUDE_DATA, COMMAND_ACK_DATA, DEBUG_FLOAT_ARRAY_DATA, HEARTBEAT_DATA, HIL_ACTUATOR_CONTROLS_DATA,
    HilActuatorControlsFlags, LOCAL_POSITION_NED_DATA, MavAutopilot, MavModeFlag, MavResult, MavSeverity, MavState,
    MavType, STATUSTEXT_DATA,
};
use mavlink::types::CharArray;
use nalgebra::{SVector, Vector3};

/// Text of up to 50 bytes.
pub type Text = CharArray<50>;

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
        /// The vehicle's mode, its `custom_mode`.
        mode: u32,
    },
    /// HIL_ACTUATOR_CONTROLS (93): commanded rotor speeds. The message's range is -1..1: each control is omega_i /
    /// [`Downlink::SPEED_FULL_SCALE_RAD_S`], a power of two, so that the speed is transmitted without rounding.
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
    Answer {
        /// Number of the command that is answered.
        command: u16,
        /// The answer.
        answer: Answer,
        /// Sender of the command.
        to: Address,
    },
    /// STATUSTEXT (253).
    Text {
        /// Severity.
        severity: MavSeverity,
        /// Text.
        text: Text,
    },
    /// DEBUG_FLOAT_ARRAY (350) named "health".
    Health(Health),
}

/// An answer to a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Answer {
    /// Carried out.
    Accepted,
    /// Refused for now, with the number of the reason in `result_param2`.
    Refused(i32),
    /// Invalid parameters.
    Denied,
    /// Unknown command.
    Unsupported,
    /// Outcome unknown.
    Failed,
}

/// State of the flight core and the link, in the order of the array's elements. Counts are sent as `f32`, exact up to
/// 2^24.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Health {
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Duration of the last control tick \[us\].
    pub tick_us: f32,
    /// Longest duration of a control tick so far \[us\].
    pub tick_max_us: f32,
    /// Ticks in the last second \[Hz\].
    pub rate_hz: f32,
    /// Ticks since power-up that came late or early.
    pub late_ticks: u32,
    /// Ticks in which a rotor was commanded a force outside its limits.
    pub saturated_ticks: u32,
    /// Age of the newest state \[us\].
    pub state_age_us: f32,
    /// Norm of each subsystem's Theta_hat.
    pub theta_norm: PerAxis<f32>,
    /// Each subsystem's delta_hat.
    pub delta: PerAxis<f32>,
    /// Reception counts of the link.
    pub link: Counters,
    /// Commands since power-up that were not answered, because more arrived at once than could be answered.
    pub unanswered: u32,
    /// States that were not used.
    pub states_refused: StatesRefused,
}

/// States since power-up that were not used, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StatesRefused {
    /// Out of order or duplicate.
    pub overtaken: u32,
    /// Too old on arrival.
    pub late: u32,
    /// From another sender than the one in use.
    pub elsewhere: u32,
    /// Repeating the last one in flight, or from a tracker that is no longer trusted.
    pub frozen: u32,
}

impl Downlink {
    /// Rotor speed at a control of 1 \[rad/s\].
    pub const SPEED_FULL_SCALE_RAD_S: f32 = 32_768.0;
}

impl Message for Downlink {
    fn format(id: u32) -> Option<Format> {
        match id {
            HEARTBEAT_DATA::ID => Some(Format::of::<HEARTBEAT_DATA>(0)),
            HIL_ACTUATOR_CONTROLS_DATA::ID => Some(Format::of::<HIL_ACTUATOR_CONTROLS_DATA>(0)),
            ATTITUDE_DATA::ID => Some(Format::of::<ATTITUDE_DATA>(0)),
            LOCAL_POSITION_NED_DATA::ID => Some(Format::of::<LOCAL_POSITION_NED_DATA>(0)),
            COMMAND_ACK_DATA::ID => Some(Format::of::<COMMAND_ACK_DATA>(ANSWER_EXTENSION)),
            STATUSTEXT_DATA::ID => Some(Format::of::<STATUSTEXT_DATA>(TEXT_EXTENSION)),
            DEBUG_FLOAT_ARRAY_DATA::ID => Some(Format::of::<DEBUG_FLOAT_ARRAY_DATA>(4 * HEALTH_ELEMENTS)),
            _ => None,
        }
    }

    fn read(id: u32, payload: &[u8], _: Address) -> Result<Self, Fault> {
        match id {
            HEARTBEAT_DATA::ID => parse(payload).map(read_heartbeat),
            HIL_ACTUATOR_CONTROLS_DATA::ID => read_rotors(&parse(payload)?),
            ATTITUDE_DATA::ID => parse(payload).map(read_attitude),
            LOCAL_POSITION_NED_DATA::ID => parse(payload).map(read_position),
            COMMAND_ACK_DATA::ID => read_answer(payload),
            STATUSTEXT_DATA::ID => {
                let STATUSTEXT_DATA { severity, text } = parse(payload)?;
                Ok(Downlink::Text { severity, text })
            }
            DEBUG_FLOAT_ARRAY_DATA::ID => {
                read_health(&parse(payload)?, extension::<DEBUG_FLOAT_ARRAY_DATA, _>(payload))
            }
            _ => Err(Fault::Unknown),
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
            Downlink::Answer { command, answer, to } => {
                put_fields(COMMAND_ACK_DATA::ID, write_answer(*command, *answer, *to), payload)
            }
            Downlink::Text { severity, text } => put(&STATUSTEXT_DATA { severity: *severity, text: *text }, payload),
            Downlink::Health(health) => {
                let data = DEBUG_FLOAT_ARRAY_DATA { time_usec: health.time_us, array_id: 0, name: HEALTH.into() };
                put_extended(&data, health.elements().flat_map(f32::to_le_bytes), payload)
            }
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

fn read_rotors(data: &HIL_ACTUATOR_CONTROLS_DATA) -> Result<Downlink, Fault> {
    let [a, b, c, d, e, f, g, h, ..] = data.controls;
    let controls = SVector::from([a, b, c, d, e, f, g, h]);
    if !controls.iter().all(|control| (0.0..=1.0).contains(control)) {
        return Err(Fault::Implausible);
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

/// Extension fields of COMMAND_ACK: progress, `result_param2` as `i32`, target system and component.
const ANSWER_EXTENSION: usize = 7;
const ANSWER_FIELDS: usize = COMMAND_ACK_DATA::ENCODED_LEN + ANSWER_EXTENSION;
/// Extension fields of STATUSTEXT, which number the parts of longer texts.
const TEXT_EXTENSION: usize = 3;
/// Elements of DEBUG_FLOAT_ARRAY, its only extension field.
const HEALTH_ELEMENTS: usize = 58;
const HEALTH: &str = "health";

/// Reads command, result, progress, `result_param2` and target. By hand, since the `mavlink` crate rejects commands
/// that its dialect does not define.
fn read_answer(payload: &[u8]) -> Result<Downlink, Fault> {
    let [low, high, result, _, reason @ .., system, component]: [u8; ANSWER_FIELDS] = field(payload, 0);
    let answer = match result {
        ACCEPTED => Answer::Accepted,
        REFUSED => Answer::Refused(i32::from_le_bytes(reason)),
        DENIED => Answer::Denied,
        UNSUPPORTED => Answer::Unsupported,
        FAILED => Answer::Failed,
        _ => return Err(Fault::Unsupported),
    };
    let command = u16::from_le_bytes([low, high]);
    Ok(Downlink::Answer { command, answer, to: Address { system, component } })
}

fn write_answer(command: u16, answer: Answer, to: Address) -> [u8; ANSWER_FIELDS] {
    let (result, reason) = match answer {
        Answer::Accepted => (ACCEPTED, 0),
        Answer::Refused(reason) => (REFUSED, reason),
        Answer::Denied => (DENIED, 0),
        Answer::Unsupported => (UNSUPPORTED, 0),
        Answer::Failed => (FAILED, 0),
    };
    let ([low, high], [a, b, c, d]) = (command.to_le_bytes(), reason.to_le_bytes());
    [low, high, result, 0, a, b, c, d, to.system, to.component]
}

const ACCEPTED: u8 = MavResult::MAV_RESULT_ACCEPTED as u8;
const REFUSED: u8 = MavResult::MAV_RESULT_TEMPORARILY_REJECTED as u8;
const DENIED: u8 = MavResult::MAV_RESULT_DENIED as u8;
const UNSUPPORTED: u8 = MavResult::MAV_RESULT_UNSUPPORTED as u8;
const FAILED: u8 = MavResult::MAV_RESULT_FAILED as u8;

fn read_health(data: &DEBUG_FLOAT_ARRAY_DATA, extension: [u8; 4 * HEALTH_ELEMENTS]) -> Result<Downlink, Fault> {
    if data.name.to_str() != Ok(HEALTH) {
        return Err(Fault::Unsupported);
    }
    let (elements, _) = extension.as_chunks();
    let mut elements = elements.iter().map(|bytes| f32::from_le_bytes(*bytes));
    let mut next = || elements.next().unwrap_or_default();
    Ok(Downlink::Health(Health {
        time_us: data.time_usec,
        tick_us: next(),
        tick_max_us: next(),
        rate_hz: next(),
        late_ticks: next() as u32,
        saturated_ticks: next() as u32,
        state_age_us: next(),
        theta_norm: PerAxis::from_fn(|_| next()),
        delta: PerAxis::from_fn(|_| next()),
        link: Counters::from_array(core::array::from_fn(|_| next() as u32)),
        unanswered: next() as u32,
        states_refused: StatesRefused {
            overtaken: next() as u32,
            late: next() as u32,
            elsewhere: next() as u32,
            frozen: next() as u32,
        },
    }))
}

impl Health {
    /// Returns the array's elements.
    fn elements(&self) -> impl Iterator<Item = f32> {
        let Health { tick_us, tick_max_us, rate_hz, late_ticks, saturated_ticks, state_age_us, .. } = *self;
        let ticks = [tick_us, tick_max_us, rate_hz, late_ticks as f32, saturated_ticks as f32, state_age_us];
        let estimates = [self.theta_norm, self.delta].map(|estimate| Axis::ALL.map(|axis| estimate[axis]));
        let StatesRefused { overtaken, late, elsewhere, frozen } = self.states_refused;
        let counts = self.link.to_array().into_iter().chain([self.unanswered, overtaken, late, elsewhere, frozen]);
        ticks.into_iter().chain(estimates.into_iter().flatten()).chain(counts.map(|count| count as f32))
    }
}
