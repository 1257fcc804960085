"""tools/convert_recording.py on recordings that are made here: no real one was at hand.

    python tests/convert_recording_test.py
"""
import io
import subprocess
import sys
import unittest

import numpy as np
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory
from PIL import Image

import camera_recordings as made
from bag_test import FRAMES, BagTest
from bags import Frame
from ygslam_cli import BINARY, HANG_S, ROOT, CliTest, trajectory

try:
    import liblzfse
except ModuleNotFoundError:
    liblzfse = None

TOOL = ROOT / "tools" / "convert_recording.py"
COLOUR, DEPTH = "/camera/color/image_raw", "/camera/depth/image_raw"
START_NS = 1_700_000_000 * 10**9
# A point of the depth camera lies 5 cm to the left as the colour camera sees it, turned about y by 2 deg.
TURN_RAD = np.deg2rad(2)
T = np.eye(4)
T[:3, :3] = [[np.cos(TURN_RAD), 0, np.sin(TURN_RAD)], [0, 1, 0], [-np.sin(TURN_RAD), 0, np.cos(TURN_RAD)]]
T[:3, 3] = -0.05, 0.002, 0.001


def some_frames(colour_size=(80, 60), depth_size=(40, 30), count=3):
    """Smooth colours, which JPEG keeps, and depth with holes."""
    x, y = np.meshgrid(*map(np.arange, colour_size))
    depth = np.arange(depth_size[0] * depth_size[1], dtype=np.uint16).reshape(depth_size[::-1]) % 4000
    return [Frame(START_NS + i * 33_000_000,
                  np.stack([x % 256, y % 256, 0 * x + 20 * i], axis=-1).astype(np.uint8),
                  (depth + i).astype(np.uint16)) for i in range(count)]


def convert(path, out="-"):
    return subprocess.run([sys.executable, TOOL, path, out], capture_output=True, timeout=HANG_S, check=False)


def messages_of(data, seek=False):
    """Topic: messages, as the library of others decodes them."""
    reader = (make_reader if seek else NonSeekingReader)(io.BytesIO(data), decoder_factories=[DecoderFactory()])
    said = {}
    for _, channel, _, message in reader.iter_decoded_messages():
        said.setdefault(channel.topic, []).append(message)
    return said


