"""The package and `sitl` give the same bits, and so do all ways to fly in the package."""

import csv

import numpy as np
import pytest

import afbc


def same(column, texts):
    """Numbers in a CSV file have the fewest digits that restore them, in the precision in which they were computed."""
    written = np.array([float(text) for text in texts])
    single = written.astype(np.float32) == column.astype(np.float32)
    return np.array_equal(written, column, equal_nan=True) or bool(
        np.all(single | np.isnan(written)) and np.array_equal(column, column.astype(np.float32), equal_nan=True)
    )


@pytest.mark.parametrize(
    "arguments",
    [
        {"scenario": "hover"},
        {"scenario": "hardware", "controllers": ["afbc", "indi", "mpc"]},
        {"scenario": "hover", "vehicle": "crazyflie", "controllers": ["afbc"]},
        {"scenario": "mocap", "controllers": ["afbc"], "duration_s": 12},
    ],
    ids=lambda arguments: "-".join(str(value) for value in arguments.values()),
)
def test_a_flight_is_the_same_as_on_the_command_line(arguments, sitl, tmp_path):
    command = ["fly", arguments["scenario"], "--out", tmp_path / "out"]
    for name in arguments.get("controllers", []):
        command += ["--controller", name]
    if "vehicle" in arguments:
        command += ["--vehicle", arguments["vehicle"]]
    if "duration_s" in arguments:
        command += ["--duration", arguments["duration_s"]]
    sitl(*command, cwd=tmp_path)
    flights = afbc.fly(**arguments)
    assert flights
    for name, flight in flights.items():
        [path] = (tmp_path / "out").glob(f"*-{name}.csv")
        with open(path, newline="") as file:
            rows = list(csv.DictReader(file))
        assert list(rows[0]) == list(flight.columns)
        for column, values in flight.columns.items():
            assert same(values, [row[column] for row in rows]), (name, column)


@pytest.mark.parametrize("law", ["afbc", "pid", "indi"])
@pytest.mark.parametrize("vehicle", [None, "crazyflie", "racer"])
def test_stepping_is_flying(law, vehicle):
    scenario = afbc.Scenario("hover")
    if vehicle:
        scenario = scenario.replace(vehicle=vehicle)
    flight = afbc.fly(scenario, [law], log_hz=1000, duration_s=3)[law]
    controller, plant = afbc.Controller(law, vehicle), afbc.Plant(scenario)
    for row in range(len(flight)):
        action = controller.step(plant.state, plant.setpoint)
        assert plant.true_vector[2] == flight["z_m"][row], (row, law, vehicle)
        assert action.speeds_rad_s[0] == flight["omega1_rad_s"][row], row
        plant.step(action.speeds_rad_s)


def test_a_batch_is_as_many_plants():
    scenario = afbc.Scenario("hardware")
    batch = afbc.Batch(5, scenario, seed=7)
    plants = [afbc.Plant(scenario, seed=7 + i) for i in range(5)]
    random = np.random.default_rng(1)
    for _ in range(50):
        speeds = random.uniform(150, 250, (5, scenario.rotors))
        batch.step(speeds, 4)
        for plant, row in zip(plants, speeds):
            for _ in range(4):
                plant.step(row)
    assert np.array_equal(batch.true_states, [plant.true_vector for plant in plants])
    assert np.array_equal(batch.states, [plant.state.vector for plant in plants])
    batch.reset(3, 11)
    assert np.array_equal(batch.true_states[3], afbc.Plant(scenario, seed=11).true_vector)


def test_a_campaign_writes_the_same_bytes_and_resumes(sitl, tmp_path):
    text = sitl("campaigns", "robustness", cwd=tmp_path).stdout
    text = "\n".join("flights = 6" if line.startswith("flights") else line for line in text.splitlines())
    (tmp_path / "small.toml").write_text(text)
    sitl("campaign", "small.toml", "--out", "by-sitl", cwd=tmp_path)
    path = tmp_path / "small.toml"
    frame = afbc.campaign(path, out=tmp_path / "by-python", threads=1)
    again = afbc.campaign(path, out=tmp_path / "by-python")
    for name in ["results.parquet", "summary.json"]:
        by_sitl, by_python = ((tmp_path / folder / name).read_bytes() for folder in ["by-sitl", "by-python"])
        assert by_sitl == by_python, name
    in_memory = afbc.campaign(path)
    assert frame.equals(again) and frame.equals(in_memory)


def test_shards_are_the_parts_of_the_whole(sitl, tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(
        'name = "small"\nflights = 7\nduration_s = 6\nscenario = "hover"\n[spread]\nmass_ratio = [0.8, 1.2]\n'
    )
    sitl("campaign", path, "--out", "whole", cwd=tmp_path)
    frames = [afbc.campaign(path, shard=f"{i}/3", out=tmp_path / f"{i}") for i in (1, 2, 3)]
    for i, frame in enumerate(frames):
        assert frame.equals(afbc.campaign(path, shard=f"{i + 1}/3")) and set(frame["flight"]) == set(range(i, 7, 3))
    merged = afbc.merge([tmp_path / f"{i}" for i in (3, 1, 2)], tmp_path / "merged")
    assert merged.equals(afbc.campaign(path))
    for name in ["results.parquet", "summary.json", "report.html"]:
        assert (tmp_path / "merged" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


def test_a_plant_begins_where_it_is_put():
    state = afbc.State([3, 2, 1], [0.5, 0, 0], [0.1, 0.2, 0.3], [0, 0, 1])
    plant, batch = afbc.Plant("hardware"), afbc.Batch(2, "hardware")
    plant.reset(5, state)
    batch.reset(1, 5, state)
    np.testing.assert_allclose(plant.true_vector, state.vector, atol=1e-7)
    assert np.array_equal(batch.true_states[1], plant.true_vector)
    assert not np.array_equal(batch.true_states[0], plant.true_vector)
    with pytest.raises(afbc.AfbcError):
        batch.reset(1, 5, afbc.State([float("nan"), 0, 0]))


def test_a_replay_is_the_same_as_on_the_command_line(sitl, tmp_path):
    sitl(
        "fly", "mocap", "--duration", 20, "--controller", "afbc", "--ulog", "flight.ulg", "--out", "flown", cwd=tmp_path
    )
    sitl("replay", "flight.ulg", "--out", "replayed", cwd=tmp_path)
    frame = afbc.replay(tmp_path / "flight.ulg")
    with open(tmp_path / "replayed/replay.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(frame.columns) and len(rows) == len(frame)
    for name in frame.columns[1:]:
        written = np.array([float(row[name] or "nan") for row in rows], dtype=np.float32)
        assert np.array_equal(written, np.asarray(frame[name], dtype=np.float32), equal_nan=True), name
