"""Screens that play videos, before and after: ATE over sizes, contents, camera paths and seeds.

    .venv/bin/python bench/screens.py screens.jsonl --ygslam build/release/ygslam

Each world is rendered (320x240, 15 frames/s, 12 s) and run with the built-in network, as it is and without the part
that finds screens; a line of JSON a world, so that it can be stopped and goes on.
"""
import json
import subprocess
import tempfile
from pathlib import Path

from matrix import measured, parser_of, print_table

WORLD = """seconds: 12
fps: 15
layout: office
camera: {{path: {path}, at: [0, -1.9, 1.4], look_at: [0, 1.5, 0.9]}}
furniture: [{{kind: monitor, variant: {variant}, at: [0, -0.4, {low}], size: [{width}, 0.05, {height}]}}]
"""
SIZES = {"9 %": (0.6, 0.36, 0.75), "35 %": (1.2, 0.7, 0.4), "66 %": (1.6, 1.0, 0.5), "all": (2.4, 1.5, 0.4)}
# Hundreds of the variant: what the video does; tens: which pictures; 9: it is a video.
CONTENTS = {"pan": 9, "pan, other pictures": 29, "slow pan": 109, "scroll": 209, "cuts": 309, "zoom": 409,
            "slow scroll": 509, "still picture": 8, "screen off": 1}
ROWS = [("9 %", "pan", "xyz"), *[("35 %", content, "xyz") for content in CONTENTS],
        *[("35 %", content, path) for path in ("static", "halfsphere", "rpy")
          for content in ("pan", "scroll", "still picture")],
        ("66 %", "pan", "xyz"), ("all", "pan", "xyz"), ("all", "still picture", "xyz")]


def run(ygslam, row, seed):
    size, content, path = row
    width, height, low = SIZES[size]
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        world = folder / "world.yaml"
        world.write_text(WORLD.format(path=path, variant=CONTENTS[content], low=low, width=width, height=height), "utf-8")
        subprocess.run([ygslam, "simulate", world, "--out", folder / "S", "--size", "320x240", "--seed", str(seed),
                        "--quiet"], check=True)
        with_it = measure(ygslam, folder, [])
        without = measure(ygslam, folder, ["--set", "run.without=[screens]"])
    return {"row": row, "seed": seed, **with_it, "ate_without_m": without["ate_m"]}


def measure(ygslam, folder, options):
    subprocess.run([ygslam, "run", folder / "S", "--out", folder / "out", "--segmenter", "builtin", "--deterministic",
                    "--quiet", *options], check=False)
    metrics = json.loads((folder / "out" / "metrics.json").read_text("utf-8"))
    return {"ate_m": metrics["ate"]["rmse"], "coverage": metrics["coverage"]}


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    args = parser.parse_args()
    jobs = {(row, seed): (lambda row=row, seed=seed: run(args.ygslam, row, seed))
            for row in ROWS for seed in range(1, args.seeds + 1)}
    lines = measured(args.results, lambda line: (tuple(line["row"]), line["seed"]), jobs)
    table = []
    for row in ROWS:
        runs = [line for line in lines if tuple(line["row"]) == row]
        ates = sorted(1000 * line["ate_m"] for line in runs)
        without = sorted(1000 * line["ate_without_m"] for line in runs)
        table.append([", ".join(row), f"{ates[len(ates) // 2]:.1f} ({ates[0]:.1f} to {ates[-1]:.1f})",
                      f"{min(line['coverage'] for line in runs):.2f}", f"{without[len(without) // 2]:.1f}"])
    print_table(["screen, shows, camera path", "ATE [mm]", "coverage", "without the part"], table)


if __name__ == "__main__":
    main()
