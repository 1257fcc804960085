#!/usr/bin/env python3
"""What tracking is worth while depth fails.

    bench/depth_outages.py RESULTS.jsonl SEQUENCE [...] --ygslam build/release/ygslam [--frames 90-179] [-- OPTIONS OF run]

Copies each recording with its depth gone wrong between two frames and runs it; a line of RESULTS for
each, which is not measured again, and a table: frames tracked and ATE, as recorded and with each kind.
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

import matrix


def middle(depth):
    kept = np.zeros_like(depth)
    h, w = depth.shape
    rows, columns = (slice(round(0.34 * n), round(0.66 * n)) for n in (h, w))
    kept[rows, columns] = depth[rows, columns]
    return kept


def halves(axis):
    def change(depth):
        kept = depth.copy()
        half = depth.shape[axis] // 2
        kept[(slice(None), slice(half, None)) if axis else (slice(half, None),)] = 0
        return kept
    return change


def sparse(share):
    rng = np.random.default_rng(1)
    return lambda depth: np.where(rng.random(depth.shape) < share, depth, 0).astype(depth.dtype)


KINDS = {"as recorded": None, "nothing": np.zeros_like, "the middle tenth left": middle,
         "one pixel of 30 left": sparse(1 / 30), "right half missing": halves(1), "lower half missing": halves(0)}


def write(sequence, folder, change, first, last):
    """The recording, but for its depth images from first to last."""
    (folder / "depth").mkdir()
    for path in sequence.iterdir():
        if path.name != "depth":
            (folder / path.name).symlink_to(path.resolve())
    for i, path in enumerate(sorted((sequence / "depth").iterdir())):
        if change is None or not first <= i <= last:
            (folder / "depth" / path.name).symlink_to(path.resolve())
        else:
            cv2.imwrite(str(folder / "depth" / path.name), change(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)))


def measure(options, sequence, kind):
    first, last = (int(x) for x in options.frames.split("-"))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / sequence.name
        folder.mkdir()
        write(sequence, folder, KINDS[kind], first, last)
        out = Path(scratch) / "out"
        done = subprocess.run([options.ygslam, "run", folder, "--out", out, "--deterministic", *options.run],
                              capture_output=True, text=True, check=False)
        if not (out / "metrics.json").exists():
            sys.exit(f"{folder}: {done.stderr.strip()}")
        metrics = json.loads((out / "metrics.json").read_text("utf-8"))
    return {"sequence": sequence.name, "kind": kind, "run": options.run, "coverage": metrics["coverage"],
            "ate_m": metrics["ate"]["rmse"]}


def main():
    parser = matrix.parser_of(__doc__)
    parser.add_argument("sequences", type=Path, nargs="+")
    parser.add_argument("--frames", default="90-179", help="first and last with the fault")
    words = sys.argv[1:]
    run = words[words.index("--") + 1:] if "--" in words else []
    options = parser.parse_args(words[:words.index("--")] if "--" in words else words)
    options.run = run
    if not options.ygslam:
        parser.error("--ygslam is missing")
    jobs = {(s.name, kind, *run): (lambda s=s, kind=kind: measure(options, s, kind))
            for s in options.sequences for kind in KINDS}
    lines = matrix.measured(options.results, lambda line: (line["sequence"], line["kind"], *line["run"]), jobs)
    asked = [line for line in lines if line["run"] == run]
    for sequence in options.sequences:
        rows = [[line["kind"], f"{100 * line['coverage']:.1f} %", f"{1e3 * line['ate_m']:.1f}"]
                for line in asked if line["sequence"] == sequence.name]
        matrix.print_table([f"depth of {sequence.name}", "tracked", "ATE [mm]"], rows)


if __name__ == "__main__":
    main()
