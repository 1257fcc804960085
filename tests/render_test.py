"""Pictures of a scene and the judgement of its surface, from the command line.

    python tests/render_test.py
"""
import io
import json
import struct
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


def avi_images(path):
    """(frames a second, number of frames in the header, images) of a Motion JPEG file, by its index."""
    data = path.read_bytes()
    assert data[:4] == b"RIFF" and data[8:12] == b"AVI " and struct.unpack("<I", data[4:8])[0] == len(data) - 8
    header, stream = data.index(b"avih") + 8, data.index(b"strh") + 8
    assert data[stream:stream + 8] == b"vidsMJPG"
    scale, rate = struct.unpack("<II", data[stream + 20:stream + 28])
    movi, index = data.index(b"movi"), data.rindex(b"idx1")
    images = []
    for at in range(index + 8, len(data), 16):
        name, _, offset, size = struct.unpack("<4sIII", data[at:at + 16])
        assert name == b"00dc" == data[movi + offset:movi + offset + 4]
        assert size == struct.unpack("<I", data[movi + offset + 4:movi + offset + 8])[0]
        images.append(Image.open(io.BytesIO(data[movi + offset + 8:movi + offset + 8 + size])).convert("RGB"))
    return rate / scale, struct.unpack("<I", data[header + 16:header + 20])[0], images


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

    def test_a_video_follows_a_path_at_its_pace(self):
        mesh, path, video = self.folder / "mesh.ply", self.folder / "path.txt", self.folder / "tour.avi"
        write_mesh(mesh, *square(2.0))  # seen from below: faces up, so from behind
        write_mesh(mesh, square(2.0)[0], [[0, 2, 1], [0, 3, 2]])
        poses = [(0.1 * i, 0.02 * i) for i in range(31)]  # 3 s, 0.6 m to the right
        path.write_text("".join(f"{t:.6f} {0.2 + x:.6f} 0.5 0 0 0 0 1\n" for t, x in poses), encoding="utf-8")
        self.assert_ran(ygslam("render", mesh, "--up", "0,1,0", "--path", path, "--size", "160x120",
                               "--video", video, "--fps", "5"))
        rate, count, images = avi_images(video)
        self.assertEqual((rate, count, len(images)), (5, 16, 16))
        columns = []
        for image in images:
            self.assertEqual(image.size, (160, 120))
            drawn = (np.asarray(image).astype(int).min(axis=2) < 200)
            columns.append(np.nonzero(drawn)[1].mean())
        moved = np.diff(columns)
        np.testing.assert_allclose(moved, -0.04 * 0.86 * 160 / 2, atol=0.7)
        try:
            import cv2
        except ImportError:
            return
        reader = cv2.VideoCapture(str(video))
        self.assertEqual(reader.get(cv2.CAP_PROP_FRAME_COUNT), 16)
        self.assertEqual(reader.get(cv2.CAP_PROP_FPS), 5)
        for image in images:
            read, picture = reader.read()
            self.assertTrue(read)
            off = np.abs(picture[..., ::-1].astype(int) - np.asarray(image))
            self.assertLess(off.mean(), 1)
            self.assertLess((off > 24).mean(), 1e-3, "but for JPEG's ringing at edges")

    def test_a_video_holds_a_pose_until_the_next_one(self):
        mesh, path, video = self.folder / "mesh.ply", self.folder / "path.txt", self.folder / "tour.avi"
        write_mesh(mesh, *square())
        for stamps, fps, count in (((0, 0.5, 1, 1.5), 10, 16),  # keyframes: as long as they took
                                   ([i / 15 for i in range(15)], 15, 15),  # none falls to rounding
                                   ([i / 15 for i in range(15)], 30, 29),
                                   ((0, 1000), 2, 5)):  # who stood for long is not waited for
            path.write_text("".join(f"{t:.6f} {t} 0 0 0 0 0 1\n" for t in stamps), encoding="utf-8")
            self.assert_ran(ygslam("render", mesh, "--up", "0,1,0", "--path", path, "--size", "80x60",
                                   "--video", video, "--fps", str(fps)))
            self.assertEqual(avi_images(video)[1], count, (stamps, fps))

    def test_boxes_that_nothing_tells_of_are_an_error(self):
        mesh = self.folder / "mesh.ply"
        write_mesh(mesh, *square())
        done = ygslam("render", mesh, "--boxes", "--out", self.folder / "boxes.png")
        self.assert_error(done, 4, "mesh.ply", "objects.json")

    def test_a_video_without_a_path_goes_around_the_scene(self):
        mesh, video = self.folder / "mesh.ply", self.folder / "tour.avi"
        write_mesh(mesh, *square())
        self.assert_ran(ygslam("render", mesh, "--up", "0,0,1", "--size", "80x60", "--video", video, "--fps", "2"))
        self.assertEqual(len(avi_images(video)[2]), 16)

    def test_what_a_video_cannot_be_is_told(self):
        mesh = self.folder / "mesh.ply"
        write_mesh(mesh, *square())
        for options, part in ((("--video", "tour.mp4"), ".avi"), ((), "--out and --video"),
                              (("--video", "tour.avi", "--size", "8000x60"), "4096")):
            done = ygslam("render", mesh, *options, cwd=self.folder)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(part, done.stderr)
        empty = self.folder / "empty.txt"
        empty.write_text("# nothing\n", encoding="utf-8")
        done = ygslam("render", mesh, "--path", empty, "--video", self.folder / "tour.avi")
        self.assertEqual(done.returncode, 4, done.stderr)

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
