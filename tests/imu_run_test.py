"""`run` with the camera's IMU.

    YGSLAM_BINARY=build/release/ygslam YGSLAM_SEQUENCE=FOLDER python tests/imu_run_test.py
"""
import pathlib
import shutil
import tempfile
import unittest

import numpy as np

from ygslam_cli import CliTest, ygslam

DARK = ("--fault", "both:black@3s+1s", "--fault", "depth:empty@3s+1s")
RENDER = ("--seconds", 5, "--fps", 20, "--size", "320x240", "--imu", "BMI085", "--quiet")


class ImuRuns(CliTest):
    """The lens is covered from 3 s to 4 s."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="ygslam imu ")
        cls.addClassCleanup(folder.cleanup)
        cls.recording = pathlib.Path(folder.name) / "covered"
        done = ygslam("simulate", "walking_xyz", "--without", "people", "--out", cls.recording, *RENDER, *DARK)
        assert done.returncode == 0, done.stderr

    def test_a_covered_lens_costs_no_pose(self):
        done, metrics, rows = self.run_on(self.recording)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("readings of the IMU; --imu none leaves them out", done.stderr)
        self.assertIn("(20 by IMU or wheels alone)", done.stdout + done.stderr)
        self.assertEqual(metrics["coverage"], 1)
        self.assertEqual(metrics["coasting"], 20)
        self.assertEqual([row["state"] for row in rows[60:80]], ["coasting"] * 20)
        self.assertEqual({row["provisional"] for row in rows[60:80]}, {"1"})
        std_mm = [float(row["position_std_mm"]) for row in rows[60:80]]
        self.assertEqual(std_mm, sorted(std_mm))
        self.assertLess(metrics["ate"]["rmse"], 0.02)

    def test_without_it_the_camera_is_lost(self):
        done, metrics, rows = self.run_on(self.recording, "--imu", "none")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([row["state"] for row in rows[60:80]], ["lost"] * 20)
        self.assertEqual({row["position_std_mm"] for row in rows[60:80]}, {""})
        self.assertEqual(metrics["coasting"], 0)

    def test_readings_without_a_place_are_told_and_not_used(self):
        folder = self.folder / "placeless"
        shutil.copytree(self.recording, folder)
        (folder / "imu.yaml").unlink()
        done, metrics, _ = self.run_on(folder)
        self.assertIn("imu.csv: not used: there is no imu.yaml", done.stderr)
        self.assertEqual(metrics["coasting"], 0)
        self.assertEqual(self.run_on(folder, "--imu-calibration", self.recording / "imu.yaml")[1]["coasting"], 20)

    def test_a_bag_has_its_own(self):
        bag = self.folder / "covered.mcap"
        done = ygslam("simulate", "walking_xyz", "--without", "people", "--mcap", bag, *RENDER, *DARK)
        self.assertEqual(done.returncode, 0, done.stderr)
        done, metrics, _ = self.run_on(bag)
        self.assertEqual(metrics["coasting"], 0)
        self.assertIn(": /imu may be of the IMU: --imu /imu --imu-calibration FILE.yaml uses it", done.stderr)
        place = ("--imu-calibration", self.recording / "imu.yaml")
        done, metrics, _ = self.run_on(bag, *place)
        self.assertEqual(metrics.get("coasting"), 20, done.stderr)
        done, _, _ = self.run_on(bag, *place, "--imu", "/no/topic")
        self.assertEqual(done.returncode, 4)
        self.assertIn("/no/topic", done.stderr)
        done, _, _ = self.run_on(bag, "--imu", "/imu")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--imu-calibration", done.stderr)

    def test_a_stream_has_its_own(self):
        bag = self.folder / "covered.mcap"
        done = ygslam("simulate", "walking_xyz", "--without", "people", "--mcap", bag, *RENDER, *DARK)
        self.assertEqual(done.returncode, 0, done.stderr)
        place = ("--imu-calibration", self.recording / "imu.yaml")
        done, metrics, rows = self.run_on_stream(bag, *place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("readings of the IMU come from /imu", done.stderr)
        self.assertEqual([row["state"] for row in rows[60:80]], ["coasting"] * 20)
        self.assertEqual(metrics["coasting"], 20)
        self.assertLess(metrics["ate"]["rmse"] if "ate" in metrics else 0, 0.02)
        again = self.run_on_stream(bag, *place)[2]
        self.assertEqual([row["position_std_mm"] for row in rows], [row["position_std_mm"] for row in again])
        done, metrics, _ = self.run_on_stream(bag)
        self.assertIn("/imu may be of the IMU: --imu /imu --imu-calibration FILE.yaml uses it", done.stderr)
        self.assertEqual(metrics["coasting"], 0)
        self.assertEqual(self.run_on_stream(bag, "--imu", "none")[1]["coasting"], 0)
        done, _, _ = self.run_on_stream(bag, *place, "--imu", "/no/topic")
        self.assertEqual(done.returncode, 4)
        self.assertIn("/no/topic", done.stderr)
        self.assertEqual(self.run_on_stream(bag, "--imu", "/imu")[0].returncode, 2)
        self.assertEqual(self.run_on_stream(bag, "--odometry", "/odom")[0].returncode, 2)

    def run_on_stream(self, bag, *options):
        with bag.open("rb") as stream:
            return self.run_on("-", *options, stdin=stream)

    def test_faulty_files_are_named(self):
        folder = self.folder / "faulty"
        shutil.copytree(self.recording, folder)
        (folder / "imu.csv").write_text("1 2 3\n", encoding="utf-8")
        done, _, _ = self.run_on(folder)
        self.assertEqual(done.returncode, 4)
        self.assertIn("imu.csv:1: 3 columns", done.stderr)
        done, _, _ = self.run_on(self.recording, "--imu-calibration", self.recording / "calibration.txt")
        self.assertEqual(done.returncode, 3)
        self.assertIn("calibration.txt:", done.stderr)
        done, _, _ = self.run_on(self.recording, "--imu", "none", "--imu-calibration", self.recording / "imu.yaml")
        self.assertEqual(done.returncode, 2)

    def test_swapped_axes_are_told(self):
        folder = self.folder / "swapped"
        shutil.copytree(self.recording, folder)
        head, *lines = (folder / "imu.csv").read_text(encoding="utf-8").splitlines()
        swapped = [",".join(np.array(line.split(","))[[0, 2, 1, 3, 5, 4, 6]]) for line in lines]  # x and y
        (folder / "imu.csv").write_text("\n".join([head, *swapped]) + "\n", encoding="utf-8")
        done, metrics, _ = self.run_on(folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("warning: IMU: it disagrees with what the camera sees", done.stderr)
        self.assertEqual(metrics["coasting"], 0)


if __name__ == "__main__":
    unittest.main()
