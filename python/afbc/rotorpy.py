"""Bridge to RotorPy: our laws fly its vehicles, winds and trajectories, and its controllers fly our plant.

    from rotorpy.environments import Environment
    from rotorpy.vehicles.multirotor import Multirotor
    import afbc, afbc.rotorpy

    plant = afbc.Plant("hover", vehicle="hummingbird")
    vehicle = Multirotor(afbc.rotorpy.parameters("hummingbird"), afbc.rotorpy.state(plant))
    law = afbc.rotorpy.Controller("afbc", "hummingbird")
    Environment(vehicle, law, afbc.rotorpy.Trajectory("hover"), sim_rate=1000).run(t_final=5)

    from rotorpy.controllers.quadrotor_control import SE3Control
    afbc.fly("hover", {"se3": afbc.rotorpy.law(SE3Control)}, vehicle="hummingbird")

Both use the same axes: earth z up, body x forward, y left, z up. This module only needs numpy; import RotorPy to fly in
it. Tested with RotorPy 3.0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from json import dumps
from os import PathLike
from typing import Any

import numpy as np

from . import _afbc
from ._check import finite, key, mapping, number, path
from ._rotation import euler, quaternion

__all__ = [
    "Controller",
    "Trajectory",
    "flat_output",
    "law",
    "parameters",
    "state",
    "to_setpoint",
    "to_state",
    "to_vehicle",
]

_Vehicle = _afbc.Vehicle | str | PathLike[str]

#: RotorPy's gravity [m/s2], which cannot be changed.
GRAVITY_M_S2 = 9.81
#: Parameters of effects that our plant lacks: products of inertia, induced inflow, translational lift, blade flapping.
_OTHERS = ("Ixy", "Ixz", "Iyz", "k_z", "k_h", "k_flap")


def _found(named: _Vehicle) -> _afbc.Vehicle:
    return named if isinstance(named, _afbc.Vehicle) else _afbc.Vehicle(path("vehicle", named))


def parameters(vehicle: _Vehicle) -> dict[str, Any]:
    """Returns one of our vehicles as the dictionary that RotorPy's `Multirotor` and its controllers take.

    The vehicle must have four rotors with a lag, like RotorPy's. RotorPy has no rotor inertia, battery or centre of
    drag, so these are left out. Its ground, if enabled, is its own.
    """
    vehicle = _found(vehicle)
    of, drag = vehicle.parameters, vehicle.drag or {"blade_n_s2_m": 0.0, "body_n_s2_m2": [0.0] * 3}
    if vehicle.rotors != 4:
        raise _afbc.AfbcError(f"{vehicle.name}: {vehicle.rotors} rotors; RotorPy flies vehicles of 4")
    if vehicle.lag_s <= 0:
        raise _afbc.AfbcError(f"{vehicle.name}: its rotors do not lag; RotorPy's do, time_constant_s must be positive")
    if of["gravity_m_s2"] != GRAVITY_M_S2:
        raise _afbc.AfbcError(f"{vehicle.name}: gravity_m_s2 {of['gravity_m_s2']}; RotorPy's is {GRAVITY_M_S2}")
    slowest, fastest = vehicle.rotor_speed_limits_rad_s
    return {
        "mass": of["mass_kg"],
        **dict(zip(("Ixx", "Iyy", "Izz"), of["inertia_kg_m2"])),
        **dict.fromkeys(_OTHERS, 0.0),
        "num_rotors": vehicle.rotors,
        "rotor_pos": {f"r{i + 1}": position for i, position in enumerate(vehicle.rotor_positions_m)},
        "rotor_directions": vehicle.rotor_yaw_signs,
        "rI": np.zeros(3),
        **dict(zip(("c_Dx", "c_Dy", "c_Dz"), drag["body_n_s2_m2"])),
        "k_eta": of["thrust_factor_n_s2"],
        "k_m": of["drag_factor_n_m_s2"],
        "k_d": drag["blade_n_s2_m"],
        "tau_m": float(vehicle.lag_s),
        "rotor_speed_min": slowest,
        "rotor_speed_max": fastest,
        "motor_noise_std": 0.0,
    }


def to_vehicle(parameters: Mapping[str, Any], name: str = "rotorpy") -> _afbc.Vehicle:
    """Returns a vehicle given by RotorPy's dictionary as one of ours, with gains by rule (docs/vehicles.md).

    Refuses effects that our plant lacks. To fly without them, pass `params | {"k_z": 0, "k_h": 0}`.
    """
    parameters = mapping("parameters", parameters, "a dictionary of RotorPy's is")

    def of(wanted: str) -> float:
        return number(wanted, key("parameters", parameters, wanted), -1e30, 1e30)

    unknown = [other for other in _OTHERS if parameters.get(other, 0.0) != 0.0]
    if unknown:
        cure = ", ".join(f'"{other}": 0' for other in unknown)
        raise _afbc.AfbcError(f"{name}: {', '.join(unknown)}: not in our plant; {{**parameters, {cure}}} flies without")
    hubs = mapping("rotor_pos", key("parameters", parameters, "rotor_pos"), "a mapping of rotors to positions is")
    positions = np.array([finite(f"rotor_pos[{rotor!r}]", hub, (3,)) for rotor, hub in hubs.items()])
    directions = finite("rotor_directions", key("parameters", parameters, "rotor_directions"), (len(positions),))
    arm_m = np.mean(np.hypot(positions[:, 0], positions[:, 1])) if hubs else 0.0
    fastest = of("rotor_speed_max")
    spins = ["cw" if sign > 0 else "ccw" for sign in directions]
    rotors = "".join(
        f'[[rotor]]\nposition_m = {position.tolist()}\nspin = "{spin}"\n' for position, spin in zip(positions, spins)
    )
    # A drag area of 2 m2 in air of 1 kg/m3 gives 1 N s2/m2.
    without_drag = {"c_Dx": 0.0, "c_Dy": 0.0, "c_Dz": 0.0, "k_d": 0.0}
    parameters = {**without_drag, **parameters}
    area_m2 = [2.0 * of(f"c_D{axis}") for axis in "xyz"]
    return _afbc.Vehicle.from_toml(
        f"""
