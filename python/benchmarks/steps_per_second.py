"""Vehicle-steps per second of this package's environments, beside other simulators: `steps_per_second.py [SECONDS]`.

A step is one of 1 ms of a vehicle's physics, whatever the rate of control; a second is one of a processor, all threads
added up, which other work on the machine does not change much. Of the others those are measured that are installed:
`pip install rotorpy crazyflow` (Python 3.11 or later), and gym-pybullet-drones from its repository. Prints a table for
docs/reference/python-figures.md.
"""

import os
import sys
import time
from collections.abc import Callable
from functools import partial

# Before SciPy is imported: Crazyflow's controllers ask for it.
os.environ.setdefault("SCIPY_ARRAY_API", "1")

import numpy as np

import afbc

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 3.0


def rate(step: Callable[[], object], steps: int) -> float:
    """Steps per processor-second of calls that make this many."""
    step()
    start, calls = time.process_time(), 0
    while (spent := time.process_time() - start) < SECONDS:
        step()
        calls += 1
    return calls * steps / spent


def ours() -> None:
    from afbc.gymnasium import FlightEnv, FlightVectorEnv

    hover = np.full(4, 2 / 1.74 - 1)
    env = FlightEnv("hover", "crazyflie", duration_s=1e9, far_m=1e9)
    env.reset(seed=1)
    row("`FlightEnv`", "control at 100 Hz", rate(lambda: env.step(hover), 10))
    for count in (1, 16, 256, 4096):
        envs = FlightVectorEnv(count, "hover", "crazyflie")
        envs.reset(seed=1)
        actions = np.tile(hover, (count, 1))
        row(f"`FlightVectorEnv`, {count}", "control at 100 Hz", rate(partial(envs.step, actions), 10 * count))
    batch = afbc.Batch(4096, "hover", vehicle="crazyflie")
    speeds = np.full((4096, 4), 1860.0)
    row("`Batch`, 4096", "10 steps a call", rate(lambda: batch.step(speeds, 10), 10 * 4096))


def rotorpy() -> None:
    import afbc.rotorpy
    from rotorpy.vehicles.multirotor import Multirotor

    plant = afbc.Plant("hover", vehicle="crazyflie")
    vehicle = Multirotor(afbc.rotorpy.parameters("crazyflie"))
    states = [afbc.rotorpy.state(plant)]
    command = {"cmd_motor_speeds": np.full(4, 1860.0)}
    row(
        "RotorPy",
        "`Multirotor.step` at 1 kHz",
        rate(lambda: states.append(vehicle.step(states.pop(), command, 1e-3)), 1),
    )


def crazyflow() -> None:
    import jax
    from crazyflow.control import Control
    from crazyflow.drones import Drone
    from crazyflow.sim import Sim

    for count in (1, 256, 4096):
        sim = Sim(n_worlds=count, drone=Drone.cf2x_L250, control=Control.rotor_vel, freq=1000)
        sim.rotor_vel_control(np.full((count, 1, 4), 17_800.0, dtype=np.float32))

        def step(sim=sim):
            sim.step(10)
            jax.block_until_ready(sim.data)

        row(f"Crazyflow, {count}", "10 steps a call, rotor speeds held, single precision", rate(step, 10 * count))


def gym_pybullet_drones() -> None:
    from gym_pybullet_drones.envs.HoverAviary import HoverAviary
    from gym_pybullet_drones.utils.enums import ActionType, ObservationType

    env = HoverAviary(pyb_freq=1000, ctrl_freq=100, obs=ObservationType.KIN, act=ActionType.RPM)
    env.reset(seed=1)
    action = np.zeros((1, 4))
    row("gym-pybullet-drones", "`HoverAviary`, control at 100 Hz", rate(lambda: env.step(action), 10))


def row(what: str, how: str, rate_hz: float) -> None:
    print(f"| {what} | {how} | {rate_hz:,.0f} |", flush=True)


print("| simulator | how | vehicle-steps of 1 ms per processor-second |\n|---|---|--:|")
for simulator in (ours, rotorpy, crazyflow, gym_pybullet_drones):
    try:
        simulator()
    except ImportError as missing:
        print(f"{simulator.__name__} is not measured: {missing}", file=sys.stderr)
