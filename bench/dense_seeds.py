#!/usr/bin/env python3
"""The dense map over rendered worlds and seeds, against the exact truth.

    .venv/bin/python bench/dense_seeds.py RESULTS.jsonl --ygslam build/release/ygslam --scratch DIR \\
        --worlds walking_xyz,crowd --seeds 1-3 --masks true,network --model yolov8n-seg_480x640.onnx
    .venv/bin/python bench/dense_seeds.py RESULTS.jsonl          # the tables of what is there

A world of a seed is rendered into DIR (--seconds of it, --fps frames a second), run (deterministic, own
poses) with the true masks of all things or with those of a network, judged by `ygslam eval --map`,
voxel_truth.py and, with --background, background_table.py, and deleted (what was rendered stays
with --keep, and is used again). The figures are a line of RESULTS; what is there is not
repeated. Tables tell the median of the seeds (the worst).
"""
import argparse
import functools
import json
import statistics
from pathlib import Path

import background_table
import voxel_truth
from matrix import measured, parser_of, print_table
from rendered_seeds import Bench, seed_range

WORLDS = "walking_xyz,walking_halfsphere,crowd,moved_chair,corridor_loop"


def masks_of(bench, sequence, masks):
    """Where the run's masks come from, and where they lie as images when it has ended."""
    if masks == "true":
        return ["--segmenter", f"masks:{sequence / 'things'}"], sequence / "things"
    kept = bench.folder("masks")  # not for another run: they have no scores
    return ["--model", bench.options.model, "--save-masks", kept], kept


def judge(bench, name, seed, masks):
    """@return a line of the results."""
    o = bench.options
    sequence = bench.render(f"{name}_{seed}", name, seed, "--truth", "--seconds", o.seconds,
                            "--fps", o.fps).folder
    how, images = masks_of(bench, sequence, masks)
    scene = bench.folder("scene")
    pictures = ["--background", bench.folder("background")] if o.background else []
    out = bench.run("run", sequence, "--export", scene, *pictures, *o.run_options.split(),
                    how=["--deterministic", *how])
    done = bench.call("eval", "--map", scene, "--truth", sequence, "--est", out / "trajectory.txt", "--json")
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    figures = {"world": name, "seed": seed, "masks": masks,
               "ate_mm": 1000 * json.loads((out / "metrics.json").read_text())["ate"]["rmse"],
               **json.loads(done.stdout),
               "cells": voxel_truth.measure(scene, sequence, out / "trajectory.txt", images)}
    if o.background:
        figures["background"] = background_table.measure(argparse.Namespace(
            pictures=bench.folder("background"), seq=sequence, step=8, cell=0.04, far=4.4))
    return figures


def value(line, path):
    for key in path.split("."):
        line = line.get(key) if line else None
    return line


# Heading, figure, factor, whether more is better.
TABLES = {
    "surface": [("accuracy cm", "accuracy_m.mean", 100, False), ("precision %", "precision", 100, True),
                ("completeness %", "completeness", 100, True), ("ghosts %", "ghosts", 100, False),
                ("kept %", "cells.kept", 100, True), ("gone %", "cells.gone", 100, True),
                ("ATE mm", "ate_mm", 1, False)],
    "labels": [("mIoU %", "cells.miou", 100, True), ("of things", "cells.miou_things", 100, True),
               ("single masks", "cells.miou_single", 100, True)],
    "objects": [("F1 %", "objects.f1", 100, True), ("precision %", "objects.precision", 100, True),
                ("recall %", "objects.recall", 100, True), ("true ones", "objects.truths", 1, True),
                ("duplicates", "objects.duplicates", 1, False), ("lost", "changes.lost", 1, False)],
    "ground plan": [("obstacles found %", "cells.plan.obstacles_found", 100, True),
                    ("free, unseen %", "cells.plan.unknown_free", 100, False),
                    ("free, obstacle %", "cells.plan.free_obstacle", 100, False),
                    ("falsely occupied %", "cells.plan.false_occupied", 100, False)],
    "background": [("PSNR dB", "background.psnr_db", 1, True), ("SSIM", "background.ssim", 1, True),
                   ("depth RMSE cm", "background.depth_rmse_m", 100, False),
                   ("median cm", "background.depth_median_m", 100, False),
                   ("90 % within cm", "background.depth_p90_m", 100, False),
                   ("filled %", "background.covered", 100, True)]}


def spread(values, more_is_better):
    if not values:
        return "-"
    worst = min(values) if more_is_better else max(values)
    middle = statistics.median(values)
    return f"{middle:.3g}" if len(values) == 1 else f"{middle:.3g} ({worst:.3g})"


def report(lines):
    for title, columns in TABLES.items():
        rows = []
        for masks in ("true", "network"):
            worlds = dict.fromkeys(line["world"] for line in lines if line["masks"] == masks)
            for world in worlds:
                its = [line for line in lines if (line["world"], line["masks"]) == (world, masks)]
                cells = [spread([factor * v for line in its if (v := value(line, path)) is not None], better)
                         for _, path, factor, better in columns]
                if set(cells) != {"-"}:
                    rows.append([world, masks, str(len(its)), *cells])
        if rows:
            print_table([title, "masks", "seeds", *(column[0] for column in columns)], rows)


def measure(options, name, seed, masks, is_last):
    with Bench(options) as bench:
        line = judge(bench, name, seed, masks)
        if options.keep or not is_last:
            bench.keep(f"{name}_{seed}")
        return line


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--scratch", type=Path, help="folder for what is rendered, and deleted")
    parser.add_argument("--worlds", default=WORLDS)
    parser.add_argument("--seeds", default="1-3", help="FIRST-LAST, or one")
    parser.add_argument("--masks", default="true,network")
    parser.add_argument("--model", type=Path, help="of the masks `network`")
    parser.add_argument("--seconds", type=float, default=9)
    parser.add_argument("--fps", type=float, default=15)
    parser.add_argument("--keep", action="store_true", help="what was rendered, for the next call")
    parser.add_argument("--background", action="store_true", help="judge the pictures without people, too")
    parser.add_argument("--run-options", default="", help="further options of `ygslam run`, in one text")
    o = parser.parse_args()
    all_masks = o.masks.split(",")
    jobs = {(world, seed, masks): functools.partial(measure, o, world, seed, masks, masks == all_masks[-1])
            for seed in (seed_range(o.seeds) if o.ygslam and o.scratch else ())
            for world in o.worlds.split(",") for masks in all_masks}
    report(measured(o.results, lambda line: (line["world"], line["seed"], line["masks"]), jobs))


if __name__ == "__main__":
    main()
