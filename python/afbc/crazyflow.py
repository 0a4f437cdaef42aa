"""Crazyflow's controllers on our plant: the Crazyflie's Mellinger controller from the package `drone-controllers`.

    afbc.fly("hover", {"mellinger": afbc.crazyflow.mellinger()}, vehicle="crazyflie")

`drone-controllers` needs `SCIPY_ARRAY_API=1` in the environment before SciPy is imported. If it is imported before
SciPy, it sets the variable itself. Tested with drone-controllers 0.1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from . import _afbc
from ._rotation import quaternion

__all__ = ["mellinger"]

#: Rates of the position and of the attitude loop, as in Crazyflow and in the Crazyflie's firmware [Hz].
POSITION_HZ, ATTITUDE_HZ = 100, 500


class _Mellinger:
    """Runs the position loop and the attitude loop, each at its rate. The last command is held in between."""

    def __init__(self, drone: str, vehicle: _afbc.OwnVehicle) -> None:
        from drone_controllers import parametrize
        from drone_controllers.mellinger import attitude2force_torque, state2attitude

        self._position = parametrize(state2attitude, drone)
        self._attitude = parametrize(attitude2force_torque, drone)
        arm_m = vehicle.arm_m
        self._lever_m = np.array([arm_m, arm_m, vehicle.effectiveness[2] * vehicle.inertia_kg_m2[2]], dtype=float)
        every_s = float(vehicle.dt_s)
        self._every = [max(1, round(1 / (rate * every_s))) for rate in (POSITION_HZ, ATTITUDE_HZ)]
        self._steps = 0
        self._integral: np.ndarray | None = None
        self._turned: np.ndarray | None = None
        self._rates_rad_s: np.ndarray | None = None
        self._wanted = np.zeros(4)
        self._inputs_n = np.zeros(4)

    def step(self, state: _afbc.State, setpoint: _afbc.Setpoint, fresh: bool) -> np.ndarray:
        rates_rad_s = state.rates_rad_s
        seen = (state.position_m, quaternion(state.attitude_rad), state.velocity_m_s, rates_rad_s)
        if self._steps % self._every[0] == 0:
            heading = [setpoint.yaw_rad, 0.0, 0.0, setpoint.yaw_rate_rad_s]
            command = [*setpoint.position_m, *setpoint.velocity_m_s, *setpoint.acceleration_m_s2, *heading]
            errors = None if self._integral is None else (self._integral,)
            self._wanted, self._integral = self._position(
                *seen, np.array(command), ctrl_errors=errors, ctrl_freq=POSITION_HZ
            )
        if self._steps % self._every[1] == 0:
            errors = None if self._turned is None else (self._turned,)
            force_n, moment_n_m, self._turned = self._attitude(
                *seen, self._wanted, prev_ang_vel=self._rates_rad_s, ctrl_errors=errors, ctrl_freq=ATTITUDE_HZ
            )
            self._rates_rad_s = rates_rad_s
            self._inputs_n = np.array([*(moment_n_m / self._lever_m), np.squeeze(force_n)])
        self._steps += 1
        return self._inputs_n


def mellinger(drone: str = "cf2x_L250") -> Callable[[_afbc.OwnVehicle], Any]:
    """Returns Crazyflow's Mellinger controller, with its parameters for this drone, as a law to register.

    `afbc.register` and `afbc.fly` accept the result. The position loop runs at 100 Hz, the attitude loop at 500 Hz. The
    moments are computed for the controller's own drone, and our simulator allocates them to the rotors.
    """
    if not isinstance(drone, str):
        raise TypeError(f"drone: the name of a drone is needed, not {type(drone).__name__}")
    return lambda vehicle: _Mellinger(drone, vehicle)
