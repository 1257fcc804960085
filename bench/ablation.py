#!/usr/bin/env python3
"""What each part of the handling of moving things is worth: the full system, then each part off.

    .venv/bin/python bench/ablation.py RESULTS.jsonl --ygslam build/release/ygslam \\
        --masks masks_net SEQUENCE [SEQUENCE ...]
    .venv/bin/python bench/ablation.py RESULTS.jsonl          # the tables of what is there

Deterministic runs (or live ones, --live) over sequences and seeds; every run is a line of RESULTS,
and a run whose line is there is not repeated. --masks names a folder inside each sequence with what
the network once said (`run --save-masks`; live runs want --model FILE); `--parts` chooses rows by a
regular expression.

Prints, for each part and sequence, how much its absence changes the ATE in per cent: mean and 95 %
interval (Student's t) of the differences to the full system with the same seed. Then, for each
part: on how many sequences that interval lies above zero (its absence hurts), below (it helps) or
around it; the geometric mean of the ratios over the sequences with its interval; the change of
precision and recall (in points) and of tracking's thread CPU time.
"""
import functools
import json
import math
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from scipy.stats import t as student

from matrix import measured, parser_of, print_table

FULL = "full"
WITHOUT = ("static_prior", "ego_motion", "occlusion_boundaries", "neighbour_votes",
           "neighbour_support", "free_space", "depth_edge_weights", "local_map", "local_bundle")
PARTS = {  # name: (mode, settings)
    FULL: ("full", []),
    "mode off": ("off", []),
    "mode geometry": ("geometry", []),
    "mode semantic": ("semantic", []),
    **{f"no {part.replace('_', ' ')}": ("full", [f"run.without=[{part}]"]) for part in WITHOUT},
    "no local map nor bundle": ("full", ["run.without=[local_map, local_bundle]"]),
    "no epipolar line": ("full", ["motion.tau_px=50"]),
    "nobody comes back": ("full", ["labels.min_static=0"]),
    "mask edges not mended": ("full", ["masks.outer_band_px=0", "masks.inner_band_px=0"]),
    "unknown weighs as static": ("full", ["labels.unknown_weight=1"]),
    "unknown weighs nothing": ("full", ["labels.unknown_weight=0"]),
}


def measure(options, sequence, part, seed):
    """One run's figures; without "ate_mm" if it failed."""
    mode, settings = PARTS[part]
    source = (["--model", options.model] if options.model
              else ["--segmenter", f"masks:{sequence / options.masks}"])
    common = [*source, "--seed", str(seed), *(a for s in settings for a in ("--set", s))]
    figures = {"sequence": sequence.resolve().name, "part": part, "seed": seed,
               "live": options.live}
    with tempfile.TemporaryDirectory(prefix="ygslam-ablation-") as out:
        command = [options.ygslam, "--quiet", "run", str(sequence), "--out", out, "--dynamic", mode,
                   *common, *([] if options.live else ["--deterministic"])]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(done.stderr.strip(), file=sys.stderr)
        metrics_file = Path(out) / "metrics.json"
        if not metrics_file.is_file():
            return figures
        metrics = json.loads(metrics_file.read_text(encoding="utf-8"))
    figures |= {"coverage": metrics["coverage"], "ate_mm": 1000 * metrics["ate"]["rmse"],
                "track_cpu_ms": metrics["cpu_ms"]["track"]["median"]}
    # `inspect` knows two of the modes: geometry ("improved") and full.
    check = {"full": "full", "geometry": "improved"}.get(mode)
    judged = check and seed < options.truth_seeds and (sequence / "mask").is_dir()
    if judged and not options.live:
        done = subprocess.run([options.ygslam, "--quiet", "inspect", str(sequence), "--checks",
                               check, "--json", *common],
                              capture_output=True, text=True, check=True)
        counts = json.loads(done.stdout)["checks"][0]
        figures |= {key: counts[key] for key in ("found", "missed", "false_alarms", "standing")}
    return figures


def interval(values):
    """Mean and half the width of its 95 % interval; NaN for a single value."""
    n = len(values)
    if n < 2:
        return values[0], math.nan
    return statistics.mean(values), student.ppf(0.975, n - 1) * statistics.stdev(values) / n**0.5


def share(found, others):
    return found / (found + others) if found + others else 1.0


def precision_recall(runs):
    """Of the runs together, in per cent; None without truth, or where nothing moves."""
    runs = [r for r in runs if "found" in r]
    total = {k: sum(r[k] for r in runs) for k in ("found", "missed", "false_alarms")}
    if not runs or total["found"] + total["missed"] == 0:
        return None
    return (100 * share(total["found"], total["false_alarms"]),
            100 * share(total["found"], total["missed"]))


