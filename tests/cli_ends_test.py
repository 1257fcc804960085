"""What others do to a run's ends: readers that leave, closed streams, links, names that steer terminals,
two options for one file."""
import os
import pathlib
import shutil
import subprocess
import unittest

from ygslam_cli import BINARY, FILES, HANG_S, CliTest, contents, sequence, ygslam

READER_LEFT = 141
# Escape, C1's CSI, right-to-left override, and a byte that is no UTF-8.
EVIL = b"a\x1b[2J\xc2\x9b2J\xe2\x80\xaetxt.\xff"
EVIL_SHOWN = r"a\x1b[2J\u009b2J\u202etxt.\xff"


def broken_pipe():
    """The writing end of a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    return writing


class EndsTest(CliTest):
    def start(self, *arguments, broken=(), closed=(), **how):
        """A finished run, some of whose standard streams (1, 2) have no reader or (0, 1, 2) are closed."""
        streams = {name: broken_pipe() if number in broken else subprocess.PIPE
                   for name, number in (("stdout", 1), ("stderr", 2))}
        command = [BINARY, *map(str, arguments)]
        if closed:
            command = ["bash", "-c", '"$@" ' + " ".join(f"{n}>&-" for n in closed), "bash", *command]
        try:
            # As a shell starts programs: Python itself ignores the signal.
            return subprocess.run(command, **streams, check=False, timeout=HANG_S, restore_signals=True,
                                  text=True, errors="replace", **how)
        finally:
            for stream in streams.values():
                if stream != subprocess.PIPE:
                    os.close(stream)


class Readers(EndsTest):
    """A reader of standard error or output that left."""

    def test_a_run_goes_on_and_writes_everything(self):
        for broken in ((1,), (2,), (1, 2)):
            shutil.rmtree(self.folder / "out", ignore_errors=True)
            done = self.start("run", sequence(), "--out", self.folder / "out", "--dynamic", "geometry", "--to",
                              12, "-v", broken=broken)
            self.assertEqual(done.returncode, 0, (broken, done.stderr))
            self.assert_sound()
            self.assertIn("frame 11: ", self.log())

    def test_other_commands_that_write_files_go_on_too(self):
        world, room = self.folder / "world", self.folder / "room.map"
        self.assert_ran(self.run_slam(sequence(), "--to", 8, "--save-map", room))
        for made, command in (
                (world / "simulation.json", ("simulate", "static_xyz", "--out", world, "--size", "160x120",
                                             "--seconds", "0.1", "-v")),
                (self.folder / "scene/mesh.ply", ("export", room, "--out", self.folder / "scene")),
                (self.folder / "cloud.ply", ("map", "export", room, "-o", self.folder / "cloud.ply")),
                (self.folder / "new.map", ("map", "recover", room, "-o", self.folder / "new.map")),
                (self.folder / "localized/trajectory.txt", ("localize", sequence(), "--map", room, "--to", 4,
                                                            "--out", self.folder / "localized", "--dynamic",
                                                            "off")),
                (self.folder / "scene.png", ("render", self.folder / "scene", "--out",
                                             self.folder / "scene.png"))):
            done = self.start(*command, broken=(1, 2))
            self.assertEqual(done.returncode, 0, command)
            self.assertTrue(made.is_file(), command)

    def test_a_product_that_nobody_reads_ends_quietly_with_a_code_of_its_own(self):
        truth = sequence() / "groundtruth.txt"
        errors = self.folder / "errors.csv"
        for command in (("config",), ("--help",), ("run", "--help"), ("simulate", "--list"),
                        ("completion", "bash"),
                        ("eval", "--gt", truth, "--est", truth, "--errors", errors)):
            done = self.start(*command, broken=(1,))
            self.assertEqual((done.returncode, done.stderr), (READER_LEFT, ""), command)
        self.assertTrue(errors.is_file())
        # The errors of a command are its own, whoever reads them.
        self.assertEqual(self.start("map", "info", truth, broken=(1, 2)).returncode, 6)
        self.assertEqual(self.start("bogus", broken=(1, 2)).returncode, 2)

    def test_a_sweep_goes_on(self):
        folder = self.copy_sequence(frames=6)
        done = self.start("bench", folder, "--out", self.folder / "sweep", "--modes", "off", "--runs", 1,
                          "--no-report", "--deterministic", broken=(1, 2))
        self.assertEqual(done.returncode, 0)
        self.assertTrue((self.folder / "sweep" / "sweep.json").is_file())


class ClosedStreams(EndsTest):
    """Standard streams that are closed from the start: no file gets their numbers."""

    def test_what_a_run_writes_is_what_it_writes_always(self):
        how = ("--dynamic", "geometry", "--deterministic", "--to", 12, "-v", "--out")
        self.assert_ran(self.start("run", sequence(), *how, self.folder / "plain"))
        plain = contents(self.folder / "plain")
        for closed in ((0, 1, 2), (1,), (2,), (0, 2)):
            shutil.rmtree(self.folder / "out", ignore_errors=True)
            done = self.start("run", sequence(), *how, self.folder / "out", closed=closed)
            self.assertEqual(done.returncode, 0, (closed, done.stderr))
            now = contents(self.folder / "out")
            for name in FILES - {"metrics.json", "log.txt"}:
                self.assertEqual(now[name], plain[name], (closed, name))

    def test_a_product_without_a_place_is_an_error(self):
        done = self.start("config", closed=(1,))
        self.assertEqual((done.returncode, done.stderr), (9, "error: standard output could not be written\n"))

    def test_a_stream_from_nowhere_is_an_error(self):
        done = self.start("run", "-", "--out", self.folder / "out", "--dynamic", "geometry", closed=(0,))
        self.assert_error(done, 4, "standard input")


class TwoUses(EndsTest):
    """No file is written twice, or read and written, by whatever name: told before anything is written."""

    def assert_refused(self, before, *arguments, names=()):
        done = ygslam(*arguments)
        self.assertEqual((done.returncode, done.stdout), (2, ""), (arguments, done.stderr))
        self.assertRegex(done.stderr, r"\Aerror: [^\n]+\n\Z")
        for name in names:
            self.assertIn(str(name), done.stderr)
        self.assertEqual(self.everything(), before, arguments)

    def everything(self):
        return {path: path.read_bytes() if path.is_file() else b"" for path in self.folder.rglob("*")}

    def test_of_outputs_of_a_run(self):
        a, out = self.folder / "a.map", self.folder / "out"
        (self.folder / "link").symlink_to(self.folder)
        (self.folder / "there").mkdir()
        dots = f"{self.folder}/there/../a.map"
        before = self.everything()
        pairs = [(("--save-map", a), ("--mcap", f"{other}{ending}"))
                 for ending in ("", ".dense", "-wal", "-shm", "-journal", ".lock")
                 for other in (a, self.folder / "link" / "a.map", f"{self.folder}/./a.map", dots)]
        pairs += [((option, out / name), ()) for option in ("--mcap", "--trace")
                  for name in (*FILES, ".lock")]
        pairs += [(("--trace", self.folder / "run"), ("--mcap", self.folder / "run"))]
        pairs += [(("--mcap", out), ()), (("--save-map", f"{out}/"), ()),
                  (("--mcap", out / "trajectory.txt" / "run.mcap"), ()),
                  (("--export", self.folder / "x"), ("--mcap", self.folder / "x" / "mesh.ply")),
                  (("--export", self.folder / "x"), ("--save-map", self.folder / "x")),
                  (("--debug-images", self.folder / "x"), ("--mcap", self.folder / "x" / "frame_000001.jpg")),
                  (("--save-masks", self.folder / "x" / "rgb"), ("--background", self.folder / "x")),
                  (("--save-masks", self.folder / "x"), ("--save-map", self.folder / "x" / "instances.json"))]
        for one, other in pairs:
            self.assert_refused(before, "run", sequence(), "--out", out, "--dynamic", "geometry", *one, *other,
                                names=(one[0], *other[:1]))

    def test_of_a_hard_link(self):
        old, again = self.folder / "old.mcap", self.folder / "again"
        self.assert_ran(self.run_slam(sequence(), "--to", 3, "--mcap", old))
        os.link(old, again)
        before = self.everything()
        self.assert_refused(before, "run", sequence(), "--out", self.folder / "out", "--dynamic", "geometry",
                            "--mcap", old, "--save-map", again, names=("--mcap", "--save-map"))

    def test_folders_that_can_be_shared_are(self):
        out = self.folder / "out"
        done = self.run_slam(sequence(), "--to", 4, "--export", out, "--save-map", out / "room.map", "--mcap",
                             out / "run.mcap", "--debug-images", out, "--save-masks", out)
        self.assert_ran(done)
        for name in (*FILES, "mesh.ply", "room.map", "room.map.dense", "run.mcap", "frame_000000.jpg"):
            self.assertTrue((out / name).is_file(), name)

    def test_of_inputs_of_a_run(self):
        folder = self.copy_sequence(frames=4)
        room = self.folder / "room.map"
        self.assert_ran(self.run_slam(folder, "--save-map", room))
        shutil.rmtree(self.folder / "out")
        stamp = self.pairs(folder)[0][0]
        before = self.everything()
        masks = ("--segmenter", f"masks:{folder / 'mask'}")
        for options in (("--debug-images", folder / "rgb"), ("--mcap", folder / self.pairs(folder)[1][1]),
                        ("--save-map", folder / "rgb.txt"), ("--mcap", folder / "groundtruth.txt"),
                        ("--trace", folder / "rgb.txt"),
                        (*masks, "--mcap", folder / "mask" / f"{stamp}.png"),
                        ("--load-map", room, "--mcap", f"{room}.dense"),
                        ("--load-map", room, "--save-map", f"{room}-wal")):
            self.assert_refused(before, "run", folder, "--out", self.folder / "out", *options,
                                names=(options[-2], "is "))
        self.assert_refused(before, "localize", folder, "--map", room, "--out", self.folder / "out", "--mcap",
                            f"{room}.lock", names=("--mcap", "--map"))
        # A map that goes on in its own file is no such case.
        self.assert_ran(self.run_slam(folder, "--load-map", room, "--save-map", room))

    def test_of_the_recording_itself(self):
        folder = self.copy_sequence(frames=4)
        linked = self.folder / "linked"
        linked.symlink_to(folder)
        before = self.everything()
        for out in (folder, linked):
            self.assert_refused(before, "run", folder, "--segmenter", "none", "--out", out)

    def test_of_other_commands(self):
        folder = self.copy_sequence(frames=4)
        room, scene = self.folder / "mesh.ply", self.folder / "scene"
        truth = folder / "groundtruth.txt"
        self.assert_ran(self.run_slam(folder, "--save-map", room, "--export", scene))
        shutil.copyfile(truth, self.folder / "way.png")
        world = self.folder / "world"
        before = self.everything()
        for command in (
                ("export", room, "--out", self.folder),
                ("map", "recover", room, "-o", f"{room}.dense"),
                ("inspect", folder, "--segmenter", "none", "--out", folder / "rgb"),
                ("calibrate", folder, "--write", folder / "calibration.txt"),
                ("calibrate", folder, "--write", folder / self.pairs(folder)[0][1]),
                ("eval", "--gt", truth, "--est", truth, "--errors", truth),
                ("eval", "--gt", truth, "--est", truth, "--errors", self.folder / "x.svg", "--plot",
                 self.folder / "x.svg"),
                ("render", scene, "--out", self.folder / "way.png", "--path", self.folder / "way.png"),
                ("simulate", "static_xyz", "--out", world, "--mcap", world / "rgb.txt"),
                ("simulate", "static_xyz", "--out", world, "--mcap", world / "rgb" / "1.000000.jpg"),
                ("simulate", "static_xyz", "--out", world, "--mcap", world)):
            self.assert_refused(before, *command)


class InnerLinks(EndsTest):
    """What the user names as an output may be a link; what lies below an output folder may not."""

    def test_a_recording_goes_where_the_link_leads(self):
        real, link = self.folder / "real.mcap", self.folder / "link.mcap"
        self.assert_ran(self.run_slam(sequence(), "--to", 3, "--mcap", real))
        other_name = self.folder / "other.mcap"
        os.link(real, other_name)
        before = real.read_bytes()
        link.symlink_to(real)
        self.assert_ran(self.run_slam(sequence(), "--to", 5, "--mcap", link))
        self.assertTrue(link.is_symlink())
        self.assertGreater(real.stat().st_size, len(before))
        self.assertEqual(other_name.read_bytes(), before, "who has it under another name keeps it")
        link.unlink()
        link.symlink_to(self.folder / "nowhere")
        self.assert_error(self.run_slam(sequence(), "--to", 3, "--mcap", link, out="new"), 9,
                          f"{link}: is a link to nowhere", out="new")
        self.assertFalse((self.folder / "nowhere").exists())

    def test_no_folder_below_an_output_folder_is_followed(self):
        outside = self.folder / "outside"
        outside.mkdir()
        (outside / "precious").write_text("precious", encoding="utf-8")
        simulate = ("simulate", "static_xyz", "--size", "160x120", "--seconds", "0.1", "--quiet")
        for name, command in (("rgb", simulate), ("depth", simulate), ("mask", (*simulate, "--truth"))):
            out = self.folder / f"with_{name}"
            out.mkdir()
            (out / name).symlink_to(outside)
            self.assert_error(ygslam(*command, "--out", out), 9, f"{out / name}: is a link", out=out.name,
                              left=[name])
        back = self.folder / "back"
        back.mkdir()
        (back / "source").symlink_to(outside)
        self.assert_error(self.run_slam(sequence(), "--to", 3, "--background", back), 9,
                          f"{back / 'source'}: is a link")
        sweep = self.folder / "sweep"
        sweep.mkdir()
        (sweep / "runs").symlink_to(outside)
        done = ygslam("bench", self.copy_sequence(frames=3), "--out", sweep, "--modes", "off", "--runs", 1,
                      "--no-report", "--deterministic")
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertIn(f"{sweep / 'runs'}: is a link", done.stderr)
        self.assertEqual([path.name for path in outside.iterdir()], ["precious"])

    def test_a_link_to_nowhere_that_was_there_stays(self):
        link = self.folder / "out"
        link.symlink_to(self.folder / "nowhere")
        done = self.run_slam(sequence(), "--to", 3, "--quiet")
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertTrue(link.is_symlink())

    def test_the_output_folder_itself_may_be_a_link(self):
        real = self.folder / "real"
        real.mkdir()
        (self.folder / "out").symlink_to(real)
        self.assert_ran(self.run_slam(sequence(), "--to", 3))
        self.assert_sound("real")


class Shown(EndsTest):
    """Names that others gave are shown so that they can do nothing to a terminal."""

    def assert_harmless(self, *outputs):
        for output in outputs:
            for evil in (b"\x1b", b"\xc2\x9b", b"\xe2\x80\xae", b"\xff"):
                self.assertNotIn(evil, output)

    def run_raw(self, *arguments):
        return subprocess.run([os.fsencode(word) if isinstance(word, os.PathLike) else
                               word if isinstance(word, bytes) else str(word).encode()
                               for word in (BINARY, *arguments)], capture_output=True, check=False,
                              timeout=HANG_S)

    def test_in_errors_logs_and_results(self):
        evil = os.fsencode(self.folder) + b"/" + EVIL
        shown = EVIL_SHOWN.encode()
        os.rename(os.fsencode(self.copy_sequence(frames=4)), evil)
        room = evil + b".map"
        done = self.run_raw("run", evil, "--out", evil + b"out", "--dynamic", "geometry", "--save-map", room,
                            "-v")
        self.assertEqual(done.returncode, 0, done.stderr)
        log = pathlib.Path(os.fsdecode(evil + b"out/log.txt")).read_bytes()
        self.assert_harmless(done.stdout, done.stderr, log)
        for output in (done.stdout, done.stderr, log):
            self.assertIn(shown, output)
        truth = evil + b"/groundtruth.txt"
        for command, code in ((("eval", "--gt", truth, "--est", truth), 0),
                              (("eval", "--gt", truth, "--est", truth, truth), 0),
                              (("eval", "--gt", truth, "--est", evil + b"none"), 4),
                              (("map", "check", room), 0), (("map", "info", evil), 6),
                              (("map", "export", room, "-o", evil + b".ply"), 0),
                              (("bench", evil, "--out", evil + b"sweep", "--modes", "off", "--runs", 1,
                                "--no-report", "--deterministic"), 0),
                              (("run", evil, "--out", b"x", EVIL), 2)):
            done = self.run_raw(*command)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assert_harmless(done.stdout, done.stderr)
            self.assertIn(shown, done.stdout + done.stderr, command)

    def test_a_name_stays_on_its_line(self):
        folder = self.folder / "two\nerror: lines"
        folder.mkdir()
        done = ygslam("run", folder, "--out", self.folder / "out")
        self.assertEqual(done.returncode, 4)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(r"two\nerror: lines", done.stderr)

    def test_in_json_it_is_what_it_is(self):
        truth = self.folder / "a\u202eb\u009b.txt"
        shutil.copyfile(sequence() / "groundtruth.txt", truth)
        done = self.run_raw("eval", "--gt", truth, "--est", truth, "--json")
        self.assert_harmless(done.stdout, done.stderr)
        self.assertIn(rb"a\u202eb\u009b.txt", done.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
