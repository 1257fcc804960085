#!/usr/bin/env python3
"""What images do to the pose that show something besides the world: text, dirt, screens, mirrors, a moving floor, ...

    .venv/bin/python bench/deceptions.py RESULTS.jsonl --ygslam build/release/ygslam SEQUENCE [SEQUENCE ...]
    .venv/bin/python bench/deceptions.py RESULTS.jsonl          # the table of what is there

Every kind is painted into a copy of each recording, at each strength and with each seed, and run in each mode;
a run is a line of RESULTS, and one whose line is there is not repeated. A SEQUENCE is a folder, or a world (.yaml),
of which 10 s are rendered (320x240). Right is an error within 1.5 times that of the clean recording, or weak or lost.

The table has, for each kind and mode: the median ATE and its worst [mm]; of the frames as they were delivered, the
shares called tracking, weak and lost, all seeds together; the share that was called tracking and was wrong by more
than 3 cm, and that of the worst seed; the share of the image that the run took for the camera's own.

A kind is a function of deception_kinds.py. --keep writes the painted recordings to a folder and leaves them there.
"""
import functools
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from deception_kinds import KINDS, STRENGTHS, View
from matrix import measured, parser_of, print_table
from rendered_seeds import errors_m, micros, read_calibration, read_table, read_tum

WRONG_M = 0.03
STATES = ("tracking", "weak", "lost")

MODES = {"off": ["--dynamic", "off"], "geometry": ["--dynamic", "geometry"],
         "full": ["--dynamic", "full", "--segmenter", "builtin"]}


def rows_of(path):
    return [line.split() for line in path.read_text().splitlines() if line and line[0] != "#"]


def camera_of(sequence):
    """fx, fy, cx, cy [px] and units of depth a metre; those of ROS' default camera where the folder's name tells it."""
    known = {"fx": 525.0, "fy": 525.0, "cx": 319.5, "cy": 239.5, "depth_scale": 5000.0}
    if (sequence / "calibration.txt").is_file():
        known |= read_calibration(sequence)
    return tuple(known[key] for key in ("fx", "fy", "cx", "cy")), known["depth_scale"]


