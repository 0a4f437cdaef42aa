"""Writes frames of pymavlink, MAVLink's reference implementation, one a line: name, bytes.

    python3 -m venv venv && venv/bin/pip install pymavlink
    venv/bin/python crates/mavlink/tests/reference/frames.py >crates/mavlink/tests/reference/frames.txt
"""

from pymavlink.dialects.v20 import all as m

nan = float("nan")
link = m.MAVLink(None, srcSystem=255, srcComponent=190)


def show(name, message):
    link.seq = 0
    print(name, message.pack(link).hex())


def item(seq):
    return m.MAVLink_mission_item_int_message(1, 1, seq, 6, 16, 0, 1, 5.0, 2.0, 0.5, nan, 473977420, -85455940, 10.5, 0)


show("SET_MODE", m.MAVLink_set_mode_message(1, 1, 0x03040000))
show("COMMAND_LONG", m.MAVLink_command_long_message(1, 1, 176, 0, 1, 4, 3, 0, 0, 0, 0))
show("COMMAND_INT", m.MAVLink_command_int_message(1, 1, 3, 192, 0, 0, 2.5, 1, 0, 0.5, 473977420, 85455940, 12.25))
show("TAKEOFF", m.MAVLink_command_long_message(1, 1, 22, 0, 0, 0, 0, nan, nan, nan, 2.5))
show("TARGET", m.MAVLink_set_position_target_local_ned_message(7, 1, 1, 8, 0b110111000111, 0, 0, 0, 1, 2, 3, 0, 0, 0, 0, 0.25))
show("PLACE", m.MAVLink_set_position_target_global_int_message(
    7, 1, 1, 6, 0b110111111000, 473977420, 85455940, 12.5, 0, 0, 0, 0, 0, 0, 0, 0))
show("ATTITUDE", m.MAVLink_set_attitude_target_message(7, 1, 1, 7, [0.5, 0.5, 0.5, 0.5], 9, 9, 9, 0.75))
show("STICKS", m.MAVLink_manual_control_message(1, 500, -250, 750, 1000, 0))
show("STREAM", m.MAVLink_request_data_stream_message(1, 1, 10, 4, 1))
show("COUNT", m.MAVLink_mission_count_message(1, 1, 300, 1))
show("ITEM", item(513))
show("LIST", m.MAVLink_mission_request_list_message(1, 1, 2))
show("REQUEST", m.MAVLink_mission_request_message(1, 1, 3, 0))
show("REQUEST_INT", m.MAVLink_mission_request_int_message(1, 1, 3, 1))
show("ACK", m.MAVLink_mission_ack_message(1, 1, 13, 0))
show("CLEAR", m.MAVLink_mission_clear_all_message(1, 1, 255))
show("SET_CURRENT", m.MAVLink_mission_set_current_message(1, 1, 9))
show("TIMESYNC", m.MAVLink_timesync_message(0, -5))
show("PING", m.MAVLink_ping_message(77, 5, 0, 0))
show("SYSTEM_TIME", m.MAVLink_system_time_message(1700000000000000, 1234))
show("PARAM_READ", m.MAVLink_param_request_read_message(1, 1, b"MIS_TAKEOFF_ALT", -1))
show("PARAM_PLACE", m.MAVLink_param_request_read_message(1, 1, b"", 3))
show("PARAM_LIST", m.MAVLink_param_request_list_message(1, 1))
show("PARAM_SET", m.MAVLink_param_set_message(1, 1, b"SIXTEEN_LETTERS_", 1.5, 9))
show("CONTROL", m.MAVLink_change_operator_control_message(1, 1, 0, b""))

show("<COMMAND_ACK", m.MAVLink_command_ack_message(22, 5, 255, 0, 245, 190))
show("<ATTITUDE_QUATERNION", m.MAVLink_attitude_quaternion_message(5, 0.5, 0.25, -0.5, 0.75, 1, 2, 3))
show("<GLOBAL_POSITION_INT", m.MAVLink_global_position_int_message(5, 473977420, -85455940, 488123, -123, 100, -200, 300, 35999))
show("<GPS_RAW_INT", m.MAVLink_gps_raw_int_message(
    9, 3, 473977420, 85455940, 488000, 65535, 65535, 123, 4567, 12, 0, 500, 800, 0, 0, 0))
show("<HOME_POSITION", m.MAVLink_home_position_message(1, 2, 3, 4, 5, 6, [1, 0, 0, 0], 0, 0, 0, 99))
show("<GPS_GLOBAL_ORIGIN", m.MAVLink_gps_global_origin_message(1, 2, 3, 99))
show("<SYS_STATUS", m.MAVLink_sys_status_message(7, 5, 3, 51, 16100, 1234, 87, 0, 11, 0, 0, 0, 0))
show("<BATTERY_STATUS", m.MAVLink_battery_status_message(
    0, 0, 0, 32767, [16100] + 9 * [65535], 1234, 250, -1, 87, 0, 1))
show("<EXTENDED_SYS_STATE", m.MAVLink_extended_sys_state_message(0, 2))
show("<ESTIMATOR_STATUS", m.MAVLink_estimator_status_message(9, 831, 0, 0, 0, 0, 0, 0, 0.5, 0.75))
show("<ACTUATOR_OUTPUT_STATUS", m.MAVLink_actuator_output_status_message(9, 4, [0.25, 0.5, 0.75, 1] + 28 * [0]))
show("<AUTOPILOT_VERSION", m.MAVLink_autopilot_version_message(
    8706, 0x010203FF, 0, 0, 0, [1, 2, 3, 4, 5, 6, 7, 8], 8 * [0], 8 * [0], 0, 0, 77))
show("<VFR_HUD", m.MAVLink_vfr_hud_message(1.5, 1.5, 270, 55, 490, -0.5))
show("<MESSAGE_INTERVAL", m.MAVLink_message_interval_message(31, -1))
show("<AVAILABLE_MODES", m.MAVLink_available_modes_message(9, 2, 8, 0x02040000, 4, b"takeoff"))
show("<CURRENT_MODE", m.MAVLink_current_mode_message(7, 0x06040000, 0x03040000))
show("<MISSION_CURRENT", m.MAVLink_mission_current_message(3, 9, 3, 1))
show("<MISSION_ITEM_REACHED", m.MAVLink_mission_item_reached_message(3))
show("<PARAM_VALUE", m.MAVLink_param_value_message(b"GF_MAX_HOR_DIST", 2.5, 9, 300, 65535))
show("<POSITION_TARGET", m.MAVLink_position_target_local_ned_message(5, 1, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0.5, 0.25))
show("<CONTROL", m.MAVLink_change_operator_control_ack_message(245, 0, 3))
show("<TEXT", m.MAVLink_statustext_message(4, b"refused: not armed"))
