"""What QGroundControl asks when it connects: its first connection's steps, in their order, each answered in time.

The order is that of its InitialConnectStateMachine: version, standard modes, component metadata over the file protocol,
parameters, mission, fence, rally points; then cameras and gimbals. Whatever the vehicle does not have must be refused
by a message: silence costs a station its time limit, several times over.
"""

import json
import os
import re
import struct
import time
import zlib

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402  (reads the variable)

from served import PATIENCE, Served, Session  # noqa: E402

MAVLINK = mavutil.mavlink
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
# Time in which each question is answered [s]; QGroundControl's limit for commands is 3 s, for files 1 s.
IN_TIME = 1.0 * PATIENCE
# Operations of the file protocol.
RESET, OPEN, READ, BURST, ACK, NAK = 2, 4, 5, 15, 128, 129
END_OF_FILE = 6
BLOCK = 239
# One packet of a burst in so many is taken for lost.
LOST = 7
# COMP_METADATA_TYPE_PARAMETER.
PARAMETER_TYPE = 1
# Messages that pymavlink's dialects do not have.
NUMBERS = {"PROTOCOL_VERSION": 300, "COMPONENT_INFORMATION": 395, "COMPONENT_METADATA": 397}
# The published schemas of the files (mavlink, component_metadata): keys, and those of them that must be there.
# QGroundControl takes version 1 of both.
PARAMETER_KEYS = {
    "name", "type", "shortDesc", "longDesc", "units", "default", "decimalPlaces", "min", "max", "increment",
    "rebootRequired", "group", "category", "volatile", "values", "bitmask", "readOnly",
}
PARAMETER_TYPES = {"Uint8", "Int8", "Uint16", "Int16", "Uint32", "Int32", "Float"}


