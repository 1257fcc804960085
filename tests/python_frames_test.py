"""What the Python module takes: frames as cameras and robots have them, and frames that nobody waits for.

    PYTHONPATH=build/release/python python tests/python_frames_test.py
"""
import time
import unittest

import numpy as np
import ygslam

from ygslam_cli import HEIGHT, WIDTH, CliTest, sequence


class FramesTest(CliTest):
    def setUp(self):
        super().setUp()
        self.frames = ygslam.open(sequence())

    def slam(self, **how):
        how = {"segmenter": "none", "deterministic": True, **how}
        return ygslam.Slam(self.frames.camera, **how)

    def results(self, slam, change):
        """Of the first frames, each as `change` hands it over."""
        return [slam.process(**change(f), t_ns=f.t_ns) for f in (self.frames[i] for i in range(6))]


class Images(FramesTest):
    def test_rows_may_be_apart_and_colours_the_other_way_round(self):
        plain = self.results(self.slam(), lambda f: {"rgb": f.rgb, "depth": f.depth})

        def odd(frame):
            rgb = np.zeros((HEIGHT, WIDTH + 5, 3), np.uint8)
            rgb[:, :WIDTH] = frame.rgb[:, :, ::-1]
            depth = np.zeros((HEIGHT, WIDTH + 8), np.float32)
            depth[:, 8:] = frame.depth
            return {"rgb": rgb[:, :WIDTH], "depth": depth[:, 8:], "order": "bgr"}
        for a, b in zip(plain, self.results(self.slam(), odd)):
            np.testing.assert_array_equal(a.pose, b.pose)

    def test_grey_is_enough(self):
        results = self.results(self.slam(), lambda f: {"rgb": f.rgb[:, :, 1].copy(), "depth": f.depth,
                                                       "order": "mono"})
        self.assertEqual({r.state for r in results}, {ygslam.State.TRACKING})

    def test_depth_of_a_camera_of_its_own(self):
        c = self.frames.camera
        half = ygslam.CameraModel(c.fx / 2, c.fy / 2, c.cx / 2, c.cy / 2, c.width // 2, c.height // 2)
        slam = self.slam(depth_camera=half, T_colour_depth=np.eye(4))
        results = self.results(slam, lambda f: {"rgb": f.rgb, "depth": f.depth[::2, ::2].copy()})
        self.assertEqual({r.state for r in results}, {ygslam.State.TRACKING})
        plain = self.results(self.slam(), lambda f: {"rgb": f.rgb, "depth": f.depth})
        np.testing.assert_allclose(results[-1].pose, plain[-1].pose, atol=0.03)
        with self.assertRaisesRegex(ValueError, "depth_camera"):
            self.slam(T_colour_depth=np.eye(4))
        with self.assertRaises(ygslam.ConfigError):
            self.slam(depth_camera=ygslam.CameraModel(0, 1, 1, 1))
        for bad, kind in ((np.eye(3), TypeError), (2 * np.eye(4), ValueError), (np.eye(4) * np.nan, ValueError)):
            with self.assertRaises(kind):
                self.slam(depth_camera=half, T_colour_depth=bad)

    def test_masks_of_ones_own(self):
        ids = np.zeros((HEIGHT, WIDTH), np.uint8)
        ids[:, WIDTH // 2:] = 1
        slam = self.slam(segmenter="frames", dynamic="semantic")
        results = self.results(slam, lambda f: {"rgb": f.rgb, "depth": f.depth, "instances": ids,
                                                "classes": ["person"], "scores": [0.8]})
        without = self.results(self.slam(dynamic="off"), lambda f: {"rgb": f.rgb, "depth": f.depth})
        self.assertEqual(results[-1].mask_age_frames, 0)
        self.assertLess(results[-1].static_points, 0.8 * without[-1].static_points)
        frame = self.frames[6]

        def refused(kind, **how):
            with self.assertRaises(kind) as error:
                slam.process(frame.rgb, frame.depth, frame.t_ns, **how)
            self.assertNotIn("\n", str(error.exception))
        refused(ygslam.InputError, instances=ids)
        refused(ygslam.InputError, instances=ids, classes=["ghost"])
        refused(ygslam.InputError, instances=ids, classes=["person"], scores=[float("nan")])
        refused(ygslam.InputError, classes=["person"])
        refused(ValueError, instances=ids, classes=["person"], scores=[1, 1])
        refused(ValueError, instances=ids[:5], classes=["person"])
        refused(TypeError, instances=ids.astype(np.int32), classes=["person"])
        refused(ValueError, order="yuv")
        refused(ValueError, T_last_camera=np.full((4, 4), np.nan))
        refused(TypeError, T_last_camera=np.eye(3))
        with self.assertRaises(ygslam.InputError):
            self.slam().process(frame.rgb, frame.depth, 1, instances=ids, classes=["person"])

    def test_odometry_is_a_start_for_the_search(self):
        def states(motion):
            slam, before = self.slam(dynamic="off"), self.frames[0]
            slam.process(before.rgb, before.depth, 1)
            return [slam.process(f.rgb, f.depth, 2 + i, T_last_camera=motion).state
                    for i, f in enumerate(self.frames[k] for k in range(1, 6))]
        for motion in (np.eye(4), np.array([[1, 0, 0, .05], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.]])):
            self.assertEqual(set(states(motion)), {ygslam.State.TRACKING})


class Pushed(FramesTest):
    def test_nobody_waits_and_the_newest_is_processed(self):
        slam = self.slam(deterministic=False)
        self.assertIsNone(slam.poll())
        for frame in self.frames:
            slam.push(frame.rgb, frame.depth, frame.t_ns)
        slam.finish()
        results = list(iter(slam.poll, None))
        self.assertEqual(results[-1].t_ns, self.frames[-1].t_ns)
        self.assertEqual(len(results) + results[-1].dropped_frames, len(self.frames))
        self.assertEqual([r.t_ns for r in results], sorted(r.t_ns for r in results))
        self.assertGreater(results[0].times_ms.all, 0)
        with self.assertRaises(ygslam.UsageError):
            slam.push(self.frames[0].rgb, self.frames[0].depth, self.frames[-1].t_ns + 1)

    def test_results_come_while_it_goes_on(self):
        slam, frame = self.slam(deterministic=False), self.frames[0]
        slam.push(frame.rgb, frame.depth, frame.t_ns)
        deadline, result = time.monotonic() + 60, None
        while result is None and time.monotonic() < deadline:
            result = slam.poll()
            time.sleep(0.005)
        self.assertEqual(result.t_ns, frame.t_ns)
        with self.assertRaises(ygslam.InputError):
            slam.push(frame.rgb, frame.depth, frame.t_ns)
        with self.assertRaises(ygslam.UsageError):
            slam.process(frame.rgb, frame.depth, frame.t_ns + 1)

    def test_where_am_i(self):
        slam = self.slam()
        first = self.frames[0]
        self.assertIsNone(slam.localise_now(first.rgb, first.depth, 0))
        for frame in self.frames:
            last = slam.process(frame.rgb, frame.depth, frame.t_ns)
        place = slam.localise_now(frame.rgb, frame.depth, 0)
        np.testing.assert_allclose(place, last.pose, atol=0.05)
        self.assertIsNone(slam.localise_now(np.zeros_like(frame.rgb), frame.depth, 0))


if __name__ == "__main__":
    unittest.main()
