"""What a robot asks the Python module while it runs: the room, events, how certain the pose is; and its types.

    PYTHONPATH=build/release/python python tests/python_room_test.py
"""
import os
import pathlib
import pickle
import re
import subprocess
import sys
import time
import unittest

import numpy as np
import ygslam

from ygslam_cli import HEIGHT, ROOT, WIDTH, CliTest, sequence


class RoomTest(CliTest):
    def setUp(self):
        super().setUp()
        self.frames = ygslam.open(sequence())

    def run_through(self, **how):
        """@return the Slam and its results."""
        slam = ygslam.Slam(self.frames.camera, segmenter="none", deterministic=True, **how)
        return slam, [slam.process(f.rgb, f.depth, f.t_ns, depth_t_ns=f.depth_t_ns) for f in self.frames]


class People(RoomTest):
    def test_where_they_are_and_will_be(self):
        slam = ygslam.Slam(self.frames.camera, segmenter="frames", deterministic=True)
        person = np.zeros((HEIGHT, WIDTH), np.uint8)
        person[:, WIDTH // 3:WIDTH // 2] = 1  # whoever that is
        for frame in (self.frames[i] for i in range(10)):
            found = slam.process(frame.rgb, frame.depth, frame.t_ns, instances=person, classes=["person"], scores=[0.9])
        [one] = [o for o in found.objects if o.class_name == "person"]
        self.assertEqual(one.body_covariance.shape, (6, 6))
        np.testing.assert_allclose(one.body_covariance, one.body_covariance.T, atol=1e-12)
        place, covariance = one.after(0)
        np.testing.assert_allclose(place, one.body_world_m)
        np.testing.assert_allclose(covariance, one.body_covariance[:3, :3])
        soon, wider = one.after(1.0)
        self.assertGreater(np.linalg.eigvalsh(wider - covariance).min(), 0)
        self.assertLess(np.linalg.norm(np.subtract(soon, place)), 1.01 * np.linalg.norm(one.body_velocity_world_mps) + 1e-9)
        again = pickle.loads(pickle.dumps(one))
        self.assertEqual(again.after(1.0)[0], soon)
        for seconds in (-1, np.nan, np.inf):
            with self.assertRaises(ygslam.UsageError):
                one.after(seconds)


class Rooms(RoomTest):
    def test_its_plan_its_space_and_its_mesh(self):
        slam, _ = self.run_through()
        room = slam.room()
        self.assertEqual(room.t_ns > 0, True)
        grid = room.occupancy()
        self.assertEqual((grid.cells.dtype, grid.cells.ndim), (np.int8, 2))
        self.assertTrue(set(np.unique(grid.cells)) <= {-1, 0, 100})
        self.assertGreater((grid.cells == 100).sum(), 10)
        self.assertEqual(grid.resolution_m, room.cell_m)
        self.assertEqual((len(grid.origin_m), grid.T_world_floor.shape), (2, (4, 4)))
        for points, dtype in ((room.vertices, np.float32), (room.normals, np.float32), (room.colors, np.uint8)):
            self.assertEqual((points.dtype, points.shape), (dtype, (len(room.vertices), 3)))
        self.assertLess(room.triangles.max(), len(room.vertices))
        # What a cell says is what the mesh says: most vertices lie in occupied cells or beside one.
        vertices = room.vertices[::max(1, len(room.vertices) // 200)].astype(float)
        half = room.cell_m
        near = [room.box(v - half, v + half) is ygslam.Space.OCCUPIED for v in vertices]
        self.assertGreater(np.mean(near), 0.9)
        hits = [room.ray([0, 0, 0], v, np.linalg.norm(v) + 0.3, True) for v in vertices]
        self.assertGreater(np.mean([hit.what is ygslam.Space.OCCUPIED for hit in hits]), 0.8)
        self.assertIs(room.at([0, 0, -50]), ygslam.Space.UNKNOWN)
        self.assertAlmostEqual(np.linalg.norm(room.up), 1, places=6)

    def test_arrays_are_views_that_keep_what_they_show(self):
        slam, _ = self.run_through()
        room = slam.room()
        self.assertEqual(room.vertices.ctypes.data, room.vertices.ctypes.data)
        vertices, before = room.vertices, room.vertices.copy()
        self.assertFalse(vertices.flags.owndata or vertices.flags.writeable)
        points = slam.map().points
        self.assertEqual(points.ctypes.data, vertices.ctypes.data, "both are the room's")
        del room, slam
        np.testing.assert_array_equal(vertices, before)

    def test_what_cannot_be_asked_is_refused_in_one_line(self):
        room = ygslam.Slam(self.frames.camera, segmenter="none").room()
        self.assertEqual((room.t_ns, len(room.vertices), room.objects), (0, 0, []))
        self.assertEqual(room.triangles.shape, (0, 3))
        for ask in (lambda: room.occupancy(np.nan, 1), lambda: room.occupancy(2, 1), lambda: room.at([np.nan, 0, 0]),
                    lambda: room.box([0, 0, 0], [-1, 1, 1]), lambda: room.ray([0, 0, 0], [0, 0, 0]),
                    lambda: room.ray([0, 0, 0], [0, 0, 1], np.inf)):
            with self.assertRaises(ygslam.InputError) as refused:
                ask()
            self.assertNotIn("\n", str(refused.exception))
        with self.assertRaises(TypeError):
            room.at([1, 2])

    def test_it_is_published_while_frames_come(self):
        with ygslam.Slam(self.frames.camera, segmenter="none", room_every_s=0) as slam:
            for frame in self.frames:
                slam.process(frame.rgb, frame.depth, frame.t_ns)
            deadline = time.monotonic() + 60
            while slam.room().t_ns == 0 and time.monotonic() < deadline:
                time.sleep(0.02)
            self.assertGreater(len(slam.room().vertices), 100)


class Plan(RoomTest):
    def test_it_is_the_same_object_until_something_changes(self):
        slam = ygslam.Slam(self.frames.camera, segmenter="none", deterministic=True)
        self.assertIsNone(slam.plan())
        for frame in self.frames:
            slam.process(frame.rgb, frame.depth, frame.t_ns)
        plan = slam.plan()
        self.assertIs(slam.plan(), plan)
        self.assertGreater(plan.t_ns, self.frames[0].t_ns)
        self.assertEqual(plan.cells.dtype, np.int8)
        self.assertFalse(plan.cells.flags.writeable)
        self.assertLessEqual({0, 100}, set(np.unique(plan.cells)))
        room = slam.room()
        np.testing.assert_allclose(plan.T_world_floor, room.T_world_floor, atol=0.05)
        del slam
        self.assertGreater(np.sum(plan.cells == 0), 10)

    def test_heights_and_floor_are_the_robots(self):
        def occupied(floor, **heights):
            slam = ygslam.Slam(self.frames.camera, segmenter="none", deterministic=True, floor=floor,
                               options={f"dense.plan_{name}_m": str(m) for name, m in heights.items()})
            for frame in self.frames:
                slam.process(frame.rgb, frame.depth, frame.t_ns)
            plan = slam.plan()
            return plan, int(np.sum(plan.cells == 100))

        plan, all_of_it = occupied(None)
        floor = plan.T_world_floor
        given = floor[:3, 2].tolist(), float(floor[:3, 2] @ floor[:3, 3])
        again, as_many = occupied(given)
        np.testing.assert_allclose(again.T_world_floor, floor, atol=1e-9)
        self.assertLess(abs(as_many - all_of_it), 0.1 * all_of_it)
        self.assertLess(occupied(given, low=1.2, high=1.5)[1], all_of_it)
        for floor in (([0, 0, 0], 1.0), ([0, 1, 0], float("nan"))):
            with self.assertRaisesRegex(ygslam.ConfigError, "floor: "):
                ygslam.Slam(self.frames.camera, segmenter="none", floor=floor)
        with self.assertRaisesRegex(ygslam.ConfigError, "plan_low_m must be less than dense.plan_high_m"):
            ygslam.Slam(self.frames.camera, segmenter="none",
                        options={"dense.plan_low_m": "2", "dense.plan_high_m": "1"})


class Results(RoomTest):
    def test_events_and_covariance(self):
        slam = ygslam.Slam(self.frames.camera, segmenter="none", deterministic=True)
        first, last = self.frames[0], self.frames[1]
        seen = slam.process(first.rgb, first.depth, 1).events + slam.process(last.rgb, last.depth, 2).events
        self.assertEqual(seen.count(ygslam.Event.KEYFRAME), 1)
        result = slam.process(last.rgb, last.depth, 3)
        for covariance in (result.covariance, result.map_covariance, result.seen_covariance):
            self.assertEqual(covariance.shape, (6, 6))
            self.assertGreater(np.linalg.eigvalsh(covariance).min(), 0)
            self.assertLess(covariance.diagonal().max(), 1e-3)
        self.assertGreaterEqual(np.trace(result.covariance), np.trace(result.seen_covariance))
        slam.save_map(self.folder / "room.map")
        lost = slam.process(np.zeros_like(last.rgb), np.zeros_like(last.depth), 4)
        self.assertEqual(set(lost.events), {ygslam.Event.MAP_SAVED, ygslam.Event.LOST})
        self.assertGreater(lost.covariance.diagonal().min(), 1e5)

    def test_results_and_cameras_are_pickled(self):
        _, results = self.run_through()
        for result in results[:3]:
            again = pickle.loads(pickle.dumps(result))
            np.testing.assert_array_equal(again.pose, result.pose)
            np.testing.assert_array_equal(again.covariance, result.covariance)
            np.testing.assert_array_equal(again.map_covariance, result.map_covariance)
            self.assertEqual((again.state, again.events, again.inliers, len(again.objects)),
                             (result.state, result.events, result.inliers, len(result.objects)))
        camera = ygslam.CameraModel(500.25, 501, 320, 240, k1=0.1, ignore=[[0, 1, 2, 3]], device="kinect_v1",
                                    shutter_guessed=True, likely_device="carmine", shutter_source="a sheet")
        again = pickle.loads(pickle.dumps(camera))
        for name in ("fx", "fy", "cx", "cy", "k1", "k2", "width", "height", "ignore", "device", "shutter_known",
                     "shutter_guessed", "likely_device", "shutter_source"):
            self.assertEqual(getattr(again, name), getattr(camera, name))
        earlier = ygslam.CameraModel.__new__(ygslam.CameraModel)  # as pickle does, of a version before 21 fields
        earlier.__setstate__(camera.__getstate__()[:18])
        self.assertEqual((earlier.fx, earlier.ignore, earlier.device, earlier.likely_device),
                         (500.25, [[0, 1, 2, 3]], "kinect_v1", ""))

    def test_what_is_printed_says_something(self):
        slam, results = self.run_through()
        for value, words in ((results[-1], r"Result\(TRACKING, at \[.*\] m, \d+ inliers, \d+ objects\)"),
                             (self.frames, r"Sequence\(\d+ frames of \d+ x \d+ pixels\)"),
                             (self.frames[0], r"Frame\(t_ns=\d+, \d+ x \d+ pixels\)"),
                             (self.frames.camera, r"CameraModel\(fx=.*, width=\d+, height=\d+\)"),
                             (slam, r"Slam\(\d+ x \d+ pixels\)"),
                             (slam.map(), r"MapSnapshot\(\d+ keyframes, \d+ landmarks, \d+ points\)"),
                             (slam.room(), r"Room\(\d+ vertices, \d+ triangles, \d+ objects\)"),
                             (slam.room().occupancy(), r"OccupancyGrid\(\d+ x \d+ cells of 0.05 m\)"),
                             (slam.finish(), r"Outcome\(\d+ poses, \d+ points\)")):
            self.assertRegex(repr(value), f"^{words}$")

    def test_a_sequence_is_gone_over_by_itself(self):
        stamps = [frame.t_ns for frame in self.frames]
        self.assertEqual(stamps, [self.frames[i].t_ns for i in range(len(self.frames))])
        self.assertEqual(len(list(ygslam.open(sequence()))), len(stamps))


class Types(unittest.TestCase):
    """mypy --strict over what docs/python.md shows."""

    def check(self, text):
        package = pathlib.Path(ygslam.__file__).parent
        # mypy finds installed packages by itself, and refuses to be shown their folder.
        paths = {} if "site-packages" in package.parts else {"MYPYPATH": str(package.parent)}
        done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--no-incremental", "-c", text],
                              capture_output=True, text=True, check=False, env={**os.environ, **paths})
        return done.stdout.splitlines()

    def test_the_examples_of_the_page(self):
        page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
        examples = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
        self.assertGreaterEqual(len(examples), 3)
        for example in examples:
            self.assertEqual(self.check(example), ["Success: no issues found in 1 source file"], example)

    def test_the_package_itself(self):
        package = pathlib.Path(ygslam.__file__).parent
        done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--no-incremental", "-p", "ygslam"],
                              capture_output=True, text=True, check=False, cwd=package.parent)
        # nanobind writes os.PathLike without its argument; rclpy, which ygslam.ros stands on, has no types.
        errors = [line for line in done.stdout.splitlines()
                  if ": error:" in line and "PathLike" not in line and not line.startswith("ygslam/ros/")]
        self.assertEqual(errors, [])
        self.assertRegex(done.stdout, r"checked \d+ source files|Success")

    def test_a_wrong_use_is_found(self):
        lines = self.check("import ygslam\nwith ygslam.Slam(ygslam.CameraModel(1, 1, 1, 1)) as slam:\n"
                           "    x: str = slam.room().t_ns\n")
        self.assertIn(":3: error", lines[0])

    def test_errors_stand_at_the_top_alone(self):
        stub = (pathlib.Path(ygslam.__file__).parent / "_core.pyi").read_text(encoding="utf-8")
        self.assertEqual(len(re.findall(r"^ *class Error\(", stub, re.MULTILINE)), 1)


if __name__ == "__main__":
    unittest.main()
