"""Traces of a run (`--trace`): JSON that says which thread did what and when.

    python tests/trace_test.py
"""
import json
import os
import signal
import unittest

from cli_runs_test import LongRuns
from ygslam_cli import FRAMES, CliTest, contents, sequence, ygslam

CLOSE_US = 0.002  # numbers with three decimals, added as floating point


def spans_of(events):
    """Thread to its spans, by their begin, those that hold others first."""
    spans = {}
    for event in events:
        if event["ph"] == "X":
            spans.setdefault(event["tid"], []).append(event)
    for of_thread in spans.values():
        of_thread.sort(key=lambda event: (event["ts"], -event["dur"]))
    return spans


def threads_of(events):
    return {event["args"]["name"]: event["tid"] for event in events if event["name"] == "thread_name"}


class Trace(CliTest):
    def setUp(self):
        super().setUp()
        self.file = self.folder / "trace.json"

    def events(self):
        return json.loads(self.file.read_text(encoding="utf-8"))

    def assert_nested(self, events):
        """Two spans of one thread have no time in common, or one holds the other."""
        for spans in spans_of(events).values():
            open_until = []
            for span in spans:
                while open_until and open_until[-1] <= span["ts"] + CLOSE_US:
                    open_until.pop()
                end = span["ts"] + span["dur"]
                if open_until:
                    self.assertLessEqual(end, open_until[-1] + CLOSE_US, span)
                open_until.append(end)

    def assert_told(self, events, stages):
        """Each frame has these stages in the tracking thread."""
        tracking = spans_of(events)[threads_of(events)["tracking"]]
        for stage in stages:
            frames = [span["args"]["frame"] for span in tracking if span["name"] == stage]
            self.assertEqual(sorted(set(frames)), list(range(FRAMES)), stage)

    def run_live(self, *options):
        done = ygslam("run", sequence(), "--out", self.folder / "out", "--trace", self.file,
                      "--save-map", self.folder / "room.map", *options)
        self.assert_ran(done)
        self.assertRegex(done.stdout.splitlines()[-1], r"trace\.json \(--trace\)")
        return self.events()

    def test_of_threads(self):
        events = self.run_live("--segmenter", f"masks:{sequence() / 'mask'}")
        self.assertLessEqual({"tracking", "reading", "segmentation", "mapping", "dense map", "map file"},
                             set(threads_of(events)))
        self.assert_nested(events)
        self.assert_told(events, ["frame", "track", "features", "motion checks"])
        names = {event["name"] for event in events}
        self.assertLessEqual({"read", "decode colour", "decode depth", "flow", "local map",
                              "keyframe decision", "map keyframe", "view intake", "fuse", "segment",
                              "queue: frames", "queue: mapping", "queue: segmentation",
                              "queue: dense map", "write outputs"}, names)
        self.assertTrue(any(event["cat"] == "wait" for event in events if "cat" in event))
        for event in events:
            self.assertGreaterEqual(event.get("ts", 0), 0)
            if event["ph"] == "X":
                self.assertGreaterEqual(event["args"]["cpu_ms"], 0)

    def test_of_one_schedule_and_its_results_stay_the_same(self):
        for out, options in (("with", ("--trace", self.file)), ("without", ())):
            self.assert_ran(self.run_slam(sequence(), "--export", self.folder / f"{out}_scene", "--segmenter",
                                          f"masks:{sequence() / 'mask'}", *options, out=out, geometry=False))
        for one, other in (("with", "without"), ("with_scene", "without_scene")):
            was, now = contents(self.folder / other), contents(self.folder / one)
            self.assertEqual(set(was), set(now))
            self.assertEqual([name for name in was if was[name] != now[name]
                              and name not in ("metrics.json", "log.txt")], [])
        events = self.events()
        self.assertEqual(set(threads_of(events)), {"tracking", "reading"})
        self.assert_nested(events)
        self.assert_told(events, ["frame", "segment", "track", "mapping"])
        self.assertLessEqual({"bundle adjustment", "fuse", "mesh"}, {event["name"] for event in events})

    def test_frames_that_are_dropped(self):
        """At a hundred times the pace some must be."""
        folder = self.copy_sequence()
        pairs = [f"{i / 3000:.6f} {colour} {i / 3000:.6f} {depth}"
                 for i, (_, colour, _, depth) in enumerate(self.pairs(folder), 1)]
        (folder / "associations.txt").write_text("\n".join(pairs) + "\n", encoding="utf-8")
        for part in ("groundtruth.txt", "instances.json"):
            (folder / part).unlink()
        done = self.run_slam(folder, "--realtime", "--trace", self.file)
        self.assertIn(done.returncode, (0, 7), done.stderr)
        dropped = [event["args"]["frame"] for event in self.events() if event["ph"] == "i"
                   and event["name"] == "dropped: frames"]
        rows = (self.folder / "out" / "frames.csv").read_text(encoding="utf-8").splitlines()[1:]
        self.assertEqual(dropped, [int(row.split(",")[1]) for row in rows if ",dropped," in row])
        self.assertGreater(len(dropped), 0)

    def test_of_localize(self):
        room = self.folder / "room.map"
        self.assert_ran(self.run_slam(sequence(), "--save-map", room))
        done = ygslam("localize", sequence(), "--map", room, "--out", self.folder / "placed", "--dynamic",
                      "geometry", "--to", 10, "--trace", self.file)
        self.assert_ran(done)
        self.assertIn("mapping", threads_of(self.events()))

    def test_a_file_that_is_no_trace_is_not_replaced(self):
        for name, text in (("metrics.json", "[1, 2]"), ("diary", "a diary")):
            precious = self.folder / name
            precious.write_text(text, encoding="utf-8")
            self.assert_error(self.run_slam(sequence(), "--trace", precious), 9, precious, "not replaced")
            self.assertEqual(precious.read_text(encoding="utf-8"), text)
        os.mkfifo(self.folder / "pipe")
        for target in (self.folder / "pipe", self.folder, "/dev/null"):
            self.assert_error(self.run_slam(sequence(), "--trace", target), 9, target, "not replaced")
        self.assert_error(self.run_slam(sequence(), "--trace", self.folder / "nowhere" / "t.json"), 9,
                          "nowhere/t.json", "No such file")

    def test_an_earlier_trace_stays_where_no_frame_can_be_read(self):
        self.assert_ran(self.run_slam(sequence(), "--to", 3, "--trace", self.file))
        before = self.file.read_bytes()
        folder = self.copy_sequence(frames=3)
        for _, colour, _, _ in self.pairs(folder):
            (folder / colour).write_bytes(b"damaged")
        self.assertNotEqual(self.run_slam(folder, "--trace", self.file, out="other").returncode, 0)
        self.assertEqual(self.file.read_bytes(), before)


class TraceEnds(LongRuns):
    def setUp(self):
        super().setUp()
        self.file = self.folder / "trace.json"
        self.options = ["--trace", self.file]

    def test_a_signal_leaves_it_whole(self):
        process = self.start()
        process.send_signal(signal.SIGINT)
        self.assert_ran(self.finish(process), 130)
        events = json.loads(self.file.read_text(encoding="utf-8"))
        self.assertIn("end of the run", {event["name"] for event in events})

    def test_what_was_killed_lacks_a_bracket(self):
        process = self.start()
        process.kill()
        self.finish(process)
        events = json.loads(self.file.read_text(encoding="utf-8") + "]")
        self.assertIn("features", {event["name"] for event in events})

    def test_one_that_was_removed_is_told(self):
        process = self.start()
        self.file.unlink()
        process.send_signal(signal.SIGINT)
        done = self.finish(process)
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertIn("trace.json: was removed during the run", done.stderr)
        self.assert_sound()


if __name__ == "__main__":
    unittest.main()
