//! Messages to the vehicle.

use crate::address::Address;
use crate::frames::{Odometry, flip, flip_turn};
use crate::message::{Fault, Format, Message, PAYLOAD_MAX, extension, field, parse, put, put_extended, put_fields};
use afbc_types::{Pose, PoseSigmas, Setpoint, State};
use mavlink::MessageData;
use mavlink::dialects::common::{
    ATT_POS_MOCAP_DATA, COMMAND_INT_DATA, COMMAND_LONG_DATA, HEARTBEAT_DATA, MavAutopilot, MavCmd, MavFrame,
    MavModeFlag, MavState, MavType, ODOMETRY_DATA, PositionTargetTypemask, SET_POSITION_TARGET_LOCAL_NED_DATA,
    VISION_POSITION_ESTIMATE_DATA,
};
use nalgebra::Vector3;

/// A message to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Uplink {
    /// HEARTBEAT (0) of a ground station or companion computer.
    Heartbeat,
    /// ODOMETRY (331): the full state, from motion capture, a companion computer or the simulator.
    ///
    /// Supported in frame MAV_FRAME_LOCAL_NED or MAV_FRAME_LOCAL_FRD with child frame MAV_FRAME_BODY_FRD, otherwise
    /// [`Fault::Unsupported`]; so is a quality of -1, "odometry has failed". The covariance of the
    /// velocity is ignored.
    State {
        /// Time of the measurement on the sender's clock \[us\].
        sent_us: u64,
        /// Plausible state in the frames of [`afbc_types`].
        state: State,
        /// Standard deviations of its pose, from the covariance as for [`Uplink::Pose`].
        sigmas: PoseSigmas,
    },
    /// VISION_POSITION_ESTIMATE (102) or ATT_POS_MOCAP (138): a pose, for vehicles with an estimate of their own.
    /// Written as ATT_POS_MOCAP.
    ///
    /// Standard deviations are the square roots of the covariance's largest variance of x, y, z, and of roll, pitch,
    /// yaw. Both are unknown if the covariance is missing or begins with NaN; each is if its variances are all zero or
    /// one of them is negative or not finite. The reset counter is ignored.
    Pose {
        /// Time of the measurement on the sender's clock \[us\].
        sent_us: u64,
        /// Plausible pose in the frames of [`afbc_types`].
        pose: Pose,
    },
    /// SET_POSITION_TARGET_LOCAL_NED (84) in MAV_FRAME_LOCAL_NED. The vehicle needs a position and a heading: if
    /// `type_mask` ignores one of x, y, z or yaw, or selects forces, the message is [`Fault::Unsupported`]. Ignored
    /// velocities, accelerations and yaw rate are zero, and so is the yaw acceleration, which the message lacks.
    Setpoint(Setpoint),
    /// COMMAND_LONG (76) or COMMAND_INT (75). Written as COMMAND_LONG.
    Command(Command),
}

/// Request in COMMAND_LONG or COMMAND_INT, answered by [`Downlink::Answer`](crate::Downlink::Answer).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// MAV_CMD_COMPONENT_ARM_DISARM (400) with 1. Forcing it (param2 = 21196) has no effect.
    Arm,
    /// MAV_CMD_COMPONENT_ARM_DISARM (400) with 0.
    Disarm,
    /// MAV_CMD_COMPONENT_ARM_DISARM (400) with 0, forced (param2 = 21196): also in flight.
    Kill,
    /// MAV_CMD_USER_1 (31010): engage AFBC again after its monitor has tripped.
    Engage,
    /// One of these commands, by number, with an invalid parameter: answered with "denied".
    Denied(u16),
    /// Any other command, by number, of any dialect: answered with "unsupported".
    Other(u16),
}

impl Command {
    /// Returns the MAVLink command's number, for its answer.
    pub fn id(self) -> u16 {
        match self {
            Command::Arm | Command::Disarm | Command::Kill => ARM_DISARM,
            Command::Engage => ENGAGE,
            Command::Denied(id) | Command::Other(id) => id,
        }
    }
}

const ARM_DISARM: u16 = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM as u16;
const ENGAGE: u16 = MavCmd::MAV_CMD_USER_1 as u16;

