#!/usr/bin/env python3
"""Exports YOLOv8n-seg to ONNX in a Python environment made for the purpose and thrown away.

The trained weights come from Ultralytics' public releases; `--weights untrained` builds the same
network with random weights, which detects nothing but takes the same path.
"""

import argparse
import os
import shutil
import sys
import tempfile
import urllib.error
import urllib.request
from pathlib import Path

from throwaway_env import ToolError, environment, fail_in_one_line, install, move_into_place, run

WEIGHTS_URL = "https://github.com/ultralytics/assets/releases/download/v8.3.0/yolov8n-seg.pt"
NETWORK = "yolov8n-seg"
OPSET = 17
NOTICE = """\
Notice: YOLOv8 and its weights are Ultralytics', licensed under AGPL-3.0 (or an Ultralytics
enterprise licence). They are no part of this project, which is Apache-2.0 and does not ship them.
What you do with the exported model is under that licence: https://ultralytics.com/license
"""


def image_size(text):
    """HEIGHTxWIDTH, both multiples of 32."""
    try:
        height, width = (int(part) for part in text.lower().split("x"))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not HEIGHTxWIDTH") from error
    for side in (height, width):
        if side % 32 or not 32 <= side <= 2048:
            raise argparse.ArgumentTypeError(f"{side} is not a multiple of 32 up to 2048")
    return height, width


def parse_arguments(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--weights",
        default="trained",
        metavar="FILE|trained|untrained",
        help="a YOLOv8-seg .pt file, the published ones (default), or random ones",
    )
    parser.add_argument("--size", type=image_size, default=(480, 640), metavar="HxW")
    parser.add_argument("--dynamic", action="store_true", help="leave the input size open")
    parser.add_argument("--out", type=Path, default=Path("models"), metavar="DIR")
    parser.add_argument("--env", type=Path, metavar="DIR", help="keep the environment here")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def output_name(arguments):
    """File name of the exported model."""
    given = {"trained": NETWORK, "untrained": f"{NETWORK}-untrained"}
    stem = given.get(arguments.weights) or Path(arguments.weights).stem
    size = "dynamic" if arguments.dynamic else "{}x{}".format(*arguments.size)
    return f"{stem}_{size}.onnx"


def fetch_weights(target, url=WEIGHTS_URL):
    """Downloads the published weights to `target`."""
    print(f"fetching {url}", file=sys.stderr)
    try:
        with urllib.request.urlopen(url, timeout=30) as answer:
            content = answer.read()
    except (urllib.error.URLError, OSError) as error:
        reason = getattr(error, "reason", error)
        raise ToolError(
            f"cannot download the trained weights ({reason}); with a copy of "
            f"{NETWORK}.pt run again with --weights FILE"
        ) from error
    if not content.startswith(b"PK"):
        raise ToolError(f"{url}: what came is not a weights file")
    target.write_bytes(content)


def export_inside(arguments):
    """Runs inside the environment: weights to ONNX in the folder arguments.inside."""
    from ultralytics import YOLO  # pylint: disable=import-outside-toplevel

    network = YOLO(f"{NETWORK}.yaml" if arguments.weights == "untrained" else arguments.weights)
    if network.task != "segment":
        raise ToolError(f"{arguments.weights}: not a segmentation network")
    exported = network.export(
        format="onnx",
        imgsz=list(arguments.size),
        opset=OPSET,
        simplify=True,
        dynamic=arguments.dynamic,
    )
    move_into_place(Path(exported), arguments.inside / "exported.onnx")
    return 0


def prepare_weights(arguments, work):
    """What the exporter is given as weights: a file, or "untrained"."""
    if arguments.weights == "untrained":
        return arguments.weights
    if arguments.weights == "trained":
        fetch_weights(work / f"{NETWORK}.pt")
        return work / f"{NETWORK}.pt"
    try:  # a copy, for the exporter writes beside its weights
        return Path(shutil.copy(arguments.weights, work / f"{NETWORK}.pt"))
    except OSError as error:
        raise ToolError(f"{arguments.weights}: {error.strerror}") from error


def export(arguments):
    """Everything: notice, weights, environment, export. Prints the model's path on stdout."""
    print(NOTICE, file=sys.stderr)
    if not (3, 10) <= sys.version_info[:2] <= (3, 13):
        raise ToolError("the exporter needs Python 3.10 to 3.13 (run this script with such a one)")
    with tempfile.TemporaryDirectory(prefix="ygslam-export-") as folder:
        work = Path(folder)
        weights = prepare_weights(arguments, work)
        with environment(arguments.env) as python:
            print("installing PyTorch and the exporter (a while)", file=sys.stderr)
            install(python, "requirements-torch.txt")
            install(python, "requirements-export.txt")
            install(python, "requirements-ultralytics.txt", "--no-deps")
            command = [python, Path(__file__).resolve(), "--inside", work, "--weights", weights]
            command += ["--size", "{}x{}".format(*arguments.size)]
            command += ["--dynamic"] if arguments.dynamic else []
            quiet = {"YOLO_CONFIG_DIR": folder, "YOLO_AUTOINSTALL": "false", "YOLO_OFFLINE": "true"}
            run(command, "the export", cwd=work, env={**os.environ, **quiet})
        target = arguments.out / output_name(arguments)
        move_into_place(work / "exported.onnx", target)
    print(target)
    return 0


def main():
    """Command line, or the part that runs inside the environment."""
    arguments = parse_arguments()
    return export_inside(arguments) if arguments.inside else export(arguments)


if __name__ == "__main__":
    sys.exit(fail_in_one_line(main))
