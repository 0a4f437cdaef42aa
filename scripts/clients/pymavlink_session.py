"""Five minutes by pymavlink: every frame is decoded, every command is answered, whatever it is; then a flight."""

import os
import sys
import time

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402  (reads the variable)

from served import PATIENCE, Served, Session  # noqa: E402

SECONDS = float(os.environ.get("LISTEN_S", "300"))
OPTIONS = os.environ.get("SERVE_OPTIONS", "").split()
MAVLINK = mavutil.mavlink
# They would end the session, or answer by silence: a shutdown and the like are for a flight of their own.
NOT_ASKED = {"MAV_CMD_ENUM_END"}


class Link:
    """A connection that counts what cannot be decoded."""

    def __init__(self, port):
        self.mav = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", dialect="all")
        self.counts, self.bad, self.beat = {}, [], 0.0

    def next(self, seconds=1.0):
        """Returns the next message, or none; keeps the heartbeat going."""
        now = time.monotonic()
        if now - self.beat > 1.0:
            self.beat = now
            self.mav.mav.heartbeat_send(MAVLINK.MAV_TYPE_GCS, MAVLINK.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        message = self.mav.recv_match(blocking=True, timeout=seconds)
        if message is None:
            return None
        kind = message.get_type()
        self.counts[kind] = self.counts.get(kind, 0) + 1
        if kind == "BAD_DATA" or kind.startswith("UNKNOWN"):
            self.bad.append(str(message)[:200])
        return message

    def until(self, kind, wanted=lambda _: True, seconds=3.0 * PATIENCE):
        """Returns the first message of this kind that is wanted, or none."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            message = self.next(max(0.01, end - time.monotonic()))
            if message is not None and message.get_type() == kind and wanted(message):
                return message
        return None

    def command(self, number, *parameters, whole=False):
        """Sends a command; returns the result of its answer, or none."""
        values = list(parameters) + [0.0] * (7 - len(parameters))
        target = (self.mav.target_system, self.mav.target_component)
        if whole:
            self.mav.mav.command_int_send(*target, 0, number, 0, 0, *values[:4], 0, 0, values[6])
        else:
            self.mav.mav.command_long_send(*target, number, 0, *values)
        answer = self.until("COMMAND_ACK", lambda ack: ack.command == number)
        return None if answer is None else answer.result


def main():
    session, served = Session("pymavlink"), Served(*OPTIONS)
    link, unanswered, asked = Link(served.station), [], 0
    if link.mav.wait_heartbeat(timeout=10 * PATIENCE) is None:
        session.fail("heartbeat", f"none within {10 * PATIENCE} s")
    session.line(f"heartbeat of system {link.mav.target_system}")
    end = time.monotonic() + SECONDS
    commands = MAVLINK.enums["MAV_CMD"]
    # All of them, as COMMAND_LONG and as COMMAND_INT, and some that nobody knows, again and again.
    numbers = [number for number, entry in commands.items() if entry.name not in NOT_ASKED] + [9, 29_999, 65_535]
    results = {}
    while time.monotonic() < end:
        for number in numbers:
            for whole in (False, True):
                if time.monotonic() >= end:
                    break
                result, asked = link.command(number, whole=whole), asked + 1
                if result is None:
                    unanswered.append((number, "int" if whole else "long"))
                else:
                    results[result] = results.get(result, 0) + 1
                # The pause of a station that does something else too.
                link.until("HEARTBEAT", seconds=0.02)
    mav = link.mav.mav
    counts = dict(sorted(link.counts.items()))
    session.line(f"{sum(counts.values())} messages of {len(counts)} kinds: {counts}")
    session.line(f"{asked} commands, answers by result: {dict(sorted(results.items()))}")
    if unanswered:
        session.fail("every command answered", f"{len(unanswered)} are not: {unanswered[:20]}")
    if link.bad or mav.total_receive_errors:
        session.fail("every frame decoded", f"{mav.total_receive_errors} errors: {link.bad[:5]}")
    session.end(served)


if __name__ == "__main__":
    sys.exit(main())
