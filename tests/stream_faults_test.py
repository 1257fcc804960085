"""Streams with faults: stamps that jump, images that cannot be read, late frames, writers that are
started again. What cannot be used is told while the stream goes on, and counts as lost.

    python tests/stream_faults_test.py
"""
import csv
import dataclasses
import subprocess
import threading
import unittest

import numpy as np

from bag_test import RESULTS, BagTest
from bags import DEPTH, RGB, write_mcap
from pipe_test import is_colour, records
from ygslam_cli import BINARY, HANG_S, ygslam

FRAMES = 60
HOUR_NS = 3600 * 10**9
STEP_NS = 10**9 // 30


def end_of_frame(data, number):
    """Where what follows a frame begins: its colour image comes last."""
    at, frames = 8, 0
    for opcode, record in records(data):
        at += len(record)
        frames += is_colour(opcode, record)
        if frames > number:
            return at
    raise AssertionError("no such frame")


class StreamTest(BagTest):
    COUNT = FRAMES

    def stream(self, offset_ns=lambda topic, number: 0, frames=None, name="stream.mcap"):
        """MCAP without chunks, stamps shifted by what is said of (topic, number of its image)."""
        numbers, said = {}, []
        for topic, stamp_ns, message in self.said() if frames is None else self.said_of(frames):
            number = numbers[topic] = numbers.get(topic, -1) + 1
            by_ns = offset_ns(topic, number)
            ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec + by_ns
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, 10**9)
            said.append((topic, stamp_ns, message))
        return write_mcap(self.folder / name, said, "", use_chunking=False).read_bytes()

    def said_of(self, frames):
        kept, self.frames = self.frames, frames
        yield from self.said()
        self.frames = kept

    def piped(self, data, *options, out="out", command=("run",)):
        how = () if "--realtime" in options else ("--deterministic",)
        done = subprocess.run(
            [BINARY, command[0], "-", *map(str, command[1:]), "--out", self.folder / out,
             "--dynamic", "geometry", *how, *map(str, options)], input=data, check=False,
            capture_output=True, timeout=HANG_S)
        return subprocess.CompletedProcess(done.args, done.returncode, done.stdout.decode(),
                                           done.stderr.decode(errors="replace"))

    def rows(self, out="out"):
        with open(self.folder / out / "frames.csv", newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def stamps(self, out="out"):
        return [float(row["stamp"]) for row in self.rows(out)]


def of(topics, numbers, by_ns):
    return lambda topic, number: by_ns if topic in topics and number in numbers else 0


class Stamps(StreamTest):
    """F11"""

    def test_one_that_is_far_off_costs_its_frame_and_is_told(self):
        for topics in ((RGB, DEPTH), (RGB,), (DEPTH,)):
            for by_ns in (HOUR_NS, -HOUR_NS // 4):
                for at in (0, 25) if by_ns > 0 else (25,):
                    with self.subTest(topics=topics, by_ns=by_ns, at=at):
                        done = self.piped(self.stream(of(topics, {at}, by_ns)))
                        self.assert_ran(done)
                        metrics = self.metrics()
                        self.assertEqual(metrics["tracked"], FRAMES - 1)
                        self.assertEqual((metrics["coverage"], metrics["left_out"]),
                                         (1.0, len(topics)))
                        for topic in topics:
                            self.assertIn(f"{topic}[{at}]: its stamp is ", done.stderr)

    def test_file_and_pipe_leave_out_the_same(self):
        data = self.stream(of((RGB, DEPTH), {25, 40}, HOUR_NS))
        self.assert_ran(self.piped(data, out="piped"))
        done = self.run_bag(self.folder / "stream.mcap", out="folder")
        self.assertIn("4 of 120 images are left out", done.stderr)
        self.assert_same("piped")

    def test_clocks_that_are_set_ahead_make_a_gap(self):
        done = self.piped(self.stream(of((RGB, DEPTH), range(25, FRAMES), HOUR_NS)))
        self.assert_ran(done)
        self.assertIn(f"{RGB}[25]: stamps go ahead by 3600.0", done.stderr)
        stamps = self.stamps()
        self.assertEqual(len(stamps), FRAMES)
        self.assertAlmostEqual(stamps[25] - stamps[24], 3600 + 1 / 30, places=2)

    def test_clocks_that_are_set_back_are_counted_on(self):
        for by_ns in (-HOUR_NS // 4, -10**9 // 2):
            data = self.stream(of((RGB, DEPTH), range(25, FRAMES), by_ns))
            done = self.piped(data)
            self.assert_ran(done)
            self.assertIn(f"{RGB}[25]: stamps go back by ", done.stderr)
            self.assertIn("are added to stamps from", done.stderr)
            stamps = self.stamps()
            self.assertEqual(len(stamps), FRAMES)
            self.assertEqual(self.metrics()["tracked"], FRAMES)
            np.testing.assert_allclose(np.diff(stamps), 1 / 30, atol=0.002)
        # From a file, too, where images of two times would be mixed.
        done = self.run_bag(self.folder / "stream.mcap", out="file")
        self.assertIn("stamps go back by", done.stderr)
        for name in RESULTS:
            self.assertEqual((self.folder / "out" / name).read_bytes(),
                             (self.folder / "file" / name).read_bytes(), name)

    def test_localize_reads_them_alike(self):
        data = self.stream()
        self.assert_ran(self.piped(data, "--save-map", self.folder / "room.map"))
        data = self.stream(of((RGB, DEPTH), {25}, HOUR_NS))
        done = self.piped(data, command=("localize", "--map", self.folder / "room.map"), out="placed")
        self.assert_ran(done)
        self.assertEqual(self.metrics("placed")["frames"], FRAMES - 1)
        self.assertIn("its stamp is 3599.9", done.stderr)

    def test_it_is_told_while_the_stream_goes_on(self):
        data = self.stream(of((RGB, DEPTH), {25}, HOUR_NS))
        for options in ((), ("--realtime",)):
            # What comes after is not written before the warning has been read.
            self.assert_told(data, end_of_frame(data, 26), "its stamp is 3599.9", *options)

    def assert_told(self, data, at, words, *options):
        process = subprocess.Popen(
            [BINARY, "run", "-", "--out", self.folder / "told", "--dynamic", "geometry", *options],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        guard = threading.Timer(HANG_S, process.kill)
        guard.start()
        self.addCleanup(guard.cancel)
        writer = threading.Thread(target=lambda: (process.stdin.write(data[:at]),
                                                  process.stdin.flush()))
        writer.start()
        lines = []
        while not lines or words not in lines[-1]:
            lines.append(process.stderr.readline().decode(errors="replace"))
            self.assertTrue(lines[-1], "".join(lines))
        writer.join()
        process.stdin.write(data[at:])
        process.stdin.close()
        process.stderr.read()
        process.stderr.close()
        self.assertIn(process.wait(timeout=HANG_S), (0, 7))


class NothingUsable(StreamTest):
    """Time without a usable image is time lost."""

    def test_images_that_cannot_be_read_count_as_lost_and_no_list_grows(self):
        small = dataclasses.replace(self.frames[0], colour=np.zeros((2, 2, 3), np.uint8),
                                    depth_mm=np.zeros((2, 2), np.uint16))
        bad = 3000
        frames = self.frames[:30] + [
            dataclasses.replace(small, stamp_ns=self.frames[29].stamp_ns + (i + 1) * STEP_NS)
            for i in range(bad)]
        done = self.piped(self.stream(frames=frames))
        self.assert_ran(done, code=7)
        self.assertIn(f"lost for 99 % of the frames ({bad} of {bad + 30} were dropped or could not "
                      "be read)", done.stderr)
        metrics = self.metrics()
        self.assertEqual((metrics["frames"], metrics["readable"], metrics["tracked"]),
                         (bad + 30, 30, 30))
        self.assertEqual(metrics["coverage"], 30 / (bad + 30))
        self.assertEqual(metrics["skipped_image_count"], 2 * bad)
        self.assertEqual(len(metrics["skipped_images"]), 1000)
        (begin, end), = metrics["lost_intervals"]
        self.assertAlmostEqual(begin, 1e-9 * frames[30].stamp_ns, places=5)
        self.assertAlmostEqual(end, 1e-9 * frames[-1].stamp_ns, places=5)
        self.assertLess((self.folder / "out" / "metrics.json").stat().st_size, 300_000)
        self.assertEqual([row["state"] for row in self.rows()][29:],
                         ["tracking"] + bad * ["unreadable"])

    def test_every_other_image_is_one_warning_for_many(self):
        empty = np.zeros((2, 2, 3), np.uint8)
        frames = [dataclasses.replace(frame, colour=empty) if i % 2 else frame
                  for i, frame in enumerate(self.frames)]
        done = self.piped(self.stream(frames=frames))
        self.assert_ran(done)
        self.assertEqual(done.stderr.count("skipping"), 10, "then the 100th")
        self.assertEqual(self.metrics()["coverage"], 0.5)

    def test_depth_that_stops_is_told_and_counts(self):
        frames = [dataclasses.replace(self.frames[0], stamp_ns=self.frames[0].stamp_ns + i * STEP_NS)
                  for i in range(200)]
        said = [(topic, ns, message) for topic, ns, message in self.said_of(frames)
                if topic != DEPTH or ns < frames[40].stamp_ns]
        data = write_mcap(self.folder / "x.mcap", said, "", use_chunking=False).read_bytes()
        done = self.piped(data)
        self.assert_ran(done, code=7)
        self.assertIn(f"{RGB}[40]: no depth image within 20 ms; skipping", done.stderr)
        self.assertEqual(self.metrics()["tracked"], 40)
        self.assertEqual(self.metrics()["coverage"], 0.2)
        self.assertEqual(self.metrics()["colour_without_depth"], 160)

    def test_stamps_that_stand_still_are_told_and_count(self):
        def still(topic, number):  # pylint: disable=unused-argument
            return -(number - 20) * STEP_NS if number > 20 else 0
        frames = [dataclasses.replace(self.frames[0],
                                      stamp_ns=self.frames[0].stamp_ns + i * STEP_NS)
                  for i in range(FRAMES)]
        done = self.piped(self.stream(still, frames=frames))
        self.assert_ran(done, code=7)
        self.assertIn("its stamp is that of another image; left out", done.stderr)
        self.assertEqual(self.metrics()["tracked"], 21)
        self.assertLess(self.metrics()["coverage"], 0.45)  # the last ten are undecided


class LateFrames(StreamTest):
    def test_each_that_is_dropped_has_a_row_and_counts_as_lost(self):
        done = self.piped(self.stream(), "--realtime")  # as fast as the pipe goes
        rows, metrics = self.rows(), self.metrics()
        self.assertEqual([int(row["frame"]) for row in rows], list(range(FRAMES)))
        dropped = sum(row["state"] == "dropped" for row in rows)
        self.assertGreater(dropped, 0)
        self.assertEqual(metrics["dropped"], dropped)
        self.assertEqual(metrics["readable"], FRAMES)
        self.assertEqual(metrics["coverage"], metrics["tracked"] / FRAMES)
        self.assert_ran(done, code=7 if 2 * metrics["tracked"] < FRAMES else 0)
        told = ygslam("eval", "--json", "--gt", self.folder / "out" / "trajectory_live.txt", "--est",
                      self.folder / "out" / "trajectory_live.txt", "--frames",
                      self.folder / "out" / "frames.csv")
        self.assertIn(f'"coverage": {metrics["coverage"]}', told.stdout.replace("1,", "1.0,"))


class Restarts(StreamTest):
    """The writer of a stream is started again."""

    def beginnings(self):
        """Two recordings, one after the other; the second one numbers its channels otherwise."""
        first = self.stream(frames=self.frames[:25], name="first.mcap")
        said = sorted(self.said_of(self.frames[25:]), key=lambda s: (s[1], s[0]))
        second = write_mcap(self.folder / "second.mcap", said, "", use_chunking=False).read_bytes()
        return first, second

    def test_the_run_goes_on_with_the_new_beginning(self):
        first, second = self.beginnings()
        data_end = next(i for i in range(len(first) - 20, 0, -1) if first[i:i + 9] == b"\x0f" + bytes(
            [4]) + bytes(7))
        middle = end_of_frame(first, 24) - 2000  # in the last colour image
        for name, begun, lost in (("closed", first, 0), ("open", first[:data_end], 0),
                                  ("killed", first[:middle], 1),
                                  ("noise", first[:data_end] + b"\x77" * 3000, 0)):
            with self.subTest(name=name):
                self.folder.joinpath("both.mcap").write_bytes(begun + second)
                done = self.piped(begun + second, out="piped")
                self.assert_ran(done)
                self.assertEqual(self.metrics("piped")["tracked"], FRAMES - lost)
                self.assertEqual(done.stderr.count("begins anew after"), 1, done.stderr)
                self.assertEqual(done.stderr.count("warning"), 1, done.stderr)
                done = self.run_bag(self.folder / "both.mcap", out="folder")
                self.assertIn("2 recordings follow each other", done.stderr)
                self.assert_same("piped")

    def test_its_clock_may_begin_anew_too(self):
        first, _ = self.beginnings()
        start_ns = self.frames[0].stamp_ns
        again = [dataclasses.replace(frame, stamp_ns=frame.stamp_ns - start_ns + 10**9)
                 for frame in self.frames[25:]]
        done = self.piped(first + self.stream(frames=again))
        self.assert_ran(done)
        self.assertEqual(self.metrics()["tracked"], FRAMES)
        self.assertIn("begins anew after", done.stderr)
        self.assertIn("are added to stamps from", done.stderr)


if __name__ == "__main__":
    unittest.main()