description = {dumps(f"RotorPy's {name}")}
[vehicle]
mass_kg = {of("mass")!r}
arm_m = {float(arm_m)!r}
inertia_kg_m2 = {[of("Ixx"), of("Iyy"), of("Izz")]}
rotor_inertia_kg_m2 = 0.0
thrust_factor_n_s2 = {of("k_eta")!r}
drag_factor_n_m_s2 = {of("k_m")!r}
{rotors}
[rotors]
time_constant_s = {of("tau_m")!r}
force_max_n = {of("k_eta") * fastest**2!r}
min_rad_s = {of("rotor_speed_min")!r}
[motor]
speed_max_rad_s = {fastest!r}
linearity = 1.0
idle = 0.0
[drag]
air_density_kg_m3 = 1.0
blade_n_s2_m = {of("k_d")!r}
area_m2 = {area_m2}
centre_m = [0.0, 0.0, 0.0]
""",
        name,
    )


def to_state(state: Mapping[str, Any]) -> _afbc.State:
    """Converts a state of RotorPy's to ours. Its quaternion must have length 1."""
    state = mapping("state", state, "a dictionary of RotorPy's is")
    x, v, w = (finite(f"state[{part!r}]", key("state", state, part), (3,)) for part in ("x", "v", "w"))
    return _afbc.State(x, v, euler(key("state", state, "q")), w)


def to_setpoint(flat_output: Mapping[str, Any]) -> _afbc.Setpoint:
    """Converts RotorPy's flat outputs to a setpoint."""
    flat = mapping("flat_output", flat_output, "a dictionary of RotorPy's is")
    vectors, angles = ("x", "x_dot", "x_ddot", "x_dddot", "x_ddddot"), ("yaw", "yaw_dot", "yaw_ddot")
    return _afbc.Setpoint(
        *(finite(f"flat_output[{part!r}]", key("flat_output", flat, part), (3,)) for part in vectors),
        *(number(f"flat_output[{part!r}]", flat.get(part, 0.0), -1e30, 1e30) for part in angles),
    )


