"""`ygslam inspect`: its table against the truth, its pictures, its faults."""
import json
import os
import shutil
import struct
import subprocess
import unittest

from ygslam_cli import BINARY, HEIGHT, WIDTH, CliTest, lines_of, sequence, ygslam


def jpeg_size(path):
    """(width, height) from a JPEG's frame header."""
    data = path.read_bytes()
    at = 2
    while data[at + 1] not in (0xC0, 0xC1, 0xC2):
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    height, width = struct.unpack(">HH", data[at + 5:at + 9])
    return width, height


class Inspect(CliTest):
    def inspect(self, *options, folder=None):
        return ygslam("inspect", folder or sequence(), *options)

    def test_checks_are_compared_with_the_truth_and_drawn_side_by_side(self):
        out = self.folder / "out"
        done = self.inspect("--out", out, "--segmenter", f"masks:{sequence() / 'mask'}",
                            "--frames", "20,40", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        printed = json.loads(done.stdout)
        self.assertEqual(printed, json.loads((out / "inspect.json").read_text(encoding="utf-8")))
        self.assertTrue(printed["truth"])
        checks = {check["name"]: check for check in printed["checks"]}
        self.assertEqual(list(checks), ["classic", "improved", "full"])
        for check in checks.values():
            judged = check["found"] + check["false_alarms"]
            self.assertAlmostEqual(check["precision"], check["found"] / judged if judged else 1)
            moving = check["found"] + check["missed"]
            self.assertGreater(moving, 0)
            self.assertAlmostEqual(check["recall"], check["found"] / moving)
        self.assertGreater(checks["full"]["recall"], 0.8)
        self.assertGreater(checks["full"]["recall"], checks["classic"]["recall"])
        self.assertEqual(checks["full"]["mask_iou"], 1)  # the masks are the truth
        self.assertNotIn("mask_iou", checks["classic"])
        self.assertEqual({path.name for path in out.iterdir()},
                         {"frame_000020.jpg", "frame_000040.jpg", "checks.jpg", "inspect.json",
                          "tracks.txt", "tracks_truth.txt"})
        self.assertEqual(jpeg_size(out / "frame_000020.jpg"), (3 * WIDTH, HEIGHT))
        self.assertEqual(jpeg_size(out / "checks.jpg"), (2 * WIDTH // 2, 3 * HEIGHT // 2))

    def test_without_truth_it_draws_and_says_so(self):
        folder = self.copy_sequence("plain", 20)
        shutil.rmtree(folder / "mask")
        out = self.folder / "out"
        done = self.inspect("--out", out, "--checks", "improved", folder=folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("no truth", done.stdout)
        self.assertTrue((out / "checks.jpg").exists())

    def test_faults_are_one_line_with_the_right_exit_code(self):
        damaged = self.copy_sequence("damaged", 20)
        missing = sorted((damaged / "mask").iterdir())[5]
        missing.unlink()
        for options, folder, code, said in (
                (("--frames", "60"), None, 2, "--frames 60"),
                (("--frames", "one"), None, 2, "one"),
                (("--checks", "best"), None, 2, "best"),
                (("--checks", "full", "--segmenter", "model"), None, 5, "make model"),
                (("--set", "motion.reprojection=1", "--checks", "classic"), None, 3, "motion.reprojection_px"),
                (("--checks", "classic"), self.folder / "nowhere", 4, "nowhere"),
                (("--checks", "classic"), damaged, 4, missing.name)):
            with self.subTest(options=options):
                done = self.inspect(*options, folder=folder)
                self.assertEqual(done.returncode, code, done.stderr)
                last = done.stderr.strip().splitlines()[-1]
                self.assertTrue(last.startswith("error: "), done.stderr)
                self.assertIn(said, last)


LOOPS = ("stamp,keyframe,place,place_stamp,outcome,verdict,score,matches,guided,inliers,"
         "contradiction,path_m,correction_m,correction_rad,agreeing,stretch\n")


class Loops(CliTest):
    """`ygslam inspect SEQ --loops OUT`."""

    def write_loops(self, *rows, out="out"):
        folder = self.folder / out
        folder.mkdir(exist_ok=True)
        (folder / "loops.csv").write_text(LOOPS + "".join(row + "\n" for row in rows), encoding="utf-8")
        return folder

    def row(self, last=20, end="closed,agrees"):
        stamps = [line.split()[0] for line in lines_of(sequence() / "groundtruth.txt")]
        return f"{stamps[last]},9,1,{stamps[0]},{end},0.3,50,99,70,0.02,31.5,0.25,0.1,4,1.2"

    def test_reads_what_a_run_wrote(self):
        self.assert_ran(self.run_slam(sequence(), "--to", 10))
        done = ygslam("inspect", sequence(), "--loops", self.folder / "out")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout, "no keyframe was compared with a place\n")

    def test_tells_stages_and_true_places(self):
        out = self.write_loops(self.row(), self.row(end="refused,contradicts"))
        done = ygslam("inspect", sequence(), "--loops", out)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"(?m)^contradicts +1 +1 +0$")
        self.assertRegex(done.stdout, r"(?m)^closed +1 +1 +0$")
        self.assertRegex(done.stdout, r"(?m)^ +\S+ +9 +1 +70 +31\.5 +0\.250 +5\.73 +4 +1\.20 .* yes$")
        printed = json.loads(ygslam("inspect", sequence(), "--loops", out, "--json").stdout)
        self.assertEqual(printed["stages"]["closed"]["true_places"], 1)
        self.assertTrue(printed["closed"][0]["same_place"])

    def test_without_truth_it_says_so(self):
        done = ygslam("inspect", self.folder, "--loops", self.write_loops(self.row()))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("no truth", done.stdout)
        self.assertNotIn("true places", done.stdout)

    def test_faults_are_one_line_with_the_right_exit_code(self):
        good = self.write_loops(self.row())
        bad = self.write_loops(self.row(), self.row()[:40], out="bad")
        for arguments, code, said in (
                ((sequence(), "--loops", self.folder / "nowhere"), 4, "nowhere/loops.csv"),
                ((sequence(), "--loops", bad), 4, "bad/loops.csv:3: "),
                ((self.folder / "nowhere", "--loops", good), 4, "nowhere"),
                ((sequence(), "--loops", good, "--checks", "full"), 2, "--checks")):
            with self.subTest(arguments=arguments):
                done = ygslam("inspect", *arguments)
                self.assertEqual((done.returncode, done.stdout), (code, ""), done.stderr)
                self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z")
                self.assertIn(said, done.stderr)


class Overwriting(CliTest):
    """Nothing that was there is lost, nothing stale is left."""

    def test_eval_does_not_write_over_what_it_read_nor_over_a_pipe(self):
        truth = self.folder / "truth.txt"
        shutil.copy(sequence() / "groundtruth.txt", truth)
        before = truth.read_bytes()
        done = ygslam("eval", "--gt", truth, "--est", truth, "--errors", truth)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("truth.txt", done.stderr)
        self.assertEqual(truth.read_bytes(), before)
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        done = ygslam("eval", "--gt", truth, "--est", truth, "--errors", pipe)
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertTrue(pipe.is_fifo())

    def test_a_full_standard_output_is_an_output_error(self):
        with open("/dev/full", "wb") as full:
            done = subprocess.run([BINARY, "config"], stdout=full, stderr=subprocess.PIPE,
                                  check=False, text=True)
        self.assertEqual(done.returncode, 9, done.stderr)

    def test_a_new_rendering_leaves_no_truth_of_the_old_one(self):
        folder = self.folder / "world"
        small = ("--out", folder, "--seconds", "0.2", "--size", "64x48")
        self.assertEqual(ygslam("simulate", "walking_xyz", "--truth", *small).returncode, 0)
        self.assertTrue((folder / "mask").exists())
        self.assertEqual(ygslam("simulate", "static_xyz", *small).returncode, 0)
        for name in ("mask", "moving", "instances.json", "movers", "static.ply"):
            self.assertFalse((folder / name).exists(), name)

    def test_numbers_that_are_none_are_refused(self):
        for option in ("--fps", "--blur", "--rolling", "--exposure-drift", "--seconds"):
            with self.subTest(option=option):
                done = ygslam("simulate", "static_xyz", "--out", self.folder / "w",
                              f"{option}=nan")
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(option, done.stderr)
                self.assertFalse((self.folder / "w").exists())

    def test_a_pipe_in_place_of_a_mask_does_not_hang(self):
        folder = self.copy_sequence("piped", 15)
        mask = sorted((folder / "mask").iterdir())[11]
        mask.unlink()
        os.mkfifo(mask)
        done = ygslam("inspect", folder, "--checks", "improved")
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn(f"{mask.name}: not a regular file", done.stderr)


if __name__ == "__main__":
    unittest.main()
