"""Logs, files and metadata by MAVSDK's Python API of the examples (mavsdk-grpc): those of its logfile_download.py,
ftp_list_dir.py and ftp_download_file.py, and of its component metadata; and its shell, which the vehicle does not
have."""

import asyncio
import json
import os
import pathlib
import tempfile

from mavsdk_grpc import System
from mavsdk_grpc.component_metadata import MetadataType
from mavsdk_grpc.ftp import FtpError
from mavsdk_grpc.log_files import LogFilesError
from mavsdk_grpc.shell import Device

from served import Served, Session, free_port
from socket import SOCK_STREAM

# An older log among those of the vehicle, of no even number of messages.
OLD, OLD_BYTES = "log001.ulg", bytes(place * 7919 >> 3 & 0xFF for place in range(150_001))
# Another older log, and the log that is being written.
OTHER, NOW = "log002.ulg", "log003.ulg"


async def connect(served):
    drone = System(port=free_port(SOCK_STREAM))
    await drone.connect(system_address=f"udpin://0.0.0.0:{served.companion}")
    async for state in drone.core.connection_state():
        if state.is_connected:
            return drone


def same(path):
    size, content = path.stat().st_size, path.read_bytes()
    if content != OLD_BYTES:
        raise ValueError(f"{size} bytes, and others than those of the log")
    return f"{size} bytes, the same"


async def list_logs(drone, entries):
    entries += await drone.log_files.get_entries()
    sizes = [entry.size_bytes for entry in entries]
    if len(sizes) != 3 or sizes[0] != len(OLD_BYTES):
        raise ValueError(f"{entries}")
    return ", ".join(f"log {entry.id} of {entry.date[:4]}" for entry in entries)


async def download_log(drone, entry, folder):
    path = folder / "downloaded.ulg"
    async for progress in drone.log_files.download_log_file(entry, str(path)):
        if progress.progress > 1.0:
            raise ValueError(f"{progress}")
    return same(path)


async def list_folder(drone, path, *wanted):
    listed = (await drone.ftp.list_directory(path)).entries
    if sorted(entry.name for entry in listed) != sorted(wanted):
        raise ValueError(f"{listed}")
    return ", ".join(wanted)


async def download_file(drone, path, folder, burst):
    async for progress in drone.ftp.download(path, str(folder), burst):
        if progress.bytes_transferred > progress.total_bytes:
            raise ValueError(f"{progress}")
    return same(folder / OLD)


async def identical(drone, local, remote):
    if not await drone.ftp.are_files_identical(str(local), remote):
        raise ValueError("they differ")


async def refused(doing, name):
    """Something that must be refused, for this reason."""
    try:
        answer = await doing
    except (FtpError, LogFilesError) as error:
        if error._result.result.name == name:
            return f"refused, {name}"
        raise
    raise ValueError(f"answered: {answer}")


async def component(drone):
    async def ask():
        # MAVSDK asks once, and waits for ever if a datagram is lost.
        while True:
            await drone.component_metadata.request_autopilot_component()
            await asyncio.sleep(10)

    asking = asyncio.ensure_future(ask())
    try:
        async for update in drone.component_metadata.metadata_available():
            if update.type == MetadataType.PARAMETER:
                return f"{len(json.loads(update.json_metadata)['parameters'])} parameters"
    finally:
        asking.cancel()


async def shell(drone):
    answers = drone.shell.receive()
    answer = asyncio.ensure_future(anext(answers))
    # The client wants an answer once it listens for one.
    await asyncio.sleep(0.5)
    await drone.shell.send("help\n", Device.SHELL)
    told = str(await answer)
    if "no shell" not in told:
        raise ValueError(told)
    return "refused, no shell"


async def run():
    session, folder = Session("mavsdk files"), pathlib.Path(tempfile.mkdtemp())
    logs, down = folder / "logs", folder / "down"
    logs.mkdir()
    down.mkdir()
    (logs / OLD).write_bytes(OLD_BYTES)
    os.utime(logs / OLD, (1_700_000_000, 1_700_000_000))
    (logs / OTHER).write_bytes(OLD_BYTES[:1000])
    os.utime(logs / OTHER, (1_710_000_000, 1_710_000_000))
    served = Served("--ulog", str(logs))
    drone = await session.step("connect", connect(served), 20)
    entries = []
    await session.step("logs", list_logs(drone, entries))
    await session.step("download of a log", download_log(drone, entries[0], down), 20)
    await session.step("the root", list_folder(drone, "/", "etc", "log"))
    await session.step("the metadata", list_folder(drone, "/etc", "general.json", "parameters.json"))
    await session.step("the logs", list_folder(drone, "/log", OLD, OTHER, NOW))
    for burst in (False, True):
        await session.step(f"download, burst {burst}", download_file(drone, f"/log/{OLD}", down, burst), 30)
    await session.step("checksum", identical(drone, down / OLD, f"/log/{OLD}"))
    await session.step("a line for the shell", shell(drone), 5)
    await session.step("metadata of the component", component(drone), 20)
    # What is not there, what must not be changed, and the log that is being written.
    none = drone.ftp.list_directory("/none")
    await session.step("no such folder", refused(none, "FILE_DOES_NOT_EXIST"), 2)
    await session.step("out of the root", refused(drone.ftp.list_directory("/log/../.."), "FILE_DOES_NOT_EXIST"), 2)
    new = drone.ftp.create_directory("/log/new")
    await session.step("a new folder", refused(new, "FILE_PROTECTED"), 2)
    await session.step("the log of now", refused(drone.ftp.remove_file(f"/log/{NOW}"), "FILE_PROTECTED"), 2)
    await session.step("an old log removed", drone.ftp.remove_file(f"/log/{OLD}"), 2)
    if (logs / OLD).exists() or not (logs / OTHER).exists() or not (logs / NOW).exists():
        session.fail("an old log removed", f"{sorted(logs.iterdir())}")
    await session.step("logs erased", drone.log_files.erase_all_log_files(), 2)
    for _ in range(20):
        await asyncio.sleep(0.1)
        if not (logs / OTHER).exists():
            break
    else:
        session.fail("logs erased", "they are still there")
    await session.step("the logs then", list_folder(drone, "/log", NOW))
    session.end(served)


asyncio.run(run())
