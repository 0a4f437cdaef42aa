"""A second opinion on the estimator: batch least squares over the same samples.

    second_opinion.py SITL

Makes a flight of 21 s with an inertial sensor, a GNSS receiver, a barometer and a magnetometer, writes it as a log that
`SITL replay` reads, and solves for the whole trajectory up to each of a few times by Gauss-Newton (scipy): states every
40 ms, what the inertial sensor says between them with its noise, and all that had arrived. With the same samples and
the same noise told, both must say the same: the filter's estimate within a fraction of its own standard deviation of
the batch's, and its standard deviations must be those of the batch. That this can fail is checked as well.

Frames are PX4's: north, east, down; forward, right, down. Errors are 16: rotation (earth frame), velocity, position,
bias of gyroscope and accelerometer, barometer's offset.
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

# What the estimator is told (docs/estimation.md): settings, receiver, barometer, magnetometer.
GYRO, ACCEL, GYRO_WALK, ACCEL_WALK, BARO_WALK = 1e-3, 2e-2, 5e-5, 3e-4, 0.02
ACCEL_BIAS, REST_M_S = 0.1, 2e-3
FIX_M, FIX_M_S, BARO_M, FIELD_GAUSS = np.array([0.5, 0.5, 1.0]), 0.3, 0.5, 0.05
DELAY_US = 110_000

GRAVITY = np.array([0.0, 0.0, 9.81])
STEP_US = 4_000
# The vehicle rests, and the estimator aligns until then.
REST_S, ALIGNED_US, END_S = 1.5, 1_004_000, 21.0
# Of the field, rounded: what counts is what the estimator is told.
DECLINATION = np.radians(-4.0)
# On the equator at longitude 0: metres per 1e-7 degrees (WGS 84).
NORTH_M, EAST_M = 110_574.3 * 1e-7, 111_319.5 * 1e-7
# Times of the comparison [s].
TIMES_S = [9.98, 14.98, 20.98]

# Largest difference of the two estimates in standard deviations, of one coordinate and the root mean square of all, and
# limits of the standard deviations' ratio. Found on 2026-11-22: 0.11, 0.04, 0.97 to 1.04. What remains is that the
# filter is linear and goes 4 ms at a time, and that the batch has taken up what arrived up to 5 ms ago.
APART, APART_RMS, RATIO = 0.3, 0.1, (0.9, 1.1)


def cross(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def truth(t):
    """Position, velocity, acceleration and attitude of a flight that leans into its accelerations."""
    t = max(t - REST_S, 0.0)
    p, v, a = np.zeros(3), np.zeros(3), np.zeros(3)
    for axis, size, w in ((0, 4.0, 0.9), (1, -3.0, 0.7), (2, -1.5, 1.1)):
        # No jump in velocity or acceleration.
        p[axis], v[axis] = size * (w * t - np.sin(w * t)) * 0.3, size * w * (1 - np.cos(w * t)) * 0.3
        a[axis] = size * w * w * np.sin(w * t) * 0.3
    yaw = 0.5 * np.sin(0.4 * t) ** 2
    down = GRAVITY - a
    z = down / np.linalg.norm(down)
    x = np.cross(np.array([-np.sin(yaw), np.cos(yaw), 0.0]), z)
    x /= np.linalg.norm(x)
    return p, v, a, np.column_stack([x, np.cross(z, x), z])


def record(rng, declination):
    """Lines of a log, and the same as samples: the estimator's and the batch's."""
    lines, imu, fixes, heights, fields = [], [], [], [], []
    gyro_bias, accel_bias = rng.normal(0, 0.005, 3), rng.normal(0, 0.05, 3)
    field = np.array([0.25 * np.cos(declination), 0.25 * np.sin(declination), 0.15])
    for index in range(1, int(END_S * 1e6) // STEP_US):
        at = index * STEP_US
        t, half = at * 1e-6, 0.5e-6 * STEP_US
        p, v, a, r = truth(t)
        turn = Rotation.from_matrix(truth(t - half)[3].T @ truth(t + half)[3]).as_rotvec() / (2 * half)
        rates = turn + gyro_bias + rng.normal(0, 0.005, 3)
        force = r.T @ (a - GRAVITY) + accel_bias + rng.normal(0, 0.1, 3)
        imu.append((at, rates, force))
        lines.append((at, "imu", *force, *rates))
        if at % 40_000 == 0:
            height, gauss = 488.0 - p[2] + rng.normal(0, BARO_M), r.T @ field + rng.normal(0, 0.01, 3)
            heights.append((at, at, height))
            fields.append((at, at, gauss))
            lines += [(at, "baro", height), (at, "mag", *gauss)]
        if at % 200_000 == 0 and at > DELAY_US:
            p, v, _, _ = truth((at - DELAY_US) * 1e-6)
            place, speed = p + rng.normal(0, FIX_M), v + rng.normal(0, FIX_M_S, 3)
            # As the log's units round them.
            north, east = round(place[0] / NORTH_M), round(place[1] / EAST_M)
            height_mm = round(1e3 * (488.0 - place[2]))
            place = np.array([north * NORTH_M, east * EAST_M, 488.0 - 1e-3 * height_mm])
            fixes.append((at - DELAY_US, at, place, speed))
            lines.append((at, "gps", height_mm, north, east, *speed))
    return lines, imu, fixes, heights, fields


class State:
    """A node of the trajectory."""

    def __init__(self, at, r, v, p, bg, ba, b):
        self.at, self.r, self.v, self.p, self.bg, self.ba, self.b = at, r, v, p, bg, ba, b

    def moved(self, e):
        r = Rotation.from_rotvec(e[:3]).as_matrix() @ self.r
        v, p, bg, ba = self.v + e[3:6], self.p + e[6:9], self.bg + e[9:12], self.ba + e[12:15]
        return State(self.at, r, v, p, bg, ba, self.b + e[15])

    def less(self, other):
        turn = Rotation.from_matrix(self.r @ other.r.T).as_rotvec()
        rest = (self.v - other.v, self.p - other.p, self.bg - other.bg, self.ba - other.ba, [self.b - other.b])
        return np.concatenate([turn, *rest])


def propagate(state, samples, to):
    """The state at `to`, by the samples from the state's time on, with the transition and noise of its error."""
    s, phi, q = state, np.eye(16), np.zeros((16, 16))
    r, v, p = s.r, s.v, s.p
    for (at, w0, f0), (later, w1, f1) in zip(samples, samples[1:]):
        if later <= s.at or at >= to:
            continue
        begin, end = max(at, s.at), min(later, to)
        dt = (end - begin) * 1e-6
        mean = ((begin + end) / 2 - at) / (later - at)
        w, f = w0 + (w1 - w0) * mean - s.bg, f0 + (f1 - f0) * mean - s.ba
        half = r @ Rotation.from_rotvec(0.5 * dt * w).as_matrix()
        a = half @ f + GRAVITY
        # d theta = -R bg; dv = theta x R f - R ba, about the earth's axes.
        step = np.eye(16)
        step[0:3, 9:12] = -half * dt
        step[3:6, 0:3] = -cross(half @ f) * dt
        step[3:6, 12:15] = -half * dt
        step[6:9, 3:6] = np.eye(3) * dt
        step[6:9, 0:3] = -cross(half @ f) * 0.5 * dt * dt
        step[6:9, 12:15] = -half * 0.5 * dt * dt
        q = step @ q @ step.T
        squares = [GYRO**2, ACCEL**2, 0.0, GYRO_WALK**2, ACCEL_WALK**2]
        q += np.diag([*np.repeat(squares, 3), BARO_WALK**2]) * dt
        phi = step @ phi
        r, p, v = r @ Rotation.from_rotvec(dt * w).as_matrix(), p + v * dt + 0.5 * a * dt * dt, v + a * dt
    return State(to, r, v, p, s.bg, s.ba, s.b), phi, q


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def add_field(add, node, state, gauss, count, declination):
    """A field, the mean of so many: it tells the heading and nothing else."""
    north, east, _ = state.r @ gauss
    sigma = np.sqrt((FIELD_GAUSS**2 / (north**2 + east**2) + 1e-6) / count)
    add(np.array([wrapped(np.arctan2(east, north) - declination)]), [(node, np.eye(16)[[2]])], np.eye(1) / sigma)


