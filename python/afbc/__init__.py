"""Adaptive fuzzy backstepping control (AFBC) of a quadrotor, other control laws, and the plant that they fly.

The package runs the same compiled code as `sitl`. A flight gives the same bits in Python, in `sitl` and on a board.

Frames: earth z up, body x forward, y left, z up. Attitudes are Euler angles roll, pitch, yaw (z-y-x). Units are SI, and
each name ends in its unit.

    >>> import afbc
    >>> flight = afbc.fly("hover", ["afbc"])["afbc"]
    >>> flight.lost is None, len(flight["z_m"]) == len(flight)
    (True, True)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from typing import Any, Protocol

from numpy.typing import ArrayLike

from . import _afbc, _check
from ._afbc import (
    Action,
    AfbcError,
    Batch,
    Controller,
    Estimator,
    Flight,
    FlightCore,
    Guidance,
    Instruments,
    OwnVehicle,
    Plant,
    Scenario,
    Setpoint,
    State,
    Vehicle,
    __version__,
    campaigns,
    laws,
    scenarios,
    vehicles,
)

__all__ = [
    "Action",
    "AfbcError",
    "Batch",
    "Controller",
    "Estimator",
    "Flight",
    "FlightCore",
    "Guidance",
    "Instruments",
    "Law",
    "OwnVehicle",
    "Plant",
    "Scenario",
    "Setpoint",
    "State",
    "Vehicle",
    "campaign",
    "campaigns",
    "compare",
    "fly",
    "frame",
    "laws",
    "merge",
    "register",
    "replay",
    "scenarios",
    "tune",
    "vehicles",
]

_Path = str | PathLike[str]
_Named = Scenario | _Path


class Law(Protocol):
    """A control law written by the user."""

    def step(self, state: State, setpoint: Setpoint, fresh: bool) -> ArrayLike:
        """Returns the demanded U1, U2, U3, U4 [N]. A state that is not `fresh` repeats the last one."""


_Make = Callable[[OwnVehicle], Law]
_Controllers = str | Sequence[str] | Mapping[str, _Make | None] | None


@contextmanager
def _bar(shown: bool, total: int | None, unit: str) -> Iterator[Callable[[int], object] | None]:
    """Yields a function to call with the number of finished units: it moves a tqdm bar. Yields None without a bar."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        tqdm = None
    if not shown or tqdm is None:
        yield None
        return
    with tqdm(total=total, unit=unit) as bar:
        yield lambda done: bar.update(done - bar.n)


def frame(columns: Mapping[str, Any]) -> Any:
    """Returns columns as a data frame of polars, else of pandas; the columns themselves if neither is installed.

    `columns` is a flight's log, as in `frame(flight.columns)`. `compare`, `campaign` and `replay` call this themselves.
    """
    columns = _check.mapping("columns", columns, "a mapping of names to arrays is")
    try:
        import polars
    except ImportError:
        pass
    else:
        return polars.DataFrame(dict(columns))
    try:
        import pandas
    except ImportError:
        return columns
    return pandas.DataFrame(dict(columns))


def register(
    name: str,
    make: _Make,
    *,
    title: str | None = None,
    gains: Mapping[str, float | tuple[float, float, float]] | None = None,
) -> None:
    """Registers a law of your own, which then flies wherever a built-in one does: in `fly`, `compare`, `campaign`,
    `tune`, scenario files and vehicle files.

    `make(vehicle)` is called at the start of each flight with an `OwnVehicle`; a class with that constructor will do.
    It returns an object whose `step(state, setpoint, fresh)` returns the demanded U1, U2, U3, U4 [N] in every time
    step. U1 and U2 are the moments about body x and y divided by the arm, U3 is the moment about body z divided by
    d/b, and U4 is the thrust. A state that is not `fresh` repeats the last one. `gains` maps each name to (default,
    smallest, largest) or to a default. `tune` searches this range; without one, it searches from a twentieth of the
    default to twenty times the default. A law of the same name is replaced.
    """
    gains = _check.mapping("gains", {} if gains is None else gains, "a mapping of names to numbers is")
    _afbc.register(name, make, title=title, gains=[(gain, _range(gain, value)) for gain, value in gains.items()])


def _range(gain: str, value: Any) -> tuple[float, float, float]:
    """Returns default, smallest and largest value of a gain."""
    if not isinstance(gain, str):
        raise TypeError(f"gains: names are needed as keys, not {gain!r}")
    name = f"gains[{gain!r}]"
    given = value if isinstance(value, (tuple, list)) else (value,)
    default, *ends = (_check.number(name, number, -1e30, 1e30) for number in given) if given else (0.0,)
    if len(given) not in (1, 3) or (not ends and default == 0.0):
        raise AfbcError(f"{name}: {value!r} given; a default other than 0, or (default, smallest, largest) is needed")
    low, high = ends or sorted((default / 20, default * 20))
    return default, low, high


