#!/usr/bin/env python3
"""How a run in real time comes through when others want the processor: sequences x loads x networks, in rounds.

    .venv/bin/python bench/starved.py RESULTS.jsonl SEQUENCE ... --ygslam build/release/ygslam [--rounds 5]
    .venv/bin/python bench/starved.py RESULTS.jsonl            # the table of what is there

Loads: quiet; loops, many (three, ten busy loops beside it, on the same two cores); one (a single core). A round has
every load once, so that what else happens on the machine is shared. A run is a line of RESULTS, and one whose line is there is
not repeated. Late: frames that took over 200 ms; stood: those in which the tracking thread had less than a tenth of
the time the load would leave it (a quarter of two cores; half of one), so that something else kept it.
"""
import csv
import functools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from matrix import measured, parser_of, print_table

LATE_MS = 200
CORES = sorted(os.sched_getaffinity(0))[:2]
LOADS = {"quiet": (CORES, 0, 1), "loops": (CORES, 3, 0.25), "many": (CORES, 10, 0.1), "one": (CORES[:1], 0, 0.5)}


def figures(out, share):
    metrics = json.loads((out / "metrics.json").read_text())
    rows = [row for row in csv.DictReader((out / "frames.csv").open()) if row["state"] not in ("dropped", "unreadable")]
    took = [(float(row["track_ms"]), float(row["track_cpu_ms"])) for row in rows]
    late = [(wall, cpu) for wall, cpu in took if wall > LATE_MS]
    ages = [int(row["mask_age_frames"]) for row in rows if int(row["mask_age_frames"]) >= 0]
    return {"coverage": metrics["coverage"], "dropped": metrics.get("dropped", 0),
            "lost": sum(row["state"] == "lost" for row in rows),
            "ate_mm": 1e3 * metrics["ate"]["rmse"] if "ate" in metrics else float("nan"),
            "late": len(late), "stood": sum(cpu < 0.1 * share * wall for wall, cpu in late),
            "longest_ms": max((wall for wall, _ in took), default=0), "mask_age": statistics.median(ages) if ages else -1,
            "oldest_mask": max(ages, default=-1)}


def run(arguments, sequence, model, load, number):
    cores, loops, share = LOADS[load]
    with tempfile.TemporaryDirectory() as folder:
        busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(loops)]
        try:
            for process in busy:
                os.sched_setaffinity(process.pid, cores)
            time.sleep(0.2)
            done = subprocess.run([arguments.ygslam, "run", sequence, "--out", folder, "--realtime",
                                   *(["--model", model] if model != "builtin" else []), *arguments.options.split()],
                                  capture_output=True, text=True, check=False,
                                  preexec_fn=lambda: os.sched_setaffinity(0, cores))
        finally:
            for process in busy:
                process.kill()
                process.wait()
        if done.returncode not in (0, 7):
            sys.exit(f"error: {sequence.name}, {load}: {done.stderr.strip()[-500:]}")
        line = {"sequence": sequence.name, "model": Path(model).stem, "load": load, "round": number,
                "build": arguments.build, **figures(Path(folder), share)}
    print(json.dumps(line), flush=True)
    return line


def show(lines):
    rows = []
    for key in dict.fromkeys((line["build"], line["sequence"], line["model"], line["load"]) for line in lines):
        of = [line for line in lines if (line["build"], line["sequence"], line["model"], line["load"]) == key]

        def all_of(name, digits):
            values = sorted(line[name] for line in of)
            return f"{statistics.median(values):.{digits}f} ({values[0]:.{digits}f} to {values[-1]:.{digits}f})"
        rows.append([" ".join(key[:3]), key[3], str(len(of)), all_of("coverage", 3), all_of("ate_mm", 1), all_of("dropped", 0),
                     str(sum(line["late"] for line in of)), str(sum(line["stood"] for line in of)),
                     all_of("longest_ms", 0), all_of("mask_age", 0), str(max(line["oldest_mask"] for line in of))])
    print_table(["run", "load", "rounds", "coverage", "ATE [mm]", "dropped", "late", "stood", "longest [ms]",
                 "age of masks", "oldest"], rows)


def main():
    parser = parser_of(__doc__)
    parser.add_argument("sequences", type=Path, nargs="*")
    parser.add_argument("--models", nargs="+", default=["builtin"], help="builtin, or files")
    parser.add_argument("--loads", nargs="+", choices=LOADS, default=list(LOADS))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--build", default="", help="its name, in the table")
    parser.add_argument("--options", default="", help="more words for `ygslam run`")
    arguments = parser.parse_args()
    if arguments.sequences and not arguments.ygslam:
        parser.error("--ygslam is missing")
    if len({Path(model).stem for model in arguments.models}) < len(arguments.models):
        parser.error("--models: two files of one name")
    jobs = {(arguments.build, sequence.name, Path(model).stem, load, number):
            functools.partial(run, arguments, sequence, model, load, number)
            for number in range(arguments.rounds) for sequence in arguments.sequences
            for model in arguments.models for load in arguments.loads}
    show(measured(arguments.results, lambda line: tuple(line[name] for name in ("build", "sequence", "model", "load", "round")), jobs))


if __name__ == "__main__":
    main()