class Station:
    """A connection that keeps its heartbeat going and tells how long the vehicle takes."""

    def __init__(self, port):
        self.link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", dialect="all", source_system=255)
        self.beat, self.slowest, self.number = 0.0, 0.0, 0

    @property
    def to(self):
        return self.link.target_system, self.link.target_component

    def next(self, end):
        """Returns the next message until then, or none."""
        now = time.monotonic()
        if now - self.beat > 1.0:
            self.beat = now
            self.link.mav.heartbeat_send(MAVLINK.MAV_TYPE_GCS, MAVLINK.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        return self.link.recv_match(blocking=True, timeout=max(0.001, min(0.5, end - now)))

    def answers(self, *kinds, wanted=lambda _: True, seconds=IN_TIME):
        """Returns the first message of each of these kinds that is wanted."""
        began, found = time.monotonic(), {}
        while len(found) < len(kinds):
            if time.monotonic() > began + seconds:
                raise TimeoutError(f"no {', '.join(set(kinds) - set(found))} within {seconds} s")
            message = self.next(began + seconds)
            if message is not None and message.get_type() in kinds and wanted(message):
                found.setdefault(message.get_type(), message)
        self.slowest = max(self.slowest, time.monotonic() - began)
        return [found[kind] for kind in kinds]

    def command(self, number, *parameters):
        """Sends a command; returns the result of its answer."""
        self.link.mav.command_long_send(*self.to, number, 0, *parameters, *[0] * (7 - len(parameters)))
        return self.answers("COMMAND_ACK", wanted=lambda ack: ack.command == number)[0].result

    def request(self, kind, index=0):
        """Requests a message; returns it, or the result of the refusal."""
        number = NUMBERS.get(kind) or getattr(MAVLINK, f"MAVLINK_MSG_ID_{kind}")
        kind = f"UNKNOWN_{number}" if kind in NUMBERS else kind
        command = MAVLINK.MAV_CMD_REQUEST_MESSAGE
        self.link.mav.command_long_send(*self.to, command, 0, number, index, 0, 0, 0, 0, 0)
        kept = []

        def wanted(message):
            if message.get_type() == kind:
                kept.append(message)
            return message.get_type() == "COMMAND_ACK" and message.command == command
        began = time.monotonic()
        answer = None
        while answer is None:
            if time.monotonic() > began + IN_TIME:
                raise TimeoutError(f"no answer to the request of {kind}")
            message = self.next(began + IN_TIME)
            answer = message if message is not None and wanted(message) else None
        if answer.result != ACCEPTED:
            return answer.result
        return kept[0] if kept else self.answers(kind)[0]

    def send_file(self, operation, session=0, offset=0, size=0, data=b""):
        self.number = (self.number + 1) % 0x10000
        head = struct.pack("<HBBBBBBI", self.number, session, operation, len(data) or size, 0, 0, 0, offset)
        self.link.mav.file_transfer_protocol_send(0, *self.to, (head + data).ljust(251, b"\0"))

    def file_answer(self, operation):
        """Returns the next packet that answers an operation: kind, session, whether a burst ends, offset, data."""
        def is_answer(message):
            return message.payload[5] == operation and message.target_system == self.link.mav.srcSystem
        payload = bytes(self.answers("FILE_TRANSFER_PROTOCOL", wanted=is_answer)[0].payload)
        _, session, kind, size, _, complete, _, offset = struct.unpack("<HBBBBBBI", payload[:12])
        return kind, session, complete, offset, payload[12:12 + size]

    def download(self, uri):
        """Returns a file, as QGroundControl does it: in bursts, then what is missing, then a reset of the sessions."""
        path = uri.removeprefix("mftp://").encode()
        self.send_file(OPEN, data=path)
        kind, session, _, _, data = self.file_answer(OPEN)
        if kind != ACK:
            raise ValueError(f"{uri}: refused, {data[0]}")
        size = struct.unpack("<I", data)[0]
        blocks, offset, count, ended = {}, 0, 0, False
        while not ended:
            self.send_file(BURST, session, offset, BLOCK)
            complete = False
            while not complete and not ended:
                kind, _, complete, offset, data = self.file_answer(BURST)
                ended = kind == NAK
                if ended and data[0] != END_OF_FILE:
                    raise ValueError(f"{uri}: refused, {data[0]}")
                if kind == ACK:
                    count += 1
                    if count % LOST:
                        blocks[offset] = data
                    offset += len(data)
        missing = [place for place in range(0, size, BLOCK) if place not in blocks]
        for place in missing:
            self.send_file(READ, session, place, BLOCK)
            kind, _, _, _, data = self.file_answer(READ)
            if kind != ACK:
                raise ValueError(f"{uri}: refused at {place}, {data[0]}")
            blocks[place] = data
        self.send_file(RESET)
        if self.file_answer(RESET)[0] != ACK:
            raise ValueError("the sessions were not reset")
        whole = b"".join(blocks[place] for place in sorted(blocks))
        if len(whole) != size:
            raise ValueError(f"{uri}: {len(whole)} of {size} bytes")
        return whole


def checksum(data):
    """CRC-32 without its inversions, as the file protocol has it."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def must(condition, what):
    if not condition:
        raise ValueError(what)


def version(station):
    message = station.request("AUTOPILOT_VERSION")
    must(message.capabilities & MAVLINK.MAV_PROTOCOL_CAPABILITY_FTP, "no FTP among the capabilities")
    major, minor = message.flight_sw_version >> 24, message.flight_sw_version >> 16 & 0xFF
    return f"{major}.{minor}, capabilities {message.capabilities:#x}"


def payload_of(message, length):
    """Returns the payload of a message that pymavlink does not know, with its trailing zeros."""
    return bytes(message.data)[10:-2].ljust(length, b"\0")


def protocol(station):
    version = struct.unpack("<H", payload_of(station.request("PROTOCOL_VERSION"), 22)[:2])[0]
    must(version == 200, version)
    return f"{version}"


def where_metadata_is(message):
    """Returns checksum and address of the general metadata in COMPONENT_METADATA."""
    _, crc, uri = struct.unpack("<II100s", payload_of(message, 108))
    return crc, uri.rstrip(b"\0").decode()


def modes(station):
    """One after the other, by number."""
    first = station.request("AVAILABLE_MODES", 1)
    names = [first] + [station.request("AVAILABLE_MODES", place) for place in range(2, first.number_modes + 1)]
    must([mode.mode_index for mode in names] == list(range(1, len(names) + 1)), "modes are missing")
    standard = sum(mode.standard_mode != 0 for mode in names)
    current = station.request("CURRENT_MODE")
    must(current.custom_mode in {mode.custom_mode for mode in names}, f"the mode {current.custom_mode} is not listed")
    must(station.request("AVAILABLE_MODES", len(names) + 1) == DENIED, "a mode beyond the last one is not denied")
    return f"{len(names)}, {standard} of them standard modes"


def metadata(station, found):
    crc, uri = where_metadata_is(station.request("COMPONENT_METADATA"))
    general = station.download(uri)
    must(checksum(general) == crc, "the checksum of the general metadata is another")
    general = json.loads(general)
    must(general["version"] == 1 and isinstance(general["metadataTypes"], list), "no general metadata of version 1")
    keys = {"version", "vendorName", "modelName", "firmwareVersion", "hardwareVersion", "metadataTypes"}
    must(set(general) <= keys, f"keys {set(general) - keys}")
    must(re.fullmatch(r"\d+\.\d+\.\d+(\.\d+)?", general["firmwareVersion"]), general["firmwareVersion"])
    entry = next(one for one in general["metadataTypes"] if one["type"] == PARAMETER_TYPE)
    parameters = station.download(entry["uri"])
    must(checksum(parameters) == entry["fileCrc"], "the checksum of the parameters' metadata is another")
    size = len(parameters)
    parameters = json.loads(parameters)
    must(parameters["version"] == 1, "parameters' metadata of another version")
    for one in parameters["parameters"]:
        must(set(one) <= PARAMETER_KEYS and {"name", "type"} <= set(one), f"keys of {one}")
        must(re.fullmatch(r"[a-zA-Z0-9_]{1,16}", one["name"]) and one["type"] in PARAMETER_TYPES, one)
        must(one["min"] <= one["default"] <= one["max"] and one["shortDesc"], one)
        for value in one.get("values", []):
            must(set(value) == {"value", "description"} and one["min"] <= value["value"] <= one["max"], one)
        found[one["name"]] = one
    # What stations asked for before: its checksum and its address stand behind another checksum.
    before = payload_of(station.request("COMPONENT_INFORMATION"), 212)
    must(before[4:8] == struct.pack("<I", crc) and before[12:].startswith(uri.encode()), "the old message differs")
    return f"{general['modelName']}: {len(found)} parameters described in {size} bytes"


def parameters(station, described):
    station.link.mav.param_request_list_send(*station.to)
    found, end = {}, time.monotonic() + 10 * PATIENCE
    count = None
    while count is None or len(found) < count:
        must(time.monotonic() < end, f"{len(found)} of {count} parameters")
        message = station.next(end)
        if message is not None and message.get_type() == "PARAM_VALUE" and message.param_index != 0xFFFF:
            found[message.param_id], count = message, message.param_count
    must(set(found) == set(described), f"described otherwise: {set(found) ^ set(described)}")
    for name, message in found.items():
        one = described[name]
        whole = message.param_type == MAVLINK.MAV_PARAM_TYPE_INT32
        must(one["type"] == ("Int32" if whole else "Float"), one)
        value = struct.unpack("<i", struct.pack("<f", message.param_value))[0] if whole else message.param_value
        # A range in the file has all digits, a value those of a float.
        low, high = one["min"] - 1e-6 * abs(one["min"]), one["max"] + 1e-6 * abs(one["max"])
        must(low <= value <= high, f"{value} {one}")
    return f"{count}, each described and within its range"


def plan(station, kind):
    """A list of mission items, all of them, and its acknowledgement."""
    station.link.mav.mission_request_list_send(*station.to, kind)
    count = station.answers("MISSION_COUNT", wanted=lambda it: it.mission_type == kind)[0].count
    for number in range(count):
        station.link.mav.mission_request_int_send(*station.to, number, kind)
        station.answers("MISSION_ITEM_INT", wanted=lambda it: it.mission_type == kind and it.seq == number)
    station.link.mav.mission_ack_send(*station.to, MAVLINK.MAV_MISSION_ACCEPTED, kind)
    return f"{count} items"


def accessories(station):
    """Cameras and gimbals, by request of the message and by the commands of old; and what else is asked for."""
    asked = [
        "CAMERA_INFORMATION", "CAMERA_SETTINGS", "STORAGE_INFORMATION", "CAMERA_CAPTURE_STATUS",
        "VIDEO_STREAM_INFORMATION", "GIMBAL_MANAGER_INFORMATION", "GIMBAL_DEVICE_INFORMATION",
        "FLIGHT_INFORMATION", "OPEN_DRONE_ID_ARM_STATUS",
    ]
    for kind in asked:
        must(station.request(kind) == UNSUPPORTED, f"{kind} is not refused")
    commands = ["MAV_CMD_REQUEST_CAMERA_INFORMATION", "MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION"]
    for name in commands:
        must(station.command(getattr(MAVLINK, name), 1) == UNSUPPORTED, f"{name} is not refused")
    return f"{len(asked) + len(commands)} questions, each unsupported"


def logs(station):
    station.link.mav.log_request_list_send(*station.to, 0, 0xFFFF)
    entry = station.answers("LOG_ENTRY")[0]
    return f"{entry.num_logs}"


def main():
    session, served = Session("first connection"), Served()
    try:
        connect(session, Station(served.station))
    finally:
        served.quit()
    session.end(served)


def connect(session, station):
    station.answers("HEARTBEAT", seconds=30 * PATIENCE)
    station.slowest = 0.0
    steps = [
        ("version", version, []),
        ("protocol", protocol, []),
        ("modes", modes, []),
        ("component metadata", metadata, [described := {}]),
        ("parameters", parameters, [described]),
        ("mission", plan, [MAVLINK.MAV_MISSION_TYPE_MISSION]),
        ("geofence", plan, [MAVLINK.MAV_MISSION_TYPE_FENCE]),
        ("rally points", plan, [MAVLINK.MAV_MISSION_TYPE_RALLY]),
        ("cameras and gimbals", accessories, []),
        ("logs", logs, []),
    ]
    for what, doing, more in steps:
        began = time.monotonic()
        try:
            result = doing(station, *more)
        except Exception as error:  # Whatever is wrong is a failed step.
            session.fail(what, f"{type(error).__name__}: {error}")
            continue
        session.line(f"{what}: {result}, {time.monotonic() - began:.2f} s")
    session.line(f"slowest answer: {station.slowest:.2f} s")


main()
