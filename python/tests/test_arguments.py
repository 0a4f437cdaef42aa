"""Every public call, with every argument wrong in every way: a clear exception, or a result; never a panic, an abort,
an endless loop or silence.

`CALLS` has a good call of everything public; a test says which is missing. Each argument in turn is replaced by each of
`VALUES`. What an argument's kind excludes must be refused by an exception that names the argument, or shows the value.
"""

import inspect
import math
import pathlib
import re
import signal
import tempfile

import numpy as np
import pytest

import afbc
import afbc.crazyflow
import afbc.dask
import afbc.rotorpy

ALLOWED = (TypeError, ValueError, OverflowError, MemoryError, KeyError)
#: Longest time of a call [s].
LIMIT_S = 60

UNALIGNED = np.frombuffer(b"\0" + np.ones(4).tobytes(), dtype=np.uint8)[1:].view(np.float64)
READONLY = np.array([1.0, 2.0, 3.0])
READONLY.setflags(write=False)
VALUES = [
    None,
    True,
    -1,
    0,
    1,
    3,
    10**6 + 1,
    10**12,
    2**31,
    2**32,
    2**63,
    2**64,
    -(2**70),
    10**400,
    0.5,
    -0.5,
    math.nan,
    math.inf,
    -math.inf,
    1e308,
    -1e308,
    5e-324,
    1j,
    "",
    "x",
    "hover",
    "a\nb",
    "\0",
    "\udcff",
    "/",
    "/dev/zero",
    "9" * 5000,
    b"hover",
    [],
    [1, 2],
    [1, 2, 3],
    [1, 2, 3, 4],
    [[1, 2, 3]],
    [[1], [1, 2]],
    [math.nan] * 3,
    [math.inf] * 4,
    [1e308] * 4,
    [10**400] * 3,
    ["1", "2", "3"],
    [None] * 3,
    (),
    {},
    {"x": 1},
    {"x": "y"},
    {1: 2},
    {"kp": (1, 2)},
    set(),
    range(3),
    (n for n in [1, 2, 3]),
    object(),
    object,
    lambda *_: None,
    np.zeros(0),
    np.zeros((2, 2)),
    np.zeros((0, 3)),
    np.array(3),
    np.float32(3),
    np.uint8(3),
    np.arange(3),
    np.arange(8.0)[::2],
    np.arange(4.0)[::-1],
    np.ones(3, dtype=">f8"),
    np.ones(4, dtype=np.float16),
    np.ones(3, dtype=np.longdouble),
    np.ones(3, dtype=complex),
    np.ones(3, dtype=object),
    np.ones(3, dtype=bool),
    np.zeros(3, dtype="datetime64[s]"),
    np.broadcast_to(1.0, (4,)),
    UNALIGNED,
    READONLY,
]


def is_told_by_line(text):
    """One line, or one for each mistake of a file, which begins with its name and a number."""
    lines = text.splitlines()
    return len(lines) == 1 or all(re.match(r"[^:]+:\d+: ", line) for line in lines)


def is_whole(value):
    return isinstance(value, (int, np.integer))


def is_real(value):
    return isinstance(value, (int, float, np.integer, np.floating))


def whole(least, most):
    def fits(value):
        one = isinstance(value, np.ndarray) and value.ndim == 0
        return (one or is_whole(value)) and least <= value <= most

    return fits


def real(least=-math.inf, most=math.inf, finite=True):
    def fits(value):
        if isinstance(value, np.ndarray):
            return value.ndim == 0
        return is_real(value) and (not finite or (abs(value) < 1e38 and least <= value <= most))

    return fits


def array(*shape, finite=False):
    def fits(value):
        if not isinstance(value, (list, tuple, range, np.ndarray)):
            return False
        try:
            numbers = np.asarray(value)
        except ValueError:
            return False
        fits = len(numbers.shape) == len(shape) and all(map(one_of, shape, numbers.shape))
        return fits and numbers.dtype.kind in "fiu" and (not finite or np.all(np.abs(numbers.astype(float)) < 1e38))

    return fits


def one_of(wanted, given):
    return wanted in (None, given)


def text(value):
    return isinstance(value, str)


def path(value):
    return isinstance(value, str)


def anything(_):
    return True


def none_or(kind):
    return lambda value: value is None or kind(value)


