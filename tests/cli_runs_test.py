"""Runs under hard conditions: signals, two at once, other locales, the same run twice.

The numbers F26 ... F38 are those of docs/reliability.md.
"""
import csv
import io
import os
import pathlib
import shutil
import signal
import subprocess
import time
import unittest

from ygslam_cli import (BINARY, FILES, HANG_S, CliTest, contents, lines_of, sequence, trajectory,
                        ygslam)

RESULTS = sorted(FILES - {"metrics.json", "log.txt"})


def without_timings(text):
    """frames.csv without the columns of measured times."""
    rows = list(csv.DictReader(io.StringIO(text.decode("utf-8"))))
    return [{key: value for key, value in row.items() if not key.endswith("_ms")} for row in rows]


class LongRuns(CliTest):
    """Tests that need a run that does not end by itself: the same images again and again."""

    options = ()

    def setUp(self):
        super().setUp()
        self.long = self.copy_sequence("long")
        pairs = self.pairs(self.long)
        there_and_back = pairs + pairs[-2:0:-1]
        with open(self.long / "associations.txt", "w", encoding="utf-8") as file:
            for i in range(20000):
                _, colour, _, depth = there_and_back[i % len(there_and_back)]
                file.write(f"{1000 + i / 30:.6f} {colour} {1000 + i / 30:.6f} {depth}\n")

    def start(self, out="out", before=()):
        """A run that has begun to track."""
        process = subprocess.Popen(
            [*before, BINARY, "run", self.long, "--out", self.folder / out, "--dynamic", "geometry",
             "--debug-images", self.folder / "pictures", "--debug-every", "10", *self.options],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        end = time.monotonic() + HANG_S
        while not list(self.folder.glob("pictures/frame_*0.jpg")):  # a frame has passed
            self.assertIsNone(process.poll(), "it ended by itself")
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)
        return process

    def finish(self, process):
        stdout, stderr = process.communicate(timeout=HANG_S)
        return subprocess.CompletedProcess([], process.returncode, stdout, stderr)


class Signals(LongRuns):
    """F27"""

    def test_a_signal_ends_the_run_and_what_there_is_is_saved(self):
        for number, code in ((signal.SIGHUP, 129), (signal.SIGINT, 130), (signal.SIGTERM, 143)):
            out = f"out{code}"
            shutil.rmtree(self.folder / "pictures", ignore_errors=True)
            process = self.start(out)
            process.send_signal(number)
            self.assert_ran(self.finish(process), code)
            self.assert_sound(out)
            metrics = self.metrics(out)
            self.assertEqual(metrics["frames"], 20000)
            self.assertLess(metrics["readable"], 20000)
            rows = trajectory(self.folder / out / "trajectory.txt")
            self.assertEqual(len(rows), metrics["tracked"])
            self.assertGreater(len(rows), 0)
            # Frames that were read ahead do not count.
            frames = lines_of(self.folder / out / "frames.csv")[1:]
            self.assertEqual(metrics["readable"], len(frames))
            self.assertEqual(metrics["coverage"], len(rows) / len(frames))

    def test_a_terminal_that_closes_does_not_end_a_run_under_nohup(self):
        process = self.start(before=["nohup"])
        drawn = len(list(self.folder.glob("pictures/*")))
        process.send_signal(signal.SIGHUP)
        end = time.monotonic() + HANG_S
        while len(list(self.folder.glob("pictures/*"))) < drawn + 2:  # it goes on
            self.assertIsNone(process.poll(), "it ended")
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        self.assert_ran(self.finish(process), 143)

    def test_a_second_signal_ends_it_at_once(self):
        process = self.start()
        os.kill(process.pid, signal.SIGSTOP)  # so that both are there when it goes on
        os.kill(process.pid, signal.SIGINT)
        os.kill(process.pid, signal.SIGTERM)
        os.kill(process.pid, signal.SIGCONT)
        done = self.finish(process)
        self.assertIn(done.returncode, (130, 143), done.stderr)  # whichever is handled last
        self.assert_nothing_written(left=[".lock", "log.txt"])


class RemovedOutputs(LongRuns):
    """What others remove while it is written."""

    def ended_without(self, *files):
        """A run that was ended after the files were removed."""
        process = self.start()
        for file in files:
            file.unlink()
        process.send_signal(signal.SIGINT)
        return self.finish(process)

    def test_a_map_that_was_removed_is_written_once_more(self):
        room = self.folder / "room.map"
        self.options = ["--save-map", room]
        done = self.ended_without(room)
        self.assert_ran(done, 130)
        self.assertIn("room.map: was removed during the run", done.stderr)
        self.assertEqual(ygslam("map", "check", room).returncode, 0)

    def test_a_recording_that_was_removed_is_told(self):
        self.options = ["--mcap", self.folder / "run.mcap"]
        done = self.ended_without(self.folder / "run.mcap")
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertIn("run.mcap: was removed during the run", done.stderr)
        self.assert_sound()


