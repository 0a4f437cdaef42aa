//! Commands, each of which is answered.

mod read;
mod write;

use crate::global_position::{GlobalPosition, Height};
use mavlink::dialects::common::MavCmd;
pub(crate) use read::{format, read};
pub(crate) use write::write;

/// A command, answered by [`Downlink::CommandAck`](crate::Downlink::CommandAck). It arrives as COMMAND_LONG (76),
/// COMMAND_INT (75), SET_MODE (11) or SET_HOME_POSITION (243).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VehicleCommand {
    /// MAV_CMD_COMPONENT_ARM_DISARM (400) with 1. Arming cannot be forced.
    Arm,
    /// MAV_CMD_COMPONENT_ARM_DISARM (400) with 0.
    Disarm,
    /// MAV_CMD_COMPONENT_ARM_DISARM (400) with 0, forced (param2 = 21196): stops the motors, even in flight.
    Kill,
    /// MAV_CMD_USER_1 (31010): engage AFBC again after its monitor has tripped.
    Engage,
    /// MAV_CMD_USER_2 (31011): run the sensors' self-tests.
    SelfTest,
    /// MAV_CMD_NAV_TAKEOFF (22) at the vehicle's position. In COMMAND_LONG, which has no frame, the height counts from
    /// the vehicle's position; there, NaN or 0 means the height in the parameters.
    TakeOff(Height),
    /// MAV_CMD_NAV_LAND (21) at the vehicle's position.
    Land,
    /// MAV_CMD_NAV_RETURN_TO_LAUNCH (20).
    Return,
    /// MAV_CMD_DO_SET_MODE (176) or SET_MODE, with a custom mode as in HEARTBEAT. The command has its main mode in
    /// param2 and its sub mode in param3.
    SelectMode(u32),
    /// MAV_CMD_DO_SET_STANDARD_MODE (262).
    SelectStandardMode(u8),
    /// MAV_CMD_DO_REPOSITION (192).
    Reposition {
        /// Destination.
        place: GlobalPosition,
        /// Heading; NaN keeps the present one \[rad\].
        yaw_rad: f32,
        /// Horizontal speed; none for the default \[m/s\].
        speed_m_s: Option<f32>,
        /// True if the vehicle may change its mode (MAV_DO_REPOSITION_FLAGS_CHANGE_MODE).
        changes_mode: bool,
    },
    /// MAV_CMD_DO_ORBIT (34).
    Orbit {
        /// Centre of the circle, with the height of the flight.
        place: GlobalPosition,
        /// Radius, positive for clockwise; NaN for the default \[m\].
        radius_m: f32,
        /// Speed along the circle; NaN for the default \[m/s\].
        speed_m_s: f32,
        /// Angle to fly; 0 to fly without end \[deg\].
        angle_deg: u16,
        /// `ORBIT_YAW_BEHAVIOUR`, except the one that leaves yaw to radio control.
        heading: u8,
    },
    /// MAV_CMD_DO_CHANGE_SPEED (178): horizontal speed \[m/s\].
    Speed(f32),
    /// MAV_CMD_DO_SET_HOME (179) or SET_HOME_POSITION; none for the vehicle's present position.
    Home(Option<GlobalPosition>),
    /// MAV_CMD_MISSION_START (300): number of the first item and of the last; none for the end of the mission.
    StartMission(u16, Option<u16>),
    /// MAV_CMD_DO_SET_MISSION_CURRENT (224): item number, none for the present item; true resets the mission.
    SetCurrent(Option<u16>, bool),
    /// MAV_CMD_SET_MESSAGE_INTERVAL (511).
    SetInterval {
        /// Id of the message.
        message: u32,
        /// Interval; 0: the default, -1: never \[us\].
        interval_us: i32,
    },
    /// MAV_CMD_GET_MESSAGE_INTERVAL (510).
    GetInterval(u32),
    /// MAV_CMD_REQUEST_MESSAGE (512).
    RequestMessage {
        /// Id of the message.
        message: u32,
        /// Second parameter of the command, which some messages use.
        index: u32,
    },
    /// MAV_CMD_REQUEST_PROTOCOL_VERSION (519).
    RequestProtocol,
    /// MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES (520).
    RequestCapabilities,
    /// MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN (246).
    Reboot(Reboot),
    /// MAV_CMD_PREFLIGHT_STORAGE (245) of the parameters.
    Storage(Storage),
    /// MAV_CMD_PREFLIGHT_CALIBRATION (241), one calibration at a time.
    Calibrate(CalibrationRequest),
    /// MAV_CMD_RUN_PREARM_CHECKS (401).
    CheckArming,
    /// MAV_CMD_LOGGING_START (2510) in the format ULog (param1 = 0).
    StartLogStream,
    /// MAV_CMD_LOGGING_STOP (2511).
    StopLogStream,
    /// One of the commands above, by number, with an invalid parameter. It is answered with "denied".
    Denied(u16),
    /// Any other command of any dialect, by number. It is answered with "unsupported".
    Other(u16),
}