def batch(until_us, imu, fixes, heights, fields, declination):
    """The state at `until_us` and its covariance, of all that had arrived then."""
    samples = [sample for sample in imu if ALIGNED_US <= sample[0] <= until_us]
    resting = [sample for sample in imu if sample[0] <= ALIGNED_US]
    # A few milliseconds pass before a measurement is taken up.
    arrived = lambda all: [it for it in all if it[1] <= until_us - 5_000]
    later = lambda all: [it for it in all if it[0] > ALIGNED_US]
    heard = [gauss for at, _, gauss in fields if at <= ALIGNED_US]
    fixes, heights, fields = later(arrived(fixes)), later(arrived(heights)), later(arrived(fields))
    times = sorted({ALIGNED_US, until_us, *(at for at, *_ in fixes + heights + fields)})
    number = {at: index for index, at in enumerate(times)}
    # At rest: the means of rates, specific force and field.
    rates, force = (np.mean([sample[part] for sample in resting], axis=0) for part in (1, 2))
    mean = np.mean(heard, axis=0)
    zero = np.zeros(3)
    level = Rotation.align_vectors([[0, 0, -1]], [force])[0].as_matrix()
    north, east, _ = level @ mean
    level = Rotation.from_euler("z", declination - np.arctan2(east, north)).as_matrix() @ level
    states = [State(times[0], level, zero, zero, rates, zero, heights[0][2])]
    for at in times[1:]:
        states.append(propagate(states[-1], samples, at)[0])
    start = states[0]
    for _ in range(12):
        rows, columns, values, right = [], [], [], []

        def add(residual, blocks, root):
            """A residual r(e) = residual + sum of block e of a node, whitened by `root`."""
            at, count = len(right), len(residual)
            right.extend(-(root @ residual))
            for node, block in blocks:
                values.append((root @ block).ravel())
                rows.append(np.repeat(np.arange(at, at + count), 16))
                columns.append(np.tile(np.arange(16 * node, 16 * node + 16), count))

        pick = lambda rows: np.eye(16)[rows]
        # What rest tells, and what is known before: nothing of position and barometer.
        first = states[0]
        add(first.bg - rates, [(0, pick(slice(9, 12)))], np.eye(3) / GYRO)
        add(first.ba, [(0, pick(slice(12, 15)))], np.eye(3) / ACCEL_BIAS)
        add(first.v, [(0, pick(slice(3, 6)))], np.eye(3) / REST_M_S)
        add(first.p, [(0, pick(slice(6, 9)))], np.eye(3) / 1e3)
        add(np.array([first.b - start.b]), [(0, pick([15]))], np.eye(1) / 1e3)
        told = np.zeros((3, 16))
        told[:, 0:3], told[:, 12:15] = -cross(first.r @ (force - first.ba)), -first.r
        add(first.r @ (force - first.ba) + GRAVITY, [(0, told)], np.eye(3) / ACCEL)
        add_field(add, 0, first, mean, len(heard), declination)
        for index, (one, other) in enumerate(zip(states, states[1:])):
            told, phi, q = propagate(one, samples, other.at)
            root = np.linalg.inv(np.linalg.cholesky(q + 1e-16 * np.eye(16)))
            add(other.less(told), [(index, -phi), (index + 1, np.eye(16))], root)
        for at, _, place, speed in fixes:
            index = number[at]
            add(states[index].p - place, [(index, pick(slice(6, 9)))], np.diag(1 / FIX_M))
            add(states[index].v - speed, [(index, pick(slice(3, 6)))], np.eye(3) / FIX_M_S)
        for at, _, height in heights:
            index, state = number[at], states[number[at]]
            add(np.array([state.b - state.p[2] - height]), [(index, pick([15]) - pick([8]))], np.eye(1) / BARO_M)
        for at, _, gauss in fields:
            add_field(add, number[at], states[number[at]], gauss, 1, declination)
        shape = (len(right), 16 * len(states))
        places = np.concatenate(rows), np.concatenate(columns)
        j = coo_matrix((np.concatenate(values), places), shape=shape).tocsc()
        solver = splu((j.T @ j).tocsc())
        e = solver.solve(j.T @ np.array(right)).reshape(-1, 16)
        states = [state.moved(part) for state, part in zip(states, e)]
        if np.abs(e[:, :9]).max() < 1e-5:
            break
    else:
        raise SystemExit("second_opinion: Gauss-Newton has not converged")
    last = np.zeros((16 * len(states), 16))
    last[-16:] = np.eye(16)
    return states[-1], solver.solve(last)[-16:]


