"""Every law in RotorPy's own loop, dynamics, wind and trajectories, against the same flight of ours; RotorPy's
controller on our plant."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.environments import Environment
from rotorpy.trajectories.circular_traj import ThreeDCircularTraj
from rotorpy.trajectories.hover_traj import HoverTraj
from rotorpy.trajectories.minsnap import MinSnap
from rotorpy.vehicles import crazyflie_params, hummingbird_params
from rotorpy.vehicles.multirotor import Multirotor
from rotorpy.wind.default_winds import ConstantWind, NoWind
from rotorpy.world import World

import afbc
import afbc.rotorpy

LAWS = afbc.laws()[:8]
VEHICLE = "hummingbird"
RATE_HZ = 1000


def corners() -> MinSnap:
    """RotorPy's path of least snap around four corners, 1.5 m/s on the average, in 5 s."""
    points = np.array([[0, 0, 1], [1.5, 0, 1.5], [1.5, 1.5, 1], [0, 1.5, 1.5], [0, 0, 1]], dtype=float)
    return MinSnap(points, yaw_angles=np.linspace(0, 1, 5), v_avg=1.5, verbose=False)


def sampled(trajectory: Any, seconds: float) -> str:
    """A trajectory of RotorPy's as the lines of a file for ours, a sample every 10 ms."""
    head = "time_s,x_m,y_m,z_m,yaw_rad,vx_m_s,vy_m_s,vz_m_s,yaw_rate_rad_s,ax_m_s2,ay_m_s2,az_m_s2\n"
    rows = []
    for time_s in np.arange(0, seconds + 1, 0.01):
        at = trajectory.update(time_s)
        rows.append([time_s, *at["x"], at["yaw"], *at["x_dot"], at["yaw_dot"], *at["x_ddot"]])
    return head + "".join(",".join(repr(float(number)) for number in row) + "\n" for row in rows)


@dataclass
class Case:
    """A flight in both simulators."""

    scenario: str
    trajectory: Callable[[afbc.Scenario], Any]
    seconds: float
    #: Largest distance between the two flights at any time [m].
    apart_m: float
    #: Largest difference of the root mean square errors, over the larger one.
    figures: float
    wind_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)


CASES = {
    "hover": Case(
        "[initial]\nposition_m = [0.5, 0.0, 1.0]\n[trajectory]\nkind = 'hover'\nposition_m = [0, 0, 1.2]",
        lambda _: HoverTraj(np.array([0, 0, 1.2])),
        4.0,
        1e-3,
        1e-3,
    ),
    "step": Case(
        "[initial]\nposition_m = [0.0, 0.0, 1.0]\n"
        "[trajectory]\nkind = 'step'\nfrom_m = [0, 0, 1]\nto_m = [1, 1, 1.5]\nat_s = 0.0",
        lambda _: HoverTraj(np.array([1, 1, 1.5])),
        4.0,
        1e-3,
        1e-3,
    ),
    "paper": Case(
        "[initial]\nposition_m = [0.0, 0.0, 0.5]\nattitude_rad = [0.0, 0.0, 0.35]\n[trajectory]\nkind = 'paper'",
        afbc.rotorpy.Trajectory,
        6.0,
        1e-3,
        1e-3,
    ),
    "circle": Case(
        "[trajectory]\nkind = 'circle'\ncentre_m = [0, 0, 1]\nradius_m = 1.5\nperiod_s = 5.0",
        lambda _: ThreeDCircularTraj(np.array([0, 0, 1]), np.array([1.5, 1.5, 0]), np.array([0.2, 0.2, 0.2])),
        5.0,
        1e-3,
        1e-3,
    ),
    "minimum snap": Case(
        "[initial]\nposition_m = [0.0, 0.0, 1.0]\n[trajectory]\nkind = 'file'\nfile = 'corners.csv'",
        lambda _: corners(),
        5.0,
        1e-3,
        1e-3,
    ),
    "wind": Case(
        "[initial]\nposition_m = [0.0, 0.0, 1.0]\n[trajectory]\nkind = 'hover'\nposition_m = [0, 0, 1]\n"
        "[drag]\n[wind]\nsteady_m_s = [4, -3, 0]",
        lambda _: HoverTraj(np.array([0, 0, 1])),
        4.0,
        1e-3,
        1e-3,
        (4.0, -3.0, 0.0),
    ),
}


def scenario(case: Case, folder, vehicle=VEHICLE) -> afbc.Scenario:
    (folder / "corners.csv").write_text(sampled(corners(), 5.0))
    (folder / "case.toml").write_text(f"duration_s = {case.seconds}\n{case.scenario}\n")
    return afbc.Scenario(folder / "case.toml").replace(vehicle=vehicle)


def rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))


def in_rotorpy(case: Case, scenario: afbc.Scenario, controller, parameters, abstraction="cmd_motor_speeds"):
    """Positions and references of a flight in RotorPy's own loop, shape (steps, 3)."""
    start = afbc.rotorpy.state(afbc.Plant(scenario))
    done = Environment(
        Multirotor(parameters, start, control_abstraction=abstraction),
        controller,
        case.trajectory(scenario),
        wind_profile=ConstantWind(*case.wind_m_s) if any(case.wind_m_s) else NoWind(),
        world=World.empty((-20, 20, -20, 20, -20, 20)),
        sim_rate=RATE_HZ,
    ).run(t_final=case.seconds, terminate=False)
    return done["state"]["x"], done["flat"]["x"]


