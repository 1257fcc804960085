"""Shared by the tests of the command line: runs it, makes sequences faulty, reads its files.

The program is $YGSLAM_BINARY, a small rendered sequence with truth masks $YGSLAM_SEQUENCE; without
them build/release/ygslam and a sequence rendered into the temporary folder.
"""
import csv
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
BINARY = os.environ.get("YGSLAM_BINARY", str(ROOT / "build" / "release" / "ygslam"))
FILES = {"trajectory.txt", "trajectory_live.txt", "keyframes.txt", "frames.csv", "objects.csv", "map.ply",
         "loops.csv", "metrics.json", "config.yaml", "log.txt"}
WIDTH, HEIGHT, FRAMES = 320, 240, 60
HANG_S = 300  # far beyond anything a loaded machine needs


def render(folder, *options):
    """Renders the sequence all these tests use."""
    shutil.rmtree(folder, ignore_errors=True)
    subprocess.run([BINARY, "simulate", "walking_xyz", "--out", folder, "--size",
                    f"{WIDTH}x{HEIGHT}", "--seconds", "2", "--truth", "--threads", "1", *options],
                   check=True, timeout=HANG_S, stderr=subprocess.DEVNULL)


def sequence():
    """The clean sequence; not to be written to."""
    given = os.environ.get("YGSLAM_SEQUENCE")
    if given:
        return pathlib.Path(given)
    folder = pathlib.Path(tempfile.gettempdir(), f"ygslam_test_sequence_{os.getuid()}")
    if not (folder / "groundtruth.txt").exists():
        render(folder)
    return folder


def ygslam(*arguments, environment=None, **how):
    """One finished run of the program."""
    how = {"timeout": HANG_S, "errors": "replace", **how}
    return subprocess.run([BINARY, *map(str, arguments)], capture_output=True, text=True,
                          check=False, env={**os.environ, **(environment or {})}, **how)


def png(width, height, channels=1, bits=8, value=0, interlace=0):
    """Bytes of a PNG with one value everywhere (grey, 1 channel, or RGB, 3)."""
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data
                + struct.pack(">I", zlib.crc32(kind + data)))
    header = struct.pack(">IIBBBBB", width, height, bits, {1: 0, 3: 2}[channels], 0, 0, interlace)
    sample = value.to_bytes(bits // 8, "big")
    rows = (b"\0" + sample * (width * channels)) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows))
            + chunk(b"IEND", b""))


def contents(folder):
    """Name to bytes of the files of a run."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def lines_of(path):
    """Lines of a list without comments."""
    return [line for line in pathlib.Path(path).read_text(encoding="utf-8").splitlines()
            if line and not line.startswith("#")]


def trajectory(path):
    """Rows of a TUM trajectory as (stamp text, seven numbers)."""
    rows = [line.split() for line in lines_of(path)]
    return [(row[0], [float(word) for word in row[1:]]) for row in rows]


class CliTest(unittest.TestCase):
    """Each test has a folder of its own, with a blank and an umlaut in its name."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="yg slam ü ")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_on(self, sequence, *options, **how):
        """Without masks. @return the finished run, metrics.json, frames.csv; the latter two empty if it failed."""
        done = ygslam("run", sequence, "--out", self.folder / "out", "--deterministic", "--segmenter", "none", *options,
                      **how)
        if done.returncode != 0:
            return done, {}, []
        metrics = json.loads((self.folder / "out" / "metrics.json").read_text(encoding="utf-8"))
        with (self.folder / "out" / "frames.csv").open(encoding="utf-8") as file:
            return done, metrics, list(csv.DictReader(file))

    def copy_sequence(self, name="sequence", frames=FRAMES):
        """The first frames of the clean sequence, colour, depth, masks and truth."""
        source, target = sequence(), self.folder / name
        target.mkdir()
        for part in ("rgb", "depth", "mask"):
            (target / part).mkdir()
        for part in ("calibration.txt", "groundtruth.txt", "instances.json"):
            shutil.copyfile(source / part, target / part)
        pairs = lines_of(source / "associations.txt")[:frames]
        (target / "associations.txt").write_text("\n".join(pairs) + "\n", encoding="utf-8")
        for _, colour, stamp, depth in map(str.split, pairs):
            for file in (colour, depth, f"mask/{stamp}.png"):
                shutil.copyfile(source / file, target / file)
        return target

    def pairs(self, folder):
        """(stamp, colour file, depth stamp, depth file) of every pair of a sequence."""
        return [line.split() for line in lines_of(folder / "associations.txt")]

    def run_slam(self, folder, *options, out="out", geometry=True, **how):
        """`ygslam run`, deterministic and without a network unless told otherwise."""
        fixed = ["--dynamic", "geometry"] if geometry else []
        if "--realtime" not in options:
            fixed.append("--deterministic")
        return ygslam("run", folder, "--out", self.folder / out, *fixed, *options, **how)

    def metrics(self, out="out"):
        with open(self.folder / out / "metrics.json", encoding="utf-8") as file:
            return json.load(file)

    def log(self, out="out"):
        return (self.folder / out / "log.txt").read_text(encoding="utf-8", errors="replace")

    def assert_ran(self, done, code=0):
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertNotRegex(done.stderr, r"(?m)^error")

    def assert_error(self, done, code, *parts, out="out", left=()):
        """The exit code, one line of error that holds the parts, and nothing written but `left`."""
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        errors = [line for line in done.stderr.splitlines()
                  if not line.startswith(("info: ", "warning: "))]
        self.assertEqual(len(errors), 1, done.stderr)
        self.assertTrue(errors[0].startswith("error: "), errors[0])
        for part in parts:
            self.assertIn(str(part), errors[0])
        self.assert_nothing_written(out, left)

    def assert_nothing_written(self, out="out", left=()):
        folder = self.folder / out
        found = [] if not folder.is_dir() else sorted(p.name for p in folder.iterdir())
        self.assertEqual(found, sorted(left))

    def assert_sound(self, out="out"):
        """All files are there and no pose is broken."""
        found = {path.name for path in (self.folder / out).iterdir()}
        self.assertEqual(found, FILES)
        for name in ("trajectory.txt", "trajectory_live.txt", "keyframes.txt"):
            for stamp, pose in trajectory(self.folder / out / name):
                self.assertEqual(len(pose), 7, f"{name} {stamp}")
                self.assertAlmostEqual(sum(q * q for q in pose[3:]), 1.0, places=5)  # not NaN
                self.assertLess(max(map(abs, pose[:3])), 100.0)


if __name__ == "__main__":
    render(sys.argv[1])
