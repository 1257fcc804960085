"""bench/voxel_truth.py on a rendered sequence, with maps made up of its truth; its parts against OpenCV,
pandas, pycocotools and matplotlib.

    python tests/voxel_truth_test.py
"""
import json
import pathlib
import sys
import unittest

import cv2
import matplotlib.path
import numpy as np
import pandas
import plyfile
import pyoctomap
import pycocotools.mask
from PIL import Image
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "bench"))

import dense_seeds  # noqa: E402
import voxel_truth as vt  # noqa: E402
from ygslam_cli import CliTest, sequence  # noqa: E402

TURN, SHIFT = Rotation.from_euler("zyx", [40, 10, -5], degrees=True), np.array([0.4, -1.0, 0.3])


class TruthParts(unittest.TestCase):
    def setUp(self):
        self.random = np.random.default_rng(3)

    def test_points_lie_behind_their_pixels(self):
        frames = vt.Frames(sequence())
        stamp = frames.stamps[3]
        depth = frames.pixels("depth_true", stamp) / 5000
        points = frames.points(stamp, depth)[depth > 0]
        R, t = frames.pose(stamp)
        c = frames.camera
        matrix = np.array([[c["fx"], 0, c["cx"]], [0, c["fy"], c["cy"]], [0, 0, 1]])
        pixels, _ = cv2.projectPoints(points, cv2.Rodrigues(R.T)[0], -R.T @ t, matrix, None)
        expected = np.argwhere(depth > 0)[:, ::-1] * vt.PIXEL_STEP
        np.testing.assert_allclose(pixels[:, 0], expected, atol=1e-6)

    def test_cells_are_groups_of_points(self):
        points = self.random.uniform(-0.2, 0.2, (4000, 3))
        names = self.random.choice(["", "chair", "cup"], 4000, p=[.2, .5, .3])
        views = self.random.integers(0, 9, 4000)
        cells = vt.Cells(points, names, views)
        table = pandas.DataFrame(points, columns=list("xyz"))
        table["cell"] = [tuple(np.floor(p / vt.CELL_M).astype(int)) for p in points]
        groups = table.assign(name=names, view=views).groupby("cell")
        self.assertEqual(len(cells.keys), groups.ngroups)
        for mean, name, count in zip(cells.mean, cells.names, cells.views):
            group = groups.get_group(tuple(np.floor(mean / vt.CELL_M).astype(int)))
            np.testing.assert_allclose(mean, group[list("xyz")].mean(), atol=1e-12)
            self.assertIn(name, group["name"].mode().tolist())
            self.assertEqual(count, group["view"].nunique())

    def test_overlap_of_names(self):
        true, given = (self.random.choice(["", "floor", "tv", "cup"], 5000) for _ in range(2))
        for name, iou in vt.confusion_iou(true, given, ["floor", "tv"]).items():
            one, other = (pycocotools.mask.encode(np.asfortranarray((x == name).astype(np.uint8)[:, None]))
                          for x in (true, given))
            self.assertAlmostEqual(iou, pycocotools.mask.iou([one], [other], [False])[0, 0])

    def test_inside_of_a_box(self):
        box = {"centre_m": [1, 2, 0.5], "size_m": [1.5, 0.5, 1.0], "yaw_rad": 0.7}
        points = self.random.uniform([-0.5, 0.5, -0.5], [2.5, 3.5, 1.5], (3000, 3))
        corners = np.array([[-.85, -.35], [.85, -.35], [.85, .35], [-.85, .35]])
        ground = Rotation.from_euler("z", 0.7).as_matrix()[:2, :2] @ corners.T
        path = matplotlib.path.Path(ground.T + [1, 2])
        expected = path.contains_points(points[:, :2]) & (abs(points[:, 2] - 0.5) < 0.6)
        self.assertGreater(expected.sum(), 50)
        np.testing.assert_array_equal(vt.inside(points, box, 0.1), expected)


