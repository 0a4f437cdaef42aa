//! Messages to the vehicle.

use crate::address::Address;
use crate::command::{self, VehicleCommand};
use crate::frames::{Odometry, flip, flip_turn};
use crate::interval::DataStream;
use crate::message::{FrameFault, MessageFormat, MessageSet, PAYLOAD_MAX, extension, field, parse, put, put_extended};
use crate::mission::MissionMessage;
use crate::operator::{CHANGE_ID, ControlRequest};
use crate::parameter::ParameterRequest;
use crate::service::ServiceRequest;
use crate::signature::SetupSigning;
use crate::target::{ExternalTarget, PositionTarget, write_motion};
use crate::time::TimeMessage;
use afbc_types::{Pose, PoseSigmas, Setpoint, State};
use mavlink::MessageData;
use mavlink::dialects::common::{
    ATT_POS_MOCAP_DATA, HEARTBEAT_DATA, MavAutopilot, MavFrame, MavModeFlag, MavState, MavType, ODOMETRY_DATA,
    REQUEST_DATA_STREAM_DATA, VISION_POSITION_ESTIMATE_DATA,
};
use nalgebra::Vector3;

/// A message to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Uplink {
    /// HEARTBEAT (0) of a ground station or companion computer.
    Heartbeat,
    /// ODOMETRY (331): the full state, from motion capture, a companion computer or the simulator.
    ///
    /// Supported are the frames MAV_FRAME_LOCAL_NED and MAV_FRAME_LOCAL_FRD with the child frame MAV_FRAME_BODY_FRD.
    /// Other frames are [`FrameFault::Unsupported`], and so is a quality of -1, "odometry has failed". The covariance
    /// of the velocity is ignored.
    State {
        /// Time of the measurement on the sender's clock \[us\].
        sent_us: u64,
        /// Plausible state in the frames of [`afbc_types`].
        state: State,
        /// Standard deviations of the pose, computed from the covariance as for [`Uplink::Pose`].
        sigmas: PoseSigmas,
    },
    /// VISION_POSITION_ESTIMATE (102) or ATT_POS_MOCAP (138): a pose, for vehicles with their own estimator. Written as
    /// ATT_POS_MOCAP.
    ///
    /// There are two standard deviations: one from the largest variance of x, y, z, and one from the largest of roll,
    /// pitch, yaw. Both are unknown if the covariance is missing or begins with NaN. One of them is unknown if its
    /// three variances are all zero, or if one is negative or not finite. The reset counter is ignored.
    Pose {
        /// Time of the measurement on the sender's clock \[us\].
        sent_us: u64,
        /// Plausible pose in the frames of [`afbc_types`].
        pose: Pose,
    },
    /// SET_POSITION_TARGET_LOCAL_NED (84) in MAV_FRAME_LOCAL_NED without ignored numbers. Yaw acceleration, jerk and
    /// snap, which the message lacks, are zero.
    Setpoint(Setpoint),
    /// Any other target, or a pilot's sticks.
    Target(ExternalTarget),
    /// COMMAND_LONG (76), COMMAND_INT (75), SET_MODE (11) or SET_HOME_POSITION (243).
    Command(VehicleCommand),
    /// MISSION_* messages.
    Mission(MissionMessage),
    /// PARAM_REQUEST_LIST, PARAM_REQUEST_READ, PARAM_SET.
    Parameter(ParameterRequest),
    /// TIMESYNC, PING, SYSTEM_TIME.
    Time(TimeMessage),
    /// REQUEST_DATA_STREAM (66).
    Stream(DataStream),
    /// CHANGE_OPERATOR_CONTROL (5).
    Control(ControlRequest),
    /// SETUP_SIGNING (256).
    Signing(SetupSigning),
    /// A request for an optional service.
    ServiceRequest(ServiceRequest),
}

