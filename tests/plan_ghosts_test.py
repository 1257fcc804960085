"""bench/plan_ghosts.py and plan_truth.py: plans made up of the truth of a rendered sequence.

    python tests/plan_ghosts_test.py
"""
import copy
import pathlib
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "bench"))

import plan_ghosts as pg  # noqa: E402
import plan_truth as pt  # noqa: E402
from ygslam_cli import sequence  # noqa: E402


class PlanVerdicts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.seen = pg.Truth(pathlib.Path(sequence()))
        for stamp in sorted(cls.seen.poses)[:8]:
            cls.seen.observe(stamp)

    def setUp(self):
        self.truth = copy.deepcopy(self.seen)

    def perfect(self):
        return np.where(self.truth.standing(), pg.OCCUPIED, pg.FREE)

    def judge(self, cells):
        return self.truth.judge(pg.Plan(cells.reshape(-1), self.truth.coarse.centres()))

    def open_place(self):
        """A cell with nothing near."""
        near = pt.binary_dilation(self.truth.standing() | self.truth.under_people
                                  | np.isfinite(self.truth.covered).any(0), pt.disc(8))
        return tuple(np.argwhere(~near)[0])

    def test_the_truth_itself_has_no_fault(self):
        verdict = self.judge(self.perfect())
        self.assertEqual([verdict[k] for k in ("ghosts", "ghosts_unseen", "false_free", "false_occupied", "missed")],
                         [0] * 5)
        self.assertEqual((verdict["free"], verdict["unknown"], verdict["occupied"]), (1, 0, 0))

    def test_what_is_missing_and_what_is_too_much(self):
        all_free = self.judge(np.full(self.truth.coarse.shape, pg.FREE))
        self.assertGreater(all_free["false_free"], 100)
        self.assertEqual(all_free["missed"], 1)
        unknown = self.judge(np.full(self.truth.coarse.shape, pg.UNKNOWN))
        self.assertEqual((unknown["false_free"], unknown["unknown"]), (0, 1))
        cells = self.perfect()
        cells[self.open_place()] = pg.OCCUPIED
        self.assertEqual(self.judge(cells)["false_occupied"], 1)

    def test_a_ghost_stands_where_somebody_left_and_a_second_saw_it_empty(self):
        place, cells = self.open_place(), self.perfect()
        cells[place] = pg.OCCUPIED
        self.truth.covered[(3, *place)] = self.truth.now - 3
        for frames, expected in ((0, (0, 1)), (self.truth.enough + 1, (1, 0))):
            self.truth.through[(3, *place)] = frames
            verdict = self.judge(cells)
            self.assertEqual((verdict["ghosts"], verdict["ghosts_unseen"]), expected)
        self.truth.covered[(5, *place)] = self.truth.now - 3  # and as high as that nobody saw it empty
        self.assertEqual(self.judge(cells)["ghosts"], 0)
        self.truth.covered[(5, *place)] = self.truth.now  # somebody is there
        self.assertEqual(self.judge(cells)["ghosts_unseen"], 0)

    def test_triangles_are_filled(self):
        points = pt.surface_points(pathlib.Path(sequence()) / "static.ply")
        self.assertTrue((points[:, 2] >= pg.LOW_M).all() and (points[:, 2] <= pg.HIGH_M).all())
        inside = pt.binary_erosion(self.truth.fixed_fine, np.ones((5, 5)))
        self.assertGreater(inside.sum(), 200, "table tops are more than their edges")


class OctoMapCells(unittest.TestCase):
    def test_each_cell_comes_back_from_the_package(self):
        """Single ones, and eight that it has made one leaf."""
        try:
            import pyoctomap
        except ImportError:
            self.skipTest("no pyoctomap")
        tree = pyoctomap.OcTree(pg.CELL_M)
        block = [(x, y, z) for x in range(4) for y in range(-4, 0) for z in range(8, 12)]
        wanted = {*map(tuple, np.random.default_rng(1).integers(-20, 20, (300, 3)).tolist()), *block}
        for cell in wanted:
            for _ in range(12):  # until it is at the bound, as leaves that become one must be
                tree.updateNode([(k + 0.5) * pg.CELL_M for k in cell], True)
        occupied, _ = tree.extractPointCloud()
        found = np.floor(pg.cell_centres(occupied) / pg.CELL_M + 1e-6).astype(int)
        self.assertEqual({*map(tuple, found.tolist())}, wanted)


if __name__ == "__main__":
    unittest.main()