def stamp_of(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


class Conversion(CliTest):
    def converted(self, path):
        """What a pipe gets, which is what a file gets."""
        done, file = convert(path), self.folder / "file.mcap"
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(convert(path, file).returncode, 0)
        piped = messages_of(done.stdout)
        self.assertEqual(repr(messages_of(file.read_bytes(), seek=True)), repr(piped))
        return piped, done.stderr.decode()

    def assert_frames(self, said, frames, compressed=True, exact_stamps=True):
        """Images of the frames, on topics and of frames as `ygslam run` wants them."""
        colours = said[COLOUR + ("/compressed" if compressed else "")]
        self.assertEqual((len(colours), len(said[DEPTH])), (len(frames),) * 2)
        for frame, colour, depth in zip(frames, colours, said[DEPTH]):
            for message, name in ((colour, "color"), (depth, "depth")):
                self.assertEqual(message.header.frame_id, f"camera_{name}_optical_frame")
                self.assertLess(abs(stamp_of(message) - frame.stamp_ns), 1 if exact_stamps else 1000)
            if compressed:
                pixels = np.asarray(Image.open(io.BytesIO(bytes(colour.data))))
                self.assertLess(np.abs(pixels.astype(int) - frame.colour).mean(), 2)
            else:
                self.assertEqual(bytes(colour.data), frame.colour.tobytes())
            self.assertEqual((depth.height, depth.width), frame.depth_mm.shape)
            values = np.frombuffer(bytes(depth.data), "<u2" if depth.encoding == "16UC1" else "<f4")
            if depth.encoding == "32FC1":
                values = 1000 * np.nan_to_num(values)
            np.testing.assert_allclose(values.reshape(frame.depth_mm.shape), frame.depth_mm, rtol=1e-5)

    def assert_cameras(self, said, colour, depth, T_colour_depth, terms=None):
        """fx fy cx cy of both, and where the depth camera is."""
        for name, camera in (("color", colour), ("depth", depth)):
            info = said[f"/camera/{name}/camera_info"][0]
            fitted = terms == "any"  # with distortion the focal lengths are fitted, too
            np.testing.assert_allclose([info.k[i] for i in (0, 4, 2, 5)], camera, rtol=0.02 if fitted else 1e-5)
            self.assertEqual(info.header.frame_id, f"camera_{name}_optical_frame")
            self.assertEqual(info.distortion_model, "plumb_bob")
            if not fitted:
                self.assertFalse(any(info.d))
        (static,) = said["/tf_static"]
        (transform,) = static.transforms
        self.assertEqual((transform.header.frame_id, transform.child_frame_id),
                         ("camera_color_optical_frame", "camera_depth_optical_frame"))
        t, q = transform.transform.translation, transform.transform.rotation
        np.testing.assert_allclose([t.x, t.y, t.z], T_colour_depth[:3, 3], atol=1e-6)
        angle = 2 * np.arctan2(np.linalg.norm([q.x, q.y, q.z]) * np.sign(q.y or 1), q.w)
        self.assertAlmostEqual(angle, np.arctan2(T_colour_depth[0, 2], T_colour_depth[0, 0]), places=5)

    def assert_refused(self, data, *parts, name="recording"):
        path = self.folder / name
        path.write_bytes(data)
        for out in ("-", self.folder / "x.mcap"):
            done = convert(path, out)
            said = done.stderr.decode()
            self.assertEqual(done.returncode, 1, said)
            *notes, last = said.splitlines()
            self.assertTrue(all(note.startswith("convert_recording: ") for note in notes), said)
            self.assertTrue(last.startswith(f"error: {path}: "), said)
            for part in parts:
                self.assertIn(part, last)
        self.assertEqual([p.name for p in self.folder.glob("x.mcap*")], [], "nothing half-written remains")


class Sens(Conversion):
    cameras = (90, 91, 39.5, 29.5), (45, 46, 19.5, 14.5)

    def write(self, *how, name="room.sens", **more):
        path = self.folder / name
        path.write_bytes(made.sens(*how, **more))
        return path

    def test_images_cameras_and_where_they_are(self):
        frames = some_frames()
        for jpeg, units in ((True, 1000), (False, 5000)):
            said, notes = self.converted(self.write(frames, *self.cameras, T, jpeg=jpeg, units=units))
            scaled = [Frame(f.stamp_ns, f.colour, f.depth_mm * (1000 / units)) for f in frames]
            self.assert_frames(said, scaled)
            self.assert_cameras(said, *self.cameras, T)
            self.assertEqual(notes.count("\n"), 1, notes)

    def test_without_stamps_frames_are_at_30_a_second_and_told(self):
        said, notes = self.converted(self.write(some_frames(), *self.cameras, stamps=False))
        self.assertEqual([stamp_of(m) // 10**6 for m in said[DEPTH]], [0, 33, 66])
        self.assertIn("30 a second", notes)

    def test_what_is_damaged_is_refused_in_a_line(self):
        whole = made.sens(some_frames(), *self.cameras)
        for data, part in ((b"", "is empty"), (b"a diary", "is no recording"), (whole[:40], "ends early"),
                           (whole[:len(whole) * 2 // 3], "ends early, in frame 1 of 3"),
                           (whole[:4] + b"\xff" * 8 + whole[12:], "is no .sens"),
                           (whole[:274] + b"\7" + whole[275:], "compressed otherwise"),
                           (whole[:298] + b"\0\0\0\0" + whole[302:], "units per metre"),
                           (whole[:282] + b"\xff" * 16 + whole[298:], "x 4294967295 pixels"),
                           (whole[:18] + bytes(64) + whole[82:], "impossible colour camera"),
                           (whole[:302] + b"\xff" * 8 + whole[310:], "ends early")):
            with self.subTest(part=part):
                self.assert_refused(data, part)
        bomb = some_frames(count=1)
        small = made.sens(bomb, *self.cameras)
        bomb[0].depth_mm = np.zeros((3000, 4000), np.uint16)
        large = made.sens(bomb, *self.cameras)
        self.assert_refused(large[:290] + small[290:298] + large[298:], "another size")

    def test_no_file_and_no_place_for_it(self):
        for path, out in ((self.folder / "none", "-"), (self.folder, "-"),
                          (self.write(some_frames(), *self.cameras), self.folder / "no" / "x.mcap")):
            done = convert(path, out)
            self.assertEqual((done.returncode, done.stderr.count(b"\n")), (1, 1), done.stderr)
        own = self.write(some_frames(), *self.cameras)
        before = own.read_bytes()
        self.assertEqual(convert(own, own).returncode, 1)
        self.assertEqual(own.read_bytes(), before)

    def test_what_is_no_recording_is_not_replaced(self):
        own = self.write(some_frames(), *self.cameras)
        diary, empty = self.folder / "diary.mcap", self.folder / "empty.mcap"
        diary.write_text("Dear diary")
        empty.touch()
        done = convert(own, diary)
        self.assertEqual(done.returncode, 1)
        self.assertIn(f"{diary} is there and no recording", done.stderr.decode())
        self.assertEqual(diary.read_text(), "Dear diary")
        for _ in range(2):  # an empty file, then the recording it has become
            self.assertEqual(convert(own, empty).returncode, 0)


@unittest.skipUnless(liblzfse, "pyliblzfse is not installed")
class Record3d(Conversion):
    camera = (90, 91, 39.5, 29.5)

    def write(self, frames, **about):
        return made.r3d(self.folder / "room.r3d", frames, self.camera, liblzfse.compress, **about)

    def test_depth_has_the_colour_camera_with_fewer_pixels(self):
        frames = some_frames()
        said, _ = self.converted(self.write(frames))
        self.assert_frames(said, frames, exact_stamps=False)
        self.assert_cameras(said, self.camera, (45, 45.5, 19.5, 14.5), np.eye(4))

    def test_older_ones_tell_less(self):
        said, notes = self.converted(self.write(some_frames((360, 480), (192, 256)), dw=None, dh=None,
                                                frameTimestamps=None, perFrameIntrinsicCoeffs=[
                                                    [90, 90, 39, 29], [95, 95, 39, 29]]))
        self.assertEqual((said[DEPTH][0].width, said[DEPTH][0].height), (192, 256))
        self.assertEqual([stamp_of(m) // 10**6 for m in said[DEPTH]], [0, 16, 33])
        self.assertIn("focal length changes", notes)

    def test_what_is_damaged_is_refused_in_a_line(self):
        frames = some_frames()
        whole = self.write(frames).read_bytes()
        self.assert_refused(whole[:len(whole) // 2], "is no .r3d, or cut off")
        for about, part in (({"K": [1, 2]}, "K is no 3 x 3 matrix"), ({"K": None}, "K is no list"),
                            ({"w": "wide"}, "w is no number"), ({"w": float("nan")}, "w is no number"),
                            ({"h": float("inf")}, "h is no number"), ({"K": [10**400] * 9}, "K is no list"), ({"dw": 7}, "another size"),
                            ({"frameTimestamps": [1]}, "frameTimestamps")):
            self.assert_refused(self.write(frames, **about).read_bytes(), part)
        spoilt = self.write(frames).read_bytes().replace(b"bvx2", b"bvxx").replace(b"bvxn", b"bvxx")
        self.assert_refused(spoilt, "rgbd/0.depth is damaged")


class AzureKinect(Conversion):
    # cx cy fx fy k1..k6 codx cody p2 p1, of the size of real devices' ones.
    colour = (0.4987, 0.5021, 0.4782, 0.6374, 0.5844, -2.4942, 1.3603, 0.4648, -2.3362, 1.3012, 0, 0, -0.0002, 0.0007)
    depth = (0.5034, 0.5032, 0.4925, 0.4926, 0.5479, -0.0210, -0.0027, 0.8897, 0.0861, -0.0139, 0, 0, 0, 0)

    def setUp(self):
        super().setUp()
        self.frames = some_frames((1280, 720), (640, 576), 2)
        self.calibration = made.kinect_calibration(self.colour, self.depth, T[:3, :3], T[:3, 3])

    def write(self, data):
        path = self.folder / "room.mkv"
        path.write_bytes(data)
        return path

    def test_images_cameras_and_where_they_are(self):
        said, notes = self.converted(self.write(made.mkv(self.frames, self.calibration)))
        self.assert_frames(said, self.frames)
        self.assert_cameras(
            said, (1280 * 0.4782, 960 * 0.6374, 1280 * 0.4987 - 0.5, 960 * 0.5021 - 120.5),
            (1024 * 0.4925, 1024 * 0.4926, 1024 * 0.5034 - 192.5, 1024 * 0.5032 - 180.5), T, terms="any")
        self.assertRegex(notes, r"colour distortion is written with five terms .* off by 0\.\d\d px")
        self.assertRegex(notes, r"depth distortion is written with five terms .* off by 0\.\d\d px")
        # A ray 0.4 to the right and 0.3 down, by the eight terms and by what was written.
        x, y = 0.4, 0.3
        k1, k2, k3, k4, k5, k6 = self.colour[4:10]
        p2, p1 = self.colour[12:]
        r2 = x * x + y * y
        radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
        exact = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        info = said["/camera/color/camera_info"][0]
        a1, a2, q1, q2, a3 = info.d
        fitted = x * (1 + a1 * r2 + a2 * r2**2 + a3 * r2**3) + 2 * q1 * x * y + q2 * (r2 + 2 * x * x)
        self.assertLess(abs(fitted * info.k[0] - exact * 1280 * 0.4782), 0.5)

    def test_five_terms_that_are_too_far_off_are_not_written(self):
        said, notes = self.converted(self.write(made.mkv(some_frames((2048, 1536), (640, 576), 1), self.calibration)))
        info = said["/camera/color/camera_info"][0]
        self.assertEqual(info.distortion_model, "rational_polynomial")
        k1, k2, k3, k4, k5, k6 = self.colour[4:10]
        np.testing.assert_allclose(info.d, [k1, k2, 0.0007, -0.0002, k3, k4, k5, k6])
        self.assertIn("which ygslam does not read", notes)

    def test_what_is_damaged_is_refused_in_a_line(self):
        whole = made.mkv(self.frames, self.calibration)
        for data, part in ((whole[:1000], "ends early"), (whole[:len(whole) * 2 // 3], "ends early"),
                           (whole[:4], "ends early"),
                           (whole.replace(b"MJPG", b"NV12"), "colour is 'NV12'"),
                           (whole.replace(b"DEPTH", b"depth"), "has no track DEPTH"),
                           (whole.replace(b'"Cameras"', b'"cameras"'), "calibration.json is missing or damaged"),
                           (whole.replace(b"LensDistortionModelB", b"LensDistortionModelX"), "another model"),
                           (made.mkv(some_frames((80, 60)), self.calibration), "which no mode has")):
            with self.subTest(part=part):
                self.assert_refused(data, part)


class RealSense(Conversion):
    cameras = (90, 91, 39.5, 29.5), (45, 46, 19.5, 14.5)
    # From depth, the reference, to colour.
    transforms = ((tuple(T[:3, 3]), (0, np.sin(TURN_RAD / 2), 0, np.cos(TURN_RAD / 2))),
                  ((0, 0, 0), (0, 0, 0, 1)))

    def write(self, *how, **more):
        path = self.folder / "room.bag"
        path.unlink(missing_ok=True)
        return made.realsense(path, *how, **more)

    def test_images_cameras_and_where_they_are(self):
        frames = some_frames()
        for units in (0.001, 0.00025):
            said, notes = self.converted(self.write(frames, self.cameras, self.transforms, units))
            scaled = [Frame(f.stamp_ns, f.colour, f.depth_mm * (1000 * units)) for f in frames]
            self.assert_frames(said, scaled, compressed=False)
            self.assert_cameras(said, *self.cameras, T)
            self.assertEqual(notes.count("\n"), 1, notes)

    def test_run_names_what_converts_it(self):
        bag = self.write(some_frames(), self.cameras, self.transforms)
        done, _, _ = self.run_on(bag)
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertEqual(done.stderr, f"error: {bag}: a recording of the RealSense SDK; tools/convert_recording.py makes "
                                      "an MCAP recording of it (docs/inputs.md)\n")

    def test_distortion_of_its_own_models_becomes_that_of_ygslam(self):
        """The inverse of a small distortion is nearly the same with other signs."""
        terms = (0.02, -0.01, 0.001, -0.002, 0.0)
        for model, sign, size in (("Inverse Brown Conrady", -1, 5e-3), ("Brown Conrady", 1, 1e-9),
                                  ("Modified Brown Conrady", 1, 1e-3)):
            said, _ = self.converted(self.write(some_frames(), self.cameras, self.transforms,
                                                models=(model, "None"), terms=(terms, (0.0,) * 5)))
            d = said["/camera/color/camera_info"][0].d
            np.testing.assert_allclose(d[:4], np.multiply(sign, terms[:4]), atol=size)
        self.assert_refused(self.write(some_frames(), self.cameras, self.transforms, models=("FTheta", "None"),
                                       terms=(terms, (0.0,) * 5)).read_bytes(), "'FTheta'")

    def test_what_is_not_told_is_assumed_and_told(self):
        said, notes = self.converted(self.write(some_frames(), self.cameras, (None, None), units_m=None))
        self.assert_cameras(said, *self.cameras, np.eye(4))
        self.assertIn("taken for a millimetre", notes)
        self.assertIn("taken for registered", notes)

    def test_what_is_damaged_is_refused_in_a_line(self):
        whole = self.write(some_frames(), self.cameras, self.transforms).read_bytes()
        for data, part in ((whole[:len(whole) // 2], "is damaged or not closed"), (whole[:14], "is damaged"),
                           (whole.replace(b"Color_0", b"Colon_0"), "has no topic Color_0"),
                           (whole[:4300] + b"\xff" * 64 + whole[4364:], "is damaged")):
            with self.subTest(part=part):
                self.assert_refused(data, part)


class Converted(BagTest):
    """What comes out, read by `ygslam run`: a recording whose two cameras are one."""

    def test_pipe_and_file_give_what_the_folder_gives(self):
        self.run_bag(self.seq, out="folder")
        recording = self.folder / "room.sens"
        recording.write_bytes(made.sens(self.frames, self.camera, self.camera))
        done = subprocess.run(
            ["/bin/bash", "-c", 'set -o pipefail; "$0" "$1" "$2" - | "$3" run - --out "$4" --deterministic '
             "--dynamic geometry", sys.executable, TOOL, recording, BINARY, self.folder / "piped"],
            check=False, capture_output=True, text=True, timeout=HANG_S)
        self.assert_ran(done)
        self.assertIn(f"{FRAMES} pairs of images", done.stderr)
        self.assertEqual(convert(recording, self.folder / "room.mcap").returncode, 0)
        self.run_bag(self.folder / "room.mcap", out="file")
        self.assert_same("file", "piped")
        same, found = (trajectory(self.folder / out / "trajectory.txt") for out in ("folder", "piped"))
        self.assertEqual([row[0] for row in found], [row[0] for row in same])
        # Intrinsics are of 32 bits in a .sens.
        np.testing.assert_allclose([row[1] for row in found], [row[1] for row in same], atol=1e-3)


if __name__ == "__main__":
    unittest.main()
