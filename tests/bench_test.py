"""`ygslam bench` as a whole, on tiny rendered sequences: resuming, faults, crashes, comparison.

The report is made by a small script of the test's own ($YGSLAM_REPORT).
"""
import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import time
import unittest

from ygslam_cli import BINARY, HANG_S, HEIGHT, WIDTH, CliTest, lines_of, png, ygslam

RUN_FILES = {"metrics.json", "trajectory.txt", "trajectory_live.txt", "keyframes.txt",
             "frames.csv", "objects.csv", "loops.csv", "map.ply", "config.yaml", "log.txt",
             "errors.csv", "run.json"}
FRAMES = 36  # enough for an RPE over 30 frames
FAKE_REPORT = """
import argparse, json, pathlib
parser = argparse.ArgumentParser()
parser.add_argument("--results", type=pathlib.Path)
parser.add_argument("--check", action="store_true")
if parser.parse_args().check:
    raise SystemExit
results = parser.parse_args().results
sweep = json.loads((results / "sweep.json").read_text(encoding="utf-8"))
(results / "report").mkdir(exist_ok=True)
(results / "report" / "index.html").write_text(str(len(sweep["sequences"])), encoding="utf-8")
"""

BROKEN_REPORT = """
import sys
if "--check" not in sys.argv:
    raise KeyError('ate')
"""


class BenchTest(CliTest):
    def setUp(self):
        super().setUp()
        self.root = self.folder / "data"
        self.root.mkdir()
        self.out = self.folder / "results"
        self.report = self.folder / "report"
        self.report.mkdir()
        (self.report / "__main__.py").write_text(FAKE_REPORT, encoding="utf-8")
        self.environment = {"YGSLAM_REPORT": str(self.report)}

    def add(self, name, frames=FRAMES):
        (self.root / name).parent.mkdir(exist_ok=True)
        return self.copy_sequence(f"data/{name}", frames)

    def command(self, *options, modes="off", runs=1, out=None):
        return ["bench", self.root, "--out", out or self.out, "--modes", modes, "--runs", runs,
                *options]

    def bench(self, *options, **how):
        return ygslam(*self.command(*options, **how), environment=self.environment)

    def load(self, *parts, out=None):
        file = pathlib.Path(out or self.out, *parts)
        return json.loads(file.read_text(encoding="utf-8"))

    def record(self, name, mode="off", run="01", out=None):
        return self.load("runs", name, mode, run, "run.json", out=out)

    def run_times(self):
        """When each finished run was finished, by its place."""
        return {str(path.parent.relative_to(self.out)): path.stat().st_mtime_ns
                for path in self.out.glob("runs/*/*/*/run.json")}

    def start(self, *options, **how):
        return subprocess.Popen([BINARY, *map(str, self.command(*options, **how))], text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                env={**os.environ, **self.environment})

    def wait_until(self, condition, process):
        """Until something has happened in the results folder."""
        end = time.monotonic() + HANG_S
        while not condition():
            self.assertIsNone(process.poll(), "it ended too early")
            self.assertLess(time.monotonic(), end)
            time.sleep(0.01)

    def child_of(self, process):
        """The run that is going on; waits for one."""
        found = []

        def look():
            path = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children")
            found[:] = path.read_text(encoding="ascii").split()
            return bool(found)
        self.wait_until(look, process)
        return int(found[0])

    def assert_gone(self, pid):
        end = time.monotonic() + HANG_S
        while time.monotonic() < end:
            try:
                state = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
            except (FileNotFoundError, ProcessLookupError):
                return
            if state.rsplit(")", 1)[1].split()[0] == "Z":
                return
            time.sleep(0.01)
        self.fail(f"process {pid} is still there")