impl Message for Uplink {
    fn format(id: u32) -> Option<Format> {
        match id {
            HEARTBEAT_DATA::ID => Some(Format::of::<HEARTBEAT_DATA>(0)),
            ODOMETRY_DATA::ID => Some(Format::of::<ODOMETRY_DATA>(ODOMETRY_EXTENSION)),
            VISION_POSITION_ESTIMATE_DATA::ID => Some(Format::of::<VISION_POSITION_ESTIMATE_DATA>(POSE_EXTENSION)),
            ATT_POS_MOCAP_DATA::ID => Some(Format::of::<ATT_POS_MOCAP_DATA>(COVARIANCE)),
            SET_POSITION_TARGET_LOCAL_NED_DATA::ID => Some(Format::of::<SET_POSITION_TARGET_LOCAL_NED_DATA>(0)),
            COMMAND_LONG_DATA::ID => Some(Format::of::<COMMAND_LONG_DATA>(0)),
            COMMAND_INT_DATA::ID => Some(Format::of::<COMMAND_INT_DATA>(0)),
            _ => None,
        }
    }

    fn read(id: u32, payload: &[u8], receiver: Address) -> Result<Self, Fault> {
        match id {
            HEARTBEAT_DATA::ID => Ok(Uplink::Heartbeat),
            ODOMETRY_DATA::ID => read_odometry(&parse(payload)?, extension::<ODOMETRY_DATA, _>(payload)),
            VISION_POSITION_ESTIMATE_DATA::ID => read_vision(&parse(payload)?, payload),
            ATT_POS_MOCAP_DATA::ID => read_mocap(&parse(payload)?, payload),
            SET_POSITION_TARGET_LOCAL_NED_DATA::ID => read_setpoint(&parse(payload)?, receiver),
            COMMAND_LONG_DATA::ID | COMMAND_INT_DATA::ID => read_command(payload, receiver),
            _ => Err(Fault::Unknown),
        }
    }

    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            Uplink::Heartbeat => put(
                &HEARTBEAT_DATA {
                    custom_mode: 0,
                    mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
                    autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
                    base_mode: MavModeFlag::empty(),
                    system_status: MavState::MAV_STATE_ACTIVE,
                    mavlink_version: 3,
                },
                payload,
            ),
            Uplink::State { sent_us, state, sigmas } => put(&write_odometry(*sent_us, state, sigmas), payload),
            Uplink::Pose { sent_us, pose } => {
                let covariance = covariance(&pose.sigmas).into_iter().flat_map(f32::to_le_bytes);
                put_extended(&write_mocap(*sent_us, pose), covariance, payload)
            }
            Uplink::Setpoint(setpoint) => put(&write_setpoint(setpoint), payload),
            Uplink::Command(command) => put_fields(COMMAND_LONG_DATA::ID, write_command(*command), payload),
        }
    }
}

/// Returns [`Fault::Elsewhere`] if the message's target is not `receiver`.
fn meant_for(receiver: Address, system: u8, component: u8) -> Result<(), Fault> {
    if receiver.is_meant_by(Address { system, component }) { Ok(()) } else { Err(Fault::Elsewhere) }
}

/// Extension fields of ODOMETRY: reset counter, type of the estimator, quality as `i8`.
const ODOMETRY_EXTENSION: usize = 3;

fn read_odometry(data: &ODOMETRY_DATA, extension: [u8; ODOMETRY_EXTENSION]) -> Result<Uplink, Fault> {
    let earth = matches!(data.frame_id, MavFrame::MAV_FRAME_LOCAL_NED | MavFrame::MAV_FRAME_LOCAL_FRD);
    let body = data.child_frame_id == MavFrame::MAV_FRAME_BODY_FRD;
    let [_, _, quality] = extension;
    if !earth || !body || quality as i8 == -1 {
        return Err(Fault::Unsupported);
    }
    let odometry = Odometry {
        position_m: Vector3::new(data.x, data.y, data.z),
        attitude: data.q,
        velocity_m_s: Vector3::new(data.vx, data.vy, data.vz),
        rates_rad_s: Vector3::new(data.rollspeed, data.pitchspeed, data.yawspeed),
    };
    let state = odometry.to_state().ok_or(Fault::Implausible)?;
    Ok(Uplink::State { sent_us: data.time_usec, state, sigmas: sigmas(&data.pose_covariance) })
}

