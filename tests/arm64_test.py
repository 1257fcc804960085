"""The program, package and wheel for 64-bit ARM under QEMU, beside this machine's program; the last step of `make arm64`.

    .venv/bin/python tests/arm64_test.py --reference build/release/ygslam
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
ARM_ROOT = ROOT / ".venv" / "arm64-root"
EMULATED = ROOT / "build" / "arm64" / "emulated" / "ygslam"
LIMIT_S = 3000
REFERENCE = None
FIRST_FRAMES = """
import sys, ygslam
recording = ygslam.open(sys.argv[1])
with ygslam.Slam(recording.camera, segmenter="builtin") as slam:
    for _, frame in zip(range(3), recording):
        print(slam.process(frame.rgb, frame.depth, frame.t_ns).state.name)
"""


def call(*command, **how):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False, timeout=LIMIT_S, **how)
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def emulator():
    """The command that `emulated/ygslam` begins with."""
    return re.findall(r"'([^']*)'", EMULATED.read_text(encoding="utf-8"))[:-1]


def rows(path):
    return [list(map(float, line.split())) for line in path.read_text(encoding="utf-8").splitlines() if line[:1] != "#"]


class Arm(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="ygslam-arm64-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)


class Worlds(Arm):
    """A seed is one world on both: `simulate` draws in one order."""

    def test_a_seed_gives_the_same_world(self):
        for name, options in (("walk", ("walking_xyz", "--seconds", "0.2", "--imu", "BMI085", "--format", "png")),
                              ("random", ("--random", "3",))):
            with self.subTest(name):
                ours, theirs = self.folder / f"{name}.arm", self.folder / f"{name}.here"
                for program, out in ((EMULATED, ours), (REFERENCE, theirs)):
                    call(program, "simulate", *options, "--out", out, "--size", "160x120", "--threads", 1)
                self.alike(ours, theirs)

    def alike(self, ours, theirs):
        names = sorted(path.relative_to(theirs) for path in theirs.rglob("*") if path.is_file())
        self.assertEqual(names, sorted(path.relative_to(ours) for path in ours.rglob("*") if path.is_file()))
        images = [name for name in names if name.suffix in (".png", ".jpg")]
        self.assertGreater(len(images), 3)
        for name in images:
            self.assertLess(self.mean_difference(ours / name, theirs / name), 0.01, name)
        for name in (name for name in names if name.suffix in (".txt", ".csv")):
            self.same_numbers(ours / name, theirs / name)

    def same_numbers(self, ours, theirs):
        """Apart from what both round differently."""
        words = [re.split(r"[\s,]+", path.read_text("utf-8")) for path in (ours, theirs)]
        self.assertEqual(len(words[0]), len(words[1]), theirs.name)
        for a, b in zip(*words):
            if a != b:
                self.assertAlmostEqual(float(a), float(b), delta=2e-6 * max(1, abs(float(b))), msg=theirs.name)

    @staticmethod
    def mean_difference(a, b):
        """Relative to the image's own mean."""
        import numpy as np
        from PIL import Image
        x, y = (np.asarray(Image.open(path), dtype=float) for path in (a, b))
        return abs(x - y).mean() / max(y.mean(), 1)


