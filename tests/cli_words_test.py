"""What the command line says: help, what was written, how far it has come."""
import json
import re
import unittest

from ygslam_cli import CliTest, sequence, ygslam


class Words(CliTest):
    def test_help_of_run_says_what_is_needed_first_and_groups_the_rest(self):
        text = ygslam("run", "--help").stdout
        self.assertRegex(text, r"(?m)^ +--out DIR REQUIRED ")
        order = [text.index(f"\n{word}") for word in (
            "Positionals:", "Options:", "Input:", "Settings:", "What is written:", "Watching:",
            "Examples:")]
        self.assertEqual(order, sorted(order))
        self.assertLess(order[1], text.index("--out DIR"))
        self.assertLess(text.index("--out DIR"), order[2])
        for command in ("run", "localize", "inspect", "calibrate", "simulate"):
            text = ygslam(command, "--help").stdout
            self.assertNotRegex(text, r":(NONNEGATIVE|INT in|UINT in|FLOAT in \[0 - 9)", command)
        for option, shown in (("--from", r"N=0"), ("--stride", r"N=1"), ("--seed", "N"), ("--to", "N")):
            self.assertRegex(ygslam("run", "--help").stdout, rf"(?m)^ +{option} {shown} ")

    def test_help_names_the_files_that_are_written(self):
        text = ygslam("simulate", "--help").stdout
        self.assertRegex(text, r"(?m)^ +--out DIR +.*REQUIRED")
        out = self.folder / "world"
        self.assert_ran(ygslam("simulate", "walking_xyz", "--out", out, "--size", "160x120", "--seconds",
                               "0.1", "--truth", "--threads", "1"))
        for path in out.iterdir():
            self.assertIn(path.name, text)
        self.assert_ran(self.run_slam(sequence(), "--to", 5, "--export", self.folder / "scene"))
        text = ygslam("export", "--help").stdout
        for path in (self.folder / "scene").iterdir():
            self.assertIn(path.name, text)

    def test_an_unknown_command_names_the_nearest(self):
        for given, told in ((["confg"], "no command 'confg': did you mean config?"),
                            (["--quiet", "rum", "a", "--out", "b"], "'rum': did you mean run?"),
                            (["map", "chek", "a"], "'chek': did you mean check?"),
                            (["xyzzyxyzzy"], "no command 'xyzzyxyzzy' (see --help)")):
            done = ygslam(*given)
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertIn(told, done.stderr)
        self.assertNotIn("no command", ygslam("run", "map", "--bogus").stderr)

    def test_what_was_written_is_named_at_the_end(self):
        targets = {option: self.folder / name for option, name in (
            ("--export", "scene"), ("--save-map", "room.map"), ("--mcap", "run.mcap"), ("--trace", "trace.json"),
            ("--background", "back"), ("--debug-images", "pictures"),
            ("--save-masks", "masks"))}
        done = self.run_slam(sequence(), "--to", 8, *(word for both in targets.items() for word in both),
                             "--segmenter", f"masks:{sequence() / 'mask'}", geometry=False)
        self.assert_ran(done)
        last = done.stdout.splitlines()[-1]
        self.assertTrue(last.startswith(f"written: {self.folder / 'out'}, "), last)
        for option, path in targets.items():
            self.assertRegex(last, rf"{re.escape(str(path))}( with \S.*?)? \({option}\)")
        self.assertIn(last, self.log())
        self.assertRegex(done.stderr, r"background: 8 frames drawn in \d+\.\d s")
        plain = self.run_slam(sequence(), "--to", 8, out="plain").stdout.splitlines()[-1]
        self.assertEqual(plain, f"written: {self.folder / 'plain'}")
        truth = sequence() / "groundtruth.txt"
        errors, cloud, picture = (self.folder / name for name in ("e.csv", "cloud.ply", "room.png"))
        for file, command in ((errors, ("eval", "--gt", truth, "--est", truth, "--errors", errors)),
                              (cloud, ("map", "export", self.folder / "room.map", "-o", cloud)),
                              (picture, ("render", self.folder / "scene", "--out", picture)),
                              (targets["--export"], ("export", self.folder / "room.map", "--out",
                                                     targets["--export"]))):
            done = ygslam(*command)
            self.assert_ran(done)
            self.assertEqual(done.stdout.splitlines()[-1], f"written: {file}")
            self.assertNotIn("written", ygslam(*command, "--quiet").stdout)
        done = ygslam("eval", "--gt", truth, "--est", truth, "--errors", errors, "--json")
        json.loads(done.stdout)
        self.assertIn(f"info: written: {errors}\n", done.stderr)

    def test_debug_images_beside_those_of_an_earlier_run_are_told_and_left(self):
        pictures = self.folder / "pictures"
        draw = ("--debug-images", pictures, "--debug-every", 2)
        done = self.run_slam(sequence(), "--to", 8, *draw)
        self.assertNotIn("earlier run", done.stderr)
        mine = pictures / "mine.jpg"
        mine.write_bytes(b"x")
        done = self.run_slam(sequence(), "--to", 5, *draw)
        self.assert_ran(done)
        self.assertRegex(done.stderr, r"(?m)^warning: .*pictures: 1 picture of an earlier run")
        self.assertEqual(len(list(pictures.iterdir())), 5)
        self.assertEqual(mine.read_bytes(), b"x")

    def test_long_work_says_so_where_there_is_no_terminal(self):
        folder = self.copy_sequence(frames=6)
        pairs = self.pairs(folder)  # 11 s in real time, nearly all of it waiting
        stamps = [f"{1000 + 2.2 * i:.6f}" for i in range(len(pairs))]
        (folder / "associations.txt").write_text("".join(
            f"{stamp} {pair[1]} {stamp} {pair[3]}\n" for stamp, pair in zip(stamps, pairs)), encoding="utf-8")
        lines = rf"(?m)^info: \d of {len(pairs)}, [a-z]+$"
        done = self.run_slam(folder, "--realtime")
        self.assertEqual(len(re.findall(lines, done.stderr)), 1, done.stderr)
        self.assertNotRegex(self.log(), lines)
        self.assertEqual(self.run_slam(folder, "--realtime", "--quiet", out="quiet").stderr, "")


if __name__ == "__main__":
    unittest.main(verbosity=2)
