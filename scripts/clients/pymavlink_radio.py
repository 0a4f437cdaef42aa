"""A flight by pymavlink's RC_CHANNELS_OVERRIDE: armed, flown and stopped by channels, which RC_CHANNELS shows."""

import os
import struct
import sys
import time

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402  (reads the variable)

from served import PATIENCE, Served, Session  # noqa: E402

MAVLINK = mavutil.mavlink
# Channels, from 0: sticks at their centre, throttle down, the arming switch, the mode's switch, the kill switch.
THROTTLE, ARM, MODE, KILL = 2, 4, 5, 6
LEFT_ALONE = 65535


class Transmitter:
    """A station that sends channels at 25 Hz, in the vehicle's time."""

    def __init__(self, port):
        self.mav = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", dialect="common")
        self.channels = [1500, 1500, 1000, 1500, 1000, 1000, 1000, 1000]
        self.armed, self.height_m, self.shown = False, 0.0, None
        self.beat_s, self.known = 0.0, {}
        if self.mav.recv_match(blocking=True, timeout=10 * PATIENCE) is None:
            sys.exit("radio: nothing from the vehicle")

    def send(self):
        # Of the later channels, 65534 gives one back and 65535 leaves it alone.
        self.mav.mav.rc_channels_override_send(1, 1, *self.channels, *[LEFT_ALONE] * 10)
        if time.monotonic() - self.beat_s > 1:
            self.beat_s = time.monotonic()
            self.mav.mav.heartbeat_send(MAVLINK.MAV_TYPE_GCS, MAVLINK.MAV_AUTOPILOT_INVALID, 0, 0, 0)

    def hold(self, until, seconds):
        """Sends until something holds; true if it does in time."""
        end = time.monotonic() + seconds * PATIENCE
        while time.monotonic() < end:
            self.send()
            again = time.monotonic() + 0.04
            while time.monotonic() < again:
                message = self.mav.recv_match(blocking=True, timeout=0.01)
                if message is not None:
                    self.take(message)
            if until():
                return True
        return False

    def take(self, message):
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self.armed = bool(message.base_mode & MAVLINK.MAV_MODE_FLAG_SAFETY_ARMED)
        elif kind == "LOCAL_POSITION_NED":
            self.height_m = -message.z
        elif kind == "RC_CHANNELS":
            self.shown = message
        elif kind == "PARAM_VALUE":
            # A whole number's bytes, as a float.
            raw = struct.pack("<f", message.param_value)
            is_real = message.param_type == MAVLINK.MAV_PARAM_TYPE_REAL32
            self.known[message.param_id] = struct.unpack("<f" if is_real else "<i", raw)[0]

    def set(self, name, value):
        """Sets a parameter until the vehicle says so."""

        def is_known():
            if self.known.get(name) != value:
                self.mav.mav.param_set_send(1, 1, name.encode(), value, MAVLINK.MAV_PARAM_TYPE_REAL32)
            return self.known.get(name) == value

        return self.hold(is_known, 10)

    def shows(self):
        """True if RC_CHANNELS has what was sent."""
        shown = self.shown
        if shown is None or shown.chancount != 8 or shown.rssi != 255:
            return False
        raw = [getattr(shown, f"chan{number}_raw") for number in range(1, 19)]
        return raw == self.channels + [LEFT_ALONE] * 10


def main():
    session, served = Session("radio"), Served()
    station = Transmitter(served.station)

    def step(what, holds):
        if holds:
            session.line(f"{what}: ok")
        else:
            session.fail(what, f"armed {station.armed}, {station.height_m:.1f} m, {station.shown}")

    step("RC_MAP_KILL_SW set", station.set("RC_MAP_KILL_SW", KILL + 1))
    step("RC_CHANNELS shows what is sent", station.hold(station.shows, 10))
    station.shown = None
    station.mav.mav.command_long_send(
        1, 1, MAVLINK.MAV_CMD_REQUEST_MESSAGE, 0, MAVLINK.MAVLINK_MSG_ID_RC_CHANNELS, 0, 0, 0, 0, 0, 0
    )
    step("RC_CHANNELS on request", station.hold(station.shows, 2))

    def arms():
        # Moved again and again until the vehicle is ready.
        station.channels[ARM] = 2000 if station.armed or time.monotonic() % 2 > 1 else 1000
        return station.armed

    step("armed by its switch", station.hold(arms, 40))
    station.channels[THROTTLE] = 1900
    step("climbs by the throttle", station.hold(lambda: station.height_m > 3, 15))
    station.channels[THROTTLE] = 1500
    end = time.monotonic() + 3
    station.hold(lambda: time.monotonic() > end, 3)
    step("hovers", station.armed and station.height_m > 2.5)
    station.channels[KILL] = 2000
    step("stopped by the kill switch", station.hold(lambda: not station.armed, 5))
    session.end(served)


if __name__ == "__main__":
    main()