class Runs(Arm):
    """The same recording, run by both."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.sequence = cls.folder / "walk"
        call(REFERENCE, "simulate", "walking_xyz", "--out", cls.sequence, "--size", "320x240", "--seconds", 3, "--threads", 1)

    def both(self, mode, *options, folders=()):
        """The ATE [m] of each, ours first, and how far poses are from each other [m]; masks go into the folders."""
        ate, poses = [], []
        for i, (label, program) in enumerate((("arm", EMULATED), ("here", REFERENCE))):
            out = self.folder / f"{mode}.{label}"
            kept = ("--save-masks", folders[i]) if folders else ()
            call(program, "run", self.sequence, "--out", out, "--deterministic", "--dynamic", mode, *options, *kept)
            report = call(program, "eval", "--gt", self.sequence / "groundtruth.txt", "--est", out / "trajectory.txt", "--json")
            ate.append(json.loads(report)["ate"]["rmse"])
            poses.append(rows(out / "trajectory.txt"))
        self.assertEqual(len(poses[0]), len(poses[1]))
        apart = max(sum((a - b) ** 2 for a, b in zip(p[1:4], q[1:4])) ** 0.5 for p, q in zip(*poses))
        print(f"{mode}: ATE {1000 * ate[0]:.3f} mm on ARM, {1000 * ate[1]:.3f} here; poses at most {1000 * apart:.3f} mm apart")
        return ate, apart

    def test_the_error_is_the_same(self):
        masks = [self.folder / name for name in ("masks.arm", "masks.here")]
        exact = ("--set", "segment.precision=f32")  # `auto` is bf16 where a processor has it
        for mode, options in (("off", ()), ("geometry", ()), ("full", exact)):
            with self.subTest(mode):
                (ours, here), _ = self.both(mode, *options, folders=masks if mode == "full" else ())
                self.assertLess(abs(ours - here), 0.01 * here)
        overlap = self.overlap(*masks)
        print(f"people on ARM and here: IoU {overlap:.5f}")
        self.assertGreater(overlap, 0.99)

    def overlap(self, ours, theirs):
        """Of the people in the masks of both."""
        import numpy as np
        from PIL import Image
        names = sorted(path.name for path in theirs.glob("*.png"))
        self.assertGreater(len(names), 10)
        a, b = (np.stack([np.asarray(Image.open(folder / name)) > 0 for name in names]) for folder in (ours, theirs))
        self.assertGreater(b.sum(), 1000 * len(names))
        return (a & b).sum() / (a | b).sum()

    def test_maps_and_exports_are_made(self):
        saved, out = self.folder / "room.ygm", self.folder / "mapped"
        call(EMULATED, "run", self.sequence, "--out", out, "--to", 15, "--deterministic", "--dynamic", "geometry",
             "--save-map", saved, "--export", self.folder / "scene")
        self.assertIn("keyframes", call(EMULATED, "map", "info", saved))
        self.assertIn("keyframes", call(REFERENCE, "map", "info", saved))
        self.assertTrue(any((self.folder / "scene").iterdir()))


class Files(Arm):
    """What is handed to users."""

    def test_the_package_has_the_program_and_says_what_it_needs(self):
        deb, = (ROOT / "dist").glob("ygslam_*_arm64.deb")
        fields = dict(re.findall(r"(?m)^ ?([\w-]+): (.*)", call("dpkg-deb", "-I", deb)))
        self.assertEqual(fields["Architecture"], "arm64")
        records = (ARM_ROOT / "var" / "lib" / "dpkg" / "status").read_text(encoding="utf-8")
        known = {name for row in re.findall(r"(?m)^(?:Package|Provides): (.*)", records)
                 for name in re.findall(r"(?:^|, )([\w.+-]+)", row)}
        needed = [re.split(r"[ (|]", part.strip())[0] for part in fields["Depends"].split(",")]
        self.assertGreater(len(needed), 8)
        for package in needed:
            self.assertIn(package, known)
        call("dpkg-deb", "-x", deb, self.folder / "package")
        files = {path.relative_to(self.folder / "package").as_posix() for path in (self.folder / "package").rglob("*")}
        for file in ("usr/bin/ygslam", "usr/share/man/man1/ygslam.1.gz", "usr/lib/ygslam/libopenvino_arm_cpu_plugin.so",
                     "usr/share/bash-completion/completions/ygslam", "usr/share/doc/ygslam/LICENSE"):
            self.assertIn(file, files)
        self.assertEqual(call(*emulator(), self.folder / "package" / "usr" / "bin" / "ygslam", "--version"),
                         call(REFERENCE, "--version"))

    def test_the_wheel_brings_what_it_needs(self):
        wheel = max((ROOT / "dist").glob("ygslam-*_aarch64.whl"), key=lambda path: path.stat().st_mtime)
        self.assertRegex(wheel.name, r"^ygslam-[\d.]+-cp311-cp311-manylinux_2_3\d_aarch64\.whl$")
        place = self.folder / "installed"
        platforms = [word for glibc in (28, 31, 34, 35, 36) for word in ("--platform", f"manylinux_2_{glibc}_aarch64")]
        call(sys.executable, "-m", "pip", "install", "--quiet", "--only-binary=:all:", "--python-version", "3.11",
             *platforms, "--target", place, wheel)
        machines = {path.name: call("readelf", "-h", path) for path in (place / "ygslam.libs").iterdir()}
        self.assertGreater(len(machines), 10)
        for name, header in machines.items():
            self.assertIn("AArch64", header, name)
        self.assertFalse([name for name in machines if name.startswith(("libopenvino", "libtbb"))])
        call(REFERENCE, "simulate", "walking_xyz", "--out", self.folder / "short", "--size", "320x240", "--seconds", 0.2)
        told = call(ARM_ROOT / "python3", "-c", FIRST_FRAMES, self.folder / "short",
                    env={**os.environ, "PYTHONPATH": str(place)})
        self.assertEqual(told, "TRACKING\n" * 3)
        self.assertEqual(call(*emulator(), place / "ygslam" / "ygslam", "--version"), call(REFERENCE, "--version"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reference", required=True, help="this machine's program of the same sources")
    known, rest = parser.parse_known_args()
    REFERENCE = pathlib.Path(known.reference).resolve()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
