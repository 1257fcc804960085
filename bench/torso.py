"""Somebody who fills the view with no mask over it: frames lost and ATE, before and after.

    .venv/bin/python bench/torso.py torso.jsonl --ygslam build/release/ygslam

A person walks past a camera in motion, 0.4 to 0.5 m away, stops in front of it and goes on; each seed has another
body, clothes, speeds and gesture. The torso covers up to 60 to 100 % of the image, most of it too near for depth.
Each world is rendered (320x240, 30 frames/s, 6 s) and run by geometry alone; a line of JSON a run, so that it can be
stopped and goes on. Lost frames count apart by how much of the view was covered.
"""
import csv
import json
import random
import statistics
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from matrix import measured, parser_of, print_table

WORLD = """seconds: 6
layout: office
camera: {{path: xyz, at: [0, -1.9, 1.25], look_at: [0, 1.5, 1.05]}}
people:
  - {{name: eva, body: {body}, top: {top}, top_variant: {variant}, skin: {skin}, hair: {hair}, short_sleeves: {sleeves},
     start: [{start:.2f}, {y:.2f}],
     actions: [{{do: walk, via: [[{stop:.2f}, {y:.2f}]], speed: {speed:.2f}}},
               {{do: stand, seconds: {seconds:.1f}, yaw: {yaw}, gesture: {gesture}}},
               {{do: walk, via: [[{end:.2f}, {y:.2f}]], speed: {speed_away:.2f}}}]}}
"""
BINS = [0, 0.6, 0.75, 1.01]  # of the view, covered


def world_of(seed):
    rng = random.Random(seed)
    side = rng.choice([-1.6, 1.6])
    return WORLD.format(
        start=side, end=-side, y=-1.9 + rng.uniform(0.38, 0.5), stop=rng.uniform(-0.15, 0.15), body=rng.randrange(6),
        top=rng.choice(["plaid", "stripes", "print", "cloth"]), variant=rng.randrange(5), skin=rng.randrange(5),
        hair=rng.randrange(5), sleeves=rng.choice(["true", "false"]), speed=rng.uniform(0.7, 1.1),
        seconds=rng.uniform(0.5, 2), yaw=rng.randrange(360),
        gesture=rng.choice(["talk", "wave", "phone", "drink", "point"]), speed_away=rng.uniform(0.4, 1.1))


def covered(sequence):
    """Share of the person in each image."""
    return [float((np.asarray(Image.open(mask)) > 0).mean()) for mask in sorted((sequence / "mask").glob("*.png"))]


def run(ygslam, seed):
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        world = folder / "world.yaml"
        world.write_text(world_of(seed), "utf-8")
        subprocess.run([ygslam, "simulate", world, "--out", folder / "S", "--size", "320x240", "--seed", str(seed),
                        "--truth", "--quiet"], check=True)
        subprocess.run([ygslam, "run", folder / "S", "--out", folder / "out", "--dynamic", "geometry", "--segmenter",
                        "none", "--deterministic", "--quiet"], check=False)
        metrics = json.loads((folder / "out" / "metrics.json").read_text("utf-8"))
        with (folder / "out" / "frames.csv").open(encoding="utf-8") as file:
            states = [row["state"] for row in csv.DictReader(file)]
        share = covered(folder / "S")
        lost = [sum(state == "lost" and low <= s < high for state, s in zip(states, share))
                for low, high in zip(BINS, BINS[1:])]
    return {"seed": seed, "ate_m": metrics["ate"]["rmse"], "lost": lost, "covered": max(share)}


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    args = parser.parse_args()
    jobs = {seed: (lambda seed=seed: run(args.ygslam, seed)) for seed in range(1, args.seeds + 1)}
    lines = measured(args.results, lambda line: line["seed"], jobs)
    head = ["seed", "covered at most", *[f"lost, {low:.0%} to {min(high, 1):.0%}" for low, high in zip(BINS, BINS[1:])],
            "ATE [mm]"]
    rows = [[str(line["seed"]), f"{line['covered']:.2f}", *map(str, line["lost"]), f"{1000 * line['ate_m']:.1f}"]
            for line in lines]
    ates = [1000 * line["ate_m"] for line in lines]
    rows.append(["all", "", *[str(sum(line["lost"][i] for line in lines)) for i in range(len(BINS) - 1)],
                 f"{statistics.median(ates):.1f} (worst {max(ates):.1f})"])
    print_table(head, rows)


if __name__ == "__main__":
    main()
