"""MAVSDK-Python's own examples, unchanged, each with a vehicle of its own: what each prints, and how it ends.

The examples are those of COMMIT, in the folder EXAMPLES (target/clients/examples), fetched from GitHub if they are not
there. Their package `mavsdk` is `mavsdk_grpc` here, which has the same API; ports are free ones, so that several run at
a time. Without arguments the quick ones run, those in QUICK; `all` takes every one, names some."""

import asyncio
import contextlib
import os
import pathlib
import signal
import sys
import urllib.request

from served import PATIENCE, Served, Session, free_port

COMMIT = "4fab80e453072b8404313ebccb41c5fc04942aa5"
SOURCE = f"https://raw.githubusercontent.com/mavlink/MAVSDK-Python/{COMMIT}/examples"
FOLDER = pathlib.Path(os.environ.get("EXAMPLES", "target/clients/examples"))

# Name, seconds after which it is ended, what its last lines must contain.
EXAMPLES = {
    "do_orbit": (110, "--- Landing"),
    "failure_injection": (60, "SYS_FAILURE_EN"),
    "follow_me_example": (60, "FollowMeError"),
    # Its circle of radius 0 is refused by MAVSDK itself; without it, the upload is accepted.
    "geofence": (40, "INVALID_ARGUMENT"),
    "manual_control": (45, "-- Starting manual control"),
    "mission_import": (30, "Mission uploaded"),
    "mission_raw": (30, "-- Done"),
    "offboard_attitude": (70, "-- Stopping offboard"),
    "offboard_position_ned": (70, "-- Stopping offboard"),
    "offboard_position_velocity_ned": (70, "-- Stopping offboard"),
    "offboard_velocity_body": (90, "-- Stopping offboard"),
    "offboard_velocity_ned": (70, "-- Stopping offboard"),
    "shell": (25, "Connected"),
    "tune": (30, "Tune played"),
}
QUICK = ["geofence", "mission_import", "mission_raw", "tune"]
# Those that go on for ever.
ENDLESS = ["manual_control", "shell"]
# What the vehicle says beside what the client prints.
SAYS = {"tune": "there is no buzzer"}

RUNNER = """
import importlib, os, pkgutil, runpy, sys
import mavsdk_grpc

class System(mavsdk_grpc.System):
    def __init__(self, **options):
        super().__init__(**{"port": int(os.environ["PORT"]), **options})

    async def connect(self, system_address=None):
        await super().connect(system_address=f"udpin://0.0.0.0:{os.environ['UDP']}")

sys.modules["mavsdk"] = mavsdk_grpc
for module in pkgutil.iter_modules(mavsdk_grpc.__path__):
    if module.name not in ("bin", "generate"):
        sys.modules[f"mavsdk.{module.name}"] = importlib.import_module(f"mavsdk_grpc.{module.name}")
mavsdk_grpc.System = System
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""


def fetched(name):
    """Returns the path of a file among the examples."""
    path = FOLDER / name
    if not path.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        with urllib.request.urlopen(f"{SOURCE}/{name}", timeout=30) as answer:
            path.write_bytes(answer.read())
    return path.resolve()


async def run(name):
    """Runs an example; returns what it printed, without repetitions, and its vehicle's texts."""
    seconds, expected = EXAMPLES[name]
    path = fetched(f"{name}.py")
    served = Served()
    environment = {**os.environ, "UDP": str(served.companion), "PORT": str(free_port()), "PYTHONUNBUFFERED": "1"}
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", RUNNER, str(path), cwd=FOLDER, env=environment,
        start_new_session=True, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT)
    printed = []

    async def read():
        async for line in process.stdout:
            text = line.decode(errors="replace").rstrip()
            if text and text not in printed:
                printed.append(text)
            if name == "shell" and "Connected" in text:
                process.stdin.write(b"help\n")
                await process.stdin.drain()

    # Not until the pipe closes: the client's own server has it, and outlives an example that fails.
    reading = asyncio.ensure_future(read())
    try:
        await asyncio.wait_for(process.wait(), seconds * (1 if name in ENDLESS else PATIENCE))
        await asyncio.sleep(0.5)
    except asyncio.TimeoutError:
        if name not in ENDLESS:
            printed.append("ENDED AFTER ITS TIME")
    reading.cancel()
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    texts = [line for line in served.said if "vehicle 1: " in line]
    code = served.quit()
    told = "\n".join(printed)
    if code != 0 or expected not in told or "ENDED AFTER" in told:
        raise RuntimeError(f"exit code {code}, printed {printed[-12:]}, the vehicle said {texts[-8:]}")
    if name in SAYS and not any(SAYS[name] in text for text in texts):
        raise RuntimeError(f"the vehicle did not say {SAYS[name]}: {texts[-8:]}")
    last = [line for line in printed if not line.startswith((" ", "Traceback"))][-3:]
    said = texts[-1].split("vehicle 1: ")[-1] if texts else "nothing"
    return f"{' | '.join(last)} || vehicle: {said}"


async def main(session, names):
    if "mission_import" in names:
        fetched("example-mission.plan")
    # As many at a time as this machine flies in real time.
    places = asyncio.Semaphore(int(os.environ.get("AT_A_TIME", "4")))

    async def one(name):
        async with places:
            seconds, _ = EXAMPLES[name]
            await session.step(name, run(name), seconds + 20)

    await asyncio.gather(*(one(name) for name in names))


if __name__ == "__main__":
    chosen = sys.argv[1:] or QUICK
    session = Session("examples")
    asyncio.run(main(session, sorted(EXAMPLES) if chosen == ["all"] else chosen))
    if session.failed:
        session.line(f"{len(session.failed)} failed: {', '.join(session.failed)}")
        sys.exit(1)
    session.line("all passed")
