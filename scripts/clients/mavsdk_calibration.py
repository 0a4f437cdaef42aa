"""MAVSDK's example calibration.py, and its cancel, with a hand that turns the simulated vehicle where it is asked to.

MAVSDK asks PX4 and ArduPilot only: for any other autopilot its calibration is "unsupported", and nothing is sent. So a
relay makes the heartbeats those of a PX4; every other byte passes as it is."""

import asyncio
import os
import socket
import threading

from mavsdk_grpc import System
from mavsdk_grpc.calibration import CalibrationError
from pymavlink.dialects.v20 import common

from served import Served, Session, free_port

OPTIONS = os.environ.get("SERVE_OPTIONS", "").split()


class Relay:
    """Passes datagrams between the vehicle and a client at the port `client`."""

    def __init__(self, served):
        self.client, self.vehicle = free_port(), None
        self.to_vehicle, self.to_client = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self.to_vehicle.bind(("127.0.0.1", served.companion))
        self.to_client.bind(("127.0.0.1", 0))
        self.parser = common.MAVLink(None)
        for direction in (self._down, self._up):
            threading.Thread(target=direction, daemon=True).start()

    def _down(self):
        while True:
            data, self.vehicle = self.to_vehicle.recvfrom(4096)
            for message in self.parser.parse_buffer(data) or []:
                frame = bytes(message.get_msgbuf())
                if message.get_type() == "HEARTBEAT":
                    writer = common.MAVLink(None, message.get_srcSystem(), message.get_srcComponent())
                    writer.seq = message.get_seq()
                    message.autopilot = common.MAV_AUTOPILOT_PX4
                    frame = message.pack(writer)
                self.to_client.sendto(frame, ("127.0.0.1", self.client))

    def _up(self):
        while True:
            try:
                data, _ = self.to_client.recvfrom(4096)
            except ConnectionError:
                continue  # The client does not listen yet.
            if self.vehicle:
                self.to_vehicle.sendto(data, self.vehicle)


async def connect(relay):
    drone = System(port=free_port(socket.SOCK_STREAM))
    await drone.connect(system_address=f"udpin://0.0.0.0:{relay.client}")
    async for state in drone.core.connection_state():
        if state.is_connected:
            return drone


async def follow(served, progress, turn=""):
    """Reads what a calibration says to its end, and puts the vehicle on the side that it waits for."""
    done, told = 0.0, []
    async for data in progress:
        if data.has_progress:
            done = data.progress
        if data.has_status_text:
            told.append(data.status_text)
            if data.status_text.startswith("pending: "):
                served.ask(f"hold {data.status_text.split()[1]} {turn}".strip())
    return f"{100 * done:.0f} %, {len(told)} texts" + (f", last: {told[-1]}" if told else "")


async def offsets(drone, prefix):
    values = [await drone.param.get_param_float(f"{prefix}_{axis}") for axis in "XYZ"]
    if not any(values):
        raise ValueError(f"{prefix} is zero")
    return " ".join(f"{value:.4f}" for value in values)


async def cancelled(drone):
    """Cancels as soon as sides are asked for."""
    try:
        async for data in drone.calibration.calibrate_accelerometer():
            if data.has_status_text and data.status_text.startswith("hold vehicle still"):
                # It waits for the answer, which nobody else does.
                asyncio.ensure_future(drone.calibration.cancel())
    except CalibrationError as error:
        if error._result.result.name == "CANCELLED":
            return "CANCELLED"
        raise
    raise ValueError("not cancelled")


async def refused(drone):
    """A vehicle that is armed."""
    try:
        async for _ in drone.calibration.calibrate_gyro():
            pass
    except CalibrationError as error:
        return error._result.result.name
    raise ValueError("calibrated while armed")


async def health(drone):
    async for ok in drone.telemetry.health_all_ok():
        if ok:
            return


async def run():
    session, served = Session("mavsdk-calibration"), Served(*OPTIONS)
    drone = await session.step("connect", connect(Relay(served)), 20)
    calibration = drone.calibration
    await session.step("gyroscope", follow(served, calibration.calibrate_gyro()), 20)
    await session.step("its offset", offsets(drone, "CAL_GYRO0_OFF"))
    await session.step("cancel", cancelled(drone), 20)
    await session.step("accelerometer", follow(served, calibration.calibrate_accelerometer()), 90)
    await session.step("its offset", offsets(drone, "CAL_ACC0_OFF"))
    await session.step("magnetometer", follow(served, calibration.calibrate_magnetometer(), "90"), 120)
    await session.step("its offset", offsets(drone, "CAL_MAG0_OFF"))
    served.ask("hold none")
    await asyncio.sleep(2.0)
    await session.step("level", follow(served, calibration.calibrate_level_horizon()), 20)
    await session.step("health", health(drone), 60)
    # The estimate has begun again.
    await asyncio.sleep(5.0)
    await session.step("arm", drone.action.arm())
    await session.step("refused", refused(drone))
    session.end(served)


asyncio.run(run())
