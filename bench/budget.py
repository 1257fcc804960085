#!/usr/bin/env python3
"""Where a live run's processor time goes, stage by stage, with the best library's figure beside it where there is one.

    .venv/bin/python bench/budget.py SEQUENCE ... --ygslam build/release/ygslam [--benchmarks FOLDER] [--options "..."]

Runs with --realtime --trace. Thread time of each time a stage ran; of a core: all of it over the recording's length.
Stages within others stand below them. FOLDER has what orb_bench and optim_bench wrote (orb.json, optim.json: `make bench`).
"""
import argparse
import collections
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from matrix import print_table

# The benchmark that does a stage's main work beside a library, and whose it is.
BESIDE = {"features": ("BM_ExtractBesideOpenCv", "opencv", "OpenCV's ORB"),
          "flow": ("BM_FlowBesideOpenCv", "opencv", "OpenCV's Lucas-Kanade"),
          "local map": ("BM_PoseOnlyBesideCeres", "ceres", "Ceres, pose of 500 points"),
          "bundle adjustment": ("BM_LocalBundleBesideCeres", "ceres", "Ceres, 15 keyframes"),
          "adjust the whole map": ("BM_WholeMapBundleBesideCeres/225", "ceres", "Ceres, 225 keyframes")}
WORTH = 0.002  # of a core: less is not shown


def events_of(trace):
    events = json.loads(trace.read_text("utf-8"))
    threads = {event["tid"]: event["args"]["name"] for event in events if event.get("name") == "thread_name"}
    spans = [event for event in events if event["ph"] == "X"]
    for span in spans:
        span["thread"] = threads[span["tid"]]
    return spans


def name_paths(spans):
    """Of each span the names of the stages of its thread that it stands in, and its own."""
    around = collections.defaultdict(list)
    for span in sorted(spans, key=lambda s: (s["tid"], s["ts"], -s["dur"])):
        outer = around[span["tid"]]
        while outer and outer[-1]["ts"] + outer[-1]["dur"] <= span["ts"]:
            outer.pop()
        span["path"] = (span["thread"], *(o["name"] for o in outer), span["name"])
        outer.append(span)


def quantile(values, q):
    return sorted(values)[min(len(values) - 1, int(q * len(values)))]


def traced(arguments, sequence):
    with tempfile.TemporaryDirectory() as folder:
        trace = Path(folder) / "trace.json"
        done = subprocess.run([arguments.ygslam, "run", sequence, "--out", folder, "--realtime", "--trace", trace,
                               *arguments.options.split()], capture_output=True, text=True, check=False)
        if done.returncode not in (0, 7):
            sys.exit(f"error: {sequence}: {done.stderr.strip()[-500:]}")
        stamps = [float(row["stamp"]) for row in csv.DictReader((Path(folder) / "frames.csv").open())]
        for line in done.stderr.splitlines():  # of spans that are not in the trace
            if line.startswith("warning:"):
                print(line, file=sys.stderr)
        return events_of(trace), stamps[-1] - stamps[0]


def beside(folder):
    """Per stage the library's time over ours, as text."""
    found = {}
    for file in folder.glob("*.json") if folder else []:
        for line in json.loads(file.read_text())["benchmarks"]:
            for stage, (name, library, what) in BESIDE.items():
                if line["name"] == name:
                    found[stage] = f"{what}: {line[library + '_over_ours']:.1f} ({line[library + '_ms']:.2f} ms)"
    return found


def table(spans, length_s, libraries):
    stages = collections.defaultdict(list)
    work = [span for span in spans if span["cat"] == "stage"]
    name_paths(work)
    for span in work:
        stages[span["path"]].append(span)
    frames = max((len(of) for path, of in stages.items() if path[-1] == "track"), default=0)
    if not frames:
        sys.exit("error: no frame was tracked")
    share = {path: sum(span["args"]["cpu_ms"] for span in of) / 1e3 / length_s for path, of in stages.items()}

    def rows_below(above):
        for path in sorted((p for p in stages if p[:-1] == above), key=lambda p: stages[p][-1]["ts"]):
            if share[path] < WORTH:
                continue
            cpu = [span["args"]["cpu_ms"] for span in stages[path]]
            wall = [span["dur"] / 1e3 for span in stages[path]]
            yield [above[0] + ": " + "· " * (len(path) - 2) + path[-1], f"{len(cpu) / frames:.2f}",
                   f"{quantile(cpu, 0.5):.2f}, {quantile(cpu, 0.99):.2f}",
                   f"{quantile(wall, 0.5):.2f}, {quantile(wall, 0.99):.2f}", f"{share[path]:.3f}",
                   libraries.get(path[-1], "")]
            yield from rows_below(path)
    of_thread = collections.defaultdict(float)
    for path in stages:
        if len(path) == 2:
            of_thread[path[0]] += share[path]
    rows = [row for thread in sorted(of_thread, key=lambda t: -of_thread[t]) for row in rows_below((thread,))]
    waits = collections.defaultdict(float)
    for span in spans:
        if span["cat"] == "wait":
            waits[span["thread"]] += span["dur"] / 1e6 / length_s
    print_table(["thread: stage", "times a frame", "processor: median, p99 [ms]", "wall: median, p99 [ms]", "of a core",
                 "library's time over ours"], rows)
    print("Of a core: " + ", ".join(f"{thread} {of_thread[thread]:.2f}" for thread in sorted(of_thread, key=lambda t: -of_thread[t]))
          + f"; all {sum(of_thread.values()):.2f}.")
    print("Waiting, of the time: " + ", ".join(f"{thread} {100 * share:.0f} %" for thread, share in sorted(waits.items())) + ".")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", type=Path, nargs="+")
    parser.add_argument("--ygslam", required=True)
    parser.add_argument("--benchmarks", type=Path)
    parser.add_argument("--options", default="", help="more words for `ygslam run`")
    arguments = parser.parse_args()
    for sequence in arguments.sequences:
        spans, length_s = traced(arguments, sequence)
        print(f"\n{sequence.name}, {length_s:.1f} s\n")
        table(spans, length_s, beside(arguments.benchmarks))


if __name__ == "__main__":
    main()
