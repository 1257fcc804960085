"""The contract of the command line: options, output files and their content."""
import csv
import json
import os
import pathlib
import re
import struct
import subprocess
import unittest

import numpy as np
from ygslam_cli import BINARY, FRAMES, HEIGHT, WIDTH, CliTest, lines_of, sequence, trajectory, ygslam

METRICS = {"frames", "readable", "tracked", "coverage", "lost_intervals", "keyframes", "landmarks",
           "skipped_images", "skipped_image_count", "colour_without_depth", "left_out",
           "trajectory_frames", "unjoined_frames", "lost_interval_count", "dropped", "masks_used", "mask_age_frames", "timing_ms", "cpu_ms",
           "startup_s", "wall_s", "peak_rss_mb", "seed", "mode", "segmenter", "precision",
           "version", "machine"}
SUMMARY = {"median", "mean", "p95", "p99", "max"}
ERRORS = {"rmse", "mean", "median", "std", "min", "max"}
COMMANDS = ("run", "eval", "bench", "calibrate", "simulate", "inspect", "map", "export", "render", "config",
            "completion")


def read_ply(path):
    """Rows x y z r g b of a binary little-endian point cloud, read after the PLY specification."""
    data = path.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    lines = head.decode("ascii").split("\n")
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"], lines[:2]
    count, layout, names = 0, "<", []
    kinds = {"float": "f", "float32": "f", "double": "d", "uchar": "B", "uint8": "B", "int": "i"}
    for words in (line.split() for line in lines[2:]):
        if words[:2] == ["element", "vertex"]:
            count = int(words[2])
        elif words[:1] == ["property"]:
            layout += kinds[words[1]]
            names.append(words[2])
    assert len(body) == count * struct.calcsize(layout), (len(body), count, layout)
    wanted = [names.index(n) for n in ("x", "y", "z", "red", "green", "blue")]
    return [tuple(row[i] for i in wanted) for row in struct.iter_unpack(layout, body)]


class Help(CliTest):
    def test_help_and_version_work_everywhere(self):
        for command in ([], *([c] for c in COMMANDS)):
            done = ygslam(*command, "--help")
            self.assertEqual((done.returncode, done.stderr), (0, ""), command)
            self.assertIn("Usage", done.stdout)
            done = ygslam(*command, "--version")
            self.assertEqual((done.returncode, done.stderr), (0, ""), command)
            self.assertRegex(done.stdout, r"^\d+\.\d+\.\d+\n$")

    def test_every_command_knows_quiet_and_verbose(self):
        for command in COMMANDS:
            for option in ("--quiet", "-v"):
                done = ygslam(command, option, "--help")
                self.assertEqual(done.returncode, 0, f"{command} {option}: {done.stderr}")
        for option in ("--quiet", "-v"):
            self.assertEqual(ygslam("config", option).returncode, 0)
            truth = sequence() / "groundtruth.txt"
            done = ygslam("eval", "--gt", truth, "--est", truth, option)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_verbose_tells_of_the_call_and_of_every_frame(self):
        done = self.run_slam(sequence(), "--to", 8, "-v")
        self.assert_ran(done)
        for text in (done.stderr, self.log()):
            self.assertEqual(re.findall(r"debug\W+frame (\d+): tracking, \d+ matches", text),
                             [str(i) for i in range(8)])
        self.assertRegex(done.stderr, r"\Adebug: version .*, called with run .*-v\n")
        self.assertNotIn("debug", self.run_slam(sequence(), "--to", 8, out="plain").stderr)
        truth = sequence() / "groundtruth.txt"
        done = ygslam("eval", "--gt", truth, "--est", truth, "-v")
        self.assertIn(f"debug: {truth}: {FRAMES} poses\n", done.stderr)
        done = ygslam("-v", "simulate", "static_xyz", "--out", self.folder / "rendered", "--size",
                      "160x120", "--seconds", "0.1", "--threads", "1")
        self.assertIn("debug: frame 1 of ", done.stderr)
        self.assertRegex(ygslam("config", "-v").stderr, r"\Adebug: version .*\n\Z")

    def test_help_of_run_names_every_option_of_the_contract(self):
        text = ygslam("run", "--help").stdout
        for option in ("--out", "--model", "--segmenter", "--dynamic", "--camera", "--config",
                       "--set", "--from", "--to", "--stride", "--realtime", "--deterministic",
                       "--seed", "--debug-images"):
            self.assertIn(option, text)

    def test_complaints_are_one_short_line_whatever_was_written(self):
        for words, said in ((["--from", "-1"], "--from: -1 is not in 0 .. 1000000000"),
                            (["--seed", "1e9"], "--seed: 1e9 is not in 0 .. 9007199254740992"),
                            (["--to", "9" * 25], "--to: " + "9" * 25 + " is not in 1"),
                            (["--\nnew\x1b[2J"], "no option '--\\nnew\\x1b[2J'"),
                            (["--" + "x" * 5000], "no option '--xxx")):
            done = ygslam("run", sequence(), "--out", self.folder / "out", *words)
            self.assertEqual(done.returncode, 2)
            self.assertRegex(done.stderr, r"\Aerror: [^\n\x1b]{1,600}\n\Z")
            self.assertIn(said, done.stderr)

    def test_wrong_usage_is_code_2_and_told_on_stderr(self):
        for arguments in ([], ["run"], ["run", "a", "--out", "b", "--bogus"], ["walk"],
                          ["run", "a"], ["run", "a", "--out", "b", "--stride", "0"],
                          ["run", "a", "--out", "b", "--from", "-1"],
                          ["run", "a", "--out", "b", "--from", "x"],
                          ["run", "a", "--out", "b", "--dynamic", "fast"],
                          ["run", "a", "--out", "b", "--segmenter", "masks:"],
                          ["run", "a", "--out", "b", "--segmenter", "magic"],
                          ["run", "a", "--out", "b", "--realtime", "--deterministic"],
                          ["run", "a", "--out", "b", "--load-map", ""], ["map", "info", ""],
                          ["eval", "--tracks", "--gt", "a", "--est", "b", "--max-diff", "0.5"]):
            done = ygslam(*arguments)
            self.assertEqual(done.returncode, 2, f"{arguments}: {done.stderr}")
            self.assertEqual(done.stdout, "", arguments)
            self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z", arguments)


