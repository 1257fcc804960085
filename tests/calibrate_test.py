"""`ygslam calibrate`, and how cameras tell of their shutter."""
import pathlib
import re
import shutil
import tempfile
import unittest

from ygslam_cli import CliTest, sequence, ygslam

DELAY_MS = -8
TIMES = ("colour_readout_ms", "depth_readout_ms", "depth_delay_ms")
READOUT_MS = 0.8 * 1000 / 30


def with_lines(folder, *lines):
    """Its calibration.txt with these lines in place of the shutter's."""
    path = folder / "calibration.txt"
    kept = [line for line in path.read_text().splitlines() if not line.startswith(TIMES)]
    path.write_text("\n".join([*kept, *lines]) + "\n")


class Calibrate(CliTest):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="ygslam-lively-")
        cls.addClassCleanup(folder.cleanup)
        cls.rendered = pathlib.Path(folder.name, "lively")
        done = ygslam("simulate", "walking_rpy", "--out", cls.rendered, "--without", "movers",
                      "--size", "320x240", "--seconds", 6, "--rolling", 0.8,
                      "--depth-delay-ms", DELAY_MS)
        assert done.returncode == 0, done.stderr

    def setUp(self):
        super().setUp()
        self.lively = self.folder / "lively"
        shutil.copytree(self.rendered, self.lively)

    def found(self, done):
        """Name: (found, standard deviation, verdict)."""
        rows = re.findall(r"^(\S.*?) {2,}[^\n]*?([-+]?[\d.]+) +([\d.]+) (?:ms|%/m|%|px) +(.*)$",
                          done.stdout, re.M)
        return {name: (float(value), float(std), verdict) for name, value, std, verdict in rows}

    def test_finds_an_unknown_readout_and_writes_a_camera_that_runs_use(self):
        with_lines(self.lively)
        camera = self.folder / "camera.yaml"
        done = ygslam("calibrate", self.lively, "--write", camera)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = self.found(done)
        value, std, verdict = found["colour_readout_ms"]
        self.assertAlmostEqual(value, READOUT_MS, delta=2)
        self.assertLess(std, 2)
        self.assertEqual(verdict, "differs")
        self.assertRegex(done.stdout, r"\A +in use +found ")
        self.assertIn("In use: nothing is known, taken as global.\n", done.stdout)
        self.assertAlmostEqual(found["depth_delay_ms"][0], DELAY_MS, delta=3)
        errors = {}
        as_global = self.folder / "as_global"
        shutil.copytree(self.lively, as_global)
        with_lines(as_global, *(f"{key} 0" for key in TIMES))
        for name, folder, options in (("without", as_global, ()),
                                      ("with", self.lively, ("--camera", camera))):
            run = ygslam("run", folder, *options, "--deterministic", "--dynamic", "geometry",
                         "--out", self.folder / name)
            self.assert_ran(run)
            errors[name] = self.metrics(name)["ate"]["rmse"]
        self.assertLess(errors["with"], 0.5 * errors["without"])

    def test_a_file_that_is_right_agrees(self):
        done = ygslam("calibrate", self.lively)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertAlmostEqual(self.found(done)["colour_readout_ms"][0], READOUT_MS, delta=2)
        self.assertIn("In use: calibration.txt.\n", done.stdout)

    def test_times_that_were_not_told_are_not_written(self):
        calm, camera = self.folder / "calm", self.folder / "camera.yaml"
        done = ygslam("simulate", "walking_halfsphere", "--out", calm, "--without", "movers",
                      "--size", "160x120", "--seconds", 5, "--rolling", 0.8)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = ygslam("calibrate", calm, "--write", camera, "--quiet")
        self.assertEqual(self.found(done)["colour_readout_ms"][2], "this motion does not tell")
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertRegex(done.stderr, r"\Aerror: [^\n]+not written\n\Z")
        self.assertFalse(camera.exists())

    def test_a_calm_recording_is_not_told_to_differ(self):
        calm, camera = self.folder / "calm", self.folder / "camera.yaml"
        done = ygslam("simulate", "robot_rounds", "--out", calm, "--without", "movers", "--size", "320x240",
                      "--seconds", 15)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = ygslam("calibrate", calm, "--write", camera, "--quiet")
        self.assertIn(done.returncode, (0, 4), done.stderr)
        for name in TIMES:
            self.assertIn(self.found(done)[name][2], ("agrees", "this motion does not tell"), name)
        self.assertEqual(camera.exists(), done.returncode == 0)
        if done.returncode == 0:
            lines = camera.read_text(encoding="utf-8").splitlines()
            self.assertEqual([line for line in lines if line.startswith(TIMES)], [f"{name}: 0" for name in TIMES])

    def test_what_cannot_be_told_is_an_error_in_one_line(self):
        for arguments, code in ((("--to", 10), 4), (("--from", 9999), 2)):
            done = ygslam("calibrate", self.lively, *arguments)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z")
        done = ygslam("calibrate", self.lively, "--to", 100, "--write", self.folder / "no" / "c.yaml")
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertNotIn("too short", done.stderr)

    def test_where_it_cannot_be_written_is_told_before_the_work(self):
        done = ygslam("calibrate", self.lively, "--to", 10, "--write", self.folder)
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z")