class Results:
    def __init__(self, lines):
        self.runs = {}  # (sequence, part) -> {seed: figures}
        for line in lines:
            self.runs.setdefault((line["sequence"], line["part"]), {})[line["seed"]] = line
        self.sequences = list(dict.fromkeys(s for s, _ in self.runs))
        self.parts = [p for p in PARTS if any(p == part for _, part in self.runs)]

    def pairs(self, sequence, part):
        """(full, part) runs of the same seeds."""
        full = self.runs.get((sequence, FULL), {})
        return [(full[seed], run) for seed, run in self.runs.get((sequence, part), {}).items()
                if seed in full]

    def is_lost(self, sequence, part):
        return any(run.get("coverage", 0) < 0.99 for _, run in self.pairs(sequence, part))

    def change(self, sequence, part):
        """Change of the ATE without the part [%], (mean, half width); None where not measured."""
        pairs = self.pairs(sequence, part)
        if not pairs or any("ate_mm" not in run for pair in pairs for run in pair):
            return None
        return interval([100 * (run["ate_mm"] / full["ate_mm"] - 1) for full, run in pairs])

    def ratio(self, part):
        """Geometric mean over the sequences of the ATE's ratio: (mean, low, high)."""
        logs = []
        for sequence in self.sequences:
            if self.change(sequence, part) is None:
                continue
            logs.append(statistics.mean(math.log(run["ate_mm"] / full["ate_mm"])
                                        for full, run in self.pairs(sequence, part)))
        if not logs:
            return None
        mean, half = interval(logs)
        return math.exp(mean), math.exp(mean - half), math.exp(mean + half)

    def truth_change(self, part):
        """Mean change of precision and recall over the sequences [points]."""
        changes = []
        for sequence in self.sequences:
            pairs = [p for p in self.pairs(sequence, part) if all("found" in run for run in p)]
            before, after = (precision_recall([p[i] for p in pairs]) for i in (0, 1))
            if before and after:
                changes.append((after[0] - before[0], after[1] - before[1]))
        if not changes:
            return None
        return tuple(statistics.mean(c[i] for c in changes) for i in (0, 1))

    def cost(self, part):
        """Tracking's thread CPU time without the part, ratio to the full system."""
        ratios = [run["track_cpu_ms"] / full["track_cpu_ms"] for sequence in self.sequences
                  for full, run in self.pairs(sequence, part)
                  if "track_cpu_ms" in run and "track_cpu_ms" in full]
        return statistics.median(ratios) if ratios else None


def report(results):
    cells = []
    for sequence in results.sequences:
        runs = list(results.runs.get((sequence, FULL), {}).values())
        ates = [r["ate_mm"] for r in runs if "ate_mm" in r]
        if not ates:
            continue
        truth = precision_recall(runs)
        cells.append([sequence, str(len(ates)), f"{statistics.mean(ates):.3f}",
                      f"{min(ates):.3f} to {max(ates):.3f}",
                      f"{truth[0]:.1f}, {truth[1]:.1f}" if truth else "-"])
    print_table(["full system", "seeds", "ATE [mm]", "least to most", "precision, recall [%]"], cells)

    def cell(sequence, part):
        change = results.change(sequence, part)
        if change is None:
            return "-"
        lost = " lost" if results.is_lost(sequence, part) else ""
        return f"{change[0]:+.1f} ± {change[1]:.1f}{lost}"

    parts = [p for p in results.parts if p != FULL]
    print_table(["change of the ATE [%]", *results.sequences],
                [[part, *(cell(s, part) for s in results.sequences)] for part in parts])

    rows = []
    for part in parts:
        changes = [c for s in results.sequences if (c := results.change(s, part))]
        worse = sum(mean - half > 0 for mean, half in changes)
        better = sum(mean + half < 0 for mean, half in changes)
        ratio, truth, cost = results.ratio(part), results.truth_change(part), results.cost(part)
        rows.append([part, f"{worse} / {better} / {len(changes) - worse - better}",
                     f"{ratio[0]:.3f} ({ratio[1]:.3f} to {ratio[2]:.3f})" if ratio else "-",
                     f"{truth[0]:+.1f}, {truth[1]:+.1f}" if truth else "-",
                     f"{cost:.2f}" if cost else "-"])
    print_table(["without it", "ATE worse / better / noise", "ratio of the ATE",
                 "precision, recall [points]", "CPU ratio"], rows)


def main():
    parser = parser_of(__doc__)
    parser.add_argument("sequences", nargs="*", type=Path)
    parser.add_argument("--model")
    parser.add_argument("--masks", default="mask", help="folder of masks inside each sequence")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--truth-seeds", type=int, default=1,
                        help="seeds of which precision and recall are counted (a second run)")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--parts", default=".", help="regular expression")
    parser.add_argument("--live", action="store_true")
    options = parser.parse_intermixed_args()
    if options.sequences and not options.ygslam:
        parser.error("--ygslam: which program?")
    for sequence in options.sequences:
        if not (sequence / "groundtruth.txt").is_file():
            parser.error(f"{sequence}: no groundtruth.txt")

    wanted = [p for p in PARTS if p == FULL or re.search(options.parts, p)]
    jobs = {(sequence.resolve().name, part, seed, options.live): functools.partial(measure, options, sequence, part, seed)
            for seed in range(options.seeds) for sequence in options.sequences for part in wanted}
    lines = measured(options.results, lambda r: (r["sequence"], r["part"], r["seed"], r["live"]), jobs, options.jobs)
    report(Results(r for r in lines if r["live"] == options.live))


if __name__ == "__main__":
    main()
