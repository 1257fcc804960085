"""`ygslam bench --engine dask://...` with a real scheduler and two workers on this machine.

    python tests/bench_engine_test.py
"""
import importlib.util
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time
import unittest

from bench_test import BenchTest, RUN_FILES
from ygslam_cli import BINARY, HANG_S, ygslam

# Without times: the same bytes wherever they were made.
SAME = {"trajectory.txt", "trajectory_live.txt", "keyframes.txt", "objects.csv", "loops.csv", "map.ply",
        "errors.csv", "config.yaml"}
NO_SCHEDULER = "127.0.0.1:1"


def children_of(process):
    """Processes that any thread of it has started."""
    found = []
    for task in pathlib.Path(f"/proc/{process.pid}/task").glob("*/children"):
        try:
            found += map(int, task.read_text(encoding="ascii").split())
        except (FileNotFoundError, ProcessLookupError):
            continue
    return found


class EngineTest(BenchTest):
    def setUp(self):
        super().setUp()
        self.environment = {}
        self.address = NO_SCHEDULER

    def start_scheduler(self):
        file = self.folder / "scheduler.json"
        self.scheduler = self.background("dask_scheduler", "--host", "127.0.0.1", "--port", "0",
                                         "--no-dashboard", "--no-show", "--scheduler-file", file)
        end = time.monotonic() + HANG_S
        while not (file.exists() and file.read_text(encoding="utf-8").endswith("}")):
            self.assertIsNone(self.scheduler.poll(), "no scheduler")
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)
        self.address = json.loads(file.read_text(encoding="utf-8"))["address"].removeprefix("tcp://")

    def add_worker(self, before=()):
        """One that runs once this is back. @param before: what its command begins with."""
        said = self.folder / f"worker_{time.monotonic_ns()}"
        worker = self.background("dask_worker", f"tcp://{self.address}", "--nthreads", "1", "--no-dashboard",
                                 "--no-nanny", "--host", "127.0.0.1", before=before, said=said)
        end = time.monotonic() + HANG_S
        while "Registered to" not in said.read_text(encoding="utf-8"):
            self.assertIsNone(worker.poll(), said.read_text(encoding="utf-8"))
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)
        return worker

    def background(self, module, *arguments, before=(), said=os.devnull):
        with open(said, "wb") as file:
            process = subprocess.Popen([*before, sys.executable, "-m", f"distributed.cli.{module}",
                                        *map(str, arguments)], stdout=file, stderr=file, cwd="/")
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def engine(self):
        return "--engine", f"dask://{self.address}", "--no-report"

    def runs_of(self, worker):
        """Number of a process to the folder it writes, of the runs that go on there."""
        found = {}
        for pid in children_of(worker):
            try:
                words = pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
            except (FileNotFoundError, ProcessLookupError):
                continue
            if words[0] == os.fsencode(BINARY):
                found[pid] = pathlib.Path(os.fsdecode(words[words.index(b"--out") + 1]))
        return found

    def facts(self, out):
        """sweep.json and all run.json, without when and how fast."""
        sweep = self.load("sweep.json", out=out)
        for key in ("started", "wall_s", "timings_valid"):
            sweep.pop(key)
        sweep["options"].pop("jobs")
        records = {}
        for path in out.glob("runs/*/*/*/run.json"):
            record = self.load(path)
            for key in ("wall_s", "timings_valid"):
                record.pop(key)
            record["files"].pop("metrics.json")
            records[str(path.relative_to(out))] = record
        return sweep, records