def state(plant: _afbc.Plant) -> dict[str, Any]:
    """Returns our plant's true state as RotorPy's, with wind and rotor speeds, for use as an initial state."""
    if not isinstance(plant, _afbc.Plant):
        raise TypeError(f"plant: an afbc.Plant is needed, not {type(plant).__name__}")
    vector = plant.true_vector
    return {
        "x": vector[0:3],
        "v": vector[3:6],
        "q": quaternion(vector[6:9]),
        "w": vector[9:12],
        "wind": plant.wind_m_s,
        "rotor_speeds": plant.rotor_speeds_rad_s,
    }


def flat_output(setpoint: _afbc.Setpoint) -> dict[str, Any]:
    """Converts a setpoint to RotorPy's flat outputs."""
    if not isinstance(setpoint, _afbc.Setpoint):
        raise TypeError(f"setpoint: an afbc.Setpoint is needed, not {type(setpoint).__name__}")
    return {
        "x": setpoint.position_m,
        "x_dot": setpoint.velocity_m_s,
        "x_ddot": setpoint.acceleration_m_s2,
        "x_dddot": setpoint.jerk_m_s3,
        "x_ddddot": setpoint.snap_m_s4,
        "yaw": setpoint.yaw_rad,
        "yaw_dot": setpoint.yaw_rate_rad_s,
        "yaw_ddot": setpoint.yaw_acceleration_rad_s2,
    }


class Controller:
    """One of our laws as a controller for RotorPy, with `cmd_motor_speeds`, `cmd_motor_thrusts` or `cmd_ctbm`.

    Takes the arguments of `afbc.Controller`. The law is stepped once every `dt_s`, so RotorPy must run with
    `sim_rate=1 / dt_s`, which is 1000 Hz; another rate is refused. The law is reset when time starts again.
    """

    def __init__(self, law: str = "afbc", vehicle: _Vehicle | None = None, **options: Any) -> None:
        self.controller = _afbc.Controller(law, vehicle, **options)
        of = _found("paper" if vehicle is None else vehicle).parameters
        arm_m, per_thrust_m = of["arm_m"], of["drag_factor_n_m_s2"] / of["thrust_factor_n_s2"]
        self._lever_m = np.array([arm_m, arm_m, per_thrust_m])
        self._time_s: float | None = None

    def update(self, t: float, state: Mapping[str, Any], flat_output: Mapping[str, Any]) -> dict[str, Any]:
        """Returns rotor speeds [rad/s] and thrusts [N], shape (4,), total thrust [N] and moment [N m], shape (3,)."""
        before, dt_s = self._time_s, self.controller.dt_s
        t = number("t", t, -1e9, 1e9)
        if before is not None and t <= before:
            self.controller.reset()
        elif before is not None and abs(t - before - dt_s) > 0.01 * dt_s:
            raise _afbc.AfbcError(
                f"RotorPy steps by {t - before:.6g} s, the law by {dt_s:g} s: sim_rate={1 / dt_s:g} is needed"
            )
        self._time_s = t
        action = self.controller.step(to_state(state), to_setpoint(flat_output))
        inputs, unknown = action.inputs_n, np.full(3, np.nan)
        return {
            "cmd_motor_speeds": action.speeds_rad_s,
            "cmd_motor_thrusts": action.forces_n,
            "cmd_thrust": float(inputs[3]),
            "cmd_moment": inputs[:3] * self._lever_m,
            # RotorPy's plots need these entries. Our laws do not command these quantities.
            "cmd_q": np.array([0.0, 0.0, 0.0, 1.0]),
            "cmd_w": unknown,
            "cmd_v": unknown,
            "cmd_acc": unknown,
        }