def _controllers(controllers: _Controllers) -> list[str] | None:
    """Returns the names of the controllers. If a mapping of names to laws is given, registers the laws first."""
    if controllers is None or isinstance(controllers, str):
        return None if controllers is None else [controllers]
    if not isinstance(controllers, Mapping):
        return _check.several("controllers", controllers, "names, or a mapping of names to laws, are")
    for name, make in controllers.items():
        if make is not None:
            register(name, make)
    return list(controllers)


def _list(scenarios: _Named | Sequence[_Named]) -> list[_Named]:
    """Returns one or several scenarios as a list."""
    if isinstance(scenarios, (str, Scenario, PathLike)):
        return [scenarios]
    return _check.several("scenarios", scenarios, "an afbc.Scenario, a name, a path, or several of them are")


def fly(
    scenario: _Named,
    controllers: _Controllers = None,
    *,
    vehicle: Vehicle | _Path | None = None,
    seed: int | None = None,
    duration_s: float | None = None,
    log_hz: int | None = None,
    threads: int | None = None,
    progress: bool = False,
) -> dict[str, Flight]:
    """Flies a scenario and returns the flights by contender. They equal those of `sitl fly` in every bit.

    `scenario` is a `Scenario`, the name of a built-in one, or the path of a file. `controllers` are names of the
    scenario's contenders or of laws. A mapping of names to laws of your own registers these (None for a built-in law).
    By default, all of the scenario's contenders fly.
    """
    names = _controllers(controllers)
    with _bar(progress, len(names) if names else None, "flight") as shown:
        return _afbc.fly(
            scenario,
            names,
            vehicle=vehicle,
            seed=seed,
            duration_s=duration_s,
            log_hz=log_hz,
            threads=threads,
            progress=shown,
        )


def compare(
    scenarios: _Named | Sequence[_Named],
    controllers: _Controllers = None,
    *,
    vehicle: Vehicle | _Path | None = None,
    seeds: int | None = None,
    threads: int | None = None,
    progress: bool = False,
) -> Any:
    """Flies scenarios under the same contenders, each with `seeds` consecutive seeds, on all cores.

    The defaults are those of `sitl compare`: ten seeds, or one for a scenario that no seed changes. Returns a data
    frame (see `frame`) with a row for each flight: scenario, contender, seed, lost_at_s, lost_reason and the figures
    of merit.
    """
    with _bar(progress, None, "flight") as shown:
        return frame(
            _afbc.compare(
                _list(scenarios),
                _controllers(controllers),
                vehicle=vehicle,
                seeds=seeds,
                threads=threads,
                progress=shown,
            )
        )


def campaign(
    campaign: _Path,
    *,
    flights: int | None = None,
    vehicle: Vehicle | _Path | None = None,
    shard: str | None = None,
    out: _Path | None = None,
    threads: int | None = None,
    progress: bool = False,
) -> Any:
    """Flies a campaign, built in or from a file: one scenario, many times, with drawn vehicles, weather and faults.

    Returns a data frame with a row for each flight of each contender: the drawn values and the figures of merit. With
    `out`, results and report are kept in this folder, as by `sitl campaign`, and the same call resumes. `shard`, "I/N"
    with I from 1 to N, flies only every N-th flight, from the I-th on; `merge` merges all shards.
    """
    with _bar(progress, flights, "flight") as shown:
        return frame(
            _afbc.campaign(
                campaign, flights=flights, vehicle=vehicle, shard=shard, out=out, threads=threads, progress=shown
            )
        )


def merge(shards: Sequence[_Path], out: _Path) -> Any:
    """Merges the folders of all shards of a campaign into the folder `out`, with the same bytes as on one machine.

    Returns the data frame that `campaign` would return.
    """
    return frame(_afbc.merge(_check.several("shards", shards, "the folders of all shards are"), out))


def tune(
    law: str,
    scenarios: _Named | Sequence[_Named] | None = None,
    *,
    vehicle: Vehicle | _Path | None = None,
    budget: int = 1000,
    seed: int = 1,
    step: float = 0.3,
    flying: bool = False,
    threads: int | None = None,
    progress: bool = False,
) -> dict[str, Any]:
    """Searches for gains of a law by CMA-ES, as `sitl tune` does, on the training flights or on the given scenarios.

    Returns a dict: costs `before` and `after`, the number of `evaluations`, the `gains` found, and their `text` for a
    scenario or vehicle file. `flying` starts from the present flight gains instead of hand-tuned ones.
    """
    with _bar(progress, budget, "try") as shown:
        return _afbc.tune(
            law,
            None if scenarios is None else _list(scenarios),
            vehicle=vehicle,
            budget=budget,
            seed=seed,
            step=step,
            flying=flying,
            threads=threads,
            progress=shown,
        )


def replay(log: _Path) -> Any:
    """Runs the estimator over a recorded flight: a ULog of PX4 or of this firmware, or a CSV file of PX4-ECL.

    Returns a data frame with our estimate, its standard deviations, and the estimate in the log.
    """
    return frame(_afbc.replay(log))
