"""The wheels of `make wheel` where there is no compiler and none of Debian's libraries they were built with.

    python tests/wheel_test.py --wheels dist

In a fresh Debian, each wheel in a new environment of every CPython of this machine that it is for. Needs root,
mmdebstrap and Debian's mirror ($YGSLAM_DEBIAN_MIRROR, or the one this machine uses); skipped without them.
$YGSLAM_CLEAN_ROOT may name a tarball of a Debian with python3-venv.
"""
import argparse
import os
import pathlib
import re
import shutil
import sys
import tempfile
import unittest

from package_test import call, release

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
from pythons import found  # noqa: E402 - the line above first

WHEELS = None
WALK = pathlib.Path(os.environ.get("YGSLAM_SHARED", ROOT.parent / "shared")) / "data" / "redkitchen_walk"


def newest(tag):
    """None without one."""
    return max(WHEELS.glob(f"ygslam-*-{tag}-manylinux*.whl"), key=lambda path: path.stat().st_mtime, default=None)


def ten_lines():
    """The second example of docs/python.md, word for word."""
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.S)[1]


class Wheels(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0 or release() is None or shutil.which("mmdebstrap") is None:
            raise unittest.SkipTest("a clean root needs root, a Debian and mmdebstrap")
        cls.wheels = {python: wheel for python in found() if (wheel := newest(python.wheel_tag))}
        if not cls.wheels:
            raise unittest.SkipTest(f"no manylinux wheel in {WHEELS}: `make wheel` makes them")
        folder = tempfile.TemporaryDirectory(prefix="ygslam-wheel-")
        cls.addClassCleanup(folder.cleanup)
        cls.root = pathlib.Path(folder.name) / "root"
        cls.make_root()
        cls.tags = {}  # of each environment /tmp/venv-VERSION
        for python, wheel in cls.wheels.items():
            cls.install(python, wheel)
        cls.first = f"/tmp/venv-{next(iter(cls.tags))}/bin"
        done = cls.inside(f"{cls.first}/ygslam simulate walking_xyz --out /tmp/seq --size 320x240 --seconds 0.6 --threads 1")
        assert done.returncode == 0, done.stderr

    @classmethod
    def make_root(cls):
        given = os.environ.get("YGSLAM_CLEAN_ROOT")
        if given:
            cls.root.mkdir()
            done = call("tar", "-xf", given, "-C", cls.root)
        else:
            mirror = os.environ.get("YGSLAM_DEBIAN_MIRROR")
            done = call("mmdebstrap", "--variant=apt", "--include=python3-venv", release(), cls.root,
                        *([mirror] if mirror else []))
        if done.returncode != 0 and not given:
            raise unittest.SkipTest(f"no clean root can be made: {done.stderr[-300:]}")
        assert done.returncode == 0, done.stderr
        for place in ("dev", "proc"):
            cls.mount("--rbind", pathlib.Path("/", place), place)
        cls.own = cls.inside("python3 -c 'import sys; print(*sys.version_info[:2], sep=\".\")'").stdout.strip()
        for folder in ("docs", "examples", "tests"):
            shutil.copytree(ROOT / folder, cls.root / "tmp" / "source" / folder, ignore=shutil.ignore_patterns("__pycache__"))

    @classmethod
    def mount(cls, how, folder, place):
        (cls.root / place).mkdir(parents=True, exist_ok=True)
        mounted = call("mount", *how.split(), folder, cls.root / place)
        assert mounted.returncode == 0, mounted.stderr
        cls.addClassCleanup(call, "umount", "-l", cls.root / place)

    @classmethod
    def install(cls, python, wheel):
        """Into a bare environment, from files alone: what the wheel needs is fetched out here."""
        program = "python3"
        if python.name != cls.own:  # as it lies on this machine, with the libraries of the clean root
            program = python.program
            cls.mount("--bind -o ro", python.prefix, str(python.prefix).lstrip("/"))
        done = call(sys.executable, "-m", "pip", "download", "--quiet", "--only-binary=:all:", "--python-version", python.name,
                    "-d", cls.root / "tmp" / "wheels", f"{wheel}[report]")
        assert done.returncode == 0, done.stderr
        venv = f"/tmp/venv-{python.name}"
        done = cls.inside(f"{program} -m venv {venv} && {venv}/bin/pip install --no-index "
                          f"--find-links /tmp/wheels '/tmp/wheels/{wheel.name}[report]'")
        assert done.returncode == 0, done.stdout + done.stderr
        cls.tags[python.name] = python.wheel_tag

    @classmethod
    def inside(cls, script):
        return call("chroot", cls.root, "/bin/bash", "-c", script,
                    env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/tmp", "LC_ALL": "C"})

    def in_each(self, script, says):
        """A script in a folder of its own, in each environment; @p says is what to look for in its output."""
        for version in self.tags:
            with self.subTest(python=version):
                done = self.inside(f"set -e; cd $(mktemp -d); export PATH=/tmp/venv-{version}/bin:$PATH; {script}")
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                self.assertRegex(done.stdout, says)

    def test_1_nothing_is_there_that_they_could_have_been_built_with(self):
        done = self.inside("command -v cc c++ gcc g++ cmake; ls /usr/lib/*-linux-gnu | "
                           "grep -E 'opencv|embree|yaml-cpp|libtbb|spdlog|turbojpeg'")
        self.assertEqual(done.stdout, "")

    def test_2_the_program_runs(self):
        self.in_each("ygslam --version; ygslam run /tmp/seq --out out; "
                     "ygslam eval --gt /tmp/seq/groundtruth.txt --est out/trajectory.txt", r"100\.0 % tracked")

    def test_3_the_ten_lines_of_the_docs_run(self):
        (self.root / "tmp" / "ten_lines.py").write_text(ten_lines(), encoding="utf-8")
        self.in_each("ln -s /tmp/seq office_bag; python /tmp/ten_lines.py; head -1 office.txt",
                     r"\d+ poses, \d+ points of the room without the people")

    def test_4_plots_and_reports_are_made(self):
        self.in_each("ygslam run /tmp/seq --out out; ygslam eval --gt /tmp/seq/groundtruth.txt --est out/trajectory.txt "
                     "--plot plot.svg; ygslam bench /tmp/seq --modes off --runs 1 --out bench; "
                     "grep -c '<svg' plot.svg bench/report/index.html", r"plot\.svg:1\n.*index\.html:[1-9]")

    def test_5_the_notebook_runs(self):
        self.in_each("python /tmp/source/tests/notebook_test.py 2>&1", r"Ran 3 tests in .*\n\nOK\n")

    def test_6_one_module_serves_3_12_and_later(self):
        for version, tag in self.tags.items():
            module, = self.root.glob(f"tmp/venv-{version}/lib/python3*/site-packages/ygslam/_core*.so")
            abi = tag.split("-")[1].replace("cp", "cpython-")
            self.assertRegex(module.name, rf"^_core\.{abi}[.-]")

    def test_7_licences_of_what_they_bring_along_are_in_them(self):
        for version in self.tags:
            venv = f"/tmp/venv-{version}"
            found_texts = self.inside(f"find {venv} -path '*ygslam-*licenses*' -name '*.copyright' -printf '%f\\n'").stdout
            brought = self.inside(f"ls {venv}/lib/python3*/site-packages/ygslam.libs").stdout
            for library, package in (("libembree3", "libembree3-3"), ("libopencv_core", "libopencv-core406"),
                                     ("libsqlite3", "libsqlite3-0")):
                self.assertIn(library, brought)
                self.assertIn(f"{package}.copyright", found_texts)
            self.assertNotIn("libopenvino", brought)
            self.assertNotIn("libtbb", brought)

    @unittest.skipUnless(WALK.exists(), "needs the recordings of ../shared")
    def test_8_a_recording_is_followed_past_its_people(self):
        self.mount("--bind -o ro", WALK, "tmp/walk")
        done = self.inside(f"cd $(mktemp -d); export PATH={self.first}:$PATH; ygslam run /tmp/walk --out out >&2 && "
                           "python -c \"import ygslam; print(ygslam.evaluate('/tmp/walk/groundtruth.txt', "
                           "'out/trajectory.txt')['ate']['rmse'])\"")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess(float(done.stdout), 0.06)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wheels", required=True, help="the folder of `make wheel`")
    known, rest = parser.parse_known_args()
    WHEELS = pathlib.Path(known.wheels).resolve()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