def filtered(folder, until_s):
    """The estimator's own state and standard deviations at a time of the log, in north-east-down."""
    with open(folder / "out" / "replay.csv") as file:
        rows = [row for row in csv.DictReader(file) if row["x_m"]]
    row = min(rows, key=lambda row: abs(float(row["time_s"]) - until_s))
    n = lambda *names: np.array([float(row[name]) for name in names])
    flip = np.array([1, -1, -1])
    angles = n("yaw_rad", "pitch_rad", "roll_rad") * np.array([-1, -1, 1])
    r = Rotation.from_euler("ZYX", angles).as_matrix()
    v, p = flip * n("vx_m_s", "vy_m_s", "vz_m_s"), flip * n("x_m", "y_m", "z_m")
    state = State(float(row["time_s"]), r, v, p, 0, 0, 0)
    names = ["rx_sigma_rad", "ry_sigma_rad", "rz_sigma_rad", "vx_sigma_m_s", "vy_sigma_m_s", "vz_sigma_m_s"]
    return state, n(*names, "x_sigma_m", "y_sigma_m", "z_sigma_m")


def differences(ours, batch):
    turn = Rotation.from_matrix(ours.r @ batch.r.T).as_rotvec()
    return np.concatenate([turn, ours.v - batch.v, ours.p - batch.p])


