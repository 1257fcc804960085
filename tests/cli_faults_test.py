"""Bad input of `ygslam run`: images, lists, cameras and masks that are not as they should be.

The numbers F1 ... F20 are those of docs/reliability.md.
"""
import math
import unittest

import numpy as np
from PIL import Image

from ygslam_cli import FRAMES, HEIGHT, WIDTH, CliTest, lines_of, png, sequence, trajectory


class Images(CliTest):
    """F1 to F4 and F7: images that are missing, broken, of another kind, empty or black."""

    def assert_skipped(self, folder, files, *words, warnings=1):
        """The files are counted, with a reason that holds one of the words, and no others."""
        done = self.run_slam(folder)
        self.assert_ran(done)
        self.assert_sound()
        metrics = self.metrics()
        found = {entry["file"]: entry["reason"] for entry in metrics["skipped_images"]}
        self.assertEqual(set(found), set(files))
        for file, reason in found.items():
            self.assertTrue(any(word in reason for word in words), f"{file}: {reason}")
        frames = len(self.pairs(folder))
        self.assertEqual(metrics["frames"], frames)
        self.assertEqual(metrics["readable"], frames - len(files))
        told = [line for line in done.stderr.splitlines() if "skipping" in line]
        self.assertEqual(len(told), warnings, done.stderr)
        return metrics

    def clean_ate(self, frames=FRAMES):
        self.assert_ran(self.run_slam(sequence(), "--to", frames, out="clean"))
        return self.metrics("clean")["ate"]["rmse"]

    def test_missing_images_are_skipped_counted_and_cost_no_accuracy(self):
        folder = self.copy_sequence()
        gone = [self.pairs(folder)[i][1] for i in (12, 30, 31, 32, 33, 34)]
        for file in gone:
            (folder / file).unlink()
        metrics = self.assert_skipped(folder, gone, "no such file", warnings=2)
        self.assertEqual(metrics["coverage"], (FRAMES - len(gone)) / FRAMES)
        # F1 asks for 1.2 x; a millimetre more because the clean error is a few of them only.
        self.assertLess(metrics["ate"]["rmse"], 1.2 * self.clean_ate() + 0.001)

    def test_one_second_of_missing_images_is_survived(self):
        folder = self.copy_sequence()
        gone = [pair[1] for pair in self.pairs(folder)[15:45]]
        for file in gone:
            (folder / file).unlink()
        done = self.run_slam(folder)
        self.assertIn(done.returncode, (0, 7), done.stderr)
        self.assert_sound()
        self.assertEqual(len(self.metrics()["skipped_images"]), 30)

    def test_truncated_and_corrupt_images_are_skipped_not_used_in_part(self):
        folder = self.copy_sequence(frames=30)
        pairs = self.pairs(folder)
        bad = []
        for i, share in ((5, 0.03), (7, 0.5), (9, 0.95)):
            for file in (pairs[i][1], pairs[i + 1][3]):  # a JPEG, and a depth PNG of the next pair
                data = (folder / file).read_bytes()
                (folder / file).write_bytes(data[:int(share * len(data))])
                bad.append(file)
        for i, file in ((15, pairs[15][1]), (18, pairs[18][3])):
            data = bytearray((folder / file).read_bytes())
            data[len(data) // 2:len(data) // 2 + 60] = b"\xff\x00" * 30
            (folder / file).write_bytes(data)
            bad.append(file)
        (folder / pairs[21][1]).write_bytes(b"")
        (folder / pairs[24][3]).unlink()
        (folder / pairs[24][3]).mkdir()
        bad += [pairs[21][1], pairs[24][3]]
        done = self.run_slam(folder)
        self.assert_ran(done)
        metrics = self.metrics()
        self.assertEqual({entry["file"] for entry in metrics["skipped_images"]}, set(bad))
        self.assertEqual(metrics["readable"], 30 - len(bad))
        self.assertTrue(all(entry["reason"] for entry in metrics["skipped_images"]))
        # 5 to 10 in a row, then 15, 18, 21 and 24: one warning for each burst.
        self.assertEqual(done.stderr.count("skipping"), 5, done.stderr)

    def test_images_of_another_kind_are_rejected_with_the_reason(self):
        folder = self.copy_sequence(frames=30)
        pairs = self.pairs(folder)
        kinds = ((pairs[5][1], png(WIDTH // 2, HEIGHT // 2, channels=3)),
                 (pairs[8][1], png(WIDTH, HEIGHT, bits=16, channels=3)),
                 (pairs[11][1], png(WIDTH, HEIGHT, channels=1, value=90)),
                 (pairs[14][3], png(WIDTH, HEIGHT, bits=8, value=90)),
                 (pairs[17][3], png(HEIGHT, WIDTH, bits=16, value=9000)),
                 (pairs[20][3], png(WIDTH, HEIGHT, channels=3, bits=16, value=9000)))
        for file, data in kinds:
            (folder / file).write_bytes(data)
        metrics = self.assert_skipped(folder, [file for file, _ in kinds], "x", "bit", "channel",
                                      warnings=len(kinds))
        self.assertIn(f"{WIDTH // 2}x{HEIGHT // 2}", metrics["skipped_images"][0]["reason"])

    def test_without_depth_no_pose_is_broken(self):
        folder = self.copy_sequence()
        for _, _, _, depth in self.pairs(folder)[20:]:
            (folder / depth).write_bytes(png(WIDTH, HEIGHT, bits=16))
        done = self.run_slam(folder)
        self.assertIn(done.returncode, (0, 7), done.stderr)
        self.assert_sound()

    def test_a_view_gone_for_most_of_the_time_is_code_7_with_all_files(self):
        folder = self.copy_sequence()
        for _, colour, _, _ in self.pairs(folder)[12:]:
            (folder / colour).write_bytes(png(WIDTH, HEIGHT, channels=3))
        done = self.run_slam(folder)
        self.assert_ran(done, code=7)
        self.assertIn("lost for", done.stderr)
        self.assert_sound()
        metrics = self.metrics()
        self.assertLess(metrics["coverage"], 0.5)
        stamps = [float(pair[0]) for pair in self.pairs(folder)]
        (begin, end), = metrics["lost_intervals"]
        self.assertLessEqual(begin - stamps[12], 0.5)  # F7
        self.assertAlmostEqual(end, stamps[-1], places=6)
        done = self.run_slam(folder, "--set", "run.max_lost_share=1", out="tolerant")
        self.assert_ran(done)

    def test_nothing_readable_is_code_4(self):
        folder = self.copy_sequence(frames=5)
        for _, colour, _, _ in self.pairs(folder):
            (folder / colour).write_bytes(b"no picture")
        self.assert_error(self.run_slam(folder, "--quiet"), 4, str(folder))
        folder = self.copy_sequence("depth", frames=5)
        for _, _, _, depth in self.pairs(folder):
            (folder / depth).write_bytes(b"no picture")
        self.assert_error(self.run_slam(folder, "--quiet"), 4, str(folder))
        self.assertFalse((self.folder / "out").exists())
        # An earlier run's files, the log among them, stay as they were; so does a folder of others.
        self.assert_ran(self.run_slam(sequence(), "--to", 5))
        before = {path.name: path.read_bytes() for path in (self.folder / "out").iterdir()}
        self.assertIn(f"{FRAMES} pairs", self.log())
        self.assertEqual(self.run_slam(folder).returncode, 4)
        self.assertEqual({path.name: path.read_bytes() for path in (self.folder / "out").iterdir()},
                         before)


class Lists(CliTest):
    """F11, F12: what the text files of a sequence may hold."""

    def test_a_missing_folder_or_list_is_code_4(self):
        self.assert_error(self.run_slam(self.folder / "none", "--quiet"), 4, "none")
        empty = self.folder / "empty"
        empty.mkdir()
        self.assert_error(self.run_slam(empty, "--quiet"), 4, "rgb.txt")
        file = self.folder / "file"
        file.write_text("x", encoding="utf-8")
        self.assert_error(self.run_slam(file, "--quiet"), 4, "file")

    def test_a_folder_of_recordings_names_them(self):
        for name in ("walk", "sit"):
            self.copy_sequence(name, frames=2)
        (self.folder / "notes").mkdir()
        self.assert_error(self.run_slam(self.folder, "--quiet"), 4,
                          f"{self.folder}: no recording; it contains 2: sit, walk")

    def test_odd_stamps_are_left_out_and_counted(self):
        folder = self.copy_sequence(frames=30)
        lines = lines_of(folder / "associations.txt")
        shown = lines[10].split()
        odd = [lines[3],                                             # again, out of order
               lines[10],                                            # duplicate of the next
               "-5.0 rgb/a.jpg -5.0 depth/a.png",                    # negative
               "nan rgb/a.jpg nan depth/a.png",                      # not a number
               f"4600.0 {shown[1]} 4600.0 {shown[3]}",               # one hour ahead
               "1000.4 ../../etc/passwd 1000.4 depth/a.png",         # out of the folder
               "words"]
        (folder / "associations.txt").write_text("\n".join(lines[:11] + odd + lines[11:]) + "\n",
                                                 encoding="utf-8")
        done = self.run_slam(folder)
        self.assert_ran(done)
        self.assertEqual(self.metrics()["frames"], 30)
        self.assertEqual([stamp for stamp, _ in trajectory(self.folder / "out/trajectory.txt")],
                         [line.split()[0] for line in lines])
        self.assertIn(f"{len(odd)} of {len(lines) + len(odd)} lines left out", done.stderr)

    def test_a_list_without_a_usable_line_is_code_4(self):
        for text in ("nan a nan b\n", "-1 rgb/a -1 depth/a\n", "", "# only words\n", "\x00\xff\n"):
            folder = self.copy_sequence(f"bad{abs(hash(text))}", frames=3)
            (folder / "associations.txt").write_text(text, encoding="utf-8")
            self.assert_error(self.run_slam(folder, "--quiet"), 4, "associations.txt")

    def unpaired(self, offset_s, jitter_s=0.0):
        """A sequence of two lists whose depth comes later by the offset."""
        folder = self.copy_sequence(f"offset{offset_s}")
        pairs = self.pairs(folder)
        (folder / "associations.txt").unlink()
        wobble = [jitter_s * math.sin(1.7 * i * i) for i in range(len(pairs))]
        for name, column, late in (("rgb.txt", 1, 0.0), ("depth.txt", 3, offset_s)):
            rows = [f"{float(pair[0]) + late + wobble[i]:.6f} {pair[column]}"
                    for i, pair in enumerate(pairs)]
            (folder / name).write_text("\n".join(rows) + "\n", encoding="utf-8")
        return folder

    def test_an_offset_of_50_ms_is_told(self):
        done = self.run_slam(self.unpaired(0.05, jitter_s=0.008))
        self.assertIn(done.returncode, (0, 4, 7), done.stderr)
        self.assertRegex(done.stderr, r"offset by (49|50) ms")

    def test_lists_that_do_not_meet_are_code_4(self):
        done = self.run_slam(self.unpaired(1000.0), "--quiet")
        self.assert_error(done, 4, "0 of 60", "nothing in common")
        self.assert_error(self.run_slam(self.unpaired(0.2 + 60 / 30), "--quiet"), 4, "0 of 60")

    def test_broken_ground_truth_does_not_stop_the_run(self):
        folder = self.copy_sequence(frames=12)
        for text in ("1 2 nan\n", "5000 0 0 0 0 0 0 1\n", ""):
            (folder / "groundtruth.txt").write_text(text, encoding="utf-8")
            done = self.run_slam(folder)
            self.assert_ran(done)
            self.assertIn("groundtruth.txt", done.stderr)
            self.assertNotIn("ate", self.metrics())


class Cameras(CliTest):
    """F6, F20: calibration.txt and --camera."""

    BAD = (("fx 0", "fx"), ("fx -500", "fx"), ("fx nan", "fx"), ("fx inf", "fx"), ("fx 1e9", "fx"),
           ("k1 1e9", "k1"), ("depth_scale 0", "depth_scale"), ("width -3", "width"),
           ("width 0.5", "width"), ("fx 12,5", "fx"), ("cx 1e5", "cx"), ("fz 500", "fx"),
           ("fx 500\nfx 500", "fx"), ("p1 2", "p1"), ("height 99999999999", "height"),
           ("cx -1", "cx"), ("cy 241", "cy"), ("k1 -1", "k1"))

    def test_an_impossible_calibration_names_file_line_and_key(self):
        folder = self.copy_sequence(frames=3)
        good = {"fx": "fx 267", "fy": "fy 269", "cx": "cx 159", "cy": "cy 123"}
        for bad, key in self.BAD:
            name = bad.split()[0]
            lines = [line for k, line in good.items() if k != name] + ["# a comment", bad]
            line = len(lines) + bad.count("\n")
            (folder / "calibration.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
            done = self.run_slam(folder, "--quiet")
            self.assert_error(done, 3, f"calibration.txt:{line}:", key)
        (folder / "calibration.txt").write_text("fx 267\nfy 269\ncx 159\n", encoding="utf-8")
        self.assert_error(self.run_slam(folder, "--quiet"), 3, "calibration.txt", "'cy'")
        (folder / "calibration.txt").unlink()
        self.assert_error(self.run_slam(folder, "--quiet"), 3, "no calibration.txt", "--camera")

    def test_a_lens_that_cannot_be_undone_is_refused_and_an_odd_one_runs(self):
        folder = self.copy_sequence(frames=12)
        freiburg1 = {"fx": 258.7, "fy": 258.2, "cx": 159.3, "cy": 127.7, "k1": 0.262383,
                     "k2": -0.953104, "p1": -0.005358, "p2": 0.002628, "k3": 1.163314}
        def run(**changes):
            text = "".join(f"{k} {v}\n" for k, v in {**freiburg1, **changes}.items())
            (folder / "calibration.txt").write_text(text, encoding="utf-8")
            return self.run_slam(folder, "--quiet")
        for changes in ({"k3": 0}, {"k1": -1}, {"p1": -0.9}):
            self.assert_error(run(**changes), 3, "calibration.txt:5: k1", "cannot be undone")
        plain = dict.fromkeys(("k1", "k2", "p1", "p2", "k3"), 0)
        for changes in ({}, {"cx": 0}, {**plain, "cx": 0}, {**plain, "k1": 9}, {**plain, "k3": 900}):
            self.assertIn(run(**changes).returncode, (0, 7), changes)  # the images know another lens
            self.assert_sound()

    def test_an_impossible_camera_file_names_file_and_key(self):
        file = self.folder / "camera.yaml"
        good = {"fx": "fx: 267", "fy": "fy: 269", "cx": "cx: 159", "cy": "cy: 123"}
        for bad, key in self.BAD:
            name = bad.split()[0]
            if "\n" in bad:
                continue
            lines = [line for k, line in good.items() if k != name] + [bad.replace(" ", ": ")]
            file.write_text("\n".join(lines) + "\n", encoding="utf-8")
            done = self.run_slam(sequence(), "--camera", file, "--quiet")
            self.assert_error(done, 3, "camera.yaml", key)
        file.write_text("fx: 267\nfy: -269\ncx: 159\ncy: 123\nk1: 0.1\n", encoding="utf-8")
        done = self.run_slam(sequence(), "--camera", file, "--quiet")
        self.assert_error(done, 3, "camera.yaml:2:", "fy")
        for text, key in (("fx: 267\nfy: 269\ncx: 159\n", "cy"), ("", "fx"), ("fx: [1]\n", "fx")):
            file.write_text(text, encoding="utf-8")
            if key == "cy":
                continue  # a principal point at 0 is odd but possible
            self.assert_error(self.run_slam(sequence(), "--camera", file, "--quiet"), 3,
                              "camera.yaml", key)
        self.assert_error(self.run_slam(sequence(), "--camera", self.folder / "no.yaml", "--quiet"),
                          3, "no.yaml")

    def test_a_camera_file_replaces_the_calibration(self):
        folder = self.copy_sequence(frames=20)
        wanted = (folder / "calibration.txt").read_text(encoding="utf-8")
        self.assert_ran(self.run_slam(folder, out="calibrated"))
        file = self.folder / "camera.yaml"
        file.write_text(wanted.replace(" ", ": ").replace("#: ", "# "), encoding="utf-8")
        (folder / "calibration.txt").write_text("fx 0\n", encoding="utf-8")
        self.assert_ran(self.run_slam(folder, "--camera", file))
        self.assertEqual((self.folder / "out/trajectory.txt").read_bytes(),
                         (self.folder / "calibrated/trajectory.txt").read_bytes())

    def test_a_wrong_depth_scale_is_warned_of(self):
        folder = self.copy_sequence(frames=10)
        text = (folder / "calibration.txt").read_text(encoding="utf-8")
        self.assertNotIn("depth_scale", self.run_slam(folder).stderr)
        for scale in (1000, 25000):  # 5 x and 0.2 x the depth
            (folder / "calibration.txt").write_text(
                text.replace("depth_scale 5000", f"depth_scale {scale}"), encoding="utf-8")
            done = self.run_slam(folder)
            self.assertIn(done.returncode, (0, 7), done.stderr)
            self.assertRegex(done.stderr, "warning: .*depth_scale", scale)

    def test_depth_that_is_turned_over_is_warned_of(self):
        """Also colour that an EXIF tag turns for other programs; and one depth for all."""
        folder = self.copy_sequence(frames=3)
        files = [folder / depth for *_, depth in self.pairs(folder)]
        whole = [np.asarray(Image.open(file)) for file in files]
        for change, word in ((lambda d: d, None), (lambda d: d[::-1], "upside down"),
                             (lambda d: d[:, ::-1], "mirrored"), (lambda d: d[::-1, ::-1], "turned by 180 degrees"),
                             (lambda d: np.full_like(d, 9000), "1.80 m everywhere")):
            for file, depth in zip(files, whole):
                Image.fromarray(np.ascontiguousarray(change(depth)).astype(np.uint16)).save(file)
            done = self.run_slam(folder)
            if word:
                self.assertRegex(done.stderr, f"warning: the first frame's depth .*{word}")
            else:
                self.assertNotIn("the first frame", done.stderr)


class Masks(CliTest):
    """--segmenter masks:DIR"""

    def run_masks(self, folder, masks, *options):
        return self.run_slam(folder, "--segmenter", f"masks:{masks}", *options, geometry=False)

    def test_a_folder_without_masks_is_code_4(self):
        empty = self.folder / "empty"
        empty.mkdir()
        (empty / "readme.png").write_bytes(b"x")
        for masks in (self.folder / "none", empty):
            self.assert_error(self.run_masks(sequence(), masks, "--quiet"), 4, masks.name)

    def test_unreadable_missing_and_wrongly_sized_masks_are_counted_and_the_run_goes_on(self):
        folder = self.copy_sequence(frames=20)
        stamps = [pair[0] for pair in self.pairs(folder)]
        (folder / "mask" / f"{stamps[5]}.png").unlink()
        (folder / "mask" / f"{stamps[8]}.png").write_bytes(b"no picture")
        (folder / "mask" / f"{stamps[11]}.png").write_bytes(png(WIDTH // 2, HEIGHT // 2))
        done = self.run_masks(folder, folder / "mask")
        self.assert_ran(done)
        self.assert_sound()
        metrics = self.metrics()
        self.assertEqual((metrics["masks_failed"], metrics["coverage"]), (3, 1.0))
        self.assertIn("warning", done.stderr)

    def test_broken_instances_are_code_4(self):
        folder = self.copy_sequence(frames=3)
        for text in ("[1, 2]", "{", '{"a": "person"}', '{"300": "person"}', '{"1": []}',
                     "[" * 100000):
            (folder / "instances.json").write_text(text, encoding="utf-8")
            self.assert_error(self.run_masks(folder, folder / "mask", "--quiet"), 4,
                              "instances.json")


if __name__ == "__main__":
    unittest.main(verbosity=2)
