#!/usr/bin/env python3
"""Whether covariances say the truth: relative poses over 1, 10 and 60 s, worlds x sensors x seeds.

    .venv/bin/python bench/nees.py RESULTS.jsonl --ygslam build/release/ygslam --seeds 1-3 [--worlds walking_xyz ...]
    .venv/bin/python bench/nees.py RESULTS.jsonl            # the table of what is there

A run is a line of RESULTS, and one whose line is there is not repeated. Of the pose of a frame in that of an earlier
one, as `run --covariance` tells both in odom and in the map: the squared error over its covariance (6 degrees of
freedom: 95 % lie between 1.24 and 14.45), and how many windows do. The covariance is the sum of both poses' against the
ground they see and of what was drifted in between (docs/inertial.md).
"""
import csv
import functools
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from matrix import measured, parser_of, print_table

WINDOWS_S = (1, 10, 60)
EVERY_S = 0.5
LEAST, MOST = 1.237, 14.449  # 95 % of chi-square with 6 degrees of freedom
# What lies between two frames beside drift: the ground itself is bent. In variances of their poses against the ground
# in view (mean of the axes), for each metre and each radian between the two, position and rotation (docs/inertial.md).
BENT = np.array([[0.7, 0.5], [0.5, 0.5]])
FRAMES = {"odom": "odometry.txt", "map": "trajectory_live.txt"}


def matrices(rows):
    """4x4 of lines x y z qx qy qz qw."""
    out = np.tile(np.eye(4), (len(rows), 1, 1))
    out[:, :3, :3] = Rotation.from_quat(rows[:, 3:7]).as_matrix()
    out[:, :3, 3] = rows[:, :3]
    return out


def covariances(rows):
    out = np.zeros((len(rows), 6, 6))
    at = np.triu_indices(6)
    out[:, at[0], at[1]] = rows
    return out + np.transpose(np.triu(out, 1), (0, 2, 1))


def adjoint(T):
    x, y, z = T[:3, 3]
    out = np.kron(np.eye(2), T[:3, :3])
    out[:3, 3:] = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ T[:3, :3]
    return out


class Poses:
    """Estimated and true poses, each with its covariance against the ground in view in the camera's axes."""

    def __init__(self, sequence, out, frame):
        rows = np.loadtxt(out / FRAMES[frame], ndmin=2)
        truth = np.loadtxt(sequence / "groundtruth.txt", ndmin=2)
        drifts = {round(1e6 * float(row["stamp"])): (row[f"{frame}_drift_mm"], row[f"{frame}_drift_deg"])
                  for row in csv.DictReader((out / "frames.csv").open())}
        nearest = np.minimum(np.searchsorted(truth[:, 0], rows[:, 0] - 1e-4), len(truth) - 1)
        known = [abs(truth[i, 0] - row[0]) < 2e-3 and drifts[round(1e6 * row[0])][0] != "" and row[8] < 1e3
                 for i, row in zip(nearest, rows)]
        rows, nearest = rows[known], nearest[known]
        self.stamps, self.estimated, self.true = rows[:, 0], matrices(rows[:, 1:8]), matrices(truth[nearest, 1:8])
        told = np.array([drifts[round(1e6 * t)] for t in self.stamps], float).reshape(-1, 2)
        self.drift = np.repeat((told * (1e-3, np.pi / 180)) ** 2 / 3, 3, axis=1)  # variance of each axis
        seen = covariances(rows[:, 8:29]) - self.drift[:, :, None] * np.eye(6)
        turn = np.kron(np.eye(2)[None], np.transpose(self.estimated[:, :3, :3], (0, 2, 1)))
        self.seen = turn @ seen @ np.transpose(turn, (0, 2, 1))
        self.ground = np.diagonal(self.seen, axis1=1, axis2=2).reshape(-1, 2, 3).mean(2)

    def nees(self, i, j):
        true, told = (np.linalg.inv(T[i]) @ T[j] for T in (self.true, self.estimated))
        between = np.linalg.inv(true) @ told
        error = np.r_[between[:3, 3], Rotation.from_matrix(between[:3, :3]).as_rotvec()]
        back = adjoint(np.linalg.inv(told))
        apart = np.linalg.norm(told[:3, 3]), np.linalg.norm(Rotation.from_matrix(told[:3, :3]).as_rotvec())
        more = abs(self.drift[j] - self.drift[i]) + np.repeat(BENT @ apart * self.ground[[i, j]].mean(0), 3)
        covariance = back @ self.seen[i] @ back.T + self.seen[j] + np.diag(more)
        return float(error @ np.linalg.solve(covariance, error))

    def windows(self, seconds):
        stamps = np.arange(self.stamps[0] + EVERY_S, self.stamps[-1] - seconds, EVERY_S)
        for t in stamps:
            i, j = (int(np.argmin(abs(self.stamps - at))) for at in (t, t + seconds))
            if abs(self.stamps[j] - self.stamps[i] - seconds) < 0.1:
                yield self.nees(i, j)


