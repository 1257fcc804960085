#!/usr/bin/env python3
"""Tables of trajectory errors over several runs.

  ate_table.py recorded [--runs 5] [--model FILE]     the recorded sequences, live runs
  ate_table.py ablation --sequence DIR [--runs 3]     what local map and bundle adjustment are worth
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("YGSLAM_SHARED", ROOT.parent / "shared"))

RECORDED = [  # sequence, mode, ATE RMSE to reach [m]
    ("redkitchen_static", "full", 0.048),
    ("redkitchen_static", "off", 0.048),
    ("redkitchen_walk", "full", 0.050),
    ("redkitchen_walk", "off", None),
    ("tum_fr1_rpy_part", "full", 0.0125),
    ("tum_fr1_rpy_part", "off", 0.0125),
    ("kitchen_person_static_camera", "full", 0.005),
]
ABLATION = [
    ("everything", []),
    ("no bundle adjustment", ["run.without=[local_bundle]"]),
    ("no local map", ["run.without=[local_map]"]),
    ("neither", ["run.without=[local_bundle, local_map]"]),
]


def run_once(arguments, sequence, mode, settings=(), extra=()):
    """One run. Returns metrics.json, with "exit" added."""
    with tempfile.TemporaryDirectory(prefix="ygslam-table-") as out:
        command = [arguments.ygslam, "run", sequence, "--out", out, "--dynamic", mode, "--quiet"]
        command += ["--model", arguments.model] if arguments.model else ["--segmenter", "none"]
        for setting in settings:
            command += ["--set", setting]
        done = subprocess.run([*command, *extra], check=False, stdout=subprocess.DEVNULL)
        file = Path(out) / "metrics.json"
        metrics = json.loads(file.read_text()) if file.exists() else {}
        return {**metrics, "exit": done.returncode}


def row(name, runs, target=None):
    """A line of the table: median, spread, coverage, times."""
    failed = [r["exit"] for r in runs if r["exit"] != 0 or "ate" not in r]
    good = [r for r in runs if "ate" in r]
    if not good:
        return f"{name:44} every run failed (exit {failed})"
    ate = [r["ate"]["rmse"] for r in good]
    wall = statistics.median(r["timing_ms"]["track"]["median"] for r in good)
    cpu = statistics.median(r["cpu_ms"]["track"]["median"] for r in good)
    verdict = ""
    if target is not None:
        verdict = f"  <= {target:.4f} {'reached' if statistics.median(ate) <= target else 'MISSED'}"
    return (
        f"{name:44} ATE {statistics.median(ate):.4f} m ({min(ate):.4f} to {max(ate):.4f}, "
        f"{len(good)} runs{f', {len(failed)} failed' if failed else ''})  "
        f"coverage {100 * min(r['coverage'] for r in good):.1f} %  "
        f"track {wall:.1f} ms wall, {cpu:.1f} ms cpu{verdict}"
    )


def recorded(arguments):
    """The sequences of the shared folder."""
    if not (SHARED / "data").is_dir():
        print("skipped: no recorded data")
        return
    extra = ["--realtime"] if arguments.realtime else []
    for sequence, mode, target in RECORDED:
        folder = SHARED / "data" / sequence
        runs = [run_once(arguments, folder, mode, extra=extra) for _ in range(arguments.runs)]
        print(row(f"{sequence} {mode}", runs, target), flush=True)


def ablation(arguments):
    """Parts switched off, one schedule, several seeds."""
    for name, settings in ABLATION:
        runs = [
            run_once(arguments, arguments.sequence, arguments.mode, settings,
                     ["--deterministic", "--seed", str(seed)])
            for seed in range(arguments.runs)
        ]
        print(row(name, runs), flush=True)


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("table", choices=["recorded", "ablation"])
    parser.add_argument("--ygslam", default=str(ROOT / "build/release/ygslam"))
    parser.add_argument("--model", default=None)
    parser.add_argument("--sequence", default=None)
    parser.add_argument("--mode", default="off", help="of the ablation")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--realtime", action="store_true", help="feed frames at their stamps")
    arguments = parser.parse_args()
    if arguments.table == "ablation" and not arguments.sequence:
        parser.error("ablation needs --sequence")
    {"recorded": recorded, "ablation": ablation}[arguments.table](arguments)


if __name__ == "__main__":
    sys.exit(main())