def instance(of):
    return lambda value: isinstance(value, of)


flag = instance((bool, np.bool_))
SEED = none_or(whole(0, 2**63 - 1))
THREADS = none_or(whole(1, 1024))
STEP_S = real(1e-5, 1.0)
THREE, GIVEN_THREE = array(3), array(3, finite=True)
SIGMA = real(1e-45, 1e38)
TIME_S = real(0, 1e9)
SHORT = afbc.Scenario("hover").replace(duration_s=0.2)
CONTROLLERS = none_or(lambda value: isinstance(value, (str, list, tuple, set, dict)) and len(value) > 0)
NAMED, VEHICLE = path, none_or(path)
PAIRS = (dict, list, tuple, set)
GAINS = none_or(lambda value: isinstance(value, PAIRS) or hasattr(value, "__next__") or np.size(value) == 0)
LAW = type("Law", (), {"__init__": lambda self, vehicle: None, "step": lambda self, *_: [0, 0, 0, 1]})
ROTORPY = {"x": [0, 0, 1], "v": [0] * 3, "q": [0, 0, 0, 1], "w": [0] * 3}
FLAT = {key: [0, 0, 0] for key in ("x", "x_dot", "x_ddot", "x_dddot", "x_ddddot")}


class Client:
    """A scheduler that has no workers."""

    def submit(self, *_, **__):
        pass

    def gather(self, tasks):
        raise ValueError(f"client: nobody flies {len(tasks)} shards")


FOLDER = tempfile.TemporaryDirectory()
CAMPAIGN = pathlib.Path(FOLDER.name) / "small.toml"
CAMPAIGN.write_text('flights = 2\nduration_s = 0.5\nscenario = "hover"\n[spread]\nmass_ratio = [0.8, 1.2]\n')