class TruthAsMap(CliTest):
    """A map that is the truth itself, in a frame of its own, and what is taken from it or put into it."""

    @classmethod
    def setUpClass(cls):
        cls.frames = vt.Frames(sequence())
        cls.cells, cls.small, cls.movers, cls.fixed = vt.true_cells(cls.frames)
        cls.names = sorted(set(cls.small.names) - {""})

    def write(self, points, called=None, shades=None):
        """As the run would have written it whose world lies at (TURN, SHIFT) in the truth's."""
        local = TURN.inv().apply(points - SHIFT)
        space = pyoctomap.ColorOcTree(0.001)  # so that points keep their places
        for point in local:
            space.updateNode(point, True)
        self.assertTrue(space.write(str(self.folder / "space.ot")))
        ids = {name: i for i, name in enumerate(self.names)} | {"": 255}
        vertices = np.zeros(len(self.small.mean), [("x", "f4"), ("y", "f4"), ("z", "f4"), ("label", "u2")])
        vertices["x"], vertices["y"], vertices["z"] = TURN.inv().apply(self.small.mean - SHIFT).T
        vertices["label"] = [ids[name] for name in (self.small.names if called is None else called)]
        plyfile.PlyData([plyfile.PlyElement.describe(vertices, "vertex")]).write(self.folder / "mesh.ply")
        (self.folder / "labels.json").write_text(json.dumps(
            {"labels": [{"label": i, "name": name} for i, name in enumerate(self.names)]}))
        lines = []
        for line in (sequence() / "groundtruth.txt").read_text().splitlines():
            if line[0] == "#":
                continue
            stamp, *pose = line.split()
            pose = np.array(pose, float)
            turned = (TURN.inv() * Rotation.from_quat(pose[3:])).as_quat()
            lines.append(" ".join([stamp, *(f"{x:.9f}" for x in (*TURN.inv().apply(pose[:3] - SHIFT), *turned))]))
        (self.folder / "trajectory.txt").write_text("\n".join(lines) + "\n")
        self.write_plan(points if shades is None else points[:0], shades)

    def write_plan(self, points, shades):
        """The truth's frame is the plan's: its floor is at 0."""
        low = np.floor(self.fixed.min(0)[:2] / 0.05) - 2
        if shades is None:
            size = np.ceil(self.fixed.max(0)[:2] / 0.05) + 2 - low
            shades = np.full(size.astype(int)[::-1], 205, np.uint8)
            up = points[(points[:, 2] > 0.1) & (points[:, 2] < 1.5)]
            x, y = (np.floor(up[:, :2] / 0.05) - low).astype(int).T
            shades[y, x] = 0
        Image.fromarray(shades[::-1]).save(self.folder / "grid.pgm")
        origin = [float(low[0] * 0.05), float(low[1] * 0.05), 0.0]
        rotation = [float(x) for x in TURN.inv().as_quat()]
        shift = [float(x) for x in TURN.inv().apply(-SHIFT)]
        (self.folder / "grid.yaml").write_text(
            f"image: grid.pgm\nresolution: 0.05\norigin: {origin}\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
            f"world_from_map:\n  translation_m: {shift}\n  rotation_xyzw: {rotation}\n")

    def measure(self):
        return vt.measure(self.folder, sequence(), self.folder / "trajectory.txt", sequence() / "things")

    def test_the_truth_is_right_in_everything(self):
        self.write(self.cells.mean)
        found = self.measure()
        self.assertEqual((found["kept"], found["gone"]), (1, 1))
        self.assertGreater(found["mover_cells"], 300)
        self.assertGreater(found["miou"], 0.999)
        self.assertIn("tv", found["iou"])
        self.assertGreater(found["miou_single"], 0.75)  # each sees edges its own way
        self.assertEqual((found["plan"]["obstacles_found"], found["plan"]["false_occupied"]), (1, 0))
        self.assertEqual(found["plan"]["free_pixels"], 0)

    def test_what_is_missing_is_not_kept_and_what_moved_is_not_gone(self):
        left = self.cells.mean[:, 0] < np.median(self.cells.mean[:, 0])
        movers = vt.means(self.movers)
        points = np.concatenate([self.cells.mean[left], movers])
        self.write(points)
        found = self.measure()
        often = self.cells.views >= vt.LEAST_VIEWS
        near = np.array([np.min(np.sum((points - p) ** 2, 1)) <= vt.WITHIN_M ** 2
                         for p in self.cells.mean[often]])
        self.assertAlmostEqual(found["kept"], near.mean(), delta=0.005)  # places are cut to a millimetre
        self.assertLess(found["kept"], 0.8)
        self.assertEqual(found["gone"], 0)
        self.assertLess(found["plan"]["obstacles_found"], 0.9)
        self.assertGreater(found["plan"]["false_occupied"], 0)

    def test_wrong_names_count(self):
        called = np.where(self.small.names == "tv", "floor", self.small.names)
        self.write(self.cells.mean, called)
        found = self.measure()
        self.assertEqual(found["iou"]["tv"], 0)
        often = self.small.views >= vt.LEAST_VIEWS
        floor, tv = (np.sum((self.small.names == n) & often) for n in ("floor", "tv"))
        self.assertAlmostEqual(found["iou"]["floor"], floor / (floor + tv), delta=0.01)

    def test_all_free_is_free_where_nothing_was_seen_and_in_obstacles(self):
        self.write(self.cells.mean)
        shape = np.asarray(Image.open(self.folder / "grid.pgm")).shape
        self.write(self.cells.mean, None, np.full(shape, 254, np.uint8))
        plan = self.measure()["plan"]
        self.assertEqual(plan["obstacles_found"], 0)
        self.assertGreater(plan["unknown_free"], 0.3)
        self.assertLess(plan["unknown_free"], 0.99)
        self.assertGreater(plan["free_obstacle"], 0)
        self.write(self.cells.mean, None, np.full(shape, 205, np.uint8))
        self.assertEqual(self.measure()["plan"]["free_pixels"], 0)


class TruthTables(unittest.TestCase):
    def test_median_and_worst(self):
        self.assertEqual(dense_seeds.spread([3.0, 1.0, 2.0], True), "2 (1)")
        self.assertEqual(dense_seeds.spread([3.0, 1.0, 2.0], False), "2 (3)")
        self.assertEqual(dense_seeds.spread([3.0], True), "3")
        self.assertEqual(dense_seeds.spread([], True), "-")

    def test_figures_are_found_by_their_names(self):
        line = {"cells": {"plan": {"obstacles_found": 0.5}}, "objects": None}
        self.assertEqual(dense_seeds.value(line, "cells.plan.obstacles_found"), 0.5)
        self.assertIsNone(dense_seeds.value(line, "objects.f1"))


if __name__ == "__main__":
    unittest.main()
