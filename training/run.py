#!/usr/bin/env python3
"""From nothing to the weights: renders frames, trains, exports, quantises, and says how well it went.

    training/run.py --ygslam build/release/ygslam [--work out/people] [--frames N] [--samples N]

Whatever was finished by an earlier call is not done again: stop it and call it again as often as you
like. Needs Python alone; PyTorch and the like go into --environment. What comes out: WORK/people.onnx, the
same in int8 (WORK/people_int8.xml, .bin) and WORK/people.json, which says how they were made and what they
reached on rendered frames that they were not trained on.
"""
import argparse
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tools"))
sys.dont_write_bytecode = True

from throwaway_env import ToolError, environment, fail_in_one_line, run  # noqa: E402

PER_FOLDER = 2000
SEED_OF_VALIDATION = 9001


def lines(folder):
    file = folder / "frames.csv"
    return len(file.read_text(encoding="utf-8").splitlines()) - 1 if file.exists() else 0


def rendered(a, folder, seed, count):
    """A folder with this many random frames."""
    if lines(folder) < count:
        run([a.ygslam, "simulate", "--random", count, "--seed", seed, "--out", folder, "--size", "320x240",
             "--threads", a.threads, "--quiet"], f"rendering {folder}")
        (folder / "frames.bin").unlink(missing_ok=True)
    return folder


def parse_arguments(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ygslam", type=Path, default=HERE.parent / "build/release/ygslam")
    parser.add_argument("--work", type=Path, default=Path("out/people"))
    parser.add_argument("--environment", type=Path, default=HERE.parent / "build/training-env")
    parser.add_argument("--frames", type=int, default=30_000)
    parser.add_argument("--validation-frames", type=int, default=300)
    parser.add_argument("--samples", type=int, default=900_000)
    parser.add_argument("--coarse", type=int, help="of them a quarter as large (default: two of three)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    a = parser.parse_args(arguments)
    a.coarse = a.samples * 2 // 3 if a.coarse is None else a.coarse
    if min(a.frames, a.samples, a.validation_frames) < 1 or not 0 <= a.coarse <= a.samples:
        parser.error("--frames and --samples must be positive, --coarse no more than --samples")
    return a


def main(arguments=None):
    a = parse_arguments(arguments)
    if not a.ygslam.exists():
        raise ToolError(f"{a.ygslam}: no such program, build it first")
    folders = []
    for k in range(-(-a.frames // PER_FOLDER)):
        count = min(PER_FOLDER, a.frames - k * PER_FOLDER)
        folders.append(rendered(a, a.work / f"frames-{k:02}", 1000 * a.seed + k, count))
    held_out = rendered(a, a.work / "validation", SEED_OF_VALIDATION, a.validation_frames)
    with environment(a.environment) as python:
        if subprocess.run([python, "-c", "import torch, onnx, openvino, nncf, PIL"], capture_output=True).returncode:
            run([python, "-m", "pip", "install", "--quiet", "-r", HERE / "requirements.txt"], "installing PyTorch")
        run([python, HERE / "train.py", "--frames", *folders, "--validation", held_out, "--out", a.work,
             "--samples", a.samples, "--coarse", a.coarse, "--seed", a.seed, "--threads", a.threads,
             "--validation-frames", a.validation_frames,
             "--log-steps", min(400, max(1, a.samples // 32))], "training")
        model = a.work / "people.onnx"
        run([python, HERE / "export.py", "--checkpoint", a.work / "checkpoint.pt", "--out", model,
             "--note", f"ygslam {revision()},"], "exporting")
        quantised = a.work / "people_int8.xml"
        run([python, HERE / "quantize.py", "--model", model, "--frames", *folders, "--validation", held_out,
             "--validation-frames", a.validation_frames, "--out", quantised], "quantising")
    log = (a.work / "log.jsonl").read_text(encoding="utf-8").splitlines()
    card = {"command": f"training/run.py --frames {a.frames} --samples {a.samples} --coarse {a.coarse} --seed {a.seed}",
            "revision": revision(), "last": json.loads(log[-1]),
            "sha256": hashlib.sha256(model.read_bytes()).hexdigest(),
            "openvino": json.loads(quantised.with_suffix(".json").read_text(encoding="utf-8"))}
    (a.work / "people.json").write_text(json.dumps(card, indent=2) + "\n", encoding="utf-8")
    print(f"{model}: overlap (IoU) {card['openvino']['f32']} on rendered frames it has not seen,"
          f" {card['openvino']['int8']} in int8")
    return 0


def revision():
    done = subprocess.run(["git", "-C", HERE, "describe", "--always", "--dirty"], capture_output=True, text=True,
                          check=False)
    return done.stdout.strip() or "unknown"


if __name__ == "__main__":
    sys.exit(fail_in_one_line(main))
