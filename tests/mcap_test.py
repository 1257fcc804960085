"""Recordings of a run (`--mcap`), read by the readers of others: mcap with mcap-ros2-support, rosbags.

    python tests/mcap_test.py
"""
import io
import os
import unittest

import numpy as np
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.records import Message
from mcap_ros2.decoder import DecoderFactory
from PIL import Image
from plyfile import PlyData
from rosbags.highlevel import AnyReader

from foxglove_layout import topics_of
from ygslam_cli import FRAMES, HEIGHT, WIDTH, CliTest, sequence, trajectory, ygslam

EVERY_FRAME = {"/tf", "/odometry", "/camera/image/compressed", "/camera/camera_info",
               "/camera/annotations", "/objects", "/state"}
OF_THE_MAP = {"/landmarks", "/path", "/loops", "/cloud", "/mesh", "/mesh/classes"}
DELETE_ALL, TRIANGLE_LIST = 3, 11  # of visualization_msgs/Marker
# x forward, y left, z up; of a point in the axes of an image
BODY_OPTICAL = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])


def messages(path):
    """Topic to its messages, decoded."""
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        of_topic = {}
        for _, channel, _, message in reader.iter_decoded_messages():
            of_topic.setdefault(channel.topic, []).append(message)
        count = reader.get_summary().statistics.message_count
    assert count == sum(map(len, of_topic.values()))
    return of_topic


def vector(v):
    return np.array([v.x, v.y, v.z])


def points(cloud):
    rows = np.frombuffer(cloud.data, np.uint8).reshape(cloud.width, cloud.point_step)
    return np.frombuffer(rows[:, :12].tobytes(), "<f4").reshape(-1, 3)


