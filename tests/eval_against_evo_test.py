"""`ygslam eval` against evo (used as a library): the same numbers to 1e-6 for the same protocol.

    python tests/eval_against_evo_test.py --ygslam build/release/ygslam

Random trajectories always; the recorded ones of $YGSLAM_SHARED (else ../shared) where they exist.
RPE over one second is no protocol of evo: it is compared with a plain search written here.
"""
import argparse
import csv
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
from random_trajectories import (disturbed, matrices, product, quaternions, random_trajectory, write,
                                 write_euroc, write_kitti)

TOLERANCE = 1e-6
BINARY = None


def statistics(errors):
    errors = np.asarray(errors)
    return {"rmse": float(np.sqrt(np.mean(errors**2))), "mean": float(np.mean(errors)),
            "median": float(np.median(errors)), "std": float(np.std(errors)),
            "min": float(np.min(errors)), "max": float(np.max(errors))}


def evo_read(path):
    """The file as evo reads it, by the ending of its name."""
    reader = {".csv": file_interface.read_euroc_csv_trajectory,
              ".kitti": file_interface.read_kitti_poses_file}
    return reader.get(path.suffix, file_interface.read_tum_trajectory_file)(str(path))


def evo_associated(truth_path, estimate_path, align, max_diff, offset=0.0, body=None):
    truth, estimate = evo_read(truth_path), evo_read(estimate_path)
    if body is not None:
        truth.transform(body, right_mul=True)
    if truth_path.suffix != ".kitti":
        truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=max_diff,
                                                      offset_2=offset)
    if align in ("se3", "sim3"):
        estimate.align(truth, correct_scale=align == "sim3")
    elif align == "first":
        estimate.align_origin(truth)
    return truth, estimate


def evo_result(metric, pair):
    metric.process_data(pair)
    values = metric.get_all_statistics()
    return {key: float(values[key]) for key in ("rmse", "mean", "median", "std", "min", "max")}


