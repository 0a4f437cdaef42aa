"""Gymnasium's and PettingZoo's own checkers, and that one vehicle is as good as one of many."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from pettingzoo.test import parallel_api_test, parallel_seed_test

import afbc
import afbc.gymnasium
import afbc.pettingzoo
from afbc.gymnasium import FlightEnv, FlightVectorEnv

FLIGHTS = [("hover", "crazyflie"), ("hardware", "hummingbird"), ("wind", "f550")]


@pytest.mark.parametrize("scenario, vehicle", FLIGHTS)
def test_gymnasium_accepts_it(scenario, vehicle):
    check_env(FlightEnv(scenario, vehicle), skip_render_check=True)
    made = gymnasium.make("afbc.gymnasium:afbc/Flight-v0", scenario=scenario, vehicle=vehicle)
    assert made.reset(seed=1)[0].shape == made.observation_space.shape


@pytest.mark.parametrize("scenario, vehicle", FLIGHTS)
def test_many_are_as_many_single_ones(scenario, vehicle):
    """The reference, in every bit, is Gymnasium's own vector environment of single ones: through ends and starts."""
    count, options = 3, {"duration_s": 0.25, "far_m": 0.7 if scenario == "wind" else 1.5}
    many = RecordEpisodeStatistics(FlightVectorEnv(count, scenario, vehicle, **options))
    single = RecordEpisodeStatistics(SyncVectorEnv([lambda: FlightEnv(scenario, vehicle, **options)] * count))
    assert many.unwrapped.single_observation_space == single.unwrapped.single_observation_space
    assert many.observation_space == single.observation_space and many.action_space == single.action_space
    assert many.metadata["autoreset_mode"] == single.metadata["autoreset_mode"]
    many.action_space.seed(5)
    same(many.reset(seed=7), single.reset(seed=7))
    ended = np.zeros(2)
    for _ in range(200):
        actions = many.action_space.sample()
        ours, theirs = many.step(actions), single.step(actions)
        same(ours, theirs)
        ended += [np.sum(ours[2]), np.sum(ours[3])]
    assert np.all(ended > 0), f"lost and over: {ended}"


def same(ours, theirs):
    for mine, other in zip(ours, theirs, strict=True):
        if not isinstance(mine, dict):
            assert mine.dtype == other.dtype and np.array_equal(mine, other)
            continue
        # Times of episodes are those of the clock on the wall.
        assert set(mine) - {"_distance_m", "distance_m"} == set(other) - {"_distance_m", "distance_m"}
        if "_distance_m" in other:
            assert np.array_equal(mine["_distance_m"], other["_distance_m"])
            assert np.array_equal(mine["distance_m"], other["distance_m"])


@pytest.mark.parametrize("scenario, vehicle", FLIGHTS)
def test_pettingzoo_accepts_it(scenario, vehicle):
    parallel_api_test(afbc.pettingzoo.FlightParallelEnv(3, scenario, vehicle, duration_s=2.0), num_cycles=300)
    parallel_seed_test(lambda: afbc.pettingzoo.FlightParallelEnv(3, scenario, vehicle, duration_s=1.0))


@pytest.mark.parametrize("vehicle", ["crazyflie", "f550"])
def test_a_law_of_ours_is_a_good_policy(vehicle):
    """What actions, observations and rewards mean: AFBC, given what the environment observes, earns nearly all."""
    env = FlightEnv("hover", vehicle, control_hz=1000)
    law, largest_n = afbc.Controller("afbc", vehicle), afbc.Vehicle(vehicle).rotor_force_max_n
    seen, _ = env.reset(seed=3)
    earned = []
    for _ in range(8000):
        state = afbc.State(seen[0:3], seen[3:6], seen[6:9], seen[9:12])
        seen, reward, lost, over, info = env.step(2 * law.step(state, afbc.Setpoint()).forces_n / largest_n - 1)
        assert not lost and not over
        earned.append(reward)
    assert np.mean(earned[-1000:]) > 0.95 and info["distance_m"] < 0.05


@pytest.mark.parametrize("options", [{"control_hz": 3}, {"vehicle": "crazyfly"}, {"scenario": "hovver"}])
def test_bad_options_are_refused_by_one_line(options):
    for make in (FlightEnv, lambda **options: FlightVectorEnv(2, **options)):
        with pytest.raises(afbc.AfbcError) as raised:
            make(**options)
        assert "\n" not in str(raised.value)