fn write_odometry(sent_us: u64, state: &State, sigmas: &PoseSigmas) -> ODOMETRY_DATA {
    let odometry = Odometry::from_state(state);
    let mut data = ODOMETRY_DATA {
        time_usec: sent_us,
        frame_id: MavFrame::MAV_FRAME_LOCAL_NED,
        child_frame_id: MavFrame::MAV_FRAME_BODY_FRD,
        q: odometry.attitude,
        pose_covariance: covariance(sigmas),
        ..ODOMETRY_DATA::DEFAULT
    };
    [data.x, data.y, data.z] = odometry.position_m.into();
    [data.vx, data.vy, data.vz] = odometry.velocity_m_s.into();
    [data.rollspeed, data.pitchspeed, data.yawspeed] = odometry.rates_rad_s.into();
    data
}

/// Bytes of the covariance of a pose: the upper triangle of six by six numbers, row by row.
const COVARIANCE: usize = 4 * 21;
/// Extension fields of VISION_POSITION_ESTIMATE: covariance, reset counter.
const POSE_EXTENSION: usize = COVARIANCE + 1;

fn read_vision(data: &VISION_POSITION_ESTIMATE_DATA, payload: &[u8]) -> Result<Uplink, Fault> {
    let level = State { attitude_rad: Vector3::new(data.roll, -data.pitch, -data.yaw), ..State::default() };
    if !level.is_plausible() {
        return Err(Fault::Implausible);
    }
    let position_m = flip(Vector3::new(data.x, data.y, data.z));
    let sigmas = extended_sigmas::<VISION_POSITION_ESTIMATE_DATA>(payload);
    plausible(data.usec, Pose { position_m, ..Pose::of(&level, sigmas) })
}

fn read_mocap(data: &ATT_POS_MOCAP_DATA, payload: &[u8]) -> Result<Uplink, Fault> {
    let position_m = flip(Vector3::new(data.x, data.y, data.z));
    let sigmas = extended_sigmas::<ATT_POS_MOCAP_DATA>(payload);
    plausible(data.time_usec, Pose { position_m, attitude: flip_turn(data.q), sigmas })
}

fn plausible(sent_us: u64, pose: Pose) -> Result<Uplink, Fault> {
    if pose.is_plausible() { Ok(Uplink::Pose { sent_us, pose }) } else { Err(Fault::Implausible) }
}

fn write_mocap(sent_us: u64, pose: &Pose) -> ATT_POS_MOCAP_DATA {
    let [x, y, z] = flip(pose.position_m).into();
    ATT_POS_MOCAP_DATA { time_usec: sent_us, q: flip_turn(pose.attitude), x, y, z }
}

/// Returns the standard deviations in the covariance with which the extension fields of `D` begin.
fn extended_sigmas<D: MessageData>(payload: &[u8]) -> PoseSigmas {
    let number = |place| f32::from_le_bytes(field(payload, D::ENCODED_LEN + 4 * place));
    sigmas(&core::array::from_fn(number))
}

fn sigmas(covariance: &[f32; 21]) -> PoseSigmas {
    let [x, _, _, _, _, _, y, _, _, _, _, z, _, _, _, roll, _, _, pitch, _, yaw] = *covariance;
    if x.is_nan() { PoseSigmas::UNKNOWN } else { PoseSigmas::from_variances([x, y, z], [roll, pitch, yaw]) }
}

/// Returns a diagonal covariance; zeros stand for what is unknown.
fn covariance(sigmas: &PoseSigmas) -> [f32; 21] {
    let [position, attitude] = [sigmas.position_m, sigmas.attitude_rad].map(|sigma| sigma.map_or(0.0, |it| it * it));
    core::array::from_fn(|place| match place {
        0 | 6 | 11 => position,
        15 | 18 | 20 => attitude,
        _ => 0.0,
    })
}

