#!/usr/bin/env python3
"""Whether anything but the map grows in a long run over the same ground.

    ygslam simulate walking_static --truth --seconds 8 --out SEQ
    .venv/bin/python bench/long_run.py SEQ --ygslam build/release/ygslam --scratch DIR --frames 100000

Plays a recording (with associations.txt and groundtruth.txt) to and fro as one endless walk, by the masks of
SEQ/mask where there are some. Prints for every tenth of the run: resident memory [MB], processor time of
tracking a frame [ms] (median; of --live runs), frames with a pose [%], distance of live positions from the truth [m] (median, in the
frame of the first); then the map's size at the end, and how much the straight line through the memory of the last half rises
over it. Exit code 1 where that is more than --max-growth.
"""
import argparse
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from rendered_seeds import Sequence, alignment, errors_m, micros, read_table, read_tum, to_and_fro

PARTS = 10


def watched(command):
    """Resident memory [MB] ten times a second while the command runs: frames go by evenly."""
    memory_mb = []
    run = subprocess.Popen(command)
    while run.poll() is None:
        status = Path(f"/proc/{run.pid}/status").read_text()
        if "VmRSS" in status:  # it has not ended yet
            memory_mb.append(int(status.split("VmRSS:")[1].split()[0]) / 1024)
        time.sleep(0.1)
    if run.returncode not in (0, 7):
        sys.exit(f"exit code {run.returncode}")
    return memory_mb


def growth_percent(memory_mb):
    """Of the straight line through the last half, over it."""
    half = memory_mb[len(memory_mb) // 2:]
    slope, start = np.polyfit(np.linspace(0, 1, len(half)), half, 1)
    return 100 * slope / start


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence", type=Path)
    parser.add_argument("--ygslam", required=True)
    parser.add_argument("--scratch", type=Path, required=True, help="folder for links and results, left there")
    parser.add_argument("--frames", type=int, default=3000)
    parser.add_argument("--live", action="store_true", help="threads, as fast as they go")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--max-growth", type=float, default=2, help="[%%]")
    o = parser.parse_args()
    folder, out = o.scratch / "to_and_fro", o.scratch / "out"
    for old in (folder, out):
        shutil.rmtree(old, ignore_errors=True)
    played = to_and_fro(Sequence(o.sequence), folder, o.frames)
    has_masks = (folder / "mask").is_dir()
    how = ["--segmenter", f"masks:{folder / 'mask'}"] if has_masks else ["--dynamic", "geometry", "--segmenter", "none"]
    command = [o.ygslam, "--quiet", "run", folder, "--out", out, *how, *([] if o.live else ["--deterministic"])]
    memory_mb = watched([*map(str, command), *(word for s in o.set for word in ("--set", s))])
    rows, live = read_table(out / "frames.csv"), read_tum(out / "trajectory_live.txt")
    off = errors_m(live, played.truth(), alignment(live, played.truth()))
    print("   frames  memory MB  track ms  tracked %  error m")
    for part, memory in zip(np.array_split(np.arange(len(rows)), PARTS), np.array_split(memory_mb, PARTS)):
        mine = [rows[i] for i in part]
        track_ms = [float(row["track_cpu_ms"]) for row in mine if row["track_cpu_ms"]]
        errors = [off[s] for row in mine if (s := micros(row["stamp"])) in off]
        print(f"{part[-1] + 1:9} {memory[-1]:10.1f} {np.median(track_ms) if track_ms else np.nan:9.2f} "
              f"{100 * len(errors) / len(mine):10.2f} {np.median(errors) if errors else np.nan:8.4f}")
    metrics, growth = json.loads((out / "metrics.json").read_text()), growth_percent(memory_mb)
    print(f"{metrics['keyframes']} keyframes, {metrics['landmarks']} landmarks; "
          f"memory over the last half {growth:+.2f} %")
    return int(growth > o.max_growth)


if __name__ == "__main__":
    sys.exit(main())
