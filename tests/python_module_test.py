"""The Python module: as good as the command line, and honest about wrong use.

    PYTHONPATH=build/release/python python tests/python_module_test.py
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

import numpy as np
import ygslam
from rosbags.rosbag2 import StoragePlugin
from scipy.spatial.transform import Rotation

import bag_test
from bags import STORE1, Messages, write_ros1, write_ros2
from ygslam_cli import ROOT, FRAMES, HEIGHT, WIDTH, CliTest, sequence, trajectory
from ygslam_cli import ygslam as ygslam_command


def absolute_path():
    """The environment, for a program that runs elsewhere."""
    folders = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    return {**os.environ, "PYTHONPATH": os.pathsep.join(os.path.abspath(f) for f in folders if f)}


class PythonModule(CliTest):
    def slam(self, **how):
        how = {"dynamic": "geometry", "deterministic": True, **how}
        return ygslam.Slam(self.frames.camera, **how)

    def setUp(self):
        super().setUp()
        self.frames = ygslam.open(sequence())

    def test_the_same_poses_as_the_command_line(self):
        slam = self.slam()
        for frame in self.frames:
            result = slam.process(frame.rgb, frame.depth, frame.t_ns, depth_t_ns=frame.depth_t_ns)
        self.assertEqual(result.state, ygslam.State.TRACKING)
        outcome = slam.finish()
        self.assert_ran(self.run_slam(sequence()))
        expected = trajectory(self.folder / "out" / "trajectory.txt")
        rows = np.array([[float(stamp), *pose] for stamp, pose in expected])
        self.assertEqual(outcome.trajectory.shape, (FRAMES, 8))
        np.testing.assert_allclose(outcome.trajectory[:, 1:4], rows[:, 1:4], atol=1e-8)
        np.testing.assert_allclose(np.abs((outcome.trajectory[:, 4:] * rows[:, 4:]).sum(axis=1)), 1,
                                   atol=1e-8)
        np.testing.assert_allclose(outcome.trajectory[:, 0], rows[:, 0], atol=1e-6)
        np.testing.assert_allclose(result.pose[:3, 3], outcome.trajectory[-1, 1:4], atol=0.05)
        np.testing.assert_allclose(result.pose[:3, :3] @ result.pose[:3, :3].T, np.eye(3), atol=1e-9)
        np.testing.assert_allclose(result.T_world_odom @ result.T_odom_camera, result.pose,
                                   atol=1e-9)
        self.assertEqual(outcome.points.shape, outcome.colors.shape)
        self.assertGreater(len(outcome.points), 1000)
        again = slam.finish()
        np.testing.assert_array_equal(again.trajectory, outcome.trajectory)
        ygslam.write_trajectory(self.folder / "written.txt", outcome.trajectory)
        self.assertEqual(len(trajectory(self.folder / "written.txt")), FRAMES)

    def test_the_same_numbers_as_the_command_line_whatever_is_known_of_the_shutter(self):
        for name, to, how in (("redkitchen_walk", 130, {"likely_device": "kinect_v1"}),
                              ("bonn_crowd_part", 30, {"shutter_guessed": True, "colour_readout_ms": 26})):
            folder = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared")).resolve() / "data" / name
            if not (folder / "rgb.txt").exists():
                self.skipTest(f"no recorded data at {folder}")
            frames = ygslam.open(folder)
            for key, value in how.items():
                self.assertEqual(getattr(frames.camera, key), value)
            learned = False
            with ygslam.Slam(frames.camera, segmenter="none", deterministic=True) as slam:
                for i in range(to):
                    frame = frames[i]
                    result = slam.process(frame.rgb, frame.depth, frame.t_ns, depth_t_ns=frame.depth_t_ns)
                    learned |= ygslam.Event.CAMERA_LEARNED in result.events
                ygslam.write_trajectory(self.folder / "python.txt", slam.finish().trajectory)
            self.assertEqual(learned, name == "redkitchen_walk")
            done = self.run_slam(folder, "--segmenter", "none", "--to", to, out=name)
            self.assert_ran(done)
            self.assertEqual("published times of a Microsoft Kinect" in done.stderr, learned)
            ours, theirs = ([(float(stamp), pose) for stamp, pose in trajectory(file)] for file in
                            (self.folder / "python.txt", self.folder / name / "trajectory.txt"))
            self.assertEqual(ours, theirs)

    def test_wrong_arguments_are_told_in_one_line(self):
        slam, frame = self.slam(options={"run.seed": 2, "depth.max_m": 8.0}), self.frames[0]
        for call, words in (
                (lambda: ygslam.Slam(self.frames.camera, segmentr="none"),
                 r"Slam\(\): no argument 'segmentr': did you mean segmenter\?"),
                (lambda: ygslam.Slam(), r"Slam\(\): argument 'camera' is missing"),
                (lambda: ygslam.Slam(self.frames.camera, deterministic=1), "deterministic: bool is expected, not int"),
                (lambda: ygslam.Slam({"fx": 1}), "camera: CameraModel is expected, not dict"),
                (lambda: ygslam.Slam(self.frames.camera, options={"run.seed": [2]}), r"options: run.seed: str \| float is expected, not list of 1"),
                (lambda: slam.process(frame.rgb, frame.depth, 1.5), r"Slam.process\(\): t_ns: int is expected, not float"),
                (lambda: slam.process(frame.rgb, frame.depth), "argument 't_ns' is missing"),
                (lambda: slam.process(frame.rgb, frame.depth, 1, 2), "3 arguments without a name are taken, not 4"),
                (lambda: slam.process(frame.rgb, frame.depth.astype(float), 1), "^depth: .*float32.* expected, not an array of float64"),
                (lambda: slam.process(None, frame.depth, 1), "rgb: an array of uint8 is expected, not None"),
                (lambda: self.frames[0:3], "index: int is expected, not slice"),
                (lambda: slam.process(frame.rgb, frame.depth, 2 ** 70), "t_ns: int is expected, not one so large"),
                (lambda: slam.process(frame.rgb, frame.depth, 1, rgb=frame.rgb), "argument 'rgb' is given twice"),
                (lambda: slam.push_imu(1, [0, 0], [0, 0, 0]), "wrong arguments: .*list of 2"),
                (lambda: slam.room().ray("here", [0, 0, 1]), "Room.ray")):
            with self.assertRaisesRegex(TypeError, words) as told:
                call()
            self.assertNotIn("\n", str(told.exception))
        with self.assertRaisesRegex(ValueError, r"shape \(\d+, \d+, 3\) is expected, .* not \(10, \d+, 3\)"):
            slam.process(frame.rgb[:10], frame.depth, 1)
        with self.assertRaisesRegex(ygslam.Error, "model, builtin, none, masks:DIR or frames"):
            self.slam(segmenter="buildin")
        self.assertEqual(slam.process(frame.rgb, frame.depth, np.int64(frame.t_ns)).state, ygslam.State.TRACKING)
        self.assertRegex(ygslam.__version__, r"^\d+\.\d+\.\d+")

    def test_arrays_are_views_of_the_frame(self):
        frame = self.frames[-1]
        self.assertEqual((frame.rgb.shape, frame.rgb.dtype), ((HEIGHT, WIDTH, 3), np.uint8))
        self.assertEqual((frame.depth.shape, frame.depth.dtype), ((HEIGHT, WIDTH), np.float32))
        self.assertEqual(frame.rgb.ctypes.data, frame.rgb.ctypes.data)
        rgb = frame.rgb
        before = rgb.copy()
        del frame  # the array keeps it alive
        np.testing.assert_array_equal(rgb, before)
        self.assertEqual(len(self.frames), FRAMES)
        with self.assertRaises(IndexError):
            self.frames[FRAMES]

    def test_raw_depth_is_metres_by_its_scale(self):
        metric, raw = self.slam(), self.slam()
        for frame in list(self.frames)[:10]:
            units = np.round(frame.depth * 5000).astype(np.uint16)
            in_metres = (units * (1 / 5000)).astype(np.float32)
            a = metric.process(frame.rgb, in_metres, frame.t_ns)
            b = raw.process(frame.rgb, units, frame.t_ns, depth_scale=5000)
            np.testing.assert_array_equal(a.pose, b.pose)

    def test_wrong_arrays_are_refused_in_words(self):
        slam, frame = self.slam(), self.frames[0]
        for rgb, depth, kind, words in (
                (frame.rgb[:10], frame.depth, ValueError, "rgb"),
                (frame.rgb, frame.depth[:, :9].copy(), ValueError, "depth"),
                (frame.rgb, frame.depth.astype(np.float64), TypeError, "float32"),
                (frame.rgb, frame.depth.T, ValueError, "shape"),
                (frame.rgb.transpose(2, 0, 1), frame.depth, ValueError, "shape"),
                (frame.rgb[:, :, ::-1], frame.depth, TypeError, "order"),
                (frame.rgb, frame.depth.astype(np.uint16), ValueError, "depth_scale"),
                (frame.rgb.astype(np.float32), frame.depth, TypeError, "rgb"),
                (frame.rgb[..., 0].copy(), frame.depth, TypeError, "3 dimensions"),
                (frame.rgb[:, ::-1], frame.depth, TypeError, "contiguous"),
                (None, None, TypeError, "rgb")):
            with self.assertRaises(kind) as refused:
                slam.process(rgb, depth, 1)
            self.assertIn(words, str(refused.exception))
        with self.assertRaisesRegex(ValueError, "float32 is in metres"):
            slam.process(frame.rgb, frame.depth * 1000, 1, depth_scale=1000)
        with self.assertRaisesRegex(ygslam.InputError, "depth_t_ns is more than a second from"):
            slam.process(frame.rgb, frame.depth, 1, depth_t_ns=2 * 10**9)
        self.assertEqual(slam.process(frame.rgb, frame.depth, 2).state, ygslam.State.TRACKING)

    def test_errors_have_the_codes_of_the_command_line(self):
        def code(call):
            with self.assertRaises(ygslam.Error) as failed:
                call()
            self.assertNotIn("\n", str(failed.exception).strip())
            self.assertIs(type(failed.exception), kinds[failed.exception.code])
            return failed.exception.code
        kinds = {2: ygslam.UsageError, 3: ygslam.ConfigError, 4: ygslam.InputError, 5: ygslam.ModelError,
                 6: ygslam.MapError, 9: ygslam.OutputError}
        self.assertEqual(code(lambda: ygslam.open(self.folder / "nowhere")), 4)
        self.assertEqual(code(lambda: self.slam(options={"orb.featurs": "3"})), 3)
        self.assertEqual(code(lambda: self.slam(dynamic="full", model="no.onnx")), 5)
        slam, frame = self.slam(), self.frames[0]
        slam.process(frame.rgb, frame.depth, 5)
        self.assertEqual(code(lambda: slam.process(frame.rgb, frame.depth, 5)), 4)
        slam.finish()
        self.assertEqual(code(lambda: slam.process(frame.rgb, frame.depth, 6)), 2)
        self.assertEqual(code(lambda: ygslam.run(self.folder / "nowhere", self.folder / "o")), 4)
        self.assertEqual(code(lambda: ygslam.run(sequence(), self.folder / "o", dynamic="fast")), 2)
        taken = self.folder / "taken"
        taken.touch()
        self.assertEqual(code(lambda: ygslam.run(sequence(), taken / "o", dynamic="off")), 9)
        self.assertEqual(code(lambda: self.slam(load_map=taken)), 6)

    def test_ctrl_c_ends_a_run_that_writes_what_there_is(self):
        script = ("import sys, ygslam\ntry:\n    ygslam.run(sys.argv[1], sys.argv[2], dynamic='off', view='0',"
                  " view_paused=True)\nexcept KeyboardInterrupt:\n    sys.exit(77)\n")
        child = subprocess.Popen([sys.executable, "-c", script, sequence(), self.folder / "out"])
        self.addCleanup(child.kill)
        deadline = time.monotonic() + 60
        while not (self.folder / "out").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(1)  # it is in the middle of things
        child.send_signal(signal.SIGINT)
        self.assertEqual(child.wait(60), 77)
        self.assertTrue((self.folder / "out" / "metrics.json").exists())

    def test_others_work_while_it_works_and_may_not_use_it(self):
        slam, frames = self.slam(deterministic=True), list(self.frames)
        counted, busy, done = [0], [], threading.Event()

        def count():
            while not done.is_set():
                counted[0] += 1
                if counted[0] % 1000 == 0:
                    try:
                        slam.map()
                    except RuntimeError as error:
                        busy.append(str(error))
        other = threading.Thread(target=count)
        other.start()
        tracked = 0
        for i, frame in enumerate(frames):
            try:
                slam.process(frame.rgb, frame.depth, 1 + i)
                tracked += 1
            except RuntimeError as error:
                busy.append(str(error))
        done.set()
        other.join()
        self.assertGreater(counted[0], 1000, "the lock was not released")
        self.assertTrue(busy, "nobody was told that it is in use")
        self.assertTrue(all("another thread" in line for line in busy))
        self.assertGreater(tracked, 0)

    def test_a_page_shows_the_run(self):
        self.assertEqual(self.slam().view_url, "")
        slam = self.slam(view="127.0.0.1:0")
        with urllib.request.urlopen(slam.view_url, timeout=60) as page:
            self.assertIn("<html", page.read().decode())
        frame = next(iter(self.frames))
        slam.process(frame.rgb, frame.depth, frame.t_ns)
        slam.finish()
        with self.assertRaises(ygslam.Error):
            self.slam(view="nowhere")

    def test_maps_go_from_run_to_run(self):
        with self.slam() as first:
            for frame in self.frames:
                first.process(frame.rgb, frame.depth, frame.t_ns)
            snapshot = first.map()
            self.assertEqual(snapshot.keyframes.shape[1], 8)
            self.assertEqual(snapshot.landmarks.shape[1], 3)
            first.save_map(self.folder / "room.map")
        second = self.slam(load_map=self.folder / "room.map", localize_only=True)
        states = [second.process(f.rgb, f.depth, f.t_ns).state for f in self.frames]
        self.assertIn(ygslam.State.TRACKING, states)
        second.reset()

    def test_the_commands_are_functions(self):
        metrics = ygslam.run(sequence(), self.folder / "out", deterministic=True,
                             dynamic="geometry", set={"run.seed": 2})
        self.assertEqual(metrics["frames"], FRAMES)
        report = ygslam.evaluate(sequence() / "groundtruth.txt",
                                 self.folder / "out" / "trajectory.txt")
        self.assertLess(report["ate"]["rmse"], 0.05)

    def test_types_are_told(self):
        package = pathlib.Path(ygslam.__file__).parent
        self.assertTrue((package / "py.typed").exists())
        self.assertIn("def process(", (package / "_core.pyi").read_text(encoding="utf-8"))
        with tempfile.TemporaryDirectory() as folder:
            use = pathlib.Path(folder, "use.py")
            use.write_text("import ygslam\n"
                           "s = ygslam.Slam(ygslam.CameraModel(fx=1, fy=1, cx=1, cy=1))\n"
                           "try:\n    x: int = s.finish().trajectory.shape[0]\n"
                           "except ygslam.InputError as e:\n    code: int = e.code\n"
                           "wrong: str = s.map().landmarks.ndim\n", encoding="utf-8")
            # mypy finds installed packages by itself, and refuses to be shown their folder.
            is_installed = "site-packages" in package.parts
            paths = {} if is_installed else {"MYPYPATH": str(package.parent)}
            done = subprocess.run([sys.executable, "-m", "mypy", "--no-incremental", use],
                                  capture_output=True, text=True, check=False, cwd=folder,
                                  env={**os.environ, **paths})
        lines = [line for line in done.stdout.splitlines() if ": error:" in line]
        self.assertEqual(len(lines), 1, done.stdout)
        self.assertIn("use.py:7", lines[0])


class PythonImu(CliTest):
    """The lens is covered from 3 s to 4 s."""

    def test_readings_carry_the_pose_through_the_dark(self):
        recording = self.folder / "covered"
        done = ygslam_command("simulate", "walking_xyz", "--without", "people", "--out", recording, "--seconds", 5,
                              "--fps", 20, "--size", "320x240", "--imu", "BMI085", "--fault", "both:black@3s+1s",
                              "--fault", "depth:empty@3s+1s", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        imu = ygslam.Imu.read(recording / "imu.yaml")
        self.assertAlmostEqual(imu.rate_hz, 200)
        self.assertIn("Imu(200 Hz", repr(imu))
        frames = ygslam.open(recording)
        readings = np.loadtxt(recording / "imu.csv", delimiter=",", skiprows=1)
        states, at = [], 0
        with ygslam.Slam(frames.camera, segmenter="none", deterministic=True, imu=imu) as slam:
            for frame in frames:
                while at < len(readings) and readings[at, 0] < frame.t_ns + 10_000_000:
                    slam.push_imu(int(readings[at, 0]), readings[at, 1:4], readings[at, 4:7])
                    at += 1
                states.append(slam.process(frame.rgb, frame.depth, frame.t_ns).state)
        self.assertEqual(states[60:80], [ygslam.State.COASTING] * 20)

    def test_wrong_use_is_refused(self):
        camera = ygslam.open(sequence()).camera
        with ygslam.Slam(camera, segmenter="none") as slam, self.assertRaisesRegex(ygslam.UsageError, "without the imu of the settings"):
            slam.push_imu(0, [0, 0, 0], [0, 0, 9.8])
        with ygslam.Slam(camera, segmenter="none", imu=ygslam.Imu(np.eye(4))) as slam:
            with self.assertRaisesRegex(ygslam.InputError, "not finite"):
                slam.push_imu(0, [0, float("nan"), 0], [0, 0, 9.8])
        with self.assertRaisesRegex(ygslam.ConfigError, "rate_hz"):
            ygslam.Slam(camera, segmenter="none", imu=ygslam.Imu(np.eye(4), rate_hz=0))
        with self.assertRaisesRegex(ygslam.ConfigError, "no/imu.yaml"):
            ygslam.Imu.read("no/imu.yaml")

    def test_wheels_carry_it_through_the_dark(self):
        recording = self.folder / "wheels"
        done = ygslam_command("simulate", "robot_rounds", "--out", recording, "--seconds", 7, "--fps", 20, "--size",
                              "320x240", "--wheels", "--fault", "both:black@6s+1s", "--fault", "depth:empty@6s+1s",
                              "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        wheels = ygslam.Wheels.read(recording / "odom.yaml")
        self.assertAlmostEqual(wheels.T_base_camera[2, 3], 0.9)
        frames, told = ygslam.open(recording), np.loadtxt(recording / "odom.csv")
        states, at = [], 0
        with ygslam.Slam(frames.camera, segmenter="none", deterministic=True, wheels=wheels) as slam:
            for frame in frames:
                while at < len(told) and told[at, 0] < 1e-9 * frame.t_ns + 0.02:
                    T_odom_base = np.eye(4)
                    T_odom_base[:3, :3], T_odom_base[:3, 3] = Rotation.from_quat(told[at, 4:]).as_matrix(), told[at, 1:4]
                    slam.push_odometry(round(1e9 * told[at, 0]), T_odom_base)
                    at += 1
                states.append(slam.process(frame.rgb, frame.depth, frame.t_ns).state)
        self.assertEqual(states[120:140], [ygslam.State.COASTING] * 20)
        with ygslam.Slam(frames.camera, segmenter="none") as slam:
            with self.assertRaisesRegex(ygslam.UsageError, "without the wheels of the settings"):
                slam.push_odometry(0, np.eye(4))
        with ygslam.Slam(frames.camera, segmenter="none", wheels=wheels) as slam:
            with self.assertRaisesRegex(ValueError, "T_odom_base"):
                slam.push_odometry(0, np.full((4, 4), np.nan))
        with self.assertRaisesRegex(ygslam.ConfigError, "wheels: way_scale"):
            ygslam.Slam(frames.camera, segmenter="none", wheels=ygslam.Wheels(np.eye(4), way_scale=1000))


class TenLines(bag_test.BagTest):
    """Those of docs/python.md, as they stand there, on bags written by `rosbags`."""

    def test_they_run_on_bags_of_ros_2_and_ros_1(self):
        page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
        lines, = [block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL)
                  if "office_bag" in block]
        self.assertLessEqual(len(lines.splitlines()), 10)
        self.run_bag(self.seq, out="folder")
        rows = trajectory(self.folder / "folder" / "trajectory.txt")
        expected = np.array([pose[:3] for _, pose in rows])

        def ros2(plugin):
            return lambda bag: write_ros2(bag, self.said(), plugin)

        def ros1(bag):
            self.messages = Messages(STORE1)
            return write_ros1(bag, self.said())
        for number, write in enumerate((ros2(StoragePlugin.SQLITE3), ros2(StoragePlugin.MCAP), ros1)):
            with self.subTest(number=number):
                here = self.folder / f"as_user_{number}"
                here.mkdir()
                write(here / "office_bag")
                done = subprocess.run([sys.executable, "-c", lines], cwd=here, capture_output=True,
                                      text=True, check=False, env=absolute_path())
                self.assertEqual(done.returncode, 0, done.stderr)
                said = done.stdout.splitlines()
                self.assertEqual(len(said), len(rows) + 1)
                self.assertIn("TRACKING", said[-2])
                self.assertRegex(said[-1], rf"^{len(rows)} poses, \d\d\d+ points")
                found = np.array([pose[:3] for _, pose in trajectory(here / "office.txt")])
                np.testing.assert_allclose(found, expected, atol=0.02)


if __name__ == "__main__":
    unittest.main()
