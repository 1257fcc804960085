#!/usr/bin/env python3
"""Makes an int8 model of a YOLO-seg network, calibrated on the user's own images.

Post-training quantisation by NNCF, in a Python environment made for the purpose and thrown away.
Writes OpenVINO IR: FILE_int8.xml and FILE_int8.bin beside the model. No labels are needed; thirty to
a hundred images like those the robot will see, some with people, are enough.
"""

import argparse
import re
import sys
import tempfile
from pathlib import Path

from throwaway_env import ToolError, environment, fail_in_one_line, install, move_into_place, run

IMAGE_TYPES = {".jpg", ".jpeg", ".png", ".ppm", ".bmp", ".webp"}
OPEN_SIZE = (480, 640)  # used where the model leaves its input size open
GREY = 114


def positive(text):
    """A number above 0."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return value


def parse_arguments(arguments=None):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", type=Path, required=True, metavar="FILE", help="ONNX or .xml")
    parser.add_argument(
        "--images",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder of images (of a TUM sequence, its rgb/ is taken)",
    )
    parser.add_argument("--count", type=positive, default=60, help="images to use, evenly spread")
    parser.add_argument("--out", type=Path, metavar="FILE.xml", help="default FILE_int8.xml")
    parser.add_argument("--env", type=Path, metavar="DIR", help="keep the environment here")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.out is None:
        options.out = options.model.with_name(f"{options.model.stem}_int8.xml")
    if options.out.suffix != ".xml":
        parser.error("--out must end in .xml")
    return options


def calibration_images(folder, count):
    """Up to `count` images, evenly spread over the sorted names."""
    place = folder / "rgb" if (folder / "rgb").is_dir() else folder
    if not place.is_dir():
        raise ToolError(f"{folder}: no such folder")
    files = sorted(f for f in place.rglob("*") if f.suffix.lower() in IMAGE_TYPES)
    if not files:
        raise ToolError(f"{place}: holds no images")
    count = min(count, len(files))
    return [files[i * len(files) // count] for i in range(count)]


def network_input(file, height, width):
    """One image as the network takes it: letterboxed, planar, 0..1."""
    import numpy as np  # pylint: disable=import-outside-toplevel
    from PIL import Image  # pylint: disable=import-outside-toplevel

    try:
        image = Image.open(file).convert("RGB")
    except OSError as error:
        raise ToolError(f"{file}: cannot be read as an image") from error
    scale = min(width / image.width, height / image.height)
    inner = (max(1, round(image.width * scale)), max(1, round(image.height * scale)))
    box = Image.new("RGB", (width, height), (GREY, GREY, GREY))
    resized = image if inner == image.size else image.resize(inner, Image.Resampling.BILINEAR)
    box.paste(resized, ((width - inner[0]) // 2, (height - inner[1]) // 2))
    return (np.asarray(box, np.float32) / 255.0).transpose(2, 0, 1)[None]


def head_scope(network):
    """The arithmetic after the last convolutions: pixel boxes beside scores below 1 in one tensor,
    of which 8 bits would leave nothing. Stays float, as in Ultralytics' own int8 export."""
    import nncf  # pylint: disable=import-outside-toplevel

    names = [op.get_friendly_name() for op in network.get_ops()]
    layers = [int(m.group(1)) for name in names if (m := re.match(r"/model\.(\d+)/", name))]
    if not layers:
        return nncf.IgnoredScope(types=["Sigmoid"], validate=False)
    head = rf".*/model\.{max(layers)}/(Add|Sub|Mul|Div|Sigmoid|dfl).*"
    return nncf.IgnoredScope(patterns=[head], types=["Sigmoid"], validate=False)


def is_quantised(network):
    """Whether there is 8-bit arithmetic in a network."""
    return any(op.get_type_name() == "FakeQuantize" for op in network.get_ops())


