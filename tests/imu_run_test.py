"""`run` with the camera's IMU.

    YGSLAM_BINARY=build/release/ygslam YGSLAM_SEQUENCE=FOLDER python tests/imu_run_test.py
"""
import dataclasses
import json
import pathlib
import re
import shutil
import tempfile
import unittest

import mcap.writer
import numpy as np
from mcap.reader import make_reader

from bags import STORE
from ygslam_cli import ROOT, CliTest, lines_of, ygslam

DARK = ("--fault", "both:black@3s+1s", "--fault", "depth:empty@3s+1s")
NO_VECTOR = STORE.types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
RENDER = ("--seconds", 5, "--fps", 20, "--size", "320x240", "--imu", "BMI085", "--quiet")


def rewritten(bag, out, change):
    """@param change (topic, message) to the messages by topic in its place; None: it stays."""
    with bag.open("rb") as source, out.open("wb") as target:
        writer = mcap.writer.Writer(target, use_chunking=False)
        writer.start("ros2")
        schemas, channels = {}, {}
        for schema, channel, message in make_reader(source).iter_messages(log_time_order=False):
            changed = None
            if channel.topic == "/tf_static" or schema.name == "sensor_msgs/msg/Imu":
                changed = change(channel.topic, STORE.deserialize_cdr(message.data, schema.name))
            contents = {channel.topic: message.data} if changed is None else {
                topic: bytes(STORE.serialize_cdr(one, schema.name)) for topic, one in changed.items()}
            for topic, data in contents.items():
                if schema.name not in schemas:
                    schemas[schema.name] = writer.register_schema(schema.name, schema.encoding, schema.data)
                if topic not in channels:
                    channels[topic] = writer.register_channel(topic, channel.message_encoding, schemas[schema.name])
                writer.add_message(channels[topic], message.log_time, data, message.publish_time)
        writer.finish()
    return out


def in_halves(bag, out):
    """With a topic each for gyroscope and accelerometer, as a RealSense has them: the latter tells more seldom."""
    count = 0

    def change(topic, whole):
        nonlocal count
        if topic != "/imu":
            return None
        count += 1
        halves = {"/camera/gyro/sample": dataclasses.replace(whole, linear_acceleration=NO_VECTOR)}
        if count % 3 == 1:
            halves["/camera/accel/sample"] = dataclasses.replace(whole, angular_velocity=NO_VECTOR)
        return halves
    return rewritten(bag, out, change)