def evo_numbers(truth_path, estimate_path, align, max_diff, offset=0.0):
    pair = evo_associated(truth_path, estimate_path, align, max_diff, offset)
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

    def assert_agrees(self, truth, estimate, align="se3", max_diff=0.02, offset=0.0, extra=()):
        found = run_eval(truth, estimate, align=align, max_diff=max_diff,
                         extra=(*extra, "--offset", str(offset)) if offset else extra)
        expected, pair = evo_numbers(truth, estimate, align, max_diff, offset)
        what = f"{estimate} {align}"
        self.assertEqual(found["pairs"], expected["pairs"], what)
        self.assert_statistics(found["ate"], expected["ate"], what + " ate")
        # evo's rotation angle loses digits near 180 degrees and near 0: compared a little wider.
        for key, value in expected["ate_rot_deg"].items():
            self.assertAlmostEqual(found["ate_rot_deg"][key], value, delta=1e-5, msg=what + " rot " + key)
        for name in ("trans_m", "rot_deg"):
            self.assert_statistics(found["rpe"]["frames30"][name], expected["frames30"][name],
                                   f"{what} rpe frames {name}")
            if truth.suffix == ".kitti":
                self.assertIsNone(found["rpe"]["sec1"], "no stamps, no seconds")
                continue
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

    def test_kitti_poses_belong_together_by_line(self):
        rng = np.random.default_rng(5)
        with tempfile.TemporaryDirectory() as folder:
            truth, estimate = pathlib.Path(folder, "gt.kitti"), pathlib.Path(folder, "est.kitti")
            for _ in range(2):
                rows = random_trajectory(rng, int(rng.integers(80, 200)))
                write_kitti(truth, rows)
                other = rows.copy()
                other[:, 1:4] += np.cumsum(rng.normal(0, 0.01, (len(rows), 3)), axis=0)
                other[:, 4:] = product(other[:, 4:], quaternions(rng.normal(0, 0.02, (len(rows), 3))))
                write_kitti(estimate, other)
                for align in ("se3", "sim3", "first", "none"):
                    self.assert_agrees(truth, estimate, align)

    def test_kitti_poses_with_times_are_those_of_the_tum_format(self):
        rng = np.random.default_rng(6)
        with tempfile.TemporaryDirectory() as folder:
            kitti, tum, times, estimate = (pathlib.Path(folder, name) for name in
                                           ("poses", "tum.txt", "times.txt", "est.txt"))
            rows = random_trajectory(rng, 150)
            write_kitti(kitti, rows)
            write(tum, rows)
            write(estimate, disturbed(rng, rows))
            times.write_text("".join(f"{t:.6f}\n" for t in rows[:, 0]), encoding="utf-8")
            found = run_eval(kitti, estimate, extra=("--times", str(times)))
            expected = run_eval(tum, estimate)
            self.assertEqual(found["pairs"], expected["pairs"])
            self.assert_statistics(found["ate"], expected["ate"], "ate")
            self.assert_statistics(found["rpe"]["sec1"]["trans_m"],
                                   expected["rpe"]["sec1"]["trans_m"], "rpe")

    def test_euroc_files_and_mixed_formats(self):
        rng = np.random.default_rng(7)
        with tempfile.TemporaryDirectory() as folder:
            truth, estimate, tum = (pathlib.Path(folder, name)
                                    for name in ("data.csv", "est.csv", "est.txt"))
            for _ in range(2):
                rows = random_trajectory(rng, int(rng.integers(200, 400)), rate_hz=100.0,
                                         jitter_s=0.001)
                write_euroc(truth, rows)
                other = disturbed(rng, rows[::5])
                write_euroc(estimate, other)
                write(tum, other)
                self.assert_agrees(truth, estimate)
                self.assert_agrees(truth, tum, "sim3")
                forced = run_eval(truth, estimate, extra=("--format", "euroc"))
                self.assertEqual(forced["ate"], run_eval(truth, estimate)["ate"])

    def test_an_offset_is_added_to_the_estimate(self):
        rng = np.random.default_rng(8)
        with tempfile.TemporaryDirectory() as folder:
            truth, estimate = pathlib.Path(folder, "truth.txt"), pathlib.Path(folder, "est.txt")
            for offset in (-1.25, 0.013, 7.0):
                rows = random_trajectory(rng, 200)
                write(truth, rows)
                late = disturbed(rng, rows)
                late[:, 0] -= offset
                write(estimate, late)
                found = self.assert_agrees(truth, estimate, offset=offset)
                self.assertGreater(found["pairs"], 150)

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
            table = subprocess.run([BINARY, "eval", "--gt", paths[0], "--est", *paths[1:]],
                                   capture_output=True, text=True, check=True).stdout.splitlines()
            best = min(range(2), key=lambda i: found["estimates"][i]["ate"]["rmse"])
            for number, path in enumerate(paths[1:]):
                line = table[1 + number]
                self.assertTrue(line.startswith(str(path)), line)
                rmse = f"{found['estimates'][number]['ate']['rmse']:.6f}"
                self.assertIn(rmse + ("*" if number == best else " "), line)

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

    def test_the_errors_of_every_pose_are_those_of_evo(self):
        rng = np.random.default_rng(9)
        with tempfile.TemporaryDirectory() as folder:
            paths = [pathlib.Path(folder, name) for name in ("truth.txt", 'a "b".txt', "c.txt")]
            errors = pathlib.Path(folder, "errors.csv")
            rows = random_trajectory(rng, 200)
            write(paths[0], rows)
            for path in paths[1:]:
                write(path, disturbed(rng, rows))
            run_eval(*paths[:2], extra=("--errors", str(errors)))
            with open(errors, encoding="utf-8", newline="") as file:
                table = list(csv.DictReader(file))
            pair = evo_associated(paths[0], paths[1], "se3", 0.02)
            metric = metrics.APE(metrics.PoseRelation.translation_part)
            metric.process_data(pair)
            self.assertEqual(len(table), len(metric.error))
            np.testing.assert_allclose([float(row["ate_m"]) for row in table], metric.error,
                                       atol=TOLERANCE)
            np.testing.assert_allclose([[float(row[f"{a}_m"]) for a in "xyz"] for row in table],
                                       pair[1].positions_xyz, atol=TOLERANCE)
            metric = metrics.RPE(metrics.PoseRelation.translation_part, 30, units.Unit.frames,
                                 all_pairs=True)
            metric.process_data(pair)
            found = [float(row["rpe30_m"]) for row in table if row["rpe30_m"]]
            np.testing.assert_allclose(found, metric.error, atol=TOLERANCE)
            run_eval(*paths, extra=("--errors", str(errors)))
            with open(errors, encoding="utf-8", newline="") as file:
                names = {row["estimate"] for row in csv.DictReader(file)}
            self.assertEqual(names, {str(path) for path in paths[1:]})

    def test_a_plot_is_drawn_in_every_kind_of_file(self):
        rng = np.random.default_rng(10)
        with tempfile.TemporaryDirectory() as folder:
            truth, estimate = pathlib.Path(folder, "truth.txt"), pathlib.Path(folder, "est.txt")
            rows = random_trajectory(rng, 100)
            write(truth, rows)
            write(estimate, disturbed(rng, rows))
            for name, start in (("a.svg", b"<?xml"), ("a.png", b"\x89PNG"), ("a.pdf", b"%PDF")):
                picture = pathlib.Path(folder, name)
                run_eval(truth, estimate, extra=("--plot", str(picture)))
                self.assertTrue(picture.read_bytes().startswith(start), name)
            rmse = run_eval(truth, estimate)["ate"]["rmse"]
            self.assertIn(f"RMSE {rmse:.4f} m", pathlib.Path(folder, "a.svg").read_text("utf-8"))
            left = {path.name for path in pathlib.Path(folder).iterdir()}
            self.assertEqual(left, {"truth.txt", "est.txt", "a.svg", "a.png", "a.pdf"})

    def test_a_plot_may_have_any_name(self):
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "good.txt").write_text("1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n")
            done = subprocess.run([pathlib.Path(BINARY).resolve(), "eval", "--gt", "good.txt",
                                   "--est", "good.txt", "--plot=-x.svg"], cwd=folder,
                                  capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertTrue(pathlib.Path(folder, "-x.svg").read_bytes().startswith(b"<?xml"))

    def test_what_is_no_trajectory_of_its_format_is_refused_in_one_line(self):
        kitti = "0.6 -0.8 0 5 0.8 0.6 0 -1 0 0 1 2\n"
        with tempfile.TemporaryDirectory() as folder:
            good, bad = pathlib.Path(folder, "good.txt"), pathlib.Path(folder, "bad.txt")
            good.write_text("1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n")
            for text, part, *options in (
                    ("1,5 0,0 0 0 0 0 0 1\n", "decimal commas"),
                    ("1,5;0,0;0,0;0,0;0;0;0;1\n", "decimal commas"),
                    ("1 0 0 0 0 0 0 1\r2 1 0 0 0 0 0 1\r", "carriage return"),
                    (kitti, "a KITTI pose", "--format", "tum"),
                    (kitti.rsplit(" ", 1)[0] + "\n", "11 columns"),
                    ("1,0,0,0,1,0,0,0\n2,0,0,0,1,0,0,0\n", "microsecond", "--format", "euroc")):
                bad.write_text(text, newline="")
                done = subprocess.run([BINARY, "eval", "--gt", good, "--est", bad, *options],
                                      capture_output=True, text=True, check=False)
                self.assertEqual((done.returncode, done.stdout), (4, ""), text)
                self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z")
                self.assertIn(part, done.stderr)

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
            both = ("--gt", good, "--est", good)
            self.assertEqual(code(*both, "--plot", "a.gif"), 2)
            self.assertEqual(code(*both, "--offset", "nan"), 2)
            self.assertEqual(code(*both, "--format", "bag"), 2)
            self.assertEqual(code(*both, "--format", "kitti"), 4)
            self.assertEqual(code(*both, "--errors", pathlib.Path(folder, "no", "e.csv")), 9)
            self.assertEqual(code(*both, "--plot", pathlib.Path(folder, "no", "e.svg")), 9)
            kitti = pathlib.Path(folder, "poses")
            kitti.write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" * 3)
            self.assertEqual(code("--gt", kitti, "--est", kitti), 0)
            self.assertEqual(code("--gt", good, "--est", kitti), 4, "no stamps")
            self.assertEqual(code("--gt", kitti, "--est", kitti, "--offset", "1"), 2)
            shorter = pathlib.Path(folder, "shorter")
            shorter.write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
            self.assertEqual(code("--gt", kitti, "--est", shorter), 4, "another number of lines")

    def test_recorded_trajectories(self):
        shared = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared"))
        folder = shared / "data" / "trajectories"
        if not folder.is_dir():
            self.skipTest(f"no recorded data at {folder}")
        # (truth, estimate, largest difference, ATE RMSE computed independently, poses)
        for truth, estimate, max_diff, rmse, pairs in (
                ("freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-rgbdslam.txt", 0.02, 0.0135, 786),
                ("bonn_synchronous2_groundtruth.txt", "bonn_synchronous2_amos_CameraTrajectory.txt",
                 0.02, 0.0082, 357),
                ("bonn_synchronous2_groundtruth.txt", "bonn_synchronous2_amos_CameraTrajectory.txt",
                 0.01, 0.0071, 210)):
            found = self.assert_agrees(folder / truth, folder / estimate, max_diff=max_diff,
                                       extra=("--same-body",))  # Bonn's truth is a marker's
            self.assertAlmostEqual(found["ate"]["rmse"], rmse, delta=6e-5)
            self.assertEqual(found["pairs"], pairs)
            for align in ("sim3", "first", "none"):
                self.assert_agrees(folder / truth, folder / estimate, align, max_diff,
                                   extra=("--same-body",))

    def test_errors_without_a_constant_transform_are_those_of_a_truth_moved_by_it(self):
        rng = np.random.default_rng(11)
        with tempfile.TemporaryDirectory() as folder:
            truth, estimate = pathlib.Path(folder, "truth.txt"), pathlib.Path(folder, "est.txt")
            rows = random_trajectory(rng, 400)
            write(estimate, disturbed(rng, rows))
            rows[:, 4:] = product(rows[:, 4:], np.tile(quaternions(np.array([[0.1, 3, 0.2]])), (400, 1)))
            write(truth, rows)
            found = run_eval(truth, estimate)
            x, y, z, *quaternion = found["body"]["T_body_camera"]
            body = np.eye(4)
            body[:3] = matrices(np.array([[0, x, y, z, *quaternion]]))[0]
            pair = evo_associated(truth, estimate, "se3", 0.02, body=body)
            relation = metrics.PoseRelation
            for name, kind in (("trans_m", relation.translation_part),
                               ("rot_deg", relation.rotation_angle_deg)):
                self.assert_statistics(
                    found["rpe"]["frames30"][name],
                    evo_result(metrics.RPE(kind, 30, units.Unit.frames, all_pairs=True), pair), name)
            self.assert_statistics(found["body"]["ate"],
                                   evo_result(metrics.APE(relation.translation_part), pair), "ate")
            for key, value in evo_result(metrics.APE(relation.rotation_angle_deg), pair).items():
                self.assertAlmostEqual(found["ate_rot_deg"][key], value, delta=1e-5, msg=key)
            self.assert_agrees(truth, estimate, extra=("--same-body",))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ygslam", required=True, help="the program to test")
    known, rest = parser.parse_known_args()
    BINARY = known.ygslam
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