class Sweep(BenchTest):
    def test_one_command_makes_runs_tables_and_the_report(self):
        self.add("one")
        self.add("part/two")
        done = self.bench("--deterministic", modes="off,geometry", runs=2)
        self.assert_ran(done)
        self.assertEqual(done.stderr.count("info: one "), 4, done.stderr)
        self.assertIn("report: ", done.stderr)
        self.assertEqual((self.out / "report" / "index.html").read_text(encoding="utf-8"), "2")
        sweep = self.load("sweep.json")
        self.assertEqual([s["id"] for s in sweep["sequences"]], ["one", "part__two"])
        self.assertEqual(sweep["sequences"][0]["frames"], FRAMES)
        self.assertEqual(sweep["options"]["way"], "deterministic")
        drawn = self.load("sequences", "one", "inspect", "inspect.json")
        self.assertEqual([c["name"] for c in drawn["checks"]], ["classic", "improved"])
        self.assertTrue((self.out / "sequences" / "one" / "inspect" / "checks.jpg").exists())
        self.assertTrue(sweep["complete"] and sweep["timings_valid"])
        truth = sweep["sequences"][0]["truth"]
        self.assertAlmostEqual(truth["duration_s"], (FRAMES - 1) / 30, delta=0.05)
        self.assertGreater(truth["length_m"], 0.05)
        run = self.out / "runs" / "one" / "geometry" / "02"
        self.assertEqual({path.name for path in run.iterdir()} - {".lock"}, RUN_FILES)
        record, metrics = self.record("one", "geometry", "02"), self.load(run / "metrics.json")
        self.assertEqual((record["status"], record["seed"], metrics["seed"]), ("ok", 1, 1))
        self.assertEqual((metrics["mode"], metrics["schedule"]), ("geometry", "deterministic"))
        with open(run / "errors.csv", encoding="utf-8", newline="") as file:
            ate = [float(row["ate_m"]) for row in csv.DictReader(file)]
        rmse = (sum(e * e for e in ate) / len(ate)) ** 0.5
        self.assertAlmostEqual(rmse, metrics["ate"]["rmse"], places=6)
        self.assertRegex(done.stdout, r"(?m)^one \(rendered\) +geometry +0\.\d{4} \(0\.\d{4} to 0\.\d{4}\)")
        for path in self.out.rglob("*.json"):
            if path.name in ("sweep.json", "run.json"):
                self.assertNotIn(str(self.folder), path.read_text(encoding="utf-8"), path)

    def test_the_folder_may_be_a_sequence_itself_and_a_choice_is_possible(self):
        one = self.add("one")
        self.add("two")
        done = ygslam("bench", one, "--out", self.folder / "alone", "--modes", "off", "--runs", 1,
                      "--no-report", "--json")
        self.assert_ran(done)
        self.assertEqual([row["sequence"] for row in json.loads(done.stdout)["rows"]], ["one"])
        self.assert_ran(self.bench("--sequences", "two", "--no-report"))
        self.assertEqual([s["id"] for s in self.load("sweep.json")["sequences"]], ["two"])
        self.assertFalse((self.out / "report").exists())
        self.assert_error(self.bench("--sequences", "tow", "--quiet"), 2, "'two'")

    def test_modes_without_masks_do_not_depend_on_where_masks_come_from(self):
        self.add("one")
        self.assert_ran(self.bench("--no-report"))
        before = self.run_times()
        self.assert_ran(self.bench("--no-report", "--segmenter", "masks:mask", modes="off,full"))
        self.assertTrue(before.items() <= self.run_times().items(), "nothing is run twice")
        self.assertEqual(self.load("sweep.json")["options"]["segmenter"], "masks:mask")
        self.assertTrue(self.load("sweep.json")["complete"])
        done = self.bench("--no-report", "--segmenter", "none", "--quiet", modes="full")
        self.assertIn("segmenter was masks:mask, is now none", done.stderr)
        self.assertEqual(done.returncode, 9)

    def test_recorded_masks_are_those_of_each_sequence(self):
        self.add("one")
        self.assert_ran(self.bench("--segmenter", "masks:mask", "--no-report", modes="full"))
        self.assertGreater(self.load("runs", "one", "full", "01", "metrics.json")["masks_used"], 0)
        command = self.record("one", "full")["command"]
        self.assertIn("--segmenter masks:mask", command)

    def test_wrong_usage_and_input_have_their_codes(self):
        self.add("one")
        empty = self.folder / "empty"
        empty.mkdir()
        for code, arguments in (
                (2, ["bench"]), (2, ["bench", self.root, "--modes", "fast"]),
                (2, ["bench", self.root, "--runs", "0"]),
                (2, ["bench", self.root, "--compare", "a", "b"]),
                (2, ["bench", self.root, "--realtime", "--deterministic"]),
                (3, ["bench", self.root, "--set", "orb.feature=1"]),
                (3, ["bench", self.root, "--set", "dynamic.mode=off"]),
                (4, ["bench", empty]), (4, ["bench", self.folder / "none"]),
                (4, ["bench", "--compare", empty, empty]),
                (5, ["bench", self.root, "--segmenter", "model"]),
                (5, ["bench", "--modes", "off,full", self.root, "--segmenter", "model"]),
                (5, ["bench", self.root, "--model", "none.onnx"]),
                (5, ["bench", self.root, "--modes", "off", "--model", "none.onnx"]),
                (9, ["bench", self.root, "--modes", "off", "--out", "/proc/none"])):
            done = ygslam(*arguments, "--quiet", cwd=self.folder)
            self.assertEqual(done.returncode, code, f"{arguments}: {done.stderr}")
            self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z", arguments)
            self.assertEqual(done.stdout, "", arguments)