def to_int8(network, inputs, ignored_scope=None):
    """Post-training quantisation, calibrated on these inputs."""
    import nncf  # pylint: disable=import-outside-toplevel

    return nncf.quantize(
        network,
        nncf.Dataset(inputs),
        preset=nncf.QuantizationPreset.MIXED,
        subset_size=len(inputs),
        ignored_scope=ignored_scope,
    )


END_VALUES = 38  # of a detection of an end-to-end network; its score is the fifth
PROTOTYPES = 32


def is_yolo(network):
    """Whether the outputs are a YOLO-seg network's: rows of detections, prototypes."""
    shapes = [output.get_partial_shape() for output in network.outputs]
    return (
        len(shapes) == 2
        and len(shapes[0]) == 3
        and len(shapes[1]) == 4
        and shapes[1][1] == PROTOTYPES
    )


def best_score(detections):
    """The best class score of one image's detections, of either kind of YOLO."""
    if detections.shape[-1] == END_VALUES:
        return float(detections[0, :, 4].max())
    return float(detections[0, 4:-PROTOTYPES].max())


def best_scores(compiled, inputs):
    """The best class score of each image."""
    return [best_score(compiled(x)[0]) for x in inputs]


def quantize_inside(options):
    """Runs inside the environment: model to int8 IR in the folder options.inside."""
    import openvino as ov  # pylint: disable=import-outside-toplevel

    try:
        # convert_model also simplifies; of the raw graph NNCF would quantise shape arithmetic and
        # miss that x * sigmoid(x) is one operation, at half the speed.
        network = ov.convert_model(options.model)
    except Exception as error:  # pylint: disable=broad-exception-caught
        raise ToolError(f"{options.model}: cannot be read as a network") from error
    shape = network.input().get_partial_shape()
    if shape.rank.is_dynamic or len(shape) != 4 or not is_yolo(network):
        raise ToolError(f"{options.model}: not a YOLO-seg export (others are not quantised)")
    if is_quantised(network):
        raise ToolError(f"{options.model}: is quantised already")
    height, width = (
        d.get_length() if d.is_static else size for d, size in zip(list(shape)[2:], OPEN_SIZE)
    )
    if shape.is_dynamic:
        network.reshape([1, 3, height, width])
    files = calibration_images(options.images, options.count)
    inputs = [network_input(file, height, width) for file in files]
    quantized = to_int8(network, inputs, head_scope(network))
    few = inputs[:: max(1, len(inputs) // 10)]
    before = best_scores(ov.compile_model(network, "CPU"), few)
    after = best_scores(ov.compile_model(quantized, "CPU"), few)
    loss = sum(abs(a - b) for a, b in zip(before, after)) / len(few)
    print(f"best scores differ by {loss:.3f} on average over {len(few)} images")
    ov.save_model(quantized, options.inside / "quantized.xml", compress_to_fp16=False)
    return 0


def quantize(options):
    """Everything: checks, environment, quantisation. Prints the model's path on stdout."""
    if not options.model.is_file():
        raise ToolError(f"{options.model}: no such model file")
    files = calibration_images(options.images, options.count)
    print(f"calibrating on {len(files)} images", file=sys.stderr)
    with tempfile.TemporaryDirectory(prefix="ygslam-quantize-") as folder:
        work = Path(folder)
        with environment(options.env) as python:
            install(python, "requirements-quantize.txt")
            command = [python, Path(__file__).resolve(), "--inside", work]
            command += ["--model", options.model, "--images", options.images]
            command += ["--count", options.count, "--out", options.out]
            run(command, "the quantisation")
        move_into_place(work / "quantized.bin", options.out.with_suffix(".bin"))
        move_into_place(work / "quantized.xml", options.out)
    print(options.out)
    return 0


def main():
    """Command line, or the part that runs inside the environment."""
    options = parse_arguments()
    return quantize_inside(options) if options.inside else quantize(options)


if __name__ == "__main__":
    sys.exit(fail_in_one_line(main))
