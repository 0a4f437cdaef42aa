"""A flight by MAVSDK's Python API of the examples (mavsdk-grpc): everything that issue trackers ask about first."""

import asyncio
import math
import os
import subprocess
import tempfile

from mavsdk_grpc import System
from mavsdk_grpc.ftp import FtpError
from mavsdk_grpc.log_files import LogFilesError
from mavsdk_grpc.mission import MissionItem, MissionPlan
from mavsdk_grpc.offboard import Attitude, PositionNedYaw, VelocityBodyYawspeed, VelocityNedYaw
from mavsdk_grpc.telemetry import LandedState

from served import SITL, Served, Session, free_port
from socket import SOCK_STREAM

METRES_PER_DEGREE = 111_195
STORE = os.path.join(tempfile.mkdtemp(), "parameters")
OPTIONS = os.environ.get("SERVE_OPTIONS", "").split()


async def first(stream, wanted=lambda _: True):
    """Returns the first of a stream that is wanted."""
    async for item in stream:
        if wanted(item):
            return item


async def connect(served):
    drone = System(port=free_port(SOCK_STREAM))
    await drone.connect(system_address=f"udpin://0.0.0.0:{served.companion}")
    await first(drone.core.connection_state(), lambda state: state.is_connected)
    return drone


async def near(drone, north, east, down, within=1.5):
    """Waits until the vehicle is at this place, and slow."""
    def there(at):
        place, speed = at.position, at.velocity
        off = math.dist((place.north_m, place.east_m, place.down_m), (north, east, down))
        return off < within and math.hypot(speed.north_m_s, speed.east_m_s, speed.down_m_s) < 1.0
    at = await first(drone.telemetry.position_velocity_ned(), there)
    return f"{at.position.north_m:.1f} {at.position.east_m:.1f} {at.position.down_m:.1f} m"


async def above(drone, latitude, longitude, height, within=2.0):
    """Waits until the vehicle is so high above this place; its height counts from home."""
    def there(at):
        north = (at.latitude_deg - latitude) * METRES_PER_DEGREE
        east = (at.longitude_deg - longitude) * METRES_PER_DEGREE * math.cos(math.radians(latitude))
        return math.hypot(north, east, at.relative_altitude_m - height) < within
    at = await first(drone.telemetry.position(), there)
    return f"{at.latitude_deg:.6f} {at.longitude_deg:.6f}, {at.relative_altitude_m:.1f} m above home"


async def mode(drone, name):
    return str(await first(drone.telemetry.flight_mode(), lambda mode: mode.name == name))


async def where(drone):
    return (await first(drone.telemetry.position_velocity_ned())).position


async def landed(drone):
    await first(drone.telemetry.landed_state(), lambda state: state == LandedState.ON_GROUND)
    await first(drone.telemetry.armed(), lambda armed: not armed)


async def versions(drone):
    version = await drone.info.get_version()
    product = await drone.info.get_product()
    identification = await drone.info.get_identification()
    return f"{version.flight_sw_major}.{version.flight_sw_minor}, {product}, {identification.hardware_uid[:8]}"


async def read_all(drone):
    """All parameters of the vehicle, and no others."""
    exported = subprocess.run([SITL, "params", "export"], check=True, capture_output=True, text=True).stdout
    lines = [line.split("\t") for line in exported.splitlines() if line and not line.startswith("#")]
    everything = await drone.param.get_all_params()
    floats, whole = ({one.name for one in some} for some in (everything.float_params, everything.int_params))
    if (floats, whole) != tuple({name for _, _, name, _, kind in lines if kind == wanted} for wanted in ("9", "6")):
        raise ValueError(f"{len(floats)} and {len(whole)} of {len(lines)}")
    return f"{len(floats)} numbers, {len(whole)} whole"


async def set_one(drone, name, value):
    await drone.param.set_param_float(name, value)
    got = await drone.param.get_param_float(name)
    if got != value:
        raise ValueError(f"{name} is {got}, not {value}")
    return f"{name} = {got}"


async def refused(doing):
    """The answer to a question about what the vehicle does not have: no silence, which MAVSDK calls a timeout."""
    try:
        return f"answered: {await doing}"
    except (FtpError, LogFilesError) as error:
        name = error._result.result.name
        if name == "TIMEOUT":
            raise
        return f"refused, {name}"


async def offboard_position(drone, place):
    def target(north):
        return PositionNedYaw(place.north_m + north, place.east_m, place.down_m, 90.0)
    await drone.offboard.set_position_ned(target(0))
    await drone.offboard.start()
    await mode(drone, "OFFBOARD")
    await drone.offboard.set_position_ned(target(5))
    return await near(drone, place.north_m + 5, place.east_m, place.down_m)


async def offboard_velocity(drone, metres=3):
    """Forward at 1 m/s, in body axes, heading east; then north."""
    before = await where(drone)
    await drone.offboard.set_velocity_body(VelocityBodyYawspeed(1.0, 0.0, 0.0, 0.0))
    flown = before.east_m + metres
    at = await first(drone.telemetry.position_velocity_ned(), lambda at: at.position.east_m > flown)
    east, north = at.position.east_m - before.east_m, at.position.north_m - before.north_m
    if not (0.6 < at.velocity.east_m_s < 1.4 and abs(north) < 1.0):
        raise ValueError(f"flew {north:.1f} m north and {east:.1f} m east at {at.velocity.east_m_s:.1f} m/s")
    await drone.offboard.set_velocity_ned(VelocityNedYaw(1.0, 0.0, 0.0, 90.0))
    speed = await first(drone.telemetry.velocity_ned(), lambda speed: speed.north_m_s > 0.8)
    return f"{east:.1f} m east, then {speed.north_m_s:.1f} m/s north"


