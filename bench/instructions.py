#!/usr/bin/env python3
"""How many instructions each stage of a run takes, counted by Valgrind: the same on a busy machine.

    .venv/bin/python bench/instructions.py SEQUENCE ... --ygslam build/release/ygslam [--frames 90] [--options "..."]

Runs the first frames with --deterministic under callgrind (some 50 times as long as without). A stage is a function with all
that it calls; those within others stand below them. Processor time of the same stages: bench/budget.py.
"""
import argparse
import collections
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from matrix import print_table

# Of each stage the function that does it, as callgrind names it (without `ygslam::` and parameters).
STAGES = [
    ("tracking: features", "Tracker::look"),
    ("tracking: · ORB", "OrbExtractor::extract"),
    ("tracking: · flow", "track_points"),
    ("tracking: track", "Tracker::step"),
    ("tracking: · motion checks", "Tracker::observe"),
    ("tracking: · · ego-motion", "fit_ego_motion"),
    ("tracking: · · epipolar check", "fit_fundamental"),
    ("tracking: · previous frame", "PoseEstimator::match_previous_frame"),
    ("tracking: · local map", "PoseEstimator::match_map"),
    ("tracking: · the map's say", "PoseSearch::held_against_map"),
    ("tracking: · screens", "PoseSearch::held_against_screens"),
    ("tracking: · free space", "compared_with_map"),
    ("tracking: · objects", "Tracker::follow_objects"),
    ("segmentation: segment", "PeopleSegmenter::segment"),
    ("segmentation: · decode masks", "decode_people"),
    ("reading: decode colour", "decode_colour"),
    ("reading: decode depth", "decode_depth_m"),
    ("dense map: view intake", "DenseMap::add"),
    ("dense map: · undo lens and shutter", "make_depth_view"),
    ("dense map: · pack", "StoredView::StoredView"),
    ("dense map: update a view", "DenseMap::step"),
    ("dense map: · fuse", "FusedVolume::put_in"),
    ("dense map: · take back", "FusedVolume::take_back"),
    ("dense map: · exchange pixels", "FusedVolume::exchange_pixels"),
    ("mapping: insert keyframe", "Mapper::insert"),
    ("mapping: the rest of a keyframe", "Mapper::refine"),
    ("mapping: · bundle adjustment", "adjust_bundle"),
]


class Profile:
    """Of each function its calls and its instructions, with all that it calls."""

    def __init__(self, file):
        self.calls = collections.Counter()
        self.inclusive = collections.Counter()
        names = {}

        def named(text):
            number, name = re.fullmatch(r"(\(\d+\))(?: (.*))?", text).groups()
            if name is not None:
                names[number] = name
            return names[number]
        function, called = None, None
        for line in file.read_text("utf-8", "replace").splitlines():
            if line.startswith("fn="):
                function = named(line[3:])
            elif line.startswith("cfn="):
                called = named(line[4:])
            elif line.startswith("calls="):
                self.calls[called] += int(line[6:].split()[0])
            elif line[:1] in "+-*0123456789" and function is not None:
                self.inclusive[function] += sum(map(int, line.split()[1:2]))  # none: nothing

    def of(self, name):
        """Calls and instructions of a function by its name alone; of overloads the one that takes most."""
        pattern = re.compile(r"ygslam::(\(anonymous namespace\)::)?" + re.escape(name) + r"(\(|\[|$|')")
        found = [function for function in self.inclusive if pattern.match(function)]
        return max(((self.calls[f], self.inclusive[f]) for f in found), key=lambda x: x[1], default=(0, 0))


def counted(arguments, sequence):
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "callgrind.out"
        done = subprocess.run(
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", arguments.ygslam, "run", sequence, "--out",
             Path(folder) / "run", "--deterministic", "--to", str(arguments.frames), *arguments.options.split()],
            capture_output=True, text=True, check=False)
        if done.returncode not in (0, 7):
            sys.exit(f"error: {sequence}: {done.stderr.strip()[-500:]}")
        return Profile(out)


def rows_of(profile, frames):
    for stage, function in STAGES:
        calls, instructions = profile.of(function)
        if calls:
            yield [stage, f"{calls / frames:.2f}", f"{instructions / calls / 1e6:.2f}", f"{instructions / frames / 1e6:.2f}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", type=Path, nargs="+")
    parser.add_argument("--ygslam", required=True)
    parser.add_argument("--frames", type=int, default=90, help="at most as many as the recording has")
    parser.add_argument("--options", default="", help="more words for `ygslam run`")
    arguments = parser.parse_args()
    for sequence in arguments.sequences:
        profile = counted(arguments, sequence)
        print(f"\n{sequence.name}, {arguments.frames} frames\n")
        print_table(["thread: stage", "times a frame", "instructions each time [million]", "a frame [million]"],
                    list(rows_of(profile, arguments.frames)))


if __name__ == "__main__":
    main()
