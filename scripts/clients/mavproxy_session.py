"""MAVProxy without its windows: parameters, modes, arm, takeoff, land, all typed at its prompt."""

import os
import pathlib
import queue
import subprocess
import sys
import tempfile
import threading
import time

from served import PATIENCE, Served, Session

OPTIONS = os.environ.get("SERVE_OPTIONS", "").split()
# Those that need neither windows nor numerical libraries.
MODULES = "param,cmdlong,arm,mode,link,output,signing,wp,fence,rally,log,ftp"
# A log of an earlier flight, of no even number of messages.
LOG = bytes(place * 7919 >> 3 & 0xFF for place in range(50_001))


class Prompt:
    """MAVProxy at a pipe."""

    def __init__(self, port):
        program = os.path.join(os.path.dirname(sys.executable), "mavproxy.py")
        folder = tempfile.mkdtemp()
        command = [sys.executable, "-u", program, f"--master=udpin:127.0.0.1:{port}", f"--state-basedir={folder}"]
        command.append(f"--default-modules={MODULES}")
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=folder
        )
        self.text, self.new = "", queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        while chunk := os.read(self.process.stdout.fileno(), 4096):
            self.new.put(chunk.decode(errors="replace"))

    def type(self, line):
        self.text = ""
        self.process.stdin.write(line.encode() + b"\n")
        self.process.stdin.flush()

    def sees(self, *words, seconds=15):
        """Waits until one of these is printed; returns it, or none."""
        end = time.monotonic() + seconds * PATIENCE
        while time.monotonic() < end:
            found = next((word for word in words if word in self.text), None)
            if found is not None:
                return found
            try:
                self.text += self.new.get(timeout=0.2)
            except queue.Empty:
                pass
        return None

    def repeats(self, line, *words, seconds=30):
        """Types a line every few seconds until one of these is printed; returns it, or none."""
        end = time.monotonic() + seconds * PATIENCE
        while time.monotonic() < end:
            self.type(line)
            found = self.sees(*words, seconds=1)
            if found is not None:
                return found
        return None

    def end(self):
        self.process.stdin.close()
        self.process.terminate()
        self.process.wait(timeout=10 * PATIENCE)


def main():
    logs, down = pathlib.Path(tempfile.mkdtemp()), pathlib.Path(tempfile.mkdtemp())
    (logs / "log001.ulg").write_bytes(LOG)
    os.utime(logs / "log001.ulg", (1_700_000_000, 1_700_000_000))
    session, served = Session("mavproxy"), Served("--ulog", str(logs), *OPTIONS)
    prompt = Prompt(served.station)

    def typed(line, *words, seconds=15, refused=("UNSUPPORTED", "DENIED", "FAILED", "Unknown")):
        if line is not None:
            prompt.type(line)
        seen = prompt.sees(*words, *refused, seconds=seconds)
        what = line or "then"
        if seen in words:
            session.line(f"{what}: {seen}")
        else:
            session.fail(what, f"not {' or '.join(words)}: {prompt.text[-300:]!r}")

    def repeated(line, *words):
        seen = prompt.repeats(line, *words)
        if seen is None:
            session.fail(line, f"not {' or '.join(words)}: {prompt.text[-300:]!r}")
        else:
            session.line(f"{line}: {seen}")

    typed(None, "online system 1", seconds=30)
    typed(None, "Received ", seconds=30)  # "Received N parameters"
    typed("param show MIS_TAKEOFF_ALT", "MIS_TAKEOFF_ALT ")
    # Silent if it is done.
    prompt.type("param set MIS_TAKEOFF_ALT 3")
    repeated("param show MIS_TAKEOFF_ALT", "MIS_TAKEOFF_ALT  3")
    typed("log list", "Log 0  numLogs 2 lastLog 1 size 50001")
    typed(f"log download 0 {down / 'log'}", "Finished downloading", seconds=30)
    typed("ftp list /log", "log001.ulg")
    typed(f"ftp get /log/log001.ulg {down / 'file'}", "Wrote 50001", "bytes in", seconds=30)
    for name in ("log", "file"):
        # It is written a little later than it is told.
        for _ in range(20):
            if (down / name).read_bytes() == LOG:
                break
            time.sleep(0.1)
        else:
            session.fail("downloads", f"{name} is not what the log is")
    # Modes by number: hold, main mode 4 and sub mode 3, in parts and whole. ArduPilot's names mean nothing here.
    typed("long DO_SET_MODE 1 4 3 0 0 0 0", "DO_SET_MODE: ACCEPTED")
    typed("mode 50593792", "DO_SET_MODE: ACCEPTED")
    typed("mode LAND", "DO_SET_MODE: DENIED", refused=("ACCEPTED",))
    # Until there is a fix, and it has been at rest.
    repeated("arm throttle", "COMPONENT_ARM_DISARM: ACCEPTED")
    typed(None, "ARMED")
    typed("takeoff 3", "NAV_TAKEOFF: ACCEPTED", "TAKEOFF: ACCEPTED")
    for _ in range(60 * PATIENCE):
        if height(served) > 2.0:
            break
        time.sleep(0.5)
    else:
        session.fail("climbed", served.status())
    session.line(f"climbed: {height(served):.1f} m")
    typed("long NAV_LAND 0 0 0 0 0 0 0", "NAV_LAND: ACCEPTED", "LAND: ACCEPTED")
    typed(None, "DISARMED", seconds=60)
    typed("status", "MAV Errors: 0")
    prompt.end()
    session.end(served)


def height(served):
    """Returns the vehicle's true height [m]."""
    words = served.status().split("position ")[1].split()
    return float(words[2])


main()
