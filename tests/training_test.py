#!/usr/bin/env python3
"""What the network of our own is trained with: random frames, their preparation, a small training.

The training needs PyTorch: $YGSLAM_TRAINING_PYTHON, or the environment that `make train` leaves in
build/training-env; without either that part is skipped.
"""
import csv
import json
import os
import pathlib
import subprocess
import sys
import unittest

from ygslam_cli import BINARY, CliTest, HANG_S, ROOT, ygslam

TRAINING = ROOT / "training"
PYTHON = pathlib.Path(os.environ.get("YGSLAM_TRAINING_PYTHON", ROOT / "build/training-env/bin/python"))
sys.path.insert(0, str(TRAINING))


def bytes_of(folder):
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


class RandomFrames(CliTest):
    """`ygslam simulate --random`"""

    def render(self, name, *options, count=8):
        out = self.folder / name
        self.assert_ran(ygslam("simulate", "--random", count, "--out", out, "--size", "160x120",
                               "--quiet", *options))
        return out

    def test_frames_are_listed_and_whole(self):
        out = self.render("frames")
        with open(out / "frames.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 8)
        for row in rows:
            self.assertEqual((row["width"], row["height"]), ("160", "120"))
            self.assertTrue(100 < float(row["fx"]) < 190, row)
            for ending in (".jpg", "_depth.png", "_people.png"):
                self.assertTrue((out / (row["name"] + ending)).stat().st_size > 0)
        self.assertEqual(len(bytes_of(out)), 3 * 8 + 1)

    def test_same_seed_same_bytes(self):
        first = bytes_of(self.render("a", "--seed", 5, "--threads", 1))
        self.assertEqual(first, bytes_of(self.render("b", "--seed", 5, "--threads", 2)))
        self.assertNotEqual(first, bytes_of(self.render("c", "--seed", 6)))

    def test_what_does_not_go_with_it_is_refused(self):
        out = self.folder / "out"
        for options in (("walking_xyz",), ("--truth",), ("--blur", "0.5"), ("--list",)):
            done = ygslam("simulate", "--random", 3, "--out", out, *options)
            self.assertEqual(done.returncode, 2, (options, done.stderr))
        self.assertEqual(ygslam("simulate", "--random", 0, "--out", out).returncode, 2)
        self.assertEqual(ygslam("simulate", "--random", 3).returncode, 2)
        self.assertFalse(out.exists())

    def test_a_folder_that_cannot_be_written_is_told(self):
        blocked = self.folder / "file"
        blocked.write_text("x", encoding="utf-8")
        done = ygslam("simulate", "--random", 1, "--out", blocked / "below")
        self.assertEqual(done.returncode, 9, done.stderr)


if __name__ == "__main__":
    unittest.main()
