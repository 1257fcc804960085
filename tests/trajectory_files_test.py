"""One trajectory in every format that is read: `ygslam eval` gives the ATE that NumPy gives for it.

    python tests/trajectory_files_test.py --ygslam build/release/ygslam

The recorded trajectories of $YGSLAM_SHARED (else ../shared) where they exist, else a random one.
docs/inputs.md has a row for each format; the names below are those of its table.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from random_trajectories import disturbed, matrices, product, quaternions, random_trajectory, write

BINARY = None
ROOT = pathlib.Path(__file__).resolve().parent.parent


def recorded():
    """(truth, estimate) as rows `t x y z qx qy qz qw`."""
    folder = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared")) / "data" / "trajectories"
    if folder.is_dir():
        return (np.loadtxt(folder / "freiburg1_xyz-groundtruth.txt"),
                np.loadtxt(folder / "freiburg1_xyz-rgbdslam.txt"))
    rng = np.random.default_rng(1)
    truth = random_trajectory(rng, 400)
    return truth, disturbed(rng, truth)


def associated(truth, estimate, max_diff=0.02):
    near = np.abs(truth[:, None, 0] - estimate[None, :, 0]).argmin(axis=0)
    same = np.abs(truth[near, 0] - estimate[:, 0]) <= max_diff
    return truth[near[same]], estimate[same]


def ate(truth, estimate):
    """RMSE of positions after the rigid motion of Kabsch 1976."""
    q, p = truth[:, 1:4], estimate[:, 1:4]
    u, _, vt = np.linalg.svd((q - q.mean(0)).T @ (p - p.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    return float(np.sqrt(np.mean(np.sum((q - q.mean(0) - (p - p.mean(0)) @ turn.T) ** 2, axis=1))))


def numbers(values):
    return " ".join(f"{value:.12f}" for value in values)


def ns(row):
    return int(round(row[0] * 1e6)) * 1000


def inverse(row):
    """The pose of the world in the camera."""
    turn = row[4:8] * np.array([-1, -1, -1, 1])
    point = np.append(row[1:4], 0)[None]
    moved = product(product(turn[None], point), (turn * np.array([-1, -1, -1, 1]))[None])[0, :3]
    return np.concatenate([row[:1], -moved, turn])


def lines(rows, line, head=""):
    return head + "".join(line(i, row, matrix) + "\n"
                          for i, (row, matrix) in enumerate(zip(rows, matrices(rows))))


LAST = numbers((0, 0, 0, 1))
POSE = "field.pose.pose."
# name: (whether it has stamps, the file of rows)
FORMATS = {
    "TUM": (True, lambda rows: lines(rows, lambda i, r, m: f"{r[0]:.6f} " + numbers(r[1:]))),
    "TUM with nanoseconds": (True, lambda rows: lines(
        rows, lambda i, r, m: f"{ns(r)}.000000 " + numbers(r[1:]))),
    "EuRoC": (True, lambda rows: lines(rows, lambda i, r, m: ",".join(
        [str(ns(r)), *numbers([*r[1:4], r[7], *r[4:7]]).split(), "0", "0", "0"]))),
    "number, stamp, pose": (True, lambda rows: lines(
        rows, lambda i, r, m: f"{i} {r[0]:.6f} " + numbers(r[1:]))),
    "seconds, nanoseconds, pose": (True, lambda rows: lines(rows, lambda i, r, m: ",".join(
        [str(ns(r) // 10**9), str(ns(r) % 10**9), *numbers(r[1:]).split()]))),
    "header line": (True, lambda rows: lines(
        rows, lambda i, r, m: f"{r[0]:.6f} " + numbers([*r[1:4], r[7], *r[4:7]]),
        "# timestamp tx ty tz qw qx qy qz\n")),
    "pandas": (True, lambda rows: lines(rows, lambda i, r, m: ",".join(
        [str(i), f"{r[0]:.6f}", *numbers(r[1:]).split()]), ",timestamp,x,y,z,qx,qy,qz,qw\n")),
    "rostopic": (True, lambda rows: lines(rows, lambda i, r, m: ",".join(
        [str(ns(r) + 10**9), str(i), str(ns(r)), "", *numbers(r[1:]).split(), "0.1"]),
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,"
        + ",".join(f"{POSE}position.{a}" for a in "xyz") + ","
        + ",".join(f"{POSE}orientation.{a}" for a in "xyzw") + ",field.twist.twist.linear.x\n")),
    "ros2 topic echo": (True, lambda rows: lines(rows, lambda i, r, m: ",".join(
        [str(ns(r) // 10**9), str(ns(r) % 10**9), "map", *numbers(r[1:]).split()]))),
    "stamp and 3x4": (True, lambda rows: lines(
        rows, lambda i, r, m: f"{r[0]:.6f} " + numbers(m.ravel()))),
    "stamp and 4x4": (True, lambda rows: lines(
        rows, lambda i, r, m: f"{r[0]:.6f} " + numbers(m.ravel()) + " " + LAST)),
    "COLMAP": (True, lambda rows: lines(np.array([*map(inverse, rows)]),
                                        lambda i, r, m: f"{i + 1} "
                                        + numbers([r[7], *r[4:7], *r[1:4]])
                                        + f" 1 rgb/{r[0]:.6f}.png\n3.5 4.5 -1")),
    "KITTI": (False, lambda rows: lines(rows, lambda i, r, m: numbers(m.ravel()))),
    "4x4 in a line": (False, lambda rows: lines(
        rows, lambda i, r, m: numbers(m.ravel()) + " " + LAST)),
    "4x4 in four lines": (False, lambda rows: lines(
        rows, lambda i, r, m: "\n".join(map(numbers, m)) + "\n" + LAST + "\n")),
    "3x4 in three lines": (False, lambda rows: lines(
        rows, lambda i, r, m: "\n".join(map(numbers, m)) + "\n")),
    "Open3D": (False, lambda rows: lines(
        rows, lambda i, r, m: f"{i} {i} {i + 1}\n" + "\n".join(map(numbers, m)) + "\n" + LAST)),
    "pose without stamp": (False, lambda rows: lines(rows, lambda i, r, m: numbers(r[1:]))),
}


def run_eval(*arguments):
    return subprocess.run([BINARY, "eval", *map(str, arguments), "--json"], capture_output=True,
                          text=True, check=False)


class TrajectoryFiles(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)

    def judged(self, *arguments):
        done = run_eval(*arguments)
        self.assertEqual(done.returncode, 0, f"{arguments}: {done.stderr}")
        return json.loads(done.stdout), done.stderr

    def test_every_format_gives_the_same_error_as_numpy(self):
        truth, estimate = associated(*recorded())
        estimate[:, 0] = truth[:, 0] = np.round(truth[:, 0], 6)
        keep = np.append(True, np.diff(truth[:, 0]) > 0)
        truth, estimate = truth[keep], estimate[keep]
        norm = np.linalg.norm(truth[:, 4:], axis=1, keepdims=True)
        truth[:, 4:] /= norm
        estimate[:, 4:] /= np.linalg.norm(estimate[:, 4:], axis=1, keepdims=True)
        expected = ate(truth, estimate)
        tum, times = self.folder / "tum.txt", self.folder / "times.txt"
        write(tum, estimate)
        times.write_text("".join(f"{t:.6f}\n" for t in truth[:, 0]))
        for name, (has_stamps, text) in FORMATS.items():
            path = self.folder / "truth"
            path.write_text(text(truth))
            extra = [] if has_stamps else ["--times", times]
            found, said = self.judged("--gt", path, "--est", tum, *extra)
            self.assertEqual(found["pairs"], len(truth), name)
            self.assertAlmostEqual(found["ate"]["rmse"], expected, delta=1e-8, msg=name)
            self.assertEqual("read as" in said, name != "TUM", f"{name}: {said}")
            done = run_eval("--gt", path, "--est", tum)
            self.assertEqual(done.returncode, 0 if has_stamps else 4, f"{name}: {done.stderr}")

    def test_the_table_of_formats_has_a_row_for_each(self):
        page = (ROOT / "docs" / "inputs.md").read_text(encoding="utf-8")
        table = page.split("## Trajectories", 1)[1].split("\n## ", 1)[0]
        rows = re.findall(r"(?m)^\| ([^|]+?) \|", table)
        self.assertEqual(set(rows) - {"format", "---"}, set(FORMATS))

    def test_other_commands_read_them_too(self):
        truth, _ = associated(*recorded())
        path = self.folder / "traj.txt"
        path.write_text(FORMATS["4x4 in a line"][1](truth[:20]))
        scene = self.folder / "cloud.ply"
        scene.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 1\n"
                          b"property float x\nproperty float y\nproperty float z\nend_header\n"
                          + np.zeros(3, np.float32).tobytes())
        done = subprocess.run([BINARY, "render", scene, "--path", path, "--out",
                               self.folder / "a.png", "--size", "64x48"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("read as 4x4 matrices", done.stderr)

    def test_a_marker_s_truth_becomes_that_of_the_camera(self):
        rng = np.random.default_rng(2)
        camera = random_trajectory(rng, 400)
        turn = quaternions(np.array([[0.1, 3.0, 0.2]]))
        offset = np.array([0.01, 0.04, -0.03])
        marker = camera.copy()
        rotation = camera[:, 4:]
        back = rotation * np.array([-1, -1, -1, 1])
        point = np.tile(np.append(offset, 0), (len(camera), 1))
        marker[:, 1:4] += product(product(rotation, point), back)[:, :3]
        marker[:, 4:] = product(rotation, np.tile(turn, (len(camera), 1)))
        estimate = disturbed(rng, camera)
        paths = [self.folder / name for name in ("marker", "camera", "estimate")]
        for path, rows in zip(paths, (marker, camera, estimate)):
            write(path, rows)
        found, said = self.judged("--gt", paths[0], "--est", paths[2])
        expected, _ = self.judged("--gt", paths[1], "--est", paths[2])
        given, _ = self.judged("--gt", paths[0], "--est", paths[2], "--same-body")
        self.assertIn("the truth is of a body turned by", said)
        self.assertNotIn("body", expected)
        self.assertNotIn("body", given)
        self.assertEqual(found["ate"], given["ate"])
        self.assertEqual(found["body"]["as_given"]["rpe"], given["rpe"])
        self.assertAlmostEqual(found["body"]["offset_m"], np.linalg.norm(offset), delta=0.01)
        for part in ("trans_m", "rot_deg"):
            right = expected["rpe"]["frames30"][part]["rmse"]
            self.assertLess(abs(found["rpe"]["frames30"][part]["rmse"] / right - 1), 0.05)
            self.assertGreater(given["rpe"]["frames30"][part]["rmse"], 2 * right)

    def test_bonn_s_truth_is_that_of_a_marker(self):
        shared = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared"))
        folder = shared / "data" / "trajectories"
        if not folder.is_dir():
            self.skipTest(f"no recorded data at {folder}")
        found, _ = self.judged(
            "--gt", folder / "bonn_synchronous2_groundtruth.txt",
            "--est", folder / "bonn_synchronous2_amos_CameraTrajectory.txt")
        self.assertAlmostEqual(found["body"]["turn_deg"], 175.0, delta=0.5)
        self.assertAlmostEqual(found["body"]["offset_m"], 0.055, delta=0.01)
        self.assertLess(found["rpe"]["frames30"]["rot_deg"]["rmse"], 0.5)
        self.assertLess(found["rpe"]["frames30"]["trans_m"]["rmse"], 0.013)

    def test_a_mirrored_truth_is_told(self):
        rng = np.random.default_rng(3)
        camera = random_trajectory(rng, 400)
        icl = camera * np.array([1, 1, -1, 1, -1, 1, -1, 1])  # y up: M T M with M = diag(1, -1, 1)
        truth, plain, estimate = (self.folder / name for name in ("icl", "plain", "estimate"))
        write(truth, icl)
        write(plain, camera)
        write(estimate, disturbed(rng, camera))
        found, said = self.judged("--gt", truth, "--est", estimate)
        expected, _ = self.judged("--gt", plain, "--est", estimate)
        undone, quiet = self.judged("--gt", truth, "--est", estimate, "--mirrored-truth")
        self.assertIn("the truth is mirrored", said)
        self.assertIn(f"{expected['ate']['rmse']:.4f}", said)
        self.assertNotIn("mirrored", quiet)
        self.assertAlmostEqual(undone["ate"]["rmse"], expected["ate"]["rmse"], delta=1e-9)
        self.assertAlmostEqual(undone["rpe"]["frames30"]["rot_deg"]["rmse"],
                               expected["rpe"]["frames30"]["rot_deg"]["rmse"], delta=1e-6)
        self.assertGreater(found["ate"]["rmse"], 2 * expected["ate"]["rmse"])

    def test_what_is_no_trajectory_is_refused_in_one_line(self):
        good, bad = self.folder / "good", self.folder / "bad"
        write(good, random_trajectory(np.random.default_rng(4), 50))
        for text, part in (
                ("1.5 .5 .5 .5 .5 3 2 1\n2.5 .5 .5 .5 .5 3 2 2\n", "2 to 5 have unit length"),
                ("1.5 1 2 3 4 5 6 7\n", "no unit quaternion (length 11.2)"),
                ("1.5 1 2 3 0 0 0 1\n2.5 1 2 3 0 0 0 .5\n", ":2: quaternion of length 0.5"),
                ("# t x y z qw qx qy qz\n1 3 3 3 9 0 0 1\n", "no unit quaternion"),
                ("t,x,y,z,roll,pitch,yaw\n1,1,2,3,0,0,0\n", "angles"),
                ("name,price\n1,2\n", "names no columns"),
                ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 0 0 0\n", "a matrix of which line"),
                ("-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n", "reflection")):
            bad.write_text(text)
            done = run_eval("--gt", good, "--est", bad)
            self.assertEqual((done.returncode, done.stdout), (4, ""), text)
            self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z")
            self.assertIn(part, done.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ygslam", required=True, help="the program to test")
    known, rest = parser.parse_known_args()
    BINARY = known.ygslam
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
