"""Pictures of a scene and the judgement of its surface, from the command line.

    python tests/render_test.py
"""
import json
import unittest

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from ygslam_cli import CliTest, sequence, ygslam


def write_mesh(path, points, triangles, colour=(200, 60, 60)):
    """A binary PLY as any program might write it."""
    rows = np.zeros(len(points), [("p", "<f4", 3), ("c", "u1", 3)])
    rows["p"], rows["c"] = points, colour
    faces = np.zeros(len(triangles), [("n", "u1"), ("v", "<i4", 3)])
    faces["n"], faces["v"] = 3, np.reshape(triangles, (-1, 3))
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
              "property float x\nproperty float y\nproperty float z\n"
              "property uchar red\nproperty uchar green\nproperty uchar blue\n"
              f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    path.write_bytes(header.encode() + rows.tobytes() + faces.tobytes())


def square(height=0.0, side=1.0):
    """Two triangles that face up."""
    points = np.array([[0, 0, height], [side, 0, height], [side, side, height], [0, side, height]])
    return points, [[0, 1, 2], [0, 2, 3]]


class Render(CliTest):
    def draw(self, *arguments):
        out = self.folder / "picture.png"
        done = ygslam("render", *arguments, "--out", out)
        self.assert_ran(done)
        return np.asarray(Image.open(out).convert("RGB")).astype(int)

    def test_what_lies_before_the_eye_is_drawn_where_it_lies(self):
        mesh = self.folder / "mesh.ply"
        write_mesh(mesh, *square())
        view = ("--from", "0.5,0.5,2", "--look-at", "0.5,0.5,0", "--size", "200x100")
        picture = self.draw(mesh, "--up", "0,1,0", *view)
        self.assertEqual(picture.shape, (100, 200, 3))
        drawn = (picture != 255).any(axis=2)
        side_px = 0.86 * 200 / 2  # focal length times size over distance
        self.assertAlmostEqual(np.sqrt(drawn.sum()), side_px, delta=1)
        rows, columns = np.nonzero(drawn)
        np.testing.assert_allclose([rows.mean(), columns.mean()], [49.5, 99.5], atol=1)
        self.assertFalse((self.draw(mesh, "--up", "0,1,0", "--from", "0.5,0.5,-2", "--look-at",
                                    "0.5,0.5,0") != 255).any())  # from behind

    def test_what_is_over_heads_is_cut_away_unless_asked_for(self):
        mesh = self.folder / "mesh.ply"
        low, low_faces = square(side=3.0)
        high, high_faces = square(2.6, side=3.0)
        points = np.concatenate([low, high])
        colours = np.repeat([(60, 60, 200), (200, 60, 60)], 4, axis=0)
        write_mesh(mesh, points, low_faces + [[i + 4 for i in face] for face in high_faces], colours)
        up = ("--up", "0,0,1", "--size", "200x150")

        def red_and_blue(*options):
            picture = self.draw(mesh, *up, *options)
            return [(picture[..., a] > picture[..., b] + 50).sum() for a, b in ((0, 2), (2, 0))]
        for options in ((), ("--cut", "1")):
            red, blue = red_and_blue(*options)
            self.assertEqual(red, 0, options)
            self.assertGreater(blue, 3000, options)
        for options in (("--cut", "inf"), ("--from", "1.5,-2,6", "--look-at", "1.5,1.5,0")):
            self.assertGreater(red_and_blue(*options)[0], 1000, options)

    def test_boxes_that_nothing_tells_of_are_an_error(self):
        mesh = self.folder / "mesh.ply"
        write_mesh(mesh, *square())
        done = ygslam("render", mesh, "--boxes", "--out", self.folder / "boxes.png")
        self.assert_error(done, 4, "mesh.ply", "objects.json")

    def test_boxes_are_in_the_picture_and_in_the_colours_of_the_classes(self):
        write_mesh(self.folder / "mesh.ply", *square(), colour=(120, 120, 120))
        box = {"centre_m": [3, 0.5, 0.5], "size_m": [0.4, 0.4, 0.8], "yaw_rad": 0,
               "rotation_xyzw": [0, 0, 0, 1]}
        known = {"format": "ygslam objects", "version": 1, "up_world": [0, 0, 1], "floor_m": 0.0,
                 "objects": [{"id": i, "class": "chair", "label": 56, "probability": 1.0, "state": "static",
                              "box": box, "views": 5, "epochs": 1, "first_seen_ns": 0, "last_seen_ns": 1}
                             for i in (1, 2)]}
        (self.folder / "objects.json").write_text(json.dumps(known), encoding="utf-8")

        def coloured(by):
            picture = self.draw(self.folder / "mesh.ply", "--by", by, "--size", "400x300", "--boxes")[:, :400]
            strong = picture.max(axis=2) - picture.min(axis=2) > 60
            self.assertFalse((strong[:, :2] | strong[:, -2:]).any() or strong[:2].any(), "cut by the frame")
            colours, counts = np.unique(picture[strong], axis=0, return_counts=True)
            return tuple(colours[counts.argmax()]), strong.sum()
        by_object, by_class = coloured("object"), coloured("class")
        self.assertGreater(min(by_object[1], by_class[1]), 100)
        self.assertNotEqual(by_object[0], by_class[0])
        known["objects"].pop()
        known["objects"][0]["id"] = 7  # another object of the same class
        (self.folder / "objects.json").write_text(json.dumps(known), encoding="utf-8")
        self.assertEqual(coloured("class")[0], by_class[0])
        self.assertNotEqual(coloured("object")[0], by_object[0])

    def test_it_says_so_where_no_floor_was_found(self):
        write_mesh(self.folder / "map.ply", *square())
        for options, told in ((("--by", "height"), True), (("--cut", "1"), True), ((), False),
                              (("--by", "height", "--up", "0,0,1"), False)):
            done = ygslam("render", self.folder / "map.ply", "--out", self.folder / "p.png", *options)
            self.assert_ran(done)
            self.assertEqual("no floor was found" in done.stderr, told, options)

    def test_side_by_side_is_as_wide_as_both(self):
        for name, colour in (("mesh.ply", (200, 60, 60)), ("other.ply", (60, 60, 200))):
            write_mesh(self.folder / name, *square(), colour=colour)
        picture = self.draw(self.folder / "mesh.ply", "--side-by-side", self.folder / "other.ply",
                            "--up", "0,0,1", "--size", "200x150")
        left, right = picture[:, :picture.shape[1] // 2], picture[:, picture.shape[1] // 2:]
        self.assertGreater(picture.shape[1], 400)
        self.assertGreater((left[..., 0] > left[..., 2] + 50).sum(), 1000)
        self.assertGreater((right[..., 2] > right[..., 0] + 50).sum(), 1000)
        self.assertEqual((left[..., 2] > left[..., 0] + 50).sum(), 0)

    def test_a_run_is_drawn_by_all_colours_with_its_way(self):
        self.assert_ran(self.run_slam(sequence(), "--export", self.folder / "scene"))
        plain = self.draw(self.folder / "scene", "--size", "320x240")
        self.assertGreater((plain != 255).any(axis=2).mean(), 0.1)
        way = self.draw(self.folder / "scene", "--size", "320x240", "--path",
                        self.folder / "out" / "trajectory.txt")
        red = [np.all(np.abs(picture.astype(int) - (220, 30, 30)) < 30, axis=2).sum()
               for picture in (plain, way)]
        self.assertGreater(red[1], red[0] + 10)
        for by in ("class", "object", "height"):
            self.assertGreater(self.draw(self.folder / "scene", "--by", by, "--size",
                                         "320x240").shape[1], 320, by)  # with a legend
        self.draw(self.folder / "out", "--size", "320x240")  # map.ply

    def test_bad_calls_and_files_are_one_line(self):
        mesh, out = self.folder / "mesh.ply", self.folder / "out" / "p.png"
        write_mesh(mesh, *square())
        for options, part in ((("--size", "0x5"), "--size"), (("--from", "1,2,3"), "--look-at"),
                              (("--from", "1,2", "--look-at", "0,0,0"), "--from"),
                              (("--from", "0,0,0", "--look-at", "0,0,0"), "--look-at"),
                              (("--up", "0,0,0"), "--up"), (("--cut", "nan"), "--cut"), (("--point", "nan"), "--point"),
                              (("--by", "smell"), "--by")):
            self.assert_error(ygslam("render", mesh, "--out", out, *options), 2, part)
        self.assert_error(ygslam("render", mesh, "--out", self.folder / "p.jpg"), 2, ".png")
        self.assert_error(ygslam("render", mesh), 2, "--out")
        good = mesh.read_bytes()
        broken = self.folder / "broken.ply"
        at = good.index(b"end_header\n") + 11
        for data, part in ((good[:-1], "truncated"), (b"solid x\n", "not a PLY"), (b"", "not a PLY"),
                           (good[:at] + np.float32(np.inf).tobytes() + good[at + 4:], "finite")):
            broken.write_bytes(data)
            self.assert_error(ygslam("render", broken, "--out", out), 4, broken, part)
        self.assert_error(ygslam("render", self.folder / "none.ply", "--out", out), 4, "none.ply")
        (self.folder / "objects.json").write_text("{", encoding="utf-8")
        self.assert_error(ygslam("render", mesh, "--out", out), 4, "objects.json")


class MapEval(CliTest):
    def judge(self, *arguments):
        done = ygslam("eval", "--map", *arguments, "--json")
        self.assert_ran(done)
        return json.loads(done.stdout)

    def test_a_surface_that_lies_off_by_a_known_way(self):
        truth, near, far = (self.folder / f"{name}.ply" for name in ("truth", "near", "far"))
        write_mesh(truth, *square(side=2.0))
        write_mesh(near, *square(0.03))
        write_mesh(far, *square(0.06))
        score = self.judge(near, "--truth", truth)
        self.assertAlmostEqual(score["accuracy_m"]["mean"], 0.03, places=6)
        self.assertEqual(score["precision"], 1)
        # A quarter of the truth, and what lies beside it within sqrt(5^2 - 3^2) cm.
        self.assertAlmostEqual(score["completeness"], (1 + 2 * 0.04 + np.pi * 0.04 ** 2 / 4) / 4,
                               delta=0.005)
        self.assertIsNone(score["ghosts"])
        self.assertEqual(self.judge(far, "--truth", truth)["f1"], 0)

    def test_agrees_with_nearest_neighbours_of_scipy(self):
        """Random triangles against a truth sampled so densely that its samples are the surface."""
        rng = np.random.default_rng(3)
        corners = rng.uniform(-1, 1, (40, 1, 3)) + rng.uniform(-0.4, 0.4, (40, 3, 3))
        write_mesh(self.folder / "truth.ply", corners.reshape(-1, 3), np.arange(120).reshape(-1, 3))
        cloud = rng.uniform(-1, 1, (500, 3)).astype(np.float32)
        write_mesh(self.folder / "cloud.ply", cloud, [])
        score = self.judge(self.folder / "cloud.ply", "--truth", self.folder / "truth.ply")
        weights = rng.dirichlet((1, 1, 1), (40, 20000))
        samples = np.einsum("tsc,tcx->tsx", weights, corners).reshape(-1, 3)
        distances = cKDTree(samples).query(cloud)[0]
        self.assertEqual(score["samples"], len(cloud))
        self.assertAlmostEqual(score["accuracy_m"]["mean"], distances.mean(), delta=1e-3)
        self.assertAlmostEqual(score["accuracy_m"]["median"], np.median(distances), delta=3e-3)
        self.assertAlmostEqual(score["precision"], (distances <= 0.05).mean(), delta=0.01)
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0],
                                        corners[:, 2] - corners[:, 0]), axis=1) / 2
        even = samples.reshape(40, -1, 3)
        near = [(cKDTree(cloud).query(points)[0] <= 0.05).mean() for points in even]
        self.assertAlmostEqual(score["completeness"], np.average(near, weights=areas), delta=0.01)

    def test_the_truth_itself_is_without_fault(self):
        score = self.judge(sequence() / "static.ply", "--truth", sequence())
        self.assertLess(score["accuracy_m"]["mean"], 1e-6)
        self.assertEqual((score["precision"], score["completeness"], score["f1"], score["ghosts"]),
                         (1, 1, 1, 0))

    def test_a_run_leaves_ghosts_only_without_removal(self):
        scores = {}
        for name, options in (("with", ("--segmenter", f"masks:{sequence() / 'mask'}")),
                              ("without", ("--dynamic", "off", "--segmenter", "none"))):
            self.assert_ran(self.run_slam(sequence(), "--export", self.folder / name, *options,
                                          out=f"out_{name}", geometry=False))
            scores[name] = self.judge(self.folder / name, "--truth", sequence(), "--est",
                                      self.folder / f"out_{name}" / "trajectory.txt")
        self.assertLess(scores["with"]["ghosts"], 0.1 * scores["without"]["ghosts"], scores)
        self.assertGreater(scores["with"]["f1"], 0.8, scores)

    def test_an_empty_map_has_no_accuracy(self):
        truth, empty = self.folder / "truth.ply", self.folder / "empty.ply"
        write_mesh(truth, *square())
        write_mesh(empty, np.zeros((0, 3)), np.zeros((0, 3), int))
        score = self.judge(empty, "--truth", truth)
        self.assertEqual((score["accuracy_m"], score["precision"], score["completeness"]), (None, None, 0))
        done = ygslam("eval", "--map", empty, "--truth", truth)
        self.assert_ran(done)
        self.assertRegex(done.stdout, "empty.ply: empty, 0 % of")

    def test_bad_calls_and_files_are_one_line(self):
        mesh = self.folder / "mesh.ply"
        write_mesh(mesh, *square())
        self.assert_error(ygslam("eval", "--map", mesh), 2, "--truth")
        for option, value in (("--errors", "x.csv"), ("--plot", "x.svg"), ("--times", mesh), ("--frames", mesh)):
            self.assert_error(ygslam("eval", "--map", mesh, "--truth", mesh, option, value), 2, option)
        self.assert_error(ygslam("eval", "--truth", mesh), 2, "--map")
        self.assert_error(ygslam("eval", "--map", mesh, "--truth", mesh, "--est", mesh), 2, "--gt")
        self.assert_error(ygslam("eval", "--map", mesh, "--truth", self.folder / "none"), 4, "none")
        self.assert_error(ygslam("eval", "--map", mesh, "--truth", self.folder), 4, "static.ply")
        huge = self.folder / "huge.ply"
        points, triangles = square()
        write_mesh(huge, 1e6 * points, triangles)
        for one, other in ((huge, mesh), (mesh, huge)):
            self.assert_error(ygslam("eval", "--map", one, "--truth", other), 4, huge, "m^2 of surface")
        (self.folder / "objects.json").write_text("[" * 10**6, encoding="utf-8")
        self.assert_error(ygslam("eval", "--map", mesh, "--truth", mesh), 4, "objects.json", "nested")


if __name__ == "__main__":
    unittest.main()