def figures(sequence, out):
    found = {}
    for frame in FRAMES:
        poses = Poses(sequence, out, frame)
        for seconds in WINDOWS_S:
            nees = list(poses.windows(seconds))
            if nees:
                found[f"{frame} {seconds} s"] = {
                    "windows": len(nees), "within": sum(LEAST <= v <= MOST for v in nees),
                    "above": sum(v > MOST for v in nees), "median": statistics.median(nees)}
    return found


def measure(options, world, sensor, seed):
    with tempfile.TemporaryDirectory(prefix="ygslam-nees-") as scratch:
        folder, out = Path(scratch) / "sequence", Path(scratch) / "out"
        imu = ["--imu", sensor] if sensor != "none" else []
        subprocess.run([options.ygslam, "--quiet", "simulate", world, "--out", str(folder), "--seed", str(seed), *imu,
                        "--seconds", str(options.seconds), "--fps", "30", "--size", options.size], check=True,
                       stdout=subprocess.DEVNULL)
        line = {"world": world, "sensor": sensor, "seed": seed, "seconds": options.seconds, "size": options.size}
        done = subprocess.run([options.ygslam, "--quiet", "run", str(folder), "--out", str(out), "--deterministic",
                               "--covariance"], check=False)
        return line | ({"error": done.returncode} if done.returncode not in (0, 7) else figures(folder, out))


def key_of(line):
    return (line["world"], line["sensor"], line["seed"], line["seconds"], line["size"])


def table(lines):
    groups = {}
    for line in lines:
        for window in [word for word in line if isinstance(line[word], dict)]:
            for world in (line["world"], "all"):
                groups.setdefault((world, line["sensor"], window), []).append(line[window])
    for (world, sensor, window), runs in sorted(groups.items(), key=lambda group: group[0][0] == "all"):
        windows = sum(run["windows"] for run in runs)
        yield [world, sensor, window, str(len(runs)), str(windows),
               f"{100 * sum(run['within'] for run in runs) / windows:.0f} %",
               f"{100 * sum(run['above'] for run in runs) / windows:.0f} %",
               f"{statistics.median(run['median'] for run in runs):.1f}"]


def seeds_of(text):
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--worlds", nargs="+", default=["walking_xyz", "walking_halfsphere", "crowd", "room_walk"])
    parser.add_argument("--sensors", nargs="+", default=["none", "BMI085"])
    parser.add_argument("--seconds", type=float, default=70)
    parser.add_argument("--seeds", type=seeds_of, default=(), help="e.g. 1-3; none: the table alone")
    parser.add_argument("--size", default="320x240")
    options = parser.parse_args()
    if options.seeds and not options.ygslam:
        parser.error("--ygslam is missing")
    jobs = {(world, sensor, seed, options.seconds, options.size): functools.partial(measure, options, world, sensor, seed)
            for seed in options.seeds for world in options.worlds for sensor in options.sensors}
    lines = measured(options.results, key_of, jobs)
    print_table(["world", "IMU", "window", "seeds", "windows", "within 95 % bounds", "above", "median NEES"], table(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
