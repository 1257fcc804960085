"""The Python module where a program ends before it does: daemon threads, forks; and what is handed to it.

    PYTHONPATH=build/release/python python tests/python_ends_test.py
"""
import os
import pathlib
import subprocess
import sys
import unittest

import numpy as np
import ygslam

from ygslam_cli import FRAMES, CliTest, contents, sequence, trajectory

# What every script begins with: a Slam that has begun, and a thread that goes on with it.
BEGIN = """
import gc, os, signal, sys, threading
import ygslam
seq = ygslam.open(sys.argv[1])
frames = [seq[i] for i in range(12)]
began = threading.Event()
def loop(slam):
    for i in range(1, 100000):
        slam.process(frames[i % 12].rgb, frames[i % 12].depth, 10**13 + i * 33333333)
        began.set()
def tracked(**how):
    slam = ygslam.Slam(seq.camera, **{"segmenter": "none", "dynamic": "geometry", **how})
    slam.process(frames[0].rgb, frames[0].depth, frames[0].t_ns)
    return slam
def in_child(work):
    pid = os.fork()
    if pid == 0:
        signal.alarm(60)
        work()
        sys.exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
"""


class ScriptTest(CliTest):
    def script(self, text, code=0, said=""):
        done = subprocess.run([sys.executable, "-W", "ignore::DeprecationWarning", "-c", BEGIN + text, sequence()],
                              capture_output=True, text=True, check=False, timeout=120)
        self.assertEqual((done.returncode, done.stderr), (code, said), text)
        return done.stdout


class DaemonThreads(ScriptTest):
    """A daemon thread is in a call when the interpreter ends."""

    def test_the_program_ends_as_it_wants_to(self):
        for how in ("", "deterministic=True", "view='127.0.0.1:0'"):
            for end, code in (("", 0), ("sys.exit(3)", 3)):
                for _ in range(3):  # in whatever moment
                    self.script(f"g = tracked({how})\n"
                                "threading.Thread(target=loop, args=(g,), daemon=True).start()\n"
                                f"began.wait()\n{end}", code)

    def test_with_several_and_a_map_that_is_copied(self):
        self.script("""
slams = [tracked() for _ in range(2)]
for slam in slams:
    threading.Thread(target=loop, args=(slam,), daemon=True).start()
def copies():
    while True:
        seq[3]
threading.Thread(target=copies, daemon=True).start()
began.wait()
""")

    def test_a_thread_that_an_exit_handler_joins_goes_on_until_then(self):
        self.assertEqual(self.script("""
import atexit
g, stop = tracked(), threading.Event()
def work():
    while not stop.is_set():
        g.process(frames[1].rgb, frames[1].depth, 10**13 + work.i)
        work.i += 33333333
        began.set()
work.i = 0
thread = threading.Thread(target=work, daemon=True)
thread.start()
began.wait()
atexit.register(lambda: (stop.set(), thread.join(), print("joined", work.i > 0)))
"""), "joined True\n")

    def test_one_that_is_used_while_everything_goes_is_no_crash(self):
        self.script("""
g = tracked()
class Last:
    def __del__(self):
        g.process(frames[1].rgb, frames[1].depth, 10**13)
last = Last()
""")


class ForkedChildren(ScriptTest):
    """A child made by fork() has its parent's objects, but not their threads."""

    def test_a_child_ends_and_drops_them_without_waiting(self):
        for how in ("", "deterministic=True", "view='127.0.0.1:0'"):
            out = self.script(f"""
g = tracked({how})
def drop():
    global g
    del g
    gc.collect()
print(in_child(lambda: None), in_child(drop))
with tracked({how}) as h:
    print(in_child(lambda: None))
print(g.process(frames[1].rgb, frames[1].depth, frames[1].t_ns).state.name)
""")
            self.assertEqual(out, "0 0\n0\nTRACKING\n", how)

    def test_a_child_that_uses_them_is_told(self):
        out = self.script("""
g = tracked()
def use():
    for call in (lambda: g.process(frames[1].rgb, frames[1].depth, frames[1].t_ns), g.map, g.reset, g.finish,
                 lambda: g.save_map("x.map"), lambda: g.view_url):
        try:
            call()
        except ygslam.UsageError as error:
            print(error.code, error, flush=True)
print(in_child(use), flush=True)
""").splitlines()
        self.assertEqual(out[-1], "0")
        self.assertEqual(len(out), 7)
        for line in out[:-1]:
            self.assertRegex(line, r"^2 \w+\(\) in a forked child: .*make one in the child$")

    def test_a_child_may_have_its_own(self):
        self.assertEqual(self.script("""
g = tracked()
def own():
    with tracked() as slam:
        print(slam.process(frames[1].rgb, frames[1].depth, frames[1].t_ns).state.name, flush=True)
print(in_child(own))
"""), "TRACKING\n0\n")

    def test_while_another_thread_is_in_a_call(self):
        self.assertEqual(self.script("""
g = tracked()
threading.Thread(target=loop, args=(g,), daemon=True).start()
began.wait()
def use():
    try:
        g.map()
    except ygslam.UsageError as error:
        print("forked child" in str(error), flush=True)
print([in_child(use) for _ in range(3)])
"""), "True\n" * 3 + "[0, 0, 0]\n")


