"""Laws of one's own, and what goes wrong."""

import re
import signal
import threading

import numpy as np
import pytest

import afbc


class PD:
    """PD on position and attitude, for small angles and a heading along x."""

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.kp = vehicle.gains.get("kp", 2.0)
        self.steps = 0

    def step(self, state, setpoint, fresh):
        self.steps += 1
        g, per_newton = self.vehicle.gravity_m_s2, self.vehicle.effectiveness
        a = (
            self.kp * (setpoint.position_m - state.position_m)
            + 2.5 * (setpoint.velocity_m_s - state.velocity_m_s)
            + setpoint.acceleration_m_s2
        )
        wanted = [*np.clip([-a[1] / g, a[0] / g], -0.4, 0.4), setpoint.yaw_rad]
        turn = np.array([100.0, 100.0, 2.0]) * (wanted - state.attitude_rad) - [18.0, 18.0, 2.0] * state.rates_rad_s
        return [*(turn / per_newton), self.vehicle.mass_kg * (g + a[2])]


def test_a_law_flies_beside_the_others():
    flights = afbc.fly("hover", {"pd": PD, "pid": None})
    assert set(flights) == {"pd", "pid"}
    assert flights["pd"].lost is None and flights["pd"].metrics["rmse_position_m"] < 0.01
    again = afbc.fly("hover", ["pd"])["pd"]
    assert np.array_equal(again["z_m"], flights["pd"]["z_m"])
    frame = afbc.compare("hover", ["pd", "afbc"], seeds=2)
    assert len(frame) == 4


def test_files_and_searches_know_it():
    afbc.register("pd-tuned", PD, title="PD, tuned", gains={"kp": (2.0, 0.1, 20.0)})
    assert "pd-tuned" in afbc.laws()
    text = """
    [trajectory]
    kind = "step"
    from_m = [0, 0, 1]
    to_m = [1, 0, 1]
    at_s = 1
    [[contender]]
    name = "stiff"
    controller = "pd-tuned"
    [contender.gains]
    kp = 4.0
    """
    scenario = afbc.Scenario.from_toml(text, "own").replace(duration_s=8)
    assert scenario.contenders == ["stiff"]
    assert afbc.fly(scenario)["stiff"].lost is None
    found = afbc.tune("pd-tuned", scenario, budget=6)
    assert found["after"] <= found["before"] and "kp" in found["gains"] and "pd-tuned" in found["text"]


def test_a_law_may_be_changed():
    afbc.register("changing", PD)
    first = afbc.fly("hover", ["changing"])["changing"].metrics["rmse_position_m"]

    class Worse(PD):
        def step(self, state, setpoint, fresh):
            return 1.02 * np.array(super().step(state, setpoint, fresh))

    afbc.register("changing", Worse)
    assert afbc.fly("hover", ["changing"])["changing"].metrics["rmse_position_m"] > 2 * first


@pytest.mark.parametrize(
    "make, problem",
    [
        (lambda vehicle: 1 / 0, ZeroDivisionError),
        (lambda vehicle: object(), AttributeError),
    ],
)
def test_what_a_law_raises_is_raised(make, problem):
    with pytest.raises(problem):
        afbc.fly("hover", {"broken": make})
    assert afbc.fly("hover", ["pid"])["pid"].lost is None


@pytest.mark.parametrize(
    "given, problem",
    [([1, 2], afbc.AfbcError), ([0, 0, 0, float("nan")], afbc.AfbcError), (None, TypeError), ("1234", TypeError)],
)
def test_what_a_step_may_return(given, problem):
    class Wrong(PD):
        def step(self, state, setpoint, fresh):
            return given if self.steps > 5 else super().step(state, setpoint, fresh)

    for flown in [
        lambda: afbc.fly("hover", {"wrong": Wrong}),
        lambda: afbc.compare("hover", {"wrong": Wrong}),
        lambda: afbc.tune("wrong", "hover", budget=2),
    ]:
        with pytest.raises(problem):
            flown()


