"""Environments for Gymnasium: one vehicle, or many vehicles stepped together on all cores without the GIL.

    env = afbc.gymnasium.FlightEnv("circle", "crazyflie")
    envs = afbc.gymnasium.FlightVectorEnv(1024, "circle", "crazyflie")

    gymnasium.make("afbc.gymnasium:afbc/Flight-v0", scenario="circle")

Actions are rotor thrusts; observations are errors relative to the scenario's reference. `afbc.gymnasium.Task` describes
units, shapes, rewards and the ends of episodes. Vehicle i of the vector environment flies the same bits as a single
vehicle with the same seed. Tested with Gymnasium 1.4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ._afbc import AfbcError, Scenario, Vehicle
from ._task import MOTION, Task, seeds

__all__ = ["FlightEnv", "FlightVectorEnv", "Task"]

_Path = str | PathLike[str]


def spaces(rotors: int) -> tuple[Box, Box]:
    """Returns the spaces of one vehicle's observations and actions."""
    seen = Box(-np.inf, np.inf, (MOTION + rotors,), np.float32)
    return seen, Box(-1.0, 1.0, (rotors,), np.float32)


class FlightEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One vehicle that follows the reference of a scenario. `options` are those of `Task`.

    The info of a step has `distance_m`, the distance from the reference.
    """

    metadata = {"render_modes": []}

    def __init__(
        self, scenario: Scenario | _Path = "hover", vehicle: Vehicle | _Path = "crazyflie", **options: Any
    ) -> None:
        self.task = Task(1, scenario, vehicle, **options)
        self.observation_space, self.action_space = spaces(self.task.rotors)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        [seed] = seeds("seed", seed, 1)
        super().reset(seed=seed)
        self.task.reset(0, self.np_random)
        return self.task.observe()[0], {}

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        rewards, lost, over, distance_m = self.task.step([action])
        info = {"distance_m": float(distance_m[0])}
        return self.task.observe()[0], float(rewards[0]), bool(lost[0]), bool(over[0]), info


class FlightVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]]):
    """`num_envs` vehicles, each in its own world. `options` are those of `Task`.

    A vehicle whose episode has ended restarts in the next step, which ignores its action and gives no reward
    (`AutoresetMode.NEXT_STEP`). The info of a step has `distance_m`, shape (num_envs,).
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int,
        scenario: Scenario | _Path = "hover",
        vehicle: Vehicle | _Path = "crazyflie",
        **options: Any,
    ) -> None:
        self.task = Task(num_envs, scenario, vehicle, **options)
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = spaces(self.task.rotors)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._randoms = [seeding.np_random()[0] for _ in range(num_envs)]
        self._ended = np.zeros(num_envs, dtype=bool)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Restarts all vehicles, or those of `options["reset_mask"]`. With a single seed, vehicle i has `seed + i`."""
        given = seeds("seed", seed, self.num_envs)
        for index in np.flatnonzero(self._masked(options)):
            if given[index] is not None:
                self._randoms[index] = seeding.np_random(given[index])[0]
            self.task.reset(int(index), self._randoms[index])
            self._ended[index] = False
        return self.task.observe(), {}

    def _masked(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        """Returns a flag for each vehicle that restarts."""
        if options is not None and not isinstance(options, Mapping):
            raise TypeError(f"options: a mapping is needed, not {type(options).__name__}")
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.ones(self.num_envs, dtype=bool)
        mask = np.asarray(mask)
        if mask.dtype != bool or mask.shape != (self.num_envs,):
            raise AfbcError(
                f"reset_mask: shape {mask.shape} of {mask.dtype} given; ({self.num_envs},) of bool is needed"
            )
        return mask

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        rewards, lost, over, distance_m = self.task.step(actions)
        again = self._ended
        for index in np.flatnonzero(again):
            self.task.reset(int(index), self._randoms[index])
        rewards[again], lost[again], over[again], distance_m[again] = 0.0, False, False, 0.0
        self._ended = lost | over
        return self.task.observe(), rewards, lost, over, {"distance_m": distance_m, "_distance_m": ~again}


gymnasium.register("afbc/Flight-v0", entry_point=FlightEnv, vector_entry_point=FlightVectorEnv, order_enforce=True)