WRONG = {
    FlightVectorEnv: [
        lambda env: env.reset(seed=-1),
        lambda env: env.reset(seed=1.5),
        lambda env: env.reset(seed=2**64),
        lambda env: env.reset(seed=[1, 2]),
        lambda env: env.reset(seed=[1, 2, 3, 4]),
        lambda env: env.reset(seed=[1, 2, -3]),
        lambda env: env.reset(seed=np.array([1.0, 2.0, 3.0])),
        lambda env: env.reset(seed="1"),
        lambda env: env.reset(options={"reset_mask": [0, 2]}),
        lambda env: env.reset(options={"reset_mask": np.array([True])}),
        lambda env: env.reset(options={"reset_mask": np.ones((3, 1), dtype=bool)}),
        lambda env: env.reset(options={"reset_mask": np.ones(3)}),
        lambda env: env.reset(options=5),
        lambda env: env.step(np.zeros((2, 4))),
        lambda env: env.step(np.zeros(4)),
        lambda env: env.step(np.full((3, 4), np.nan)),
        lambda env: env.step(np.full((3, 4), np.inf)),
        lambda env: env.step([["0"] * 4] * 3),
        lambda env: env.step(None),
        lambda env: env.task.reset(-1, np.random.default_rng(1)),
        lambda env: env.task.reset(3, np.random.default_rng(1)),
        lambda env: env.task.reset(0, 5),
    ],
    FlightEnv: [
        lambda env: env.reset(seed=-1),
        lambda env: env.reset(seed=0.5),
        lambda env: env.step(np.zeros(3)),
        lambda env: env.step(np.full(4, np.nan)),
        lambda env: env.step(None),
    ],
    afbc.pettingzoo.FlightParallelEnv: [
        lambda env: env.reset(seed=-1),
        lambda env: env.reset(seed="x"),
        lambda env: env.step({}),
        lambda env: env.step({"vehicle_0": np.zeros(4)}),
        lambda env: env.step({f"vehicle_{i}": np.zeros(4) for i in range(4)}),
        lambda env: env.step({f"vehicle_{i}": np.zeros(5) for i in range(3)}),
        lambda env: env.step({f"vehicle_{i}": np.full(4, np.nan) for i in range(3)}),
        lambda env: env.step(np.zeros((3, 4))),
    ],
}


@pytest.mark.parametrize("kind, call", [(kind, call) for kind in WRONG for call in WRONG[kind]])
def test_wrong_calls_are_refused_by_one_line(kind, call):
    env = kind(*([] if kind is FlightEnv else [3]), "hover", "crazyflie")
    env.reset(seed=1)
    with pytest.raises((TypeError, afbc.AfbcError)) as raised:
        call(env)
    assert str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, "x", None, [1.0], 10**400])
@pytest.mark.parametrize("option", ["duration_s", "far_m", "spread_m", "spread_rad", "control_hz"])
def test_wrong_options_are_refused_by_name(option, value):
    if (option, value) == ("duration_s", None):
        return
    for make in (FlightEnv, lambda **given: FlightVectorEnv(2, **given), afbc.pettingzoo.FlightParallelEnv):
        with pytest.raises((TypeError, afbc.AfbcError), match=option):
            make(**{option: value})


@pytest.mark.parametrize("count", [0, -1, 1.5, "2", None, 10**12, 2**31])
def test_wrong_counts_are_refused_by_name(count):
    for make in (FlightVectorEnv, afbc.pettingzoo.FlightParallelEnv):
        with pytest.raises((TypeError, afbc.AfbcError), match="count"):
            make(count)


def test_a_mask_starts_those_alone_that_it_names():
    env = FlightVectorEnv(3, "hover", "crazyflie")
    first, _ = env.reset(seed=[1, None, 3])
    env.step(np.zeros((3, 4)))
    seen, _ = env.reset(seed=[1, 2, 3], options={"reset_mask": np.array([True, False, True])})
    assert np.array_equal(seen[[0, 2]], first[[0, 2]]) and not np.array_equal(seen[1], first[1])