class Config(CliTest):
    def test_lists_every_key_with_default_and_meaning(self):
        text = ygslam("config").stdout
        for key in ("run.seed", "dynamic.mode", "run.max_lost_share", "motion.tau_px",
                    "run.without", "segment.precision", "dense.voxel_m"):
            self.assertRegex(text, rf"(?m)^{key}\s+\S+.*\(.+\)\n +change it: \S.*$")
        keys = [line.split()[0] for line in text.splitlines() if not line.startswith(" ")]
        self.assertEqual(len(keys), len(set(keys)))
        self.assertLessEqual(len(keys), 45)

    def test_an_unknown_key_names_the_nearest(self):
        for given, nearest in (("motion.tau", "motion.tau_px"), ("tau_px", "motion.tau_px"),
                               ("orb.feature", "orb.features"), ("run.sed", "run.seed")):
            done = self.run_slam(sequence(), "--set", f"{given}=1", "--quiet")
            self.assert_error(done, 3, given, f"'{nearest}'")
        file = self.folder / "settings.yaml"
        file.write_text("motion:\n  tau_pxx: 1\n", encoding="utf-8")
        self.assert_error(self.run_slam(sequence(), "--config", file, "--quiet"), 3,
                          "settings.yaml", "motion.tau_pxx", "motion.tau_px")

    def test_a_value_out_of_range_or_of_another_type_names_the_key(self):
        for setting in ("motion.tau_px=-1", "motion.tau_px=nan", "motion.tau_px=1,5",
                        "dynamic.mode=maybe", "orb.levels=1.5", "run.max_lost_share=2",
                        "segment.movable=[unicorn]", "segment.input_width=100", "run.without=[wheels]", "depth.min_m=50"):
            done = self.run_slam(sequence(), "--set", setting, "--quiet")
            self.assert_error(done, 3, setting.split("=", maxsplit=1)[0].split(".")[1])
        self.assert_error(self.run_slam(sequence(), "--set", "motion.tau_px", "--quiet"), 3,
                          "key=value")

    def test_all_faults_are_told_at_once(self):
        file = self.folder / "settings.yaml"
        file.write_text("motion:\n  tau_pxx: 1\n  reprojection_px: 99\norb:\n  features: 700\n"
                        "  levels: 3\n  levels: 4\n", encoding="utf-8")
        done = self.run_slam(sequence(), "--config", file, "--set", "segment.input_width=100",
                             "--set", "depth.min_m=50", "--set",
                             "nonsense", "--quiet")
        self.assert_error(done, 3, "settings.yaml: line 2:", "motion.tau_px'", "line 3:",
                          "motion.reprojection_px", "line 7: 'orb.levels' is given twice",
                          "segment.input_width must be a multiple of 32",
                          "depth.min_m must be less than depth.max_m", "key=value")

    def test_values_that_abort_nothing(self):
        for setting in ("orb.fast_threshold=0", "orb.fast_threshold=255"):
            self.assert_error(self.run_slam(sequence(), "--set", setting, "--quiet"), 3,
                              "orb.fast_threshold")
        self.assert_ran(self.run_slam(sequence(), "--to", 5, "--set", "orb.fast_threshold=1"))
        self.assert_ran(self.run_slam(sequence(), "--to", 5, "--set", "orb.fast_threshold=254"),
                        code=7)

    def test_a_broken_settings_file_is_named(self):
        file = self.folder / "settings.yaml"
        for text in ("motion: [\n", "just words\n", "- a\n- b\n", "{" * 100000,
                     "motion:\n  tau_px: {a: {b: 1}}\n", "a: &x [*x]\n", "orb: {features: &x [a, [*x]]}\n", "\x00\x01\x02",
                     "&a [" + "&b [" * 5000):
            file.write_text(text, encoding="utf-8")
            self.assert_error(self.run_slam(sequence(), "--config", file, "--quiet"), 3,
                              "settings.yaml")
        os.mkfifo(self.folder / "pipe.yaml")
        for missing in (self.folder / "none.yaml", self.folder, self.folder / "pipe.yaml",
                        pathlib.Path("/proc/self/mem"), pathlib.Path("/proc/self/attr/current"),
                        file / "below.yaml"):
            self.assert_error(self.run_slam(sequence(), "--config", missing, "--quiet"), 3,
                              missing.name)

    def test_options_win_over_the_file_and_the_used_settings_repeat_the_run(self):
        file = self.folder / "settings.yaml"
        file.write_text("run:\n  seed: 5\ndynamic:\n  mode: off\norb:\n  features: 700\n",
                        encoding="utf-8")
        done = self.run_slam(sequence(), "--to", 15, "--config", file, "--set", "orb.features=800",
                             "--seed", 7, geometry=False)
        self.assert_ran(done)
        self.assertEqual((self.metrics()["seed"], self.metrics()["mode"]), (7, "off"))
        used = self.folder / "out" / "config.yaml"
        self.assertIn("features: 800", used.read_text(encoding="utf-8"))
        again = self.run_slam(sequence(), "--to", 15, "--config", used, out="again",
                              geometry=False)
        self.assert_ran(again)
        self.assertEqual(self.metrics("again")["mode"], "off")
        for name in ("trajectory.txt", "map.ply", "config.yaml"):
            self.assertEqual((self.folder / "out" / name).read_bytes(),
                             (self.folder / "again" / name).read_bytes(), name)