/// Program to run after a reboot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reboot {
    /// The same program (param1 = 1).
    Program,
    /// The boot loader, which waits for a new program (param1 = 3).
    BootLoader,
}

/// Action on the stored parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Storage {
    /// Read the stored parameters.
    Load,
    /// Store the parameters.
    Save,
    /// Restore the defaults.
    Reset,
}

/// Calibration to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CalibrationRequest {
    /// The gyroscope (param1 = 1).
    Gyroscope,
    /// The magnetometer (param2 = 1).
    Magnetometer,
    /// The accelerometer, on six sides (param5 = 1).
    Accelerometer,
    /// The level mounting of the inertial sensor (param5 = 2).
    Level,
    /// Cancels a running calibration (all parameters 0).
    Cancel,
}

pub(crate) const RETURN: u16 = MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH as u16;
pub(crate) const LAND: u16 = MavCmd::MAV_CMD_NAV_LAND as u16;
pub(crate) const TAKE_OFF: u16 = MavCmd::MAV_CMD_NAV_TAKEOFF as u16;
pub(crate) const ORBIT: u16 = MavCmd::MAV_CMD_DO_ORBIT as u16;
pub(crate) const SELECT_MODE: u16 = MavCmd::MAV_CMD_DO_SET_MODE as u16;
pub(crate) const SPEED: u16 = MavCmd::MAV_CMD_DO_CHANGE_SPEED as u16;
pub(crate) const HOME: u16 = MavCmd::MAV_CMD_DO_SET_HOME as u16;
pub(crate) const REPOSITION: u16 = MavCmd::MAV_CMD_DO_REPOSITION as u16;
pub(crate) const SET_CURRENT: u16 = MavCmd::MAV_CMD_DO_SET_MISSION_CURRENT as u16;
pub(crate) const CALIBRATE: u16 = MavCmd::MAV_CMD_PREFLIGHT_CALIBRATION as u16;
pub(crate) const STORAGE: u16 = MavCmd::MAV_CMD_PREFLIGHT_STORAGE as u16;
pub(crate) const REBOOT: u16 = MavCmd::MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN as u16;
pub(crate) const SELECT_STANDARD_MODE: u16 = MavCmd::MAV_CMD_DO_SET_STANDARD_MODE as u16;
pub(crate) const START_MISSION: u16 = MavCmd::MAV_CMD_MISSION_START as u16;
pub(crate) const ARM_DISARM: u16 = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM as u16;
pub(crate) const CHECK_ARMING: u16 = MavCmd::MAV_CMD_RUN_PREARM_CHECKS as u16;
pub(crate) const GET_INTERVAL: u16 = MavCmd::MAV_CMD_GET_MESSAGE_INTERVAL as u16;
pub(crate) const SET_INTERVAL: u16 = MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL as u16;
pub(crate) const REQUEST_MESSAGE: u16 = MavCmd::MAV_CMD_REQUEST_MESSAGE as u16;
pub(crate) const REQUEST_PROTOCOL: u16 = MavCmd::MAV_CMD_REQUEST_PROTOCOL_VERSION as u16;
pub(crate) const REQUEST_CAPABILITIES: u16 = MavCmd::MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES as u16;
pub(crate) const START_LOG_STREAM: u16 = MavCmd::MAV_CMD_LOGGING_START as u16;
pub(crate) const STOP_LOG_STREAM: u16 = MavCmd::MAV_CMD_LOGGING_STOP as u16;
pub(crate) const ENGAGE: u16 = MavCmd::MAV_CMD_USER_1 as u16;
pub(crate) const SELF_TEST: u16 = MavCmd::MAV_CMD_USER_2 as u16;

