"""Signed frames by pymavlink: a key is set, then nothing is heard without it, and captured frames are of no use."""

import hashlib
import os
import sys
import tempfile
import time
from pathlib import Path

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402  (reads the variable)

from served import PATIENCE, Served, Session  # noqa: E402

MAVLINK = mavutil.mavlink
KEY, OTHER = bytes(range(1, 33)), bytes(range(2, 34))
# A command that every vehicle answers.
ASKED = MAVLINK.MAV_CMD_REQUEST_MESSAGE
# Beginning of 2015, in seconds since 1970.
EPOCH_S = 1_420_070_400


LATER_10US = 5 * 6_000_000


def now_10us():
    return int((time.time() - EPOCH_S) * 1e5)


class Station:
    """A connection that signs, if it has a key."""

    def __init__(self, port, key=None):
        self.mav = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", dialect="common")
        self.captured = []
        self.send = self.mav.write
        self.mav.write = lambda buffer: (self.captured.append(bytes(buffer)), self.send(buffer))[1]
        self.use(key)
        # The address to answer to.
        self.next()

    def next(self):
        """Returns the next message."""
        message = self.mav.recv_match(blocking=True, timeout=10 * PATIENCE)
        if message is None:
            sys.exit(f"signing: nothing from the vehicle within {10 * PATIENCE} s")
        return message

    def use(self, key):
        """Signs with this key from now on, and accepts what is signed with it only; none signs nothing."""
        if key is None:
            self.mav.disable_signing()
        else:
            self.mav.setup_signing(key, sign_outgoing=True, initial_timestamp=now_10us())

    def replay(self, frames):
        """Sends frames that were captured, as they are."""
        for frame in frames:
            self.send(frame)

    def set_key(self, key):
        self.mav.mav.setup_signing_send(1, 1, list(key), now_10us())

    def heard(self, seconds=1.0 * PATIENCE):
        """True if a command is answered."""
        self.mav.mav.command_long_send(1, 1, ASKED, 0, MAVLINK.MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0, 0, 0, 0, 0, 0)
        return self.answered(seconds)

    def answered(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            message = self.mav.recv_match(type="COMMAND_ACK", blocking=True, timeout=0.1)
            if message is not None and message.command == ASKED:
                return True
        return False

    def signatures(self, key, count=20):
        """Returns what is found in the next frames: "signed" or what else. By their bytes, for a frame that another has
        overtaken on its way is BAD_DATA to pymavlink, as if it were sent a second time."""
        messages = [self.next() for _ in range(count)]
        # Link and time, by which a receiver knows a frame that was sent before.
        stamps = {bytes(message.get_msgbuf()[-13:-6]) for message in messages}
        twice = set() if len(stamps) == count else {"a time twice"}
        return {signature_of(message, key) for message in messages} | twice


def signature_of(message, key):
    """Returns "signed" if the frame of a message is signed with the key, else what it is."""
    frame = message.get_msgbuf()
    if frame[0] != MAVLINK.PROTOCOL_MARKER_V2 or not frame[2] & MAVLINK.MAVLINK_IFLAG_SIGNED:
        return f"{message.get_type()} unsigned"
    code = hashlib.sha256(key + frame[:-6]).digest()[:6]
    return "signed" if code == frame[-6:] else f"{message.get_type()} of another key"


def main():
    session = Session("signing")
    with tempfile.TemporaryDirectory() as folder:
        options = ["--parameters", str(Path(folder, "vehicle.params"))]
        served = Served(*options)
        station = Station(served.station)
        check(session, "without a key, a command is heard", station.heard())
        station.set_key(KEY)
        check(session, "once there is a key, it is not", not station.heard())
        station.use(OTHER)
        check(session, "with another key, it is not", not station.heard())
        station.use(KEY)
        station.captured.clear()
        check(session, "with the key, it is", station.heard())
        found = station.signatures(KEY)
        check(session, "everything is signed with the key", found == {"signed"}, f"found {', '.join(sorted(found))}")
        station.replay(station.captured)
        check(session, "captured frames are not heard", not station.answered(1.0))
        # Later: the vehicle keeps its clock every two minutes.
        station.mav.mav.signing.timestamp += LATER_10US
        check(session, "later, a command is heard", station.heard())
        code = served.quit()
        check(session, f"ended with {code}", code == 0)

        # The key is kept, and so is the clock.
        station.mav.close()
        served = Served(*options)
        captured = station.captured
        station = Station(served.station, KEY)
        station.mav.mav.signing.timestamp += LATER_10US
        station.replay(captured)
        check(session, "after a restart, the key is needed", not station.answered(1.0) and station.heard())
        station.replay(captured)
        check(session, "captured frames are not heard then, either", not station.answered(1.0))
        station.set_key(bytes(32))
        time.sleep(0.2)
        station.use(None)
        check(session, "with the key taken back, a command is heard", station.heard())
        session.end(served)


def check(session, what, holds, otherwise="it does not hold"):
    if holds:
        session.line(what)
    else:
        session.fail(what, otherwise)


if __name__ == "__main__":
    sys.exit(main())