impl MessageSet for Uplink {
    fn format(id: u32) -> Option<MessageFormat> {
        match id {
            HEARTBEAT_DATA::ID => Some(MessageFormat::of::<HEARTBEAT_DATA>(0)),
            ODOMETRY_DATA::ID => Some(MessageFormat::of::<ODOMETRY_DATA>(ODOMETRY_EXTENSION)),
            VISION_POSITION_ESTIMATE_DATA::ID => {
                Some(MessageFormat::of::<VISION_POSITION_ESTIMATE_DATA>(POSE_EXTENSION))
            }
            ATT_POS_MOCAP_DATA::ID => Some(MessageFormat::of::<ATT_POS_MOCAP_DATA>(COVARIANCE)),
            REQUEST_DATA_STREAM_DATA::ID => Some(DataStream::format()),
            CHANGE_ID => Some(ControlRequest::format()),
            SetupSigning::ID => Some(SetupSigning::format()),
            _ => ExternalTarget::format(id)
                .or_else(|| command::format(id))
                .or_else(|| MissionMessage::format(id))
                .or_else(|| TimeMessage::format(id))
                .or_else(|| ParameterRequest::format(id))
                .or_else(|| ServiceRequest::format(id)),
        }
    }

    fn read(id: u32, payload: &[u8], receiver: Address) -> Result<Self, FrameFault> {
        match id {
            HEARTBEAT_DATA::ID => Ok(Uplink::Heartbeat),
            ODOMETRY_DATA::ID => read_odometry(&parse(payload)?, extension::<ODOMETRY_DATA, _>(payload)),
            VISION_POSITION_ESTIMATE_DATA::ID => read_vision(&parse(payload)?, payload),
            ATT_POS_MOCAP_DATA::ID => read_mocap(&parse(payload)?, payload),
            REQUEST_DATA_STREAM_DATA::ID => {
                let (stream, to) = DataStream::read(payload);
                meant_for(receiver, to).map(|()| Uplink::Stream(stream))
            }
            CHANGE_ID => {
                let (control, system) = ControlRequest::read(payload)?;
                meant_for(receiver, Address { system, component: 0 }).map(|()| Uplink::Control(control))
            }
            SetupSigning::ID => {
                let (setup, to) = SetupSigning::read(payload);
                meant_for(receiver, to).map(|()| Uplink::Signing(setup))
            }
            _ if ExternalTarget::format(id).is_some() => {
                match ExternalTarget::read(id, payload, |to| receiver.is_meant_by(to))? {
                    ExternalTarget::Motion(motion) => {
                        Ok(motion.complete().map_or(Uplink::Target(ExternalTarget::Motion(motion)), Uplink::Setpoint))
                    }
                    target => Ok(Uplink::Target(target)),
                }
            }
            _ if command::format(id).is_some() => {
                let (command, to) = command::read(id, payload)?;
                meant_for(receiver, to).map(|()| Uplink::Command(command))
            }
            _ if MissionMessage::format(id).is_some() => {
                let (message, to) = MissionMessage::read(id, payload)?;
                meant_for(receiver, to).map(|()| Uplink::Mission(message))
            }
            // Requests are for everyone. Answers concern only the requester; the caller checks this.
            _ if TimeMessage::format(id).is_some() => TimeMessage::read(id, payload).map(Uplink::Time),
            _ if ServiceRequest::format(id).is_some() => {
                let (request, to) = ServiceRequest::read(id, payload)?;
                meant_for(receiver, to).map(|()| Uplink::ServiceRequest(request))
            }
            _ => {
                let (request, to) = ParameterRequest::read(id, payload)?;
                meant_for(receiver, to).map(|()| Uplink::Parameter(request))
            }
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
            Uplink::Setpoint(setpoint) => write_motion(&PositionTarget::from(setpoint), payload),
            Uplink::Target(target) => target.write(payload),
            Uplink::Command(command) => command::write(*command, payload),
            Uplink::Mission(message) => message.write(Address::default(), payload),
            Uplink::Parameter(request) => request.write(payload),
            Uplink::Time(clock) => clock.write(payload),
            Uplink::Stream(stream) => stream.write(payload),
            Uplink::Control(control) => control.write(payload),
            Uplink::Signing(setup) => setup.write(payload),
            Uplink::ServiceRequest(request) => request.write(payload),
        }
    }
}

/// Returns [`FrameFault::Elsewhere`] if `target` is not `receiver`.
fn meant_for(receiver: Address, target: Address) -> Result<(), FrameFault> {
    if receiver.is_meant_by(target) { Ok(()) } else { Err(FrameFault::Elsewhere) }
}