def pose_of(row):
    """4x4 from x y z qx qy qz qw."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(row[3:]).as_matrix()
    pose[:3, 3] = row[:3]
    return pose


def views(sequence):
    """Its frames in order, as (stamp, depth stamp, View); the pose is that of the nearest stamp of the truth."""
    camera, scale = camera_of(sequence)
    truth = read_tum(sequence / "groundtruth.txt")
    stamps = np.array(sorted(truth))
    first = None
    for number, (stamp, colour, depth_stamp, depth_file) in enumerate(rows_of(sequence / "associations.txt")):
        nearest = stamps[np.argmin(abs(stamps - micros(stamp)))]
        T_truth_camera = pose_of(truth[nearest])
        first = first or (np.linalg.inv(T_truth_camera), float(stamp))
        yield stamp, depth_stamp, View(np.array(Image.open(sequence / colour).convert("RGB")),
                                       np.asarray(Image.open(sequence / depth_file)) / scale, number,
                                       float(stamp) - first[1], camera, first[0] @ T_truth_camera)


def paint(sequence, kind, strength, seed, folder):
    """A copy of the recording with the deception in it, without loss."""
    scale = camera_of(sequence)[1]
    for part in ("rgb", "depth"):
        (folder / part).mkdir(parents=True)
    lines = []
    for stamp, depth_stamp, view in views(sequence):
        KINDS[kind](view, strength, np.random.default_rng(seed))
        names = (f"rgb/{view.number:06d}.png", f"depth/{view.number:06d}.png")
        Image.fromarray(view.image).save(folder / names[0], compress_level=1)
        Image.fromarray(np.rint(view.depth * scale).astype(np.uint16)).save(folder / names[1], compress_level=1)
        lines.append(f"{stamp} {names[0]} {depth_stamp} {names[1]}\n")
    (folder / "associations.txt").write_text("".join(lines))
    for name in ("groundtruth.txt", "calibration.txt", "imu.csv", "imu.yaml"):
        if (sequence / name).is_file():
            shutil.copy(sequence / name, folder)


def most_right(estimates, truth):
    """Rotation and shift of the estimates' frame to the truth's in which most of them are right."""
    stamps = [stamp for stamp in estimates if stamp in truth]
    estimated = np.array([estimates[stamp][:3] for stamp in stamps])
    true = np.array([truth[stamp][:3] for stamp in stamps])
    weights = np.ones(len(stamps))
    for _ in range(20):
        centres = [np.average(places, axis=0, weights=weights) for places in (estimated, true)]
        turn = Rotation.align_vectors(true - centres[1], estimated - centres[0], weights)[0]
        shift = centres[1] - turn.apply(centres[0])
        weights = 1 / (1 + np.sum((turn.apply(estimated) + shift - true) ** 2, axis=1) / WRONG_M ** 2)
    return turn, shift


def shares_of(out, sequence):
    """Of the frames as they were delivered, by state, and those that are wrong while `tracking`."""
    states = {micros(row["stamp"]): row["state"] for row in read_table(out / "frames.csv")}
    poses, truth = read_tum(out / "trajectory_live.txt"), read_tum(sequence / "groundtruth.txt")
    wrong = 0
    if len(poses) > 2:
        off_m = errors_m(poses, truth, most_right(poses, truth))
        wrong = sum(states.get(stamp) == "tracking" and e > WRONG_M for stamp, e in off_m.items())
    shares = {state: sum(s == state for s in states.values()) / len(states) for state in STATES[:2]}
    return shares | {"lost": 1 - sum(shares.values()), "wrong": wrong / len(states)}


def run_once(options, folder, mode, seed):
    """Its figures; only "error" if it failed otherwise than by being lost."""
    with tempfile.TemporaryDirectory(prefix="ygslam-deceptions-") as out:
        live = [] if options.live else ["--deterministic"]
        done = subprocess.run([options.ygslam, "--quiet", "run", str(folder), "--out", out, *live, *MODES[mode],
                               "--seed", str(seed), *(a for s in options.set for a in ("--set", s))],
                              capture_output=True, text=True, check=False)
        if done.returncode not in (0, 7):
            return {"error": done.stderr.strip()}
        metrics = json.loads((Path(out) / "metrics.json").read_text())
        shares = shares_of(Path(out), folder)
    return {"ate_mm": 1e3 * metrics.get("ate", {}).get("rmse", float("nan")), "coverage": metrics["coverage"],
            "camera_fixed_share": metrics.get("camera_fixed_share"),
            "track_cpu_ms": metrics["cpu_ms"]["track"]["mean"], "shares": shares}


def measure(options, sequence, kind, strength, seed):
    """Lines of all modes, since to paint takes as long as to run."""
    with tempfile.TemporaryDirectory(prefix="ygslam-painted-") as scratch:
        folder = Path(scratch) / sequence.resolve().name
        if options.keep:
            folder = options.keep / f"{sequence.resolve().name}_{kind}_{strength:g}_{seed}"
        if not folder.exists():
            paint(sequence, kind, strength, seed, folder)
        return {"sequence": sequence.resolve().name, "kind": kind, "strength": strength, "seed": seed,
                "live": options.live, "set": options.set,
                "modes": {mode: run_once(options, folder, mode, seed) for mode in options.modes}}


def key_of(line):
    return (line["sequence"], line["kind"], line["strength"], line["seed"], line["live"], tuple(line["set"]))


def table(lines, mode):
    """A row for each recording, kind and strength."""
    groups = {}
    for line in lines:
        settings = " ".join(line["set"]) + (" live" if line["live"] else "")
        group = (line["sequence"], line["kind"], line["strength"], settings)
        groups.setdefault(group, []).append(line["modes"].get(mode, {}))
    for (sequence, kind, strength, settings), runs in groups.items():
        good = [run for run in runs if "ate_mm" in run]
        if not good:
            continue
        errors = [run["ate_mm"] for run in good]
        masked = [run["camera_fixed_share"] for run in good if run["camera_fixed_share"] is not None]
        wrong = [100 * run["shares"]["wrong"] for run in good]
        states = ", ".join(f"{100 * statistics.mean(run['shares'][state] for run in good):.0f}" for state in STATES)
        yield [sequence, f"{kind} {strength:g}", mode, settings, f"{statistics.median(errors):.1f}",
               f"{max(errors):.1f}", states, f"{statistics.mean(wrong):.0f}", f"{max(wrong):.0f}",
               f"{100 * statistics.median(masked):.1f}" if masked else "", str(len(good))]


def rendered(ygslam, world, folder):
    subprocess.run([ygslam, "--quiet", "simulate", world, "--out", folder / world.stem, "--size", "320x240",
                    "--seconds", "10"], check=True)
    return folder / world.stem


def strengths_of(options, kind):
    if kind == "clean" or not options.strengths:
        return STRENGTHS.get(kind, (1,))
    return options.strengths


def main():
    parser = parser_of(__doc__)
    parser.add_argument("sequences", nargs="*", type=Path)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--strengths", nargs="+", type=float, help="default: as deception_kinds.STRENGTHS has them")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--modes", nargs="+", choices=MODES, default=list(MODES))
    parser.add_argument("--live", action="store_true")
    parser.add_argument("--set", action="append", default=[], help="as of `ygslam run`; may be repeated")
    parser.add_argument("--keep", type=Path)
    options = parser.parse_intermixed_args()
    if options.sequences and not options.ygslam:
        parser.error("--ygslam is missing")
    with tempfile.TemporaryDirectory(prefix="ygslam-worlds-") as scratch:
        sequences = [rendered(options.ygslam, s, Path(scratch)) if s.suffix == ".yaml" else s.resolve()
                     for s in options.sequences]
        jobs = {(s.name, kind, strength, seed, options.live, tuple(options.set)):
                functools.partial(measure, options, s, kind, strength, seed)
                for s in sequences for kind in options.kinds for seed in options.seeds
                for strength in strengths_of(options, kind)}
        lines = measured(options.results, key_of, jobs)
    for mode in MODES:
        rows = list(table(lines, mode))
        if rows:
            print_table(["recording", "kind", "mode", "settings", "median [mm]", "worst [mm]",
                         "tracking, weak, lost [%]", "wrong while tracking [%]", "worst seed", "masked [%]", "runs"],
                        rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
