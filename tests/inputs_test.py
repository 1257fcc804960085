"""What people have: names of images with times in them, lists in any order, folders of datasets.

One table of what is read and one of what is refused, as in docs/inputs.md.
"""
import io
import pathlib
import re
import shutil
import struct
import unittest

import numpy as np
from PIL import Image

import bags
from ygslam_cli import HEIGHT, ROOT, WIDTH, CliTest, lines_of, sequence, trajectory, ygslam

COUNT = 24


class NamedFolders(CliTest):
    """Folders without lists."""

    def folder_of(self, title, colour, depth, camera="calibration.txt"):
        """Images of the clean sequence under other names; colour(us, i) and depth(us, i) give them."""
        source, folder = sequence(), self.folder / title
        for i, line in enumerate(lines_of(source / "associations.txt")[:COUNT]):
            stamp, colour_file, _, depth_file = line.split()
            us = round(1e6 * float(stamp))
            for name, file in ((colour(us, i), colour_file), (depth(us, i), depth_file)):
                target = folder / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source / file, target)
        if camera:
            shutil.copyfile(source / "calibration.txt", folder / camera)
        return folder

    def stamps_of(self, folder, *words):
        done = self.run_slam(folder, out=folder.name + " out")
        self.assert_ran(done)
        for word in words:
            self.assertIn(word, done.stderr)
        return [float(stamp) for stamp, _ in trajectory(self.folder / (folder.name + " out") / "trajectory.txt")]

    def true_stamps(self):
        return [float(line.split()[0]) for line in lines_of(sequence() / "associations.txt")[:COUNT]]

    def assert_times(self, stamps, shifted=False):
        true = self.true_stamps()
        self.assertEqual(len(stamps), COUNT)
        shift = stamps[0] - true[0] if shifted else 0
        for found, wanted in zip(stamps, true, strict=True):
            self.assertAlmostEqual(found - shift, wanted, delta=0.0011)

    def both(self, name):
        return (lambda us, i: f"rgb/{name(us, i)}.jpg"), (lambda us, i: f"depth/{name(us, i)}.png")

    def test_seconds_and_nanoseconds(self):
        epoch = 1305031102
        colour, depth = self.both(lambda us, i: f"{epoch + us // 10**6}_{us % 10**6 * 1000}")
        stamps = self.stamps_of(self.folder_of("sec_nsec", colour, depth), "taken as seconds and nanoseconds")
        self.assert_times([stamp - epoch for stamp in stamps])

    def test_seconds_and_milliseconds_unpadded(self):
        colour, depth = self.both(lambda us, i: f"video_{us // 10**6}.{us % 10**6 // 1000}")
        self.assert_times(self.stamps_of(self.folder_of("ms", colour, depth), "milliseconds"), shifted=True)

    def test_redwood(self):
        folder = self.folder_of("redwood", lambda us, i: f"image/{i + 1:07d}-{us - 10**9:012d}.jpg",
                                lambda us, i: f"depth/{i + 1:07d}-{us - 10**9:012d}.png")
        self.assert_times(self.stamps_of(folder, "taken as microseconds"), shifted=True)

    def test_nanoseconds(self):
        colour, depth = self.both(lambda us, i: f"{1305031102 * 10**9 + us * 1000}")
        stamps = self.stamps_of(self.folder_of("ns", colour, depth), "nanoseconds since 1970")
        self.assert_times([stamp - 1305031102 for stamp in stamps])

    def test_the_size_of_the_image_is_no_number_of_a_frame(self):
        folder = self.folder_of("sized", lambda us, i: f"color/color_{i + 1:06d}_320x240.jpg",
                                lambda us, i: f"depth/depth_{i + 1:06d}_320x240.png")
        self.assert_times(self.stamps_of(folder, "numbers of frames at 30 Hz"), shifted=True)

    def test_seven_scenes_and_bundlefusion(self):
        folder = self.folder_of("seq-01", lambda us, i: f"frame-{i:06d}.color.jpg",
                                lambda us, i: f"frame-{i:06d}.depth.png")
        (folder / "frame-000000.pose.txt").write_text("1 0 0 0\n", encoding="utf-8")
        self.assert_times(self.stamps_of(folder), shifted=True)

    def test_names_that_are_not_clear_are_code_4_and_shown(self):
        for title, name, words in (
                ("stride", lambda us, i: f"{33 * i:06d}", ("'000000' (000000)", "'000033' (000033)", "milliseconds")),
                ("parts", lambda us, i: f"seq{i // 8}_{i % 8:03d}", ("'seq0_000' (0, 000)", "'seq0_001'")),
                ("date", lambda us, i: f"2021-03-15-14-{i // 8:02d}-{7 * i % 60:02d}", ("'2021-03-15-14-00-00'",))):
            colour, depth = self.both(name)
            done = self.run_slam(self.folder_of(title, colour, depth), "--quiet")
            self.assert_error(done, 4, *words, "write rgb.txt")

    def test_a_folder_too_deep_or_too_high_is_told(self):
        folder = self.copy_sequence("walk", frames=3)
        self.assert_error(self.run_slam(folder / "rgb", "--quiet"), 4, "it holds 3 .jpg", f"did you mean its parent {folder}?")
        self.assert_error(self.run_slam(folder / "rgb.txt", "--quiet"), 4, "no such file")
        self.assert_error(self.run_slam(folder / "calibration.txt", "--quiet"), 4, f"did you mean its parent {folder}?")
        self.assert_error(self.run_slam(self.folder, "--quiet"), 4, f"did you mean {folder}?")


