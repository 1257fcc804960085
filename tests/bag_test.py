"""Bags as sequences, written by the libraries of others: same frames, same bytes as from a folder.

    python tests/bag_test.py
"""
import contextlib
import json
import shutil
import sqlite3
import unittest

import mcap.writer
import numpy as np
from PIL import Image
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin

from bags import (DEPTH, INFO, RGB, STORE1, Messages, frames_of, png_bytes, recording, write_mcap,
                  write_ros1, write_ros2)
from ygslam_cli import HEIGHT, WIDTH, CliTest, lines_of, sequence, trajectory, ygslam

FRAMES = 15
RESULTS = ("trajectory.txt", "trajectory_live.txt", "keyframes.txt", "map.ply")


class BagTest(CliTest):
    """A folder whose depth is in millimetres, as bags have it, and its frames."""
    COUNT = FRAMES

    def setUp(self):
        super().setUp()
        self.seq = self.copy_sequence(frames=self.COUNT)
        shutil.rmtree(self.seq / "mask")
        (self.seq / "groundtruth.txt").unlink()
        for _, _, _, depth in self.pairs(self.seq):
            raw = np.asarray(Image.open(self.seq / depth)).astype(np.uint32)
            mm = ((raw + 2) // 5).astype(np.uint16)  # from 5000 to 1000 per metre
            (self.seq / depth).write_bytes(png_bytes(mm))
        rows = dict(line.split() for line in lines_of(self.seq / "calibration.txt"))
        self.camera = [float(rows[key]) for key in ("fx", "fy", "cx", "cy")]
        self.seq.joinpath("calibration.txt").write_text(
            "".join(f"{key} {rows[key]}\n" for key in ("fx", "fy", "cx", "cy"))
            + "depth_scale 1000\n", encoding="utf-8")
        self.frames = list(frames_of(self.seq, self.pairs(self.seq)))
        self.messages = Messages()

    def said(self, **how):
        return recording(self.messages, self.frames, self.camera, **how)

    def assert_same(self, out, other="folder"):
        for name in RESULTS:
            self.assertEqual((self.folder / out / name).read_bytes(),
                             (self.folder / other / name).read_bytes(), f"{out}/{name}")

    def run_bag(self, bag, *options, out="out", **how):
        done = self.run_slam(bag, *options, out=out, **how)
        self.assert_ran(done)
        return done


class McapBags(BagTest):
    def mcap(self, name="run.mcap", compression="zstd", said=None, **how):
        return write_mcap(self.folder / name, said or self.said(), compression, **how)

    def test_folder_and_bag_give_the_same_bytes(self):
        self.run_bag(self.seq, out="folder")
        self.assertEqual(len(trajectory(self.folder / "folder" / "trajectory.txt")), FRAMES)
        for rgb, depth, compression, how in (
                ("rgb8", "16UC1", "zstd", {}), ("bgr8", "32FC1", "lz4", {}),
                ("png", "compressedDepth", "", {}),
                ("bgra8", "big", "", {"use_chunking": False, "use_statistics": False})):
            with self.subTest(rgb=rgb, depth=depth, compression=compression):
                # no name to know it by
                bag = self.mcap("bag", compression, self.said(rgb=rgb, depth=depth), **how)
                self.run_bag(bag, out=rgb)
                self.assert_same(rgb)

    def test_one_that_was_cut_off_is_read_as_far_as_it_goes(self):
        whole = self.mcap().read_bytes()
        part = self.folder / "part.mcap"
        part.write_bytes(whole[:len(whole) * 2 // 3])
        self.assertIn("ends early", self.run_bag(part).stderr)
        frames = self.metrics()["frames"]
        self.assertGreater(frames, 4)
        self.assertLess(frames, FRAMES)

    def test_a_damaged_chunk_is_left_out(self):
        bag = self.mcap()
        data = bytearray(bag.read_bytes())
        data[len(data) // 2] ^= 0x55
        bag.write_bytes(data)
        self.assertIn("are left out, the first:", self.run_bag(bag).stderr)
        self.assertLess(self.metrics()["frames"], FRAMES)

    def test_which_topics_is_guessed_or_asked(self):
        more = [*self.said(), *self.said(rgb_topic="/other/image", depth_topic="/other/depth",
                                         info_topic=None)]
        bag = self.mcap(said=more)
        self.assert_error(self.run_slam(bag), 4, bag, RGB, "/other/image", "--rgb-topic")
        self.assert_error(self.run_slam(bag, "--rgb-topic", RGB), 4, bag, DEPTH, "/other/depth",
                          "--depth-topic")
        self.assert_error(self.run_slam(bag, "--rgb-topic", "/nothing"), 4, bag, "/nothing", RGB)
        self.run_bag(bag, "--rgb-topic", RGB, "--depth-topic", "/other/depth")
        self.assertEqual(self.metrics()["frames"], FRAMES)
        self.assert_error(self.run_slam(self.seq, "--rgb-topic", RGB, out="x"), 2, "is no bag",
                          out="x")

    def test_of_the_same_image_raw_and_compressed_the_raw_one_is_taken(self):
        more = [*self.said(), *self.said(rgb="png", depth="compressedDepth",
                                         rgb_topic=RGB + "/compressed",
                                         depth_topic=DEPTH + "/compressedDepth", info_topic=None)]
        self.run_bag(self.mcap(said=more), "--to", "3")
        self.assertEqual(self.metrics()["frames"], 3)

    def test_pictures_that_are_not_read_are_named(self):
        bag = self.folder / "foxglove.mcap"
        with open(bag, "wb") as file:
            writer = mcap.writer.Writer(file)
            writer.start("", "test")
            for topic, encoding in (("/front", "protobuf"), ("/rear", "json")):
                schema = writer.register_schema("foxglove.CompressedImage", encoding, b"{}")
                channel = writer.register_channel(topic, encoding, schema)
                writer.add_message(channel, 10**9, b"{}", 10**9)
            writer.finish()
        self.assert_error(self.run_slam(bag), 4, "not read: /front (foxglove.CompressedImage as protobuf), "
                          "/rear (foxglove.CompressedImage as json)")
        said = [(topic, stamp, message) for topic, stamp, message in self.said() if topic != RGB]
        for frame in self.frames:
            said.append((RGB, frame.stamp_ns, self.messages.image(frame.stamp_ns, "rgb16", frame.colour)))
        self.assert_error(self.run_slam(self.mcap(said=said)), 4, f"{RGB} ('rgb16')")

    def test_colour_in_other_encodings_is_told(self):
        said = [(topic, stamp, message) for topic, stamp, message in self.said() if topic != RGB]
        for frame in self.frames:
            said.append((RGB, frame.stamp_ns, self.messages.image(frame.stamp_ns, "8UC3", frame.colour[..., ::-1])))
        done = self.run_bag(self.mcap(said=said))
        self.assertIn("colour images are 8-bit 8UC3 (as b, g, r)", done.stderr)
        self.run_bag(self.seq, out="folder")
        self.assert_same("out")

    def test_the_camera_of_camera_goes_before(self):
        bag = self.mcap(said=self.said(info_topic=None))
        self.assert_error(self.run_slam(bag), 3, bag, "no CameraInfo", "--camera")
        file = self.folder / "camera.yaml"
        file.write_text("".join(f"{key}: {value}\n" for key, value in zip(
            ("fx", "fy", "cx", "cy"), self.camera)), encoding="utf-8")
        self.run_bag(self.seq, out="folder")
        self.run_bag(bag, "--camera", file)
        self.assert_same("out")

    def test_a_distortion_that_is_not_ours_is_refused(self):
        def with_info(model, terms):
            info = self.messages.info(1, self.camera, (WIDTH, HEIGHT), model, terms)
            return [(INFO, 1, info), *self.said(info_topic=None)]
        eight = (0.1, 0, 0, 0, 0, 0.2, 0, 0)
        for number, (model, terms) in enumerate((("rational_polynomial", eight),
                                                 ("equidistant", (0.1, 0, 0, 0)))):
            bag = self.mcap(f"{number}.mcap", said=with_info(model, terms))
            self.assert_error(self.run_slam(bag), 3, bag, INFO, "distortion")
        bag = self.mcap("fine.mcap", said=with_info("rational_polynomial", (0.1,) + (0.0,) * 7))
        self.run_bag(bag, "--to", "3")

    def test_what_is_no_sequence_is_refused(self):
        start = self.mcap().read_bytes()[:60]
        for name, data, part in (("text.mcap", b"a diary", "no recording that can be read"),
                                 ("empty.mcap", b"", "no recording that can be read: the file is empty"),
                                 ("magic.mcap", start[:8], "no topic with colour images: the recording holds no message"),
                                 ("head.mcap", start, "no topic with colour images")):
            with self.subTest(name=name):
                bag = self.folder / name
                bag.write_bytes(data)
                self.assert_error(self.run_slam(bag), 4, bag, part)
        only = [m for m in self.said() if m[0] == RGB]
        bag = self.mcap("colour.mcap", said=only)
        self.assert_error(self.run_slam(bag), 4, bag, "no topic with depth images", RGB)

    def test_a_camera_that_changes_is_told_and_one_that_is_not_calibrated_waits(self):
        said = list(self.said())
        infos = [message for topic, _, message in said if topic == INFO]
        infos[0].k[:] = 0
        self.run_bag(self.seq, "--to", "3", out="folder")
        self.assertNotIn("changes", self.run_bag(self.mcap(said=said), "--to", "3").stderr)
        self.assert_same("out")
        infos[-1].k[0] *= 2
        done = self.run_bag(self.mcap("other.mcap", said=said), "--to", "3")
        self.assertRegex(done.stderr, f"warning: .*{INFO} changes")
        self.assert_same("out")

    def test_stamps_that_are_all_negative_are_told(self):
        said = list(self.said())
        for topic, _, message in said:
            message.header.stamp.sec = -5
        bag = self.mcap(said=said)
        self.assert_error(self.run_slam(bag), 4, bag, RGB, "negative")

    def test_the_recording_that_is_read_is_not_replaced(self):
        bag = self.mcap()
        whole = bag.read_bytes()
        link = self.folder / "link.mcap"
        link.symlink_to(bag)
        folder = self.folder / "bag"
        folder.mkdir()
        part = folder / "part.mcap"
        part.write_bytes(whole)
        for read, written in ((bag, bag), (bag, link), (folder, part), (folder, folder / "new.mcap")):
            done = self.run_slam(read, "--mcap", written, "--export", self.folder / "scene", out="x")
            self.assert_error(done, 2, written, "is of the recording that is read", out="x")
            self.assertFalse((self.folder / "x").exists() or (self.folder / "scene").exists())
        self.assertEqual(bag.read_bytes(), whole)
        self.assertEqual(sorted(folder.iterdir()), [part])

    def test_depth_of_another_frame_is_told(self):
        said = [(t, s, m) for t, s, m in self.said()]
        for topic, _, message in said:
            if topic == DEPTH:
                message.header.frame_id = "depth_optical"
        done = self.run_bag(self.mcap(said=said), "--to", "3")
        self.assertIn("it is taken as registered; else give --depth-camera", done.stderr)

    def test_other_commands_take_it(self):
        bag = self.mcap()
        self.run_bag(bag, "--save-map", self.folder / "room.map")
        done = ygslam("localize", bag, "--map", self.folder / "room.map", "--out",
                      self.folder / "again", "--dynamic", "geometry")
        self.assert_ran(done)
        done = ygslam("inspect", bag, "--checks", "classic", "--to", "4")
        self.assert_ran(done)


class Ros2Bags(BagTest):
    def test_folder_and_bag_give_the_same_bytes(self):
        self.run_bag(self.seq, out="folder")
        for name, plugin, compression in (
                ("sqlite", StoragePlugin.SQLITE3, None), ("mcap", StoragePlugin.MCAP, None),
                ("packed", StoragePlugin.SQLITE3,
                 (CompressionMode.MESSAGE, CompressionFormat.ZSTD))):
            with self.subTest(name=name):
                bag = write_ros2(self.folder / f"{name}_bag", self.said(), plugin, compression)
                self.run_bag(bag, out=name)
                self.assert_same(name)
        files = [f for f in (self.folder / "sqlite_bag").iterdir() if f.suffix == ".db3"]
        self.run_bag(*files, "--to", "4", out="file")

    def test_a_bag_of_several_files_is_one(self):
        said = list(self.said())
        parts = [write_ros2(self.folder / f"part{i}", part, StoragePlugin.SQLITE3)
                 for i, part in enumerate((said[:len(said) // 2], said[len(said) // 2:]))]
        for part in parts:
            (file,) = part.glob("*.db3")
            shutil.copy(file, self.folder / "part0" / f"bag_{part.name[-1]}.db3")
        (self.folder / "part0" / "part0.db3").unlink()
        self.run_bag(self.folder / "part0")
        self.assertEqual(self.metrics()["frames"], FRAMES)

    def test_a_path_may_begin_with_two_slashes(self):
        bag = write_ros2(self.folder / "bag", self.said(), StoragePlugin.SQLITE3)
        (file,) = bag.glob("*.db3")
        self.run_bag(f"/{file}", "--to", "3")

    def test_one_compressed_as_a_whole_is_refused(self):
        bag = write_ros2(self.folder / "bag", self.said(), StoragePlugin.SQLITE3,
                         (CompressionMode.FILE, CompressionFormat.ZSTD))
        self.assert_error(self.run_slam(bag), 4, "bag.db3.zstd", "zstd -d")

    def test_a_damaged_or_foreign_database_is_told(self):
        bag = write_ros2(self.folder / "bag", self.said(), StoragePlugin.SQLITE3)
        (file,) = bag.glob("*.db3")
        data = file.read_bytes()
        file.write_bytes(data[:len(data) * 2 // 3])
        done = self.run_slam(bag)
        if done.returncode == 0:
            self.assertLess(self.metrics()["frames"], FRAMES)
            self.assertIn("as far as it goes", done.stderr)
        else:
            self.assert_error(done, 4, file)
        with contextlib.closing(sqlite3.connect(self.folder / "diary.db3")) as diary:
            diary.execute("CREATE TABLE days(text)")
            diary.commit()
        self.assert_error(self.run_slam(self.folder / "diary.db3", out="x"), 4, "diary.db3",
                          "no ROS 2 bag", out="x")
        self.folder.joinpath("hollow").mkdir()
        (self.folder / "hollow" / "metadata.yaml").write_text("x: 1\n", encoding="utf-8")
        self.assert_error(self.run_slam(self.folder / "hollow", out="x"), 4, "hollow",
                          "no file of a bag", out="x")


class Ros1Bags(BagTest):
    def setUp(self):
        super().setUp()
        self.messages = Messages(STORE1)

    def test_folder_and_bag_give_the_same_bytes(self):
        self.run_bag(self.seq, out="folder")
        for compression, rgb, depth in ((None, "rgb8", "16UC1"), ("BZ2", "png", "compressedDepth"),
                                        ("LZ4", "bgr8", "32FC1")):
            with self.subTest(compression=compression):
                bag = write_ros1(self.folder / f"{compression}.bag", self.said(rgb=rgb, depth=depth),
                                 compression)
                self.run_bag(bag, out=f"out{compression}")
                self.assert_same(f"out{compression}")

    def test_one_that_was_cut_off_is_read_as_far_as_it_goes(self):
        data = write_ros1(self.folder / "a.bag", self.said()).read_bytes()
        bag = self.folder / "cut.bag"
        bag.write_bytes(data[:len(data) // 2])
        self.assertIn("ends early", self.run_bag(bag).stderr)
        self.assertLess(self.metrics()["frames"], FRAMES)
        bag.write_bytes(data[:40])
        self.assert_error(self.run_slam(bag, out="x"), 4, bag, "no topic with colour images", out="x")

    def test_a_damaged_chunk_is_left_out(self):
        bag = write_ros1(self.folder / "a.bag", self.said(), "BZ2")  # which has checksums
        data = bytearray(bag.read_bytes())
        data[len(data) // 2] ^= 0x55
        bag.write_bytes(data)
        self.assertIn("are left out, the first:", self.run_bag(bag).stderr)
        self.assertLess(self.metrics()["frames"], FRAMES)


class Folders(BagTest):
    """Folders without lists: what belongs together is said by names."""

    def rename(self, name, colour, depth, camera=None):
        folder = self.folder / name
        for i, (_, old_colour, _, old_depth) in enumerate(self.pairs(self.seq)):
            for old, new in ((old_colour, colour.format(i)), (old_depth, depth.format(i))):
                (folder / new).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(self.seq / old, folder / new)
        for file, text in (camera or {}).items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text(text, encoding="utf-8")
        return folder

    def assert_like_the_folder(self, out):
        poses = [[pose for _, pose in trajectory(self.folder / name / "trajectory.txt")]
                 for name in (out, "folder")]
        self.assertEqual(len(poses[0]), FRAMES)
        np.testing.assert_allclose(poses[0], poses[1], atol=2e-3)

    def test_the_usual_patterns_are_recognised(self):
        self.run_bag(self.seq, out="folder")
        fx, fy, cx, cy = self.camera
        replica = json.dumps({"camera": dict(w=WIDTH, h=HEIGHT, fx=fx, fy=fy, cx=cx, cy=cy,
                                             scale=1000)})
        own = f"fx {fx}\nfy {fy}\ncx {cx}\ncy {cy}\ndepth_scale 1000\n"
        for name, colour, depth, camera in (
                ("replica", "results/frame{:06}.png", "results/depth{:06}.png",
                 {"../cam_params.json": replica}),
                ("scannet", "color/{}.png", "depth/{}.png",
                 {"intrinsic/intrinsic_color.txt":
                  f"{fx} 0 {cx} 0\n0 {fy} {cy} 0\n0 0 1 0\n0 0 0 1\n"}),
                ("own", "images/shot_{:03}.png", "depth/shot_{:03}.png", {"calibration.txt": own})):
            with self.subTest(name=name):
                self.run_bag(self.rename(name, colour, depth, camera), out=f"out_{name}")
                self.assert_like_the_folder(f"out_{name}")

    def test_what_a_run_recorded_beside_the_images_is_not_taken_for_them(self):
        own = self.rename("own", "rgb/{}.png", "depth/{}.png", {
            "calibration.txt": (self.seq / "calibration.txt").read_text(encoding="utf-8")})
        for _ in range(2):
            self.run_bag(own, "--to", "3", "--mcap", own / "run.mcap")
            self.assertEqual(self.metrics()["frames"], 3)

    def test_a_bag_in_a_folder_with_other_folders_stays_a_bag(self):
        folder = self.folder / "bags"
        for name in ("results", "depth", "rgb"):
            (folder / name).mkdir(parents=True)
        write_mcap(folder / "run.mcap", self.said())
        self.run_bag(folder, "--to", "3", out="bag")
        self.assertEqual(self.metrics("bag")["frames"], 3)

    def test_images_of_another_size_than_replicas_file_says_are_refused(self):
        fx, fy, cx, cy = self.camera
        folder = self.rename("replica", "results/frame{:06}.png", "results/depth{:06}.png", {
            "cam_params.json": json.dumps({"camera": dict(w=2 * WIDTH, h=2 * HEIGHT, fx=2 * fx, fy=2 * fy,
                                                          cx=2 * cx, cy=2 * cy, scale=1000)})})
        done = self.run_slam(folder)
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn(f"the camera is for {2 * WIDTH}x{2 * HEIGHT}", done.stderr)

    def test_without_a_camera_the_files_that_may_tell_it_are_named(self):
        folder = self.rename("own", "rgb/{}.png", "depth/{}.png")
        self.assert_error(self.run_slam(folder), 3, folder, "calibration.txt", "cam_params.json",
                          "--camera")

    def test_images_of_another_size_are_named(self):
        folder = self.rename("own", "rgb/{}.png", "depth/{}.png", {
            "calibration.txt": "fx 300\nfy 300\ncx 160\ncy 120\n"})
        for file in (folder / "depth").iterdir():
            file.write_bytes(png_bytes(np.zeros((12, 16), np.uint16)))
        done = self.run_slam(folder)
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn("other size: 16x12, expected 320x240", done.stderr)


if __name__ == "__main__":
    unittest.main()
