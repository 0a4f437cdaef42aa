"""The other parts of the firmware, stepped beside a plant: flight core, guidance, instruments."""

import numpy as np
import pytest

import afbc


@pytest.mark.parametrize("vehicle", ["paper", "f550"])
def test_a_vehicle_arms_takes_off_flies_somewhere_and_lands(vehicle):
    scenario = afbc.Scenario("waypoints").replace(duration_s=60)
    core, guidance = afbc.FlightCore("afbc", vehicle), afbc.Guidance(vehicle)
    plant = afbc.Plant(scenario, vehicle=vehicle)
    modes, answers, ended, places = [], [], [], []
    for step in range(45_000):
        setpoint = guidance.step(plant.state, core.mode, airborne=core.airborne, rested=core.rested)
        if guidance.answer:
            answers.append(guidance.answer)
        if step == 2000:
            core.request("arm")
        elif step == 3000:
            guidance.take_off(2.0)
        elif step == 12_000:
            guidance.go_to([1.0, 0.5, 2.5], speed_m_s=1.0)
        elif step == 22_000:
            guidance.select("land")
        elif guidance.request:
            core.request(guidance.request)
        action = core.step(plant.state, setpoint, idle_on_ground=guidance.idle_on_ground)
        if core.answer:
            answers.append(core.answer)
        if core.ended:
            ended.append(core.ended)
        if not modes or modes[-1] != core.mode:
            modes.append(core.mode)
        if step in (11_999, 21_999):
            places.append(plant.true_state.position_m)
        plant.step(action.speeds_rad_s)
        if ended:
            break
    assert modes[:2] == ["disarmed", "flying"] and modes[-1] == "disarmed", modes
    assert "arm: granted" in answers and answers.count("granted") == 3, answers
    assert len(ended) == 1
    assert abs(places[0][2] - 2.0) < 0.2 and np.allclose(places[1], [1.0, 0.5, 2.5], atol=0.2), places
    assert plant.on_ground


def test_a_flight_core_refuses_and_coasts():
    core, plant = afbc.FlightCore("pid"), afbc.Plant("hover")
    core.request("arm")
    core.step(plant.state, plant.setpoint)
    assert core.mode == "disarmed" and core.answer != "arm: granted" and core.against
    for step in range(4000):
        if step == 3000:
            core.request("arm")
        action = core.step(afbc.State([0, 0, 1e-5 * (step % 2)]), afbc.Setpoint([0, 0, 0]))
    assert core.mode == "flying" and action.speeds_rad_s.shape == (4,)
    for _ in range(300):
        core.step()
    assert core.mode in ("coasting", "descending")


def test_instruments_read_a_plant_by_their_seed():
    def readings(seed):
        instruments, plant = afbc.Instruments("outdoor", seed=seed), afbc.Plant("outdoor", seed=1)
        controller, run = afbc.Controller("afbc"), []
        for _ in range(3000):
            run.append(instruments.measure(plant))
            plant.step(controller.step(plant.state, plant.setpoint).speeds_rad_s)
        return run

    first, again, other = readings(1), readings(1), readings(2)
    force = [np.array([reading["imu"]["specific_force_m_s2"] for reading in run]) for run in (first, again, other)]
    assert np.array_equal(force[0], force[1]) and not np.array_equal(force[0], force[2])
    assert abs(np.mean(force[0][:, 2]) - 9.81) < 1.0
    assert sum(len(reading["gnss"]) for reading in first) >= 4
    assert sum(len(reading["barometer"]) for reading in first) >= 10


@pytest.mark.parametrize(
    "call",
    [
        lambda: afbc.Instruments("hover"),
        lambda: afbc.FlightCore("nothing"),
        lambda: afbc.FlightCore().request("fly"),
        lambda: afbc.Guidance().select("acrobatics"),
        lambda: afbc.Guidance().step(None, "asleep"),
        lambda: afbc.Guidance().sticks(2.0, 0.0, 0.0, 0.0),
        lambda: afbc.Guidance(dt_s=float("nan")),
    ],
)
def test_bad_input_is_one_line(call):
    with pytest.raises(afbc.AfbcError) as raised:
        call()
    assert "\n" not in str(raised.value)