fn read_setpoint(data: &SET_POSITION_TARGET_LOCAL_NED_DATA, receiver: Address) -> Result<Uplink, Fault> {
    use PositionTargetTypemask as Mask;
    meant_for(receiver, data.target_system, data.target_component)?;
    let needed = Mask::POSITION_TARGET_TYPEMASK_X_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_Y_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_Z_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_YAW_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_FORCE_SET;
    if data.coordinate_frame != MavFrame::MAV_FRAME_LOCAL_NED || data.type_mask.intersects(needed) {
        return Err(Fault::Unsupported);
    }
    let unless = |ignored: Mask, value: f32| if data.type_mask.contains(ignored) { 0.0 } else { value };
    let setpoint = Setpoint {
        position_m: flip(Vector3::new(data.x, data.y, data.z)),
        velocity_m_s: flip(Vector3::new(
            unless(Mask::POSITION_TARGET_TYPEMASK_VX_IGNORE, data.vx),
            unless(Mask::POSITION_TARGET_TYPEMASK_VY_IGNORE, data.vy),
            unless(Mask::POSITION_TARGET_TYPEMASK_VZ_IGNORE, data.vz),
        )),
        acceleration_m_s2: flip(Vector3::new(
            unless(Mask::POSITION_TARGET_TYPEMASK_AX_IGNORE, data.afx),
            unless(Mask::POSITION_TARGET_TYPEMASK_AY_IGNORE, data.afy),
            unless(Mask::POSITION_TARGET_TYPEMASK_AZ_IGNORE, data.afz),
        )),
        yaw_rad: -data.yaw,
        yaw_rate_rad_s: -unless(Mask::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE, data.yaw_rate),
        // The message has no jerk, snap or angular acceleration.
        ..Setpoint::default()
    };
    if setpoint.is_plausible() { Ok(Uplink::Setpoint(setpoint)) } else { Err(Fault::Implausible) }
}

fn write_setpoint(setpoint: &Setpoint) -> SET_POSITION_TARGET_LOCAL_NED_DATA {
    let mut data = SET_POSITION_TARGET_LOCAL_NED_DATA {
        yaw: -setpoint.yaw_rad,
        yaw_rate: -setpoint.yaw_rate_rad_s,
        type_mask: PositionTargetTypemask::empty(),
        coordinate_frame: MavFrame::MAV_FRAME_LOCAL_NED,
        ..SET_POSITION_TARGET_LOCAL_NED_DATA::DEFAULT
    };
    [data.x, data.y, data.z] = flip(setpoint.position_m).into();
    [data.vx, data.vy, data.vz] = flip(setpoint.velocity_m_s).into();
    [data.afx, data.afy, data.afz] = flip(setpoint.acceleration_m_s2).into();
    data
}

/// Value of param2 of MAV_CMD_COMPONENT_ARM_DISARM that forces it.
const FORCED: f32 = 21196.0;

/// Offsets of the fields used, equal in COMMAND_LONG and COMMAND_INT: two parameters, number, target. By hand, since
/// the `mavlink` crate rejects commands that its dialect does not define.
const COMMAND_FIELDS: [usize; 4] = [0, 4, 28, 30];

fn read_command(payload: &[u8], receiver: Address) -> Result<Uplink, Fault> {
    let [param1_at, param2_at, id_at, target_at] = COMMAND_FIELDS;
    let [system, component] = field(payload, target_at);
    meant_for(receiver, system, component)?;
    let param1 = f32::from_le_bytes(field(payload, param1_at));
    let forced = f32::from_le_bytes(field(payload, param2_at)) == FORCED;
    let command = match u16::from_le_bytes(field(payload, id_at)) {
        ARM_DISARM if param1 == 1.0 => Command::Arm,
        ARM_DISARM if param1 == 0.0 && forced => Command::Kill,
        ARM_DISARM if param1 == 0.0 => Command::Disarm,
        ARM_DISARM => Command::Denied(ARM_DISARM),
        ENGAGE => Command::Engage,
        other => Command::Other(other),
    };
    Ok(Uplink::Command(command))
}

/// Returns the fields of COMMAND_LONG: seven parameters, number, target (all) and confirmation.
fn write_command(command: Command) -> impl Iterator<Item = u8> {
    let [param1, param2] = match command {
        Command::Arm => [1.0, 0.0],
        Command::Kill => [0.0, FORCED],
        Command::Denied(_) => [f32::NAN, 0.0],
        Command::Disarm | Command::Engage | Command::Other(_) => [0.0; 2],
    };
    let parameters = [param1, param2, 0.0, 0.0, 0.0, 0.0, 0.0].into_iter().flat_map(f32::to_le_bytes);
    parameters.chain(command.id().to_le_bytes())
}