def in_ours(scenario: afbc.Scenario, laws):
    """The same of a flight of ours."""
    [flight] = afbc.fly(scenario, laws, log_hz=RATE_HZ).values()
    assert flight.lost is None
    return (np.stack([flight[f"{axis}{what}"] for axis in "xyz"], axis=1) for what in ("_m", "_d_m"))


def compare(case, theirs, ours):
    (x, wanted), (own, own_wanted) = theirs, ours
    steps = min(len(x), len(own))
    assert steps >= case.seconds * RATE_HZ
    assert np.max(np.abs(wanted[:steps] - own_wanted[:steps])) < 1e-5, "the references differ"
    apart_m = np.max(np.linalg.norm(x[:steps] - own[:steps], axis=1))
    a, b = rms(x[:steps] - wanted[:steps]), rms(own[:steps] - own_wanted[:steps])
    print(f"apart {apart_m:.3g} m, rms {a:.6g} {b:.6g} m, ratio {abs(a - b) / max(a, b):.3g}")
    assert apart_m < case.apart_m
    assert abs(a - b) <= case.figures * max(a, b)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", CASES)
def test_a_law_flies_the_same_in_rotorpy(name, law, tmp_path):
    case = CASES[name]
    flown = scenario(case, tmp_path)
    controller = afbc.rotorpy.Controller(law, VEHICLE)
    theirs = in_rotorpy(case, flown, controller, afbc.rotorpy.parameters(VEHICLE))
    compare(case, theirs, in_ours(flown, [law]))


@pytest.mark.parametrize("name", ["step", "circle", "wind"])
def test_its_controller_flies_the_same_on_our_plant(name, tmp_path):
    case = CASES[name]
    flown = scenario(case, tmp_path)
    parameters = afbc.rotorpy.parameters(VEHICLE)
    theirs = in_rotorpy(case, flown, SE3Control(parameters), parameters)
    compare(case, theirs, in_ours(flown, {"se3": afbc.rotorpy.law(SE3Control)}))


@pytest.mark.parametrize("abstraction", ["cmd_motor_thrusts", "cmd_ctbm"])
def test_thrusts_and_moments_are_those_of_the_speeds(abstraction, tmp_path):
    case = CASES["hover"]
    case = Case(case.scenario, case.trajectory, 0.5, 1e-4, 1e-4)
    flown, parameters = scenario(case, tmp_path), afbc.rotorpy.parameters(VEHICLE)
    speeds, other = (
        in_rotorpy(case, flown, afbc.rotorpy.Controller("afbc", VEHICLE), parameters, kind)[0]
        for kind in ("cmd_motor_speeds", abstraction)
    )
    assert np.max(np.abs(speeds - other)) < 1e-5


@pytest.mark.parametrize("of", [hummingbird_params, crazyflie_params], ids=lambda of: of.__name__.split(".")[-1])
def test_a_vehicle_of_theirs_is_one_of_ours(of):
    given = dict(of.quad_params, k_z=0.0, k_h=0.0, k_flap=0.0)
    again = afbc.rotorpy.parameters(afbc.rotorpy.to_vehicle(given))
    for key, value in again.items():
        if key == "rotor_pos":
            for mine, theirs in zip(value.values(), given[key].values(), strict=True):
                np.testing.assert_allclose(mine, theirs, atol=1e-9)
        else:
            np.testing.assert_allclose(np.asarray(value), given[key], rtol=1e-6, err_msg=key)


def test_a_vehicle_of_theirs_flies_the_same(tmp_path):
    given = dict(hummingbird_params.quad_params, k_z=0.0, k_h=0.0)
    vehicle, case = afbc.rotorpy.to_vehicle(given), CASES["circle"]
    flown = scenario(case, tmp_path, vehicle)
    theirs = in_rotorpy(case, flown, afbc.rotorpy.Controller("afbc", vehicle), given)
    compare(case, theirs, in_ours(flown, ["afbc"]))


def test_what_cannot_be_is_refused_by_one_line():
    law = afbc.rotorpy.Controller("pid", VEHICLE)
    plant = afbc.Plant("hover", vehicle=VEHICLE)
    state, flat = afbc.rotorpy.state(plant), afbc.rotorpy.flat_output(plant.setpoint)
    law.update(0.0, state, flat)
    for call in [
        lambda: law.update(0.01, state, flat),
        lambda: afbc.rotorpy.parameters("f550"),
        lambda: afbc.rotorpy.to_vehicle(hummingbird_params.quad_params),
        lambda: afbc.rotorpy.to_vehicle(dict(hummingbird_params.quad_params, k_z=0, k_h=0, mass=-1.0)),
    ]:
        with pytest.raises(afbc.AfbcError) as raised:
            call()
        assert "\n" not in str(raised.value)
