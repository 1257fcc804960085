"""Runs that want more than there is: full disks, memory; and links where output goes.

The numbers F26 ... F29 are those of docs/reliability.md.
"""
import os
import pathlib
import resource
import shutil
import subprocess
import unittest

from ygslam_cli import BINARY, FILES, HANG_S, CliTest, contents, sequence, ygslam


class FullDisk(CliTest):
    """F26: what cannot be written is code 9, and what was there stays."""

    @staticmethod
    def limit(largest_file):
        """For a child's start: no file larger than so many bytes. To write more raises a signal
        (SIGXFSZ) that ends a program unless it is ignored."""
        return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))

    def limited(self, largest_file, *options):
        """A run that may write no file larger than so many bytes, as on a full disk."""
        return self.run_slam(sequence(), "--to", 12, *options, preexec_fn=self.limit(largest_file))

    def test_a_disk_that_fills_up_leaves_the_earlier_files_whole(self):
        self.assert_ran(self.run_slam(sequence(), "--to", 12, out="twelve"))
        map_bytes = (self.folder / "twelve" / "map.ply").stat().st_size
        self.assert_ran(self.run_slam(sequence(), "--to", 20))
        before = contents(self.folder / "out")
        for largest in (600, map_bytes - 1):  # the first file fails, the last one
            done = self.limited(largest, "--quiet")
            self.assertEqual(done.returncode, 9, done.stderr)
            self.assertIn(str(self.folder / "out"), done.stderr.splitlines()[-1])
            after = contents(self.folder / "out")
            self.assertEqual(set(after), set(before), "no temporary file remains")
            self.assertEqual(after["map.ply"], before["map.ply"])
            for name in ("trajectory.txt", "frames.csv"):  # the old one or the whole new one
                self.assertIn(len(after[name].splitlines()) - (name == "frames.csv"), (12, 20))

    def test_a_file_size_limit_ends_a_run_with_one_line(self):
        done = self.limited(600, "--quiet")
        self.assert_error(done, 9, self.folder / "out" / "trajectory.txt", "File too large",
                          left=["log.txt"])

    def test_a_file_size_limit_leaves_a_rendering_without_lists(self):
        out = self.folder / "rendered"
        done = ygslam("simulate", "walking_xyz", "--out", out, "--size", "160x120", "--seconds",
                      "0.2", "--truth", "--threads", "1", preexec_fn=self.limit(2000))
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertRegex(done.stderr, r"\Aerror: .*/(rgb|depth)/\S+: File too large\n\Z")
        self.assertIn(str(out), done.stderr)
        files = [path for path in out.rglob("*") if path.is_file()]
        self.assertEqual([path for path in files if path.suffix not in (".jpg", ".png")], [])
        self.assertNotIn(done.stderr.split(": ")[1], map(str, files), "half a file")

    def test_a_file_size_limit_on_standard_output_is_told(self):
        with open(self.folder / "keys", "wb") as file:
            done = subprocess.run([BINARY, "config"], stdout=file, stderr=subprocess.PIPE,
                                  text=True, check=False, timeout=HANG_S,
                                  preexec_fn=self.limit(100))
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertEqual(done.stderr, "error: standard output could not be written\n")

    def test_a_full_disk_of_its_own(self):
        if os.geteuid() != 0:
            self.skipTest("needs root to mount a small disk")
        script = ('mount -t tmpfs -o size=64k none "$1" && head -c 60000 /dev/zero > "$1/full"; '
                  'shift; "$@"; code=$?; ls -A "$OUT"; exit $code')
        out = self.folder / "out"
        out.mkdir()
        try:
            done = subprocess.run(
                ["unshare", "-m", "bash", "-c", script, "bash", out, BINARY, "run", sequence(),
                 "--out", out, "--dynamic", "geometry", "--deterministic", "--quiet"],
                capture_output=True, text=True, check=False, timeout=HANG_S,
                env={**os.environ, "OUT": str(out)})
        except FileNotFoundError:
            self.skipTest("no unshare")
        if "unshare" in done.stderr or "mount" in done.stderr:
            self.skipTest(done.stderr.strip())
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertIn("No space left on device", done.stderr)
        self.assertNotIn(".tmp", done.stdout)

    def test_a_scene_that_cannot_be_written_costs_nothing_else(self):
        scene = self.folder / "scene"
        (scene / "space.ot").mkdir(parents=True)  # in the place of its file
        done = self.run_slam(sequence(), "--to", 12, "--export", scene)
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertIn(str(scene / "space.ot"), done.stderr.splitlines()[-1])
        self.assert_sound()

    def test_a_map_whose_companions_would_have_too_long_a_name_is_told_before_the_run(self):
        for length in (250, 255):
            name = self.folder / ("m" * length)
            self.assert_error(self.run_slam(sequence(), "--to", 12, "--save-map", name), 9, name, "too long")
        self.assert_ran(self.run_slam(sequence(), "--to", 3, "--save-map", self.folder / ("m" * 249)))

    def test_a_folder_that_cannot_be_written_is_told_before_the_run(self):
        blocked = self.folder / "file"
        blocked.write_text("x", encoding="utf-8")
        for out in (blocked, blocked / "below", pathlib.Path("/proc/ygslam")):
            done = ygslam("run", sequence(), "--out", out, "--dynamic", "geometry", "--quiet")
            self.assertEqual(done.returncode, 9, done.stderr)
            self.assertIn(str(out), done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)

    def test_a_read_only_folder_is_told_and_its_files_stay(self):
        self.assert_ran(self.run_slam(sequence(), "--to", 12))
        before = contents(self.folder / "out")
        binary, user = BINARY, {}
        if os.geteuid() == 0:  # root may write anywhere: go as nobody
            user = {"user": 65534, "extra_groups": []}
            os.chmod(self.folder, 0o755)
            readable = subprocess.run(["test", "-x", BINARY], check=False, **user)
            if readable.returncode != 0:
                self.skipTest("nobody cannot run the program")
        os.chmod(self.folder / "out", 0o555)
        self.addCleanup(os.chmod, self.folder / "out", 0o755)
        done = subprocess.run([binary, "run", sequence(), "--out", self.folder / "out",
                               "--dynamic", "geometry", "--quiet"], capture_output=True, text=True,
                              check=False, timeout=HANG_S, **user)
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertIn("ermission denied", done.stderr)
        self.assertEqual(contents(self.folder / "out"), before)