class Resume(BenchTest):
    def test_kill_9_in_the_middle_and_the_same_command_goes_on(self):
        self.add("one")
        process = self.start("--no-report", modes="off,geometry", runs=3)
        self.wait_until(lambda: len(self.run_times()) >= 2, process)
        child = self.child_of(process)
        process.kill()
        process.communicate(timeout=HANG_S)
        self.assert_gone(child)  # a run does not outlive the sweep
        before = self.run_times()
        self.assertLess(len(before), 6)
        done = self.bench("--no-report", modes="off,geometry", runs=3)
        self.assert_ran(done)
        after = self.run_times()
        self.assertEqual(len(after), 6, "nothing is lost")
        self.assertEqual({place: after[place] for place in before}, before, "nothing is run twice")
        self.assertIn(f"6 runs, {len(before)} of them done before", done.stderr)
        self.assert_ran(self.bench("--no-report", modes="off,geometry", runs=3))
        self.assertEqual(self.run_times(), after)

    def test_a_signal_ends_the_runs_and_the_sweep(self):
        self.add("one")
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            shutil.rmtree(self.out, ignore_errors=True)
            process = self.start(modes="off,geometry", runs=50)
            self.wait_until(lambda: len(self.run_times()) >= 1, process)
            child = self.child_of(process)
            process.send_signal(number)
            _, errors = process.communicate(timeout=HANG_S)
            self.assertEqual(process.returncode, code, errors)
            self.assertIn("interrupted", errors)
            self.assert_gone(child)
            self.assertFalse(self.load("sweep.json")["complete"])
            for place in self.run_times():
                self.assertEqual(self.load(place, "run.json")["status"], "ok")

    def test_results_of_other_options_or_versions_are_refused_and_stay(self):
        self.add("one")
        self.assert_ran(self.bench("--no-report"))
        before = self.run_times()
        done = self.bench("--seed", 3, "--quiet")
        self.assertEqual(done.returncode, 9)
        self.assertRegex(done.stderr, r"\Aerror: [^\n]*sweep.json: [^\n]*seed was 0, is now 3[^\n]*\n\Z")
        done = self.bench("--set", "orb.features=500", "--quiet")
        self.assertIn("orb.features was not set, is now 500", done.stderr)
        sweep = self.load("sweep.json")
        sweep["version"] = "0.0.1"
        (self.out / "sweep.json").write_text(json.dumps(sweep), encoding="utf-8")
        done = self.bench("--quiet")
        self.assertEqual(done.returncode, 9)
        self.assertIn("made by version 0.0.1", done.stderr)
        for damaged in ("{", "[]", '{"format": 1}', "\0"):
            (self.out / "sweep.json").write_text(damaged, encoding="utf-8")
            done = self.bench("--quiet")
            self.assertEqual(done.returncode, 9, damaged)
            self.assertRegex(done.stderr, r"\Aerror: [^\n]*sweep.json: [^\n]*remove the old results\n\Z")
        self.assertEqual(self.run_times(), before)


