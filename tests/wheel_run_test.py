"""`run` with the wheels of the camera's robot.

    YGSLAM_BINARY=build/release/ygslam python tests/wheel_run_test.py
"""
import pathlib
import shutil
import tempfile
import unittest

import mcap.writer
import numpy as np
from mcap.reader import make_reader

from bags import STORE
from ygslam_cli import CliTest, ygslam

RENDER = ("--seconds", 9, "--fps", 20, "--size", "320x240", "--wheels", "--quiet",
          "--fault", "both:black@6s+2s", "--fault", "depth:empty@6s+2s")


def on_tf(bag, out, placed):
    """With the wheels' poses on /tf in place of their own topic. @param placed False: nothing on /tf_static."""
    types = STORE.types
    with bag.open("rb") as source, out.open("wb") as target:
        writer = mcap.writer.Writer(target, use_chunking=False)
        writer.start("ros2")
        schemas, channels = {}, {}

        def say(topic, schema, time_ns, data):
            if topic not in channels:
                if schema.name not in schemas:
                    schemas[schema.name] = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[topic] = writer.register_channel(topic, "cdr", schemas[schema.name])
            writer.add_message(channels[topic], time_ns, data, time_ns)

        reader = make_reader(source)
        (transforms,) = (s for s in reader.get_summary().schemas.values() if s.name == "tf2_msgs/msg/TFMessage")
        for schema, channel, message in reader.iter_messages():
            if channel.topic == "/tf_static" and not placed:
                continue
            if channel.topic != "/wheel_odometry":
                say(channel.topic, schema, message.log_time, message.data)
                continue
            said = STORE.deserialize_cdr(message.data, schema.name)
            at, turn = said.pose.pose.position, said.pose.pose.orientation
            moved = types["geometry_msgs/msg/TransformStamped"](
                said.header, said.child_frame_id, types["geometry_msgs/msg/Transform"](
                    types["geometry_msgs/msg/Vector3"](at.x, at.y, at.z), turn))
            say("/tf", transforms, message.log_time,
                bytes(STORE.serialize_cdr(types["tf2_msgs/msg/TFMessage"]([moved]), transforms.name)))
        writer.finish()
    return out