/// Length of ODOMETRY's extension fields \[bytes\]: reset counter, type of estimator, quality as `i8`.
const ODOMETRY_EXTENSION: usize = 3;

fn read_odometry(data: &ODOMETRY_DATA, extension: [u8; ODOMETRY_EXTENSION]) -> Result<Uplink, FrameFault> {
    let earth = matches!(data.frame_id, MavFrame::MAV_FRAME_LOCAL_NED | MavFrame::MAV_FRAME_LOCAL_FRD);
    let body = data.child_frame_id == MavFrame::MAV_FRAME_BODY_FRD;
    let [_, _, quality] = extension;
    if !earth || !body || quality as i8 == -1 {
        return Err(FrameFault::Unsupported);
    }
    let odometry = Odometry {
        position_m: Vector3::new(data.x, data.y, data.z),
        attitude: data.q,
        velocity_m_s: Vector3::new(data.vx, data.vy, data.vz),
        rates_rad_s: Vector3::new(data.rollspeed, data.pitchspeed, data.yawspeed),
    };
    let state = odometry.to_state().ok_or(FrameFault::Implausible)?;
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

/// Length of a pose's covariance \[bytes\]: the upper triangle of six by six numbers, row by row.
const COVARIANCE: usize = 4 * 21;
/// Length of VISION_POSITION_ESTIMATE's extension fields \[bytes\]: covariance, reset counter.
const POSE_EXTENSION: usize = COVARIANCE + 1;

fn read_vision(data: &VISION_POSITION_ESTIMATE_DATA, payload: &[u8]) -> Result<Uplink, FrameFault> {
    // Checks the angles, since even absurd angles would give a valid quaternion.
    let level = State { attitude_rad: Vector3::new(data.roll, -data.pitch, -data.yaw), ..State::default() };
    if !level.is_plausible() {
        return Err(FrameFault::Implausible);
    }
    let position_m = flip(Vector3::new(data.x, data.y, data.z));
    let sigmas = extended_sigmas::<VISION_POSITION_ESTIMATE_DATA>(payload);
    plausible(data.usec, Pose { position_m, ..Pose::of(&level, sigmas) })
}

fn read_mocap(data: &ATT_POS_MOCAP_DATA, payload: &[u8]) -> Result<Uplink, FrameFault> {
    let position_m = flip(Vector3::new(data.x, data.y, data.z));
    let sigmas = extended_sigmas::<ATT_POS_MOCAP_DATA>(payload);
    plausible(data.time_usec, Pose { position_m, attitude: flip_turn(data.q), sigmas })
}

fn plausible(sent_us: u64, pose: Pose) -> Result<Uplink, FrameFault> {
    if pose.is_plausible() { Ok(Uplink::Pose { sent_us, pose }) } else { Err(FrameFault::Implausible) }
}

fn write_mocap(sent_us: u64, pose: &Pose) -> ATT_POS_MOCAP_DATA {
    let [x, y, z] = flip(pose.position_m).into();
    ATT_POS_MOCAP_DATA { time_usec: sent_us, q: flip_turn(pose.attitude), x, y, z }
}

/// Returns the standard deviations from the covariance at the beginning of the extension fields of `D`.
fn extended_sigmas<D: MessageData>(payload: &[u8]) -> PoseSigmas {
    let number = |place| f32::from_le_bytes(field(payload, D::ENCODED_LEN + 4 * place));
    sigmas(&core::array::from_fn(number))
}

fn sigmas(covariance: &[f32; 21]) -> PoseSigmas {
    let [x, _, _, _, _, _, y, _, _, _, _, z, _, _, _, roll, _, _, pitch, _, yaw] = *covariance;
    if x.is_nan() { PoseSigmas::UNKNOWN } else { PoseSigmas::from_variances([x, y, z], [roll, pitch, yaw]) }
}

/// Returns a diagonal covariance; zeros where the standard deviation is unknown.
fn covariance(sigmas: &PoseSigmas) -> [f32; 21] {
    let [position, attitude] = [sigmas.position_m, sigmas.attitude_rad].map(|sigma| sigma.map_or(0.0, |it| it * it));
    core::array::from_fn(|place| match place {
        0 | 6 | 11 => position,
        15 | 18 | 20 => attitude,
        _ => 0.0,
    })
}