#: Of each call: what is called, made anew for each; and of each argument its kind and a good value.
CALLS = {
    "State": (
        lambda: afbc.State,
        {name: (THREE, [0, 0, 1]) for name in ("position_m", "velocity_m_s", "attitude_rad", "rates_rad_s")},
    ),
    "Setpoint": (
        lambda: afbc.Setpoint,
        {
            **{
                name: (THREE, [0, 0, 1])
                for name in ("position_m", "velocity_m_s", "acceleration_m_s2", "jerk_m_s3", "snap_m_s4")
            },
            **{
                name: (real(finite=False), 0.0)
                for name in ("yaw_rad", "yaw_rate_rad_s", "yaw_acceleration_rad_s2")
            },
        },
    ),
    "Vehicle": (lambda: afbc.Vehicle, {"name": (path, "racer")}),
    "Vehicle.from_toml": (lambda: afbc.Vehicle.from_toml, {"text": (text, "mass = 1"), "name": (text, "mine")}),
    "Scenario": (lambda: afbc.Scenario, {"name": (NAMED, "hover")}),
    "Scenario.from_toml": (
        lambda: afbc.Scenario.from_toml,
        {"text": (text, "[trajectory]\nkind = 'hover'\nposition_m = [0, 0, 1]"), "name": (text, "mine")},
    ),
    "Scenario.replace": (
        lambda: SHORT.replace,
        {"vehicle": (VEHICLE, "racer"), "seed": (SEED, 1), "duration_s": (none_or(real(0.1, 36_000)), 1.0)},
    ),
    "Scenario.reference": (lambda: SHORT.reference, {"time_s": (array(None, finite=True), [0.0])}),
    "Controller": (
        lambda: afbc.Controller,
        {
            "law": (text, "pid"),
            "vehicle": (VEHICLE, "racer"),
            "profile": (text, "flight"),
            "monitored": (flag, False),
            "gains": (GAINS, {}),
        },
    ),
    "Controller.step": (
        lambda: afbc.Controller("pid").step,
        {"state": (instance((afbc.State, type(None))), None), "setpoint": (instance(afbc.Setpoint), afbc.Setpoint())},
    ),
    "Controller.reset": (lambda: afbc.Controller("pid").reset, {}),
    "Plant": (
        lambda: afbc.Plant,
        {
            "scenario": (none_or(NAMED), "hover"),
            "vehicle": (VEHICLE, None),
            "seed": (SEED, 1),
            "dt_s": (STEP_S, 0.001),
        },
    ),
    "Plant.step": (lambda: afbc.Plant().step, {"speeds_rad_s": (array(4, finite=True), [100.0] * 4)}),
    "Plant.reset": (
        lambda: afbc.Plant().reset,
        {"seed": (SEED, 1), "state": (instance((afbc.State, type(None))), None)},
    ),
    "Batch": (
        lambda: afbc.Batch,
        {
            "count": (whole(1, 100_000), 2),
            "scenario": (none_or(NAMED), "hover"),
            "vehicle": (VEHICLE, None),
            "seed": (SEED, 1),
            "dt_s": (STEP_S, 0.001),
        },
    ),
    "Batch.step": (
        lambda: afbc.Batch(2).step,
        {"speeds_rad_s": (array(2, 4, finite=True), np.full((2, 4), 100.0)), "steps": (whole(1, 10**6), 1)},
    ),
    "Batch.reset": (
        lambda: afbc.Batch(2).reset,
        {
            "index": (whole(0, 1), 1),
            "seed": (whole(0, 2**63 - 1), 1),
            "state": (instance((afbc.State, type(None))), None),
        },
    ),
    "Estimator": (lambda: afbc.Estimator, {}),
    "Estimator.pose": (
        lambda: afbc.Estimator().pose,
        {
            "at_s": (TIME_S, 1.0),
            "position_m": (GIVEN_THREE, [0, 0, 1]),
            "attitude": (array(4, finite=True), [1, 0, 0, 0]),
            "position_sigma_m": (SIGMA, 0.001),
            "attitude_sigma_rad": (SIGMA, 0.001),
        },
    ),
    "Estimator.gnss": (
        lambda: afbc.Estimator().gnss,
        {
            "at_s": (TIME_S, 1.0),
            "position_m": (GIVEN_THREE, [0, 0, 1]),
            "velocity_m_s": (GIVEN_THREE, [0, 0, 1]),
            "horizontal_sigma_m": (SIGMA, 1.0),
            "vertical_sigma_m": (SIGMA, 1.0),
            "speed_sigma_m_s": (SIGMA, 1.0),
            "climb_sigma_m_s": (SIGMA, 1.0),
        },
    ),
    "Estimator.height": (
        lambda: afbc.Estimator().height,
        {"at_s": (TIME_S, 1.0), "height_m": (real(), 1.0), "sigma_m": (SIGMA, 1.0)},
    ),
    "Estimator.magnetic_field": (
        lambda: afbc.Estimator().magnetic_field,
        {"at_s": (TIME_S, 1.0), "field": (GIVEN_THREE, [20, 0, -40]), "sigma": (SIGMA, 1.0)},
    ),
    "Estimator.heading": (
        lambda: afbc.Estimator().heading,
        {"at_s": (TIME_S, 1.0), "heading_rad": (real(), 1.0), "sigma_rad": (SIGMA, 1.0)},
    ),
    "Estimator.set_on_ground": (lambda: afbc.Estimator().set_on_ground, {"on_ground": (flag, True)}),
    "Estimator.step": (
        lambda: afbc.Estimator().step,
        {
            "now_s": (TIME_S, 1.0),
            "rates_rad_s": (none_or(GIVEN_THREE), [0, 0, 0]),
            "specific_force_m_s2": (none_or(GIVEN_THREE), [0, 0, 9.8]),
        },
    ),
    "Instruments": (
        lambda: afbc.Instruments,
        {
            "scenario": (none_or(NAMED), "outdoor"),
            "vehicle": (VEHICLE, None),
            "seed": (SEED, 1),
            "dt_s": (STEP_S, 0.001),
        },
    ),
    "Instruments.measure": (
        lambda: afbc.Instruments().measure,
        {"plant": (instance(afbc.Plant), afbc.Plant("outdoor"))},
    ),
    "FlightCore": (
        lambda: afbc.FlightCore,
        {"law": (text, "pid"), "vehicle": (VEHICLE, None), "monitored": (flag, True), "gains": (GAINS, None)},
    ),
    "FlightCore.request": (lambda: afbc.FlightCore("pid").request, {"request": (text, "arm")}),
    "FlightCore.step": (
        lambda: afbc.FlightCore("pid").step,
        {
            "state": (instance((afbc.State, type(None))), None),
            "setpoint": (instance((afbc.Setpoint, type(None))), None),
            "idle_on_ground": (flag, True),
        },
    ),
    "Guidance": (lambda: afbc.Guidance, {"vehicle": (VEHICLE, None), "dt_s": (STEP_S, 0.001)}),
    "Guidance.take_off": (lambda: afbc.Guidance().take_off, {"height_m": (none_or(real()), 1.0)}),
    "Guidance.go_to": (
        lambda: afbc.Guidance().go_to,
        {
            "position_m": (lambda value: THREE(value) and not np.any(np.abs(np.asarray(value)) > 1e38), [0, 0, 1]),
            "yaw_rad": (none_or(lambda value: real()(value) or value != value), 0.0),
            "speed_m_s": (none_or(real()), 1.0),
        },
    ),
    "Guidance.select": (lambda: afbc.Guidance().select, {"mode": (text, "hold")}),
    "Guidance.sticks": (
        lambda: afbc.Guidance().sticks,
        {name: (real(-1, 1), 0.0) for name in ("roll", "pitch", "yaw", "throttle")},
    ),
    "Guidance.step": (
        lambda: afbc.Guidance().step,
        {
            "state": (instance((afbc.State, type(None))), None),
            "core": (text, "flying"),
            "airborne": (flag, True),
            "rested": (flag, True),
            "thrust_m_s2": (none_or(real()), 9.8),
        },
    ),
    "fly": (
        lambda: afbc.fly,
        {
            "scenario": (NAMED, SHORT),
            "controllers": (CONTROLLERS, ["pid"]),
            "vehicle": (VEHICLE, None),
            "seed": (SEED, None),
            "duration_s": (none_or(real(0.1, 36_000)), 0.2),
            "log_hz": (none_or(whole(1, 1000)), 100),
            "threads": (THREADS, 1),
            "progress": (anything, False),
        },
    ),
    "compare": (
        lambda: afbc.compare,
        {
            "scenarios": (lambda value: isinstance(value, (str, list, tuple, set)) and len(value) > 0, SHORT),
            "controllers": (CONTROLLERS, ["pid"]),
            "vehicle": (VEHICLE, None),
            "seeds": (none_or(whole(1, 10_000)), 2),
            "threads": (THREADS, 1),
            "progress": (anything, False),
        },
    ),
    "campaign": (
        lambda: afbc.campaign,
        {
            "campaign": (path, CAMPAIGN),
            "flights": (none_or(whole(1, 2)), 1),
            "vehicle": (VEHICLE, None),
            "shard": (none_or(text), "1/1"),
            "out": (none_or(path), None),
            "threads": (THREADS, None),
            "progress": (anything, False),
        },
    ),
    "merge": (
        lambda: afbc.merge,
        {"shards": (lambda value: isinstance(value, (list, tuple, set)) and len(value) > 0, ["a"]), "out": (path, "o")},
    ),
    "tune": (
        lambda: afbc.tune,
        {
            "law": (text, "pid"),
            "scenarios": (none_or(lambda value: isinstance(value, (str, list, tuple, set)) and len(value) > 0), SHORT),
            "vehicle": (VEHICLE, None),
            "budget": (whole(1, 10**6), 1),
            "seed": (whole(0, 2**63 - 1), 1),
            "step": (real(0.001, 1), 0.3),
            "flying": (flag, False),
            "threads": (THREADS, 1),
            "progress": (anything, False),
        },
    ),
    "replay": (lambda: afbc.replay, {"log": (path, "none.ulg")}),
    "register": (
        lambda: afbc.register,
        {
            "name": (text, "argued"),
            "make": (callable, LAW),
            "title": (none_or(text), "Argued"),
            "gains": (none_or(lambda value: isinstance(value, dict) and value in ({}, {"x": 1})), {"kp": 1.0}),
        },
    ),
    "frame": (lambda: afbc.frame, {"columns": (instance(dict), {"x": [1.0]})}),
    "laws": (lambda: afbc.laws, {}),
    "vehicles": (lambda: afbc.vehicles, {}),
    "scenarios": (lambda: afbc.scenarios, {}),
    "campaigns": (lambda: afbc.campaigns, {}),
    "rotorpy.parameters": (lambda: afbc.rotorpy.parameters, {"vehicle": (path, "hummingbird")}),
    "rotorpy.to_vehicle": (
        lambda: afbc.rotorpy.to_vehicle,
        {"parameters": (instance(dict), afbc.rotorpy.parameters("hummingbird")), "name": (text, "theirs")},
    ),
    "rotorpy.to_state": (lambda: afbc.rotorpy.to_state, {"state": (lambda _: False, ROTORPY)}),
    "rotorpy.to_setpoint": (lambda: afbc.rotorpy.to_setpoint, {"flat_output": (lambda _: False, FLAT)}),
    "rotorpy.state": (lambda: afbc.rotorpy.state, {"plant": (instance(afbc.Plant), afbc.Plant())}),
    "rotorpy.flat_output": (
        lambda: afbc.rotorpy.flat_output,
        {"setpoint": (instance(afbc.Setpoint), afbc.Setpoint())},
    ),
    "rotorpy.Controller": (lambda: afbc.rotorpy.Controller, {"law": (text, "pid"), "vehicle": (VEHICLE, None)}),
    "rotorpy.Controller.update": (
        lambda: afbc.rotorpy.Controller("pid").update,
        {"t": (real(), 0.0), "state": (lambda _: False, ROTORPY), "flat_output": (lambda _: False, FLAT)},
    ),
    "rotorpy.Trajectory": (lambda: afbc.rotorpy.Trajectory, {"scenario": (path, "hover")}),
    "rotorpy.Trajectory.update": (lambda: afbc.rotorpy.Trajectory("hover").update, {"t": (real(), 0.0)}),
    "rotorpy.law": (lambda: afbc.rotorpy.law, {"make": (callable, LAW)}),
    "crazyflow.mellinger": (lambda: afbc.crazyflow.mellinger, {"drone": (text, "cf2x_L250")}),
    "dask.campaign": (
        lambda: afbc.dask.campaign,
        {
            "client": (anything, Client()),
            "campaign": (path, CAMPAIGN),
            "out": (path, "o"),
            "shards": (whole(1, 100_000), 2),
            "flights": (none_or(anything), None),
            "vehicle": (VEHICLE, None),
        },
    ),
}
#: Public, but made by calls alone, or no calls.
MADE = {"Action", "AfbcError", "Flight", "Law", "OwnVehicle"}


