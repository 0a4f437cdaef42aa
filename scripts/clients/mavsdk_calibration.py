"""MAVSDK's example calibration.py, and its cancel, with a hand that turns the simulated vehicle where it is asked to."""

import asyncio
import os

from mavsdk_grpc import System
from mavsdk_grpc.calibration import CalibrationError

from served import Served, Session, free_port
from socket import SOCK_STREAM

OPTIONS = os.environ.get("SERVE_OPTIONS", "").split()


async def connect(served):
    drone = System(port=free_port(SOCK_STREAM))
    await drone.connect(system_address=f"udpin://0.0.0.0:{served.companion}")
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
    drone = await session.step("connect", connect(served), 20)
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
    await session.step("arm", drone.action.arm())
    await session.step("refused", refused(drone))
    session.end(served)


asyncio.run(run())