class EarlySignals(CliTest):
    """F27, before there is anything to save."""

    def test_a_signal_while_it_starts_leaves_what_was_there(self):
        self.assert_ran(self.run_slam(sequence(), "--to", "5"))
        before = contents(self.folder / "out")
        ended_early = 0
        for delay_ms in (0, 1, 2, 5, 10, 15, 20, 30, 50):
            process = subprocess.Popen(
                [BINARY, "run", sequence(), "--out", self.folder / "out", "--dynamic", "geometry"],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            time.sleep(delay_ms / 1000)
            process.send_signal(signal.SIGINT)
            said = process.communicate(timeout=HANG_S)[1]
            # By itself before the command began, which a shell tells as 130, too.
            self.assertIn(process.returncode, (130, -signal.SIGINT), said)
            self.assertNotIn("error", said)
            now = contents(self.folder / "out")
            now.pop(".lock", None)
            if now == {name: text for name, text in before.items() if name != ".lock"}:
                ended_early += 1
            else:  # a frame was through: then all of the results are new
                self.assertEqual(process.returncode, 130)
                self.assert_sound()
                before = now
        self.assertGreater(ended_early, 3)


class SimulateSignals(CliTest):
    """A rendering that is broken off is a whole, shorter sequence, or none."""

    def start(self, out):
        """A rendering of half an hour, once its third frame is there."""
        process = subprocess.Popen(
            [BINARY, "simulate", "walking_xyz", "--out", out, "--size", "160x120", "--truth",
             "--seconds", "1800", "--threads", "1", "--quiet"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        end = time.monotonic() + HANG_S
        while len(list(out.glob("rgb/*.jpg"))) < 4 and time.monotonic() < end:
            time.sleep(0.02)
        return process

    def test_a_signal_leaves_a_whole_shorter_sequence(self):
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            out = self.folder / f"out{code}"
            process = self.start(out)
            process.send_signal(number)
            stdout, stderr = process.communicate(timeout=HANG_S)
            self.assertEqual((process.returncode, stdout), (code, ""), stderr)
            pairs = self.pairs(out)
            self.assertGreater(len(pairs), 2)
            self.assertEqual(len(pairs), len(trajectory(out / "groundtruth.txt")))
            for part, kind in (("rgb", "jpg"), ("depth", "png"), ("mask", "png"),
                               ("moving", "png"), ("depth_true", "png"), ("rgb_static", "jpg")):
                self.assertEqual({path.name for path in (out / part).iterdir()},
                                 {f"{pair[0]}.{kind}" for pair in pairs}, part)

    def stop_at_start(self, out, number):
        """Sends the signal as soon as it is caught, while the world is being built.
        @return exit code, files in the folder."""
        process = subprocess.Popen(
            [BINARY, "simulate", "crowd", "--out", out, "--size", "640x480", "--truth", "--quiet"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        status = pathlib.Path(f"/proc/{process.pid}/status")
        end = time.monotonic() + HANG_S
        while process.poll() is None and time.monotonic() < end:
            caught = int(status.read_text().split("SigCgt:")[1].split()[0], 16)
            if caught >> (number - 1) & 1:
                break
        process.send_signal(number)
        stdout, stderr = process.communicate(timeout=HANG_S)
        self.assertEqual(stdout + stderr, "")
        return process.returncode, {path for path in out.rglob("*") if path.is_file()}

    def test_a_signal_before_the_first_frame_leaves_no_lists(self):
        """A try may come too late on a busy machine: then it left a whole sequence."""
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            for attempt in range(10):
                out = self.folder / f"early{code}.{attempt}"
                returned, files = self.stop_at_start(out, number)
                self.assertEqual(returned, code)
                if not files:
                    break
                self.assertEqual(len(self.pairs(out)), len(list(out.glob("mask/*.png"))))
            self.assertEqual(files, set(), "no try came before the first frame")
            self.assert_error(self.run_slam(out, out=f"run{code}"), 4, out, out=f"run{code}")

    def test_a_signal_at_the_start_leaves_an_older_sequence_as_it_was(self):
        for attempt in range(10):
            out = self.folder / f"older{attempt}"
            shutil.copytree(sequence(), out)
            returned, files = self.stop_at_start(out, signal.SIGINT)
            self.assertEqual(returned, 130)
            if (out / "static.ply").read_bytes() == (sequence() / "static.ply").read_bytes():
                break
        self.assertEqual({path.relative_to(out): path.read_bytes() for path in files},
                         {path.relative_to(sequence()): path.read_bytes()
                          for path in sequence().rglob("*") if path.is_file()})

    def test_one_that_is_killed_leaves_nothing_that_looks_like_a_sequence(self):
        out = self.folder / "killed"
        process = self.start(out)
        process.kill()
        process.communicate(timeout=HANG_S)
        for name in ("associations.txt", "rgb.txt", "groundtruth.txt", "calibration.txt"):
            self.assertFalse((out / name).exists(), name)
        # Two folders of images, and nothing that tells of their camera.
        self.assert_error(self.run_slam(out, out="run"), 3, out, "camera", out="run")


class GivenPoses(CliTest):
    """`simulate --poses`: somebody else moves the camera and sees each image before the next pose."""

    def simulate(self, **how):
        return subprocess.Popen([BINARY, "simulate", "static_xyz", "--out", self.folder / "given", "--size", "64x48",
                                 "--poses", "-", "--quiet"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, **how)

    def test_each_image_is_there_when_its_stamp_is_told(self):
        process = self.simulate()
        self.addCleanup(process.kill)
        for t_s, x in ((0, 0.0), (0.5, 0.1), (7.25, 0.2)):
            process.stdin.write(f"{t_s} {x} -1.7 1.3 -0.7071068 0 0 0.7071068\n")
            process.stdin.flush()
            stamp = process.stdout.readline().strip()
            self.assertEqual(stamp, f"{1000 + t_s:.6f}")
            self.assertTrue((self.folder / "given" / "rgb" / f"{stamp}.jpg").exists())
            self.assertTrue((self.folder / "given" / "depth" / f"{stamp}.png").exists())
        _, stderr = process.communicate(timeout=HANG_S)
        self.assertEqual((process.returncode, stderr), (0, ""))
        self.assertEqual([line.split()[1] for line in lines_of(self.folder / "given" / "groundtruth.txt")
                          if line[0] != "#"], ["0.000000000", "0.100000000", "0.200000000"])

    def test_what_is_no_pose_is_named_by_its_line(self):
        for line in ("0 0 0 1 0 0 0", "0 0 0 1 0 0 0 2", "0 0 0 nan 0 0 0 1", "-1 0 0 1 0 0 0 1", "hello", "0 0 0 1 0 0 0 1 9"):
            process = self.simulate()
            _, stderr = process.communicate(f"# a line\n{line}\n", timeout=HANG_S)
            self.assertEqual(process.returncode, 4, line)
            self.assertIn("-:2: ", stderr)
        process = self.simulate()
        _, stderr = process.communicate("1 0 0 1 0 0 0 1\n1 0 0 1 0 0 0 1\n", timeout=HANG_S)
        self.assertEqual(process.returncode, 4)
        self.assertIn("not later", stderr)
        self.assertFalse((self.folder / "given" / "rgb.txt").exists())


class TwoAtOnce(LongRuns):
    """F29"""

    def test_a_second_run_on_the_same_output_is_code_9_and_disturbs_nothing(self):
        process = self.start()
        done = self.run_slam(sequence(), "--quiet")
        self.assert_error(done, 9, "locked", self.folder / "out", left=[".lock", "log.txt"])
        self.assertIn("20000 pairs", self.log())
        process.send_signal(signal.SIGINT)
        self.assert_ran(self.finish(process), 130)
        self.assert_sound()
        self.assert_ran(self.run_slam(sequence(), "--to", 12))  # free again


class SameBytes(CliTest):
    """F37, F38: nothing but the input decides what is written."""

    FRAMES_USED = 40

    def results(self, out, *options, folder=None, **how):
        done = self.run_slam(folder or sequence(), "--to", self.FRAMES_USED, "--segmenter",
                             f"masks:{sequence() / 'mask'}", *options, out=out, geometry=False,
                             **how)
        self.assert_ran(done)
        found = contents(self.folder / out)
        return {name: without_timings(found[name]) if name == "frames.csv" else found[name]
                for name in RESULTS}

    def test_the_same_run_gives_the_same_bytes(self):
        first = self.results("first")
        self.assertEqual(self.results("second"), first)

    def test_one_processor_or_two_give_the_same_bytes(self):
        first = self.results("first")
        cpus = os.sched_getaffinity(0)
        one = {min(cpus)}
        self.assertEqual(self.results("one", preexec_fn=lambda: os.sched_setaffinity(0, one)),
                         first)

    def test_locale_time_zone_and_path_do_not_matter(self):
        first = self.results("first")
        locales = self.folder / "locales"
        locales.mkdir()
        comma = {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "TZ": "Asia/Kathmandu"}
        if shutil.which("localedef") and subprocess.run(
                ["localedef", "-i", "de_DE", "-f", "UTF-8", locales / "de_DE.UTF-8"], check=False,
                capture_output=True).returncode == 0:
            comma["LOCPATH"] = str(locales)
            shown = subprocess.run(["bash", "-c", "printf %.1f 1,5"], capture_output=True,
                                   text=True, check=False, env={**os.environ, **comma})
            self.assertEqual(shown.stdout, "1,5", "the locale with decimal commas is in force")
        else:
            print("note: no locale with decimal commas can be made here")
        there = self.copy_sequence("ein Ordner mit ümläuten und 空白")
        self.assertEqual(self.results("komma ausgabe", environment=comma, folder=there), first)
        text = (self.folder / "komma ausgabe" / "metrics.json").read_text(encoding="utf-8")
        self.assertIn('"coverage": 1.0', text)
        done = ygslam("eval", "--gt", there / "groundtruth.txt", "--est",
                      self.folder / "first" / "trajectory.txt", "--json", environment=comma)
        plain = ygslam("eval", "--gt", there / "groundtruth.txt", "--est",
                       self.folder / "first" / "trajectory.txt", "--json")
        self.assertEqual((done.returncode, done.stdout), (0, plain.stdout))



if __name__ == "__main__":
    unittest.main(verbosity=2)