class Links(CliTest):
    """What lies in the output folder under the name of one of our files is replaced, never followed."""

    def test_no_file_outside_the_folder_is_written(self):
        out, outside = self.folder / "out", self.folder / "outside"
        out.mkdir()
        outside.mkdir()
        for name in FILES:
            (outside / name).write_text("precious", encoding="utf-8")
            (out / name).symlink_to(outside / name)
        self.assert_ran(self.run_slam(sequence(), "--to", 12))
        self.assert_sound()
        for name in FILES:
            self.assertEqual((outside / name).read_text(encoding="utf-8"), "precious", name)
            self.assertFalse((out / name).is_symlink(), name)

    def test_a_rendering_writes_through_no_link(self):
        out, precious = self.folder / "rendered", self.folder / "precious"
        precious.write_text("precious", encoding="utf-8")
        (out / "rgb").mkdir(parents=True)
        how = ("simulate", "static_xyz", "--out", out, "--size", "160x120", "--seconds", "0.1",
               "--threads", "1", "--quiet")
        self.assert_ran(ygslam(*how))
        first = sorted((out / "rgb").iterdir())[0]
        first.unlink()
        first.symlink_to(precious)
        self.assert_ran(ygslam(*how))
        self.assertEqual(precious.read_text(encoding="utf-8"), "precious")
        self.assertFalse(first.is_symlink())

    def test_a_rendering_does_not_replace_a_recording(self):
        folder = self.copy_sequence()
        before = contents(folder)
        done = ygslam("simulate", "static_xyz", "--out", folder, "--size", "160x120", "--seconds", "0.1",
                      "--quiet")
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertRegex(done.stderr, rf"\Aerror: {folder}: holds a recording")
        self.assertEqual(contents(folder), before)

    def test_the_folders_of_a_recording_take_no_results(self):
        folder = self.copy_sequence("recording", frames=12)
        before = sorted(folder.rglob("*"))
        for options, out in (((), folder / "rgb"), (("--export", folder / "depth"), "x"),
                             (("--segmenter", f"masks:{folder}/mask"), folder / "mask")):
            done = self.run_slam(folder, *options, out=out)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertRegex(done.stderr, r"\Aerror: [^\n]*(is of the recording that is read|is read \(--segm)[^\n]*\n\Z")
        self.assertEqual(sorted(folder.rglob("*")), before)
        self.assert_ran(self.run_slam(folder, out=folder / "results"))

    def test_a_map_is_no_file_of_the_runs_own(self):
        for name in FILES:
            for option in ("--save-map", "--mcap"):
                target = self.folder / "out" / name
                self.assert_error(self.run_slam(sequence(), "--to", 8, option, target), 2, target, option)

    def test_the_log_of_a_sweep_is_continued_unless_it_is_a_link(self):
        precious = self.folder / "precious"
        precious.write_text("precious", encoding="utf-8")
        out = self.folder / "sweep"
        out.mkdir()
        (out / "log.txt").symlink_to(precious)
        how = ("--modes", "off", "--runs", 1, "--no-report", "--deterministic")
        folder = self.copy_sequence(frames=12)
        self.assert_ran(ygslam("bench", folder, "--out", out, *how))
        self.assertEqual(precious.read_text(encoding="utf-8"), "precious")
        first = (out / "log.txt").read_text(encoding="utf-8")
        self.assertIn("1 sequences", first)
        self.assert_ran(ygslam("bench", folder, "--out", out, *how))
        self.assertTrue((out / "log.txt").read_text(encoding="utf-8").startswith(first))

    def test_a_locked_folder_that_is_a_link_is_refused(self):
        out = self.folder / "out"
        out.mkdir()
        (out / ".lock").symlink_to(self.folder / "elsewhere")
        done = self.run_slam(sequence(), "--quiet")
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertFalse((self.folder / "elsewhere").exists())


