"""The task that the learning environments share: vehicles follow a scenario's reference, each in its own world."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _afbc
from ._check import SEED_MAX, finite, number, path, whole

#: Length of an observation without the last action, which has one number per rotor.
MOTION = 15
#: Largest number of vehicles.
COUNT_MAX = 100_000


class Task:
    """Steps `count` vehicles of one kind together, and computes their observations and rewards.

    Actions, shape (count, rotors): the thrust of each rotor, from -1 (none) to 1 (largest). The rotors have the lag and
    limits of the vehicle.

    Observations, shape (count, 15 + rotors), earth frame z up, body frame x forward, y left, z up:

    | numbers | what | unit |
    |---|---|---|
    | 0 to 2 | position minus the reference's | m |
    | 3 to 5 | velocity minus the reference's | m/s |
    | 6 to 8 | roll, pitch, and heading minus the reference's, within -pi to pi | rad |
    | 9 to 11 | body rates | rad/s |
    | 12 to 14 | acceleration of the reference | m/s2 |
    | 15 on | the last action | 1 |

    Observations come from the scenario's sensors. During an outage, the last measurement stays. The reward of a step is
    computed from the true motion: exp(-distance / 1 m) - 0.05 |heading error| / pi - 0.05 mean((action - last
    action)^2). Its maximum is 1, and it is 0 for the step in which a vehicle is lost. A vehicle is lost, which
    terminates its episode, when it tilts by 90 degrees or is `far_m` away from its reference. An episode is truncated
    after `duration_s`.
    """

    def __init__(
        self,
        count: int,
        scenario: _afbc.Scenario | str | PathLike[str] = "hover",
        vehicle: _afbc.Vehicle | str | PathLike[str] = "crazyflie",
        *,
        control_hz: int = 100,
        duration_s: float | None = None,
        spread_m: float = 0.5,
        spread_rad: float = 0.2,
        far_m: float = 3.0,
    ) -> None:
        count = whole("count", count, 1, COUNT_MAX)
        if 1000 % whole("control_hz", control_hz, 1, 1000):
            raise _afbc.AfbcError(f"control_hz: {control_hz} given; a divisor of 1000 is needed")
        vehicle = vehicle if isinstance(vehicle, _afbc.Vehicle) else _afbc.Vehicle(path("vehicle", vehicle))
        scenario = scenario if isinstance(scenario, _afbc.Scenario) else _afbc.Scenario(path("scenario", scenario))
        self.scenario = scenario.replace(vehicle=vehicle, duration_s=duration_s)
        self.batch = _afbc.Batch(count, self.scenario)
        self.rotors = vehicle.rotors
        self.steps = 1000 // control_hz
        self.duration_s = self.scenario.duration_s
        self.far_m = number("far_m", far_m, 1e-3, 1e6)
        self.spread_m = number("spread_m", spread_m, 0.0, 1e3)
        self.spread_rad = number("spread_rad", spread_rad, 0.0, np.pi)
        # Square of the rotor speed at the largest thrust [rad2/s2].
        self._per_share = vehicle.rotor_force_max_n / vehicle.parameters["thrust_factor_n_s2"]
        self._start = self.batch.true_states[0]
        self.actions = np.zeros((count, self.rotors))
        self._seen = np.zeros((count, 12))

    def reset(self, index: int, random: np.random.Generator) -> None:
        """Restarts a vehicle from the scenario's start, moved by up to `spread_m` along each axis and turned by up to
        `spread_rad` about each. Noise and weather get a new random seed."""
        whole("index", index, 0, len(self.batch) - 1)
        if not isinstance(random, np.random.Generator):
            raise TypeError(f"random: a numpy.random.Generator is needed, not {type(random).__name__}")
        start = self._start.copy()
        start[0:3] += random.uniform(-self.spread_m, self.spread_m, 3)
        start[6:9] += random.uniform(-self.spread_rad, self.spread_rad, 3)
        state = _afbc.State(start[0:3], start[3:6], start[6:9], start[9:12])
        self.batch.reset(index, int(random.integers(2**53)), state)
        self.actions[index] = 0.0

    def observe(self) -> NDArray[np.float32]:
        """Returns the observations."""
        states, references = self.batch.states, self.batch.references
        known = ~np.isnan(states[:, :1])
        self._seen = np.where(known, states, self._seen)
        seen = np.empty((len(states), MOTION + self.rotors), dtype=np.float32)
        seen[:, 0:6] = self._seen[:, 0:6] - references[:, 0:6]
        seen[:, 6:8] = self._seen[:, 6:8]
        seen[:, 8] = _turn(self._seen[:, 8] - references[:, 9])
        seen[:, 9:12] = self._seen[:, 9:12]
        seen[:, 12:15] = references[:, 6:9]
        seen[:, 15:] = self.actions
        return seen

    def step(
        self, actions: NDArray[np.floating]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], NDArray[np.float64]]:
        """Moves all vehicles by one action. Returns rewards, flags of lost and of timed-out vehicles, distances [m]."""
        shares = np.clip(finite("actions", actions, self.actions.shape), -1.0, 1.0)
        self.batch.step(np.sqrt((1.0 + shares) / 2 * self._per_share), self.steps)
        states, references = self.batch.true_states, self.batch.references
        distance_m = np.linalg.norm(states[:, 0:3] - references[:, 0:3], axis=1)
        turn = np.abs(_turn(states[:, 8] - references[:, 9]))
        effort = np.mean((shares - self.actions) ** 2, axis=1)
        upright = np.all(np.abs(states[:, 6:8]) < np.pi / 2, axis=1)
        lost = ~(upright & (distance_m < self.far_m))
        rewards = np.where(lost, 0.0, np.exp(-distance_m) - 0.05 * turn / np.pi - 0.05 * effort)
        self.actions = shares
        over = ~lost & (self.batch.time_s >= self.duration_s - 1e-9)
        return rewards, lost, over, distance_m


def seeds(name: str, given: Any, count: int) -> list[int | None]:
    """Returns a seed for each of `count` vehicles: consecutive ones from a single seed on, or the seeds of a list."""
    if given is None:
        return [None] * count
    if not isinstance(given, (Sequence, np.ndarray)) or isinstance(given, (str, bytes)):
        first = whole(name, given, 0, SEED_MAX - count)
        return [first + index for index in range(count)]
    if len(given) != count:
        raise _afbc.AfbcError(f"{name}: {len(given)} seeds given; one, or one for each of {count} vehicles is needed")
    return [None if seed is None else whole(name, seed, 0, SEED_MAX) for seed in given]


def _turn(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the angles [rad] wrapped to -pi to pi."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
