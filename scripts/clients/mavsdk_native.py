"""A flight by MAVSDK 4.1's own binding, in short: health, takeoff, land, disarmed."""

import asyncio
import os

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.logging import log_subscribe

from served import Served, Session

OPTIONS = os.environ.get("SERVE_OPTIONS", "").split()


async def first(stream, wanted):
    """Returns the first of a stream that is wanted."""
    async for item in stream:
        if wanted(item):
            return item


async def run():
    log_subscribe(lambda *_: True)
    session, served = Session("mavsdk-native"), Served(*OPTIONS)
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://0.0.0.0:{served.companion}")
        drone = await session.step("connect", mavsdk.first_autopilot(timeout_s=15.0), 20)
        if drone is None:
            session.fail("connect", "no autopilot")
        action, telemetry = ActionAsync(drone), TelemetryAsync(drone)
        healthy = first(telemetry.subscribe_health_all_ok(), lambda ok: ok)
        await session.step("health all ok", healthy, 60)
        await session.step("arm", action.arm())
        await session.step("takeoff", action.takeoff())
        await session.step("in air", first(telemetry.subscribe_in_air(), lambda flies: flies), 20)
        climbed = first(telemetry.subscribe_position(), lambda it: it.relative_altitude_m > 1.5)
        await session.step("climbed", climbed, 20)
        await session.step("land", action.land())
        await session.step("armed", first(telemetry.subscribe_armed(), lambda armed: not armed), 60)
        session.end(served)


asyncio.run(run())
