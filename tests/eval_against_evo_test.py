"""`ygslam eval` against evo (used as a library): the same numbers to 1e-6 for the same protocol.

    python tests/eval_against_evo_test.py --ygslam build/release/ygslam

Random trajectories always; the recorded ones of $YGSLAM_SHARED (else ../shared) where they exist.
RPE over one second is no protocol of evo: it is compared with a plain search written here.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from evo.core import metrics, sync, units
from evo.tools import file_interface

TOLERANCE = 1e-6
BINARY = None


def random_trajectory(rng, count, rate_hz=30.0, jitter_s=0.004):
    """Stamps and poses of a smooth random camera path; rows `t x y z qx qy qz qw`."""
    stamps = 1305031000.0 + np.arange(count) / rate_hz + rng.uniform(-jitter_s, jitter_s, count)
    position = np.cumsum(rng.normal(0, 0.02, (count, 3)), axis=0)
    angles = np.cumsum(rng.normal(0, 0.03, (count, 3)), axis=0)
    return np.column_stack([stamps, position, quaternions(angles)])


def quaternions(rotation_vectors):
    angle = np.linalg.norm(rotation_vectors, axis=1, keepdims=True)
    axis = rotation_vectors / np.maximum(angle, 1e-12)
    return np.column_stack([axis * np.sin(angle / 2), np.cos(angle / 2)])


def product(a, b):
    """Quaternion product, x y z w."""
    av, aw, bv, bw = a[:, :3], a[:, 3:], b[:, :3], b[:, 3:]
    vector = aw * bv + bw * av + np.cross(av, bv)
    return np.column_stack([vector, aw * bw - np.sum(av * bv, axis=1, keepdims=True)])


def disturbed(rng, truth, scale=1.0):
    """What a tracker would make of it: another world frame, noise, drift, missing poses."""
    estimate = truth[rng.random(len(truth)) > 0.15].copy()
    count = len(estimate)
    estimate[:, 0] += rng.uniform(-0.003, 0.003, count)
    turn = quaternions(np.tile(rng.uniform(-2, 2, (1, 3)), (count, 1)))
    inverse = turn * np.array([-1, -1, -1, 1])
    drift = np.cumsum(rng.normal(0, 0.002, (count, 3)), axis=0)
    points = np.column_stack([(estimate[:, 1:4] + drift) * scale, np.zeros(count)])
    estimate[:, 1:4] = product(product(turn, points), inverse)[:, :3] + rng.uniform(-3, 3, 3)
    noise = quaternions(rng.normal(0, 0.02, (count, 3)))
    estimate[:, 4:] = product(product(turn, estimate[:, 4:]), noise)
    return estimate


def write(path, rows):
    with open(path, "w", encoding="utf-8") as file:
        for row in rows:
            file.write(f"{row[0]:.6f} " + " ".join(f"{value:.9f}" for value in row[1:]) + "\n")


def statistics(errors):
    errors = np.asarray(errors)
    return {"rmse": float(np.sqrt(np.mean(errors**2))), "mean": float(np.mean(errors)),
            "median": float(np.median(errors)), "std": float(np.std(errors)),
            "min": float(np.min(errors)), "max": float(np.max(errors))}


def evo_associated(truth_path, estimate_path, align, max_diff):
    truth = file_interface.read_tum_trajectory_file(str(truth_path))
    estimate = file_interface.read_tum_trajectory_file(str(estimate_path))
    truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=max_diff)
    if align in ("se3", "sim3"):
        estimate.align(truth, correct_scale=align == "sim3")
    elif align == "first":
        estimate.align_origin(truth)
    return truth, estimate


def evo_result(metric, pair):
    metric.process_data(pair)
    values = metric.get_all_statistics()
    return {key: float(values[key]) for key in ("rmse", "mean", "median", "std", "min", "max")}


def evo_numbers(truth_path, estimate_path, align, max_diff):
    pair = evo_associated(truth_path, estimate_path, align, max_diff)
    relation = metrics.PoseRelation
    expected = {
        "pairs": pair[0].num_poses,
        "ate": evo_result(metrics.APE(relation.translation_part), pair),
        "ate_rot_deg": evo_result(metrics.APE(relation.rotation_angle_deg), pair),
    }
    if pair[0].num_poses > 30:
        expected["frames30"] = {
            name: evo_result(metrics.RPE(kind, 30, units.Unit.frames, all_pairs=True), pair)
            for name, kind in (("trans_m", relation.translation_part),
                               ("rot_deg", relation.rotation_angle_deg))
        }
    return expected, pair


def second_numbers(pair, max_diff):
    """RPE over one second by plain search: for each pose the one nearest to a second later."""
    truth, estimate = (np.array(t.poses_se3) for t in pair)
    stamps = pair[1].timestamps
    tolerance = max(max_diff, 0.5 * float(np.median(np.diff(stamps))))
    trans, rot = [], []
    for i, stamp in enumerate(stamps):
        j = int(np.argmin(np.abs(stamps - stamp - 1.0)))
        if j <= i or abs(stamps[j] - stamp - 1.0) > tolerance:
            continue
        q = np.linalg.inv(truth[i]) @ truth[j]
        p = np.linalg.inv(estimate[i]) @ estimate[j]
        f = np.linalg.inv(q) @ p
        trans.append(np.linalg.norm(f[:3, 3]))
        sine = 0.5 * np.linalg.norm([f[2, 1] - f[1, 2], f[0, 2] - f[2, 0], f[1, 0] - f[0, 1]])
        rot.append(np.degrees(np.arctan2(sine, 0.5 * (np.trace(f[:3, :3]) - 1.0))))
    return {"trans_m": statistics(trans), "rot_deg": statistics(rot)}


def run_eval(truth, *estimates, align="se3", max_diff=0.02, extra=()):
    command = [BINARY, "eval", "--gt", str(truth), "--est", *map(str, estimates), "--align", align,
               "--max-diff", str(max_diff), "--json", *extra]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{command}: exit {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


class EvalAgainstEvo(unittest.TestCase):
    def assert_statistics(self, found, expected, what):
        for key, value in expected.items():
            self.assertAlmostEqual(found[key], value, delta=TOLERANCE, msg=f"{what}.{key}")

    def assert_agrees(self, truth, estimate, align="se3", max_diff=0.02):
        found = run_eval(truth, estimate, align=align, max_diff=max_diff)
        expected, pair = evo_numbers(truth, estimate, align, max_diff)
        what = f"{estimate} {align}"
        self.assertEqual(found["pairs"], expected["pairs"], what)
        self.assert_statistics(found["ate"], expected["ate"], what + " ate")
        # evo's rotation angle loses digits near 180 degrees and near 0: compared a little wider.
        for key, value in expected["ate_rot_deg"].items():
            self.assertAlmostEqual(found["ate_rot_deg"][key], value, delta=1e-5, msg=what + " rot " + key)
        for name in ("trans_m", "rot_deg"):
            self.assert_statistics(found["rpe"]["frames30"][name], expected["frames30"][name],
                                   f"{what} rpe frames {name}")
            self.assert_statistics(found["rpe"]["sec1"][name], second_numbers(pair, max_diff)[name],
                                   f"{what} rpe seconds {name}")
        return found

    def test_random_trajectories_in_every_alignment(self):
        rng = np.random.default_rng(1)
        with tempfile.TemporaryDirectory() as folder:
            for number in range(6):
                truth, estimate = pathlib.Path(folder, "truth.txt"), pathlib.Path(folder, "est.txt")
                rows = random_trajectory(rng, int(rng.integers(80, 300)))
                write(truth, rows)
                write(estimate, disturbed(rng, rows, scale=1.0 + 0.3 * (number % 2)))
                for align in ("se3", "sim3", "first", "none"):
                    self.assert_agrees(truth, estimate, align)

    def test_a_truth_of_higher_and_of_lower_rate(self):
        rng = np.random.default_rng(2)
        with tempfile.TemporaryDirectory() as folder:
            truth, estimate = pathlib.Path(folder, "truth.txt"), pathlib.Path(folder, "est.txt")
            rows = random_trajectory(rng, 900, rate_hz=100.0, jitter_s=0.001)
            write(truth, rows)
            write(estimate, disturbed(rng, rows[::3]))
            self.assert_agrees(truth, estimate)
            write(truth, rows[::6])
            write(estimate, disturbed(rng, rows))
            self.assert_agrees(truth, estimate)

    def test_several_estimates_are_listed(self):
        rng = np.random.default_rng(3)
        with tempfile.TemporaryDirectory() as folder:
            paths = [pathlib.Path(folder, name) for name in ("truth.txt", "a b.txt", "ä.txt")]
            rows = random_trajectory(rng, 100)
            write(paths[0], rows)
            for path in paths[1:]:
                write(path, disturbed(rng, rows))
            found = run_eval(*paths)
            self.assertEqual(len(found["estimates"]), 2)
            for entry, path in zip(found["estimates"], paths[1:]):
                self.assertEqual(entry["ate"], run_eval(paths[0], path)["ate"])

    def test_frames_add_the_coverage(self):
        rng = np.random.default_rng(4)
        with tempfile.TemporaryDirectory() as folder:
            truth, estimate = pathlib.Path(folder, "truth.txt"), pathlib.Path(folder, "est.txt")
            frames = pathlib.Path(folder, "associations.txt")
            rows = random_trajectory(rng, 100)
            write(truth, rows)
            write(estimate, rows[20:])
            with open(frames, "w", encoding="utf-8") as file:
                file.writelines(f"{t:.6f} rgb/{t:.6f}.png {t:.6f} depth/{t:.6f}.png\n"
                                for t in rows[:, 0])
            found = run_eval(truth, estimate, extra=("--frames", str(frames)))
            self.assertAlmostEqual(found["coverage"], 0.8)

    def test_errors_have_their_exit_codes(self):
        def code(*arguments):
            return subprocess.run([BINARY, "eval", *arguments], capture_output=True,
                                  check=False).returncode
        with tempfile.TemporaryDirectory() as folder:
            good, bad = pathlib.Path(folder, "good.txt"), pathlib.Path(folder, "bad.txt")
            later = pathlib.Path(folder, "later.txt")
            good.write_text("1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n")
            later.write_text("1001 0 0 0 0 0 0 1\n")
            bad.write_text("1 0 0 nan 0 0 0 1\n")
            self.assertEqual(code("--gt", good, "--est", good), 0)
            self.assertEqual(code("--gt", good, "--est", bad), 4)
            self.assertEqual(code("--gt", good, "--est", later), 4)
            self.assertEqual(code("--gt", pathlib.Path(folder, "none"), "--est", good), 4)
            self.assertEqual(code("--gt", good), 2)
            self.assertEqual(code("--gt", good, "--est", good, "--align", "affine"), 2)
            self.assertEqual(code("--gt", good, "--est", good, "--max-diff", "-1"), 2)

    def test_recorded_trajectories(self):
        shared = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared"))
        folder = shared / "data" / "trajectories"
        if not folder.is_dir():
            print("skipped: no recorded data")
            return
        # (truth, estimate, largest difference, ATE RMSE computed independently, poses)
        for truth, estimate, max_diff, rmse, pairs in (
                ("freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-rgbdslam.txt", 0.02, 0.0135, 786),
                ("bonn_synchronous2_groundtruth.txt", "bonn_synchronous2_amos_CameraTrajectory.txt",
                 0.02, 0.0082, 357),
                ("bonn_synchronous2_groundtruth.txt", "bonn_synchronous2_amos_CameraTrajectory.txt",
                 0.01, 0.0071, 210)):
            found = self.assert_agrees(folder / truth, folder / estimate, max_diff=max_diff)
            self.assertAlmostEqual(found["ate"]["rmse"], rmse, delta=6e-5)
            self.assertEqual(found["pairs"], pairs)
            for align in ("sim3", "first", "none"):
                self.assert_agrees(folder / truth, folder / estimate, align, max_diff)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ygslam", required=True, help="the program to test")
    known, rest = parser.parse_known_args()
    BINARY = known.ygslam
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
