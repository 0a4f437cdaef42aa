"""The estimator, stepped beside a plant."""

import numpy as np
import pytest

import afbc


def quaternion(roll, pitch, yaw):
    """w, x, y, z of the z-y-x sequence."""
    (cr, cp, cy), (sr, sp, sy) = (f(np.array([roll, pitch, yaw]) / 2) for f in (np.cos, np.sin))
    return [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]


def test_it_follows_a_flight_on_late_poses():
    scenario = afbc.Scenario("circle").replace(duration_s=20)
    controller, plant, estimator = afbc.Controller("afbc"), afbc.Plant(scenario), afbc.Estimator()
    random = np.random.default_rng(1)
    bias, rest, late = np.array([0.01, -0.02, 0.015]), 2.0, []
    time, errors = 0.0, []
    for step in range(12_000):
        time = 0.001 * (step + 1)
        resting = time < rest
        truth = plant.true_state
        rates = np.zeros(3) if resting else truth.rates_rad_s
        level = quaternion(0, 0, truth.attitude_rad[2]) if resting else quaternion(*truth.attitude_rad)
        force = [0, 0, 9.81] if resting else plant.specific_force_m_s2
        if step % 10 == 0:
            late.append((time, truth.position_m + random.normal(0, 0.001, 3), level))
        if len(late) > 1:
            estimator.pose(*late.pop(0))
        estimator.step(time, rates + bias + random.normal(0, 1e-3, 3), force + random.normal(0, 0.02, 3))
        if not resting:
            plant.step(controller.step(plant.state, plant.setpoint).speeds_rad_s)
        if time > 8:
            assert all(estimator.valid[part] for part in ("attitude", "velocity", "position")), estimator.unready
            errors.append(estimator.state.position_m - truth.position_m)
    assert np.sqrt(np.mean(np.square(errors))) < 0.02
    assert np.allclose(estimator.biases["gyro_rad_s"], bias, atol=3e-3)
    assert np.all(estimator.sigmas["position_m"] > 0)


@pytest.mark.parametrize(
    "call",
    [
        lambda e: e.pose(1.0, [0, 0, float("nan")], [1, 0, 0, 0]),
        lambda e: e.pose(1.0, [0, 0, 0], [0, 0, 0, 0]),
        lambda e: e.height(1.0, 1.0, -1.0),
        lambda e: e.height(-1.0, 1.0),
        lambda e: e.step(float("nan")),
        lambda e: e.step(1.0, [0, 0, 0]),
    ],
)
def test_what_no_sensor_says_is_refused(call):
    with pytest.raises(afbc.AfbcError) as raised:
        call(afbc.Estimator())
    assert "\n" not in str(raised.value)
