"""The arithmetic of bench/loop_seeds.py, rendered_seeds.py and odometry_steps.py on sequences made
up for it.

    python tests/loop_seeds_test.py
"""
import pathlib
import sys
import tempfile
import unittest

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "bench"))

import loop_seeds  # noqa: E402
import odometry_steps  # noqa: E402
import rendered_seeds as rs  # noqa: E402


def pose(x, y=0.0, yaw_deg=0.0):
    return np.concatenate([[x, y, 0.0], Rotation.from_euler("z", yaw_deg, degrees=True).as_quat()])


def walk(count, folder="."):
    """A metre a frame, ten frames a second."""
    return rs.Sequence(folder, [(10**9 + 10**5 * i, f"rgb/{i}.jpg", f"depth/{i}.png", pose(float(i)))
                                for i in range(count)])


class PutTogether(unittest.TestCase):
    def test_then_comes_so_long_after_and_keeps_the_truth(self):
        both = walk(10).cut(0, 3).then(walk(10).cut(7, None), 4)
        self.assertEqual([f[0] - 10**9 for f in both.frames],
                         [0, 10**5, 2 * 10**5, 42 * 10**5, 43 * 10**5, 44 * 10**5])
        self.assertEqual([f[3][0] for f in both.frames], [0, 1, 2, 7, 8, 9])

    def test_what_is_written_is_read_again(self):
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name)
            (root / "calibration.txt").write_text("fx 500\n")
            walk(4, root).write(root / "cut")
            again = rs.Sequence(root / "cut")
            self.assertEqual([f[:3] for f in again.frames], [f[:3] for f in walk(4).frames])
            np.testing.assert_allclose(again.frames[3][3], pose(3.0), atol=1e-8)


class Judged(unittest.TestCase):
    def test_poses_are_compared_in_the_frame_of_the_first(self):
        truth = walk(5).truth()
        turn, shift = Rotation.from_euler("xyz", [10, 20, 30], degrees=True), np.array([3, 2, 1.0])
        estimates = {s: np.concatenate([turn.apply(p[:3]) + shift,
                                        (turn * Rotation.from_quat(p[3:])).as_quat()])
                     for s, p in truth.items()}
        last = max(estimates)
        estimates[last][:3] += turn.apply([0, 0.25, 0])
        off = rs.errors_m(estimates, truth, rs.alignment(estimates, truth))
        self.assertAlmostEqual(off[last], 0.25)
        self.assertLess(max(e for s, e in off.items() if s != last), 1e-9)

    def test_best_fit_knows_no_frame(self):
        truth = walk(5).truth()
        moved = {s: np.concatenate([Rotation.from_euler("z", 1).apply(p[:3]) + 7, p[3:]])
                 for s, p in truth.items()}
        self.assertLess(rs.best_fit_rmse_m(moved, truth), 1e-9)

    def test_a_loop_is_false_whose_views_stood_apart_or_end_where_they_did_not_stand(self):
        truth = walk(10).truth()
        turn = Rotation.from_euler("z", 1)
        estimates = {s: np.concatenate([turn.apply(p[:3]) + 7,
                                        (turn * Rotation.from_quat(p[3:])).as_quat()])
                     for s, p in truth.items()}
        stamps = sorted(truth)
        estimates[stamps[9]][:3] += 0.5  # 9 is joined to the wrong place
        for i in (2, 3):
            del estimates[stamps[i]]  # of the map that was loaded
        rows = [("closed", "agrees", 5, 4), ("closed", "agrees", 8, 1), ("too far", "agrees", 9, 1),
                ("refused", "no pose", 9, 1), ("closed", "agrees", 4, 3), ("closed", "agrees", 9, 8)]
        with tempfile.TemporaryDirectory() as name:
            text = "stamp,place_stamp,outcome,verdict\n" + "".join(
                f"{rs.stamp_text(10**9 + 10**5 * a)},{rs.stamp_text(10**9 + 10**5 * b)},{o},{v}\n"
                for o, v, a, b in rows)
            (pathlib.Path(name) / "loops.csv").write_text(text)
            (pathlib.Path(name) / "trajectory.txt").write_text("".join(
                f"{rs.stamp_text(s)} {' '.join(map(str, p))}\n" for s, p in estimates.items()))
            counts = rs.count_loops(pathlib.Path(name), truth)
        self.assertEqual((counts["closed"], counts["false"]), (4, 2))
        self.assertEqual(counts["refused"], {"too far": 1, "no pose": 1})

    def test_frames_of_another_place_are_counted_by_whether_they_are_marked(self):
        truth = walk(6).truth()
        stamps = sorted(truth)
        estimates = dict(truth)
        for i in (3, 4):
            estimates[stamps[i]] = truth[stamps[i]] + np.array([0, 6, 0, 0, 0, 0, 0])
        del estimates[stamps[5]]
        with tempfile.TemporaryDirectory() as name:
            out = pathlib.Path(name)
            lines = "".join(f"{rs.stamp_text(s)} {' '.join(map(str, p))}\n"
                            for s, p in estimates.items())
            for file in ("trajectory.txt", "trajectory_live.txt"):
                (out / file).write_text(lines)
            (out / "frames.csv").write_text("stamp,provisional\n" + "".join(
                f"{rs.stamp_text(s)},{int(i == 4)}\n" for i, s in enumerate(stamps)))
            counts = rs.count_frames(out, truth, rs.alignment(estimates, truth), stamps)
        self.assertEqual((counts["final_tracked"], counts["final_wrong"],
                          counts["final_wrong_marked"]), (5, 1, 1))

    def test_rooms_of_the_twin_world(self):
        rooms = rs.Sequence(".", [(i, "", "", pose(x, y)) for i, (x, y) in
                                  enumerate([(-3, 0), (0, -4), (3, 0)])])
        self.assertEqual([rooms.room(i) for i in range(3)], ["A", "-", "B"])

    def test_drift_is_how_far_off_the_last_pose_is(self):
        truth = walk(5).truth()
        estimates = {s: p + np.array([3.0, 0.02 * i, 0, 0, 0, 0, 0])
                     for i, (s, p) in enumerate(truth.items())}
        self.assertAlmostEqual(loop_seeds.drift_m(estimates, truth), 0.08)
        del estimates[max(estimates)]
        self.assertAlmostEqual(loop_seeds.drift_m(estimates, truth), 0.06)

    def test_a_jump_of_odometry_is_the_length_by_which_a_step_is_off(self):
        truth = {s: p[:3] for s, p in walk(5).truth().items()}
        stamps = sorted(truth)
        turned = {s: np.array([1.0, p[0], 0]) for s, p in truth.items()}  # another frame: no matter
        turned[stamps[3]] += [0, 0.3, 0]
        turned[stamps[4]] += [0, 0.3, 0]
        extra = odometry_steps.extra_steps_m(turned, truth)
        self.assertEqual([round(extra[s], 9) for s in stamps[1:]], [0, 0, 0.3, 0])

    def test_spread_is_median_and_ends(self):
        self.assertEqual(loop_seeds.spread([3, 1, 2]), "2 (1 to 3)")
        self.assertEqual(loop_seeds.spread([]), "-")


if __name__ == "__main__":
    unittest.main()