class CameraFiles(CliTest):
    """Camera files of other programs, as calibration.txt and as --camera."""

    def test_each_gives_the_bytes_of_our_own_and_is_named(self):
        folder = self.copy_sequence(frames=8)
        ours = dict(line.split()[:2] for line in lines_of(folder / "calibration.txt"))
        c = {key: float(ours[key]) for key in ("fx", "fy", "cx", "cy")}
        (folder / "calibration.txt").write_text("".join(f"{k} {v}\n" for k, v in c.items()), encoding="utf-8")
        self.assert_ran(self.run_slam(folder, out="ours"))
        wanted = (self.folder / "ours/trajectory.txt").read_bytes()
        matrix = [c["fx"], 0, c["cx"], 0, c["fy"], c["cy"], 0, 0, 1]
        line = " ".join(str(value) for value in c.values())
        for taken_for, text in (
                ("settings of ORB-SLAM", "%YAML:1.0\n" + "".join(f"Camera.{k}: {v}\n" for k, v in c.items())
                 + "DepthMapFactor: 5000.0\n"),
                ("fx fy cx cy in one line", line + "\n"),
                ("a camera matrix", "\n".join(" ".join(map(str, matrix[i:i + 3])) for i in (0, 3, 6)) + "\n")):
            (folder / "calibration.txt").write_text(text, encoding="utf-8")
            file = self.folder / "camera.yaml"
            file.write_text(text, encoding="utf-8")
            for options in ((), ("--camera", file)):
                done = self.run_slam(folder, *options, out="theirs")
                self.assert_ran(done)
                self.assertIn(f"is taken for {taken_for}", done.stderr)
                self.assertEqual((self.folder / "theirs/trajectory.txt").read_bytes(), wanted, taken_for)

    def test_numbers_without_keys_are_told_the_right_form(self):
        folder = self.copy_sequence(frames=3)
        (folder / "calibration.txt").write_text("525.0\n525.0\n319.5\n", encoding="utf-8")
        self.assert_error(self.run_slam(folder, "--quiet"), 3, "calibration.txt: 3 numbers without keys", "fx 525.0")


class Orders(CliTest):
    """Lists whose lines are in any order."""

    def test_every_order_gives_the_same_bytes(self):
        folder = self.copy_sequence(frames=COUNT)
        lines = lines_of(folder / "associations.txt")
        self.assert_ran(self.run_slam(folder, out="sorted"))
        wanted = (self.folder / "sorted/trajectory.txt").read_bytes()
        self.assertEqual(wanted.count(b"\n"), COUNT)
        for name, order in (("reversed", lines[::-1]), ("shuffled", [lines[i * 7 % COUNT] for i in range(COUNT)]),
                            ("halves", lines[12:] + lines[:12])):
            (folder / "associations.txt").write_text("\n".join(order) + "\n", encoding="utf-8")
            done = self.run_slam(folder, out=name)
            self.assert_ran(done)
            self.assertEqual((self.folder / name / "trajectory.txt").read_bytes(), wanted, name)
            self.assertEqual(done.stderr.count("sorted by their stamps"), 1, done.stderr)

    def test_utf16_is_named(self):
        folder = self.copy_sequence(frames=3)
        for file, code in (("associations.txt", 4), ("calibration.txt", 3)):
            text = (folder / file).read_text(encoding="utf-8")
            (folder / file).write_text(text, encoding="utf-16")
            self.assert_error(self.run_slam(folder, "--quiet"), code, f"{file}: is UTF-16 text")
            (folder / file).write_text(text, encoding="utf-8")


