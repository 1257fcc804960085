#!/usr/bin/env python3
"""What an IMU is worth while everything is seen: ATE with it and without, worlds x seeds.

    .venv/bin/python bench/turns.py RESULTS.jsonl --ygslam build/release/ygslam --seeds 3 [--worlds fast walking_xyz ...]
    .venv/bin/python bench/turns.py RESULTS.jsonl            # the table of what is there

`fast` turns by 60 degrees a second and is blurred over half of a frame's time. A run is a line of RESULTS, and one
whose line is there is not repeated. Errors of the position are of `trajectory.txt` and of `trajectory_live.txt`, after
both were laid onto the truth; errors of the rotation [mrad] are of `trajectory.txt`.
"""
import functools
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coasting import poses_of
from matrix import measured, parser_of, print_table

KEY = ("world", "seed", "size", "seconds", "sensor")
FAST = """seconds: 25
layout: office_sitters
camera: {path: rpy, at: [0, -1.7, 1.35], look_at: [0, 1.5, 1.0], speed: 0.1, turning: 60}
"""
FAST_OPTIONS = ["--camera", "kinect_v1", "--blur", "0.5"]


def figures(truth, path):
    """ATE RMSE [mm] and the rotation's [mrad], aligned."""
    estimate = poses_of(path)
    nearest = [int(np.argmin(abs(truth[0] - t))) for t in estimate[0]]
    true_m, true_turn = truth[1][nearest], truth[2][nearest]
    turn, _ = Rotation.align_vectors(true_m - true_m.mean(0), estimate[1] - estimate[1].mean(0))
    errors_m = turn.apply(estimate[1] - estimate[1].mean(0)) - (true_m - true_m.mean(0))
    offsets = true_turn * estimate[2].inv()
    errors_rad = (offsets.mean().inv() * offsets).magnitude()
    return {"ate_mm": 1000 * float(np.sqrt((errors_m ** 2).sum(1).mean())),
            "turn_mrad": 1000 * float(np.sqrt((errors_rad ** 2).mean())), "poses": len(nearest)}


def measure(options, key):
    world, seed = key[:2]
    with tempfile.TemporaryDirectory(prefix="ygslam-turns-") as scratch:
        folder, more = Path(scratch) / "sequence", []
        if world == "fast":
            world, more = Path(scratch) / "fast.yaml", FAST_OPTIONS
            world.write_text(FAST, "utf-8")
        subprocess.run([options.ygslam, "--quiet", "simulate", str(world), "--out", str(folder), "--seed", str(seed),
                        "--fps", "30", "--size", options.size, "--seconds", str(options.seconds),
                        "--imu", options.sensor, *more], check=True, stdout=subprocess.DEVNULL)
        truth, line = poses_of(folder / "groundtruth.txt"), dict(zip(KEY, key))
        for name, imu in (("with", []), ("without", ["--imu", "none"])):
            out = Path(scratch) / name
            subprocess.run([options.ygslam, "--quiet", "run", str(folder), "--out", str(out), "--deterministic", *imu],
                           check=True, stdout=subprocess.DEVNULL)
            line[name] = figures(truth, out / "trajectory.txt")
            line[name]["live_mm"] = figures(truth, out / "trajectory_live.txt")["ate_mm"]
        return line


def table(lines):
    groups = {}
    for line in lines:
        groups.setdefault((line["world"], line["size"], line["sensor"]), []).append(line)
    for (world, size, sensor), runs in groups.items():
        ratios = [run["with"]["ate_mm"] / run["without"]["ate_mm"] for run in runs]
        row = [f"{world}, {size}, {sensor}", str(len(runs))]
        for figure in ("ate_mm", "live_mm", "turn_mrad"):
            row += [" / ".join(f"{run[name][figure]:.2f}" for run in runs) for name in ("without", "with")]
        yield [*row, f"{statistics.mean(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"]


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--worlds", nargs="+", default=["fast", "walking_rpy", "walking_xyz", "walking_halfsphere", "crowd",
                                                        "room_walk"])
    parser.add_argument("--seeds", type=int, default=0, help="so many of each; 0: the table alone")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--seconds", type=float, default=25)
    parser.add_argument("--sensor", default="BMI085")
    options = parser.parse_args()
    if options.seeds and not options.ygslam:
        parser.error("--ygslam is missing")
    keys = [(world, seed, options.size, options.seconds, options.sensor) for world in options.worlds
            for seed in range(options.first_seed, options.first_seed + options.seeds)]
    jobs = {key: functools.partial(measure, options, key) for key in keys}
    lines = measured(options.results, lambda line: tuple(line[word] for word in KEY), jobs)
    print_table(["world", "seeds", "ATE without [mm]", "with", "live without", "with", "rotation without [mrad]", "with",
                 "ATE's ratio"], table(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