class Mcap(CliTest):
    def record(self, out="out", name="run.mcap", **how):
        file = self.folder / name
        how = {"timeout": 300, **how}
        done = self.run_slam(sequence(), "--segmenter", f"masks:{sequence() / 'mask'}", "--mcap",
                             file, out=out, geometry=False, **how)
        return file, done

    def test_it_holds_what_the_run_wrote(self):
        file, done = self.record()
        self.assert_ran(done)
        said = messages(file)
        self.assertEqual(set(said), EVERY_FRAME | OF_THE_MAP)
        for topic in EVERY_FRAME:
            self.assertEqual(len(said[topic]), FRAMES, topic)
        stamps = [round(m.header.stamp.sec * 1e6 + m.header.stamp.nanosec / 1e3)
                  for m in said["/odometry"]]
        live = trajectory(self.folder / "out" / "trajectory_live.txt")
        self.assertEqual(stamps, [round(1e6 * float(stamp)) for stamp, _ in live])

        for tf, (_, pose) in zip(said["/tf"], live):  # map -> odom -> camera is the pose delivered
            frames = {t.child_frame_id: t for t in tf.transforms}
            self.assertEqual({c: t.header.frame_id for c, t in frames.items()},
                             {"odom": "map", "camera": "odom", "camera_optical": "camera"})
            q = frames["odom"].transform.rotation
            u, t = np.array([q.x, q.y, q.z]), vector(frames["camera"].transform.translation)
            turned = t + 2 * np.cross(u, np.cross(u, t) + q.w * t)
            place = turned + vector(frames["odom"].transform.translation)
            np.testing.assert_allclose(place, BODY_OPTICAL @ pose[:3], atol=1e-6)

        image = np.asarray(Image.open(io.BytesIO(said["/camera/image/compressed"][-1].data)))
        self.assertEqual(image.shape, (HEIGHT, WIDTH, 3))
        shown = np.asarray(Image.open(sequence() / self.pairs(sequence())[-1][1]))
        self.assertLess(np.abs(image.astype(int) - shown).mean(), 6)

        mapped = PlyData.read(self.folder / "out" / "map.ply")["vertex"].data
        world = np.stack([mapped[axis] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(points(said["/cloud"][-1]), world @ BODY_OPTICAL.T, atol=1e-6)
        metrics = self.metrics()
        for topic in ("/mesh", "/mesh/classes"):  # at the end all of it, in one message
            first, *tiles = said[topic][-1].markers
            self.assertEqual(first.action, DELETE_ALL)
            self.assertEqual({m.type for m in tiles}, {TRIANGLE_LIST})
            corners = np.array([vector(p) for m in tiles for p in m.points])
            for end in (np.min, np.max):
                np.testing.assert_allclose(end(corners, axis=0), end(world @ BODY_OPTICAL.T, axis=0),
                                           atol=0.06)
        self.assertIn("floor", {m.ns for m in said["/mesh/classes"][-1].markers})
        self.assertEqual(said["/landmarks"][-1].width, metrics["landmarks"])
        self.assertEqual(len(said["/path"][-1].poses), metrics["keyframes"])
        self.assertEqual({m.status[0].message for m in said["/state"]}, {"tracking"})
        self.assertTrue(any(m.texts for m in said["/camera/annotations"]), "nobody has a name")
        self.assertTrue(any(len(m.markers) > 1 for m in said["/objects"]), "nobody has a box")

    def test_the_layout_for_foxglove_shows_topics_of_a_recording(self):
        topics = topics_of("recording")
        self.assertLessEqual(topics, EVERY_FRAME | OF_THE_MAP)
        self.assertGreater(len(topics), 9)

    def test_recording_changes_nothing_and_is_the_same_again(self):
        first, done = self.record()
        self.assert_ran(done)
        second, done = self.record(out="again", name="again.mcap")
        self.assert_ran(done)
        alone = self.run_slam(sequence(), "--segmenter", f"masks:{sequence() / 'mask'}",
                              out="alone", geometry=False)
        self.assert_ran(alone)
        for name in ("trajectory.txt", "trajectory_live.txt", "map.ply"):
            self.assertEqual((self.folder / "out" / name).read_bytes(),
                             (self.folder / "alone" / name).read_bytes(), name)
        images = [messages(file)["/camera/image/compressed"] for file in (first, second)]
        self.assertEqual(*[[bytes(m.data) for m in of] for of in images])

    def test_rosbags_reads_it_as_a_ros_2_bag(self):
        file, done = self.record()
        self.assert_ran(done)
        with AnyReader([file]) as reader:
            types = {c.topic: c.msgtype for c in reader.connections}
            self.assertEqual(types["/camera/image/compressed"], "sensor_msgs/msg/CompressedImage")
            self.assertEqual(types["/objects"], "visualization_msgs/msg/MarkerArray")
            seen = 0
            for connection, _, raw in reader.messages():
                reader.deserialize(raw, connection.msgtype)
                seen += 1
        self.assertEqual(seen, sum(map(len, messages(file).values())))

    def test_one_that_was_cut_off_is_readable_up_to_there(self):
        file, done = self.record()
        self.assert_ran(done)
        whole = file.read_bytes()
        read = 0
        try:
            stream = StreamReader(io.BytesIO(whole[:len(whole) * 2 // 3]))
            for record in stream.records:
                read += isinstance(record, Message)
        except Exception:  # noqa: BLE001 - the end, as the reader says it
            pass
        self.assertGreater(read, FRAMES)

    def test_what_is_no_recording_is_not_replaced(self):
        precious = self.folder / "run.mcap"
        precious.write_text("a diary", encoding="utf-8")
        _, done = self.record()
        self.assert_error(done, 9, precious, "not replaced")
        self.assertEqual(precious.read_text(encoding="utf-8"), "a diary")

    def test_standard_output_is_no_file(self):
        for done in (self.run_slam(sequence(), "--to", "3", "--mcap", "-"),
                     ygslam("simulate", "walking_xyz", "--seconds", "1", "--mcap", "-")):
            self.assert_error(done, 2, "-: ", "standard output")
        self.assertFalse(os.path.exists("-"))

    def test_a_folder_that_is_not_there_is_told(self):
        _, done = self.record(name="nowhere/run.mcap")
        self.assert_error(done, 9, "nowhere/run.mcap", "No such file")

    def test_it_may_lie_in_the_new_folder_of_the_run(self):
        self.assert_ran(self.run_slam(sequence(), "--to", 5, "--mcap", self.folder / "out" / "run.mcap"))
        self.assertGreater((self.folder / "out" / "run.mcap").stat().st_size, 10_000)
        deeper = self.folder / "other" / "below" / "run.mcap"
        self.assert_error(self.run_slam(sequence(), "--mcap", deeper, out="other"), 9, deeper, out="other")

    def test_a_pipe_is_not_waited_for_and_no_empty_map_is_left(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        saved = self.folder / "room.map"
        for target in (pipe, self.folder, "/dev/null"):
            done = self.run_slam(sequence(), "--to", "3", "--mcap", target, "--save-map", saved)
            self.assert_error(done, 9, target, "not replaced")
            self.assertFalse(saved.exists())

    def test_help_names_it(self):
        self.assertIn("--mcap FILE", ygslam("run", "--help").stdout)


if __name__ == "__main__":
    unittest.main()
