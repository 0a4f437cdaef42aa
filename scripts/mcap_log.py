"""MCAP files by the readers of others, for scripts/check-ulog: sitl, folder of the tests' logs.

Foxglove's reader checks the file and all checksums, the decoder for ROS 2 reads the messages by their schemas, and
pyulog reads the ULog of the same flight: the numbers must be the same.
"""

import csv
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from pyulog import ULog

sitl, hostile = sys.argv[1], pathlib.Path(sys.argv[2])
# Topics that are not in the ULog.
MADE = {"/tf", "/fix", "/rosout", "/dropout", "/parameter_change"}


def run(*command, folder, code=0):
    """Returns what a command prints; it must end with this code."""
    done = subprocess.run([str(word) for word in command], cwd=folder, capture_output=True, text=True)
    assert done.returncode == code, (command, done.stdout, done.stderr)
    return done.stdout + done.stderr


def read(path):
    """Returns the messages of each topic, in the file's order, and its metadata."""
    topics = {}
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            topics.setdefault(channel.topic, []).append((message, decoded))
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        counts = reader.get_summary().statistics
        assert counts.message_count == sum(map(len, topics.values()))
    return topics, metadata


def flat(decoded):
    """Returns the fields of a message as pyulog calls them."""
    fields = {}
    for name in decoded.__slots__:
        value = getattr(decoded, name)
        if isinstance(value, (list, tuple, bytes, numpy.ndarray)):
            fields |= {f"{name}[{index}]": entry for index, entry in enumerate(value)}
        else:
            fields[name] = value
    return fields


def same(folder, ulog, mcap):
    """The file has the log's numbers. Returns both."""
    log = ULog(str(folder / ulog), None, False)
    topics, metadata = read(folder / mcap)
    expected = {f"/{data.name}" + (f"/{data.multi_id}" if data.multi_id else ""): data.data for data in log.data_list}
    assert topics.keys() - MADE == expected.keys(), topics.keys() ^ expected.keys()
    for topic, columns in expected.items():
        rows = topics[topic]
        table = [flat(decoded) for _, decoded in rows]
        for name, column in columns.items():
            values = numpy.array([row[name] for row in table], dtype=column.dtype)
            assert numpy.array_equal(values, column, equal_nan=column.dtype.kind == "f"), (topic, name)
        assert [message.log_time for message, _ in rows] == [int(us) * 1000 for us in columns["timestamp"]], topic
        assert [message.sequence for message, _ in rows] == list(range(len(rows))), topic
    texts = [decoded.msg for _, decoded in topics.get("/rosout", [])]
    assert texts == [text.message for text in log.logged_messages]
    drops = [decoded.duration_ms for _, decoded in topics.get("/dropout", [])]
    assert drops == [drop.duration for drop in log.dropouts]
    initial = {name: numpy.float32(value) for name, value in log.initial_parameters.items()}
    assert {name: numpy.float32(value) for name, value in metadata["parameters"].items()} == initial
    changed = [(decoded.name, numpy.float32(decoded.value)) for _, decoded in topics.get("/parameter_change", [])]
    assert changed == [(name, numpy.float32(value)) for _, name, value in log.changed_parameters]
    return topics, log


def rotated(rotation, vector):
    """Returns a vector rotated by a quaternion with x, y, z, w."""
    axis, w = numpy.array([rotation.x, rotation.y, rotation.z]), rotation.w
    return vector + 2 * numpy.cross(axis, numpy.cross(axis, vector) + w * vector)


def flown(folder):
    """A flight: frames as REP 103 has them."""
    logs = ["--ulog", "flight.ulg", "--mcap", "flight.mcap"]
    run(sitl, "fly", "mocap", "--controller", "afbc", "--duration", "12", *logs, folder=folder)
    topics, log = same(folder, "flight.ulg", "flight.mcap")
    [attitude] = [data.data for data in log.data_list if data.name == "vehicle_attitude"]
    positions = {message.log_time: decoded for message, decoded in topics["/vehicle_local_position"]}
    vehicle = [
        (message.log_time, transform)
        for message, decoded in topics["/tf"]
        for transform in decoded.transforms
        if transform.child_frame_id == "base_link"
    ]
    assert len(vehicle) > 400
    for log_time, transform in vehicle:
        stamp = transform.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == log_time and transform.header.frame_id == "map"
        at = positions[log_time]
        place = transform.transform.translation
        assert (place.x, place.y, place.z) == (at.y, at.x, -at.z)
        # The nose points to the heading, clockwise from north; a vehicle that flies upright has its top above.
        nose = rotated(transform.transform.rotation, numpy.array([1.0, 0, 0]))
        assert abs(math.remainder(math.atan2(nose[0], nose[1]) - at.heading, 2 * math.pi)) < 0.05
        assert rotated(transform.transform.rotation, numpy.array([0, 0, 1.0]))[2] > 0.7
    # A positive roll lowers the right side.
    w, x, y, z = (attitude[f"q[{index}]"] for index in range(4))
    roll = numpy.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    at_us = attitude["timestamp"][numpy.abs(roll).argmax()]
    nearest = min(vehicle, key=lambda frame: abs(frame[0] - int(at_us) * 1000))
    left = rotated(nearest[1].transform.rotation, numpy.array([0, 1.0, 0]))
    assert left[2] * roll[numpy.abs(roll).argmax()] > 0, (left, roll)
    assert any(t.child_frame_id == "setpoint" for _, decoded in topics["/tf"] for t in decoded.transforms)

    # Without --ulog nothing else is left; by the command it is the same file.
    run(sitl, "fly", "mocap", "--controller", "afbc", "--duration", "12", "--mcap", "alone.mcap", folder=folder)
    run(sitl, "mcap", "flight.ulg", "--out", "again.mcap", folder=folder)
    files = {name: (folder / name).read_bytes() for name in ["flight.mcap", "alone.mcap", "again.mcap"]}
    assert len(set(files.values())) == 1
    assert sorted(path.name for path in folder.iterdir()) == sorted([*files, "flight.ulg", "out"])


def refusals(folder):
    """What cannot be done says why, and leaves nothing."""
    (folder / "text.ulg").write_text("no log")
    (folder / "there.mcap").write_text("precious")
    for log, out, word in [
        ("text.ulg", "new.mcap", "not a ULog"),
        ("none.ulg", "new.mcap", "cannot be read"),
        ("text.ulg", "there.mcap", "exists already"),
        ("text.ulg", "none/new.mcap", "cannot be written"),
    ]:
        said = run(sitl, "mcap", log, "--out", out, folder=folder, code=2)
        assert word in said and said.count("\n") == 1, said
    assert (folder / "there.mcap").read_text() == "precious" and not (folder / "new.mcap").exists()


def hostile_logs(folder):
    """Logs through full rings, with dropouts and changes of parameters; and logs cut anywhere."""
    with open(hostile / "expected.csv", newline="") as file:
        names = [row["log"] for row in csv.DictReader(file)]
    for name in names:
        (folder / name).write_bytes((hostile / name).read_bytes())
        run(sitl, "mcap", name, "--out", f"{name}.mcap", folder=folder)
        same(folder, name, f"{name}.mcap")
    return len(names)


with tempfile.TemporaryDirectory() as name:
    folders = [pathlib.Path(name) / part for part in ["flown", "refusals", "hostile"]]
    for folder in folders:
        folder.mkdir()
    flown(folders[0])
    refusals(folders[1])
    print(f"check-ulog: MCAP of a flight and of {hostile_logs(folders[2])} logs has the numbers of the ULog")