@unittest.skipUnless(importlib.util.find_spec("distributed"), "no distributed in this Python")
class Engine(EngineTest):
    def test_a_worker_killed_in_the_middle_and_the_same_results_as_here(self):
        for name in ("one", "two"):
            self.add(name)
        here = self.folder / "here"
        how = {"modes": "off,geometry", "runs": 2}
        self.assert_ran(self.bench("--deterministic", "--no-report", out=here, **how))
        self.start_scheduler()
        workers = [self.add_worker(), self.add_worker()]
        process = self.start("--deterministic", *self.engine(), **how)
        self.wait_until(lambda: all(self.runs_of(worker) for worker in workers), process)
        (run, place), = self.runs_of(workers[0]).items()
        workers[0].kill()
        self.assert_gone(run)
        _, errors = process.communicate(timeout=HANG_S)
        self.assertEqual(process.returncode, 0, errors)
        self.assertNotIn("warning: ", errors)
        self.assertEqual(self.load(place, "run.json")["status"], "ok", "done again elsewhere")
        self.assertEqual(len(self.run_times()), 8)
        self.assertEqual(self.load("sweep.json")["options"]["jobs"], 2, "as many as workers")
        self.assertEqual(self.facts(self.out), self.facts(here))
        for folder in here.glob("runs/*/*/*"):
            there = self.out / folder.relative_to(here)
            self.assertEqual({path.name for path in there.iterdir()} - {".lock"}, RUN_FILES)
            for name in SAME:
                self.assertEqual((there / name).read_bytes(), (folder / name).read_bytes(),
                                 f"{there} {name}")
        self.assertEqual([path.name for path in self.out.glob(".engine*")], [])

    def test_what_stops_it_ends_the_runs_and_the_same_command_goes_on(self):
        self.add("one")
        self.start_scheduler()
        worker = self.add_worker()
        for number, code in ((signal.SIGINT, 130), (signal.SIGKILL, -9)):
            shutil.rmtree(self.out, ignore_errors=True)
            process = self.start(*self.engine(), "--jobs", 2, modes="off,geometry", runs=20)
            self.wait_until(lambda: len(self.run_times()) >= 1 and self.runs_of(worker), process)
            run, = self.runs_of(worker)
            start = time.monotonic()
            process.send_signal(number)
            _, errors = process.communicate(timeout=HANG_S)
            self.assertEqual(process.returncode, code, errors)
            self.assert_gone(run)
            self.assertLess(time.monotonic() - start, 30)
            self.assertFalse(self.load("sweep.json")["complete"])
            before = self.run_times()
            done = self.bench(*self.engine(), modes="off,geometry", runs=2)
            self.assert_ran(done)
            self.assertRegex(done.stderr, r"4 runs, [1-4] of them done before")
            after = self.run_times()
            self.assertEqual({place: after[place] for place in before}, before)
            self.assertEqual({self.load(place, "run.json")["status"] for place in after}, {"ok"})

    def test_faults_of_a_run_are_rows_as_here(self):
        self.add("good")
        unreadable = self.add("unreadable")
        for path in (unreadable / "depth").iterdir():
            path.write_bytes(b"none")
        self.start_scheduler()
        self.add_worker()
        self.assert_ran(self.bench(*self.engine()))
        self.assertEqual(self.record("good")["status"], "ok")
        record = self.record("unreadable")
        self.assertEqual((record["status"], record["exit_code"]), ("failed", 4))
        self.assertTrue(record["error"].startswith("unreadable"), record["error"])
        late = self.folder / "late"
        self.assert_ran(self.bench(*self.engine(), "--run-limit", 0.001, "--realtime", "--sequences",
                                   "good", out=late))
        self.assertEqual(self.record("good", out=late)["status"], "timed_out")

    def test_an_engine_that_ends_is_one_line_and_what_is_done_stays(self):
        self.add("one")
        self.start_scheduler()
        worker = self.add_worker()
        process = self.start(*self.engine(), "--quiet", runs=50)
        self.wait_until(lambda: len(self.run_times()) >= 1 and self.runs_of(worker), process)
        runs = self.runs_of(worker)
        self.scheduler.kill()
        _, errors = process.communicate(timeout=HANG_S)
        self.assertEqual(process.returncode, 9, errors)
        self.assertRegex(errors, r"\Aerror: the engine cannot be used: [^\n]+\n\Z")
        for run in runs:
            self.assert_gone(run)
        self.assertFalse(self.load("sweep.json")["complete"])

    def test_a_worker_that_cannot_do_the_work_is_named(self):
        self.add("one")
        self.start_scheduler()
        self.assert_error(self.bench(*self.engine()), 9, "the scheduler has no workers", out="none")
        self.out.mkdir(exist_ok=True)
        hidden = ("unshare", "-rm", "sh", "-c", 'mount -t tmpfs none "$0" && exec "$@"', self.out)
        if subprocess.run([*hidden, "true"], check=False, capture_output=True).returncode != 0:
            self.skipTest("no mounts of one's own here")
        self.add_worker()
        self.add_worker(before=hidden)
        done = self.bench(*self.engine())
        self.assert_error(done, 9, "worker tcp://127.0.0.1:", "does not see",
                          "all workers must see the same files", out="none")
        self.assertEqual(self.run_times(), {})


class NoEngine(EngineTest):
    def test_wrong_addresses_and_missing_parts_have_their_codes(self):
        self.add("one")
        for address in ("head:8786", "dask://", "dask://head", "ray://head:1", "dask://head:"):
            done = ygslam(*self.command("--engine", address, "--quiet"))
            self.assert_error(done, 2, "must be dask://HOST:PORT", out="none")
        python = self.folder / "python"
        python.write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n', encoding="utf-8")
        python.chmod(0o755)
        done = ygslam(*self.command(*self.engine()), environment={"YGSLAM_PYTHON": str(python)})
        self.assert_error(done, 9, "No module named 'distributed'", "pip install distributed", out="none")
        if importlib.util.find_spec("distributed"):
            self.assert_error(self.bench(*self.engine()), 9, "no Dask scheduler at 127.0.0.1:1", out="none")

    def test_parts_of_a_sweep_made_apart_become_one_as_in_an_array_of_jobs(self):
        for name in ("one", "two"):
            self.add(name)
        whole = self.folder / "whole"
        for name in ("one", "two"):
            self.assert_ran(self.bench("--no-report", "--sequences", name, out=self.folder / name))
            shutil.copytree(self.folder / name / "runs", whole / "runs", dirs_exist_ok=True)
        done = self.bench("--no-report", out=whole)
        self.assert_ran(done)
        self.assertIn("2 sequences, 2 runs, 2 of them done before", done.stderr)
        self.assertTrue(self.load("sweep.json", out=whole)["complete"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