class Clocks(CliTest):
    """Lists of colour and depth with clocks of their own, and files that are listed and absent."""

    def lists(self, rate=1.0, offset_s=0.0):
        folder = self.copy_sequence()
        pairs = self.pairs(folder)
        (folder / "associations.txt").unlink()
        first = float(pairs[0][0])
        colour = [f"{pair[0]} {pair[1]}" for pair in pairs]
        depth = [f"{first + offset_s + (float(pair[0]) - first) / rate:.6f} {pair[3]}" for pair in pairs]
        (folder / "rgb.txt").write_text("\n".join(colour) + "\n", encoding="utf-8")
        (folder / "depth.txt").write_text("\n".join(depth) + "\n", encoding="utf-8")
        return folder

    def test_a_depth_clock_half_a_percent_faster_is_no_offset(self):
        folder = self.lists(rate=1.005, offset_s=0.014)
        done = self.run_slam(folder)
        self.assertIn(done.returncode, (0, 7), done.stderr)
        self.assertNotIn("offset", done.stderr)

    def test_absent_files_are_told_once_and_counted(self):
        folder = self.lists()
        depth = lines_of(folder / "depth.txt")
        for line in depth[20:23]:
            (folder / line.split()[1]).unlink()
        extra = f"{float(depth[30].split()[0]) + 0.0165:.6f} depth/between.png"
        (folder / "depth.txt").write_text("\n".join(depth[:31] + [extra] + depth[31:50]) + "\n", encoding="utf-8")
        done = self.run_slam(folder)
        self.assert_ran(done)
        first = depth[20].split()[1]
        self.assertEqual(done.stderr.count(f"4 of 51 listed files do not exist, first {first}"), 1, done.stderr)
        metrics = self.metrics()
        self.assertEqual({entry["file"] for entry in metrics["skipped_images"]},
                         {line.split()[1] for line in depth[20:23]} | {"depth/between.png"})
        self.assertEqual((metrics["skipped_image_count"], metrics["colour_without_depth"]), (4, 10))
        self.assertEqual((metrics["frames"], metrics["readable"]), (50, 47))


def pillow(image, form, **how):
    out = io.BytesIO()
    image.save(out, form, **how)
    return out.getvalue()


def exr(metres):
    """A scan-line EXR of one float channel, as its specification has it, without compression."""
    height, width = metres.shape

    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channel = b"Y\0" + struct.pack("<i4B2i", 2, 0, 0, 0, 0, 1, 1) + b"\0"
    head = (b"\x76\x2f\x31\x01\x02\0\0\0" + attribute(b"channels", b"chlist", channel)
            + attribute(b"compression", b"compression", b"\0") + attribute(b"dataWindow", b"box2i", window)
            + attribute(b"displayWindow", b"box2i", window) + attribute(b"lineOrder", b"lineOrder", b"\0")
            + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
            + attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0))
            + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0")
    lines = [struct.pack("<2i", y, 4 * width) + row.astype("<f4").tobytes() for y, row in enumerate(metres)]
    first = len(head) + 8 * height
    return head + b"".join(struct.pack("<Q", first + y * len(lines[0])) for y in range(height)) + b"".join(lines)


def npy(array):
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


