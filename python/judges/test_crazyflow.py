"""Crazyflow's controller on our plant."""

import drone_controllers  # noqa: F401  Before anything that imports SciPy: it asks for its array API.
import pytest

import afbc
import afbc.crazyflow


@pytest.mark.parametrize("scenario, rms_m", [("hover", 0.1), ("circle", 0.1)])
def test_its_mellinger_flies_our_crazyflie(scenario, rms_m):
    law = {"mellinger": afbc.crazyflow.mellinger()}
    flight = afbc.fly(scenario, law, vehicle="crazyflie", duration_s=10)["mellinger"]
    assert flight.lost is None
    assert flight.metrics["rmse_position_m"] < rms_m