class Output(CliTest):
    def setUp(self):
        super().setUp()
        self.done = self.run_slam(sequence(), "--segmenter", f"masks:{sequence() / 'mask'}",
                                  geometry=False)
        self.assert_ran(self.done)

    def test_all_files_are_there_and_sound(self):
        self.assert_sound()
        metrics = self.metrics()
        self.assertLessEqual(METRICS | {"ate", "rpe"}, set(metrics))
        self.assertEqual((metrics["frames"], metrics["readable"], metrics["tracked"]),
                         (FRAMES, FRAMES, FRAMES))
        self.assertEqual(metrics["coverage"], 1.0)
        self.assertEqual((metrics["lost_intervals"], metrics["skipped_images"]), ([], []))
        self.assertEqual((metrics["mode"], metrics["segmenter"]), ("full", "masks"))
        self.assertGreater(metrics["masks_used"], FRAMES - 5)
        self.assertEqual(set(metrics["mask_age_frames"]), {"median", "p95"})
        self.assertEqual(metrics["mask_age_frames"]["median"], 2)
        for group in ("timing_ms", "cpu_ms"):
            for stage in ("track", "segment", "map"):
                self.assertLessEqual(SUMMARY, set(metrics[group][stage]), f"{group} {stage}")
        self.assertEqual(set(metrics["ate"]), ERRORS)
        for span in ("frames30", "sec1"):
            for kind in ("trans_m", "rot_deg"):
                self.assertEqual(set(metrics["rpe"][span][kind]), ERRORS)
        self.assertLess(metrics["ate"]["rmse"], 0.03)

    def test_trajectories_have_the_stamps_of_the_input_and_start_at_the_origin(self):
        stamps = [line.split()[0] for line in lines_of(sequence() / "associations.txt")]
        for name in ("trajectory.txt", "trajectory_live.txt"):
            rows = trajectory(self.folder / "out" / name)
            self.assertEqual([stamp for stamp, _ in rows], stamps)
        first = trajectory(self.folder / "out" / "trajectory_live.txt")[0][1]
        for value, wanted in zip(first, (0, 0, 0, 0, 0, 0, 1)):
            self.assertAlmostEqual(value, wanted, places=6)
        poses = dict((s, p) for s, p in trajectory(self.folder / "out" / "trajectory.txt"))
        keyframes = trajectory(self.folder / "out" / "keyframes.txt")
        self.assertEqual(len(keyframes), self.metrics()["keyframes"])
        for stamp, pose in keyframes:
            for value, wanted in zip(pose[:3], poses[stamp]):
                self.assertAlmostEqual(value, wanted, delta=1e-6, msg=f"keyframe {stamp}")

    def test_the_evaluation_in_the_metrics_is_that_of_eval(self):
        done = ygslam("eval", "--json", "--gt", sequence() / "groundtruth.txt", "--est",
                      self.folder / "out" / "trajectory.txt")
        printed = json.loads(done.stdout)["ate"]
        for name, value in self.metrics()["ate"].items():
            # The file's six decimals are all that lies between the two.
            self.assertAlmostEqual(printed[name], value, delta=2e-6, msg=name)

    def test_frames_csv_has_a_row_for_every_frame(self):
        with open(self.folder / "out" / "frames.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), FRAMES)
        self.assertEqual([row["stamp"] for row in rows],
                         [line.split()[0] for line in lines_of(sequence() / "associations.txt")])
        for row in rows:
            self.assertIn(row["state"], ("waiting", "tracking", "weak", "lost"))
            for key in ("matches", "static_points", "dynamic_points", "unknown_points"):
                self.assertGreaterEqual(int(row[key]), 0)
            self.assertIn(int(row["mask_age_frames"]), (-1, 0, 1, 2, 3))
            self.assertTrue([key for key in row if key.endswith("_ms")])
        self.assertTrue(any(int(row["dynamic_points"]) > 20 for row in rows))

    def test_another_reader_reads_the_map(self):
        points = read_ply(self.folder / "out" / "map.ply")
        self.assertGreater(len(points), 500)
        for x, y, z, *colour in points:
            self.assertLess(max(abs(x), abs(y), abs(z)), 20)
            self.assertLessEqual(max(colour), 255)
        self.assertGreater(len({p[3:] for p in points}), 100, "coloured")
        cells = {tuple(round(c / 0.01) for c in p[:3]) for p in points}
        self.assertGreater(len(cells), 0.5 * len(points), "on a voxel grid of 1 cm")

    def test_data_goes_to_stdout_and_the_log_to_stderr_and_to_its_file(self):
        self.assertRegex(self.done.stdout, rf"ATE RMSE 0\.0\d+ m over {FRAMES} poses: "
                         r"trajectory\.txt aligned \(SE\(3\)\) to the ground truth\n")
        for line in self.done.stdout.splitlines():
            self.assertIn(line, self.log())
        self.assertIn("info: ", self.done.stderr)
        self.assertNotIn("\r", self.done.stderr)  # a progress bar is for terminals
        self.assertIn("mode full", self.log())


class Options(CliTest):
    def test_from_to_and_stride_choose_frames(self):
        stamps = [line.split()[0] for line in lines_of(sequence() / "associations.txt")]
        done = self.run_slam(sequence(), "--from", 4, "--to", 31, "--stride", 3)
        self.assert_ran(done)
        self.assertEqual(self.metrics()["frames"], 9)
        rows = trajectory(self.folder / "out" / "trajectory.txt")
        self.assertEqual([stamp for stamp, _ in rows], stamps[4:31:3])

    def test_a_choice_without_frames_is_wrong_usage_and_leaves_nothing(self):
        for choice in (("--from", FRAMES), ("--from", 5, "--to", 5), ("--from", 9, "--to", 3)):
            self.assert_error(self.run_slam(sequence(), *choice, "--quiet"), 2, "no frame")
            self.assertFalse((self.folder / "out").exists(), choice)

    def test_each_mode_runs_and_is_recorded(self):
        masks = f"masks:{sequence() / 'mask'}"
        for mode, segmenter in (("off", "none"), ("geometry", "none"), ("semantic", "masks"),
                                ("full", "masks")):
            done = self.run_slam(sequence(), "--to", 12, "--dynamic", mode, "--segmenter", masks,
                                 geometry=False, out=mode)
            self.assert_ran(done)
            self.assertEqual(self.metrics(mode)["mode"], mode)
            self.assertEqual(self.metrics(mode)["segmenter"], segmenter)
        self.assertEqual(self.metrics("off")["masks_used"], 0)

    def test_quiet_says_nothing(self):
        done = self.run_slam(sequence(), "--to", 8, "--quiet")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_realtime_accounts_for_every_frame(self):
        done = self.run_slam(sequence(), "--realtime")
        self.assertIn(done.returncode, (0, 7), done.stderr)  # a loaded machine drops many
        metrics = self.metrics()
        rows = len((self.folder / "out" / "frames.csv").read_text(encoding="utf-8").splitlines())
        self.assertEqual(metrics["readable"], FRAMES)
        self.assertEqual(rows - 1, FRAMES)
        self.assertGreater(metrics["wall_s"], 1.5)  # fed at the stamps: the recording lasts 2 s
        self.assertEqual(metrics["schedule"], "realtime")

    def test_live_runs_drop_nothing(self):
        done = ygslam("run", sequence(), "--out", self.folder / "out", "--dynamic", "geometry")
        self.assert_ran(done)
        self.assertEqual((self.metrics()["dropped"], self.metrics()["coverage"]), (0, 1.0))
        self.assertEqual(len(trajectory(self.folder / "out" / "trajectory.txt")), FRAMES)

    def test_debug_images_show_static_and_dynamic_points(self):
        from PIL import Image  # pylint: disable=import-outside-toplevel
        pictures = self.folder / "deep" / "pictures"
        done = self.run_slam(sequence(), "--to", 20, "--segmenter", f"masks:{sequence() / 'mask'}",
                             "--debug-images", pictures, "--debug-every", 2, geometry=False)
        self.assert_ran(done)
        names = sorted(path.name for path in pictures.iterdir())
        self.assertEqual(names, [f"frame_{i:06}.jpg" for i in range(0, 20, 2)])
        green = red = 0
        for path in sorted(pictures.iterdir())[5:]:
            with Image.open(path) as image:
                self.assertEqual(image.size, (WIDTH, HEIGHT))
                r, g, b = np.moveaxis(np.asarray(image.convert("RGB")).astype(int), 2, 0)
                green += int(((g > 150) & (r < 110) & (b < 110)).sum())
                red += int(((r > 180) & (g < 100) & (b < 100)).sum())
        self.assertGreater(green, 500)
        self.assertGreater(red, 50)

    def test_saved_masks_stand_for_the_network_that_said_them(self):
        saved = self.folder / "saved"
        for out, masks, *more in (("first", sequence() / "mask", "--save-masks", saved),
                                  ("again", saved)):
            done = self.run_slam(sequence(), "--segmenter", f"masks:{masks}", *more, geometry=False,
                                 out=out)
            self.assert_ran(done)
        names = sorted(path.name for path in saved.iterdir())
        self.assertEqual(len(names), FRAMES - 2 + 1, "those of the last two frames come too late")
        self.assertEqual(json.loads((saved / "instances.json").read_text())["1"], "person")
        for name in ("trajectory.txt", "objects.csv"):
            first, again = ((self.folder / out / name).read_bytes() for out in ("first", "again"))
            self.assertEqual(first, again, name)

    def test_saved_masks_do_not_replace_those_that_are_read(self):
        folder = self.copy_sequence()
        for target in (folder / "mask", folder / "rgb"):
            done = self.run_slam(folder, "--segmenter", f"masks:{folder / 'mask'}", "--save-masks",
                                 target, geometry=False)
            self.assert_error(done, 2, target, "--save-masks")

    def test_debug_images_that_cannot_be_written_are_code_9(self):
        blocked = self.folder / "file"
        blocked.write_text("x", encoding="utf-8")
        done = self.run_slam(sequence(), "--to", 5, "--debug-images", blocked, "--quiet")
        self.assertEqual(done.returncode, 9)
        self.assertIn(str(blocked), done.stderr)


class Terminal(CliTest):
    def test_a_closed_stdout_is_no_crash(self):
        command = f'"{BINARY}" config | head -1'
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main(verbosity=2)