class Memory(CliTest):
    """What does not fit into memory is told, in one line, with a code of its own: no signal, no
    hang, whatever the limit."""

    LIMITS = {"data": resource.RLIMIT_DATA, "addresses": resource.RLIMIT_AS}

    def start(self, kind, limit_mb, arguments):
        limit = limit_mb << 20
        done = ygslam(*arguments, timeout=60, preexec_fn=lambda: resource.setrlimit(
            self.LIMITS[kind], (limit, limit)))
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        return done

    def sweep(self, *arguments):
        """Every limit ends with code 0 or 1 and nothing but the one line."""
        arguments = (*arguments, "--out", self.folder / "out", "--quiet")
        for kind, step_mb in (("data", 3), ("addresses", 6)):
            # Below 8 MB of data, and of addresses below what program and libraries take, the
            # kernel, the loader and the libraries give up before the program begins.
            limit_mb = max(8, (os.stat(BINARY).st_size >> 20) + 2)
            while "shared libraries" in self.start(kind, limit_mb, arguments).stderr:
                limit_mb += 4
            refused = fine = 0
            while fine < 3:
                done = self.start(kind, limit_mb, arguments)
                ends = (done.returncode, done.stdout, done.stderr)
                self.assertIn(ends, ((0, "", ""), (1, "", "error: out of memory\n")),
                              f"{limit_mb} MB of {kind}")
                fine += done.returncode == 0
                refused += done.returncode == 1
                limit_mb += step_mb
            self.assertGreater(refused, 3, f"{kind}: the limits were too high to test anything")

    def test_of_a_run(self):
        self.sweep("run", sequence(), "--to", 8, "--dynamic", "geometry", "--deterministic")

    def test_of_a_live_run_with_masks(self):
        self.sweep("run", sequence(), "--to", 8, "--segmenter", f"masks:{sequence() / 'mask'}")

    def test_of_a_rendering(self):
        self.sweep("simulate", "moving_box", "--size", "160x120", "--seconds", "0.1", "--truth",
                   "--threads", 2)


if __name__ == "__main__":
    unittest.main(verbosity=2)