class Faults(BenchTest):
    def test_what_is_broken_gets_a_row_and_the_rest_goes_on(self):
        self.add("good")
        broken = self.add("broken")
        (broken / "calibration.txt").write_text("fx nan\n", encoding="utf-8")
        later = self.add("later")
        rows = lines_of(later / "groundtruth.txt")
        (later / "groundtruth.txt").write_text(
            "\n".join(f"{float(r.split()[0]) + 1e4:.6f} {r.split(' ', 1)[1]}" for r in rows),
            encoding="utf-8")
        no_truth = self.add("no_truth")
        (no_truth / "groundtruth.txt").unlink()
        unreadable = self.add("unreadable")
        for path in (unreadable / "depth").iterdir():
            path.write_bytes(b"none")
        lost = self.add("lost")
        for path in sorted((lost / "rgb").iterdir())[8:]:  # a wall without texture
            path.write_bytes(png(WIDTH, HEIGHT, channels=3, value=90))
        done = self.bench()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotRegex(done.stderr, r"(?m)^error")
        by_id = {s["id"]: s for s in self.load("sweep.json")["sequences"]}
        self.assertIn("fx", by_id["broken"]["error"])
        self.assertIn("warning: broken: ", done.stderr)
        self.assertFalse((self.out / "runs" / "broken").exists())
        self.assertEqual(self.record("good")["status"], "ok")
        record = self.record("later")
        self.assertEqual((record["status"], record["exit_code"]), ("bad_truth", 0))
        self.assertIn("later/groundtruth.txt: no stamps", record["error"])
        self.assertEqual(self.record("no_truth")["status"], "ok")
        self.assertFalse((self.out / "sequences" / "no_truth" / "groundtruth.txt").exists())
        record = self.record("unreadable")
        self.assertEqual((record["status"], record["exit_code"]), ("failed", 4))
        self.assertTrue(record["error"].startswith("unreadable"), record["error"])
        record = self.record("lost")
        self.assertEqual((record["status"], record["exit_code"]), ("lost", 7), record)
        self.assertRegex(record["error"], r"\Alost: lost for \d+ % of the frames\Z")
        for name in ("later", "unreadable", "lost"):
            self.assertRegex(done.stderr, rf"(?m)^warning: {name} off 1: \w+: \S")
            self.assertRegex(done.stdout, rf"(?m)^{name} .* 0/1 !$")
        self.assertIn("unusable: broken: ", done.stdout)
        self.assertTrue((self.out / "report" / "index.html").exists())

    def test_a_run_that_is_killed_is_a_row(self):
        self.add("one")
        process = self.start("--no-report", modes="off,geometry")
        os.kill(self.child_of(process), signal.SIGKILL)
        output, errors = process.communicate(timeout=HANG_S)
        self.assertEqual(process.returncode, 0, errors)
        record = self.record("one", "off")
        self.assertEqual((record["status"], record["signal"]), ("crashed", int(signal.SIGKILL)))
        self.assertEqual(record["error"].split(";")[0], "ended by SIGKILL")
        self.assertEqual(self.record("one", "geometry")["status"], "ok")
        self.assertIn("warning: one off 1: crashed: ended by SIGKILL", errors)
        self.assertRegex(output, r"(?m)^one.* off +- .*0/1 !$")
        self.assertIn("1 runs were killed from outside; the same command tries them again", errors)
        self.assertFalse(self.load("sweep.json")["complete"])
        before = self.run_times()
        done = self.bench("--no-report", modes="off,geometry")
        self.assert_ran(done)
        self.assertIn("runs/one/off/01: crashed: ended by SIGKILL", done.stderr)
        self.assertEqual(self.record("one", "off")["status"], "ok")
        after = self.run_times()
        self.assertEqual({place for place in after if after[place] != before[place]},
                         {"runs/one/off/01"}, "the other one is not run twice")
        self.assertTrue(self.load("sweep.json")["complete"])

    def test_a_run_over_its_time_is_a_row(self):
        self.add("one")
        done = self.bench("--run-limit", 0.001, "--realtime")
        self.assert_ran(done)
        record = self.record("one")
        self.assertEqual((record["status"], record["limit_s"]), ("timed_out", 0.001))
        self.assertIn("warning: one off 1: timed_out: not done after 0.001 s (--run-limit)",
                      done.stderr)
        self.assertRegex(done.stdout, r"(?m)^one.* off +- .*0/1 !$")
        self.assert_error(self.bench("--run-limit", "nan", "--quiet"), 2, "--run-limit")
        self.assert_ran(self.bench("--realtime", "--run-limit", 0, "--no-report"))
        self.assertEqual(self.record("one")["status"], "ok", "now it has all the time it likes")

    def test_the_log_has_every_line_that_was_said(self):
        self.add("good")
        broken = self.add("broken")
        (broken / "calibration.txt").write_text("fx nan\n", encoding="utf-8")
        (self.report / "__main__.py").write_text(BROKEN_REPORT, encoding="utf-8")
        done = self.bench("--no-pictures")
        self.assertEqual(done.returncode, 9, done.stderr)
        log = (self.out / "log.txt").read_text(encoding="utf-8")
        for line in ("broken: broken/calibration.txt", "the report cannot be made"):
            self.assertIn(line, done.stderr)
            self.assertIn(line, log)

    def test_nothing_usable_is_code_4(self):
        broken = self.add("broken")
        (broken / "associations.txt").write_text("nothing\n", encoding="utf-8")
        done = self.bench()
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn("none of its sequences can be used", done.stderr)
        self.assertFalse(self.out.exists(), "nothing is left of it")

    def test_what_the_report_needs_is_asked_before_the_first_run(self):
        self.add("one")
        (self.report / "__main__.py").write_text("import matplotlib_that_is_not_there\n", encoding="utf-8")
        done = self.bench()
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertIn("No module named 'matplotlib_that_is_not_there'", done.stderr)
        self.assertIn("nothing was run (--no-report does without)", done.stderr)
        self.assertFalse(self.out.exists())
        self.assert_ran(self.bench("--no-report"))

    def test_a_report_that_cannot_be_made_leaves_the_results(self):
        self.add("one")
        (self.report / "__main__.py").write_text(BROKEN_REPORT, encoding="utf-8")
        done = self.bench()
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertRegex(done.stderr, r"(?m)^error: the report cannot be made: KeyError: 'ate'; "
                                      r"the results stay in ")
        self.assertEqual(self.record("one")["status"], "ok")
        self.assertRegex(done.stdout, r"(?m)^one.* off +0\.")
        (self.report / "__main__.py").write_text(FAKE_REPORT, encoding="utf-8")
        before = self.run_times()
        self.assert_ran(self.bench())
        self.assertEqual(self.run_times(), before)


