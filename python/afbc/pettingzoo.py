"""An environment for PettingZoo: several vehicles in flight at once, each of them an agent.

    env = afbc.pettingzoo.FlightParallelEnv(4, "circle", "crazyflie")

Each vehicle follows the scenario's reference in its own world: vehicles do not touch or see each other. Actions,
observations, rewards and the ends of episodes are those of `afbc.gymnasium.Task`. Tested with PettingZoo 1.27.
"""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from ._afbc import AfbcError, Scenario, Vehicle
from ._check import finite, mapping
from ._task import seeds
from .gymnasium import Task, spaces

__all__ = ["FlightParallelEnv"]

_Path = str | PathLike[str]
_Each = dict[str, Any]


class FlightParallelEnv(ParallelEnv):
    """`count` vehicles, "vehicle_0" and so on. `options` are those of `Task`."""

    metadata = {"name": "afbc_flight_v0", "render_modes": [], "is_parallelizable": True}
    render_mode = None

    def __init__(
        self,
        count: int = 4,
        scenario: Scenario | _Path = "hover",
        vehicle: Vehicle | _Path = "crazyflie",
        **options: Any,
    ) -> None:
        self.task = Task(count, scenario, vehicle, **options)
        self.possible_agents = [f"vehicle_{index}" for index in range(count)]
        self.agents: list[str] = []
        space = [spaces(self.task.rotors) for _ in range(count)]
        self.observation_spaces = {agent: seen for agent, (seen, _) in zip(self.possible_agents, space)}
        self.action_spaces = {agent: act for agent, (_, act) in zip(self.possible_agents, space)}
        self._randoms = [seeding.np_random()[0] for _ in range(count)]

    def observation_space(self, agent: str) -> Any:
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[_Each, _Each]:
        """Restarts all vehicles. Vehicle i has the seed `seed + i`."""
        self.agents = list(self.possible_agents)
        for index, own in enumerate(seeds("seed", seed, len(self.agents))):
            if own is not None:
                self._randoms[index] = seeding.np_random(own)[0]
            self.task.reset(index, self._randoms[index])
        return self._of(self.task.observe()), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, NDArray[np.float32]]) -> tuple[_Each, _Each, _Each, _Each, _Each]:
        if not self.agents:
            return {}, {}, {}, {}, {}
        rewards, lost, over, distance_m = self.task.step(self._actions(actions))
        each = (
            self._of(self.task.observe()),
            self._of(rewards.tolist()),
            self._of(lost.tolist()),
            self._of(over.tolist()),
            {agent: {"distance_m": value} for agent, value in self._of(distance_m.tolist()).items()},
        )
        ended = self._of((lost | over).tolist())
        self.agents = [agent for agent in self.agents if not ended[agent]]
        return each

    def _actions(self, actions: dict[str, NDArray[np.float32]]) -> NDArray[np.float64]:
        """Returns an action for each vehicle. The rotors of a vehicle whose episode has ended stand still."""
        given = mapping("actions", actions, "a mapping of agents to actions is")
        unknown = [agent for agent in given if agent not in self.possible_agents]
        missing = [agent for agent in self.agents if agent not in given]
        if unknown or missing:
            problem = f"no agent {unknown[0]!r}" if unknown else f"no action of {missing[0]!r}"
            raise AfbcError(f"actions: {problem}; one for each of {len(self.agents)} agents in flight is needed")
        shares = np.full((len(self.possible_agents), self.task.rotors), -1.0)
        for index, agent in enumerate(self.possible_agents):
            if agent in self.agents:
                shares[index] = finite(f"actions[{agent!r}]", given[agent], (self.task.rotors,))
        return shares

    def _of(self, values: Any) -> _Each:
        """Returns the values of the agents that still fly, by agent."""
        return {agent: value for agent, value in zip(self.possible_agents, values) if agent in self.agents}
