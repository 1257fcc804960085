#!/usr/bin/env python3
"""What an IMU or wheels are worth where nothing can be seen: worlds x faults x sensors x seeds, and how the pose comes through.

    .venv/bin/python bench/coasting.py RESULTS.jsonl --ygslam build/release/ygslam [--worlds walking_xyz ...]
    .venv/bin/python bench/coasting.py RESULTS.jsonl --ygslam ... --worlds robot_rounds --sensors wheels BMI085+wheels
    .venv/bin/python bench/coasting.py RESULTS.jsonl --ygslam ... --worlds lift_door cover white_wall
    .venv/bin/python bench/coasting.py RESULTS.jsonl            # the table of what is there

Each case is rendered with readings of an inertial sensor (its model), of wheels, or of both; from 10 s on nothing is
seen for --seconds, then the camera sees again. In the worlds of coasting_worlds.py what is seen then tells nothing: no
fault is added, and they have their own times. A run is a line of RESULTS, and one whose line is there is not
repeated. Errors are of the position, counted from the last frame before: live, as a robot was told, after 1 s and at
the end, and the worst of the trajectory that is written at the end. NEES is that of the live pose at the end in that of
the last frame before, as bench/nees.py has it (6 degrees of freedom: 95 % lie below 12.6).
"""
import csv
import functools
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coasting_worlds import NAMES, BlindWorld, blind_world
from matrix import measured, parser_of, print_table
from nees import Poses

FROM_S = 10
MOST_NEES = 12.59
KEY = ("world", "fault", "sensor", "seed", "seconds", "size")
FAULTS = {"black": ["--fault", "both:black@{from_s}s+{seconds}s", "--fault", "depth:empty@{from_s}s+{seconds}s"],
          "white": ["--fault", "both:white@{from_s}s+{seconds}s", "--fault", "depth:empty@{from_s}s+{seconds}s"],
          "off": ["--fault", "both:off@{from_s}s+{seconds}s"]}


def poses_of(path):
    """Stamps, positions [m], rotations of a TUM trajectory."""
    rows = np.loadtxt(path, comments="#", ndmin=2)
    return rows[:, 0], rows[:, 1:4], Rotation.from_quat(rows[:, 4:8])


def way_since(poses, start, stamp):
    """Position at the stamp in the camera as it was at the start [m]; None where there is no pose."""
    at = [int(np.argmin(abs(poses[0] - t))) for t in (start, stamp)]
    if any(abs(poses[0][i] - t) > 0.005 for i, t in zip(at, (start, stamp))):
        return None
    return poses[2][at[0]].inv().apply(poses[1][at[1]] - poses[1][at[0]])


def error_m(truth, estimate, start, stamp):
    ways = way_since(truth, start, stamp), way_since(estimate, start, stamp)
    return float(np.linalg.norm(ways[0] - ways[1])) if ways[0] is not None and ways[1] is not None else None


def nees_of(sequence, out, start, stamp):
    """None where one of both has no pose."""
    poses = Poses(sequence, out, "map")
    at = [int(np.argmin(abs(poses.stamps - t))) for t in (start, stamp)]
    return poses.nees(*at) if all(abs(poses.stamps[i] - t) < 0.005 for i, t in zip(at, (start, stamp))) else None


def figures(sequence, out, from_s, seconds):
    truth, live, final = (poses_of(path) for path in (sequence / "groundtruth.txt", out / "trajectory_live.txt",
                                                      out / "trajectory.txt"))
    rows = list(csv.DictReader((out / "frames.csv").open()))
    began = float(rows[0]["stamp"])
    start = max(float(row["stamp"]) for row in rows if float(row["stamp"]) < began + from_s - 1e-3)
    covered = [row for row in rows if start + 1e-3 < float(row["stamp"]) < began + from_s + seconds - 1e-3]
    found = [row for row in rows if float(row["stamp"]) > began + from_s + seconds + 1]
    line = {"coasted": sum(row["state"] == "coasting" for row in covered), "covered": len(covered),
            "lost": sum(row["state"] == "lost" for row in rows),
            "after_lost": sum(row["state"] in ("lost", "coasting") for row in found), "after": len(found)}
    during = (truth[0] > start - 1e-3) & (truth[0] < began + from_s + seconds)
    line["path_m"] = float(np.linalg.norm(np.diff(truth[1][during], axis=0), axis=1).sum())
    if covered:
        last = covered[-1]
        line["one_s_m"] = error_m(truth, live, start, float(covered[min(29, len(covered) - 1)]["stamp"]))
        line["end_m"] = error_m(truth, live, start, float(last["stamp"]))
        line["nees"] = nees_of(sequence, out, start, float(last["stamp"]))
        errors = [error_m(truth, final, start, float(row["stamp"])) for row in covered]
        line["final_m"] = max((e for e in errors if e is not None), default=None)
    errors = [error_m(truth, live, start, float(row["stamp"])) for row in found]
    line["after_m"] = max((e for e in errors if e is not None), default=None)
    return line