class Trajectory:
    """The reference of a scenario as a trajectory for RotorPy."""

    def __init__(self, scenario: _afbc.Scenario | str | PathLike[str]) -> None:
        self.scenario = scenario if isinstance(scenario, _afbc.Scenario) else _afbc.Scenario(path("scenario", scenario))

    def update(self, t: float) -> dict[str, Any]:
        """Returns the flat outputs at `t` [s]."""
        times_s = [number("t", t, -1e9, 1e9)]
        at = {name: column[0] for name, column in self.scenario.reference(times_s).items()}
        parts = {"x": ("", "m"), "x_dot": ("v", "m_s"), "x_ddot": ("a", "m_s2"), "x_dddot": ("j", "m_s3")}
        parts["x_ddddot"] = ("s", "m_s4")
        flat: dict[str, Any] = {
            key: np.array([at[f"{letter}{axis}_d_{unit}"] for axis in "xyz"]) for key, (letter, unit) in parts.items()
        }
        flat["yaw"] = at["psi_d_rad"]
        flat["yaw_dot"] = at["psi_d_rate_rad_s"]
        flat["yaw_ddot"] = at["psi_d_acceleration_rad_s2"]
        return flat


class _Law:
    """One of RotorPy's controllers as a law to register."""

    def __init__(self, make: Callable[[dict[str, Any]], Any], vehicle: _afbc.OwnVehicle) -> None:
        arm_m, inertia, of_yaw = vehicle.arm_m, vehicle.inertia_kg_m2, float(vehicle.effectiveness[2])
        # Moments per newton of U1, U2, U3 [m].
        self._lever_m = np.array([arm_m, arm_m, of_yaw * float(inertia[2])])
        self._time_s, self._dt_s = 0.0, float(vehicle.dt_s)
        # Our simulator allocates the moments to the rotors, so any frame will do here: the paper's plus.
        plus = ((0, -1), (1, 0), (0, 1), (-1, 0))
        fastest = (vehicle.rotor_force_max_n / vehicle.thrust_factor_n_s2) ** 0.5
        self.controller = make(
            {
                "mass": vehicle.mass_kg,
                **{key: float(value) for key, value in zip(("Ixx", "Iyy", "Izz"), inertia)},
                **dict.fromkeys((*_OTHERS, "c_Dx", "c_Dy", "c_Dz", "k_d", "tau_m"), 0.0),
                "num_rotors": 4,
                "rotor_pos": {f"r{i + 1}": arm_m * np.array([x, y, 0]) for i, (x, y) in enumerate(plus)},
                "rotor_directions": np.array([1, -1, 1, -1]),
                "rI": np.zeros(3),
                "k_eta": vehicle.thrust_factor_n_s2,
                "k_m": vehicle.drag_factor_n_m_s2,
                "rotor_speed_min": 0.0,
                "rotor_speed_max": fastest,
            }
        )

    def step(self, state: _afbc.State, setpoint: _afbc.Setpoint, fresh: bool) -> list[float]:
        seen = {
            "x": state.position_m,
            "v": state.velocity_m_s,
            "q": quaternion(state.attitude_rad),
            "w": state.rates_rad_s,
        }
        command = self.controller.update(self._time_s, seen, flat_output(setpoint))
        self._time_s += self._dt_s
        return [*(np.asarray(command["cmd_moment"]) / self._lever_m), float(np.squeeze(command["cmd_thrust"]))]


def law(make: Callable[[dict[str, Any]], Any]) -> Callable[[_afbc.OwnVehicle], Any]:
    """Returns one of RotorPy's controllers as a law, for `afbc.register`, `afbc.fly` and similar functions.

    `make(parameters)` makes the controller: one of RotorPy's classes, or a function that also sets its gains. Our
    simulator allocates its `cmd_thrust` and `cmd_moment` to the rotors.
    """
    if not callable(make):
        raise TypeError(f"make: a controller's class is needed, not {type(make).__name__}")
    return lambda vehicle: _Law(make, vehicle)