def agree(pairs):
    """True if all estimates and standard deviations agree; pairs of difference, sigma and the batch's sigma."""
    apart = np.array([difference / sigma for difference, sigma, _ in pairs])
    ratio = np.array([sigma / other for _, sigma, other in pairs])
    good = np.abs(apart).max() <= APART and np.sqrt(np.mean(apart**2)) <= APART_RMS
    return good and ratio.min() >= RATIO[0] and ratio.max() <= RATIO[1]


def main():
    sitl = pathlib.Path(sys.argv[1]).resolve()
    pairs = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            # The field is the earth's alone, and both know it.
            command = [sitl, "replay", folder / "log.csv", "--compass-error", "0", "--out", folder / "out", "--force"]
            lines, *samples = record(rng, DECLINATION)
            (folder / "log.csv").write_text("".join(",".join(map(str, line)) + "\n" for line in lines))
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            declination = np.radians(json.loads((folder / "out" / "summary.json").read_text())["declination_deg"])
            first = lines[0][0]
            for until_s in TIMES_S:
                until_us = round(until_s * 1e6 / STEP_US) * STEP_US
                # The origin is the first fix.
                ours, sigma = filtered(folder, (until_us - first) * 1e-6)
                ours.p = ours.p + samples[1][0][2]
                theirs, covariance = batch(until_us, *samples, declination)
                p, v, _, r = truth(until_us * 1e-6)
                other = np.sqrt(np.diag(covariance)[:9])
                off = differences(State(0, r, v, p, 0, 0, 0), theirs) / other
                pairs.append((differences(ours, theirs), sigma, other))
                shown = lambda values: " ".join(f"{value:6.2f}" for value in values)
                print(f"seed {seed}, {until_s} s: estimator less batch, sigmas: {shown(pairs[-1][0] / sigma)}")
                print(f"{'':17}its sigma over the batch's:      {shown(sigma / other)}")
                print(f"{'':17}truth less batch, sigmas:        {shown(off)}")
                if np.abs(off).max() > 4.0:
                    raise SystemExit("second_opinion: the batch is wrong")
    if not agree(pairs):
        raise SystemExit("second_opinion: estimator and batch do not agree")
    # All this can fail: standard deviations that are wrong, and each coordinate off by one of them.
    wrong = [[(apart, share * sigma, other) for apart, sigma, other in pairs] for share in (0.5, 2.0)]
    wrong += [[(apart + sigma * unit, sigma, other) for apart, sigma, other in pairs] for unit in np.eye(9)]
    if any(agree(pairs) for pairs in wrong):
        raise SystemExit("second_opinion: a wrong estimate passes")
    print(f"second_opinion: estimator and batch agree; {len(wrong)} wrong estimates do not")


main()
