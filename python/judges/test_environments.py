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
