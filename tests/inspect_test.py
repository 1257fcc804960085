"""`ygslam inspect`: its table against the truth, its pictures, its faults."""
import json
import shutil
import struct
import unittest

from ygslam_cli import HEIGHT, WIDTH, CliTest, sequence, ygslam


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
                         {"frame_000020.jpg", "frame_000040.jpg", "checks.jpg", "inspect.json"})
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
                (("--checks", "full"), None, 5, "make model"),
                (("--set", "rigid.limit=1", "--checks", "classic"), None, 3, "rigid.limit_px"),
                (("--checks", "classic"), self.folder / "nowhere", 4, "nowhere"),
                (("--checks", "classic"), damaged, 4, missing.name)):
            with self.subTest(options=options):
                done = self.inspect(*options, folder=folder)
                self.assertEqual(done.returncode, code, done.stderr)
                last = done.stderr.strip().splitlines()[-1]
                self.assertTrue(last.startswith("error: "), done.stderr)
                self.assertIn(said, last)


if __name__ == "__main__":
    unittest.main()
