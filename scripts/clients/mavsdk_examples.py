"""MAVSDK-Python's own examples, unchanged, each with a vehicle of its own: what each prints, and how it ends.

The examples are those of COMMIT, in the folder EXAMPLES (target/clients/examples), fetched from GitHub if they are not
there. Their package `mavsdk` is `mavsdk_grpc` here, which has the same API; ports are free ones, so that several run at
a time. Without arguments the quick ones run, those in QUICK; `all` takes every one, names some."""

import asyncio
import contextlib
import dataclasses
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import urllib.request

from served import PATIENCE, SITL, Served, Session, free_port

COMMIT = "4fab80e453072b8404313ebccb41c5fc04942aa5"
SOURCE = f"https://raw.githubusercontent.com/mavlink/MAVSDK-Python/{COMMIT}/examples"
FOLDER = pathlib.Path(os.environ.get("EXAMPLES", "target/clients/examples"))
OWN = pathlib.Path(tempfile.mkdtemp())
LOGS, PARAMETERS = str(OWN / "logs"), str(OWN / "own.params")



@dataclasses.dataclass(frozen=True)
class Example:
    """How an example is run, and what must come of it."""

    # Seconds after which it is ended.
    seconds: int
    # What it must print, and what the vehicle must say beside that.
    prints: str
    says: str = ""
    # True if it goes on for ever.
    endless: bool = False
    # Its arguments, `sitl serve`'s, and files beside it.
    arguments: tuple = ()
    serve: tuple = ()
    files: tuple = ()


FOREVER = {"endless": True}
EXAMPLES = {
    "all_params": Example(40, "MIS_TAKEOFF_ALT: 2.5"),
    # The plugin asks PX4 and ArduPilot only; scripts/clients/mavsdk_calibration.py has it ask.
    "calibration": Example(40, "CalibrationError"),
    "do_orbit": Example(110, "--- Landing"),
    "failure_injection": Example(60, "SYS_FAILURE_EN"),
    "firmware_version": Example(30, "flight_sw_major"),
    "follow_me_example": Example(40, "FollowMeError", "no such parameter"),
    "ftp_download_file": Example(40, "FILE_DOES_NOT_EXIST"),
    "ftp_list_dir": Example(30, "FilesystemEntry"),
    # Its circle of radius 0 is refused by MAVSDK itself; without it, the upload is accepted.
    "geofence": Example(40, "INVALID_ARGUMENT"),
    "goto": Example(60, "Staying connected", "hold: ordered", **FOREVER),
    "highres_imu": Example(30, "Acceleration", **FOREVER),
    "logfile_download": Example(60, "Downloading: log 0", serve=("--ulog", LOGS)),
    "manual_control": Example(45, "-- Starting manual control", **FOREVER),
    "mission": Example(150, "Mission progress: 3/3"),
    "mission_import": Example(30, "Mission uploaded", files=("example-mission.plan",)),
    "mission_raw": Example(30, "-- Done", files=("example-mission.plan",)),
    "offboard_attitude": Example(70, "-- Stopping offboard"),
    "offboard_from_csv": Example(200, "-- Disarming", files=("offboard_from_csv/active.csv",)),
    "offboard_position_ned": Example(70, "-- Stopping offboard"),
    "offboard_position_velocity_ned": Example(70, "-- Stopping offboard"),
    "offboard_velocity_body": Example(90, "-- Stopping offboard"),
    "offboard_velocity_ned": Example(70, "-- Stopping offboard"),
    "rtcm": Example(30, "", "RTK corrections are not supported", **FOREVER),
    # It ends before anything can be typed; scripts/clients/mavsdk_files.py types.
    "shell": Example(25, "nsh>"),
    "takeoff_and_land": Example(60, "-- Landing"),
    "telemetry": Example(20, "Battery", **FOREVER),
    "telemetry_flight_mode": Example(20, "FlightMode: HOLD", **FOREVER),
    "telemetry_is_armed_is_in_air": Example(20, "Is_in_air: False", **FOREVER),
    "telemetry_status_text": Example(20, "Connected", **FOREVER),
    "telemetry_takeoff_and_land": Example(120, "Landing"),
    "tune": Example(30, "Tune played", "the vehicle has no buzzer"),
    "upload_params": Example(60, "Params uploaded!", arguments=("udpin://0.0.0.0:14540", PARAMETERS)),
}
QUICK = ["geofence", "mission_import", "mission_raw", "tune"]