class ImageFiles(CliTest):
    """The same frames in files of other kinds give the same bytes, and are told."""

    def setUp(self):
        super().setUp()
        self.seq = self.copy_sequence(frames=6)
        for _, colour, _, _ in self.pairs(self.seq):  # JPEG would lose what others keep
            pixels = Image.open(self.seq / colour).convert("RGB")
            (self.seq / colour).write_bytes(pillow(pixels, "PNG"))
        self.assert_ran(self.run_slam(self.seq, out="png"))

    def replace(self, which, encode):
        for pair in self.pairs(self.seq):
            image = Image.open(self.seq / pair[which])
            (self.seq / pair[which]).write_bytes(encode(np.asarray(image)))

    def assert_same(self, which, encode, word, exact=True):
        kept = {pair[which]: (self.seq / pair[which]).read_bytes() for pair in self.pairs(self.seq)}
        self.replace(which, encode)
        done = self.run_slam(self.seq)
        self.assert_ran(done)
        if word:
            self.assertIn(word, done.stderr)
        ours, theirs = ((self.folder / out / "trajectory.txt").read_text() for out in ("png", "out"))
        if exact:
            self.assertEqual(ours, theirs, word)
        else:  # 1 / 5000 m and its float differ in the last bit
            np.testing.assert_allclose(np.loadtxt(theirs.splitlines()), np.loadtxt(ours.splitlines()), atol=1e-4)
        for file, data in kept.items():
            (self.seq / file).write_bytes(data)

    def test_tiff(self):
        self.assert_same(3, lambda raw: pillow(Image.fromarray(raw.astype(np.uint16)), "TIFF"),
                         "depth images are 16-bit TIFF, 5000 units per metre")
        self.assert_same(3, lambda raw: pillow(Image.fromarray((raw / 5000).astype(np.float32)), "TIFF",
                                               compression="tiff_adobe_deflate"),
                         "depth images are float TIFF, metres", exact=False)
        self.assert_same(1, lambda rgb: pillow(Image.fromarray(rgb), "TIFF", compression="tiff_lzw"),
                         "colour images are 8-bit TIFF")

    def test_exr(self):
        self.assert_same(3, lambda raw: exr((raw / 5000).astype(np.float32)), "depth images are float EXR, metres",
                         exact=False)

    def test_numpy(self):
        self.assert_same(3, lambda raw: npy(raw.astype(np.uint16)), "depth images are 16-bit NumPy")
        self.assert_same(3, lambda raw: npy(raw / 5000), "depth images are float NumPy, metres", exact=False)

    def test_netpbm(self):
        head = f"\n{WIDTH} {HEIGHT}\n".encode()
        self.assert_same(3, lambda raw: b"P5" + head + b"65535\n" + raw.astype(">u2").tobytes(),
                         "depth images are 16-bit PGM")
        self.assert_same(1, lambda rgb: b"P6" + head + b"255\n" + rgb.tobytes(), "colour images are 8-bit PPM")

    def test_pfm(self):
        self.assert_same(3, lambda raw: f"Pf\n{WIDTH} {HEIGHT}\n-1\n".encode()
                         + (raw[::-1] / 5000).astype("<f4").tobytes(), "depth images are float PFM", exact=False)

    def test_png_with_alpha(self):
        self.assert_same(1, lambda rgb: pillow(Image.fromarray(np.dstack([rgb, rgb[..., 0]])), "PNG"),
                         "colour images are 8-bit PNG with 4 channels")

    def test_png_with_a_palette(self):
        self.replace(1, lambda rgb: pillow(Image.fromarray(rgb).quantize(256), "PNG"))
        done = self.run_slam(self.seq)
        self.assert_ran(done)
        self.assertIn("colour images are 8-bit PNG with a palette", done.stderr)

    def test_floats_in_millimetres_are_refused(self):
        self.replace(3, lambda raw: npy(raw / 5))
        done = self.run_slam(self.seq, "--quiet")
        self.assertIn(done.returncode, (4, 7), done.stderr)
        self.assertIn("are these millimetres?", done.stderr)

    def test_a_picture_of_depth_is_refused(self):
        self.replace(3, lambda raw: pillow(Image.fromarray((raw // 256).astype(np.uint8)), "PNG"))
        self.assert_error(self.run_slam(self.seq, "--quiet"), 4, "1 channel(s) of 8 bit")


class Truths(CliTest):
    """Folders with one pose a file, Replica's traj.txt, lists with poses, bags: as --gt, and beside images."""

    def setUp(self):
        super().setUp()
        self.seq = self.copy_sequence(frames=COUNT)
        self.rows = {}
        truth = [list(map(float, line.split())) for line in lines_of(self.seq / "groundtruth.txt")]
        for stamp, *_ in self.pairs(self.seq):
            nearest = min(truth, key=lambda row: abs(row[0] - float(stamp)))
            self.rows[stamp] = nearest[1:]
        # As a program would estimate it: 5 mm beside the truth.
        self.est = self.folder / "est.txt"

    def matrices(self):
        for x, y, z, qx, qy, qz, qw in self.rows.values():
            yield np.array([[1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw), x],
                            [2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw), y],
                            [2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy), z],
                            [0, 0, 0, 1]])

    def estimate(self, stamps):
        rows = [f"{stamp} " + " ".join(map(str, [x + 0.005 * (i % 2), *rest]))
                for i, (stamp, (x, *rest)) in enumerate(zip(stamps, self.rows.values(), strict=True))]
        self.est.write_text("\n".join(rows) + "\n", encoding="utf-8")

    def assert_figure(self, truth, *options, word=""):
        """The ATE of the estimate, whatever the truth is written in."""
        done = ygslam("eval", "--gt", truth, "--est", self.est, "--json", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        rmse = float(re.search(r'"ate".*?"rmse": ([0-9.e-]+)', done.stdout, re.S)[1])
        self.assertAlmostEqual(rmse, 0.0025, delta=0.0003)
        self.assertIn(word, done.stderr)

    def test_one_pose_a_file(self):
        """7-Scenes and BundleFusion beside the images, ScanNet in a folder."""
        self.estimate([f"{i / 30:.6f}" for i in range(COUNT)])
        for name in ("seq-01/frame-{:06d}.pose.txt", "scannet/pose/{}.txt", "other/poses/{:05d}.txt"):
            for i, matrix in enumerate(self.matrices()):
                file = self.folder / name.format(i)
                file.parent.mkdir(parents=True, exist_ok=True)
                np.savetxt(file, matrix)
            self.assert_figure(self.folder / name.split("/")[0], word="one pose a file")

    def test_replica(self):
        self.estimate([f"{i / 30:.6f}" for i in range(COUNT)])
        root = self.folder / "room0"
        (root / "results").mkdir(parents=True)
        for i in range(COUNT):
            (root / f"results/frame{i:06d}.jpg").write_bytes(b"")
        np.savetxt(root / "traj.txt", [matrix.reshape(-1) for matrix in self.matrices()])
        self.assert_figure(root, word="stamps are those of the images in results/")

    def test_associations_with_poses(self):
        """As a truth for eval, and as a recording with its truth for run."""
        self.estimate(self.rows)
        (self.seq / "groundtruth.txt").unlink()
        lines = [f"{' '.join(pair)} {pair[0]} {' '.join(map(str, self.rows[pair[0]]))}" for pair in self.pairs(self.seq)]
        (self.seq / "associations.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
        self.assert_figure(self.seq / "associations.txt", word="poses in a list of associated images")
        done = self.run_slam(self.seq)
        self.assert_ran(done)
        self.assertIn("has a pose in each line", done.stderr)
        self.assertLess(self.metrics()["ate"]["rmse"], 0.05)

    def test_bags(self):
        """The only topic with poses is taken, of several one is named."""
        self.estimate(self.rows)
        messages = bags.Messages()
        kinds = messages.types

        def pose(stamp):
            x, y, z, qx, qy, qz, qw = self.rows[stamp]
            return kinds["geometry_msgs/msg/Pose"](kinds["geometry_msgs/msg/Point"](x, y, z),
                                                   kinds["geometry_msgs/msg/Quaternion"](qx, qy, qz, qw))

        def stamped(topic):
            for stamp in self.rows:
                ns = round(1e9 * float(stamp))
                yield topic, ns, kinds["geometry_msgs/msg/PoseStamped"](messages.header(ns), pose(stamp))
        bag = bags.write_mcap(self.folder / "one.mcap", stamped("/pose"))
        self.assert_figure(bag, word="poses of /pose (geometry_msgs/PoseStamped)")
        bag = bags.write_mcap(self.folder / "two.mcap", [*stamped("/pose"), *stamped("/other")])
        self.assert_figure(bag, "--gt-topic", "/pose")
        done = ygslam("eval", "--gt", bag, "--est", self.est)
        self.assert_error(done, 4, "several topics have poses: /other", "choose with --gt-topic")
        done = ygslam("eval", "--gt", self.est, "--est", self.est, "--gt-topic", "/pose")
        self.assert_error(done, 2, "is no bag")


class Surfaces(CliTest):
    """PLY files as other programs write them are drawn alike."""

    def draw(self, name, header, data):
        file = self.folder / name
        file.write_bytes(header.encode() + data)
        picture = self.folder / (name + ".png")
        done = ygslam("render", file, "--out", picture, "--size", "64x48", "--point", "0.3", "--from", "0,0,-3",
                      "--look-at", "0,0,0")
        self.assertEqual(done.returncode, 0, done.stderr)
        pixels = np.asarray(Image.open(picture).convert("RGB")).reshape(-1, 3).astype(int)
        drawn = pixels[(pixels != 255).any(1)]
        self.assertGreater(len(drawn), 50, name)
        return np.median(drawn, axis=0).tolist(), done.stderr

    def test_all_kinds(self):
        grid = np.stack(np.meshgrid(np.linspace(-1, 1, 12), np.linspace(-1, 1, 12), [0.0]), -1).reshape(-1, 3)
        xyz = "property float x\nproperty float y\nproperty float z\n"
        names = ("red", "green", "blue")
        bytes_of = "".join(f"property uchar {name}\n" for name in names)
        floats = "".join(f"property float {name}\n" for name in names)
        camera = "element camera 1\nproperty float view_px\nproperty int viewportx\n"
        colour = (200, 40, 40)

        def head(form, properties, more=""):
            return f"ply\nformat {form} 1.0\nelement vertex {len(grid)}\n{xyz}{properties}{more}end_header\n"

        def rows(order, kind, values):
            return b"".join(struct.pack(f"{order}3f{kind}", *p, *values) for p in grid)
        little = rows("<", "3B", colour)
        ours, _ = self.draw("ours", head("binary_little_endian", bytes_of), little)
        for name, header, data, word in (
                ("text", head("ascii", bytes_of),
                 "".join(f"{x} {y} {z} 200 40 40\n" for x, y, z in grid).encode(), "PLY as text"),
                ("big", head("binary_big_endian", bytes_of), rows(">", "3B", colour), "big-endian PLY"),
                ("pcl", head("binary_little_endian", bytes_of, camera), little + b"\0" * 8, "'camera' left out"),
                ("crlf", head("binary_little_endian", bytes_of).replace("\n", "\r\n"), little, ""),
                ("floats", head("binary_little_endian", floats), rows("<", "3f", [c / 255 for c in colour]),
                 "colours from 0 to 1")):
            drawn, told = self.draw(name, header, data)
            self.assertEqual(drawn, ours, name)
            self.assertIn(word, told)
        grey, told = self.draw("none", head("binary_little_endian", ""), rows("<", "", ()))
        self.assertEqual(len(set(grey)), 1)
        self.assertGreater(grey[0], 60, "grey, not black")
        self.assertIn("no colours: grey", told)


class Rows(unittest.TestCase):
    """Each row of these tables of docs/inputs.md has a test with a file of its own; for the formats
    of trajectories see trajectory_files_test.py."""

    TESTS = {  # first cell of the row: where the test is, and its name
        "Camera files": {
            "ours": ("src/io/calibration_test.cpp", "TEST("),
            "settings of ORB-SLAM2": ("src/io/camera_formats_test.cpp", "SettingsOfStellaBelowTheirGroups"),
            "`camera_info` of ROS": ("src/io/camera_formats_test.cpp", "CameraInfoOfRos"),
            "camchain of Kalibr": ("src/io/camera_formats_test.cpp", "CalibratorsOfOthers"),
            "cameras of VINS": ("src/io/camera_formats_test.cpp", "CalibratorsOfOthers"),
            "settings of NICE-SLAM": ("src/io/camera_formats_test.cpp", "SettingsOfNeuralMappers"),
            "`cameras.txt` of COLMAP": ("src/io/camera_formats_test.cpp", "CamerasOfColmap"),
            "one line": ("tests/inputs_test.py", "fx fy cx cy in one line"),
            "camera matrix": ("tests/inputs_test.py", "a camera matrix"),
            "`info.txt` of BundleFusion": ("src/io/camera_formats_test.cpp", "InfoOfBundleFusion"),
            "intrinsics of Open3D": ("src/io/camera_formats_test.cpp", "JsonOfOpen3dRealSense"),
            "intrinsics of RealSense": ("src/io/camera_formats_test.cpp", "JsonOfOpen3dRealSense"),
            "`transforms.json`": ("src/io/camera_formats_test.cpp", "JsonOfOpen3dRealSenseAndNerfstudio")},
        "Images": {
            "JPEG": ("src/io/image_file_test.cpp", "TEST(Jpeg"),
            "PNG": ("tests/inputs_test.py", "test_png_with_a_palette"),
            "TIFF": ("tests/inputs_test.py", "test_tiff"),
            "OpenEXR": ("tests/inputs_test.py", "test_exr"),
            "NumPy": ("tests/inputs_test.py", "test_numpy"),
            "PGM, PPM": ("tests/inputs_test.py", "test_netpbm"),
            "PFM": ("tests/inputs_test.py", "test_pfm")},
        "Bags": {
            "colour": ("src/bag/ros_images_test.cpp", "ColoursAreTakenFromTheirPlaces"),
            "OpenCV's colour": ("src/bag/ros_images_test.cpp", "OpenCvsNamesAreColour"),
            "mosaics": ("src/bag/ros_images_test.cpp", "MosaicsAreColours"),
            "YUV": ("src/bag/ros_images_test.cpp", "YuvIsColourInBothOrders"),
            "depth": ("src/bag/ros_images_test.cpp", "OtherByteOrdersAreTurned"),
            "compressedDepth": ("src/bag/ros_images_test.cpp", "RvlIsRead"),
            "camera": ("src/bag/ros_images_test.cpp", "OfACameraOnlyWhatWeKnow")},
        "Poses in folders, lists and bags": {
            "list of associations": ("tests/inputs_test.py", "test_associations_with_poses"),
            "folder with one pose a file": ("tests/inputs_test.py", "test_one_pose_a_file"),
            "folder of Replica": ("tests/inputs_test.py", "test_replica"),
            "bag or MCAP": ("tests/inputs_test.py", "test_bags")},
        "Inertial readings": {
            "EuRoC's": ("src/io/imu_file_test.cpp", "EurocsFileIsReadFromDisk"),
            "text": ("src/io/imu_file_test.cpp", "LinesInSecondsAreRead"),
            "header line": ("src/io/imu_file_test.cpp", "HeaderNamesColumnsInAnyOrder"),
            "TUM's": ("src/io/imu_file_test.cpp", "TumsAccelerometerIsReadAsOneAlone"),
            "bag or MCAP": ("tests/imu_run_test.py", "test_of_several_topics_one_is_chosen"),
            "halves of a RealSense": ("tests/imu_run_test.py",
                                      "test_halves_of_one_sensor_are_united_in_bags_and_streams"),
            "MCAP stream": ("tests/imu_run_test.py", "test_a_stream_has_its_own"),
            "`/tf_static`": ("tests/imu_run_test.py", "test_static_transforms_place_it")},
        "Wheel odometry": {
            "`odom.csv`": ("tests/wheel_run_test.py", "test_a_covered_lens_costs_no_pose"),
            "bag or MCAP": ("tests/wheel_run_test.py", "test_a_bag_has_its_own"),
            "MCAP stream": ("tests/wheel_run_test.py", "test_a_stream_has_its_own"),
            "`/tf_static`": ("tests/wheel_run_test.py", '"the camera placed by /tf_static"')},
        "Surfaces": {
            "binary": ("tests/inputs_test.py", '"big-endian PLY"'),
            "text": ("tests/inputs_test.py", '"PLY as text"'),
            "elements": ("tests/inputs_test.py", "'camera' left out"),
            "colours": ("tests/inputs_test.py", '"colours from 0 to 1"'),
            "without colours": ("tests/inputs_test.py", '"no colours: grey"')}}

    def test_every_row_has_its_test(self):
        page = (ROOT / "docs" / "inputs.md").read_text(encoding="utf-8")
        for section, tests in self.TESTS.items():
            text = page.split(f"\n## {section}\n")[1].split("\n## ")[0]
            cells = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")]
            rows = [cell for cell in cells[1:] if cell]
            self.assertGreater(len(rows), 3, section)
            for row in rows:
                named = [words for start, words in tests.items() if row.startswith(start)]
                self.assertTrue(named, f"{section}: no test is named for `{row}`")
                for file, name in named:
                    self.assertIn(name, (ROOT / file).read_text(encoding="utf-8"), row)


if __name__ == "__main__":
    unittest.main(verbosity=2)
