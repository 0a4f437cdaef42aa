//! Telemetry for display by ground stations, in the frames of [`afbc_types`] unless a field says otherwise.

mod esc;
mod global_position;
mod motion;
mod orbit;
mod system;

use crate::channels::{self, RadioChannels};
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
pub use esc::{ESCS_PER_MESSAGE, EscInfo, EscStatus};
pub use global_position::{GlobalOrigin, GlobalPositionInt, GpsRawInt, HomePosition};
use mavlink::MessageData;
use mavlink::dialects::common::{
    ACTUATOR_OUTPUT_STATUS_DATA, ATTITUDE_QUATERNION_DATA, AUTOPILOT_VERSION_DATA, BATTERY_STATUS_DATA, ESC_INFO_DATA,
    ESC_STATUS_DATA, ESTIMATOR_STATUS_DATA, EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, GPS_GLOBAL_ORIGIN_DATA,
    GPS_RAW_INT_DATA, HOME_POSITION_DATA, ORBIT_EXECUTION_STATUS_DATA, PROTOCOL_VERSION_DATA, RC_CHANNELS_DATA,
    SYS_STATUS_DATA, VFR_HUD_DATA,
};
pub use motion::{AttitudeQuaternion, VfrHud};
pub use orbit::OrbitStatus;
pub use system::{ActuatorOutputs, BatteryStatus, EstimatorStatus, SystemStatus, Version};

/// A telemetry message.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Telemetry {
    /// ATTITUDE_QUATERNION (31).
    Attitude(AttitudeQuaternion),
    /// VFR_HUD (74).
    VfrHud(VfrHud),
    /// GLOBAL_POSITION_INT (33).
    GlobalPositionInt(GlobalPositionInt),
    /// GPS_RAW_INT (24).
    GpsRawInt(GpsRawInt),
    /// HOME_POSITION (242).
    HomePosition(HomePosition),
    /// GPS_GLOBAL_ORIGIN (49).
    GpsGlobalOrigin(GlobalOrigin),
    /// SYS_STATUS (1).
    System(SystemStatus),
    /// BATTERY_STATUS (147).
    Battery(BatteryStatus),
    /// EXTENDED_SYS_STATE (245): `MAV_LANDED_STATE`.
    Landed(u8),
    /// ESTIMATOR_STATUS (230).
    Estimator(EstimatorStatus),
    /// ACTUATOR_OUTPUT_STATUS (375).
    Outputs(ActuatorOutputs),
    /// AUTOPILOT_VERSION (148).
    Version(Version),
    /// ORBIT_EXECUTION_STATUS (360).
    Orbit(OrbitStatus),
    /// RC_CHANNELS (65).
    Channels(RadioChannels),
    /// ESC_STATUS (291).
    EscStatus(EscStatus),
    /// ESC_INFO (290).
    EscInfo(EscInfo),
    /// PROTOCOL_VERSION (300): only MAVLink 2.
    Protocol,
}

impl Telemetry {
    pub(crate) fn format(id: u32) -> Option<MessageFormat> {
        motion::format(id)
            .or_else(|| orbit::format(id))
            .or_else(|| global_position::format(id))
            .or_else(|| system::format(id))
            .or_else(|| channels::format(id))
            .or_else(|| esc::format(id))
    }

    pub(crate) fn read(id: u32, payload: &[u8]) -> Result<Self, FrameFault> {
        Ok(match id {
            ATTITUDE_QUATERNION_DATA::ID => Telemetry::Attitude(AttitudeQuaternion::read(payload)),
            VFR_HUD_DATA::ID => Telemetry::VfrHud(VfrHud::read(payload)),
            GLOBAL_POSITION_INT_DATA::ID => Telemetry::GlobalPositionInt(GlobalPositionInt::read(payload)),
            GPS_RAW_INT_DATA::ID => Telemetry::GpsRawInt(GpsRawInt::read(payload)),
            HOME_POSITION_DATA::ID => Telemetry::HomePosition(HomePosition::read(payload)),
            GPS_GLOBAL_ORIGIN_DATA::ID => Telemetry::GpsGlobalOrigin(GlobalOrigin::read(payload)),
            SYS_STATUS_DATA::ID => Telemetry::System(SystemStatus::read(payload)),
            BATTERY_STATUS_DATA::ID => Telemetry::Battery(BatteryStatus::read(payload)),
            EXTENDED_SYS_STATE_DATA::ID => Telemetry::Landed(system::read_landed(payload)),
            ESTIMATOR_STATUS_DATA::ID => Telemetry::Estimator(EstimatorStatus::read(payload)),
            ACTUATOR_OUTPUT_STATUS_DATA::ID => Telemetry::Outputs(ActuatorOutputs::read(payload)),
            AUTOPILOT_VERSION_DATA::ID => Telemetry::Version(Version::read(payload)),
            ORBIT_EXECUTION_STATUS_DATA::ID => Telemetry::Orbit(OrbitStatus::read(payload)),
            RC_CHANNELS_DATA::ID => Telemetry::Channels(RadioChannels::read(payload)),
            ESC_STATUS_DATA::ID => Telemetry::EscStatus(EscStatus::read(payload)),
            ESC_INFO_DATA::ID => Telemetry::EscInfo(EscInfo::read(payload)),
            PROTOCOL_VERSION_DATA::ID => Telemetry::Protocol,
            _ => return Err(FrameFault::Unknown),
        })
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            Telemetry::Attitude(attitude) => attitude.write(payload),
            Telemetry::VfrHud(summary) => summary.write(payload),
            Telemetry::GlobalPositionInt(position) => position.write(payload),
            Telemetry::GpsRawInt(fix) => fix.write(payload),
            Telemetry::HomePosition(home) => home.write(payload),
            Telemetry::GpsGlobalOrigin(origin) => origin.write(payload),
            Telemetry::System(status) => status.write(payload),
            Telemetry::Battery(battery) => battery.write(payload),
            Telemetry::Landed(state) => system::write_landed(*state, payload),
            Telemetry::Estimator(status) => status.write(payload),
            Telemetry::Outputs(outputs) => outputs.write(payload),
            Telemetry::Version(version) => version.write(payload),
            Telemetry::Orbit(orbit) => orbit.write(payload),
            Telemetry::Channels(channels) => channels.write(payload),
            Telemetry::EscStatus(status) => status.write(payload),
            Telemetry::EscInfo(info) => info.write(payload),
            Telemetry::Protocol => system::write_protocol(payload),
        }
    }
}
