"""Where people are and where they will be in a second, against rendered truth: errors, identities, covariance.

    .venv/bin/python bench/people_prediction.py people.jsonl --ygslam build/release/ygslam

Worlds are rendered with truth and run with the built-in network; a line of JSON a world and seed, so that it can be
stopped and goes on (--keep DIR: rendered worlds are kept there and used again). Truth is the pelvis, on the floor. A
person counts in a frame where he fills 0.5 % of it; the nearest live object within 0.75 m is his (CLEAR MOT: one
to one, who had it keeps it). Objects count as long as they were confirmed within half a second.

`standing` and `walking on` are what forecasts are compared with: the filtered place, and the place plus a second of
the mean velocity of half a second. NEES: squared error over its covariance, 2 where the covariance is true.
"""
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.optimize import linear_sum_assignment

from matrix import measured, parser_of, print_table
from rendered_seeds import alignment, micros, read_table, read_tum, stamp_text

WORLDS = ["crowd", "walking_xyz", "walking_halfsphere"]
SECOND_US = 1_000_000
LEAST_SHARE = 0.005
GATE_M = 0.75
LIVE_FRAMES = 15
CHI2_95 = 5.99  # of two dimensions


class Truth:
    def __init__(self, sequence):
        names = json.loads((sequence / "instances.json").read_text("utf-8"))
        self.path = {int(key): read_tum(sequence / "movers" / f"{key}.txt")
                     for key, name in names.items() if name == "person"}
        self.stamps = sorted(next(iter(self.path.values())))
        self.camera = read_tum(sequence / "groundtruth.txt")
        self.shown = {stamp: self._shown(sequence / "mask" / f"{stamp_text(stamp)}.png") for stamp in self.stamps}

    def _shown(self, mask):
        ids = np.asarray(Image.open(mask))
        pixels = np.bincount(ids.ravel(), minlength=256)
        return {person for person in self.path if pixels[person] >= LEAST_SHARE * ids.size}

    def at(self, person, stamp):
        return self.path[person][stamp][:2]

    def after_a_second(self, person, stamp):
        nearest = min(self.stamps, key=lambda s: abs(s - stamp - SECOND_US))
        return self.at(person, nearest) if abs(nearest - stamp - SECOND_US) < 20_000 else None


class Seen:
    """A row of objects.csv, in the truth's frame, on the floor."""

    def __init__(self, row, turn, shift):
        def place(name):
            return (turn.apply([float(row[f"{name}_{axis}_m"]) for axis in "xyz"]) + shift)[:2]

        def covariance(name):
            xx, xy, xz, yy, yz, zz = (float(row[f"{name}_{k}_cm2"]) * 1e-4 for k in ("xx", "xy", "xz", "yy", "yz", "zz"))
            matrix = turn.as_matrix() @ [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] @ turn.as_matrix().T
            return matrix[:2, :2]
        self.id = int(row["id"])
        self.body, self.soon = place("body"), place("soon")
        self.body_covariance, self.soon_covariance = covariance("body"), covariance("soon")
        self.velocity = turn.apply([float(row[f"v{axis}_mps"]) for axis in "xyz"])[:2]


def seen_people(out, truth):
    turn, shift = alignment(read_tum(out / "trajectory_live.txt"), truth.camera)
    people = {}
    for row in read_table(out / "objects.csv"):
        if row["class"] == "person" and int(row["missing_frames"]) <= LIVE_FRAMES:
            people.setdefault(micros(row["stamp"]), []).append(Seen(row, turn, shift))
    return people


def matches(truth, people):
    """(stamp, person, Seen) of each frame, and how often a person got another number."""
    number, found, switches = {}, [], 0
    for stamp in truth.stamps:
        seen = people.get(stamp, [])
        cost = np.full((len(truth.path), len(seen)), 1e3)
        for i, person in enumerate(truth.path):
            for j, one in enumerate(seen):
                apart = np.linalg.norm(one.body - truth.at(person, stamp))
                if apart < GATE_M:
                    cost[i, j] = apart - (1 if number.get(person) == one.id else 0)
        for i, j in zip(*linear_sum_assignment(cost)) if seen else []:
            if cost[i, j] > GATE_M:
                continue
            person = list(truth.path)[i]
            switches += number.get(person, seen[j].id) != seen[j].id
            number[person] = seen[j].id
            if person in truth.shown[stamp]:
                found.append((stamp, person, seen[j]))
    return found, switches


def judged(sequence, out):
    truth = Truth(sequence)
    found, switches = matches(truth, seen_people(out, truth))
    errors = {name: [] for name in ("now_m", "soon_m", "standing_m", "walking_on_m", "now_nees", "soon_nees")}
    for stamp, person, one in found:
        off = one.body - truth.at(person, stamp)
        errors["now_m"].append(np.linalg.norm(off))
        errors["now_nees"].append(off @ np.linalg.solve(one.body_covariance, off))
        then = truth.after_a_second(person, stamp)
        if then is None:
            continue
        off = one.soon - then
        errors["soon_m"].append(np.linalg.norm(off))
        errors["soon_nees"].append(off @ np.linalg.solve(one.soon_covariance, off))
        errors["standing_m"].append(np.linalg.norm(one.body - then))
        errors["walking_on_m"].append(np.linalg.norm(one.body + one.velocity - then))
    spans = (truth.stamps[-1] - truth.stamps[0]) / (20 * SECOND_US) * len(truth.path)
    shown = sum(len(who) for who in truth.shown.values())
    return {"found": len(found) / shown, "switches": switches, "switches_per_person_20s": switches / spans,
            "soon_in_95": float(np.mean(np.array(errors["soon_nees"]) < CHI2_95)),
            **{name: {"median": float(np.median(of)), "mean": float(np.mean(of)), "p90": float(np.quantile(of, 0.9))}
               for name, of in errors.items()}}


def run(options, world, seed):
    with tempfile.TemporaryDirectory() as folder:
        sequence = (options.keep or Path(folder)) / f"{Path(world).stem}_{seed}"
        if not (sequence / "simulation.json").exists():
            subprocess.run([options.ygslam, "simulate", world, "--out", sequence, "--seed", str(seed), "--truth",
                            "--quiet"], check=True)
        out = Path(folder) / "out"
        subprocess.run([options.ygslam, "run", sequence, "--out", out, "--segmenter", options.segmenter,
                        "--deterministic", "--quiet"], check=True)
        return {"world": Path(world).stem, "seed": seed, **judged(sequence, out)}


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--worlds", nargs="+", default=WORLDS)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--segmenter", default="builtin")
    parser.add_argument("--keep", type=Path, help="folder of rendered worlds")
    options = parser.parse_args()
    jobs = {(Path(world).stem, seed): (lambda world=world, seed=seed: run(options, world, seed))
            for world in options.worlds for seed in range(1, options.seeds + 1)}
    table = []
    for line in measured(options.results, lambda one: (one["world"], one["seed"]), jobs):
        def pair(name, line=line):
            return f"{line[name]['median']:.3f}, {line[name]['p90']:.3f}"
        table.append([f"{line['world']}, {line['seed']}", f"{line['found']:.2f}", pair("now_m"), pair("soon_m"),
                      pair("standing_m"), pair("walking_on_m"),
                      f"{line['soon_nees']['mean']:.1f}, {line['soon_in_95']:.2f}",
                      f"{line['switches']} ({line['switches_per_person_20s']:.1f})"])
    print_table(["world, seed", "found", "place now [m]: median, 90 %", "in 1 s", "standing", "walking on",
                 "NEES in 1 s: mean; within 95 %", "switches (a person, 20 s)"], table)


if __name__ == "__main__":
    main()