@pytest.mark.parametrize(
    "arguments",
    [
        ["fly", "hovver"],
        ["fly", "hover", "--vehicle", "crazyfly"],
        ["fly", "robustness"],
        ["fly", "none/such.toml"],
        ["fly", "bad.toml"],
        ["fly", "hover", "--controller", "sof"],
        ["compare", "hover", "--controllers", "pid,pid"],
        ["campaign", "robusness"],
    ],
    ids=" ".join,
)
def test_errors_are_the_line_of_the_command_line(arguments, sitl, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text("duration_s = 1e9\n[trajectory]\nkind = 'hover'\n")
    said = sitl(*arguments, cwd=tmp_path, code=2).stderr.strip()
    command, subject, *rest = arguments
    options = dict(zip(rest[::2], rest[1::2]))
    keywords = {"vehicle": options["--vehicle"]} if "--vehicle" in options else {}
    if "--controller" in options:
        keywords["controllers"] = [options["--controller"]]
    if "--controllers" in options:
        keywords["controllers"] = options["--controllers"].split(",")
    with pytest.raises(afbc.AfbcError) as raised:
        getattr(afbc, command)(subject, **keywords)
    # A law that another test registered is listed too.
    laws = ", ".join(afbc.laws())
    built_in = ", ".join(afbc.laws()[:8])
    assert str(raised.value).replace(laws, built_in) == said
    # A file with two mistakes has a line for each.
    assert isinstance(raised.value, ValueError) and said.count("\n") == (subject == "bad.toml")


@pytest.mark.parametrize(
    "call",
    [
        lambda: afbc.fly("hover", duration_s=-1),
        lambda: afbc.fly("hover", log_hz=3),
        lambda: afbc.register("Mine", PD),
        lambda: afbc.register("pid", PD),
        lambda: afbc.register("mine", PD, gains={"kp": (5.0, 6.0, 7.0)}),
        lambda: afbc.Controller("sof"),
        lambda: afbc.Controller("afbc", profile="fast"),
        lambda: afbc.Controller("pid", gains=[("kp", 1.0)]),
        lambda: afbc.Controller("afbc", gains=[("x.alpha1", -1.0)]),
        lambda: afbc.Plant("hover").step(np.zeros(3)),
        lambda: afbc.Plant("hover").step(np.array([0.0, 0.0, 0.0, np.nan])),
        lambda: afbc.Plant("hover", dt_s=0.0),
        lambda: afbc.Batch(2, "hover").step(np.zeros((3, 4))),
        lambda: afbc.Batch(2, "hover").reset(2, 0),
        lambda: afbc.Vehicle.from_toml("mass_kg = 1"),
        lambda: afbc.tune("pid", "hover", budget=0),
    ],
)
def test_bad_values_are_refused_by_one_line(call):
    with pytest.raises(afbc.AfbcError) as raised:
        call()
    lines = str(raised.value).splitlines()
    # Mistakes of a file have a line each.
    assert len(lines) == 1 or lines and all(re.match(r"[^:]+:\d+: ", line) for line in lines)


@pytest.mark.parametrize(
    "call",
    [
        lambda law: afbc.Controller(law),
        lambda law: afbc.tune(law, "hover"),
        lambda law: afbc.fly("hover", controllers=[law]),
    ],
)
def test_a_misspelt_law_is_answered_by_the_nearest(call):
    with pytest.raises(afbc.AfbcError, match=r"did you mean indi\?"):
        call("idni")
    with pytest.raises(afbc.AfbcError, match="afbc, "):
        call("magic")


def test_implausible_input_is_reported_not_flown():
    controller = afbc.Controller("afbc")
    good = controller.step(afbc.State(position_m=[0, 0, 1]), afbc.Setpoint(position_m=[0, 0, 1]))
    assert not good.state_rejected and np.all(np.isfinite(good.speeds_rad_s))
    bad = controller.step(afbc.State(position_m=[0, float("nan"), 1]), afbc.Setpoint())
    assert bad.state_rejected and np.all(np.isfinite(bad.speeds_rad_s))
    assert controller.step(None, afbc.Setpoint()).state_rejected


def test_ctrl_c_ends_long_work(tmp_path):
    # A process in the background of a shell ignores it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, lambda: signal.raise_signal(signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            afbc.campaign("robustness", out=tmp_path / "out")
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


def test_other_threads_run_meanwhile():
    counted = []
    stop = threading.Event()

    def count():
        while not stop.wait(0.01):
            counted.append(1)

    thread = threading.Thread(target=count)
    thread.start()
    afbc.campaign("robustness", flights=2, threads=1)
    stop.set()
    thread.join()
    assert len(counted) > 5