class Handed(CliTest):
    def test_a_trajectory_is_written_whole_or_not_at_all(self):
        file = self.folder / "t.txt"
        good = [[1.5, 0, 0, 0, 0, 0, 0, 1], [1.6, 1, 2, 3, 0, 0, 1, 0]]
        ygslam.write_trajectory(file, good)
        before = file.read_bytes()
        self.assertEqual(before.splitlines()[1], b"1.600000 " + b" ".join(
            f"{v:.9f}".encode() for v in good[1][1:]))
        nan, inf, far, ns = np.array(good), np.array(good), np.array(good), np.array(good)
        nan[1, 2], inf[0, 0], far[1, 6], ns[1, 0] = np.nan, np.inf, 3, 1.6e18
        for rows, words in ((np.array(good)[:, :5], r"shape \(N, 8\).*not \(2, 5\)"), (good[0], r"not \(8,\)"),
                            (nan, "row 1 .*not finite"), (inf, "row 0 .*not finite"),
                            (ns, "row 1 .*not in seconds"), (far, "row 1 .*quaternion"), (np.zeros((3, 8)), "row 0 .*quaternion"),
                            ([["a"] * 8], "could not convert")):
            with self.assertRaisesRegex(ValueError, words) as refused:
                ygslam.write_trajectory(file, rows)
            self.assertNotIn("\n", str(refused.exception))
        self.assertEqual(file.read_bytes(), before)
        with self.assertRaisesRegex(ygslam.OutputError, "nowhere"):
            ygslam.write_trajectory(self.folder / "nowhere" / "t.txt", good)
        for none in ([], np.empty((0, 8))):
            ygslam.write_trajectory(file, none)
            self.assertEqual(file.read_bytes(), b"")

    def test_paths_are_what_python_takes_for_paths(self):
        odd = os.fsencode(self.folder) + b"/\xff\xfe"
        os.symlink(sequence(), odd)
        for path in (str(sequence()), pathlib.Path(sequence()), os.fsencode(sequence()), odd,
                     os.fsdecode(odd), pathlib.Path(os.fsdecode(odd))):
            self.assertEqual(len(ygslam.open(path)), FRAMES)
        for path, kind in ((7.5, TypeError), (None, TypeError), ("a\0b", ValueError)):
            with self.assertRaises(kind) as refused:
                ygslam.open(path)
            self.assertNotIn("\n", str(refused.exception))
        with self.assertRaises(ygslam.InputError) as missing:
            ygslam.open(odd + b"\x1b[2J")
        self.assertIn(r"\xff\xfe\x1b[2J", str(missing.exception))
        out = os.fsencode(self.folder / "out")
        self.assertEqual(ygslam.run(os.fsencode(sequence()), out, dynamic="off", to=3)["tracked"], 3)
        slam = ygslam.Slam(ygslam.open(sequence()).camera, dynamic="off", deterministic=True)
        slam.save_map(odd + b".map")
        self.assertIn(b"\xff\xfe.map", os.listdir(os.fsencode(self.folder)))
        ygslam.write_trajectory(odd + b".txt", [])
        self.assertEqual(trajectory(os.fsdecode(odd + b".txt")), [])
        self.assertIn("metrics.json", contents(self.folder / "out"))


if __name__ == "__main__":
    unittest.main()