async def offboard_attitude(drone):
    """A tilt to the left makes it fly north, for it heads east."""
    await drone.offboard.set_attitude(Attitude(-6.0, 0.0, 90.0, 0.4))
    tilted = first(drone.telemetry.attitude_euler(), lambda angle: -9.0 < angle.roll_deg < -3.0)
    try:
        angle = await asyncio.wait_for(tilted, 8.0)
    finally:
        # It would fly on, whatever the answer.
        await drone.offboard.set_velocity_ned(VelocityNedYaw(0.0, 0.0, 0.0, 90.0))
    await first(drone.telemetry.velocity_ned(), lambda v: math.hypot(v.north_m_s, v.east_m_s, v.down_m_s) < 0.5)
    return f"roll {angle.roll_deg:.1f} degrees"


async def goto(drone, height):
    """10 m to the south."""
    home = await first(drone.telemetry.home())
    position = await first(drone.telemetry.position())
    south = position.latitude_deg - 10 / METRES_PER_DEGREE
    await drone.action.goto_location(south, position.longitude_deg, home.absolute_altitude_m + height, 90.0)
    return await above(drone, south, position.longitude_deg, height)


async def mission(drone, height):
    """Two waypoints, up and down again by return."""
    home = await first(drone.telemetry.home())

    def place(north, east):
        latitude = home.latitude_deg + north / METRES_PER_DEGREE
        return latitude, home.longitude_deg + east / (METRES_PER_DEGREE * math.cos(math.radians(latitude)))

    def item(north, east):
        latitude, longitude = place(north, east)
        nan, none = float("nan"), MissionItem.CameraAction.NONE
        vehicle = MissionItem.VehicleAction.NONE
        return MissionItem(latitude, longitude, height, 4.0, True, nan, nan, none, nan, nan, nan, nan, nan, vehicle)
    plan = MissionPlan([item(6, 0), item(6, 6)])
    await drone.mission.set_return_to_launch_after_mission(False)
    await drone.mission.upload_mission(plan)
    back = await drone.mission.download_mission()
    if len(back.mission_items) != 2:
        raise ValueError(f"{len(back.mission_items)} items came back")
    await drone.mission.start_mission()
    await mode(drone, "MISSION")
    await first(drone.mission.mission_progress(), lambda it: it.total == 2 and it.current == it.total)
    if not await drone.mission.is_mission_finished():
        raise ValueError("it is not finished")
    return await above(drone, *place(6, 6), height)


async def run():
    session = Session("mavsdk")
    store = ["--parameters", STORE]
    served = Served(*store, *OPTIONS)
    drone = await session.step("connect", connect(served), 20)
    await session.step("info", versions(drone), 20)
    await session.step("health all ok", first(drone.telemetry.health_all_ok(), lambda ok: ok), 60)
    await session.step("parameters", read_all(drone), 30)
    await session.step("logs", refused(drone.log_files.get_entries()), 2)
    await session.step("a file", refused(drone.ftp.are_files_identical(__file__, "/none")), 2)
    await session.step("set a parameter", set_one(drone, "MIS_TAKEOFF_ALT", 4.0))
    served.quit()
    served = Served(*store, *OPTIONS)
    drone = await session.step("connect again", connect(served), 20)
    kept = await session.step("kept over the restart", drone.param.get_param_float("MIS_TAKEOFF_ALT"))
    if kept != 4.0:
        session.fail("kept over the restart", kept)
    await session.step("health again", first(drone.telemetry.health_all_ok(), lambda ok: ok), 60)

    height = 4.0
    await session.step("arm", drone.action.arm())
    await session.step("armed", first(drone.telemetry.armed(), lambda armed: armed))
    await session.step("takeoff height", drone.action.set_takeoff_altitude(height))
    await session.step("takeoff", drone.action.takeoff())
    await session.step("in air", first(drone.telemetry.in_air(), lambda flies: flies), 20)
    climbed = first(drone.telemetry.position(), lambda it: it.relative_altitude_m > height - 0.7)
    await session.step("climbed", climbed, 30)
    await session.step("hold", drone.action.hold())
    await session.step("flight mode", mode(drone, "HOLD"))
    place = await where(drone)
    await session.step("offboard position", offboard_position(drone, place), 40)
    await session.step("offboard velocity", offboard_velocity(drone), 20)
    await session.step("offboard attitude", offboard_attitude(drone), 20)
    await session.step("offboard stop", drone.offboard.stop())
    await session.step("goto", goto(drone, height), 40)
    await session.step("mission", mission(drone, height), 90)
    await session.step("return", drone.action.return_to_launch())
    await session.step("flight mode", mode(drone, "RETURN_TO_LAUNCH"))
    await session.step("landed at home", landed(drone), 120)
    session.line(served.status())

    await session.step("arm again", drone.action.arm())
    await session.step("takeoff again", drone.action.takeoff())
    await session.step("climbed again", first(drone.telemetry.in_air(), lambda flies: flies), 30)
    await session.step("land", drone.action.land())
    await session.step("landed", landed(drone), 60)
    await session.step("arm a third time", drone.action.arm())
    await session.step("disarm", drone.action.disarm())
    await session.step("disarmed", first(drone.telemetry.armed(), lambda armed: not armed))
    session.end(served)


asyncio.run(run())
