"""What the tests share: the command line, which must agree with the package."""

import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def sitl():
    """Runs `sitl` with these arguments, and returns what it printed."""
    program = pathlib.Path(os.environ.get("SITL", ROOT / "target/release/sitl")).resolve()
    if not program.exists():
        pytest.fail(f"{program} is missing; cargo build --release, or set SITL")

    def run(*arguments, cwd, code=0):
        done = subprocess.run([program, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, timeout=300)
        assert done.returncode == code, done.stderr
        return done

    return run
