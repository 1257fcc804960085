#!/usr/bin/env python3
"""Ours beside what users do today: an extended Kalman filter over our visual odometry and the same IMU.

    .venv/bin/python bench/textbook_ekf.py RESULTS.jsonl --ygslam build/release/ygslam --seeds 3 [--worlds ...]
    .venv/bin/python bench/textbook_ekf.py RESULTS.jsonl            # the table of what is there

The filter's model is robot_localization's as its paper tells it (Moore and Stouch 2014): 15 states (position, roll,
pitch, yaw; velocity, angular velocity and acceleration of the body), constant acceleration and rates between
measurements, additive noise. It gets the motion between tracked frames as velocities (its differential mode) with our
covariances, and from the IMU rates and acceleration less gravity by its own attitude, which is levelled while the
first second lasts. It is told the truth about the IMU's noise and place; biases it has no states for. The recordings
are those of bench/coasting.py: from 10 s on nothing is seen for --seconds. Errors are of the position, counted from
the last frame before.
"""
import csv
import functools
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coasting import FAULTS, FROM_S, error_m, options_of, poses_of, spread
from matrix import measured, parser_of, print_table
from nees import covariances, matrices

GRAVITY = np.array([0, 0, -9.80665])
P, A, V, W, F = (slice(3 * i, 3 * i + 3) for i in range(5))  # position, angles, velocity, rates, acceleration
# Diagonal of the process noise a second, robot_localization's defaults.
PROCESS = np.diag([.05, .05, .06, .03, .03, .06, .025, .025, .04, .01, .01, .02, .01, .01, .015])
STEP = 1e-6


def turn_of(angles):
    return Rotation.from_euler("xyz", angles).as_matrix()


def moved(x, dt):
    """Constant acceleration and rates in the body's axes."""
    roll, pitch, _ = x[A]
    R = turn_of(x[A])
    rates = np.array([[1, np.sin(roll) * np.tan(pitch), np.cos(roll) * np.tan(pitch)], [0, np.cos(roll), -np.sin(roll)],
                      [0, np.sin(roll) / np.cos(pitch), np.cos(roll) / np.cos(pitch)]])
    out = x.copy()
    out[P] += R @ (x[V] * dt + x[F] * dt * dt / 2)
    out[A] += rates @ x[W] * dt
    out[V] += x[F] * dt
    return out


class Filter:
    def __init__(self, angles):
        self.x, self.C = np.zeros(15), np.diag([1e-9] * 6 + [0.1] * 9)
        self.x[A] = angles

    def predict(self, dt):
        at = moved(self.x, dt)
        J = np.column_stack([(moved(self.x + STEP * unit, dt) - at) / STEP for unit in np.eye(15)])
        self.x, self.C = at, J @ self.C @ J.T + PROCESS * dt

    def correct(self, residual, J, noise):
        K = self.C @ J.T @ np.linalg.inv(J @ self.C @ J.T + noise)
        self.x = self.x + K @ residual
        self.C = (np.eye(15) - K @ J) @ self.C

    def see_velocity(self, velocity, noise):
        J = np.zeros((6, 15))
        J[:3, V] = J[3:, W] = np.eye(3)
        self.correct(velocity - J @ self.x, J, noise)

    def feel(self, rates, force, noise):
        """Gravity is taken out by the attitude as it is held to be: no derivative, as there."""
        J = np.zeros((6, 15))
        J[:3, W] = J[3:, F] = np.eye(3)
        acceleration = force + turn_of(self.x[A]).T @ GRAVITY
        self.correct(np.r_[rates, acceleration] - J @ self.x, J, noise)

    def pose(self):
        out = np.eye(4)
        out[:3, :3], out[:3, 3] = turn_of(self.x[A]), self.x[P]
        return out


def calibration(path):
    values = {}
    for line in path.read_text("utf-8").splitlines():
        key, _, value = line.split("#")[0].partition(":")
        if value.strip():
            values[key.strip()] = [float(word) for word in value.strip(" []").replace("]", "").split(",")]
    return values


def velocities(out):
    """(stamp, twist of the camera per second, covariance) of each frame that was seen after one that was."""
    rows = np.loadtxt(out / "odometry.txt", ndmin=2)
    states = {round(1e6 * float(row["stamp"])): row["state"] for row in csv.DictReader((out / "frames.csv").open())}
    drifts = {round(1e6 * float(row["stamp"])): (float(row["odom_drift_mm"] or 0) / 1e3, float(row["odom_drift_deg"] or 0))
              for row in csv.DictReader((out / "frames.csv").open())}
    poses, told = matrices(rows[:, 1:8]), covariances(rows[:, 8:29])
    for i in range(1, len(rows)):
        dt = rows[i, 0] - rows[i - 1, 0]
        if dt > 0.1 or states[round(1e6 * rows[i, 0])] not in ("tracking", "weak"):
            continue
        metres, degrees = drifts[round(1e6 * rows[i, 0])]
        seen = told[i] - np.diag([metres**2 / 3] * 3 + [np.radians(degrees)**2 / 3] * 3)
        turn = np.kron(np.eye(2), poses[i, :3, :3].T)
        step = np.linalg.inv(poses[i - 1]) @ poses[i]
        twist = np.r_[step[:3, 3], Rotation.from_matrix(step[:3, :3]).as_rotvec()] / dt
        yield rows[i, 0], twist, 2 / dt**2 * turn @ seen @ turn.T + 1e-6 * np.eye(6)


