"""What joblib and multiprocessing do with the package, Ctrl-C, and what is shown of a flight."""

import copy
import json
import multiprocessing
import pickle
import signal
import threading
import time

import numpy as np
import pytest

import afbc

TEXT = """
duration_s = 0.5
vehicle = { name = "racer" }
[trajectory]
kind = "hover"
position_m = [0, 0, 1]
[[contender]]
name = "pid"
controller = "pid"
"""


HOVER = 'kind = "hover"\nposition_m = [0, 0, 1]'


def scenarios(folder):
    """Scenarios of every origin: built in, a text, a file with a path and a vehicle beside it, changed."""
    (folder / "path.csv").write_text("time_s,x_m,y_m,z_m\n0,0,0,1\n1,0,0,1\n2,1,0,1\n3,1,0,1\n")
    (folder / "own.toml").write_text(TEXT.replace(HOVER, "kind = 'file'\nfile = 'path.csv'"))
    yield afbc.Scenario(folder / "own.toml")
    yield afbc.Scenario("hover").replace(duration_s=0.5)
    yield afbc.Scenario.from_toml(TEXT, "mine").replace(seed=7)
    yield afbc.Scenario.from_toml(TEXT, "mine").replace(vehicle="iris", duration_s=0.3).replace(seed=3)


def made_again():
    return [pickle_again, copy.copy, copy.deepcopy]


def pickle_again(of):
    return pickle.loads(pickle.dumps(of))


@pytest.mark.parametrize("again", made_again(), ids=lambda again: again.__name__)
def test_a_scenario_is_the_same_again(again, tmp_path):
    for scenario in scenarios(tmp_path):
        other = again(scenario)
        assert other == scenario and hash(other) == hash(scenario) and other != afbc.Scenario("storm")
        assert (other.name, other.seed, other.duration_s) == (scenario.name, scenario.seed, scenario.duration_s)
        flown, same = (afbc.fly(of, ["pid"])["pid"] for of in (scenario, other))
        assert np.array_equal(flown["z_m"], same["z_m"])


def test_a_scenario_of_a_file_is_found_from_elsewhere(tmp_path, monkeypatch):
    path = tmp_path / "own.toml"
    path.write_text(TEXT)
    monkeypatch.chdir(tmp_path)
    scenario = afbc.Scenario("own.toml")
    kept = pickle.dumps(scenario)
    path.unlink()
    monkeypatch.chdir("/")
    assert pickle.loads(kept) == scenario


@pytest.mark.parametrize("again", made_again(), ids=lambda again: again.__name__)
def test_values_and_flights_are_the_same_again(again):
    vehicle = afbc.Vehicle("racer")
    assert again(vehicle) == vehicle != afbc.Vehicle("iris")
    state, setpoint = afbc.State([1, 2, 3], [0.1] * 3), afbc.Setpoint([1, 2, 3], yaw_rad=0.5, yaw_rate_rad_s=0.1)
    assert np.array_equal(again(state).vector, state.vector)
    for name in ("position_m", "snap_m_s4", "yaw_rad", "yaw_rate_rad_s"):
        assert np.array_equal(getattr(again(setpoint), name), getattr(setpoint, name))
    flight = afbc.fly("hover", ["pid"], duration_s=6)["pid"]
    other = again(flight)
    assert repr(other) == repr(flight) and len(other) == len(flight) and other.metrics == flight.metrics
    assert (other.contender, other.scenario, other.lost) == (flight.contender, flight.scenario, flight.lost)
    assert list(other.columns) == list(flight.columns)
    assert all(np.array_equal(other[name], flight[name], equal_nan=True) for name in flight.columns)


@pytest.mark.parametrize("of", [afbc.Plant(), afbc.Batch(1), afbc.Controller("pid"), afbc.Estimator()])
def test_what_moves_cannot_be_pickled(of):
    with pytest.raises(TypeError, match="pickle"):
        pickle.dumps(of)


def flown(scenario):
    """Flies in another process."""
    batch = afbc.Batch(4, scenario)
    batch.step(np.full((4, scenario.rotors), 100.0), 50)
    return afbc.fly(scenario, ["pid"], threads=1)["pid"], batch.true_states


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_other_processes_fly(method):
    """A forked process has its parent's memory, but none of its threads."""
    scenario = afbc.Scenario("hover").replace(duration_s=1)
    here, states = flown(scenario)
    with multiprocessing.get_context(method).Pool(2) as pool:
        for flight, others in pool.map_async(flown, [scenario] * 3).get(timeout=120):
            assert np.array_equal(flight["z_m"], here["z_m"]) and np.array_equal(others, states)


LONG = afbc.Scenario("hover").replace(duration_s=36_000)


@pytest.mark.parametrize(
    "work",
    [
        lambda: afbc.fly(LONG, ["pid"], log_hz=1),
        lambda: afbc.compare(LONG, ["pid", "afbc"], seeds=50),
        lambda: afbc.compare("storm", ["pid"], seeds=5000),
        lambda: afbc.Batch(1000).step(np.full((1000, 4), 100.0), 1_000_000),
        lambda: afbc.tune("pid", "storm", budget=100_000),
    ],
    ids=["fly", "compare", "seeds", "batch", "tune"],
)
def test_ctrl_c_ends_it_soon(work):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, lambda: signal.raise_signal(signal.SIGINT))
    timer.start()
    start = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)
    # Far less than the hours of the whole; how soon depends on who else computes here.
    assert time.monotonic() - start < 60


def test_a_flight_shows_what_was_measured():
    short, long = (afbc.fly("hover", ["pid"], duration_s=length_s)["pid"] for length_s in (1, 6))
    assert "rms" not in repr(short) and "0.000" not in repr(short) and short.metrics["rmse_position_m"] is None
    assert f"{1000 * long.metrics['rmse_position_m']:.3f} mm rms" in repr(long)


def test_a_comparison_flies_the_seeds_of_the_command_line(sitl, tmp_path):
    for name in ("hover", "storm"):
        told = json.loads(sitl("compare", name, "--controllers", "pid", "--json", "--force", cwd=tmp_path).stdout)
        frame = afbc.compare(name, ["pid"])
        assert list(frame["seed"]) == told[0]["contenders"][0]["seeds"]
        assert len(frame) == (10 if name == "storm" else 1)


def test_lists_will_do_for_arrays():
    plant, other, batch = afbc.Plant(), afbc.Plant(), afbc.Batch(2, seed=afbc.Scenario("hover").seed)
    for _ in range(50):
        plant.step([200, 210.5, 200, 200])
        other.step(np.array([200, 210.5, 200, 200], dtype=">f8"))
        batch.step([[200, 210.5, 200, 200]] * 2)
    assert np.array_equal(plant.true_vector, other.true_vector)
    assert np.array_equal(plant.true_vector, batch.true_states[0])


def test_gains_are_a_mapping_or_pairs():
    gains = dict(list(afbc.Controller("afbc").gains.items())[:2])
    doubled = {name: 1.1 * value for name, value in gains.items()}
    for kind in (afbc.Controller, afbc.FlightCore):
        kind("afbc", gains=doubled), kind("afbc", gains=list(doubled.items()))
    taken = afbc.Controller("afbc", gains=doubled).gains
    assert all(taken[name] == pytest.approx(value, rel=1e-6) for name, value in doubled.items())
