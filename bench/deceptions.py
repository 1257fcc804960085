#!/usr/bin/env python3
"""What images do to the pose that show something besides the world: text, a bonnet, dirt on the lens.

    .venv/bin/python bench/deceptions.py RESULTS.jsonl --ygslam build/release/ygslam SEQUENCE [SEQUENCE ...]
    .venv/bin/python bench/deceptions.py RESULTS.jsonl          # the table of what is there

Every kind is painted into a copy of each recording, at each strength and with each seed, and run in each mode;
a run is a line of RESULTS, and one whose line is there is not repeated. Right is an error within 1.5 times that
of the clean recording, or lost and said so. The table has, for each kind and mode, the median ATE and its worst
[mm], the least share of frames with a pose, and the share of the image that the run took for the camera's own.

A kind is a function of KINDS: image and depth [m] of one frame, its number, strength and a random generator of
the seed, which it may change in place. --keep writes the painted recordings to a folder and leaves them there.
"""
import functools
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFilter, ImageFont

from matrix import measured, parser_of, print_table
from rendered_seeds import read_calibration

BONNET_M = 0.45      # from the camera, as far as that of a robot on wheels


def clean(image, depth, frame, strength, rng):
    """As recorded."""


def text(image, depth, frame, strength, rng):
    """A line of date and time at the top left; at strength 1 a twentieth of the height."""
    height = image.shape[0]
    size = max(8, round(0.05 * strength * height))
    picture = Image.fromarray(image)
    seconds = frame // 30  # the last digits change as those of a camera's clock do
    line = f"CAM 01  2024-05-17  13:{24 + seconds // 60:02d}:{seconds % 60:02d}"
    ImageDraw.Draw(picture).text((height // 48, height // 60), line, fill=(255, 255, 255),
                                 font=ImageFont.load_default(size))
    image[:] = np.asarray(picture)


@functools.cache
def painted_bonnet(width, rows, seed):
    """Metal with a shade, seams and bolts: what a robot sees of itself."""
    rng = np.random.default_rng(seed)
    shade = np.repeat(np.linspace(70, 120, rows)[:, None], width, 1)[..., None] * [0.9, 1.0, 1.1]
    picture = Image.fromarray(shade.astype(np.uint8))
    draw = ImageDraw.Draw(picture)
    for _ in range(6):
        u = int(rng.integers(width))
        draw.line([(u, 0), (int(u + rng.integers(-rows, rows)), rows)], fill=(30, 30, 35), width=2)
    for _ in range(width // 12):
        u, v, r = int(rng.integers(width)), int(rng.integers(rows)), int(rng.integers(1, 4))
        draw.ellipse([u - r, v - r, u + r, v + r], fill=tuple(int(x) for x in rng.integers(20, 230, 3)))
    return np.asarray(picture.filter(ImageFilter.GaussianBlur(0.7)))


def bonnet(image, depth, frame, strength, rng):
    """The lowest eighth of the image at strength 1, BONNET_M away."""
    rows = round(image.shape[0] * strength / 8)
    image[-rows:] = painted_bonnet(image.shape[1], rows, int(rng.integers(2 ** 31)))
    depth[-rows:] = BONNET_M


def dots(image, depth, frame, strength, rng):
    """60 specks of dirt at strength 1, of 1 to 4 px in an image of 480 rows, with soft edges."""
    height, width = image.shape[:2]
    v, u = np.mgrid[:height, :width]
    for _ in range(round(60 * strength)):
        du, dv = u - rng.uniform(0, width), v - rng.uniform(0, height)
        radius = rng.uniform(1, 4) * height / 480
        dark = np.clip(radius + 0.5 - np.hypot(du, dv), 0, 1) * rng.uniform(0.7, 1)
        image[:] = (image * (1 - dark[..., None]) + 25 * dark[..., None]).astype(np.uint8)


KINDS = {"clean": clean, "text": text, "bonnet": bonnet, "dots": dots}
MODES = {"off": ["--dynamic", "off"], "geometry": ["--dynamic", "geometry"],
         "full": ["--dynamic", "full", "--segmenter", "builtin"]}


def rows_of(path):
    return [line.split() for line in path.read_text().splitlines() if line and line[0] != "#"]


def camera_text(sequence):
    """Its calibration; None of a recording known by its folder's name."""
    file = sequence / "calibration.txt"
    return file.read_text() if file.is_file() else None


def paint(sequence, kind, strength, seed, folder):
    """A copy of the recording with the deception in it, without loss."""
    camera = camera_text(sequence)
    scale = read_calibration(sequence)["depth_scale"] if camera and "depth_scale" in camera else 5000
    for part in ("rgb", "depth"):
        (folder / part).mkdir(parents=True)
    lines = []
    for number, (stamp, colour, depth_stamp, depth_file) in enumerate(rows_of(sequence / "associations.txt")):
        image = np.array(Image.open(sequence / colour).convert("RGB"))
        depth = np.asarray(Image.open(sequence / depth_file)) / scale
        KINDS[kind](image, depth, number, strength, np.random.default_rng(seed))
        names = (f"rgb/{number:06d}.png", f"depth/{number:06d}.png")
        Image.fromarray(image).save(folder / names[0], compress_level=1)
        Image.fromarray(np.rint(depth * scale).astype(np.uint16)).save(folder / names[1], compress_level=1)
        lines.append(f"{stamp} {names[0]} {depth_stamp} {names[1]}\n")
    (folder / "associations.txt").write_text("".join(lines))
    for name in ("groundtruth.txt", "calibration.txt"):
        if (sequence / name).is_file():
            shutil.copy(sequence / name, folder)


def run_once(options, folder, mode, seed):
    """Its figures; only "error" if it failed otherwise than by being lost."""
    with tempfile.TemporaryDirectory(prefix="ygslam-deceptions-") as out:
        live = [] if options.live else ["--deterministic"]
        done = subprocess.run([options.ygslam, "--quiet", "run", str(folder), "--out", out, *live, *MODES[mode],
                               "--seed", str(seed), *(a for s in options.set for a in ("--set", s))],
                              capture_output=True, text=True, check=False)
        if done.returncode not in (0, 7):
            return {"error": done.stderr.strip()}
        metrics = json.loads((Path(out) / "metrics.json").read_text())
    return {"ate_mm": 1e3 * metrics.get("ate", {}).get("rmse", float("nan")), "coverage": metrics["coverage"],
            "camera_fixed_share": metrics.get("camera_fixed_share"),
            "track_cpu_ms": metrics["cpu_ms"]["track"]["mean"]}


def measure(options, sequence, kind, strength, seed):
    """Lines of all modes, since to paint takes as long as to run."""
    with tempfile.TemporaryDirectory(prefix="ygslam-painted-") as scratch:
        folder = Path(scratch) / sequence.resolve().name
        if options.keep:
            folder = options.keep / f"{sequence.resolve().name}_{kind}_{strength:g}_{seed}"
        if not folder.exists():
            paint(sequence, kind, strength, seed, folder)
        return {"sequence": sequence.resolve().name, "kind": kind, "strength": strength, "seed": seed,
                "live": options.live, "set": options.set,
                "modes": {mode: run_once(options, folder, mode, seed) for mode in options.modes}}


def key_of(line):
    return (line["sequence"], line["kind"], line["strength"], line["seed"], line["live"], tuple(line["set"]))


def table(lines, mode):
    """A row for each recording, kind and strength."""
    groups = {}
    for line in lines:
        settings = " ".join(line["set"]) + (" live" if line["live"] else "")
        group = (line["sequence"], line["kind"], line["strength"], settings)
        groups.setdefault(group, []).append(line["modes"].get(mode, {}))
    for (sequence, kind, strength, settings), runs in groups.items():
        good = [run for run in runs if "ate_mm" in run]
        if not good:
            continue
        errors = [run["ate_mm"] for run in good]
        shares = [run["camera_fixed_share"] for run in good if run["camera_fixed_share"] is not None]
        yield [sequence, f"{kind} {strength:g}", mode, settings, f"{statistics.median(errors):.2f}",
               f"{max(errors):.2f}", f"{min(run['coverage'] for run in good):.2f}",
               f"{100 * statistics.median(shares):.1f}" if shares else "", str(len(good))]


def main():
    parser = parser_of(__doc__)
    parser.add_argument("sequences", nargs="*", type=Path)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--strengths", nargs="+", type=float, default=[1.0])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--modes", nargs="+", choices=MODES, default=list(MODES))
    parser.add_argument("--live", action="store_true")
    parser.add_argument("--set", action="append", default=[], help="as of `ygslam run`; may be repeated")
    parser.add_argument("--keep", type=Path)
    options = parser.parse_intermixed_args()
    if options.sequences and not options.ygslam:
        parser.error("--ygslam is missing")
    jobs = {(s.resolve().name, kind, strength, seed, options.live, tuple(options.set)):
            functools.partial(measure, options, s, kind, strength, seed)
            for s in options.sequences for kind in options.kinds for seed in options.seeds
            for strength in (options.strengths if kind != "clean" else [1.0])}
    lines = measured(options.results, key_of, jobs)
    for mode in MODES:
        rows = list(table(lines, mode))
        if rows:
            print_table(["recording", "kind", "mode", "settings", "median [mm]", "worst [mm]", "with a pose",
                         "masked [%]", "runs"], rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