def called(function, arguments):
    """Calls, and ends what does not return."""

    def late(*_):
        raise SystemError(f"it runs for more than {LIMIT_S} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(LIMIT_S)
    try:
        return function(**arguments)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def everything_public():
    others = {f"{name}.": getattr(afbc, name) for name in ("rotorpy", "crazyflow", "dask")}
    for prefix, module in [("", afbc), *others.items()]:
        for name in module.__all__:
            if name in MADE and not prefix:
                continue
            yield prefix + name
            of = getattr(module, name)
            if inspect.isclass(of):
                for method, value in vars(of).items():
                    if not method.startswith("_") and (callable(value) or isinstance(value, staticmethod)):
                        yield f"{prefix}{name}.{method}"


def test_every_public_call_is_here():
    assert sorted(everything_public()) == sorted(CALLS)


@pytest.mark.parametrize("name", CALLS)
def test_every_argument_is_here(name):
    make, arguments = CALLS[name]
    given = [
        parameter.name
        for parameter in inspect.signature(make()).parameters.values()
        if parameter.kind is not parameter.VAR_KEYWORD
    ]
    assert given == list(arguments)


@pytest.mark.parametrize("name, argument", [(name, argument) for name in CALLS for argument in CALLS[name][1]])
def test_every_wrong_value_is_refused_by_name(name, argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make, arguments = CALLS[name]
    fits, _ = arguments[argument]
    good = {other: value for other, (_, value) in arguments.items()}
    for value in VALUES:
        case = f"{name}({argument}={value!r:.60})" if not is_whole(value) else f"{name}({argument}={float_or(value)})"
        try:
            called(make(), {**good, argument: value})
        except ALLOWED as problem:
            lines = [str(problem), *getattr(problem, "__notes__", [])]
            assert is_told_by_line(str(problem).strip()), case
            shown = any(argument in line for line in lines)
            assert shown or fits(value) or str(value) in lines[0], f"{case}: {problem!r} does not name it"
        except BaseException as problem:
            raise AssertionError(f"{case}: {problem!r}") from problem
        else:
            assert fits(value), f"{case} is taken in silence"


def float_or(value):
    return value if abs(value) < 10**30 else "a number of hundreds of digits"
