#!/usr/bin/env python3
"""What images do to the pose that show something besides the world: text, dirt, mirrors, a poster carried past, ...

    .venv/bin/python bench/deceptions.py RESULTS.jsonl --ygslam build/release/ygslam SEQUENCE [SEQUENCE ...]
    .venv/bin/python bench/deceptions.py RESULTS.jsonl          # the table of what is there

Every kind is painted into a copy of each recording, at each strength and with each seed, and run in each mode;
a run is a line of RESULTS, and one whose line is there is not repeated. Right is an error within 1.5 times that
of the clean recording, or lost and said so. The table has, for each kind and mode, the median ATE and its worst
[mm], the least share of frames with a pose, and the share of the image that the run took for the camera's own.

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

from deception_kinds import KINDS, View
from matrix import measured, parser_of, print_table
from rendered_seeds import micros, read_calibration, read_tum

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
    return {"ate_mm": 1e3 * metrics.get("ate", {}).get("rmse", float("nan")), "coverage": metrics["coverage"],
            "camera_fixed_share": metrics.get("camera_fixed_share"),
            "track_cpu_ms": metrics["cpu_ms"]["track"]["mean"]}


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
        shares = [run["camera_fixed_share"] for run in good if run["camera_fixed_share"] is not None]
        yield [sequence, f"{kind} {strength:g}", mode, settings, f"{statistics.median(errors):.2f}",
               f"{max(errors):.2f}", f"{min(run['coverage'] for run in good):.2f}",
               f"{100 * statistics.median(shares):.1f}" if shares else "", str(len(good))]


def main():
    parser = parser_of(__doc__)
    parser.add_argument("sequences", nargs="*", type=Path)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--strengths", nargs="+", type=float, default=[1.0])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--modes", nargs="+", choices=MODES, default=list(MODES))
    parser.add_argument("--live", action="store_true")
    parser.add_argument("--set", action="append", default=[], help="as of `ygslam run`; may be repeated")
    parser.add_argument("--keep", type=Path)
    options = parser.parse_intermixed_args()
    if options.sequences and not options.ygslam:
        parser.error("--ygslam is missing")
    jobs = {(s.resolve().name, kind, strength, seed, options.live, tuple(options.set)):
            functools.partial(measure, options, s, kind, strength, seed)
            for s in options.sequences for kind in options.kinds for seed in options.seeds
            for strength in (options.strengths if kind != "clean" else [1.0])}
    lines = measured(options.results, key_of, jobs)
    for mode in MODES:
        rows = list(table(lines, mode))
        if rows:
            print_table(["recording", "kind", "mode", "settings", "median [mm]", "worst [mm]", "with a pose",
                         "masked [%]", "runs"], rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
