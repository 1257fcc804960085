"""What people have: names of images with times in them, lists in any order, folders of datasets.

One table of what is read and one of what is refused, as in docs/inputs.md.
"""
import pathlib
import shutil
import unittest

from ygslam_cli import CliTest, lines_of, sequence, trajectory

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


if __name__ == "__main__":
    unittest.main(verbosity=2)
