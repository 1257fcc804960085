#!/usr/bin/env python3
"""What each part of the handling of moving things is worth: the full system, then each part off.

    bench/ablation.py build/release/ygslam --model FILE SEQUENCE [SEQUENCE ...]

Prints the ATE [mm] of deterministic runs, the median over the seeds, and the ratio to the full
system; the same table as Markdown with --markdown. Sequences without ground truth are refused.
"""
import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

VARIANTS = {
    "full system": [],
    "no masks (mode geometry)": ["--dynamic", "geometry"],
    "masks alone (mode semantic)": ["--dynamic", "semantic"],
    "all points vote for F": ["--set", "motion.prior=false"],
    "epipolar line alone": ["--set", "rigid.enabled=false"],
    "no second look": ["--set", "labels.second_look=false"],
    "no anchors": ["--set", "anchor.enabled=false"],
    "no rim": ["--set", "labels.rim=false"],
    "no neighbours asked": ["--set", "labels.ask_neighbours=false"],
    "missed objects dropped": ["--set", "propagation.missed_object_frames=0"],
    "mask edges not mended": ["--set", "masks.rim_px=0", "--set", "masks.inner_rim_px=0"],
    "yes or no, no weights": ["--set", "labels.unknown_weight=1"],
    "no memory of empty space": ["--set", "tracking.intruders=false"],
    "landmarks weigh alike": ["--set", "tracking.weigh_landmarks=false"],
    "objects not followed": ["--set", "objects.enabled=false"],
}


def ate_mm(ygslam, sequence, arguments, seed):
    """ATE of one run, or None if it failed or the camera was lost for a while."""
    with tempfile.TemporaryDirectory() as out:
        command = [ygslam, "--quiet", "run", str(sequence), "--out", out, "--deterministic",
                   "--seed", str(seed), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(done.stderr.strip(), file=sys.stderr)
            return None
        metrics = json.loads((Path(out) / "metrics.json").read_text(encoding="utf-8"))
    if metrics["coverage"] < 0.99:
        return None
    return 1000 * metrics["ate"]["rmse"]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ygslam")
    parser.add_argument("sequences", nargs="+", type=Path)
    parser.add_argument("--model", required=True)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--markdown", action="store_true")
    options = parser.parse_args()
    for sequence in options.sequences:
        if not (sequence / "groundtruth.txt").is_file():
            parser.error(f"{sequence}: no groundtruth.txt")

    between, ends = (" | ", "|") if options.markdown else ("  ", "")
    names = [sequence.resolve().name for sequence in options.sequences]
    print(ends + between.join(["part".ljust(28)] + [name.rjust(18) for name in names]) + ends)
    if options.markdown:
        print("|" + "|".join(["---"] + ["---:"] * len(names)) + "|")
    full = {}
    for variant, arguments in VARIANTS.items():
        cells = []
        for sequence in options.sequences:
            runs = [ate_mm(options.ygslam, sequence, ["--model", options.model, *arguments], seed)
                    for seed in range(options.seeds)]
            if None in runs:
                cells.append("lost")
                continue
            value = statistics.median(runs)
            if not arguments:
                full[sequence] = value
            ratio = f"{value / full[sequence]:.2f}" if sequence in full else "-"
            cells.append(f"{value:.2f} ({ratio})")
        print(ends + between.join([variant.ljust(28)] + [cell.rjust(18) for cell in cells]) + ends,
              flush=True)


if __name__ == "__main__":
    main()