def filtered(sequence, out):
    """Stamps, positions, rotations of the camera at each frame, in a level frame."""
    imu = calibration(sequence / "imu.yaml")
    T_camera_imu = matrices(np.array([imu["T_camera_imu"]]))[0]
    rate_hz = imu["rate_hz"][0]
    noise = np.diag([imu["gyroscope_noise_density"][0]**2 * rate_hz] * 3
                    + [imu["accelerometer_noise_density"][0]**2 * rate_hz] * 3)
    readings = np.loadtxt(sequence / "imu.csv", delimiter=",", skiprows=1)
    stamps = np.loadtxt(sequence / "groundtruth.txt", usecols=0)
    up = readings[(readings[:, 0] * 1e-9 > stamps[0]) & (readings[:, 0] * 1e-9 < stamps[0] + 1), 4:7].mean(axis=0)
    own = Filter([np.arctan2(up[1], up[2]), np.arctan2(-up[0], np.hypot(up[1], up[2])), 0])
    turn, lever = T_camera_imu[:3, :3].T, -T_camera_imu[:3, :3].T @ T_camera_imu[:3, 3]
    to_imu = np.kron(np.eye(2), turn)
    to_imu[:3, 3:] = np.array([[0, -lever[2], lever[1]], [lever[2], 0, -lever[0]], [-lever[1], lever[0], 0]]) @ turn
    events = [(row[0] * 1e-9, 0, row) for row in readings]
    events += [(t, 1, (to_imu @ twist, to_imu @ C @ to_imu.T)) for t, twist, C in velocities(out)]
    events += [(t, 2, None) for t in stamps]
    now, poses = stamps[0], []
    for t, kind, what in sorted(events, key=lambda event: event[:2]):
        if t < stamps[0]:
            continue
        if t > now:
            own.predict(t - now)
            now = t
        if kind == 0:
            own.feel(what[1:4], what[4:7], noise)
        elif kind == 1:
            own.see_velocity(*what)
        else:
            poses.append(own.pose() @ np.linalg.inv(T_camera_imu))
    poses = np.array(poses)
    return stamps, poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3])


def measure(options, world, sensor, seed):
    with tempfile.TemporaryDirectory(prefix="ygslam-ekf-") as scratch:
        folder = Path(scratch) / "sequence"
        times = {"from_s": FROM_S, "seconds": options.seconds}
        subprocess.run([options.ygslam, "--quiet", "simulate", world, "--out", str(folder), "--seed", str(seed), "--imu",
                        sensor, "--seconds", str(FROM_S + options.seconds + 5), "--fps", "30", "--size", options.size,
                        *(word.format(**times) for word in FAULTS["black"])], check=True, stdout=subprocess.DEVNULL)
        line = {"world": world, "sensor": sensor, "seed": seed, "seconds": options.seconds, "size": options.size}
        for name, more in (("ours", []), ("vision", ["--imu", "none"])):
            done = subprocess.run([options.ygslam, "--quiet", "run", str(folder), "--out", str(Path(scratch) / name),
                                   "--deterministic", "--covariance", *more], check=False)
            if done.returncode not in (0, 7):
                return line | {"error": name}
        truth = poses_of(folder / "groundtruth.txt")
        start = truth[0][truth[0] < truth[0][0] + FROM_S - 1e-3][-1]
        for name, estimate in (("ours", poses_of(Path(scratch) / "ours" / "odometry.txt")),
                               ("ekf", filtered(folder, Path(scratch) / "vision"))):
            for what, since, until in (("seen", start - 5, start), ("one_s", start, start + 1),
                                       ("end", start, start + options.seconds)):
                line[f"{name}_{what}_m"] = error_m(truth, estimate, *(
                    float(truth[0][np.argmin(abs(truth[0] - t))]) for t in (since, until)))
        return line


def key_of(line):
    return (line["world"], line["sensor"], line["seed"], line["seconds"], line["size"])


def table(lines):
    groups = {}
    for line in lines:
        if "error" not in line:
            groups.setdefault((line["world"], line["sensor"], line["seconds"]), []).append(line)
    for (world, sensor, seconds), runs in groups.items():
        yield [world, sensor, f"{seconds:g} s", str(len(runs)), *(
            spread([run[f"{name}_{what}_m"] for run in runs], 1000)
            for what in ("seen", "one_s", "end") for name in ("ours", "ekf"))]


def main():
    options = options_of(parser_of(__doc__))
    jobs = {(world, sensor, seed, options.seconds, options.size): functools.partial(measure, options, world, sensor, seed)
            for seed in range(1, options.seeds + 1) for world in options.worlds for sensor in options.sensors}
    lines = measured(options.results, key_of, jobs)
    print_table(["world", "IMU", "black", "seeds", "5 s seen, ours [mm]", "filter", "1 s unseen, ours", "filter",
                 "all unseen, ours", "filter"], table(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
