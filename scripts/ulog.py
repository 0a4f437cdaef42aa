"""The black box by pyulog, for scripts/check-ulog: sitl, folder of pyulog's programs, folder of the tests' logs."""

import csv
import pathlib
import subprocess
import sys
import tempfile

import numpy
from pyulog import ULog
from pyulog.px4 import PX4ULog

sitl, programs, hostile = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
# What Flight Review loads of a log, as far as the vehicle has it.
FLIGHT_REVIEW = """
    actuator_motors actuator_outputs battery_status estimator_status manual_control_setpoint sensor_combined
    vehicle_air_data vehicle_angular_velocity vehicle_attitude vehicle_attitude_setpoint vehicle_global_position
    vehicle_gps_position vehicle_land_detected vehicle_local_position vehicle_local_position_setpoint
    vehicle_magnetometer vehicle_rates_setpoint vehicle_status vehicle_thrust_setpoint vehicle_torque_setpoint
    vehicle_visual_odometry
""".split()
SERVE = ["serve", "--port", "0", "--station", "none", "--companion", "none", "--fast"]


def run(*command, folder):
    """Returns what a command prints; it must end well."""
    done = subprocess.run([str(word) for word in command], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, (command, done.stdout, done.stderr)
    return done.stdout


def columns(path):
    """Returns the columns of a CSV file as arrays; empty cells are not numbers."""
    with open(path, newline="") as file:
        head, *rows = csv.reader(file)
    return {name: numpy.array([float(row[i] or "nan") for row in rows]) for i, name in enumerate(head)}


def of(log, topic):
    """Returns the only instance of a topic."""
    [found] = [data for data in log.data_list if data.name == topic]
    return found.data


def by_programs(name, folder):
    """Reads a log by each of pyulog's programs."""
    log = ULog(str(folder / name), None, False)
    info = run(programs / "ulog_info", name, folder=folder)
    for line in ["sys_name: AFBC", "ver_hw: SITL", "time_ref_utc: 0", "No Dropouts"]:
        assert line in info, info
    parameters = dict(line.split(",") for line in run(programs / "ulog_params", "-i", name, folder=folder).split())
    assert len(parameters) == len(log.initial_parameters) > 200
    assert float(parameters["V_MASS"]) == numpy.float32(0.486), parameters["V_MASS"]
    assert isinstance(log.initial_parameters["MAV_SYS_ID"], int), "a whole number is an integer"
    run(programs / "ulog2csv", "-o", "csv", name, folder=folder)
    for data in log.data_list:
        path = folder / "csv" / f"{pathlib.Path(name).stem}_{data.name}_{data.multi_id}.csv"
        rows = columns(path)
        assert len(rows["timestamp"]) == len(data.data["timestamp"]) > 0, path
        steps = numpy.diff(data.data["timestamp"].astype(numpy.int64))
        assert (steps >= 0).all(), data.name
    assert log.file_corruption is False and log.dropouts == []
    return log


def flight(folder):
    """The flight of the firmware's code: the same reference as in `fly`'s CSV, the same states as in `replay`'s."""
    scenario, seconds = "mocap", 15
    options = ["--controller", "afbc", "--duration", str(seconds), "--ulog", "flight.ulg"]
    run(sitl, "fly", scenario, *options, folder=folder)
    run(sitl, "replay", "flight.ulg", folder=folder)
    log = by_programs("flight.ulg", folder)

    # pyulog's numbers beside those that our own reader has written, in PX4's frames and in ours.
    replay = columns(folder / "out/replay-flight/replay.csv")
    attitude = of(log, "vehicle_attitude")
    first_us = of(log, "sensor_combined")["timestamp"][0] - of(log, "sensor_combined")["gyro_integral_dt"][0] // 2
    PX4ULog(log).add_roll_pitch_yaw(["vehicle_attitude", "vehicle_attitude_setpoint:_d"])
    time_us = numpy.round(replay["time_s"] * 1e6).astype(numpy.int64) + int(first_us)
    for topic, names in [
        ("vehicle_attitude", [("roll", "roll_rad", 1), ("pitch", "pitch_rad", -1), ("yaw", "yaw_rad", -1)]),
        ("vehicle_local_position", [("x", "x_m", 1), ("y", "y_m", -1), ("z", "z_m", -1), ("vx", "vx_m_s", 1)]),
    ]:
        data = of(log, topic)
        place = {int(at): index for index, at in enumerate(data["timestamp_sample"])}
        compared = 0
        for row, at in enumerate(time_us):
            for theirs, ours, sign in names:
                logged = replay[f"logged_{ours}"][row]
                if int(at) in place and numpy.isfinite(logged):
                    value = sign * data[theirs][place[int(at)]]
                    assert abs(value - logged) < 2e-6 * max(1, abs(logged)), (topic, theirs, at, value, logged)
                    compared += 1
        assert compared > 100 * len(names), (topic, compared)

    # The reference from arming on; the vehicle of the results flies it without a link, so its motion is only close.
    fly = columns(folder / f"out/{scenario}/{scenario}-afbc.csv")
    armed_s = of(log, "vehicle_status")["armed_time"].max() / 1e6
    wanted, is_at = of(log, "vehicle_local_position_setpoint"), of(log, "vehicle_local_position")
    for name, sign, of_name in [("x", 1, "x"), ("y", -1, "y"), ("z", -1, "z")]:
        for data, column, most in [(wanted, f"{of_name}_d_m", 0.1), (is_at, f"{of_name}_m", 0.2)]:
            time_s = data["timestamp"] / 1e6 - armed_s
            inside = (time_s > 3) & (time_s < seconds - 1)
            shown = numpy.interp(time_s[inside], fly["time_s"], fly[column])
            off = numpy.abs(sign * data[name][inside] - shown).max()
            assert inside.sum() > 100 and off < most, (column, off)

    # Thrust carries the weight, rates are the attitude's, and the accelerometer feels gravity.
    motors = of(log, "actuator_motors")
    flies = (motors["timestamp"] / 1e6 > armed_s + 1) & numpy.isfinite(motors["control[0]"])
    controls = numpy.array([motors[f"control[{index}]"][flies] for index in range(4)])
    assert ((0 <= controls) & (controls <= 1)).all() and numpy.isnan(motors["control[4]"]).all()
    parameter = log.initial_parameters
    newtons = controls.mean() * 4 * parameter["C_FORCE_MAX"]
    weight = parameter["V_MASS"] * parameter["V_GRAVITY"]
    assert abs(newtons / weight - 1) < 0.1, (newtons, weight)
    yaw, rates = numpy.unwrap(attitude["yaw"]), of(log, "vehicle_angular_velocity")["xyz[2]"]
    turned = numpy.trapezoid(rates, of(log, "vehicle_angular_velocity")["timestamp"] / 1e6)
    assert abs(turned - (yaw[-1] - yaw[0])) < 0.1, (turned, yaw[-1] - yaw[0])
    felt = of(log, "sensor_combined")["accelerometer_m_s2[2]"].mean()
    assert abs(felt + parameter["V_GRAVITY"]) < 0.5, felt
    said = run(programs / "ulog_messages", "flight.ulg", folder=folder)
    assert "INFO: offboard: ordered" in said and len(log.logged_messages) > 0, said

    # As Flight Review's loader does it: its list of topics, no tolerance for texts that are none.
    loaded = ULog(str(folder / "flight.ulg"), FLIGHT_REVIEW, False)
    assert {data.name for data in loaded.data_list} <= set(FLIGHT_REVIEW) and len(loaded.data_list) > 10


def served(folder):
    """A served vehicle has what a satellite receiver, a battery and the place on the earth add."""
    run(sitl, *SERVE, "--ulog", "served.ulg", "--do", "at 6 quit", folder=folder)
    log = by_programs("served.ulg", folder)
    fix, place = of(log, "vehicle_gps_position"), of(log, "vehicle_global_position")
    # Where PX4's simulation is.
    for data, names in [(fix, ["latitude_deg", "longitude_deg"]), (place, ["lat", "lon"])]:
        for name, degrees in zip(names, [47.397742, 8.545594]):
            assert numpy.abs(data[name] - degrees).max() < 1e-4, (name, data[name])
    assert abs(place["alt"].mean() - 488) < 5 and fix["fix_type"].min() == 3
    assert of(log, "battery_status")["voltage_v"].min() > 9
    assert (of(log, "vehicle_land_detected")["landed"] == 1).all()
    # A field at rest is the earth's: half a gauss.
    field = of(log, "vehicle_magnetometer")
    strength = sum(field[f"magnetometer_ga[{axis}]"] ** 2 for axis in range(3)) ** 0.5
    assert 0.2 < strength.mean() < 0.8, strength.mean()


def hostile_logs():
    """Logs through full rings, and logs cut short: what the strict reader has counted in each."""
    with open(hostile / "expected.csv", newline="") as file:
        expected = list(csv.DictReader(file))
    for row in expected:
        log = ULog(str(hostile / row["log"]), None, False)
        counts = {data.name: len(data.data["timestamp"]) for data in log.data_list}
        assert sum(counts.values()) == int(row["messages"]), (row, counts)
        assert counts.get("sensor_combined", 0) == int(row["samples"]), (row, counts)
        assert [drop.duration for drop in log.dropouts] == [int(ms) for ms in row["dropouts_ms"].split()], row
        assert len(log.logged_messages) == int(row["texts"]), row
        assert len(log.initial_parameters) == int(row["initial"]), row
        assert len(log.changed_parameters) == int(row["changes"]), row
        assert not log.file_corruption, row
    return len(expected)


with tempfile.TemporaryDirectory() as name:
    for judge in [flight, served]:
        folder = pathlib.Path(name) / judge.__name__
        folder.mkdir()
        judge(folder)
print(f"check-ulog: pyulog reads a flight, a served vehicle and {hostile_logs()} logs through full rings")