class ImuRuns(CliTest):
    """The lens is covered from 3 s to 4 s."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="ygslam imu ")
        cls.addClassCleanup(folder.cleanup)
        cls.recording, cls.bag = pathlib.Path(folder.name) / "covered", pathlib.Path(folder.name) / "covered.mcap"
        done = ygslam("simulate", "walking_xyz", "--without", "people", "--out", cls.recording, "--mcap", cls.bag, *RENDER,
                      *DARK)
        assert done.returncode == 0, done.stderr
        cls.placeless = rewritten(cls.bag, pathlib.Path(folder.name) / "placeless.mcap",
                                  lambda topic, _: {} if topic == "/tf_static" else None)

    def test_a_covered_lens_costs_no_pose(self):
        done, metrics, rows = self.run_on(self.recording)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("readings of the IMU; --imu none leaves them out", done.stderr)
        self.assertIn("(20 by IMU or wheels alone)", done.stdout + done.stderr)
        self.assertEqual(metrics["coverage"], 1)
        self.assertEqual(metrics["coasting"], 20)
        self.assertEqual([row["state"] for row in rows[60:80]], ["coasting"] * 20)
        self.assertEqual({row["provisional"] for row in rows[60:80]}, {"1"})
        std_mm = [float(row["position_std_mm"]) for row in rows[60:80]]
        self.assertEqual(std_mm, sorted(std_mm))
        self.assertLess(metrics["ate"]["rmse"], 0.02)

    def test_without_it_the_camera_is_lost(self):
        done, metrics, rows = self.run_on(self.recording, "--imu", "none")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([row["state"] for row in rows[60:80]], ["lost"] * 20)
        self.assertEqual({row["position_std_mm"] for row in rows[60:80]}, {""})
        self.assertEqual(metrics["coasting"], 0)

    def test_readings_without_a_place_are_told_and_not_used(self):
        folder = self.folder / "placeless"
        shutil.copytree(self.recording, folder)
        (folder / "imu.yaml").unlink()
        done, metrics, _ = self.run_on(folder)
        self.assertIn("imu.csv: not used: there is no imu.yaml", done.stderr)
        self.assertEqual(metrics["coasting"], 0)
        self.assertEqual(self.run_on(folder, "--imu-calibration", self.recording / "imu.yaml")[1]["coasting"], 20)
        (folder / "imu.csv").rename(folder / "imu.yaml")
        self.assertIn("imu.yaml: not used: there is no imu.csv", self.run_on(folder)[0].stderr)

    def test_a_bag_has_its_own(self):
        done, metrics, _ = self.run_on(self.bag)
        self.assertEqual(metrics["coasting"], 0)
        self.assertIn(": /imu may be of the IMU: --imu /imu uses it", done.stderr)
        self.assertNotIn("wheels", done.stderr, "/odometry is the truth of the camera")
        place = ("--imu-calibration", self.recording / "imu.yaml")
        done, metrics, _ = self.run_on(self.bag, *place)
        self.assertEqual(metrics.get("coasting"), 20, done.stderr)
        done, _, _ = self.run_on(self.bag, *place, "--imu", "/no/topic")
        self.assertEqual(done.returncode, 4)
        self.assertIn("/no/topic", done.stderr)

    def test_static_transforms_place_it(self):
        for run in (self.run_on, self.run_on_stream):
            for options in (("--imu", "/imu"), ("--imu-calibration", "tf")):
                done, metrics, _ = run(self.bag, *options)
                self.assertEqual(metrics.get("coasting"), 20, done.stderr)
                self.assertIn("the IMU placed by /tf_static", done.stderr)
                self.assertLess(self.error_of_run_m(), 0.02)
            done, _, _ = run(self.placeless, "--imu", "/imu")
            self.assertEqual(done.returncode, 2)
            self.assertIn("--imu /imu: of the frames 'imu' and 'camera", done.stderr)
            self.assertIn("--imu-calibration FILE.yaml says where the IMU is", done.stderr)
            done, _, _ = run(self.placeless, "--imu-calibration", "tf")
            self.assertEqual(done.returncode, 3)
            self.assertIn("--imu-calibration tf: of the frames", done.stderr)
            done, _, _ = run(self.placeless)
            self.assertIn("--imu /imu --imu-calibration FILE.yaml uses it", done.stderr)
        done, _, _ = self.run_on(self.recording, "--imu-calibration", "tf")
        self.assertEqual(done.returncode, 2)
        self.assertIn("imu.csv is a file, which names no frame", done.stderr)

    def test_a_stream_has_its_own(self):
        place = ("--imu-calibration", self.recording / "imu.yaml")
        done, metrics, rows = self.run_on_stream(self.bag, *place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("readings of the IMU come from /imu", done.stderr)
        self.assertEqual([row["state"] for row in rows[60:80]], ["coasting"] * 20)
        self.assertEqual(metrics["coasting"], 20)
        self.assertLess(self.error_of_run_m(), 0.02)
        again = self.run_on_stream(self.bag, *place)[2]
        self.assertEqual([row["position_std_mm"] for row in rows], [row["position_std_mm"] for row in again])
        done, metrics, _ = self.run_on_stream(self.bag)
        self.assertIn("/imu may be of the IMU: --imu /imu uses it", done.stderr)
        self.assertNotIn("wheels", done.stderr)
        self.assertEqual(metrics["coasting"], 0)
        self.assertEqual(self.run_on_stream(self.bag, "--imu", "none")[1]["coasting"], 0)
        done, _, _ = self.run_on_stream(self.bag, *place, "--imu", "/no/topic")
        self.assertEqual(done.returncode, 4)
        self.assertIn("no readings under --imu /no/topic; there are /imu", done.stderr)
        done, _, _ = self.run_on_stream(self.bag, *place, "--imu", self.recording / "imu.csv")
        self.assertEqual(done.returncode, 2)
        self.assertIn("imu.csv: a file; of a stream one of its topics is used", done.stderr)

    def test_halves_of_one_sensor_are_united_in_bags_and_streams(self):
        halves = in_halves(self.bag, self.folder / "halves.mcap")
        place = ("--imu-calibration", self.recording / "imu.yaml")
        for run in (self.run_on, self.run_on_stream):
            done, metrics, rows = run(halves, *place)
            self.assertEqual(metrics.get("coasting"), 20, done.stderr)
            self.assertEqual([row["state"] for row in rows[60:80]], ["coasting"] * 20)
            self.assertIn("/camera/gyro/sample and /camera/accel/sample: halves of one sensor", done.stderr)
            self.assertLess(self.error_of_run_m(), 0.02)
            told = run(halves)[0].stderr
            hint = re.search(r"may be of the IMU: --imu (\S+) uses it", told)
            self.assertIsNotNone(hint, told)
            for half in {hint[1], "/camera/gyro/sample", "/camera/accel/sample"}:
                done, metrics, _ = run(halves, "--imu", half)
                self.assertEqual(metrics.get("coasting"), 20, done.stderr)
        done, metrics, _ = self.run_on_stream(halves, "--imu-calibration", "tf")
        self.assertEqual(metrics.get("coasting"), 20, done.stderr)
        lone = rewritten(halves, self.folder / "lone.mcap",
                         lambda topic, _: {} if topic == "/camera/gyro/sample" else None)
        done, _, _ = self.run_on(lone, *place)
        self.assertEqual(done.returncode, 4, done.stderr)
        done, _, _ = self.run_on_stream(lone, *place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr.count("/accel/sample: an accelerometer alone; no angular velocity"), 1, done.stderr)

    def test_damage_of_a_bag_is_told_once(self):
        cut = self.folder / "cut.mcap"
        cut.write_bytes(self.bag.read_bytes()[:-100_000])
        done, _, _ = self.run_on(cut, "--imu", "/imu")
        self.assertEqual(done.returncode, 0, done.stderr)
        warnings = [line for line in done.stderr.splitlines() if line.startswith("warning: ") and "cut.mcap" in line]
        self.assertEqual(len(warnings), len(set(warnings)), done.stderr)
        self.assertGreater(len(warnings), 0)

    def test_of_several_topics_one_is_chosen(self):
        twice = rewritten(self.bag, self.folder / "twice.mcap",
                          lambda topic, whole: {"/a": whole, "/b": whole} if topic == "/imu" else None)
        place = ("--imu-calibration", self.recording / "imu.yaml")
        for run in (self.run_on, self.run_on_stream):
            done, _, _ = run(twice, *place)
            self.assertEqual(done.returncode, 4)
            self.assertRegex(done.stderr, "several topics have inertial readings: /a .*, /b .*; choose with --imu")
            self.assertEqual(run(twice, *place, "--imu", "/b")[1]["coasting"], 20)

    def error_of_run_m(self):
        """Of all poses, those of the covered second among them."""
        truth, found = self.recording / "groundtruth.txt", self.folder / "out" / "trajectory.txt"
        done = ygslam("eval", "--json", "--gt", truth, "--est", found)
        self.assertEqual(done.returncode, 0, done.stderr)
        told = json.loads(done.stdout)
        self.assertEqual(told["pairs"], len(lines_of(found)))
        return told["ate"]["rmse"]

    def run_on_stream(self, bag, *options):
        with bag.open("rb") as stream:
            return self.run_on("-", *options, stdin=stream)

    def test_faulty_files_are_named(self):
        folder = self.folder / "faulty"
        shutil.copytree(self.recording, folder)
        (folder / "imu.csv").write_text("1 2 3\n", encoding="utf-8")
        done, _, _ = self.run_on(folder)
        self.assertEqual(done.returncode, 4)
        self.assertIn("imu.csv:1: 3 columns", done.stderr)
        done, _, _ = self.run_on(self.recording, "--imu-calibration", self.recording / "calibration.txt")
        self.assertEqual(done.returncode, 3)
        self.assertIn("calibration.txt:", done.stderr)
        done, _, _ = self.run_on(self.recording, "--imu-calibration", self.folder / "missing.yaml")
        self.assertEqual(done.returncode, 3)
        self.assertIn("missing.yaml:", done.stderr)
        done, _, _ = self.run_on(self.recording, "--imu", "none", "--imu-calibration", self.recording / "imu.yaml")
        self.assertEqual(done.returncode, 2)

    def test_the_example_of_the_page_is_read(self):
        page = (ROOT / "docs" / "outputs.md").read_text(encoding="utf-8").split("### Keys of `imu.yaml`")[1].split("###")[0]
        example = [line.strip() for line in page.splitlines() if line.startswith("    ")]
        self.assertEqual(len(example), 6)
        place = self.folder / "example.yaml"
        place.write_text("\n".join(example) + "\n", encoding="utf-8")
        self.assertEqual(self.run_on(self.recording, "--imu-calibration", place)[1]["coasting"], 20)

    def test_a_sensor_that_is_turned_on_the_camera_is_told(self):
        told = (self.recording / "imu.yaml").read_text(encoding="utf-8")
        turned = self.folder / "turned.yaml"
        turned.write_text(re.sub(r"T_camera_imu: \[.*?\]", "T_camera_imu: [0.02, 0, 0, 0, 0, 0, 1]", told), encoding="utf-8")
        done, _, _ = self.run_on(self.recording, "--imu-calibration", turned)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"warning: IMU: .*\(are its axes(,| and) T_camera_imu")

    def test_swapped_axes_are_told(self):
        folder = self.folder / "swapped"
        shutil.copytree(self.recording, folder)
        head, *lines = (folder / "imu.csv").read_text(encoding="utf-8").splitlines()
        swapped = [",".join(np.array(line.split(","))[[0, 2, 1, 3, 5, 4, 6]]) for line in lines]  # x and y
        (folder / "imu.csv").write_text("\n".join([head, *swapped]) + "\n", encoding="utf-8")
        done, metrics, _ = self.run_on(folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("warning: IMU: it disagrees with what the camera sees", done.stderr)
        self.assertIn("are its axes, T_camera_imu", done.stderr)
        self.assertEqual(metrics["coasting"], 0)


if __name__ == "__main__":
    unittest.main()