class Shutter(CliTest):
    def assert_refused(self, lines, *words):
        folder = self.folder / "refused"
        shutil.copytree(sequence(), folder, dirs_exist_ok=True)
        with_lines(folder, *lines)
        done = self.run_slam(folder)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z")
        for word in ("calibration.txt:", *words):
            self.assertIn(word, done.stderr)

    def test_times_no_camera_has_are_refused_with_file_line_and_key(self):
        self.assert_refused(["colour_readout_ms 40"], "colour_readout_ms", "frame to frame")
        self.assert_refused(["depth_readout_ms 1e9"], "depth_readout_ms")
        self.assert_refused(["depth_delay_ms nan"], "depth_delay_ms")
        self.assert_refused(["camera nikon"], "camera: 'nikon'", "kinect_v1")
        self.assert_refused(["camera realsense_d455", "colour_readout_ms 20"],
                            "colour_readout_ms", "at once")
        self.assert_refused(["camera xtion", "camera xtion"], "given twice")

    def test_a_read_out_as_long_as_a_frame_is_taken(self):
        out = self.folder / "rendered"
        done = ygslam("simulate", "static_xyz", "--out", out, "--size", "160x120", "--seconds", "0.2",
                      "--quiet", "--rolling", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.run_slam(out)
        self.assertNotEqual(done.returncode, 3, done.stderr)

    def test_worlds_are_rendered_as_a_known_camera_reads_them(self):
        out = self.folder / "rendered"
        small = ("--out", out, "--size", "160x120", "--seconds", "0.1", "--quiet")
        done = ygslam("simulate", "static_xyz", *small, "--camera", "kinect_v1")
        self.assertEqual(done.returncode, 0, done.stderr)
        calibration = (out / "calibration.txt").read_text()
        self.assertIn("colour_readout_ms 26\n", calibration)
        self.assertIn("depth_readout_ms 34\n", calibration)
        for how, word in ((("nikon",), "realsense_d455"), (("azure_kinect",), "--rolling"),
                          (("kinect_v1", "--rolling", 0.5), "--rolling"),
                          (("kinect_v1", "--fps", 60), "60 frames per second")):
            done = ygslam("simulate", "static_xyz", *small, "--camera", *how)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z")
            self.assertIn(word, done.stderr)

    def test_the_log_says_where_the_times_come_from(self):
        folder = self.folder / "named"
        shutil.copytree(sequence(), folder)
        named = self.folder / "tum_fr3_part"
        shutil.copytree(sequence(), named)
        text = (named / "calibration.txt").read_text()
        (named / "calibration.txt").write_text(re.sub(r"(?m)^(f[xy]) .*", r"\1 530", text))
        with_lines(named)
        self.assertIn("shutter from Asus Xtion Pro Live, taken from the name of the folder: "
                      "colour is read in 26 ms, depth in 34 ms, ",
                      self.run_slam(named, "--to", 10, out="by_name").stderr)
        with_lines(folder, "camera kinect_v1")
        done = self.run_slam(folder, "--to", 10)
        self.assert_ran(done)
        self.assertIn("colour is read in 26 ms", done.stderr)
        with_lines(folder)
        (folder / "calibration.txt").write_text(
            (folder / "calibration.txt").read_text().replace("camera kinect_v1\n", ""))
        self.assertIn("shutter unknown", self.run_slam(folder, "--to", 10, out="unknown").stderr)
        with_lines(folder, "colour_readout_ms 20.4626951")
        self.assertIn("shutter from calibration.txt: colour is read in 20.5 ms, ",
                      self.run_slam(folder, "--to", 10, out="exact").stderr)
        camera = self.folder / "camera.yaml"
        camera.write_text("".join(f"{key}: {value}\n" for key, value in (
            line.split() for line in (folder / "calibration.txt").read_text().splitlines()
            if line and line[0] != "#")))
        told = self.run_slam(folder, "--to", 10, "--camera", camera, out="given").stderr
        self.assertIn(f"camera from {camera}, ", told)
        self.assertIn(f"shutter from {camera}: ", told)
        with_lines(folder, "colour_readout_ms -20")
        self.assert_ran(self.run_slam(folder, "--to", 10, out="upwards"))


if __name__ == "__main__":
    unittest.main()
