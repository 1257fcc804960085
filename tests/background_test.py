"""`run --background`: the recording once more, without what moves in it.

    python tests/background_test.py
"""
import shutil
import unittest

import numpy as np
from PIL import Image

from ygslam_cli import HEIGHT, WIDTH, CliTest, lines_of, sequence, ygslam

FRAME, VIEW, MAP, NEVER = 0, 64, 128, 255


def image(path):
    return np.asarray(Image.open(path))


class BackgroundPictures(CliTest):
    def draw(self, name="background", *options, **how):
        masks = ("--segmenter", f"masks:{sequence() / 'mask'}")
        return self.run_slam(sequence(), "--background", self.folder / name, *masks, *options,
                             geometry=False, **how)

    def test_pictures_without_people_open_as_a_sequence(self):
        self.assert_ran(self.draw())
        folder = self.folder / "background"
        stamps = [line.split()[0] for line in lines_of(self.folder / "out" / "trajectory.txt")]
        self.assertEqual([line.split()[0] for line in lines_of(folder / "rgb.txt")], stamps)
        squares, depths, hidden_pixels = [], [], 0
        for stamp in stamps[::3]:
            colour, depth = image(folder / "rgb" / f"{stamp}.png"), image(folder / "depth" / f"{stamp}.png")
            source = image(folder / "source" / f"{stamp}.png")
            self.assertEqual(colour.shape, (HEIGHT, WIDTH, 3))
            self.assertLessEqual(set(np.unique(source)), {FRAME, VIEW, MAP, NEVER})
            own = source == FRAME
            np.testing.assert_array_equal(depth[own], image(sequence() / "depth" / f"{stamp}.png")[own])
            mask = image(sequence() / "mask" / f"{stamp}.png") > 0
            self.assertFalse((mask & own).any(), "a person is left")
            self.assertFalse(colour[source == NEVER].any() or depth[source == NEVER].any())
            shown = mask & ((source == VIEW) | (source == MAP))
            hidden_pixels += shown.sum()
            truth = image(next((sequence() / "rgb_static").glob(f"{stamp}.*")))
            squares.append(((colour.astype(float) - truth) ** 2).mean(axis=-1)[shown])
            true_depth = image(sequence() / "depth_static" / f"{stamp}.png").astype(float)
            depths.append(np.abs(depth - true_depth)[shown] / 5000)
        self.assertGreater(hidden_pixels, 1000)
        self.assertGreater(10 * np.log10(255 ** 2 / np.concatenate(squares).mean()), 20)
        self.assertLess(np.median(np.concatenate(depths)), 0.02)
        done = ygslam("run", folder, "--out", self.folder / "again", "--dynamic", "off", "--deterministic")
        self.assert_ran(done)

    def test_the_recording_that_is_read_is_not_drawn_over(self):
        seq = self.copy_sequence(frames=3)
        before = {path: path.read_bytes() for path in seq.rglob("*") if path.is_file()}
        link = self.folder / "link"
        link.symlink_to(seq)
        beside = self.folder / "beside"
        beside.mkdir()
        (beside / "rgb").symlink_to(seq / "rgb")
        for folder in (seq, link, beside):
            done = self.run_slam(seq, "--background", folder, out="x")
            self.assert_error(done, 2, folder, "is of the recording that is read", out="x")
        self.assertEqual({path: path.read_bytes() for path in seq.rglob("*") if path.is_file()}, before)

    def test_a_call_that_ends_in_an_error_leaves_no_new_folder(self):
        new = [self.folder / name for name in ("out", "scene", "clean", "debug")]
        done = self.run_slam(sequence(), "--export", new[1], "--background", new[2], "--debug-images",
                             new[3], "--view", "1.2.3.4:1")
        self.assert_error(done, 2, "--view")
        self.assertEqual([folder for folder in new if folder.exists()], [])

    def test_two_runs_give_the_same_bytes(self):
        for name in ("one", "two"):
            self.assert_ran(self.draw(name, "--to", "20"))
        files = sorted(path.relative_to(self.folder / "one") for path in (self.folder / "one").rglob("*.*"))
        self.assertEqual(len(files), 3 * 20 + 4)
        for file in files:
            self.assertEqual((self.folder / "one" / file).read_bytes(),
                             (self.folder / "two" / file).read_bytes(), file)

    def test_without_masks_keyframes_and_free_space_tell(self):
        done = self.run_slam(sequence(), "--background", self.folder / "background", "--to", "30")
        self.assert_ran(done)
        self.assertEqual(len(lines_of(self.folder / "background" / "rgb.txt")), 30)

    def test_a_folder_that_cannot_be_written_is_told_before_the_run(self):
        (self.folder / "file").write_text("x", encoding="utf-8")
        self.assert_error(self.draw("file"), 9, self.folder / "file")

    def test_a_full_disk_leaves_the_earlier_lists(self):
        self.assert_ran(self.draw("background", "--to", "10"))
        folder = self.folder / "background"
        before = (folder / "associations.txt").read_bytes()
        shutil.rmtree(folder / "depth")
        (folder / "depth").symlink_to("/dev/full")
        done = self.draw("background", "--to", "12")
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertEqual((folder / "associations.txt").read_bytes(), before)


if __name__ == "__main__":
    unittest.main()
