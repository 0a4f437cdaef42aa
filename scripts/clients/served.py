"""A vehicle that `sitl serve` serves at free ports, and steps of a session with it, each on a line."""

import asyncio
import atexit
import itertools
import os
import queue
import socket
import subprocess
import threading
import time

SITL = os.environ.get("SITL", "target/release/sitl")


# Factor on all time limits: machines are slow at times.
PATIENCE = 3
# Each process has ports of its own, none of which the system gives to anybody unasked.
PORTS = itertools.count(20_000 + os.getpid() % 500 * 20)

# Every `sitl serve` of this process.
RUNNING = []


@atexit.register
def stop_all():
    """Ends every `sitl serve`, also after an exception that nobody expected."""
    for process in RUNNING:
        process.kill()


def free_port(kind=socket.SOCK_DGRAM):
    """Returns the next port of this process that is free."""
    for port in PORTS:
        with socket.socket(socket.AF_INET, kind) as taken:
            try:
                taken.bind(("127.0.0.1", port))
                return port
            except OSError:
                pass


class Served:
    """`sitl serve`, with its lines."""

    def __init__(self, *options):
        self.station, self.companion = free_port(), free_port()
        command = [SITL, "serve", "--port", "0", "--station", f"127.0.0.1:{self.station}"]
        command += ["--companion", f"127.0.0.1:{self.companion}", *options]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        RUNNING.append(self.process)
        self.lines, self.said = queue.Queue(), []
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        for line in self.process.stdout:
            self.said.append(line.rstrip())
            if line.startswith(("ok", "error")):
                self.lines.put(line.rstrip())

    def ask(self, line):
        """Sends a line; returns the last line of its answer."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = self.lines.get(timeout=60)
        if answer.startswith("error"):
            raise RuntimeError(f"{line}: {answer}")
        return answer

    def status(self):
        """Returns the vehicle's true state, in words."""
        self.ask("status")
        return [line for line in self.said if line.startswith("vehicle ")][-1]

    def quit(self):
        """Ends it; returns its exit code."""
        if self.process.poll() is None:
            self.process.stdin.write("quit\n")
            self.process.stdin.flush()
        try:
            return self.process.wait(timeout=20 * PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return "killed"


class Session:
    """Steps, each with its own time limit [s] on a good machine; the first that fails ends it, but for KEEP_GOING."""

    def __init__(self, name):
        self.name, self.began, self.failed = name, time.monotonic(), []
        self.keep_going = "KEEP_GOING" in os.environ

    def line(self, text):
        print(f"{self.name} {time.monotonic() - self.began:6.1f} s  {text}", flush=True)

    async def step(self, what, doing, seconds=10):
        """Awaits `doing`; what it returns is told."""
        doing = asyncio.ensure_future(doing)
        # Unlike `asyncio.wait_for`, this does not wait until a client has ended what it was told to end, maybe never.
        done, _ = await asyncio.wait({doing}, timeout=seconds * PATIENCE)
        if not done:
            doing.cancel()
            return self.fail(what, f"not within {seconds * PATIENCE} s")
        try:
            result = doing.result()
        except Exception as error:  # Whatever a client throws is a failed step.
            return self.fail(what, f"{type(error).__name__}: {error}")
        self.line(f"{what}: {'ok' if result is None else result}")
        return result

    def fail(self, what, why):
        self.failed.append(what)
        self.line(f"{what}: FAILED: {why}")
        if not self.keep_going:
            self.exit(1)

    def end(self, served):
        code = served.quit()
        if code != 0:
            self.failed.append("quit")
            self.line(f"sitl serve: exit code {code}")
        if self.failed:
            tail = "\n".join([line for line in served.said if not line.startswith(("ok", "vehicle"))][-40:])
            self.line(f"{len(self.failed)} steps failed: {', '.join(self.failed)}; sitl serve said\n{tail}")
            self.exit(1)
        self.line("all steps passed")
        self.exit(0)

    @staticmethod
    def exit(code):
        """Ends the process without waiting for the client library's threads: some wait for each other for ever."""
        stop_all()
        os._exit(code)