class Compare(BenchTest):
    def test_two_results_side_by_side(self):
        self.add("one")
        worse = self.folder / "worse"
        self.assert_ran(self.bench("--no-report", runs=2, modes="off,geometry"))
        self.assert_ran(self.bench("--no-report", "--set", "orb.features=150", runs=2, out=worse))
        done = ygslam("bench", "--compare", self.out, worse, "--json")
        self.assert_ran(done)
        found = json.loads(done.stdout)
        row, = found["rows"]
        for key, place in (("ate_m", ("ate",)), ("rpe30_m", ("rpe", "frames30", "trans_m"))):
            medians = []
            for out in (self.out, worse):
                values = []
                for run in ("01", "02"):
                    value = self.load("runs", "one", "off", run, "metrics.json", out=out)
                    for part in (*place, "rmse"):
                        value = value[part]
                    values.append(value)
                medians.append(sum(values) / 2)
                self.assertAlmostEqual(row[key]["a" if out == self.out else "b"]["max"],
                                       max(values))
            self.assertAlmostEqual(row[key]["ratio"], medians[1] / medians[0], places=9)
            apart = row[key]["b"]["min"] > row[key]["a"]["max"]
            below = row[key]["b"]["max"] < row[key]["a"]["min"]
            self.assertEqual(row[key]["verdict"], "worse" if apart else "better" if below else "same")
        self.assertEqual(found["only_a"], ["one geometry"])
        self.assertIn('config: A {}, B {"orb.features":"150"}', found["notes"])
        text = ygslam("bench", "--compare", self.out, worse).stdout
        self.assertIn("one off: good runs A 2/2, B 2/2", text)
        self.assertRegex(text, r"(?m)^  ATE \[m\] .* \d+\.\d{3}")
        self.assertRegex(text, r"(?m)^Worse: ?")
        same = json.loads(ygslam("bench", "--compare", self.out, self.out, "--json").stdout)
        self.assertEqual((same["better"], same["worse"], same["notes"]), ([], [], []))
        self.assertEqual({row["ate_m"]["ratio"] for row in same["rows"]}, {1.0})


if __name__ == "__main__":
    unittest.main(verbosity=2)
