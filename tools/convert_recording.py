#!/usr/bin/env python3
"""Convert a recording that ygslam does not read itself into an MCAP recording that it reads.

    tools/convert_recording.py scene0000_00.sens room.mcap
    tools/convert_recording.py scene0000_00.sens - | ygslam run - --out DIR

Kinds, told apart by their content: .sens (ScanNet), .r3d (Record3D), .mkv (Azure Kinect SDK), .bag
(RealSense SDK). Colour and depth are written as they are, each with its own camera, and on /tf_static
where the depth camera is.

All four were tried only with files that the tests make after the published formats, never with a
real recording. Needs NumPy, mcap and rosbags; .r3d also pyliblzfse.
Exit codes: 0 ok, 1 not converted, 2 usage.
"""
import argparse
import importlib
import os
import pathlib
import signal
import stat
import sys
import tempfile

from recordings import Fault

# Module of each kind, and how its files begin.
KINDS = {"record3d": b"PK\x03\x04", "azure_kinect": b"\x1a\x45\xdf\xa3", "realsense": b"#ROSBAG V2.0",
         "sens": b"\x04\x00\x00\x00"}
MCAP_MAGIC = b"\x89MCAP0\r\n"
REMEDIES = {"liblzfse": "pip install pyliblzfse"}
REMEDY = "pip install -r tools/requirements-tools.txt"


def kind_of(path):
    with open(path, "rb") as file:
        start = file.read(16)
    for kind, magic in KINDS.items():
        if start.startswith(magic):
            return kind
    raise Fault("is no recording of .sens, .r3d, .mkv or .bag" if start else "is empty")


def load(name):
    """A module of `recordings`, or a Fault that names the package it lacks."""
    try:
        return importlib.import_module("recordings." + name)
    except ModuleNotFoundError as missing:
        package = (missing.name or "").partition(".")[0]
        raise Fault(f"needs the Python package {package}: "
                    f"{REMEDIES.get(package, REMEDY)}") from missing


def write(path, out, chunked):
    recording = load(kind_of(path)).open_recording(path)
    for note in recording.notes:
        print(f"convert_recording: {path}: {note}", file=sys.stderr)
    return load("mcap_output").write_mcap(out, recording, chunked)


def is_replaceable(target):
    """An earlier recording or an empty file is; anything else may be somebody's only copy."""
    if not target.is_file():
        return False
    with open(target, "rb") as file:
        start = file.read(len(MCAP_MAGIC))
    return start in (b"", MCAP_MAGIC)


def write_file(path, target):
    """Complete under its name, or not there at all."""
    if target.exists() and (target.samefile(path) or not is_replaceable(target)):
        raise Fault(f"{target} is there and no recording of MCAP; it is not replaced")
    descriptor, name = tempfile.mkstemp(dir=target.parent, prefix=target.name + ".")
    try:
        with os.fdopen(descriptor, "wb") as out:
            frames = write(path, out, chunked=True)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)  # mkstemp's are for the owner alone
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise
    return frames


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=pathlib.Path, help="the file of the camera's own software")
    parser.add_argument("out", metavar="OUT", help="MCAP file to write, or - for standard output")
    args = parser.parse_args()
    to_pipe = args.out == "-"
    if to_pipe and sys.stdout.isatty():
        parser.error("standard output is a terminal: end with `| ygslam run - --out DIR`")
    if to_pipe:  # a reader that has enough ends this quietly, as it does `cat`
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        if not stat.S_ISREG(args.recording.stat().st_mode):
            raise Fault("is no regular file")
        frames = (write(args.recording, sys.stdout.buffer, chunked=False) if to_pipe
                  else write_file(args.recording, pathlib.Path(args.out)))
    except OSError as error:
        name = error.filename if error.filename is not None else args.recording
        sys.exit(f"error: {name}: {error.strerror or error}")
    except Fault as fault:
        sys.exit(f"error: {args.recording}: {fault}")
    except KeyboardInterrupt:
        sys.exit(130)
    print(f"convert_recording: {args.recording}: {frames} pairs of images", file=sys.stderr)


if __name__ == "__main__":
    main()
