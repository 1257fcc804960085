"""The installed library: complete, found by find_package, and independent of where it was built.

    python tests/install_test.py --build build/release

Installs the build to a temporary place, builds examples/minimal from a copy against it and runs it
and the command line with the build, the source tree and the Python environment out of sight.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = None
CLEAN = {"PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": "/nonexistent", "LC_ALL": "C"}


def call(*command, **how):
    how = {"env": CLEAN, "timeout": 600, **how}
    return subprocess.run([str(part) for part in command], capture_output=True, text=True,
                          check=False, errors="replace", **how)


def can_hide():
    """Whether this process may cover folders with empty ones of its own."""
    try:
        return os.geteuid() == 0 and call("unshare", "-m", "true").returncode == 0
    except FileNotFoundError:
        return False


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="ygslam install ")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        # Installed in one place and moved to another, as a package is.
        first, cls.prefix = cls.folder / "first", cls.folder / "prefix"
        done = call("cmake", "--install", BUILD, "--prefix", first)
        assert done.returncode == 0, done.stderr
        first.rename(cls.prefix)
        shutil.copytree(ROOT / "examples" / "minimal", cls.folder / "example")
        done = call("cmake", "-S", cls.folder / "example", "-B", cls.folder / "build",
                    f"-DCMAKE_PREFIX_PATH={cls.prefix}", "-DCMAKE_BUILD_TYPE=Release")
        assert done.returncode == 0, done.stdout + done.stderr
        done = call("cmake", "--build", cls.folder / "build")
        assert done.returncode == 0, done.stdout + done.stderr
        cls.example = cls.folder / "build" / "example"
        done = call("cmake", "-S", ROOT / "examples" / "camera_stream", "-B", cls.folder / "camera",
                    f"-DCMAKE_PREFIX_PATH={cls.prefix}")
        assert done.returncode == 0, done.stdout + done.stderr
        done = call("cmake", "--build", cls.folder / "camera")
        assert done.returncode == 0, done.stdout + done.stderr
        cls.program = cls.prefix / "bin" / "ygslam"

    def hidden(self, *command):
        """A command run where source tree, build and Python environment are empty folders."""
        if not can_hide():
            return call(*command, cwd=self.folder)
        empty = self.folder / "empty"
        empty.mkdir(exist_ok=True)
        away = [str(p) for p in {ROOT, BUILD, (ROOT / ".venv").resolve()} if p.is_dir()]
        cover = " && ".join(f'{{ [ ! -d "{p}" ] || mount --bind "{empty}" "{p}"; }}'
                            for p in sorted(away))
        return call("unshare", "-m", "bash", "-c", f'{cover} && exec "$@"', "bash", *command,
                    cwd=self.folder)

    def test_the_hiding_itself_works(self):
        if not can_hide():
            print("skipped: only root may hide folders; the libraries' paths are checked instead")
            return
        done = self.hidden("ls", "-A", ROOT)
        self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)

    def test_the_licences_of_what_is_passed_on_come_along(self):
        texts = list(self.prefix.glob("share/doc/ygslam/**/LICENSE"))
        self.assertGreaterEqual(len(texts), 2, "ours and OpenVINO's")
        self.assertTrue(list(self.prefix.glob("share/doc/ygslam/**/*third-party*")))

    def test_libraries_come_from_the_installation_or_the_system(self):
        for binary in (self.example, self.program, *self.prefix.glob("lib*/**/*.so*")):
            if binary.is_symlink():
                continue
            done = call("ldd", binary)
            self.assertNotIn("not found", done.stdout, binary)
            found = re.findall(r"=> (/.*) \(0x", done.stdout)
            away = [lib for lib in found
                    if not lib.startswith((str(self.prefix), "/lib", "/usr/lib"))]
            self.assertEqual(away, [], binary)

    def test_no_file_names_the_place_of_the_build(self):
        places = [str(BUILD).encode(), str(ROOT / ".venv").encode()]
        for path in self.prefix.rglob("*"):
            if path.suffix in (".cmake", ".hpp", ".xml") and path.is_file():
                for place in places:
                    self.assertNotIn(place, path.read_bytes(), path)
        for binary in (self.example, self.program, *self.prefix.glob("lib*/libygslam*.so*")):
            done = call("readelf", "-d", binary)
            for line in done.stdout.splitlines():
                if "RUNPATH" in line or "RPATH" in line:
                    self.assertNotIn(str(ROOT), line, binary)
                    self.assertNotIn(str(BUILD), line, binary)

    def test_the_facade_shows_nothing_but_itself(self):
        library, = (p for p in self.prefix.glob("lib*/libygslam.so*") if not p.is_symlink())
        done = call("nm", "-DC", "--defined-only", library)
        names = [line.split(maxsplit=2)[2] for line in done.stdout.splitlines()]
        self.assertTrue(any(name.startswith("ygslam::api::Slam::process") for name in names))
        inner = [name for name in names if re.search(r"\bygslam::(?!api\b)\w", name)
                 and not name.startswith(("ygslam::api::", "typeinfo", "vtable", "std::"))]
        self.assertEqual(inner[:5], [])

    def test_the_example_runs_with_everything_else_out_of_sight(self):
        done = self.hidden(self.example)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = re.findall(r"x (-?\d+\.\d+)\s+y (-?\d+\.\d+)\s+z (-?\d+\.\d+) m\s+(\d+) inliers",
                          done.stdout)
        self.assertEqual(len(rows), 30, done.stdout)
        # 2 px a frame at 525 px and 2 m: the wall goes left, so the camera goes right.
        self.assertAlmostEqual(float(rows[-1][0]), 29 * 2 * 2.0 / 525, delta=0.02)
        self.assertLess(abs(float(rows[-1][1])) + abs(float(rows[-1][2])), 0.03)
        self.assertRegex(done.stdout, r"map: [1-9]\d{2,} points")

    def test_the_network_runs_from_the_installation(self):
        shared = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared")).resolve()
        model = shared / "models" / "yolov8n-seg_480x640.onnx"
        if not model.exists():
            self.skipTest(f"no model at {model}")
        shutil.copyfile(model, self.folder / "model.onnx")
        done = self.hidden(self.example, self.folder / "model.onnx")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("29  x ", done.stdout)

    def test_a_missing_model_is_an_error_of_the_library(self):
        done = self.hidden(self.example, "none.onnx")
        self.assertEqual(done.returncode, 5, done.stderr)
        self.assertIn("none.onnx", done.stderr)

    def test_the_command_line_runs_with_everything_else_out_of_sight(self):
        done = self.hidden(self.program, "--version")
        self.assertEqual(done.returncode, 0, done.stderr)
        out = self.folder / "sequence"
        done = self.hidden(self.program, "simulate", "static_xyz", "--out", out, "--size",
                           "320x240", "--seconds", "0.4", "--threads", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.hidden(self.program, "run", out, "--out", self.folder / "out", "--dynamic",
                           "geometry")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.folder / "out" / "map.ply").exists())

    def test_a_camera_is_piped_into_it(self):
        done = self.hidden("bash", "-c", '"$0" 0.5 | "$1" run - --out "$2" --dynamic geometry',
                           self.folder / "camera" / "camera_stream", self.program,
                           self.folder / "camera_out")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("15 frames, 100.0 % tracked", done.stdout)
        done = call("ldd", self.folder / "camera" / "camera_stream")
        self.assertNotIn("ygslam", done.stdout)

    def test_the_python_tools_are_found_beside_the_program(self):
        tools = self.prefix / "share" / "ygslam" / "report"
        self.assertTrue((tools / "eval_plot.py").exists())
        self.assertEqual(list(tools.rglob("__pycache__")), [])
        poses = self.folder / "poses.txt"
        poses.write_text("".join(f"{i} {0.1 * i} {i % 3} 0 0 0 0 1\n" for i in range(9)))
        plot = self.folder / "plot.svg"
        command = (self.program, "eval", "--gt", poses, "--est", poses, "--plot", plot)
        done = call(*command, env={**CLEAN, "YGSLAM_PYTHON": sys.executable})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(plot.read_bytes().startswith(b"<?xml"))
        plot.unlink()
        done = call(*command, env={**CLEAN, "YGSLAM_PYTHON": "/nonexistent/python"})
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertRegex(done.stderr, r"\Aerror: [^\n]*plot.svg[^\n]*/nonexistent/python[^\n]*\n\Z")
        self.assertFalse(plot.exists())

    def test_what_make_demo_left_unbuilt_is_built_first(self):
        """`make demo` builds the program alone. In a copy of the build folder that only this process sees."""
        (self.folder / "upper").mkdir()
        script = ('mount -t tmpfs none "$1/upper" && mkdir "$1/upper/up" "$1/upper/work" && mount -t overlay none '
                  '-o "lowerdir=$0,upperdir=$1/upper/up,workdir=$1/upper/work" "$0" || exit 77; '
                  'rm "$0"/src/facade/libygslam.so*; cmake --install "$0" --prefix "$2"')
        done = call("unshare", "-m", "bash", "-c", script, BUILD, self.folder, self.folder / "late",
                    env={**CLEAN, "PATH": os.environ["PATH"], "HOME": os.environ.get("HOME", "/")})
        if done.returncode in (1, 77) and not (self.folder / "late").exists():
            self.skipTest(f"no folder can be laid over another here: {done.stderr.strip()[-200:]}")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertTrue(list((self.folder / "late").glob("lib*/libygslam.so.0")))
        self.assertTrue((self.folder / "late" / "bin" / "ygslam").exists())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, help="the configured and built folder")
    known, rest = parser.parse_known_args()
    BUILD = pathlib.Path(known.build).resolve()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