def sensor_options(sensor):
    """Of `simulate`. @param sensor MODEL, wheels, MODEL+wheels."""
    words = sensor.split("+")
    models = [word for word in words if word != "wheels"]
    return [*(["--imu", *models] if models else []), *(["--wheels"] if "wheels" in words else [])]


def case_of(options, world, fault, seed):
    return blind_world(world, seed) if fault == "none" else BlindWorld("", FROM_S, options.seconds)


def fault_options(case, fault):
    """Of `simulate`."""
    if fault == "none":
        return []
    words = (word.format(from_s=case.from_s, seconds=case.seconds) for word in FAULTS[fault])
    return ["--seconds", str(case.from_s + case.seconds + 5), *words]


def measure(options, key):
    world, fault, sensor, seed = key[:4]
    with tempfile.TemporaryDirectory(prefix="ygslam-coasting-") as scratch:
        folder, out = Path(scratch) / "sequence", Path(scratch) / "out"
        case = case_of(options, world, fault, seed)
        if case.text:
            world = Path(scratch) / f"{world}.yaml"
            world.write_text(case.text, "utf-8")
        render = [options.ygslam, "--quiet", "simulate", world, "--out", str(folder), "--seed", str(seed),
                  *sensor_options(sensor), "--fps", "30", "--size", options.size, *fault_options(case, fault)]
        subprocess.run(render, check=True, stdout=subprocess.DEVNULL)
        run = [options.ygslam, "--quiet", "run", str(folder), "--out", str(out), "--deterministic",
               "--covariance"]
        line = dict(zip(KEY, key))
        for name, more in (("with", []), ("vision", ["--imu", "none", "--odometry", "none"])):
            if subprocess.run([*run, *more], check=False).returncode not in (0, 7):
                return line | {"error": name}
            line[name] = figures(folder, out, case.from_s, case.seconds)
        return line


def key_of(line):
    return tuple(line[word] for word in KEY)


def keys_of(options):
    for seed in range(1, options.seeds + 1):
        for world in options.worlds:
            for fault in ["none"] if world in NAMES else options.faults:
                seconds = case_of(options, world, fault, seed).seconds
                for sensor in options.sensors:
                    yield (world, fault, sensor, seed, seconds, options.size)


def spread(values, scale=1, digits=1):
    """Median and worst."""
    known = [scale * v for v in values if v is not None]
    return f"{statistics.median(known):.{digits}f} ({max(known):.{digits}f})" if known else ""


def table(lines):
    groups = {}
    for line in lines:
        if "error" not in line:
            groups.setdefault((line["world"], line["fault"], line["sensor"], line["seconds"]), []).append(line)
    for (world, fault, sensor, seconds), runs in groups.items():
        carried, vision = [run["with"] for run in runs], [run["vision"] for run in runs]
        nees = [run["nees"] for run in carried if run.get("nees") is not None]
        yield [world, f"{fault} {seconds:g} s", sensor, str(len(runs)), str(max(run["lost"] for run in vision)),
               str(max(run["lost"] for run in carried)), f"{statistics.median(run['path_m'] for run in carried):.1f}",
               spread([run.get("one_s_m") for run in carried], 1000),
               spread([run.get("end_m") for run in carried], 1000),
               spread([100 * run["end_m"] / run["path_m"] for run in carried if run.get("end_m") is not None]),
               f"{sum(v < MOST_NEES for v in nees)} of {len(nees)}", spread([run.get("final_m") for run in carried], 1000),
               spread([run["after_m"] for run in carried], 1000)]


def options_of(parser):
    """What is rendered, by the command line."""
    parser.add_argument("--worlds", nargs="+", default=["walking_xyz", "walking_halfsphere", "room_walk"])
    parser.add_argument("--sensors", nargs="+", default=["BMI085"])
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--seeds", type=int, default=0, help="so many of each; 0: the table alone")
    parser.add_argument("--size", default="320x240")
    options = parser.parse_args()
    if options.seeds and not options.ygslam:
        parser.error("--ygslam is missing")
    return options


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--faults", nargs="+", default=["black"], choices=FAULTS)
    options = options_of(parser)
    jobs = {key: functools.partial(measure, options, key) for key in keys_of(options)}
    lines = measured(options.results, key_of, jobs)
    print_table(["world", "fault", "sensor", "seeds", "lost without", "lost", "path [m]", "after 1 s [mm]",
                 "at the end [mm]", "[% of path]", "NEES below 12.6", "written [mm]", "afterwards [mm]"], table(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
