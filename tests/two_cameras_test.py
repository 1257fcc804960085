"""Depth that is taken by a camera of its own is registered to colour, whatever it comes in.

    python tests/two_cameras_test.py
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import mcap.reader
import mcap_ros2.decoder
import numpy as np
from PIL import Image
from rosbags.typesys import get_types_from_msg

import camera_recordings as made
from bags import RGB, STORE1, Messages, frames_of, write_mcap, write_ros1
from ygslam_cli import BINARY, HANG_S, ROOT, CliTest, lines_of, trajectory, ygslam

DEPTH, DEPTH_INFO, RGB_INFO = ("/camera/depth/image_rect_raw", "/camera/depth/camera_info",
                               "/camera/color/camera_info")
COLOUR_FRAME, DEPTH_FRAME = "camera_color_optical_frame", "camera_depth_optical_frame"
STORE1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms",
                                   "tf2_msgs/msg/TFMessage"))
FRAMES = 15
LENS = (212.0, 212.5, 211.5, 119.5)
SIZE = (424, 240)
PLACE_M, TURN = (0.015, 0.001, -0.0005), (0.0, 0.006, 0.0, 0.999982)  # x y z w
DEPTH_CAMERA = ("".join(f"{key} {value}\n" for key, value in zip(
    ("fx", "fy", "cx", "cy", "width", "height", "depth_scale"), (*LENS, *SIZE, 1000)))
    + "T_colour_depth " + " ".join(map(str, (*PLACE_M, *TURN))) + "\n")


def place_matrix():
    """T_colour_depth."""
    x, y, z, w = TURN
    place = np.eye(4)
    place[:3, :3] += 2 * np.array([[-y * y - z * z, x * y - z * w, x * z + y * w],
                                   [x * y + z * w, -x * x - z * z, y * z - x * w],
                                   [x * z - y * w, y * z + x * w, -x * x - y * y]])
    place[:3, 3] = PLACE_M
    return place


# Where the colour camera stands in its device.
DEVICE = np.array([[0, -1, 0, 0.3], [1, 0, 0, -0.1], [0, 0, 1, 0.2], [0, 0, 0, 1.0]])


class TwoCameras(CliTest):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="ygslam-two-")
        cls.addClassCleanup(folder.cleanup)
        depth_camera = pathlib.Path(folder.name, "depth_camera.txt")
        depth_camera.write_text(DEPTH_CAMERA, encoding="utf-8")
        cls.rendered = pathlib.Path(folder.name, "two")
        done = ygslam("simulate", "walking_xyz", "--out", cls.rendered, "--size", "320x240", "--seconds",
                      str(FRAMES / 30), "--format", "png", "--depth-camera", depth_camera)
        assert done.returncode == 0, done.stderr

    def setUp(self):
        super().setUp()
        self.depth_camera = self.folder / "depth_camera.txt"
        self.depth_camera.write_text(DEPTH_CAMERA, encoding="utf-8")
        self.seq = self.folder / "two"
        shutil.copytree(self.rendered, self.seq)
        rows = dict(line.split() for line in lines_of(self.seq / "calibration.txt"))
        self.colour_lens = [float(rows[key]) for key in ("fx", "fy", "cx", "cy")]
        self.frames = list(frames_of(self.seq, self.pairs(self.seq)))

    def run_once(self, source, *options, out):
        done = self.run_slam(source, *options, out=out)
        self.assert_ran(done)
        return done

    def poses(self, out):
        return np.array([pose for _, pose in trajectory(self.folder / out / "trajectory.txt")])

    def said(self, messages, transforms=True):
        """As a RealSense says it: both cameras hang on their device's frame."""
        def transform(parent, child, place_m, turn):
            types = messages.types
            return types["geometry_msgs/msg/TransformStamped"](
                messages.header(1, parent), child, types["geometry_msgs/msg/Transform"](
                    types["geometry_msgs/msg/Vector3"](*place_m),
                    types["geometry_msgs/msg/Quaternion"](*turn)))
        start_ns = self.frames[0].stamp_ns
        if transforms:
            both = messages.types["tf2_msgs/msg/TFMessage"]([
                transform("camera_link", COLOUR_FRAME, (0, 0.015, 0), (0, 0, 0, 1)),
                transform("camera_link", "camera_depth_frame", (0, 0.015, 0), (0, 0, 0, 1))])
            last = messages.types["tf2_msgs/msg/TFMessage"]([
                transform("camera_depth_frame", DEPTH_FRAME, PLACE_M, TURN)])
            yield "/tf_static", start_ns, both
            yield "/tf_static", start_ns, last
        for frame in self.frames:
            yield DEPTH_INFO, frame.stamp_ns, messages.info(frame.stamp_ns, LENS, SIZE,
                                                            frame=DEPTH_FRAME)
            yield DEPTH, frame.stamp_ns, messages.image(frame.stamp_ns, "16UC1", frame.depth_mm,
                                                        frame=DEPTH_FRAME)
            yield RGB_INFO, frame.stamp_ns, messages.info(frame.stamp_ns, self.colour_lens,
                                                          (320, 240), frame=COLOUR_FRAME)
            yield RGB, frame.stamp_ns, messages.image(frame.stamp_ns, "rgb8", frame.colour,
                                                      frame=COLOUR_FRAME)

    def test_folder_bags_and_pipe_see_the_same(self):
        done = self.run_once(self.seq, out="folder")
        self.assertIn("depth is registered to colour: 424x240 pixels of a camera 15.0 mm away",
                      done.stderr + self.log("folder"))
        metrics = self.metrics("folder")
        self.assertEqual(metrics["coverage"], 1)
        self.assertLess(metrics["ate"]["rmse"], 0.005)
        mcap = write_mcap(self.folder / "two.mcap", self.said(Messages()))
        self.run_once(mcap, out="mcap")
        # A bag does not say that the shutter is global, so that the camera is calibrated meanwhile.
        np.testing.assert_allclose(self.poses("mcap"), self.poses("folder"), atol=3e-3)
        self.run_once(write_ros1(self.folder / "two.bag", self.said(Messages(STORE1)), "LZ4"),
                      out="ros1")
        with open(mcap, "rb") as stream:
            piped = subprocess.run([BINARY, "run", "-", "--out", self.folder / "piped", "--dynamic",
                                    "geometry", "--deterministic"], stdin=stream, check=False,
                                   capture_output=True, text=True, timeout=HANG_S)
        self.assert_ran(piped)
        for out in ("ros1", "piped"):
            for name in ("trajectory.txt", "map.ply"):
                self.assertEqual((self.folder / out / name).read_bytes(),
                                 (self.folder / "mcap" / name).read_bytes(), f"{out}/{name}")

    def test_the_depth_camera_may_be_given(self):
        self.run_once(self.seq, out="folder")
        bag = write_mcap(self.folder / "two.mcap", self.said(Messages(), transforms=False))
        told = self.run_slam(bag, out="untold")
        self.assertIn("there is no transform between them", told.stderr)
        self.assertIn("other size: 424x240, expected 320x240", told.stderr)
        self.assertEqual(told.returncode, 4)
        self.run_once(bag, "--depth-camera", self.depth_camera, out="given")
        np.testing.assert_allclose(self.poses("given"), self.poses("folder"), atol=3e-3)
        (self.seq / "calibration_depth.txt").unlink()
        self.run_once(self.seq, "--depth-camera", self.depth_camera, out="other")
        self.assertEqual((self.folder / "other" / "trajectory.txt").read_bytes(),
                         (self.folder / "folder" / "trajectory.txt").read_bytes())

    def test_scannet_tells_of_its_depth_camera(self):
        self.run_once(self.seq, out="folder")
        export = self.folder / "scannet"
        for kind in ("color", "depth", "intrinsic"):
            (export / kind).mkdir(parents=True)
        for i, (_, colour, _, depth) in enumerate(self.pairs(self.seq)):
            shutil.copy(self.seq / colour, export / "color" / f"{i}.png")
            shutil.copy(self.seq / depth, export / "depth" / f"{i}.png")
        place = place_matrix()
        for name, lens in (("color", self.colour_lens), ("depth", LENS)):
            matrix = np.eye(4)
            matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2] = lens
            np.savetxt(export / "intrinsic" / f"intrinsic_{name}.txt", matrix)
        np.savetxt(export / "intrinsic" / "extrinsic_color.txt", DEVICE)
        np.savetxt(export / "intrinsic" / "extrinsic_depth.txt", DEVICE @ place)
        self.run_once(export, out="scannet_out")
        np.testing.assert_allclose(self.poses("scannet_out"), self.poses("folder"), atol=3e-3)
        np.savetxt(export / "intrinsic" / "extrinsic_depth.txt", 2 * place)
        self.assert_error(self.run_slam(export), 3, export, "extrinsic_depth.txt", "no rigid motion")

    def test_a_rendering_is_recorded_as_its_cameras_would(self):
        self.run_once(self.seq, out="folder")
        bag = self.folder / "rendered.mcap"
        self.assert_ran(ygslam("simulate", "walking_xyz", "--mcap", bag, "--size", "320x240",
                               "--seconds", str(FRAMES / 30), "--format", "png",
                               "--depth-camera", self.depth_camera))
        self.run_once(bag, out="bag")
        self.assertIn("depth is registered to colour: 424x240", self.log("bag"))
        np.testing.assert_allclose(self.poses("bag"), self.poses("folder"), atol=3e-3)
        said = {"/tf": [], "/tf_static": []}
        with open(bag, "rb") as stream:
            reader = mcap.reader.make_reader(
                stream, decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
            for _, channel, _, message in reader.iter_decoded_messages(topics=list(said)):
                said[channel.topic].append(message.transforms)
        truth = [transforms[1].transform.translation for transforms in said["/tf"]]
        (place,), = said["/tf_static"]
        self.assertEqual((place.header.frame_id, place.child_frame_id),
                         ("camera_optical", "depth_optical"))
        self.assertEqual(place.transform.translation.x, PLACE_M[0])
        self.assertEqual(len(truth), FRAMES)
        # Axes of REP 103: x forward, y left, z up.
        rows = [pose[:3] for _, pose in trajectory(self.seq / "groundtruth.txt")]
        self.assertAlmostEqual(np.linalg.norm(np.subtract(rows[-1], rows[0])),
                               np.linalg.norm((truth[-1].x, truth[-1].y, truth[-1].z)), places=4)
        np.testing.assert_allclose((truth[0].x, truth[0].y, truth[0].z), 0, atol=1e-12)

    def test_a_sens_file_is_converted_and_registered(self):
        self.run_once(self.seq, out="folder")
        recording = self.folder / "room.sens"
        recording.write_bytes(made.sens(self.frames, self.colour_lens, LENS, place_matrix(),
                                        T_device_colour=DEVICE))
        bag = self.folder / "room.mcap"
        subprocess.run([sys.executable, ROOT / "tools" / "convert_recording.py", recording, bag],
                       check=True, capture_output=True, timeout=HANG_S)
        self.run_once(bag, out="converted")
        self.assertIn("depth is registered to colour: 424x240 pixels of a camera 15.0 mm away",
                      self.log("converted"))
        np.testing.assert_allclose(self.poses("converted"), self.poses("folder"), atol=3e-3)

    def test_depth_that_is_registered_already_stays(self):
        """Aligned topics carry the frame of the depth camera with some drivers."""
        for depth in (self.seq / "depth").iterdir():  # of the colour camera's size
            Image.fromarray(np.asarray(Image.open(depth))[:, :320]).save(depth)
        self.frames = list(frames_of(self.seq, self.pairs(self.seq)))
        said = [(topic.replace("/camera/depth/", "/camera/aligned_depth_to_color/"), stamp, message)
                for topic, stamp, message in self.said(Messages())]
        done = self.run_once(write_mcap(self.folder / "aligned.mcap", said), out="aligned")
        self.assertNotIn("registered", done.stderr + self.log("aligned"))

    def test_in_a_stream_the_colour_cameras_lens_may_come_last(self):
        """Drivers send an image before its CameraInfo, and depth first."""
        self.run_once(self.seq, out="folder")
        said = list(self.said(Messages()))
        order = {"/tf_static": 0, DEPTH_INFO: 1, DEPTH: 2, RGB: 3, RGB_INFO: 4}
        bag = write_mcap(self.folder / "late.mcap", sorted(
            said, key=lambda entry: (entry[1], order[entry[0]])))
        with open(bag, "rb") as stream:
            piped = subprocess.run([BINARY, "run", "-", "--out", self.folder / "piped", "--dynamic",
                                    "geometry", "--deterministic"], stdin=stream, check=False,
                                   capture_output=True, text=True, timeout=HANG_S)
        self.assert_ran(piped)
        np.testing.assert_allclose(self.poses("piped"), self.poses("folder"), atol=3e-3)

    def test_the_scale_of_a_depth_camera_in_the_colour_cameras_place_counts(self):
        seq = self.copy_sequence(frames=5)
        self.run_once(seq, out="right")
        colour = seq / "calibration.txt"
        text = colour.read_text(encoding="utf-8")
        rows = dict(line.split() for line in lines_of(colour))
        same = self.folder / "same.txt"
        same.write_text("".join(f"{key} {rows[key]}\n" for key in ("fx", "fy", "cx", "cy"))
                        + "depth_scale 5000\nT_colour_depth 0 0 0 0 0 0 1\n", encoding="utf-8")
        colour.write_text(text.replace("depth_scale 5000", "depth_scale 2500"), encoding="utf-8")
        self.run_once(seq, "--depth-camera", same, out="told")
        self.assertEqual((self.folder / "told" / "trajectory.txt").read_bytes(),
                         (self.folder / "right" / "trajectory.txt").read_bytes())

    def test_faults_name_file_and_key(self):
        self.depth_camera.write_text("fx 1\n", encoding="utf-8")
        self.assert_error(self.run_slam(self.seq, "--depth-camera", self.depth_camera), 3,
                          self.depth_camera, "fy")
        missing = self.folder / "nowhere.txt"
        self.assert_error(self.run_slam(self.seq, "--depth-camera", missing), 3, missing)
        own = self.seq / "calibration_depth.txt"
        own.write_text(DEPTH_CAMERA.replace("212.0", "9000"), encoding="utf-8")
        self.assert_error(self.run_slam(self.seq), 3, own, "fx: must lie in")
        lens = self.folder / "camera.yaml"
        lens.write_text("fx: 300\nfy: 300\ncx: 160\ncy: 120\n", encoding="utf-8")
        done = self.run_slam(self.seq, "--camera", lens)
        self.assert_error(done, 3, own)
        self.assertNotIn(str(lens), done.stderr, "whose fault it is not")

    def test_sizes_that_do_not_fit_are_named(self):
        bag = write_mcap(self.folder / "two.mcap", self.said(Messages()))
        smaller = self.folder / "smaller.txt"
        smaller.write_text(DEPTH_CAMERA.replace("width 424", "width 400"), encoding="utf-8")
        said = "is for depth images of 400x240, the first has 424x240"
        self.assert_error(self.run_slam(bag, "--depth-camera", smaller), 3, smaller, said)
        with open(bag, "rb") as stream:
            piped = subprocess.run([BINARY, "run", "-", "--out", self.folder / "out", "--dynamic", "off",
                                    "--depth-camera", smaller], stdin=stream, check=False,
                                   capture_output=True, text=True, timeout=HANG_S)
        self.assert_error(piped, 3, smaller, said)


if __name__ == "__main__":
    unittest.main()