RUNNER = """
import importlib, os, pkgutil, runpy, sys
import mavsdk_grpc

class System(mavsdk_grpc.System):
    def __init__(self, **options):
        super().__init__(port=int(os.environ["PORT"]))

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
        path.parent.mkdir(parents=True, exist_ok=True)
        with urllib.request.urlopen(f"{SOURCE}/{name}", timeout=30) as answer:
            path.write_bytes(answer.read())
    return path.resolve()


async def run(name):
    """Runs an example; returns what it printed, without repetitions, and its vehicle's texts."""
    example = EXAMPLES[name]
    for file in example.files:
        fetched(file)
    path = fetched(f"{name}/{name}.py" if name == "offboard_from_csv" else f"{name}.py")
    served = Served(*example.serve)
    environment = {**os.environ, "UDP": str(served.companion), "PORT": str(free_port()), "PYTHONUNBUFFERED": "1"}
    process = await asyncio.create_subprocess_exec(
        *[sys.executable, "-c", RUNNER, str(path), *example.arguments],
        cwd=path.parent, env=environment, start_new_session=True,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
    )
    printed, unended, refused = [], [""], asyncio.Event()

    def add(text):
        if text.strip() and text not in printed:
            printed.append(text.rstrip())

    async def read():
        while chunk := await process.stdout.read(4096):
            *lines, unended[0] = re.split(r"[\r\n]+", unended[0] + chunk.decode(errors="replace"))
            for text in lines:
                add(text)
                # Python does not end after an error of the client's.
                if text.startswith("mavsdk_grpc."):
                    refused.set()

    # Not until the pipe closes: the client's own server has it, and outlives an example that fails.
    reading = asyncio.ensure_future(read())
    try:
        ends = [asyncio.ensure_future(end) for end in (process.wait(), refused.wait())]
        waiting = asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
        await asyncio.wait_for(waiting, example.seconds * (1 if example.endless else PATIENCE))
        await asyncio.sleep(0.5)
    except asyncio.TimeoutError:
        if not example.endless:
            printed.append("ENDED AFTER ITS TIME")
    reading.cancel()
    add(unended[0])
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    texts = [line for line in served.said if "vehicle 1: " in line]
    code = served.quit()
    told = "\n".join(printed)
    if code != 0 or example.prints not in told or "ENDED AFTER" in told:
        raise RuntimeError(f"exit code {code}, printed {printed[-12:]}, the vehicle said {texts[-8:]}")
    if not any(example.says in text for text in [*texts, ""]):
        raise RuntimeError(f"the vehicle did not say {example.says}: {texts[-8:]}")
    last = [line for line in printed if not line.startswith((" ", "Traceback"))][-2:]
    said = texts[-1].split("vehicle 1: ")[-1] if texts else "nothing"
    return f"{' / '.join(line[-100:] for line in last)} || vehicle: {said}"


async def main(session, names):
    (OWN / "logs").mkdir()
    subprocess.run([SITL, "params", "export", "--vehicle", "paper", "--out", PARAMETERS], check=True, capture_output=True)
    # As many at a time as this machine flies in real time.
    places = asyncio.Semaphore(int(os.environ.get("AT_A_TIME", "4")))

    async def one(name):
        async with places:
            await session.step(name, run(name), EXAMPLES[name].seconds + 20)

    await asyncio.gather(*(one(name) for name in names))


if __name__ == "__main__":
    chosen = sys.argv[1:] or QUICK
    session = Session("examples")
    asyncio.run(main(session, sorted(EXAMPLES) if chosen == ["all"] else chosen))
    if session.failed:
        session.line(f"{len(session.failed)} failed: {', '.join(session.failed)}")
        sys.exit(1)
    session.line("all passed")
