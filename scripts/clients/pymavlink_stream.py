"""The black box's log while it is made, by pymavlink, as PX4's mavlink_ulog_streaming.py gets it: definitions are
acknowledged, after a loss the next whole record is found by its offset. The log must be one for pyulog's rules."""

import asyncio
import collections
import os
import random

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

from served import PATIENCE, Served, Session

# A ULog with that many bytes of data, of which this part is lost on purpose.
BYTES, LOST = 400_000, 0.02
chance = random.Random(1)


class Receiver:
    """Puts parts together; of what is lost, whole records are missing."""

    def __init__(self, link):
        self.link, self.log, self.next, self.lost, self.acked = link, bytearray(), 0, 0, 0
        self.in_step = True

    def take(self, part):
        acked = part.get_type() == "LOGGING_DATA_ACKED"
        if chance.random() < LOST:
            self.lost += not acked
            return
        if acked and chance.random() > LOST:
            self.link.mav.logging_ack_send(1, 1, part.sequence)
        behind = (part.sequence - self.next) % 65_536
        if behind > 60_000:
            return  # One that is here already, sent again.
        data, first = bytes(part.data[: part.length]), part.first_message_offset
        if behind:
            assert not acked, "a part with definitions is never skipped"
            self.in_step = False
            # What was begun before the loss is no record.
            self.log = self.log[: whole(self.log)[1]]
        if not self.in_step:
            if first == 255:
                self.next = (part.sequence + 1) % 65_536
                return
            data, self.in_step = data[first:], True
        self.acked += acked
        self.log += data
        self.next = (part.sequence + 1) % 65_536


def whole(log):
    """Returns the kinds of the whole records, and where they end."""
    kinds, at = collections.Counter(), 16
    while at + 3 <= len(log) and at + 3 + int.from_bytes(log[at : at + 2], "little") <= len(log):
        kind = chr(log[at + 2])
        if kind not in "BFIMPQADLSO":
            raise ValueError(f"no record at byte {at}: {bytes(log[at:at + 20])}")
        kinds[kind] += 1
        at += 3 + int.from_bytes(log[at : at + 2], "little")
    return kinds, at


def command(link, number):
    """Commands until it is answered, as MAVLink has it: beside a stream, answers get lost in the system's buffers."""
    for confirmation in range(5):
        link.mav.command_long_send(1, 1, number, confirmation, *[0.0] * 7)
        while answer := link.recv_match(type="COMMAND_ACK", blocking=True, timeout=PATIENCE / 5):
            if answer.command == number:
                return answer.result
    return None


def stream(link):
    if (result := command(link, mavutil.mavlink.MAV_CMD_LOGGING_START)) != 0:
        raise ValueError(f"started: {result}")
    receiver = Receiver(link)
    while len(receiver.log) < BYTES:
        part = link.recv_match(type=["LOGGING_DATA", "LOGGING_DATA_ACKED"], blocking=True, timeout=PATIENCE)
        if part is None:
            raise ValueError(f"nothing after {len(receiver.log)} bytes")
        receiver.take(part)
    if not receiver.log.startswith(b"ULog\x01\x12\x35"):
        raise ValueError(f"no ULog: {bytes(receiver.log[:40])}")
    kinds, _ = whole(receiver.log)
    if kinds["P"] < 200 or kinds["F"] < 20 or kinds["A"] < 20 or kinds["D"] < 1000 or not receiver.lost:
        raise ValueError(f"{kinds}, {receiver.lost} parts lost")
    parts = f"{receiver.acked} parts acknowledged, {receiver.lost} others lost"
    return f"{len(receiver.log)} bytes, {parts}, {kinds['D']} messages of data"


def stopped(link):
    if (result := command(link, mavutil.mavlink.MAV_CMD_LOGGING_STOP)) != 0:
        raise ValueError(f"stopped: {result}")
    # What was on its way.
    while link.recv_match(type="LOGGING_DATA", blocking=True, timeout=0.5):
        pass


async def run():
    session = Session("pymavlink stream")
    served = Served()
    link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{served.companion}", source_system=245)
    link.wait_heartbeat(timeout=20 * PATIENCE)
    for what, doing in [("a log as it is made", stream), ("stopped", stopped), ("another log", stream)]:
        await session.step(what, asyncio.to_thread(doing, link), 30)
    session.end(served)


asyncio.run(run())