/// Value of param2 of MAV_CMD_COMPONENT_ARM_DISARM that forces the command.
pub(crate) const FORCED: f32 = 21196.0;
/// Bit of `base_mode` that makes the custom mode valid.
pub(crate) const CUSTOM_MODE: u32 = 1;
/// Value for the default, in MAV_CMD_DO_REPOSITION and MAV_CMD_DO_CHANGE_SPEED.
pub(crate) const USUAL: f32 = -1.0;

impl VehicleCommand {
    /// Numbers of the supported commands.
    pub const KNOWN: [u16; 25] = [
        RETURN,
        LAND,
        TAKE_OFF,
        ORBIT,
        SELECT_MODE,
        SPEED,
        HOME,
        REPOSITION,
        SET_CURRENT,
        CALIBRATE,
        STORAGE,
        REBOOT,
        SELECT_STANDARD_MODE,
        START_MISSION,
        ARM_DISARM,
        CHECK_ARMING,
        GET_INTERVAL,
        SET_INTERVAL,
        REQUEST_MESSAGE,
        REQUEST_PROTOCOL,
        REQUEST_CAPABILITIES,
        START_LOG_STREAM,
        STOP_LOG_STREAM,
        ENGAGE,
        SELF_TEST,
    ];

    /// Returns the number of the MAVLink command, for its answer.
    pub const fn id(self) -> u16 {
        match self {
            VehicleCommand::Arm | VehicleCommand::Disarm | VehicleCommand::Kill => ARM_DISARM,
            VehicleCommand::Engage => ENGAGE,
            VehicleCommand::SelfTest => SELF_TEST,
            VehicleCommand::TakeOff(_) => TAKE_OFF,
            VehicleCommand::Land => LAND,
            VehicleCommand::Return => RETURN,
            VehicleCommand::SelectMode(_) => SELECT_MODE,
            VehicleCommand::SelectStandardMode(_) => SELECT_STANDARD_MODE,
            VehicleCommand::Reposition { .. } => REPOSITION,
            VehicleCommand::Orbit { .. } => ORBIT,
            VehicleCommand::Speed(_) => SPEED,
            VehicleCommand::Home(_) => HOME,
            VehicleCommand::StartMission(..) => START_MISSION,
            VehicleCommand::SetCurrent(..) => SET_CURRENT,
            VehicleCommand::SetInterval { .. } => SET_INTERVAL,
            VehicleCommand::GetInterval(_) => GET_INTERVAL,
            VehicleCommand::RequestMessage { .. } => REQUEST_MESSAGE,
            VehicleCommand::RequestProtocol => REQUEST_PROTOCOL,
            VehicleCommand::RequestCapabilities => REQUEST_CAPABILITIES,
            VehicleCommand::Reboot(_) => REBOOT,
            VehicleCommand::Storage(_) => STORAGE,
            VehicleCommand::Calibrate(_) => CALIBRATE,
            VehicleCommand::CheckArming => CHECK_ARMING,
            VehicleCommand::StartLogStream => START_LOG_STREAM,
            VehicleCommand::StopLogStream => STOP_LOG_STREAM,
            VehicleCommand::Denied(id) | VehicleCommand::Other(id) => id,
        }
    }
}
