#!/usr/bin/env python3
"""Exports a segmentation network to ONNX in a Python environment made for it and thrown away.

The trained weights come from their makers' public releases; `--weights untrained` builds the same
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

import export_inside
from export_networks import DEFAULT, NETWORKS, PYTHONS, REQUIREMENTS, table
from throwaway_env import ToolError, environment, fail_in_one_line, install, move_into_place, run


def image_size(text):
    """HEIGHTxWIDTH, each 32 to 2048."""
    try:
        height, width = (int(part) for part in text.lower().split("x"))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not HEIGHTxWIDTH") from error
    for side in (height, width):
        if not 32 <= side <= 2048:
            raise argparse.ArgumentTypeError(f"{side} is not in 32 to 2048")
    return height, width


def network_name(text):
    """A name of the table."""
    if text not in NETWORKS:
        raise argparse.ArgumentTypeError(f"'{text}' is none of the networks that --help lists")
    return text


def parse_arguments(arguments=None):
    """The command line; `network` and `size` are filled in."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0],
        epilog=table(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--model", type=network_name, default=DEFAULT, metavar="NAME")
    parser.add_argument(
        "--weights",
        default="trained",
        metavar="FILE|trained|untrained",
        help="a weights file of that network, the published ones (default), or random ones",
    )
    parser.add_argument(
        "--size",
        type=image_size,
        metavar="HxW",
        help="of the input; default 480x640, for rfdetr-seg the network's own square",
    )
    parser.add_argument(
        "--dynamic", action="store_true", help="leave the input size open (yolo networks)"
    )
    parser.add_argument("--out", type=Path, default=Path("models"), metavar="DIR")
    parser.add_argument("--env", type=Path, metavar="DIR", help="keep the environment here")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    options.network = NETWORKS[options.model]
    if options.dynamic and not options.network.has_open_size:
        parser.error(f"--dynamic: {options.model} is exported with a fixed input size")
    if options.size is None:
        options.size = options.network.default_size
    elif options.network.default_size is not None and any(side % 32 for side in options.size):
        parser.error(f"--size: {options.model} takes multiples of 32")
    return options


def output_name(arguments):
    """File name of the exported model."""
    given = {"trained": arguments.model, "untrained": f"{arguments.model}-untrained"}
    stem = given.get(arguments.weights) or Path(arguments.weights).stem
    if arguments.size is None:
        return f"{stem}.onnx"
    size = "dynamic" if arguments.dynamic else "{}x{}".format(*arguments.size)
    return f"{stem}_{size}.onnx"


def fetch_weights(target, url):
    """Downloads published weights to `target`."""
    print(f"fetching {url}", file=sys.stderr)
    try:
        with urllib.request.urlopen(url, timeout=30) as answer:
            content = answer.read()
    except (urllib.error.URLError, OSError) as error:
        reason = getattr(error, "reason", error)
        raise ToolError(
            f"cannot download the trained weights ({reason}); with a copy of "
            f"{url.rsplit('/', 1)[-1]} run again with --weights FILE"
        ) from error
    if not content.startswith(b"PK"):
        raise ToolError(f"{url}: what came is not a weights file")
    target.write_bytes(content)


def prepare_weights(arguments, work):
    """What the exporter is given as weights: a file, "untrained", or "trained" where it downloads
    them itself."""
    if arguments.weights == "untrained":
        return arguments.weights
    url = arguments.network.weights_url
    if arguments.weights == "trained" and not url:
        return arguments.weights
    target = work / f"{arguments.model}{Path(url or arguments.weights).suffix}"
    if arguments.weights == "trained":
        fetch_weights(target, url)
        return target
    try:  # a copy, for an exporter writes beside its weights
        return Path(shutil.copy(arguments.weights, target))
    except OSError as error:
        raise ToolError(f"{arguments.weights}: {error.strerror}") from error


def check_python(arguments, version=sys.version_info[:2]):
    """The exporters are made for some versions of Python."""
    low, high = PYTHONS[arguments.network.maker]
    if not (3, low) <= tuple(version) <= (3, high):
        raise ToolError(
            f"exporting {arguments.model} needs Python 3.{low} to 3.{high} "
            "(run this script with such a one)"
        )


def inner_command(python, arguments, weights, work):
    """What is run inside the environment."""
    command = [python, Path(__file__).resolve(), "--inside", work, "--model", arguments.model]
    command += ["--weights", weights]
    if arguments.size is not None:
        command += ["--size", "{}x{}".format(*arguments.size)]
    return command + (["--dynamic"] if arguments.dynamic else [])


def export(arguments):
    """Everything: notice, weights, environment, export. Prints the model's path on stdout."""
    print(arguments.network.notice, file=sys.stderr)
    check_python(arguments)
    with tempfile.TemporaryDirectory(prefix="ygslam-export-") as folder:
        work = Path(folder)
        weights = prepare_weights(arguments, work)
        with environment(arguments.env) as python:
            print("installing PyTorch and the exporter (a while)", file=sys.stderr)
            for requirements, *pip_options in REQUIREMENTS[arguments.network.maker]:
                install(python, requirements, *pip_options)
            quiet = {"YOLO_CONFIG_DIR": folder, "YOLO_AUTOINSTALL": "false", "YOLO_OFFLINE": "true"}
            command = inner_command(python, arguments, weights, work)
            run(command, "the export", cwd=work, env={**os.environ, **quiet})
        target = arguments.out / output_name(arguments)
        move_into_place(work / "exported.onnx", target)
    print(target)
    return 0


def inside(arguments):
    """Runs inside the environment: weights to `exported.onnx` in the folder arguments.inside."""
    exported = export_inside.export(
        arguments.network, arguments.weights, arguments.size, arguments.dynamic, arguments.inside
    )
    move_into_place(exported, arguments.inside / "exported.onnx")
    return 0


def main():
    """Command line, or the part that runs inside the environment."""
    arguments = parse_arguments()
    return inside(arguments) if arguments.inside else export(arguments)


if __name__ == "__main__":
    sys.exit(fail_in_one_line(main))
