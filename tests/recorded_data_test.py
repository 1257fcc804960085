"""The trajectories of the recorded sequences against their ground truth.

Deterministic runs without a network (masks from files), so that the figures are those of the code
and not of the machine. The data is that of $YGSLAM_SHARED, else of ../shared.
"""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

from ygslam_cli import BINARY

DATA = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared")) / "data"


class Recorded(unittest.TestCase):
    name = ""

    def setUp(self):
        self.sequence = DATA / self.name
        if not (self.sequence / "groundtruth.txt").exists():
            self.skipTest(f"no recorded data at {self.sequence}")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def metrics(self, mode, *options):
        """metrics.json of a run; everything must have been tracked."""
        out = self.folder / mode
        done = subprocess.run([BINARY, "run", self.sequence, "--out", out, "--dynamic", mode,
                               "--deterministic", "--quiet", *options], capture_output=True,
                              text=True, check=False, timeout=800)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads((out / "metrics.json").read_text(encoding="utf-8"))
        print(f"{self.name} {mode}: ATE RMSE {found['ate']['rmse']:.4f} m, "
              f"coverage {found['coverage']:.3f}")
        return found

    def masks(self):
        return ("--segmenter", f"masks:{self.sequence / 'mask'}")


class RedkitchenWalk(Recorded):
    name = "redkitchen_walk"

    def test_people_do_not_pull_the_trajectory_in_mode_full_but_do_in_mode_off(self):
        full = self.metrics("full", *self.masks())
        self.assertEqual(full["coverage"], 1.0)
        self.assertLessEqual(full["ate"]["rmse"], 0.050)
        off = self.metrics("off")
        self.assertGreaterEqual(off["ate"]["rmse"], 2.5 * full["ate"]["rmse"])


class RedkitchenStatic(Recorded):
    name = "redkitchen_static"

    def test_nothing_is_lost_where_nobody_walks(self):
        for mode in ("full", "off"):
            found = self.metrics(mode, "--segmenter", "none")
            self.assertEqual(found["coverage"], 1.0)
            self.assertLessEqual(found["ate"]["rmse"], 0.048, mode)


class TumRpy(Recorded):
    name = "tum_fr1_rpy_part"

    def test_fast_rotation_is_followed(self):
        for mode in ("geometry", "off"):
            found = self.metrics(mode)
            self.assertEqual(found["coverage"], 1.0)
            self.assertLessEqual(found["ate"]["rmse"], 0.0125, mode)


class KitchenPerson(Recorded):
    name = "kitchen_person_static_camera"

    def test_a_camera_that_stands_still_stays_where_it_is(self):
        found = self.metrics("full", *self.masks())
        self.assertEqual(found["coverage"], 1.0)
        self.assertLessEqual(found["ate"]["rmse"], 0.005)
        rows = [line.split() for line in
                (self.folder / "full" / "trajectory.txt").read_text(encoding="utf-8").splitlines()
                if not line.startswith("#")]
        least_w = min(abs(float(row[7])) for row in rows)  # half the angle's cosine
        self.assertGreaterEqual(least_w, 0.99999657)       # 0.3 degrees


if __name__ == "__main__":
    unittest.main(verbosity=2)
