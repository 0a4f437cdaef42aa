//! Answers that MAVLink's common dialect expects to each of its messages.

use mavlink::dialects::common::*;

/// Answer that is expected from the receiver of a message.
pub(crate) enum Expected {
    /// One of these messages.
    Answer(&'static [u32]),
    /// No answer.
    None,
}

/// Returns the expected answer by the dialect's definitions: `common.xml`, and mavlink.io's page on each service. There
/// is no default case, so that a new message in the dialect must be added.
pub(crate) fn expected(message: &MavMessage) -> Expected {
    use Expected::{Answer, None};
    use MavMessage as M;
    match message {
        // PING and TIMESYNC are answered with the same message.
        M::PING(_) => Answer(&[4]),
        M::TIMESYNC(_) => Answer(&[111]),
        // Commands are answered with COMMAND_ACK. SET_MODE and SET_HOME_POSITION are older commands. SET_HOME_POSITION
        // is answered with HOME_POSITION too: "vehicle should emit ... irrespective of whether it has changed".
        M::COMMAND_LONG(_) | M::COMMAND_INT(_) | M::SET_MODE(_) => Answer(&[77]),
        M::SET_HOME_POSITION(_) => Answer(&[77, 242]),
        M::SET_GPS_GLOBAL_ORIGIN(_) => Answer(&[49]),
        M::CHANGE_OPERATOR_CONTROL(_) => Answer(&[6]),
        // Parameters: PARAM_VALUE, or PARAM_ERROR.
        M::PARAM_REQUEST_LIST(_) => Answer(&[22]),
        M::PARAM_REQUEST_READ(_) | M::PARAM_SET(_) => Answer(&[22, 345]),
        M::PARAM_EXT_REQUEST_READ(_) | M::PARAM_EXT_REQUEST_LIST(_) => Answer(&[322]),
        M::PARAM_EXT_SET(_) => Answer(&[324]),
        // Messages about missions are answered with the count, the item, the next request, or MISSION_ACK.
        M::MISSION_REQUEST_LIST(_) => Answer(&[44, 47]),
        M::MISSION_REQUEST(_) | M::MISSION_REQUEST_INT(_) => Answer(&[39, 73, 47]),
        M::MISSION_REQUEST_PARTIAL_LIST(_) => Answer(&[44, 73, 47]),
        M::MISSION_WRITE_PARTIAL_LIST(_) | M::MISSION_COUNT(_) => Answer(&[40, 51, 47]),
        M::MISSION_ITEM(_) | M::MISSION_ITEM_INT(_) => Answer(&[40, 51, 47]),
        M::MISSION_CLEAR_ALL(_) => Answer(&[47]),
        M::MISSION_SET_CURRENT(_) => Answer(&[42]),
        // The dialect says "Response: DATA_STREAM". The streams themselves follow.
        M::REQUEST_DATA_STREAM(_) => Answer(&[67]),
        // These messages request logs, files, events, shells (with the flag "respond") and heights of the terrain.
        M::LOG_REQUEST_LIST(_) => Answer(&[118]),
        M::LOG_REQUEST_DATA(_) => Answer(&[120]),
        M::FILE_TRANSFER_PROTOCOL(_) => Answer(&[110]),
        M::REQUEST_EVENT(_) => Answer(&[412, 413]),
        M::SERIAL_CONTROL(_) => Answer(&[126]),
        M::TERRAIN_CHECK(_) => Answer(&[136]),

        // These messages answer a request, or belong to a transfer that the receiver has begun.
        M::AUTOPILOT_VERSION(_)
        | M::AVAILABLE_MODES(_)
        | M::CHANGE_OPERATOR_CONTROL_ACK(_)
        | M::COMMAND_ACK(_)
        | M::COMPONENT_INFORMATION(_)
        | M::COMPONENT_INFORMATION_BASIC(_)
        | M::COMPONENT_METADATA(_)
        | M::DATA_STREAM(_)
        | M::ENCAPSULATED_DATA(_)
        | M::LOGGING_ACK(_)
        | M::LOGGING_DATA(_)
        | M::LOGGING_DATA_ACKED(_)
        | M::LOG_DATA(_)
        | M::LOG_ENTRY(_)
        | M::MESSAGE_INTERVAL(_)
        | M::MISSION_ACK(_)
        | M::MISSION_CURRENT(_)
        | M::MISSION_ITEM_REACHED(_)
        | M::PARAM_ERROR(_)
        | M::PARAM_EXT_ACK(_)
        | M::PARAM_EXT_VALUE(_)
        | M::PARAM_VALUE(_)
        | M::PROTOCOL_VERSION(_)
        | M::RESPONSE_EVENT_ERROR(_)
        | M::SAFETY_ALLOWED_AREA(_)
        | M::SUPPORTED_TUNES(_)
        | M::TERRAIN_DATA(_)
        | M::TERRAIN_REPORT(_) => None,

        // Requests without a target for cameras, modems, access points and stations with maps. These answer; a refusal
        // by another component would disturb.
        M::CELLULAR_CONFIG(_)
        | M::DATA_TRANSMISSION_HANDSHAKE(_)
        | M::RESOURCE_REQUEST(_)
        | M::TERRAIN_REQUEST(_)
        | M::WIFI_CONFIG_AP(_) => None,

        // These orders have no answer. Telemetry shows their effect.
        M::ACTUATOR_CONTROL_TARGET(_)
        | M::AUTH_KEY(_)
        | M::CAN_FILTER_MODIFY(_)
        | M::COMMAND_CANCEL(_)
        | M::FOLLOW_TARGET(_)
        | M::GIMBAL_DEVICE_SET_ATTITUDE(_)
        | M::GIMBAL_MANAGER_SET_ATTITUDE(_)
        | M::GIMBAL_MANAGER_SET_MANUAL_CONTROL(_)
        | M::GIMBAL_MANAGER_SET_PITCHYAW(_)
        | M::LOG_ERASE(_)
        | M::LOG_REQUEST_END(_)
        | M::MANUAL_CONTROL(_)
        | M::MANUAL_SETPOINT(_)
        | M::PARAM_MAP_RC(_)
        | M::PLAY_TUNE(_)
        | M::PLAY_TUNE_V2(_)
        | M::RC_CHANNELS_OVERRIDE(_)
        | M::SAFETY_SET_ALLOWED_AREA(_)
        | M::SETUP_SIGNING(_)
        | M::SET_ACTUATOR_CONTROL_TARGET(_)
        | M::SET_ATTITUDE_TARGET(_)
        | M::SET_POSITION_TARGET_GLOBAL_INT(_)
        | M::SET_POSITION_TARGET_LOCAL_NED(_)
        | M::TRAJECTORY_REPRESENTATION_BEZIER(_)
        | M::TRAJECTORY_REPRESENTATION_WAYPOINTS(_) => None,

        // These messages carry data for the receiver.
        M::ATT_POS_MOCAP(_)
        | M::AUTOPILOT_STATE_FOR_GIMBAL_DEVICE(_)
        | M::CANFD_FRAME(_)
        | M::CAN_FRAME(_)
        | M::GLOBAL_VISION_POSITION_ESTIMATE(_)
        | M::GPS_INJECT_DATA(_)
        | M::GPS_INPUT(_)
        | M::GPS_RTCM_DATA(_)
        | M::HIL_CONTROLS(_)
        | M::HIL_GPS(_)
        | M::HIL_OPTICAL_FLOW(_)
        | M::HIL_RC_INPUTS_RAW(_)
        | M::HIL_SENSOR(_)
        | M::HIL_STATE(_)
        | M::HIL_STATE_QUATERNION(_)
        | M::LANDING_TARGET(_)
        | M::OBSTACLE_DISTANCE(_)
        | M::ODOMETRY(_)
        | M::OPTICAL_FLOW(_)
        | M::OPTICAL_FLOW_RAD(_)
        | M::TUNNEL(_)
        | M::V2_EXTENSION(_)
        | M::VICON_POSITION_ESTIMATE(_)
        | M::VISION_POSITION_ESTIMATE(_)
        | M::VISION_SPEED_ESTIMATE(_) => None,

        // Other aircraft broadcast these messages to identify themselves.
        M::ADSB_VEHICLE(_)
        | M::AIS_VESSEL(_)
        | M::COLLISION(_)
        | M::OPEN_DRONE_ID_ARM_STATUS(_)
        | M::OPEN_DRONE_ID_AUTHENTICATION(_)
        | M::OPEN_DRONE_ID_BASIC_ID(_)
        | M::OPEN_DRONE_ID_LOCATION(_)
        | M::OPEN_DRONE_ID_MESSAGE_PACK(_)
        | M::OPEN_DRONE_ID_OPERATOR_ID(_)
        | M::OPEN_DRONE_ID_SELF_ID(_)
        | M::OPEN_DRONE_ID_SYSTEM(_)
        | M::OPEN_DRONE_ID_SYSTEM_UPDATE(_)
        | M::UTM_GLOBAL_POSITION(_) => None,

        // Telemetry.
        M::ACTUATOR_OUTPUT_STATUS(_)
        | M::AIRSPEED(_)
        | M::ALTITUDE(_)
        | M::ATTITUDE(_)
        | M::ATTITUDE_QUATERNION(_)
        | M::ATTITUDE_QUATERNION_COV(_)
        | M::ATTITUDE_TARGET(_)
        | M::AVAILABLE_MODES_MONITOR(_)
        | M::BATTERY_INFO(_)
        | M::BATTERY_STATUS(_)
        | M::BUTTON_CHANGE(_)
        | M::CAMERA_CAPTURE_STATUS(_)
        | M::CAMERA_FOV_STATUS(_)
        | M::CAMERA_IMAGE_CAPTURED(_)
        | M::CAMERA_INFORMATION(_)
        | M::CAMERA_SETTINGS(_)
        | M::CAMERA_THERMAL_RANGE(_)
        | M::CAMERA_TRACKING_GEO_STATUS(_)
        | M::CAMERA_TRACKING_IMAGE_STATUS(_)
        | M::CAMERA_TRIGGER(_)
        | M::CELLULAR_STATUS(_)
        | M::CONTROL_SYSTEM_STATE(_)
        | M::CURRENT_EVENT_SEQUENCE(_)
        | M::CURRENT_MODE(_)
        | M::DEBUG(_)
        | M::DEBUG_FLOAT_ARRAY(_)
        | M::DEBUG_VECT(_)
        | M::DISTANCE_SENSOR(_)
        | M::EFI_STATUS(_)
        | M::ESC_INFO(_)
        | M::ESC_STATUS(_)
        | M::ESTIMATOR_STATUS(_)
        | M::EVENT(_)
        | M::EXTENDED_SYS_STATE(_)
        | M::FENCE_STATUS(_)
        | M::FIGURE_EIGHT_EXECUTION_STATUS(_)
        | M::FLIGHT_INFORMATION(_)
        | M::FUEL_STATUS(_)
        | M::GENERATOR_STATUS(_)
        | M::GIMBAL_DEVICE_ATTITUDE_STATUS(_)
        | M::GIMBAL_DEVICE_INFORMATION(_)
        | M::GIMBAL_MANAGER_INFORMATION(_)
        | M::GIMBAL_MANAGER_STATUS(_)
        | M::GLOBAL_POSITION_INT(_)
        | M::GLOBAL_POSITION_INT_COV(_)
        | M::GLOBAL_POSITION_SENSOR(_)
        | M::GPS2_RAW(_)
        | M::GPS2_RTK(_)
        | M::GPS_GLOBAL_ORIGIN(_)
        | M::GPS_RAW_INT(_)
        | M::GPS_RTK(_)
        | M::GPS_STATUS(_)
        | M::HEARTBEAT(_)
        | M::HIGHRES_IMU(_)
        | M::HIGH_LATENCY(_)
        | M::HIGH_LATENCY2(_)
        | M::HIL_ACTUATOR_CONTROLS(_)
        | M::HOME_POSITION(_)
        | M::HYGROMETER_SENSOR(_)
        | M::ILLUMINATOR_STATUS(_)
        | M::ISBD_LINK_STATUS(_)
        | M::LINK_NODE_STATUS(_)
        | M::LOCAL_POSITION_NED(_)
        | M::LOCAL_POSITION_NED_COV(_)
        | M::LOCAL_POSITION_NED_SYSTEM_GLOBAL_OFFSET(_)
        | M::MAG_CAL_REPORT(_)
        | M::MEMORY_VECT(_)
        | M::MOUNT_ORIENTATION(_)
        | M::NAMED_VALUE_FLOAT(_)
        | M::NAMED_VALUE_INT(_)
        | M::NAV_CONTROLLER_OUTPUT(_)
        | M::ONBOARD_COMPUTER_STATUS(_)
        | M::ORBIT_EXECUTION_STATUS(_)
        | M::POSITION_TARGET_GLOBAL_INT(_)
        | M::POSITION_TARGET_LOCAL_NED(_)
        | M::POWER_STATUS(_)
        | M::RADIO_STATUS(_)
        | M::RAW_IMU(_)
        | M::RAW_PRESSURE(_)
        | M::RAW_RPM(_)
        | M::RC_CHANNELS(_)
        | M::RC_CHANNELS_RAW(_)
        | M::RC_CHANNELS_SCALED(_)
        | M::RELAY_STATUS(_)
        | M::SCALED_IMU(_)
        | M::SCALED_IMU2(_)
        | M::SCALED_IMU3(_)
        | M::SCALED_PRESSURE(_)
        | M::SCALED_PRESSURE2(_)
        | M::SCALED_PRESSURE3(_)
        | M::SERVO_OUTPUT_RAW(_)
        | M::SIM_STATE(_)
        | M::SMART_BATTERY_INFO(_)
        | M::STATUSTEXT(_)
        | M::STORAGE_INFORMATION(_)
        | M::SYSTEM_TIME(_)
        | M::SYS_STATUS(_)
        | M::TIME_ESTIMATE_TO_TARGET(_)
        | M::UAVCAN_NODE_INFO(_)
        | M::UAVCAN_NODE_STATUS(_)
        | M::VFR_HUD(_)
        | M::VIBRATION(_)
        | M::VIDEO_STREAM_INFORMATION(_)
        | M::VIDEO_STREAM_STATUS(_)
        | M::WHEEL_DISTANCE(_)
        | M::WINCH_STATUS(_)
        | M::WIND_COV(_) => None,
    }
}