class WheelRuns(CliTest):
    """The lens of a robot is covered from 6 s to 8 s."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="ygslam wheels ")
        cls.addClassCleanup(folder.cleanup)
        cls.recording = pathlib.Path(folder.name) / "covered"
        cls.bag = pathlib.Path(folder.name) / "covered.mcap"
        done = ygslam("simulate", "robot_rounds", "--out", cls.recording, *RENDER, "--mcap", cls.bag)
        assert done.returncode == 0, done.stderr

    def copy(self, name):
        shutil.copytree(self.recording, self.folder / name)
        return self.folder / name

    def test_a_covered_lens_costs_no_pose(self):
        done, metrics, rows = self.run_on(self.recording)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("poses of the wheels; --odometry none leaves them out", done.stderr)
        self.assertIn("wheels: they agree with the camera", done.stderr)
        self.assertEqual(metrics["coverage"], 1)
        self.assertEqual([row["state"] for row in rows[120:160]], ["coasting"] * 40)  # then it sees what is new
        std_mm = [float(row["position_std_mm"]) for row in rows[120:160]]
        self.assertEqual(std_mm, sorted(std_mm))
        self.assertLess(std_mm[-1], 40)
        live = np.loadtxt(self.folder / "out" / "trajectory_live.txt")
        truth = np.loadtxt(self.recording / "groundtruth.txt")
        ways = [np.linalg.norm(poses[159, 1:4] - poses[119, 1:4]) for poses in (truth, live)]
        self.assertGreater(ways[0], 0.5)
        self.assertLess(abs(ways[1] - ways[0]), 0.02)
        self.assertLess(metrics["ate"]["rmse"], 0.02)

    def test_covariances_say_how_far_it_may_be(self):
        self.run_on(self.recording, "--covariance")
        live, odom = (np.loadtxt(self.folder / "out" / name) for name in ("trajectory_live.txt", "odometry.txt"))
        self.assertEqual((live.shape, odom.shape), ((180, 29), (180, 29)))
        at = np.triu_indices(6)
        for rows in (live, odom):
            self.assertEqual(set(rows[0, 8:]), {0}, "the origin itself")
            for row in rows[1:]:
                matrix = np.zeros((6, 6))
                matrix[at] = row[8:]
                self.assertGreater(np.linalg.eigvalsh(matrix + np.triu(matrix, 1).T).min(), 0)
        spread = odom[:, 8] + odom[:, 14] + odom[:, 19]  # x, y, z
        self.assertEqual(list(spread[120:160]), sorted(spread[120:160]))
        self.assertGreater(spread[-1], spread[159] / 2, "odom keeps what it may have drifted in the dark")
        done = ygslam("eval", "--gt", self.recording / "groundtruth.txt", "--est", self.folder / "out" / "odometry.txt")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.run_on(self.recording)
        self.assertFalse((self.folder / "out" / "odometry.txt").exists())

    def test_without_them_the_camera_is_lost(self):
        _, metrics, rows = self.run_on(self.recording, "--odometry", "none")
        self.assertEqual([row["state"] for row in rows[120:160]], ["lost"] * 40)
        self.assertEqual(metrics["coasting"], 0)

    def test_what_is_there_is_told(self):
        folder = self.copy("placeless")
        (folder / "odom.yaml").unlink()
        done, metrics, _ = self.run_on(folder)
        self.assertIn("odom.csv: not used: there is no odom.yaml", done.stderr)
        self.assertEqual(metrics["coasting"], 0)
        place = ("--odometry-calibration", self.recording / "odom.yaml")
        self.assertGreaterEqual(self.run_on(folder, *place)[1]["coasting"], 40)

    def test_a_bag_has_its_own(self):
        self.assertEqual(self.run_on(self.bag)[1]["coasting"], 0)
        place = ("--odometry-calibration", self.recording / "odom.yaml")
        done, metrics, _ = self.run_on(self.bag, *place, "--odometry", "/wheel_odometry")
        self.assertGreaterEqual(metrics.get("coasting", 0), 40, done.stderr)
        done, _, _ = self.run_on(self.bag, *place, "--odometry", "/no/topic")
        self.assertEqual(done.returncode, 4)
        self.assertIn("/no/topic", done.stderr)
        done, metrics, _ = self.run_on(self.bag, "--odometry", "/wheel_odometry")
        self.assertGreaterEqual(metrics.get("coasting", 0), 40, done.stderr)
        self.assertIn("the camera placed by /tf_static", done.stderr)

    def test_a_stream_has_its_own(self):
        done, metrics, _ = self.run_on_stream(self.bag)
        self.assertEqual(metrics["coasting"], 0)
        self.assertIn("/wheel_odometry may be of the wheels: --odometry /wheel_odometry uses it", done.stderr)
        topic = ("--odometry", "/wheel_odometry")
        for options in ((*topic, "--odometry-calibration", self.recording / "odom.yaml"), topic,
                        ("--odometry-calibration", "tf", *topic)):
            done, metrics, rows = self.run_on_stream(self.bag, *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("poses of the wheels come from /wheel_odometry", done.stderr)
            self.assertEqual([row["state"] for row in rows[120:160]], ["coasting"] * 40)
        done, _, _ = self.run_on_stream(self.bag, "--odometry", "/no/topic")
        self.assertEqual(done.returncode, 4)
        self.assertIn("no poses under --odometry /no/topic", done.stderr)
        self.assertEqual(self.run_on_stream(self.bag, "--odometry", "none")[1]["coasting"], 0)
        done, _, _ = self.run_on_stream(self.bag, *topic, "--odometry-calibration", self.folder / "missing.yaml")
        self.assertEqual(done.returncode, 3)

    def test_a_frame_of_tf_is_placed_as_a_topic_is(self):
        bag = on_tf(self.bag, self.folder / "tf.mcap", True)
        placeless = on_tf(self.bag, self.folder / "placeless.mcap", False)
        for run in (self.run_on, self.run_on_stream):
            for options in (("--odometry", "/tf:base_link"), ("--odometry", "/tf:base_link", "--odometry-calibration", "tf")):
                done, metrics, _ = run(bag, *options)
                self.assertGreaterEqual(metrics.get("coasting", 0), 40, done.stderr)
                self.assertIn("the camera placed by /tf_static", done.stderr)
            done, _, _ = run(placeless, *options)
            self.assertEqual(done.returncode, 3)
            self.assertIn("--odometry-calibration tf: of the frames 'base_link' and 'camera", done.stderr)
            self.assertEqual(done.stderr.count("error:"), 1, done.stderr)
            done, _, _ = run(bag, "--odometry", "/tf:nobody", "--odometry-calibration", "tf")
            self.assertEqual(done.returncode, 4)
            self.assertIn("no poses under --odometry /tf:nobody", done.stderr)

    def run_on_stream(self, bag, *options):
        with bag.open("rb") as stream:
            return self.run_on("-", *options, stdin=stream)

    def test_faulty_files_are_named(self):
        folder = self.copy("faulty")
        rows = np.loadtxt(self.recording / "odom.csv")
        place = (folder / "odom.yaml").read_text(encoding="utf-8")
        for change, words in ((lambda t, p: (t, 1000 * p), "which no robot drives"),
                              (lambda t, p: (t[0] + 1e3 * (t - t[0]), p), "s apart, which no wheels' are")):
            stamps, ways = change(rows[:, 0], rows[:, 1:4])
            np.savetxt(folder / "odom.csv", np.c_[stamps, ways, rows[:, 4:]], fmt="%.9f")
            done, _, _ = self.run_on(folder)
            self.assertEqual(done.returncode, 4, words)
            self.assertIn(f"{folder}/odom.csv: ", done.stderr)
            self.assertIn(words, done.stderr)
        shutil.copy(self.recording / "odom.csv", folder)
        (folder / "odom.yaml").write_text(place.replace("way_noise", "way_nois"), encoding="utf-8")
        done, _, _ = self.run_on(folder)
        self.assertEqual(done.returncode, 3)
        self.assertIn("did you mean 'way_noise'?", done.stderr)
        done, _, _ = self.run_on(self.recording, "--odometry", "none", "--odometry-calibration", folder / "odom.yaml")
        self.assertEqual(done.returncode, 2)

    def test_another_times_wheels_are_not_taken_in_silence(self):
        folder = self.copy("late")
        rows = np.loadtxt(folder / "odom.csv")
        rows[:, 0] += 1e4
        np.savetxt(folder / "odom.csv", rows, fmt="%.9f")
        done, metrics, _ = self.run_on(folder)
        self.assertEqual((done.returncode, metrics["coasting"]), (0, 0))
        self.assertIn("odom.csv: none of it is of the images' time: not used", done.stderr)
        done, _, _ = self.run_on(folder, "--odometry", folder / "odom.csv")
        self.assertEqual(done.returncode, 4)
        done, _, _ = self.run_on(folder, "--odometry", folder)
        self.assertEqual(done.returncode, 4)
        self.assertIn("a folder; poses of the wheels are expected", done.stderr)

    def test_a_run_does_not_write_over_its_wheels(self):
        out = self.folder / "out"
        out.mkdir(exist_ok=True)
        shutil.copy(self.recording / "odom.csv", out / "odometry.txt")
        before = (out / "odometry.txt").read_bytes()
        done, _, _ = self.run_on(self.recording, "--odometry", out / "odometry.txt")
        self.assertEqual(done.returncode, 2)
        self.assertIn("is read (--odometry)", done.stderr)
        self.assertEqual((out / "odometry.txt").read_bytes(), before)

    def test_a_camera_that_looks_elsewhere_than_told_is_noticed(self):
        folder = self.copy("turned")
        lines = (folder / "odom.yaml").read_text(encoding="utf-8").splitlines()
        lines = [line for line in lines if "T_base_camera" not in line] + ["T_base_camera: [0, 0, 0.9, 0, 0, 0, 1]"]
        (folder / "odom.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
        done, metrics, _ = self.run_on(folder)
        self.assertEqual(done.stderr.count("warning: wheels: they tell another way than the camera sees"), 1)
        self.assertEqual(metrics["coasting"], 0)


if __name__ == "__main__":
    unittest.main()
